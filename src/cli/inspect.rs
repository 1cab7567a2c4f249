//! `ltm-export inspect`: what is in an `.ltm` file.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use super::{files, report};
use crate::format::{Metadata, TileKind};

/// Show what is in a relightable photograph
#[derive(Debug, Args)]
pub struct InspectArgs {
    /// File to look at
    #[arg(value_name = "FILE.ltm")]
    file: PathBuf,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report {
    camera: [u32; 2],
    light: [u32; 2],
    window: u32,
    correspondence: [[f64; 3]; 2],
    tile_side: u32,
    tiles: usize,
    dark_tiles: usize,
    direct_tiles: usize,
    factored_tiles: usize,
    /// Functions that factored tiles are combined from; none if there are no such tiles.
    rank: Option<u16>,
    header_bytes: u64,
    tile_bytes: u64,
    largest_tile_bytes: u32,
    decoded_bytes: u64,
    file_bytes: u64,
    metadata: Metadata,
}

pub fn run(args: &InspectArgs) -> Result<()> {
    let file = files::read_ltm(&args.file)?;
    let geometry = &file.header.geometry;
    let count = |is: fn(TileKind) -> bool| file.entries.iter().filter(|e| is(e.kind)).count();
    let sizes = || file.entries.iter().map(|e| e.bytes);
    let report = Report {
        camera: [geometry.camera.width, geometry.camera.height],
        light: [geometry.light.width, geometry.light.height],
        window: geometry.window.side(),
        correspondence: geometry.correspondence.affine,
        tile_side: geometry.tile_side,
        tiles: file.entries.len(),
        dark_tiles: count(|kind| kind == TileKind::Dark),
        direct_tiles: count(|kind| kind == TileKind::Direct),
        factored_tiles: count(|kind| matches!(kind, TileKind::Factored { .. })),
        rank: Some(file.header.rank).filter(|&rank| rank > 0),
        header_bytes: file.header.tiles_offset(),
        tile_bytes: sizes().map(u64::from).sum(),
        largest_tile_bytes: sizes().max().unwrap_or(0),
        decoded_bytes: file
            .transport
            .tiles
            .iter()
            .map(|tile| size_of_val(&tile.codes[..]) as u64)
            .sum(),
        file_bytes: file.header.file_bytes,
        metadata: file.metadata,
    };
    if args.json {
        return report::print_json(&report);
    }
    let [a, b] = report.correspondence;
    let shots = report.metadata.shots_used.len();
    for (name, value) in [
        ("camera", geometry.camera.to_string()),
        ("light", geometry.light.to_string()),
        ("window", format!("{0}x{0}", report.window)),
        ("correspondence", format!("u = {a:?}, v = {b:?}")),
        (
            "tiles",
            format!(
                "{} of {1}x{1} pixels: {2} direct, {3} factored, {4} dark",
                report.tiles,
                report.tile_side,
                report.direct_tiles,
                report.factored_tiles,
                report.dark_tiles
            ),
        ),
        (
            "rank",
            report.rank.map_or("-".to_owned(), |rank| rank.to_string()),
        ),
        (
            "recovered",
            format!("{} from {shots} patterns", report.metadata.method),
        ),
        ("written by", report.metadata.writer.clone()),
        ("to open", report::bytes(report.header_bytes)),
        (
            "tile data",
            format!(
                "{}, largest tile {}",
                report::bytes(report.tile_bytes),
                report::bytes(report.largest_tile_bytes.into())
            ),
        ),
        ("decoded", report::bytes(report.decoded_bytes)),
        ("file", report::bytes(report.file_bytes)),
    ] {
        report::print_line(&format!("{name:15} {value}"))?;
    }
    Ok(())
}
