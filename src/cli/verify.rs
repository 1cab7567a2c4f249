//! `ltm-export verify`: checks every checksum of an `.ltm` file and decodes every chunk.

use std::ops::Range;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use serde::Serialize;

use super::ltm_file::{open_ltm, read_range};
use super::report::{format_bytes, print_json, print_line};
use crate::format::{self, ChunkId, FormatError};

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
    bad: Option<DamagedChunk>,
    bad_parts: usize,
    /// By the file index, if it can be read.
    #[serde(flatten)]
    contents: Option<FileTotals>,
}

#[derive(Serialize)]
struct FileTotals {
    tiles: usize,
    scans: usize,
    file_bytes: u64,
}

#[derive(Serialize)]
struct DamagedChunk {
    scan: usize,
    /// None for the basis functions of the scan.
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
        let text = format!("{file}: intact, {tiles} tiles in {scans} scans, {bytes}");
        print_line(&text)?;
    }
    result
}

/// Checks chunk by chunk, as a file may be larger than memory.
fn verify(args: &VerifyArgs, report: &mut VerifyReport) -> Result<()> {
    let (mut file, index) = open_ltm(&args.file)?;
    let name = || args.file.display().to_string();
    let end = index.header.file_bytes;
    report.contents = Some(FileTotals {
        tiles: index.tiles(),
        scans: index.scans.len(),
        file_bytes: end,
    });
    let mut first = None;
    for part in index.chunks() {
        let bytes = read_range(&mut file, index.range(part)).with_context(name)?;
        if let Err(error) = format::check(&index, part, &bytes) {
            report.bad_parts += 1;
            first.get_or_insert((part, error));
        }
    }
    if let Some((chunk, error)) = first {
        let bytes = index.range(chunk);
        let (bad, parts) = (report.bad_parts, index.chunks().count());
        let Range { start, end } = bytes;
        let at = format!("{bad} of {parts} parts are bad, the first at bytes {start} to {end}");
        let ChunkId { scan, tile } = chunk;
        report.bad = Some(DamagedChunk { scan, tile, bytes });
        return Err(anyhow::Error::new(error).context(at).context(name()));
    }
    let metadata = file.metadata().context("cannot be read");
    let length = metadata.with_context(name)?.len();
    match length > end {
        true => Err(FormatError::TrailingBytes(end)).with_context(name),
        false => Ok(()),
    }
}
