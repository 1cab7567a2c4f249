//! Remedies for the library's errors, in terms of the capture folder and the command line.

use std::error::Error;

use anyhow::Error as AnyError;

use crate::calibrate::CalibrationError;
use crate::capture::{CaptureError, CaptureErrorKind};
use crate::recover::RecoverError;

/// The text of `error` and its causes, followed by the remedy if there is one.
pub fn error_with_remedy(error: &AnyError) -> String {
    match error.chain().find_map(remedy) {
        Some(remedy) => format!("{error:#}; {remedy}"),
        None => format!("{error:#}"),
    }
}

fn remedy(error: &(dyn Error + 'static)) -> Option<&'static str> {
    if let Some(CaptureError { field, problem, .. }) = error.downcast_ref() {
        return capture_remedy(field.is_some(), problem);
    }
    Some(match error.downcast_ref() {
        Some(CalibrationError::MissingBits(_)) => "photograph them, or give \"correspondence\"",
        Some(CalibrationError::TooFewPixels { .. }) => {
            "photograph the Gray code again with more light, or give \"correspondence\""
        }
        None => return error.downcast_ref().and_then(recovery_remedy),
    })
}

fn capture_remedy(is_named: bool, problem: &CaptureErrorKind) -> Option<&'static str> {
    Some(match problem {
        CaptureErrorKind::Missing if is_named => "add it or correct its name",
        CaptureErrorKind::NotACapture(_) => "give the folder that holds capture.json",
        CaptureErrorKind::UnknownVersion(_) => "get a newer program",
        CaptureErrorKind::MissingResponse => {
            "give the gamma of the monitor or projector, usually about 2.2, or its measured response"
        }
        CaptureErrorKind::ConflictingResponse => "remove one of them",
        CaptureErrorKind::NoShots => "list the patterns and their photographs",
        CaptureErrorKind::MissingGrayCode { .. } => "add it, or give \"correspondence\"",
        CaptureErrorKind::Unreadable(_) => "export or copy it again",
        CaptureErrorKind::WrongExtent { .. } => "correct one of them",
        CaptureErrorKind::PhotoType(_) => "export it again from raw",
        CaptureErrorKind::PatternType(_) => "convert it",
        CaptureErrorKind::Interlaced => "save it without interlacing",
        _ => return None,
    })
}

fn recovery_remedy(error: &RecoverError) -> Option<&'static str> {
    Some(match error {
        RecoverError::TooFewPatterns(_) => {
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
        RecoverError::IndistinctPhotographs => {
            "check that each of \"shots\" names its own photo, and that the light was on"
        }
        RecoverError::Overexposed => {
            "photograph with less exposure, or add shots with less (\"exposure\" in capture.json)"
        }
        _ => return None,
    })
}
