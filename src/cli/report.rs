//! Results on standard output: one JSON object, or lines of text.

use std::io::{ErrorKind, Write};

use anyhow::{Context, Result};
use serde::Serialize;

/// Prints `report` as one JSON object.
pub fn print_json(report: &impl Serialize) -> Result<()> {
    let json = serde_json::to_string(report).context("the report cannot be written as JSON")?;
    print_line(&json)
}

/// Prints one line. Control characters, which texts from files may contain, are escaped; a closed pipe is no error.
pub fn print_line(line: &str) -> Result<()> {
    let escape = |c: char| match c.is_control() {
        true => c.escape_default().to_string(),
        false => c.to_string(),
    };
    let line: String = line.chars().map(escape).collect();
    let written = writeln!(std::io::stdout(), "{line}");
    match written {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output cannot be written"),
    }
}

/// For instance "54 patterns", or "108 photographs of 54 patterns".
pub fn format_shots(patterns: usize, photographs: usize) -> String {
    match patterns == photographs {
        true => format!("{patterns} patterns"),
        false => format!("{photographs} photographs of {patterns} patterns"),
    }
}

/// For instance "1.53 MB".
pub fn format_bytes(n: u64) -> String {
    indicatif::DecimalBytes(n).to_string()
}
