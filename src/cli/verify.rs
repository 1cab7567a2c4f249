//! `ltm-export verify`: checks every checksum of an `.ltm` file and decodes every chunk.

use std::ops::Range;
use std::path::PathBuf;

use anyhow::{Context, Error, Result};
use clap::Args;
use serde::Serialize;

use super::ltm_file::{LIMITS, open_ltm, read_range};
use super::report::{format_bytes, print_json, print_line};
use crate::format::{self, FormatError};
use crate::pyramid::PyramidReader;

/// Check every checksum and every tile of a relightable photograph
#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// File to check
    #[arg(value_name = "FILE.ltm")]
    file: PathBuf,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Default, Serialize)]
struct VerifyReport {
    ok: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    /// The first bad part, and how many there are.
    #[serde(skip_serializing_if = "Option::is_none")]
    bad: Option<DamagedPart>,
    bad_parts: usize,
    /// By the file index, if it can be read.
    #[serde(flatten)]
    contents: Option<FileTotals>,
}

#[derive(Serialize)]
struct FileTotals {
    levels: u32,
    /// Of all levels, with the root.
    shards: usize,
    /// Of the shards that can be read.
    tiles: usize,
    /// Of the root.
    scans: usize,
    file_bytes: u64,
}

#[derive(Serialize)]
struct DamagedPart {
    /// Level and place of the shard; none in the root and in files of one level.
    #[serde(skip_serializing_if = "Option::is_none")]
    level: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    shard: Option<[u32; 2]>,
    /// None for the index of a shard.
    scan: Option<usize>,
    /// None for the basis functions of the scan, and for an index.
    tile: Option<usize>,
    /// Its bytes in the file.
    bytes: Range<u64>,
}

pub fn run(args: &VerifyArgs) -> Result<()> {
    let mut report = VerifyReport::default();
    let result = verify(args, &mut report);
    report.ok = result.is_ok();
    report.error = result.as_ref().err().map(|e| format!("{e:#}"));
    if args.json {
        print_json(&report)?;
    } else if let (true, Some(contents)) = (report.ok, &report.contents) {
        let (tiles, scans) = (contents.tiles, contents.scans);
        let (file, bytes) = (args.file.display(), format_bytes(contents.file_bytes));
        let parts = match (contents.levels, contents.shards) {
            (1, _) => format!("{tiles} tiles in {scans} scans"),
            (levels, shards) => format!("{tiles} tiles in {shards} shards of {levels} levels"),
        };
        let text = format!("{file}: intact, {parts}, {bytes}");
        print_line(&text)?;
    }
    result
}

/// Checks chunk by chunk, as a file may be larger than memory.
fn verify(args: &VerifyArgs, report: &mut VerifyReport) -> Result<()> {
    let name = || args.file.display().to_string();
    let (mut file, root) = open_ltm(&args.file)?;
    let pyramid = PyramidReader::new(root.clone(), LIMITS).with_context(name)?;
    let shards = pyramid.as_ref().map_or(&[][..], |p| p.table().shards());
    let end = (pyramid.as_ref()).map_or(root.header.file_bytes, PyramidReader::file_bytes);
    let mut totals = FileTotals {
        levels: pyramid.as_ref().map_or(1, |p| p.table().levels()),
        shards: shards.len() + 1,
        tiles: 0,
        scans: root.scans.len(),
        file_bytes: end,
    };
    let (mut first, mut parts) = (None, 0);
    for shard in std::iter::once(None).chain(shards.iter().copied().map(Some)) {
        let (index, start) = match (shard, &pyramid) {
            (Some(shard), Some(pyramid)) => {
                let index = pyramid.index(shard, |range| read_range(&mut file, range));
                let range = pyramid.range(shard).unwrap_or_default();
                match index {
                    Ok(index) => (index, range.start),
                    Err(error) => {
                        parts += 1;
                        report.bad_parts += 1;
                        first.get_or_insert((Some(shard), None, range, error));
                        continue;
                    }
                }
            }
            _ => (root.clone(), 0),
        };
        totals.tiles += index.tiles();
        for chunk in index.chunks() {
            let Range {
                start: from,
                end: to,
            } = index.range(chunk);
            let range = start + from..start + to;
            let bytes = read_range(&mut file, range.clone()).with_context(name)?;
            parts += 1;
            if let Err(error) = format::check(&index, chunk, &bytes) {
                report.bad_parts += 1;
                first.get_or_insert((shard, Some(chunk), range, Error::new(error)));
            }
        }
    }
    report.contents = Some(totals);
    if let Some((shard, chunk, bytes, error)) = first {
        let bad = report.bad_parts;
        let Range { start, end } = bytes;
        let of_shard = shard.map_or(String::new(), |shard| format!(", in {shard}"));
        let at = format!(
            "{bad} of {parts} parts are bad, the first at bytes {start} to {end}{of_shard}"
        );
        report.bad = Some(DamagedPart {
            level: shard.map(|shard| shard.level),
            shard: shard.map(|shard| [shard.x, shard.y]),
            scan: chunk.map(|chunk| chunk.scan),
            tile: chunk.and_then(|chunk| chunk.tile),
            bytes,
        });
        return Err(error.context(at).context(name()));
    }
    let metadata = file.metadata().context("cannot be read");
    let length = metadata.with_context(name)?.len();
    match length > end {
        true => Err(FormatError::TrailingBytes(end)).with_context(name),
        false => Ok(()),
    }
}
