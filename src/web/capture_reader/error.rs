//! Codes and messages of errors of captures.

use crate::capture::{CaptureError, CaptureErrorKind};
use crate::export::{TooFewShots, capture_remedy};
use crate::web::CodedError;
use crate::web::recovery_error::with_remedy;

impl From<CaptureError> for CodedError {
    fn from(error: CaptureError) -> Self {
        use CaptureErrorKind as Kind;
        let code = match &error.problem {
            // The manifest itself.
            Kind::Io(_) if error.field.is_none() => "capture-manifest",
            Kind::Missing | Kind::Io(_) | Kind::Unreadable(..) | Kind::WrongChecksum(_) => {
                "capture-file"
            }
            Kind::WrongExtent { .. } => "capture-size",
            Kind::PhotoType(_) | Kind::Interlaced | Kind::Planar | Kind::LargeStrips(_) => {
                "capture-photograph"
            }
            Kind::PatternType(_) => "capture-pattern",
            Kind::NotACapture(_)
            | Kind::UnknownVersion(_)
            | Kind::MissingResponse { .. }
            | Kind::ConflictingResponse
            | Kind::NoShots
            | Kind::MissingGrayCode { .. }
            | Kind::NotAManifest(_)
            | Kind::FieldType(..)
            | Kind::MissingField { .. }
            | Kind::OutOfRange { .. }
            | Kind::InvalidResponse
            | Kind::NotInvertible
            | Kind::DisplacementOfOtherPicture
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

impl From<TooFewShots> for CodedError {
    fn from(error: TooFewShots) -> Self {
        with_remedy("recover-patterns", &error, "")
    }
}
