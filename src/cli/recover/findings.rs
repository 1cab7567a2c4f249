//! Findings about a capture from the preparation of its recovery.

use anyhow::Result;
use serde::{Deserialize, Serialize};

use super::calibration::EstimatedField;
use super::messages::StrictError;
use crate::cli::finding::{Finding, Severity};

/// The findings so far.
#[derive(Default, Serialize, Deserialize)]
pub struct Findings {
    pub list: Vec<Finding>,
    pub estimated_fields: Vec<EstimatedField>,
    /// Shots that are left out as the camera had moved.
    pub moved_shots: Vec<usize>,
    /// Whether findings are printed at once.
    #[serde(skip)]
    is_printed: bool,
}

impl Findings {
    /// Findings that are printed at once.
    pub fn printed() -> Self {
        Self {
            is_printed: true,
            ..Self::default()
        }
    }

    /// Prints further findings at once.
    pub fn print_further(&mut self) {
        self.is_printed = true;
    }

    /// Keeps findings.
    pub fn add(&mut self, findings: impl IntoIterator<Item = Finding>) {
        for finding in findings {
            if self.is_printed {
                eprintln!("{}: {}", finding.severity, finding.message);
            }
            self.list.push(finding);
        }
    }

    /// All but the notes.
    pub fn warnings(&self) -> impl Iterator<Item = &Finding> {
        let list = self.list.iter();
        list.filter(|finding| finding.severity < Severity::Note)
    }

    /// Fails after a warning if `strict` is set.
    pub fn check(&self, strict: bool) -> Result<()> {
        match strict && self.warnings().next().is_some() {
            true => Err(StrictError.into()),
            false => Ok(()),
        }
    }

    /// Whether the photographs contradict no response that they are recovered with.
    pub fn are_responses_right(&self) -> bool {
        self.estimated_fields.iter().all(|field| field.is_used)
    }

    /// Keeps a field that the photographs contradict, with the `finding` that says so.
    pub fn add_estimate(&mut self, field: EstimatedField, finding: Finding) {
        self.add([finding]);
        self.estimated_fields.push(field);
    }
}
