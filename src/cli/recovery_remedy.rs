//! Remedies for errors of the recovery, in terms of the capture folder.

use crate::recover::RecoverError;

/// What the user can do about `error`, if the capture is to blame.
pub fn recovery_remedy(error: &RecoverError) -> Option<&'static str> {
    match error {
        RecoverError::TooFewPatterns { .. } => Some("photograph about 80 for a good result"),
        RecoverError::CorrespondenceOffLightPlane => {
            Some("check \"correspondence\" and \"light\" in capture.json")
        }
        RecoverError::NoSignal => Some(
            "check \"camera.black\" in capture.json, the exposure, and that each photograph is listed with its pattern",
        ),
        RecoverError::UncorrelatedPatterns => Some(
            "check that each photograph is listed with its pattern, \"correspondence\" in capture.json, and the exposure",
        ),
        RecoverError::Overexposed => Some(
            "photograph with less exposure, or add shots with less (\"exposure\" in capture.json)",
        ),
        RecoverError::MismatchedPatterns { .. }
        | RecoverError::Geometry(_)
        | RecoverError::Cancelled(_) => None,
    }
}
