//! The photograph under no light.

use std::ops::Range;

use super::disk_files::DiskFiles;
use super::files::CaptureFiles;
use super::photograph_codes::PhotographCodes;
use super::photograph_row_reader::read_rows;
use crate::capture::camera_pixel_set::CameraPixelSet;
use crate::capture::error::CaptureError;
use crate::capture::manifest::ManifestCamera;
use crate::capture::measurements::LinearPhoto;
use crate::capture::noise_model::NoiseModel;
use crate::transport::{CHANNELS, CameraPixel};

/// The photograph under no light in some camera pixels, where it is subtracted from all others.
#[derive(Clone, Debug)]
pub struct DarkFrame {
    pixels: CameraPixelSet,
    /// Number of these pixels above the first row of `light`.
    above: usize,
    /// In units of the measurement.
    light: LinearPhoto,
    /// The measurement of one code, at exposure 1.
    code: f64,
}

impl DarkFrame {
    /// These `pixels` of a dark frame with this `light`, `[N]`, of the measurements of a `camera`.
    ///
    /// # Panics
    /// If there are not as many.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn new(pixels: CameraPixelSet, light: LinearPhoto, camera: &ManifestCamera) -> Self {
        assert_eq!(pixels.count(), light.len());
        Self {
            pixels,
            above: 0,
            light,
            code: code_of(camera),
        }
    }

    /// Its pixels in units of the measurement.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn light(&self) -> &[[f32; CHANNELS]] {
        &self.light
    }

    /// The columns `span` of row `y`.
    ///
    /// # Panics
    /// If these are not among its pixels.
    pub(super) fn span(&self, y: u32, span: &Range<u32>) -> &[[f32; CHANNELS]] {
        let pixel = CameraPixel { x: span.start, y };
        let first = self.pixels.index_of(pixel).unwrap_or(usize::MAX);
        &self.light[first - self.above..][..span.len()]
    }

    /// The noise floor estimated from `pixels`; of rounding alone without a dark frame.
    ///
    /// # Panics
    /// If these are not among its pixels.
    pub fn noise(&self, pixels: &CameraPixelSet) -> NoiseModel {
        let rows = pixels.rows().iter();
        let spans = rows.flat_map(|y| pixels.spans_of(y).map(move |span| (y, span)));
        let spans: Vec<_> = spans.map(|(y, span)| self.span(y, &span)).collect();
        NoiseModel::from_dark_rows(spans.into_iter(), self.code)
    }
}

fn code_of(camera: &ManifestCamera) -> f64 {
    1.0 / (camera.white - camera.black)
}

/// Reads the rows of the dark frame once, from the top down.
pub struct DarkFrameReader<'a, F: CaptureFiles = DiskFiles> {
    pub(super) camera: &'a ManifestCamera,
    /// `None` if the capture has no dark frame: it is black.
    pub(super) codes: Option<PhotographCodes<'a, F>>,
    pub(super) next_row: u32,
}

impl<F: CaptureFiles> DarkFrameReader<'_, F> {
    /// Reads those of `pixels` whose rows were not read before.
    ///
    /// # Errors
    /// If the file is damaged or ends early.
    pub fn read(&mut self, pixels: &CameraPixelSet) -> Result<DarkFrame, CaptureError> {
        let camera = self.camera;
        let above = pixels.count_above(self.next_row);
        let count = pixels.count() - above;
        let mut light = Vec::with_capacity(count);
        if let Some(codes) = &mut self.codes {
            let linear = |codes: &[u16; CHANNELS]| codes.map(|code| camera.linear(code, 1.0));
            let end = pixels.rows().end();
            read_rows(codes, &mut self.next_row, end, pixels, |y, row| {
                for span in pixels.spans_of(y) {
                    let codes = &row[span.start as usize..span.end as usize];
                    light.extend(codes.iter().map(linear));
                }
            })?;
        } else {
            light.resize(count, [0.0; CHANNELS]);
            self.next_row = self.next_row.max(pixels.rows().end());
        }
        Ok(DarkFrame {
            pixels: pixels.clone(),
            above,
            light,
            code: code_of(camera),
        })
    }

    /// Frees the memory of rows that were decoded, until the next are read.
    pub fn release(&mut self) {
        if let Some(codes) = &mut self.codes {
            codes.release();
        }
    }

    /// Checks the rest of the file.
    ///
    /// # Errors
    /// If it is damaged or ends early.
    pub fn finish(mut self) -> Result<(), CaptureError> {
        if let Some(mut codes) = self.codes {
            let none = CameraPixelSet::row_range(0..0, self.camera.width);
            let end = self.camera.height;
            read_rows(&mut codes, &mut self.next_row, end, &none, |_, _| {})?;
            codes.finish([u32::MAX; CHANNELS])?;
        }
        Ok(())
    }
}
