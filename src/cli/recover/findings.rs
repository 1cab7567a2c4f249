//! What a recovery finds doubtful in its capture.

use anyhow::Result;

use super::calibration::EstimatedField;
use super::messages::{StrictError, Warning};

/// What is doubtful in the capture, so far.
#[derive(Default)]
pub struct Findings {
    /// Printed already.
    pub warnings: Vec<Warning>,
    pub estimated_fields: Vec<EstimatedField>,
    /// Shots that are left out as the camera had moved.
    pub moved_shots: Vec<usize>,
}

impl Findings {
    /// Prints and keeps warnings.
    pub fn warn(&mut self, warnings: impl IntoIterator<Item = Warning>) {
        for warning in warnings {
            eprintln!("warning: {}", warning.message);
            self.warnings.push(warning);
        }
    }

    /// Fails after a warning if `strict` is set.
    pub fn check(&self, strict: bool) -> Result<()> {
        match strict && !self.warnings.is_empty() {
            true => Err(StrictError.into()),
            false => Ok(()),
        }
    }

    /// Whether the photographs contradict no response that they are recovered with.
    pub fn are_responses_right(&self) -> bool {
        self.estimated_fields.iter().all(|field| field.is_used)
    }

    /// Warns of a field that the photographs contradict, or notes that the estimate is used.
    pub fn add_estimate(&mut self, field: EstimatedField, warning: Warning) {
        match field.is_used {
            true => eprintln!("note: {}", warning.message),
            false => self.warn([warning]),
        }
        self.estimated_fields.push(field);
    }
}
