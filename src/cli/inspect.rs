//! `ltm-export inspect`: the file index of an `.ltm` file.

use std::ops::Range;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use serde::Serialize;
use serde_json::value::RawValue;

use super::ltm_file::{LIMITS, open_ltm};
use super::report::{format_bytes, format_shots, print_json, print_line};
use crate::format::{FileIndex, Metadata, ScanCoding};
use crate::pyramid::PyramidReader;
use crate::transport::{Decibels, Extent, TileRect};

/// Show the contents of a relightable photograph; reads its file index only
#[derive(Debug, Args)]
pub struct InspectArgs {
    /// File to inspect
    #[arg(value_name = "FILE.ltm")]
    file: PathBuf,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct DisplacementReport {
    /// Along a row and down a column.
    control_points: [u32; 2],
    /// Largest length, in light elements.
    largest: f64,
}

#[derive(Serialize)]
struct InspectReport {
    camera: [u32; 2],
    light: [u32; 2],
    window: u32,
    correspondence: [[f64; 3]; 2],
    /// If the correspondence bends.
    displacement: Option<DisplacementReport>,
    tile_side: u32,
    tiles: usize,
    /// Tiles without any chunk.
    dark_tiles: usize,
    /// Tiles with direct chunks; they may be factored as well.
    direct_tiles: usize,
    factored_tiles: usize,
    /// Number of basis functions; none without factored tiles.
    rank: Option<u16>,
    /// Bytes before the first scan.
    index_bytes: u64,
    largest_chunk_bytes: u32,
    scans: Vec<ProgressiveScanReport>,
    /// Of a file of several levels, whose other fields but `file_bytes` are those of the last, the root.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    levels: Vec<LevelReport>,
    file_bytes: u64,
    metadata: Box<RawValue>,
}

/// A level of a file of several.
#[derive(Serialize)]
struct LevelReport {
    camera: [u32; 2],
    light: [u32; 2],
    shards: usize,
    bytes: u64,
}

impl LevelReport {
    fn all(pyramid: &PyramidReader) -> Vec<Self> {
        let table = pyramid.table();
        let report = |level: u32| {
            let Extent { width, height } = table.camera(level);
            let extent = Extent { width, height };
            let shards = pyramid.shards_in(level, TileRect { x: 0, y: 0, extent });
            let ranges = shards.filter_map(|shard| pyramid.range(shard));
            let bytes: Vec<u64> = ranges.map(|range| range.end - range.start).collect();
            let light = table.light(level);
            Self {
                camera: [width, height],
                light: [light.width, light.height],
                shards: bytes.len(),
                bytes: bytes.iter().sum(),
            }
        };
        (0..table.levels()).map(report).collect()
    }

    fn print(&self, level: usize) -> Result<()> {
        let [camera, light] = [self.camera, self.light].map(|[w, h]| format!("{w}x{h}"));
        print_line(&format!(
            "{:15} {level:<5} {camera:>13} {light:>13} {:>8} {:>12}",
            "  level",
            self.shards,
            format_bytes(self.bytes),
        ))
    }
}

/// One scan, and the prefix of the file up to its end.
#[derive(Serialize)]
struct ProgressiveScanReport {
    coding: &'static str,
    /// Range of components, or of centre-out slot indices.
    items: Range<u16>,
    step: f32,
    basis_bytes: u32,
    bytes: u64,
    /// Length of the prefix.
    prefix_bytes: u64,
    /// SNR of the prefix relative to the recovered transport.
    prefix_snr_db: Decibels,
}

impl ProgressiveScanReport {
    fn new(index: &FileIndex, scan: usize) -> Self {
        let range = index.scan_range(scan);
        let scan = &index.scans[scan];
        Self {
            coding: match scan.coding {
                ScanCoding::Transform => "transform",
                ScanCoding::Halves => "halves",
                ScanCoding::Direct => "direct",
                ScanCoding::DirectHalves => "direct-halves",
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
        print_line(&format!(
            "{:15} {:13} {start:4} to {end:4} {:>12} {:>12} {:>17}",
            "  scan",
            self.coding,
            format_bytes(self.bytes),
            format_bytes(self.prefix_bytes),
            self.prefix_snr_db.to_string(),
        ))
    }
}

pub fn run(args: &InspectArgs) -> Result<()> {
    let (file, index) = open_ltm(&args.file)?;
    let name = args.file.display();
    let pyramid = PyramidReader::new(index.clone(), LIMITS).with_context(|| name.to_string())?;
    let declared = (pyramid.as_ref()).map_or(index.header.file_bytes, PyramidReader::file_bytes);
    let length = file.metadata().map_or(declared, |file| file.len());
    if length < declared {
        eprintln!(
            "warning: {name}: is cut short after {length} of {declared} bytes; copy or download it again"
        );
    } else if length > declared {
        eprintln!(
            "warning: {name}: goes on after its end at byte {declared}, to {length} bytes; other commands and \
             the element refuse it: copy or export it again"
        );
    }
    let geometry = &index.header.geometry;
    // Whether a tile has factored chunks, and direct chunks.
    let mut has_chunks = vec![[false; 2]; index.tiles()];
    let mut largest_chunk_bytes = 0;
    for chunk in index.chunks() {
        if let Some(tile) = chunk.tile {
            has_chunks[tile][usize::from(index.scans[chunk.scan].coding.is_direct())] = true;
            let range = index.range(chunk);
            largest_chunk_bytes = largest_chunk_bytes.max((range.end - range.start) as u32);
        }
    }
    let count = |is_counted: fn(&&[bool; 2]) -> bool| has_chunks.iter().filter(is_counted).count();
    let report = InspectReport {
        camera: [geometry.camera.width, geometry.camera.height],
        light: [geometry.light.width, geometry.light.height],
        window: geometry.window.side(),
        correspondence: geometry.correspondence.affine,
        displacement: geometry.correspondence.displacement.as_ref().map(|grid| {
            let Extent { width, height } = grid.points();
            DisplacementReport {
                control_points: [width, height],
                largest: grid.largest(),
            }
        }),
        tile_side: geometry.tile_side,
        tiles: index.tiles(),
        dark_tiles: count(|tile| **tile == [false; 2]),
        direct_tiles: count(|tile| tile[1]),
        factored_tiles: count(|tile| tile[0]),
        rank: Some(index.header.rank).filter(|&rank| rank > 0),
        index_bytes: index.header.index_bytes(),
        largest_chunk_bytes,
        scans: (0..index.scans.len())
            .map(|scan| ProgressiveScanReport::new(&index, scan))
            .collect(),
        levels: pyramid.as_ref().map_or(Vec::new(), LevelReport::all),
        file_bytes: declared,
        metadata: RawValue::from_string(index.metadata.text().to_owned())?,
    };
    match args.json {
        true => print_json(&report),
        false => print(&report, &index.metadata.read()?),
    }
}

fn print(report: &InspectReport, metadata: &Metadata) -> Result<()> {
    let line = |name: &str, value: &str| print_line(&format!("{name:15} {value}"));
    let [a, b] = report.correspondence;
    let [camera, light] = [report.camera, report.light].map(|[w, h]| format!("{w}x{h}"));
    let rank = report.rank.map(|rank| rank.to_string());
    let colours = match metadata.color_matrix {
        Some(_) => "the camera's, with a colour matrix to sRGB",
        None => "",
    };
    let displacement = report.displacement.as_ref().map(|displacement| {
        let [columns, rows] = displacement.control_points;
        let largest = displacement.largest;
        format!("at {columns}x{rows} control points, by up to {largest:.1} light elements")
    });
    let tiles = format!(
        "{} of {1}x{1} pixels: {2} direct, {3} factored, {4} dark",
        report.tiles,
        report.tile_side,
        report.direct_tiles,
        report.factored_tiles,
        report.dark_tiles
    );
    let picture = report.levels.first().map(|finest| {
        let ([width, height], levels) = (finest.camera, report.levels.len());
        format!("{width}x{height} in {levels} levels; what follows describes the last")
    });
    for (name, value) in [
        ("picture", picture.unwrap_or_default()),
        ("title", metadata.title.clone()),
        ("creator", metadata.creator.clone()),
        ("rights", metadata.rights.clone()),
        ("camera", camera),
        ("light", light),
        ("window", format!("{0}x{0}", report.window)),
        ("correspondence", format!("u = {a:?}, v = {b:?}")),
        ("displacement", displacement.unwrap_or_default()),
        ("tiles", tiles),
        ("rank", rank.unwrap_or_default()),
        ("colours", colours.to_owned()),
        ("recovered", format_recovery(metadata)),
        ("written by", metadata.writer.clone()),
        ("file index", format_bytes(report.index_bytes)),
    ] {
        if !value.is_empty() {
            line(name, &value)?;
        }
    }
    if !report.scans.is_empty() {
        print_line(&format!(
            "{:15} {:13} {:12} {:>12} {:>12} {:>17}",
            "scans", "", "items", "bytes", "file to here", "SNR to recovered"
        ))?;
    }
    report.scans.iter().try_for_each(|scan| scan.print())?;
    if !report.levels.is_empty() {
        print_line(&format!(
            "{:15} {:5} {:>13} {:>13} {:>8} {:>12}",
            "levels", "", "camera", "light", "shards", "bytes"
        ))?;
    }
    let mut levels = report.levels.iter().enumerate();
    levels.try_for_each(|(i, level)| level.print(i))?;
    line("file", &format_bytes(report.file_bytes))
}

/// For instance "learned from 54 patterns".
fn format_recovery(metadata: &Metadata) -> String {
    let photographs = metadata.shots_used.len();
    let patterns = match metadata.capture.patterns {
        0 => photographs,
        patterns => patterns,
    };
    let shots = format_shots(patterns, photographs);
    format!("{} from {shots}", metadata.method)
}
