//! Reads patterns and photographs of several shots in parallel; photographs row by row from the top, without rows that can
//! be skipped.

use std::ops::Range;

use anyhow::{Context, Error, Result};
use rayon::prelude::*;

use super::progress;
use crate::capture::{
    CameraPixelSet, CameraRowSet, CaptureError, CaptureFolder, CodeStatistics, DarkFrame,
    DefectivePixels, LinearPhoto, Measurements, NoiseModel, PhotographRowReader,
};
use crate::job_executor::Executor;

/// Reads the patterns of `shots` and the correspondence, by `gray_code_rows` of the Gray code if the manifest does not
/// give it. The measurements have no camera pixels yet, and this `noise`.
pub fn read_patterns(
    folder: &CaptureFolder,
    noise: NoiseModel,
    shots: &[usize],
    gray_code_rows: &CameraRowSet,
) -> Result<Measurements> {
    let correspondence = match &folder.manifest().correspondence {
        Some(correspondence) => correspondence.clone(),
        None => {
            let dark = folder.read_dark_rows(gray_code_rows)?;
            folder
                .read_gray_code(&dark, gray_code_rows)?
                .fit(folder.manifest().camera.extent())
                .with_context(|| folder.manifest_path().display().to_string())?
                .correspondence
        }
    };
    let patterns = shots.par_iter().map(|&i| folder.read_pattern(i));
    let patterns = patterns.collect::<Result<Vec<_>, _>>()?;
    Ok(folder.empty_measurements(shots, patterns, correspondence, noise))
}

/// Reads `pixels` of a photograph, and what [`PhotographRowReader::finish`] says.
pub fn read_sample_of(
    mut photo: PhotographRowReader<'_>,
    dark: &DarkFrame,
    pixels: &CameraPixelSet,
) -> Result<(LinearPhoto, CodeStatistics)> {
    let mut samples = LinearPhoto::new();
    photo.read(pixels, dark, &mut samples)?;
    let codes = photo.finish()?;
    Ok((samples, codes))
}

/// What photographs say beside the samples of the pixels that were loaded.
#[derive(Clone, Debug, Default)]
pub struct ReadSample {
    /// Of all rows of the photographs.
    pub codes: CodeStatistics,
    /// The same of each.
    pub codes_by_shot: Vec<CodeStatistics>,
    /// Of all rows of the flood photograph, if there is one.
    pub flood_codes: Option<CodeStatistics>,
    /// Loaded pixels that are filled from their neighbours.
    pub defects: DefectivePixels,
}

/// The opened photographs of some shots.
pub struct MeasurementReader<'a> {
    photos: Vec<PhotographRowReader<'a>>,
    /// The measurement of one code.
    code: f64,
}

impl<'a> MeasurementReader<'a> {
    /// Opens the photographs of `shots`.
    pub fn open(folder: &'a CaptureFolder, shots: &[usize]) -> Result<Self, CaptureError> {
        let photos = shots.par_iter().map(|&i| folder.open_shot(i));
        let camera = &folder.manifest().camera;
        Ok(Self {
            photos: photos.collect::<Result<_, _>>()?,
            code: (camera.white - camera.black).recip(),
        })
    }

    /// Makes `pixels` the loaded pixels of `measurements`: keeps rows that are already loaded, whose spans
    /// must not differ, and reads the others, which must lie below all rows read before, and where `dark` was read. Calls
    /// `check` before each photograph, and stops if it fails.
    pub fn load(
        &mut self,
        measurements: &mut Measurements,
        dark: &DarkFrame,
        pixels: &CameraPixelSet,
        check: impl Fn() -> Result<()> + Sync,
    ) -> Result<()> {
        let strips = pixels.rows().strips();
        let first = strips.first().map_or(0, |strip| strip.start);
        let obsolete = measurements.loaded.count_above(first);
        let photos = measurements.photos.par_iter_mut();
        let shots = self.photos.par_iter_mut().zip(photos);
        shots.try_for_each(|(reader, photo)| {
            check()?;
            photo.drain(..obsolete);
            // Strips have similar heights, so the first reservation is enough for all.
            photo.reserve_exact(pixels.count().saturating_sub(photo.len()));
            reader.read(pixels, dark, photo)?;
            reader.release();
            Ok::<_, Error>(())
        })?;
        measurements.loaded = pixels.clone();
        Ok(())
    }

    /// Fills hot and dead pixels in the loaded part of `rows`. The photographs have these statistics of their
    /// `codes`.
    pub fn fill_defects(
        &self,
        measurements: &mut Measurements,
        rows: Range<u32>,
        codes: &CodeStatistics,
    ) -> DefectivePixels {
        measurements.fill_defective_pixels(rows, f64::from(codes.step()) * self.code)
    }

    /// Loads `pixels`, estimates the gain of the noise from them, and reads the rest of the files without a record, which checks
    /// that they are whole.
    pub fn read_sample(
        mut self,
        measurements: &mut Measurements,
        dark: &DarkFrame,
        pixels: &CameraPixelSet,
        executor: &impl Executor,
    ) -> Result<ReadSample> {
        let bar = progress::bar("reading", self.photos.len());
        self.load(measurements, dark, pixels, || {
            bar.inc(1);
            Ok(executor.check_cancelled()?)
        })?;
        drop(bar);
        let codes = self.photos.into_par_iter().map(PhotographRowReader::finish);
        let codes = codes.collect::<Result<Vec<_>, _>>()?;
        Ok(ReadSample::new(measurements, codes, self.code))
    }
}

impl ReadSample {
    /// Fills the defective pixels of those that were read into `measurements`, whose noise has only its floor, and
    /// estimates the gain from them. A code of one is the measurement `code`.
    pub fn new(
        measurements: &mut Measurements,
        codes_by_shot: Vec<CodeStatistics>,
        code: f64,
    ) -> Self {
        let codes = codes_by_shot.iter().copied();
        let codes = codes.fold(CodeStatistics::default(), CodeStatistics::merge);
        let quantum = f64::from(codes.step()) * code;
        measurements.noise = measurements.noise.with_quantum(quantum);
        let defects = measurements.fill_defective_pixels(0..u32::MAX, quantum);
        measurements.noise = NoiseModel::with_gain_from(measurements);
        Self {
            codes,
            codes_by_shot,
            flood_codes: None,
            defects,
        }
    }
}
