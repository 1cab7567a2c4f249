//! What a command says: one JSON object on standard output, or lines for a person.

use std::io::{ErrorKind, Write};

use anyhow::{Context, Result};
use serde::Serialize;

/// Prints `report` as one JSON object on standard output.
pub fn print_json(report: &impl Serialize) -> Result<()> {
    let json = serde_json::to_string(report).context("the report cannot be written as JSON")?;
    print_line(&json)
}

/// Prints one line on standard output: what would control a terminal is shown instead, for files say
/// what they like. A reader that has gone away is no failure of ours.
pub fn print_line(line: &str) -> Result<()> {
    let shown = |c: char| match c.is_control() {
        true => c.escape_default().to_string(),
        false => c.to_string(),
    };
    let line: String = line.chars().map(shown).collect();
    let written = writeln!(std::io::stdout(), "{line}");
    match written {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output cannot be written"),
    }
}

/// What a photograph was recovered from, for people.
pub fn shots(patterns: usize, photographs: usize) -> String {
    match patterns == photographs {
        true => format!("{patterns} patterns"),
        false => format!("{photographs} photographs of {patterns} patterns"),
    }
}

/// A byte count for people.
pub fn bytes(n: u64) -> String {
    indicatif::DecimalBytes(n).to_string()
}
