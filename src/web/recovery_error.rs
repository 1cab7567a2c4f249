//! Errors that reading a capture and recovering from it share.

use std::fmt::Display;

use super::CodedError;
use crate::calibrate::CalibrationError;

pub(super) fn out_of_memory() -> CodedError {
    CodedError::new("recover-memory", "there is no memory for the recovery")
}

impl From<CalibrationError> for CodedError {
    fn from(error: CalibrationError) -> Self {
        let remedy = match error {
            CalibrationError::MissingBits(_) => "photograph them, or give the correspondence",
            CalibrationError::TooFewPixels { .. } => {
                "photograph the Gray code again with more light, or give the correspondence"
            }
        };
        with_remedy("recover-correspondence", &error, remedy)
    }
}

/// `remedy` may be empty.
pub(super) fn with_remedy(code: &'static str, error: &impl Display, remedy: &str) -> CodedError {
    let message = match remedy {
        "" => error.to_string(),
        remedy => format!("{error}; {remedy}"),
    };
    CodedError::new(code, message)
}
