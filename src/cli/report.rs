//! What a command says: one JSON object on standard output, or lines for a person.

use anyhow::{Context, Result};
use serde::Serialize;

/// Prints `report` as one JSON object on standard output.
pub fn print_json(report: &impl Serialize) -> Result<()> {
    let json = serde_json::to_string(report).context("the report cannot be written as JSON")?;
    print_line(&json);
    Ok(())
}

/// Prints one line on standard output. A reader that has gone away is no failure of ours.
pub fn print_line(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// A byte count for people.
pub fn bytes(n: u64) -> String {
    indicatif::DecimalBytes(n).to_string()
}
