//! Reads patterns and photographs of several shots in parallel; photographs row by row from the top.

use anyhow::{Context, Error, Result};
use rayon::prelude::*;

use super::progress;
use crate::capture::{
    CameraRowSet, CaptureError, CaptureFolder, CodeStatistics, DarkFrame, DefectivePixels,
    LinearPhoto, Measurements, NoiseModel, PhotographRowReader,
};
use crate::job_executor::Executor;

/// Reads the patterns of `shots` and the correspondence, by `gray_code_rows` of the Gray code if the manifest does not
/// give it. The measurements have no camera rows yet.
pub fn read_patterns(
    folder: &CaptureFolder,
    dark: &DarkFrame,
    shots: &[usize],
    gray_code_rows: &CameraRowSet,
) -> Result<Measurements> {
    let correspondence = match &folder.manifest().correspondence {
        Some(correspondence) => correspondence.clone(),
        None => {
            folder
                .read_gray_code(dark, gray_code_rows)?
                .fit(folder.manifest().camera.extent())
                .with_context(|| folder.manifest_path().display().to_string())?
                .correspondence
        }
    };
    let patterns = shots.par_iter().map(|&i| folder.read_pattern(i));
    let patterns = patterns.collect::<Result<Vec<_>, _>>()?;
    Ok(folder.empty_measurements(shots, patterns, correspondence, dark.noise()))
}

/// Reads `rows` of a photograph, and the rest of the file, which checks that it is whole.
pub fn read_sample_of(
    mut photo: PhotographRowReader<'_>,
    rows: &CameraRowSet,
) -> Result<(LinearPhoto, CodeStatistics)> {
    let mut samples = LinearPhoto::new();
    photo.read(rows, &mut samples)?;
    let codes = photo.finish()?;
    Ok((samples, codes))
}

/// What the rows that were read say beside their samples.
#[derive(Clone, Debug, Default)]
pub struct ReadSample {
    /// Of all rows of the photographs.
    pub codes: CodeStatistics,
    /// The same of each.
    pub codes_by_shot: Vec<CodeStatistics>,
    /// Of all rows of the flood photograph, if there is one.
    pub flood_codes: Option<CodeStatistics>,
    /// Pixels of the loaded rows that are filled from their neighbours.
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
    pub fn open(
        folder: &'a CaptureFolder,
        dark: &'a DarkFrame,
        shots: &[usize],
    ) -> Result<Self, CaptureError> {
        let photos = shots.par_iter().map(|&i| folder.open_shot(i, dark));
        let camera = &folder.manifest().camera;
        Ok(Self {
            photos: photos.collect::<Result<_, _>>()?,
            code: (camera.white - camera.black).recip(),
        })
    }

    /// Makes `rows` the loaded rows of `measurements`: keeps those it has, reads the others, which must lie below all
    /// rows read before. Calls `check` before each photograph, and stops if it fails.
    pub fn load_rows(
        &mut self,
        measurements: &mut Measurements,
        rows: &CameraRowSet,
        check: impl Fn() -> Result<()> + Sync,
    ) -> Result<()> {
        let width = measurements.camera.width as usize;
        let first = rows.strips().first().map_or(0, |strip| strip.start);
        let obsolete = measurements.rows.iter().take_while(|y| *y < first).count();
        let photos = measurements.photos.par_iter_mut();
        let shots = self.photos.par_iter_mut().zip(photos);
        shots.try_for_each(|(reader, photo)| {
            check()?;
            photo.drain(..obsolete * width);
            // Strips have similar heights, so the first reservation is enough for all.
            photo.reserve_exact((rows.count() * width).saturating_sub(photo.len()));
            Ok::<_, Error>(reader.read(rows, photo)?)
        })?;
        measurements.rows = rows.clone();
        Ok(())
    }

    /// Fills the hot and dead pixels of the loaded rows from their neighbours. The photographs have these statistics of
    /// their `codes`.
    pub fn fill_defects(
        &self,
        measurements: &mut Measurements,
        codes: &CodeStatistics,
    ) -> DefectivePixels {
        fill_defects(measurements, f64::from(codes.step()) * self.code)
    }

    /// Loads `rows`, estimates the noise from them, and reads the rest of all files, which checks that they are whole.
    pub fn read_sample(
        mut self,
        measurements: &mut Measurements,
        rows: &CameraRowSet,
        executor: &impl Executor,
    ) -> Result<ReadSample> {
        let bar = progress::bar("reading", self.photos.len());
        self.load_rows(measurements, rows, || {
            bar.inc(1);
            Ok(executor.check_cancelled()?)
        })?;
        drop(bar);
        let codes = self.photos.into_par_iter().map(PhotographRowReader::finish);
        let codes = codes.collect::<Result<Vec<_>, _>>()?;
        Ok(ReadSample::of_rows(measurements, codes, self.code))
    }
}

impl ReadSample {
    /// Fills the defective pixels of the rows that were read into `measurements`, whose noise has only its floor, and
    /// estimates the gain from them. A code of one is the measurement `code`.
    pub fn of_rows(
        measurements: &mut Measurements,
        codes_by_shot: Vec<CodeStatistics>,
        code: f64,
    ) -> Self {
        let codes = codes_by_shot.iter().copied();
        let codes = codes.fold(CodeStatistics::default(), CodeStatistics::merge);
        let quantum = f64::from(codes.step()) * code;
        measurements.noise = measurements.noise.with_quantum(quantum);
        let defects = fill_defects(measurements, quantum);
        measurements.noise = NoiseModel::with_gain_from(measurements);
        Self {
            codes,
            codes_by_shot,
            flood_codes: None,
            defects,
        }
    }
}

/// Fills hot and dead pixels where codes are `quantum` apart.
fn fill_defects(measurements: &mut Measurements, quantum: f64) -> DefectivePixels {
    DefectivePixels {
        hot: measurements.fill_hot_pixels(),
        dead: measurements.fill_dead_pixels(quantum),
    }
}
