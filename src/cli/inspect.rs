//! `ltm-export inspect`: what is in an `.ltm` file.

use std::ops::Range;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use serde::Serialize;

use super::{files, report};
use crate::format::{Coding, Head, Metadata, PartNumber};
use crate::transport::Decibels;

/// Show what is in a relightable photograph; only its head is read
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
    /// By what the scans hold of them. A tile may be both direct and factored.
    dark_tiles: usize,
    direct_tiles: usize,
    factored_tiles: usize,
    /// Functions that factored tiles are combined from; none if there are no such tiles.
    rank: Option<u16>,
    /// Bytes before the first scan.
    head_bytes: u64,
    largest_chunk_bytes: u32,
    scans: Vec<ScanReport>,
    file_bytes: u64,
    metadata: Metadata,
}

/// One scan, and what the file's beginning up to its end gives.
#[derive(Serialize)]
struct ScanReport {
    coding: &'static str,
    /// Components, or slots of the window from the middle outwards.
    places: Range<u16>,
    step: f32,
    basis_bytes: u32,
    bytes: u64,
    /// Bytes of the file up to the scan's end.
    prefix_bytes: u64,
    /// SNR of the file up to the scan's end against what was recovered.
    prefix_snr_db: Decibels,
}

impl ScanReport {
    fn new(head: &Head, scan: usize) -> Self {
        let range = head.scan_range(scan);
        let scan = &head.scans[scan];
        Self {
            coding: match scan.coding {
                Coding::Transform => "transform",
                Coding::Halves => "halves",
                Coding::Direct => "direct",
                Coding::DirectHalves => "direct-halves",
            },
            places: scan.first..scan.end() as u16, // components and slots are below 2^12
            step: scan.step,
            basis_bytes: scan.basis_bytes,
            bytes: range.end - range.start,
            prefix_bytes: range.end,
            prefix_snr_db: scan.snr,
        }
    }

    fn print(&self) -> Result<()> {
        let Range { start, end } = self.places;
        report::print_line(&format!(
            "{:15} {:13} {start:4} to {end:4} {:>12} {:>12} {:>9}",
            "  scan",
            self.coding,
            report::bytes(self.bytes),
            report::bytes(self.prefix_bytes),
            self.prefix_snr_db.to_string(),
        ))
    }
}

pub fn run(args: &InspectArgs) -> Result<()> {
    let (file, reader) = files::open_ltm(&args.file)?;
    let head = reader.head().context("has no head");
    let head = head.with_context(|| args.file.display().to_string())?;
    let length = file
        .metadata()
        .map_or(head.header.file_bytes, |file| file.len());
    if length != head.header.file_bytes {
        eprintln!(
            "warning: {}: has {length} bytes, not {}: cut short, or more than was written; verify says \
             what of it is sound",
            args.file.display(),
            head.header.file_bytes
        );
    }
    let geometry = &head.header.geometry;
    let chunks: Vec<PartNumber> = head.parts().filter(|part| part.tile.is_some()).collect();
    let tiles_with = |direct: bool| {
        let of_kind = chunks
            .iter()
            .filter(|part| head.scans[part.scan].coding.is_direct() == direct);
        let mut tiles: Vec<usize> = of_kind.filter_map(|part| part.tile).collect();
        tiles.sort_unstable();
        tiles.dedup();
        tiles
    };
    let (direct, factored) = (tiles_with(true), tiles_with(false));
    let dark = |tile: &usize| !direct.contains(tile) && !factored.contains(tile);
    let sizes = chunks.iter().map(|part| head.range(*part));
    let report = Report {
        camera: [geometry.camera.width, geometry.camera.height],
        light: [geometry.light.width, geometry.light.height],
        window: geometry.window.side(),
        correspondence: geometry.correspondence.affine,
        tile_side: geometry.tile_side,
        tiles: head.tiles(),
        dark_tiles: (0..head.tiles()).filter(dark).count(),
        direct_tiles: direct.len(),
        factored_tiles: factored.len(),
        rank: Some(head.header.rank).filter(|&rank| rank > 0),
        head_bytes: head.header.head_bytes(),
        largest_chunk_bytes: sizes.map(|r| (r.end - r.start) as u32).max().unwrap_or(0),
        scans: (0..head.scans.len())
            .map(|scan| ScanReport::new(head, scan))
            .collect(),
        file_bytes: head.header.file_bytes,
        metadata: head.metadata.clone(),
    };
    if args.json {
        return report::print_json(&report);
    }
    print(&report)
}

fn print(report: &Report) -> Result<()> {
    let [a, b] = report.correspondence;
    let [camera, light] = [report.camera, report.light].map(|[w, h]| format!("{w}x{h}"));
    let metadata = &report.metadata;
    let CaptureText(capture) = metadata.into();
    for (name, value) in [
        ("title", metadata.title.clone()),
        ("creator", metadata.creator.clone()),
        ("rights", metadata.rights.clone()),
        ("camera", camera),
        ("light", light),
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
            report.rank.map_or(String::new(), |rank| rank.to_string()),
        ),
        ("recovered", capture),
        ("written by", metadata.writer.clone()),
        ("head", report::bytes(report.head_bytes)),
    ] {
        if !value.is_empty() {
            report::print_line(&format!("{name:15} {value}"))?;
        }
    }
    if !report.scans.is_empty() {
        report::print_line(&format!(
            "{:15} {:13} {:12} {:>12} {:>12} {:>9}",
            "scans", "", "places", "bytes", "file to here", "SNR"
        ))?;
    }
    report.scans.iter().try_for_each(ScanReport::print)?;
    report::print_line(&format!(
        "{:15} {}",
        "file",
        report::bytes(report.file_bytes)
    ))
}

/// How the file came to be, in words.
struct CaptureText(String);

impl From<&Metadata> for CaptureText {
    fn from(metadata: &Metadata) -> Self {
        let shots = metadata.shots_used.len();
        let patterns = match metadata.capture.patterns {
            0 => shots,
            patterns => patterns,
        };
        Self(match patterns == shots {
            true => format!("{} from {shots} patterns", metadata.method),
            false => format!(
                "{} from {shots} photographs of {patterns} patterns",
                metadata.method
            ),
        })
    }
}
