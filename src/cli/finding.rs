//! Errors, warnings and notes about a capture.

use std::borrow::Cow;
use std::fmt;

use serde::{Deserialize, Serialize};

/// What a finding means for the recovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The capture cannot be recovered, or not rightly.
    Error,
    /// The result may be worse than it could be.
    Warning,
    /// Worth knowing: it does no harm, or is corrected.
    Note,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        })
    }
}

/// One finding, in JSON as in text.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Finding {
    pub severity: Severity,
    /// Names the kind of finding.
    pub code: Cow<'static, str>,
    /// Indices in the manifest's `shots`; none if it is not about some of them.
    pub shots: Vec<usize>,
    /// The problem, and its remedy.
    pub message: String,
}

impl Finding {
    pub fn error(code: &'static str, message: impl Into<String>) -> Self {
        Self::new(Severity::Error, code, message.into())
    }

    pub fn warning(code: &'static str, message: impl Into<String>) -> Self {
        Self::new(Severity::Warning, code, message.into())
    }

    pub fn note(code: &'static str, message: impl Into<String>) -> Self {
        Self::new(Severity::Note, code, message.into())
    }

    fn new(severity: Severity, code: &'static str, message: String) -> Self {
        Self {
            severity,
            code: Cow::Borrowed(code),
            shots: Vec::new(),
            message,
        }
    }

    /// The same about these shots.
    #[must_use]
    pub fn of_shots(self, shots: impl IntoIterator<Item = usize>) -> Self {
        let shots = shots.into_iter().collect();
        Self { shots, ..self }
    }
}
