//! One photograph as measurements, read row by row.

use super::dark_frame::DarkFrame;
use super::image_file::Rgb16Rows;
use crate::capture::error::CaptureError;
use crate::capture::manifest::CameraSpec;
use crate::capture::measurements::LinearPhoto;
use crate::capture::rows::RowSet;
use crate::transport::CHANNELS;

/// Reads the camera rows of one photograph once, from the top down.
pub struct PhotoReader<'a> {
    camera: &'a CameraSpec,
    dark: &'a DarkFrame,
    exposure: f64,
    codes: Rgb16Rows,
    next_row: u32,
    saturated_samples: usize,
}

impl<'a> PhotoReader<'a> {
    pub(super) fn new(
        camera: &'a CameraSpec,
        dark: &'a DarkFrame,
        exposure: f64,
        codes: Rgb16Rows,
    ) -> Self {
        Self {
            camera,
            dark,
            exposure,
            codes,
            next_row: 0,
            saturated_samples: 0,
        }
    }

    /// Appends those of `rows` that were not read before to `photo`, as measurements minus the dark frame, NaN where
    /// saturated. Skips the rows between them.
    ///
    /// # Errors
    /// If the file is damaged or ends early.
    pub fn read(&mut self, rows: &RowSet, photo: &mut LinearPhoto) -> Result<(), CaptureError> {
        let end = rows.strips().last().map_or(0, |strip| strip.end);
        self.read_to(end, |y| rows.contains(y), photo)
    }

    /// Reads the rest of the file and returns the number of saturated samples in the photograph.
    ///
    /// # Errors
    /// If the file is damaged or ends early.
    pub fn finish(mut self) -> Result<usize, CaptureError> {
        self.read_to(self.camera.height, |_| false, &mut LinearPhoto::new())?;
        self.codes.finish()?;
        Ok(self.saturated_samples)
    }

    /// Reads up to row `end` and appends the rows that `is_selected` selects.
    fn read_to(
        &mut self,
        end: u32,
        is_selected: impl Fn(u32) -> bool,
        photo: &mut LinearPhoto,
    ) -> Result<(), CaptureError> {
        let white = self.camera.white;
        let width = self.camera.width as usize;
        while self.next_row < end
            && let Some(codes) = self.codes.next()?
        {
            let selected = is_selected(self.next_row);
            let dark = &self.dark.light[self.next_row as usize * width..][..width];
            for (codes, dark) in codes.zip(dark) {
                let saturated = codes.map(|code| f64::from(code) >= white);
                self.saturated_samples += saturated.into_iter().filter(|s| *s).count();
                if selected {
                    photo.push(std::array::from_fn::<_, CHANNELS, _>(|c| {
                        match saturated[c] {
                            true => f32::NAN,
                            false => self.camera.linear(codes[c], self.exposure) - dark[c],
                        }
                    }));
                }
            }
            self.next_row += 1;
        }
        Ok(())
    }
}
