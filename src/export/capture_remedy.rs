//! Remedies for errors of capture folders.

use crate::capture::{CaptureError, CaptureErrorKind};

/// What removes the problem of a capture, in terms of its folder; `None` where the error says it.
pub fn capture_remedy(error: &CaptureError) -> Option<&'static str> {
    Some(match &error.problem {
        CaptureErrorKind::Missing if error.field.is_some() => "add it or correct its name",
        CaptureErrorKind::NotACapture(_) => "give the folder that holds capture.json",
        CaptureErrorKind::UnknownVersion(_) => "get a newer program",
        CaptureErrorKind::MissingResponse { .. } => {
            "give the gamma of the monitor or projector, usually about 2.2, or its measured response"
        }
        CaptureErrorKind::ConflictingResponse => "remove one of them",
        CaptureErrorKind::NoShots => "list the patterns and their photographs",
        CaptureErrorKind::MissingGrayCode { .. } => "add it, or give \"correspondence\"",
        CaptureErrorKind::Unreadable(..) => "export or copy it again",
        #[cfg(not(target_arch = "wasm32"))] // pages read no TIFF
        CaptureErrorKind::WrongChecksum(_) => {
            "delete it: \"ltm-export stage ingest CAPTURE -o COPY\" writes it again"
        }
        CaptureErrorKind::WrongExtent { .. } => "correct one of them",
        CaptureErrorKind::PhotoType(_) => "export it again from raw",
        CaptureErrorKind::PatternType(_) => "convert it",
        CaptureErrorKind::Interlaced => "save it without interlacing",
        CaptureErrorKind::Planar => "save it with the channels of a pixel together",
        CaptureErrorKind::LargeStrips(_) => "\"ltm-export stage ingest\" writes it in smaller ones",
        _ => return None,
    })
}
