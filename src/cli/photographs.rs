//! Photographs read side by side.

use anyhow::Result;
use rayon::prelude::*;

use crate::capture::{CaptureError, CaptureFolder, DarkFrame, Measurements, Photo, Picture, Rows};

/// Photographs of some shots, as they are read from the top down on all cores.
pub struct Photographs<'a> {
    shots: Vec<Photo<'a>>,
}

impl<'a> Photographs<'a> {
    /// Opens the photographs of `shots`.
    pub fn open(
        folder: &'a CaptureFolder,
        dark: &'a DarkFrame,
        shots: &[usize],
    ) -> Result<Self, CaptureError> {
        let open = shots.par_iter().map(|&i| folder.shot(i, dark));
        Ok(Self {
            shots: open.collect::<Result<_, _>>()?,
        })
    }

    /// Makes `measurements` hold `rows`: those it has are kept, the others are read. None of `rows`
    /// that it lacks may lie above what has been read before. `go_on` is asked before each photograph;
    /// false, and a false answer, if it ever says not to.
    pub fn advance(
        &mut self,
        measurements: &mut Measurements,
        rows: &Rows,
        go_on: impl Fn() -> bool + Sync,
    ) -> Result<bool, CaptureError> {
        let width = measurements.camera.width as usize;
        let first = rows.strips().first().map_or(0, |strip| strip.start);
        let gone = measurements.rows.iter().take_while(|y| *y < first).count();
        let advance = |photo: &mut Photo, picture: &mut Picture| {
            picture.drain(..gone * width);
            // Strips are of like height: what the first takes is enough for all.
            picture.reserve_exact((rows.count() * width).saturating_sub(picture.len()));
            photo.read(rows, picture)
        };
        let pictures = measurements.pictures.par_iter_mut();
        let shots = self.shots.par_iter_mut().zip(pictures);
        let read = shots.map(|(photo, picture)| match go_on() {
            true => advance(photo, picture).map(|()| true),
            false => Ok(false),
        });
        let read = read.try_reduce(|| true, |a, b| Ok(a && b))?;
        measurements.rows = rows.clone();
        Ok(read)
    }

    /// Reads what is left of all files, to see that they are whole. Returns the number of saturated
    /// samples in the shots.
    pub fn finish(self) -> Result<usize, CaptureError> {
        let saturated = self.shots.into_par_iter().map(Photo::finish);
        saturated.try_reduce(|| 0, |a, b| Ok(a + b))
    }
}
