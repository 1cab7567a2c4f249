//! A picture of a capture: a pattern or a photograph.

use std::fmt::Display;
use std::io;

use super::files::{CaptureFile, CaptureFiles};
use super::photograph_codes::PhotographCodes;
use super::picture_png;
use crate::capture::error::{CaptureError, CaptureErrorKind};
use crate::capture::measurements::Pattern;
use crate::transport::{CHANNELS, Extent};

/// A picture, and what the manifest says of it.
pub(super) struct PictureFile<'a, F> {
    files: &'a F,
    /// Its name in the manifest.
    name: &'a str,
    /// The size it must have, if a manifest says so.
    extent: Option<Extent>,
    /// The field of the manifest that names it, for messages.
    field: Option<String>,
}

impl<'a, F: CaptureFiles> PictureFile<'a, F> {
    pub fn new(files: &'a F, name: &'a str, extent: Extent, field: Option<String>) -> Self {
        Self {
            files,
            name,
            extent: Some(extent),
            field,
        }
    }

    /// A picture that no manifest lists.
    pub fn unlisted(files: &'a F, name: &'a str) -> Self {
        Self {
            files,
            name,
            extent: None,
            field: None,
        }
    }

    /// Reads an 8-bit pattern and its size; `emission` is that of each code.
    pub fn read_pattern(&self, emission: &[f64; 256]) -> Result<(Extent, Pattern), CaptureError> {
        picture_png::read_pattern(self, emission)
    }

    /// Number of planes of an 8-bit pattern.
    pub fn pattern_planes(&self) -> Result<usize, CaptureError> {
        picture_png::pattern_planes(self)
    }

    /// The size and the codes of a 16-bit photograph.
    pub fn read_codes(self) -> Result<(Extent, Vec<[u16; CHANNELS]>), CaptureError> {
        let mut rows = self.open_codes()?;
        let extent = rows.extent();
        let mut codes = Vec::with_capacity(extent.area());
        while let Some(row) = rows.next()? {
            codes.extend_from_slice(row);
        }
        rows.finish([u32::MAX; CHANNELS])?;
        Ok((extent, codes))
    }

    /// Opens a 16-bit photograph to be read row by row.
    pub fn open_codes(self) -> Result<PhotographCodes<'a, F>, CaptureError> {
        PhotographCodes::open(self)
    }

    /// Opens the file.
    pub fn open(&self) -> Result<CaptureFile<'a, F>, CaptureError> {
        let file = CaptureFile::open(self.files, self.name);
        file.map_err(|e| self.error(CaptureErrorKind::of_opening(e)))
    }

    /// Refuses a picture whose size is not that of the manifest.
    pub fn check_extent(&self, found: Extent) -> Result<(), CaptureError> {
        match self.extent {
            Some(expected) if found != expected => {
                Err(self.error(CaptureErrorKind::WrongExtent { found, expected }))
            }
            _ => Ok(()),
        }
    }

    pub fn io_error(&self, error: io::Error) -> CaptureError {
        self.error(CaptureErrorKind::Io(error))
    }

    /// The file does not have this format, or is damaged.
    pub fn unreadable(&self, format: &'static str, reason: impl Display) -> CaptureError {
        let reason = reason.to_string().trim_end_matches('.').to_owned();
        self.error(CaptureErrorKind::Unreadable(format, reason))
    }

    pub fn error(&self, problem: CaptureErrorKind) -> CaptureError {
        CaptureError {
            path: self.files.path(self.name),
            field: self.field.clone(),
            problem,
        }
    }
}
