//! One photograph as measurements, read row by row.

use super::capture_png::Rgb16RowReader;
use super::disk_files::DiskFiles;
use super::files::CaptureFiles;
use crate::capture::camera_pixel_set::CameraPixelSet;
use crate::capture::code_statistics::CodeStatistics;
use crate::capture::error::CaptureError;
use crate::capture::manifest::ManifestCamera;
use crate::capture::measurements::LinearPhoto;
use crate::capture::noise_model::NoiseModel;

/// The photograph under no light, which is subtracted from all others.
#[derive(Clone, Debug)]
pub struct DarkFrame {
    /// `[N]`, in units of the measurement.
    pub(super) light: LinearPhoto,
    /// The noise floor estimated from it.
    pub(super) noise: NoiseModel,
}

impl DarkFrame {
    /// The noise floor estimated from it; of rounding alone without a dark frame.
    pub fn noise(&self) -> NoiseModel {
        self.noise
    }
}

/// Reads the camera rows of one photograph once, from the top down.
pub struct PhotographRowReader<'a, F: CaptureFiles = DiskFiles> {
    pub(super) camera: &'a ManifestCamera,
    pub(super) dark: &'a DarkFrame,
    pub(super) exposure: f64,
    pub(super) codes: Rgb16RowReader<'a, F>,
    pub(super) next_row: u32,
    pub(super) statistics: CodeStatistics,
}

impl<F: CaptureFiles> PhotographRowReader<'_, F> {
    /// Appends those of `pixels` whose rows were not read before to `photo`, as measurements minus the dark frame, NaN where
    /// saturated. Skips the others.
    ///
    /// # Errors
    /// If the file is damaged or ends early.
    pub fn read(
        &mut self,
        pixels: &CameraPixelSet,
        photo: &mut LinearPhoto,
    ) -> Result<(), CaptureError> {
        let end = pixels.rows().strips().last().map_or(0, |strip| strip.end);
        self.read_to(end, pixels, photo)
    }

    /// Reads the whole photograph, as [`read`](Self::read) does, and the statistics of its codes.
    ///
    /// # Errors
    /// If the file is damaged or ends early.
    pub fn read_all(mut self) -> Result<(LinearPhoto, CodeStatistics), CaptureError> {
        let mut photo = Vec::with_capacity(self.camera.extent().area());
        self.read(&CameraPixelSet::all(self.camera.extent()), &mut photo)?;
        Ok((photo, self.finish()?))
    }

    /// Reads the rest of the file and returns the statistics of the photograph's codes.
    ///
    /// # Errors
    /// If the file is damaged or ends early.
    pub fn finish(mut self) -> Result<CodeStatistics, CaptureError> {
        let none = CameraPixelSet::row_range(0..0, self.camera.width);
        self.read_to(self.camera.height, &none, &mut LinearPhoto::new())?;
        self.codes.finish()?;
        Ok(self.statistics)
    }

    /// Reads up to row `end` and appends those of `pixels`.
    fn read_to(
        &mut self,
        end: u32,
        pixels: &CameraPixelSet,
        photo: &mut LinearPhoto,
    ) -> Result<(), CaptureError> {
        let width = self.camera.width as usize;
        let saturated_from = self.camera.saturated_from();
        while self.next_row < end
            && let Some(codes) = self.codes.next()?
        {
            self.statistics.add_row(codes, saturated_from);
            let dark = &self.dark.light[self.next_row as usize * width..][..width];
            for span in pixels.spans_of(self.next_row) {
                let span = span.start as usize..span.end as usize;
                let (codes, dark) = (&codes[span.clone()], &dark[span]);
                photo.extend(self.camera.measure(codes, self.exposure, dark));
            }
            self.next_row += 1;
        }
        Ok(())
    }
}
