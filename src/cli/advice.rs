//! Remedies for the library's errors, in terms of the capture folder and the command line.

use std::error::Error;

use anyhow::Error as AnyError;

use super::field_suggestion::{similar_fields, split_path};
use crate::calibrate::CalibrationError;
use crate::capture::{CaptureError, CaptureErrorKind};
use crate::export::capture_remedy;
use crate::recover::RecoverError;

/// The text of `error` and its causes, followed by the remedy if there is one.
pub fn error_with_remedy(error: &AnyError) -> String {
    match error.chain().find_map(remedy) {
        Some(remedy) => format!("{error:#}; {remedy}"),
        None => format!("{error:#}"),
    }
}

/// What removes the problem of a capture: the right name of a misspelt field, or the library's remedy.
pub fn remedy_of_capture(error: &CaptureError) -> Option<String> {
    misspelt_field(error).or_else(|| capture_remedy(error).map(str::to_owned))
}

/// Names the field that a missing one was probably misspelt as.
fn misspelt_field(error: &CaptureError) -> Option<String> {
    let (fields, unknown) = match &error.problem {
        CaptureErrorKind::MissingField { field, unknown } => (vec![field.as_str()], unknown),
        CaptureErrorKind::MissingResponse { unknown } => {
            (vec!["light.gamma", "light.response"], unknown)
        }
        _ => return None,
    };
    fields.into_iter().find_map(|field| {
        let field = field.replace('[', ".").replace(']', "");
        let (object, name) = split_path(&field);
        let resembles =
            |path: &&String| split_path(path).0 == object && similar_fields(path).contains(&name);
        let misspelt = unknown.iter().find(resembles)?;
        Some(format!("correct the name of \"{misspelt}\" to \"{name}\""))
    })
}

fn remedy(error: &(dyn Error + 'static)) -> Option<String> {
    if let Some(error) = error.downcast_ref() {
        return remedy_of_capture(error);
    }
    let remedy = match error.downcast_ref() {
        Some(CalibrationError::MissingBits(_)) => "photograph them, or give \"correspondence\"",
        Some(CalibrationError::TooFewPixels { .. }) => {
            "photograph the Gray code again with more light, or give \"correspondence\""
        }
        None => error.downcast_ref().and_then(recovery_remedy)?,
    };
    Some(remedy.to_owned())
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
