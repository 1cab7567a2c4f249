//! A section of the study's report: text, tables and pictures, in memory.

use super::error::StudyError;
use crate::transport::Decibels;

/// Receives a line of text when a part of the study advances.
pub type ProgressLog<'a> = &'a (dyn Fn(&str) + Sync);

/// A section of the report.
#[derive(Debug, Default)]
pub struct ReportSection {
    /// Markdown text. Its links are the paths in `files`.
    pub markdown: String,
    /// Path, with forward slashes, and content of every file.
    pub files: Vec<(String, Vec<u8>)>,
}

impl ReportSection {
    /// A section with a heading of the second level.
    pub(super) fn new(heading: &str) -> Self {
        Self {
            markdown: format!("## {heading}\n"),
            files: Vec::new(),
        }
    }

    /// Adds a paragraph, or a table in Markdown.
    pub fn add_paragraph(&mut self, text: &str) {
        self.markdown += &format!("\n{}\n", text.trim_end());
    }

    /// Adds an SVG file and a paragraph that shows it.
    pub(super) fn add_picture(&mut self, name: &str, alt: &str, svg: String) {
        let path = format!("images/{name}.svg");
        self.add_paragraph(&format!("![{alt}]({path})"));
        self.files.push((path, svg.into_bytes()));
    }

    pub(super) fn add_csv(&mut self, name: &str, table: &MarkdownTable) -> Result<(), StudyError> {
        self.files.push((format!("{name}.csv"), table.csv()?));
        Ok(())
    }
}

/// A table of text, written as Markdown or CSV.
#[derive(Clone, Debug)]
pub(super) struct MarkdownTable {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl MarkdownTable {
    /// An empty table with these columns, between ` | `.
    pub fn new(header: &str) -> Self {
        Self {
            header: header.split(" | ").map(str::to_owned).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row, one cell for each column.
    pub fn add_row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// The table as CSV, the header first; fails if a row has more or fewer cells than the header.
    pub fn csv(&self) -> Result<Vec<u8>, StudyError> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for row in std::iter::once(&self.header).chain(&self.rows) {
            writer.write_record(row)?;
        }
        Ok(writer
            .into_inner()
            .map_err(|e| csv::Error::from(e.into_error()))?)
    }

    /// The table as Markdown. Columns of numbers are right-aligned.
    pub fn markdown(&self) -> String {
        let is_numeric = |i: usize| {
            let mut cells = self.rows.iter().map(|row| row.get(i));
            cells.all(|cell| cell.is_some_and(|cell| is_number(cell)))
        };
        let alignment = |i| if is_numeric(i) { "--:" } else { "---" }.to_owned();
        let alignments: Vec<_> = (0..self.header.len()).map(alignment).collect();
        let lines = [&self.header, &alignments].into_iter().chain(&self.rows);
        lines
            .map(|cells| format!("| {} |\n", cells.join(" | ")))
            .collect()
    }
}

/// Whether a cell is a number, a percentage or empty.
fn is_number(cell: &str) -> bool {
    cell.is_empty() || cell.trim_end_matches(" %").parse::<f64>().is_ok()
}

/// An SNR as a cell with two decimals, empty for `None`.
pub(super) fn snr_cell(level: Option<Decibels>) -> String {
    level.map_or(String::new(), |level| format!("{:.2}", level.0))
}

/// A duration in seconds as a cell.
pub(super) fn seconds_cell(seconds: f64) -> String {
    let decimals = usize::from(seconds < 10.0) + usize::from(seconds < 1.0);
    format!("{seconds:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_one_cell_for_each_column() {
        let mut table = MarkdownTable::new("scene | snr_db");
        table.add_row(["a, b".to_owned(), snr_cell(Some(Decibels(25.0)))]);
        assert_eq!(
            String::from_utf8(table.csv().unwrap()).unwrap(),
            "scene,snr_db\n\"a, b\",25.00\n"
        );
        assert_eq!(
            table.markdown(),
            "| scene | snr_db |\n| --- | --: |\n| a, b | 25.00 |\n"
        );
        table.add_row(["one".to_owned()]);
        assert!(table.csv().is_err());
    }
}
