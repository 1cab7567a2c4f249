//! Reads patterns and photographs of several shots in parallel; photographs row by row from the top.

use anyhow::{Context, Result};
use rayon::prelude::*;

use crate::capture::{
    CaptureError, CaptureFolder, DarkFrame, LinearPhoto, Measurements, PhotoReader, RowSet,
};

/// Reads the patterns of `shots` and the correspondence, by `gray_code_rows` of the Gray code if the manifest does not
/// give it. The measurements have no camera rows yet.
pub fn read_patterns(
    folder: &CaptureFolder,
    dark: &DarkFrame,
    shots: &[usize],
    gray_code_rows: &RowSet,
) -> Result<Measurements> {
    let correspondence = match folder.correspondence() {
        Some(correspondence) => correspondence,
        None => folder
            .read_gray_code(dark, gray_code_rows)?
            .correspondence(folder.manifest().camera.extent())
            .with_context(|| folder.manifest_path().display().to_string())?,
    };
    let patterns = shots.par_iter().map(|&i| folder.read_pattern(i));
    let patterns = patterns.collect::<Result<Vec<_>, _>>()?;
    Ok(folder.empty_measurements(shots, patterns, correspondence, dark))
}

/// The opened photographs of some shots.
pub struct ShotReader<'a> {
    photos: Vec<PhotoReader<'a>>,
}

impl<'a> ShotReader<'a> {
    /// Opens the photographs of `shots`.
    pub fn open(
        folder: &'a CaptureFolder,
        dark: &'a DarkFrame,
        shots: &[usize],
    ) -> Result<Self, CaptureError> {
        let photos = shots.par_iter().map(|&i| folder.open_shot(i, dark));
        Ok(Self {
            photos: photos.collect::<Result<_, _>>()?,
        })
    }

    /// Makes `rows` the loaded rows of `measurements`: keeps those it has, reads the others, which must lie below all
    /// rows read before. Calls `may_continue` before each photograph, and returns false if any call did.
    pub fn load_rows(
        &mut self,
        measurements: &mut Measurements,
        rows: &RowSet,
        may_continue: impl Fn() -> bool + Sync,
    ) -> Result<bool, CaptureError> {
        let width = measurements.camera.width as usize;
        let first = rows.strips().first().map_or(0, |strip| strip.start);
        let obsolete = measurements.rows.iter().take_while(|y| *y < first).count();
        let load = |reader: &mut PhotoReader, photo: &mut LinearPhoto| {
            photo.drain(..obsolete * width);
            // Strips have similar heights, so the first reservation is enough for all.
            photo.reserve_exact((rows.count() * width).saturating_sub(photo.len()));
            reader.read(rows, photo)
        };
        let photos = measurements.photos.par_iter_mut();
        let shots = self.photos.par_iter_mut().zip(photos);
        let loaded = shots.map(|(reader, photo)| match may_continue() {
            true => load(reader, photo).map(|()| true),
            false => Ok(false),
        });
        let loaded = loaded.try_reduce(|| true, |a, b| Ok(a && b))?;
        measurements.rows = rows.clone();
        Ok(loaded)
    }

    /// Reads the rest of all files, which checks that they are whole. Returns the number of saturated samples in the
    /// photographs.
    pub fn finish(self) -> Result<usize, CaptureError> {
        let saturated = self.photos.into_par_iter().map(PhotoReader::finish);
        saturated.try_reduce(|| 0, |a, b| Ok(a + b))
    }
}
