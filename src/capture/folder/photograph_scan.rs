//! A photograph that is decoded once, for all that is asked of it: the codes of some pixels, and statistics of all codes.

use super::CaptureFolder;
use super::files::CaptureFiles;
use super::picture_file::PictureFile;
use crate::capture::camera_pixel_set::CameraPixelSet;
use crate::capture::code_statistics::CodeStatistics;
use crate::capture::error::CaptureError;
use crate::capture::manifest::ListedPhotograph;
use crate::transport::CHANNELS;

/// What a photograph is examined by.
#[derive(Clone, Debug)]
pub struct PhotographScan {
    /// The codes of the pixels that were asked for, row by row.
    pub pixels: Vec<[u16; CHANNELS]>,
    /// Of all rows.
    pub codes: CodeStatistics,
    /// Of all codes: photographs with noise that share it, and their statistics, are one and the same.
    pub checksum: u32,
}

impl<F: CaptureFiles> CaptureFolder<F> {
    /// Decodes a photograph that the manifest names, and keeps the codes of `pixels`.
    ///
    /// # Errors
    /// If it is missing, not a 16-bit photograph of the camera's size, or damaged.
    pub fn scan(
        &self,
        photograph: ListedPhotograph<'_>,
        pixels: &CameraPixelSet,
    ) -> Result<PhotographScan, CaptureError> {
        let camera = &self.manifest.camera;
        let mut reader = self.listed(photograph).open_codes()?;
        let saturated_from = camera.saturated_from();
        let mut scan = PhotographScan {
            pixels: Vec::with_capacity(pixels.count()),
            codes: CodeStatistics::of_photograph(),
            checksum: 0,
        };
        for y in 0..camera.height {
            let Some(codes) = reader.next()? else {
                break;
            };
            scan.codes.add_row(codes, saturated_from);
            scan.checksum = crc32c::crc32c_append(scan.checksum, bytemuck::cast_slice(codes));
            for span in pixels.spans_of(y) {
                let span = span.start as usize..span.end as usize;
                scan.pixels.extend_from_slice(&codes[span]);
            }
        }
        reader.finish(saturated_from)?;
        Ok(scan)
    }

    /// Looks whether a photograph that the manifest names exists and has the right type and size, without decoding it.
    ///
    /// # Errors
    /// If it is missing, or not a 16-bit photograph of the camera's size.
    pub fn check_header(&self, photograph: ListedPhotograph<'_>) -> Result<(), CaptureError> {
        self.listed(photograph).open_codes().map(drop)
    }

    pub(super) fn listed<'a>(&'a self, photograph: ListedPhotograph<'a>) -> PictureFile<'a, F> {
        self.photograph(photograph.name, photograph.role.field())
    }
}
