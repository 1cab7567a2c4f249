//! A photograph, read by rows.

use super::images::Rgb16Rows;
use super::{CameraSpec, CaptureError, DarkFrame, Picture, Rows};
use crate::transport::CHANNELS;

/// An opened photograph that yields its camera rows once, from the top down.
pub struct Photo<'a> {
    camera: &'a CameraSpec,
    dark: &'a DarkFrame,
    exposure: f64,
    codes: Rgb16Rows,
    /// The row that comes next.
    row: u32,
    saturated: usize,
}

impl<'a> Photo<'a> {
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
            row: 0,
            saturated: 0,
        }
    }

    /// Appends those of `rows` that have not been passed yet to `picture`, as measurement less the
    /// dark, NaN where saturated; passes all up to the last of them.
    pub fn read(&mut self, rows: &Rows, picture: &mut Picture) -> Result<(), CaptureError> {
        let end = rows.strips().last().map_or(0, |strip| strip.end);
        self.pass(end, |y| rows.contains(y), picture)
    }

    /// Passes what rows are left, and returns how many samples of the photograph are saturated. A
    /// file that is cut short is found out here at the latest.
    pub fn finish(mut self) -> Result<usize, CaptureError> {
        self.pass(self.camera.height, |_| false, &mut Picture::new())?;
        self.codes.finish()?;
        Ok(self.saturated)
    }

    fn pass(
        &mut self,
        end: u32,
        wanted: impl Fn(u32) -> bool,
        picture: &mut Picture,
    ) -> Result<(), CaptureError> {
        let white = self.camera.white;
        let width = self.camera.width as usize;
        while self.row < end
            && let Some(codes) = self.codes.next()?
        {
            let keep = wanted(self.row);
            let dark = &self.dark.light()[self.row as usize * width..][..width];
            for (codes, dark) in codes.zip(dark) {
                let saturated = codes.map(|code| f64::from(code) >= white);
                self.saturated += saturated.into_iter().filter(|s| *s).count();
                if keep {
                    picture.push(std::array::from_fn::<_, CHANNELS, _>(|c| {
                        match saturated[c] {
                            true => f32::NAN,
                            false => self.camera.linear(codes[c], self.exposure) - dark[c],
                        }
                    }));
                }
            }
            self.row += 1;
        }
        Ok(())
    }
}
