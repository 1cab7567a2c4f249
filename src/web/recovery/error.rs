//! Codes and messages of errors of captures and recoveries.

use std::fmt::Display;

use crate::calibrate::CalibrationError;
use crate::capture::{CaptureError, CaptureErrorKind};
use crate::export::{TooFewShots, TooLittleMemory, capture_remedy};
use crate::recover::RecoverError;
use crate::transport::GeometryError;
use crate::web::CodedError;

/// The error for bytes that the other worker cannot have sent.
pub(super) fn corrupt() -> CodedError {
    CodedError::internal("a recovery was corrupted on its way from its worker")
}

pub(super) fn out_of_memory() -> CodedError {
    CodedError::new("recover-memory", "there is no memory for the recovery")
}

impl From<CaptureError> for CodedError {
    fn from(error: CaptureError) -> Self {
        use CaptureErrorKind as Kind;
        let code = match &error.problem {
            // The manifest itself.
            Kind::Io(_) if error.field.is_none() => "capture-manifest",
            Kind::Missing | Kind::Io(_) | Kind::Unreadable(_) => "capture-file",
            Kind::WrongExtent { .. } => "capture-size",
            Kind::PhotoType(_) | Kind::Interlaced => "capture-photograph",
            Kind::PatternType(_) => "capture-pattern",
            Kind::NotACapture(_)
            | Kind::UnknownVersion(_)
            | Kind::MissingResponse
            | Kind::ConflictingResponse
            | Kind::NoShots
            | Kind::MissingGrayCode { .. }
            | Kind::NotAManifest(_)
            | Kind::FieldType(..)
            | Kind::OutOfRange { .. }
            | Kind::InvalidResponse
            | Kind::NotInvertible
            | Kind::InvalidTruth(_) => "capture-manifest",
        };
        let remedy = match &error.problem {
            Kind::Io(_) if error.field.is_none() => "give the folder that holds capture.json",
            Kind::UnknownVersion(_) => "get a newer version of this page",
            _ => capture_remedy(&error).unwrap_or_default(),
        };
        with_remedy(code, &error, remedy)
    }
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

impl From<RecoverError> for CodedError {
    fn from(error: RecoverError) -> Self {
        let (code, remedy) = match &error {
            RecoverError::TooFewPatterns(_) => (
                "recover-patterns",
                "photograph the object under more patterns, about 80 for a good result",
            ),
            RecoverError::Geometry(_) => ("recover-geometry", ""),
            RecoverError::CorrespondenceOffLightPlane => (
                "recover-correspondence",
                "check it, and the size of the light plane",
            ),
            RecoverError::NoSignal => (
                "recover-no-signal",
                "check the black level, the exposure, and that each photograph shows its pattern",
            ),
            RecoverError::UncorrelatedPatterns => (
                "recover-mismatch",
                "check that each photograph shows its pattern, the correspondence, and the exposure",
            ),
            RecoverError::MismatchedPatterns { .. } => (
                "recover-mismatch",
                "correct these shots or take them out; if there are many, check whether the \
                 correspondence is mirrored",
            ),
            RecoverError::IndistinctPhotographs => (
                "recover-no-signal",
                "check that each photograph shows its own pattern, and that the light was on",
            ),
            RecoverError::Overexposed => (
                "recover-overexposed",
                "photograph with less exposure, or add shots with less",
            ),
            RecoverError::Cancelled(_) => ("worker-unavailable", ""),
        };
        with_remedy(code, &error, remedy)
    }
}

impl From<GeometryError> for CodedError {
    fn from(error: GeometryError) -> Self {
        with_remedy("recover-geometry", &error, "")
    }
}

impl From<TooFewShots> for CodedError {
    fn from(error: TooFewShots) -> Self {
        with_remedy("recover-patterns", &error, "")
    }
}

impl From<TooLittleMemory> for CodedError {
    fn from(TooLittleMemory { limit, min }: TooLittleMemory) -> Self {
        let [limit, min] = [limit >> 20, min.div_ceil(1 << 20)];
        let message = format!(
            "a memory limit of {limit} MiB is too little for this capture; it takes at least {min} MiB"
        );
        Self::new("recover-memory", message)
    }
}

fn with_remedy(code: &'static str, error: &impl Display, remedy: &str) -> CodedError {
    let message = match remedy {
        "" => error.to_string(),
        remedy => format!("{error}; {remedy}"),
    };
    CodedError::new(code, message)
}
