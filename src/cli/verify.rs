//! `ltm-export verify`: whether every byte of an `.ltm` file is as it was written.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use super::{files, report};

/// Check a relightable photograph: every checksum, every tile
#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// File to check
    #[arg(value_name = "FILE.ltm")]
    file: PathBuf,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report {
    ok: bool,
    /// What is wrong first.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tiles: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    file_bytes: Option<u64>,
}

pub fn run(args: &VerifyArgs) -> Result<()> {
    let result = files::read_ltm(&args.file);
    if args.json {
        report::print_json(&Report {
            ok: result.is_ok(),
            error: result.as_ref().err().map(|e| format!("{e:#}")),
            tiles: result.as_ref().ok().map(|f| f.entries.len()),
            file_bytes: result.as_ref().ok().map(|f| f.header.file_bytes),
        })?;
    }
    let file = result?;
    if !args.json {
        return report::print_line(&format!(
            "{}: sound, {} tiles, {}",
            args.file.display(),
            file.entries.len(),
            report::bytes(file.header.file_bytes)
        ));
    }
    Ok(())
}
