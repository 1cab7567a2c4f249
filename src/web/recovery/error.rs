//! Codes and messages of errors of recoveries.

use crate::recover::RecoverError;
use crate::transport::GeometryError;
use crate::web::CodedError;
use crate::web::recovery_error::with_remedy;

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
