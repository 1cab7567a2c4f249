//! One photograph as measurements, read row by row.

use super::dark_frame::DarkFrame;
use super::disk_files::DiskFiles;
use super::files::CaptureFiles;
use super::photograph_codes::PhotographCodes;
use crate::capture::camera_pixel_set::CameraPixelSet;
use crate::capture::code_statistics::CodeStatistics;
use crate::capture::error::CaptureError;
use crate::capture::manifest::ManifestCamera;
use crate::capture::measurements::LinearPhoto;
use crate::transport::CHANNELS;

/// Reads the camera rows of one photograph once, from the top down.
pub struct PhotographRowReader<'a, F: CaptureFiles = DiskFiles> {
    pub(super) camera: &'a ManifestCamera,
    pub(super) exposure: f64,
    pub(super) codes: PhotographCodes<'a, F>,
    pub(super) next_row: u32,
    /// Of the rows that were read, unless the file has a record of all.
    pub(super) statistics: CodeStatistics,
}

impl<F: CaptureFiles> PhotographRowReader<'_, F> {
    /// Appends those of `pixels` whose rows were not read before to `photo`, as measurements minus the `dark` frame, which was
    /// read there; NaN where saturated. Skips the others.
    ///
    /// # Errors
    /// If the file is damaged or ends early.
    ///
    /// # Panics
    /// If the dark frame lacks one of the pixels.
    pub fn read(
        &mut self,
        pixels: &CameraPixelSet,
        dark: &DarkFrame,
        photo: &mut LinearPhoto,
    ) -> Result<(), CaptureError> {
        let (camera, exposure) = (self.camera, self.exposure);
        self.read_to(pixels.rows().end(), pixels, |y, row| {
            for span in pixels.spans_of(y) {
                let codes = &row[span.start as usize..span.end as usize];
                photo.extend(camera.measure(codes, exposure, dark.span(y, &span)));
            }
        })
    }

    /// Reads the whole photograph, as [`read`](Self::read) does, and the statistics of its codes.
    ///
    /// # Errors
    /// If the file is damaged or ends early.
    ///
    /// # Panics
    /// If the dark frame is not whole.
    pub fn read_all(
        mut self,
        dark: &DarkFrame,
    ) -> Result<(LinearPhoto, CodeStatistics), CaptureError> {
        let mut photo = Vec::with_capacity(self.camera.extent().area());
        self.read(&CameraPixelSet::all(self.camera.extent()), dark, &mut photo)?;
        Ok((photo, self.finish()?))
    }

    /// Frees the memory of rows that were decoded, until the next are read.
    pub fn release(&mut self) {
        self.codes.release();
    }

    /// Returns the statistics of the photograph's codes: by the record of an ingested photograph, otherwise from the rest of the
    /// rows, which it reads.
    ///
    /// # Errors
    /// If the file is damaged or ends early.
    pub fn finish(mut self) -> Result<CodeStatistics, CaptureError> {
        let none = CameraPixelSet::row_range(0..0, self.camera.width);
        self.read_to(self.camera.height, &none, |_, _| {})?;
        let recorded = self.codes.finish(self.camera.saturated_from())?;
        Ok(recorded.unwrap_or(self.statistics))
    }

    /// Reads up to row `end`, and calls `add` with the rows that are read.
    fn read_to(
        &mut self,
        end: u32,
        pixels: &CameraPixelSet,
        mut add: impl FnMut(u32, &[[u16; CHANNELS]]),
    ) -> Result<(), CaptureError> {
        let saturated_from = self.camera.saturated_from();
        let (statistics, is_recorded) = (&mut self.statistics, self.codes.is_recorded());
        read_rows(
            &mut self.codes,
            &mut self.next_row,
            end,
            pixels,
            |y, row| {
                if !is_recorded {
                    statistics.add_row(row, saturated_from);
                }
                add(y, row);
            },
        )
    }
}

/// Reads the rows from `next_row` to `end`, and calls `add` with the number and the codes of each. Of a photograph with a record,
/// only `pixels` are read, and their rows.
pub(super) fn read_rows<F: CaptureFiles>(
    codes: &mut PhotographCodes<'_, F>,
    next_row: &mut u32,
    end: u32,
    pixels: &CameraPixelSet,
    mut add: impl FnMut(u32, &[[u16; CHANNELS]]),
) -> Result<(), CaptureError> {
    let is_recorded = codes.is_recorded();
    while *next_row < end {
        let row = if is_recorded {
            *next_row = pixels.rows().first_from(*next_row).unwrap_or(end);
            if *next_row >= end {
                break;
            }
            codes.skip_to(*next_row);
            codes.next_columns(pixels.spans_of(*next_row))?
        } else {
            codes.next()?
        };
        let Some(row) = row else {
            break;
        };
        add(*next_row, row);
        *next_row += 1;
    }
    Ok(())
}
