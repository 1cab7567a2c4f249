//! Remedies for the library's errors, in terms of the capture folder and the command line.

use std::error::Error;

use anyhow::Error as AnyError;

use crate::calibrate::CalibrationError;
use crate::capture::{CaptureError, FieldProblem, ImageProblem};
use crate::recover::RecoverError;

/// The text of `error` and its causes, followed by the remedy if there is one.
pub fn error_with_remedy(error: &AnyError) -> String {
    match error.chain().find_map(remedy) {
        Some(remedy) => format!("{error:#}; {remedy}"),
        None => format!("{error:#}"),
    }
}

fn remedy(error: &(dyn Error + 'static)) -> Option<&'static str> {
    let capture = error.downcast_ref().and_then(capture_remedy);
    let calibration = || error.downcast_ref().map(calibration_remedy);
    let recovery = || error.downcast_ref().and_then(recovery_remedy);
    capture.or_else(calibration).or_else(recovery)
}

fn capture_remedy(error: &CaptureError) -> Option<&'static str> {
    Some(match error {
        CaptureError::Missing { field: Some(_), .. } => "add it or correct its name",
        CaptureError::NotACapture { .. } => "give the folder that holds capture.json",
        CaptureError::UnknownVersion { .. } => "get a newer program",
        CaptureError::Field { problem, .. } => match problem {
            FieldProblem::Missing { .. } => {
                "give the gamma of the monitor or projector, usually about 2.2, or its measured response"
            }
            FieldProblem::Conflict { .. } => "remove one of them",
            FieldProblem::Empty => "list the patterns and their photographs",
            FieldProblem::MissingGrayCode { .. } => "add it, or give \"correspondence\"",
            _ => return None,
        },
        CaptureError::Image { problem, .. } => match problem {
            ImageProblem::Unreadable(_) => "export or copy it again",
            ImageProblem::WrongExtent { .. } => "correct one of them",
            ImageProblem::PhotoType(_) => "export it again from raw",
            ImageProblem::PatternType(_) => "convert it",
            ImageProblem::Interlaced => "save it without interlacing",
        },
        _ => return None,
    })
}

fn calibration_remedy(error: &CalibrationError) -> &'static str {
    match error {
        CalibrationError::MissingBits(_) => "photograph them, or give \"correspondence\"",
        CalibrationError::TooFewPixels { .. } => {
            "photograph the Gray code again with more light, or give \"correspondence\""
        }
    }
}

fn recovery_remedy(error: &RecoverError) -> Option<&'static str> {
    Some(match error {
        RecoverError::TooFewPatterns { .. } => {
            "photograph the object under more patterns, about 80 for a good result"
        }
        RecoverError::CorrespondenceOffLightPlane => {
            "check \"correspondence\" and \"light\" in capture.json"
        }
        RecoverError::NoSignal => {
            "check \"camera.black\", the exposure, and that each photograph is listed with the pattern it \
             shows"
        }
        RecoverError::UncorrelatedPatterns => {
            "check that each is listed with the pattern it shows, check \"correspondence\" in \
             capture.json, and the exposure"
        }
        RecoverError::Overexposed => {
            "photograph with less exposure, or add shots with less (\"exposure\" in capture.json)"
        }
        _ => return None,
    })
}
