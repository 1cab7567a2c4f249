//! `ltm-export inspect`: what is in an `.ltm` file.

use std::cmp::Ordering;
use std::ops::Range;
use std::path::PathBuf;

use anyhow::Result;
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
    items: Range<u16>,
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
            items: scan.first..scan.end() as u16, // components and slots are below 2^12
            step: scan.step,
            basis_bytes: scan.basis_bytes,
            bytes: range.end - range.start,
            prefix_bytes: range.end,
            prefix_snr_db: scan.snr,
        }
    }

    fn print(&self) -> Result<()> {
        let Range { start, end } = self.items;
        report::print_line(&format!(
            "{:15} {:13} {start:4} to {end:4} {:>12} {:>12} {:>17}",
            "  scan",
            self.coding,
            report::bytes(self.bytes),
            report::bytes(self.prefix_bytes),
            self.prefix_snr_db.to_string(),
        ))
    }
}

pub fn run(args: &InspectArgs) -> Result<()> {
    let (file, head) = files::open_ltm(&args.file)?;
    let declared = head.header.file_bytes;
    let length = file.metadata().map_or(declared, |file| file.len());
    let name = args.file.display();
    match length.cmp(&declared) {
        Ordering::Less => eprintln!(
            "warning: {name}: is cut short, at {length} of {declared} bytes; copy or download it again"
        ),
        Ordering::Equal => {}
        Ordering::Greater => eprintln!(
            "warning: {name}: has {length} bytes, and the photograph ends after {declared}; the rest \
             is not of it"
        ),
    }
    let geometry = &head.header.geometry;
    let chunks: Vec<PartNumber> = head.parts().filter(|part| part.tile.is_some()).collect();
    // Whether scans hold anything of a tile: as coefficients, as functions.
    let mut held = vec![[false; 2]; head.tiles()];
    for part in &chunks {
        if let Some(tile) = part.tile {
            held[tile][usize::from(head.scans[part.scan].coding.is_direct())] = true;
        }
    }
    let tiles_of = |of: fn(&[bool; 2]) -> bool| held.iter().filter(|tile| of(tile)).count();
    let sizes = chunks.iter().map(|part| head.range(*part));
    let report = Report {
        camera: [geometry.camera.width, geometry.camera.height],
        light: [geometry.light.width, geometry.light.height],
        window: geometry.window.side(),
        correspondence: geometry.correspondence.affine,
        tile_side: geometry.tile_side,
        tiles: head.tiles(),
        dark_tiles: tiles_of(|tile| *tile == [false; 2]),
        direct_tiles: tiles_of(|tile| tile[1]),
        factored_tiles: tiles_of(|tile| tile[0]),
        rank: Some(head.header.rank).filter(|&rank| rank > 0),
        head_bytes: head.header.head_bytes(),
        largest_chunk_bytes: sizes.map(|r| (r.end - r.start) as u32).max().unwrap_or(0),
        scans: (0..head.scans.len())
            .map(|scan| ScanReport::new(&head, scan))
            .collect(),
        file_bytes: head.header.file_bytes,
        metadata: head.metadata.read()?,
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
        ("recovered", recovered(metadata)),
        ("written by", metadata.writer.clone()),
        ("head", report::bytes(report.head_bytes)),
    ] {
        if !value.is_empty() {
            report::print_line(&format!("{name:15} {value}"))?;
        }
    }
    if !report.scans.is_empty() {
        report::print_line(&format!(
            "{:15} {:13} {:12} {:>12} {:>12} {:>17}",
            "scans", "", "items", "bytes", "file to here", "SNR to recovered"
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
fn recovered(metadata: &Metadata) -> String {
    let photographs = metadata.shots_used.len();
    let patterns = match metadata.capture.patterns {
        0 => photographs,
        patterns => patterns,
    };
    let shots = report::shots(patterns, photographs);
    format!("{} from {shots}", metadata.method)
}
