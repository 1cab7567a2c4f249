//! `ltm-export evaluate`: the accuracy of an `.ltm` file, against the known transport of a simulated capture and
//! against photographs that the recovery did not use.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use clap::Args;
use serde::Serialize;

use super::finest_level::FinestLevel;
use super::ltm_file::PrefixLength;
use super::report::{format_bytes, print_json, print_line};
use crate::capture::{CameraPixelSet, CaptureFolder, DarkFrame, GroundTruth, PhotographRowReader};
use crate::relight::{BuiltinLight, Light};
use crate::study::{CaptureTruth, psnr};
use crate::transport::{CHANNELS, Decibels, Geometry, SnrAccumulator, transport_error};

/// Compare a file with the known transport, the relit pictures and the unused photographs of a capture
#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// File to evaluate
    #[arg(value_name = "FILE.ltm")]
    file: PathBuf,
    /// Capture folder that it was recovered from
    capture: PathBuf,
    /// Use only the first part of the file, as a page does while it loads: 20K, 10%
    #[arg(long, value_name = "BYTES|PERCENT", value_parser = PrefixLength::parse)]
    first: Option<PrefixLength>,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Default, Serialize)]
pub struct EvaluateReport {
    /// SNR of the whole matrix against the known transport; null without one.
    pub snr_db: Option<Decibels>,
    /// PSNR of relit pictures against the true ones, peak 1 in units of the measurement.
    relit: BTreeMap<String, Option<Decibels>>,
    /// SNR of predicted pictures against photographs that the recovery did not use.
    heldout_snr_db: Option<Decibels>,
    /// The same by camera channel.
    heldout_rgb_snr_db: [Option<Decibels>; CHANNELS],
    heldout_shots: usize,
    /// SNR of predicted pictures against these photographs, each with an exposure and stray light of its own.
    heldout_fitted_snr_db: Option<Decibels>,
    /// One for each of these photographs.
    heldout_table: Vec<HeldOutPhotograph>,
    /// SNR of the predicted picture against the flood photograph, which the recovery does not use; null without one.
    flood_snr_db: Option<Decibels>,
    file_bytes: u64,
    read_bytes: u64,
    /// Scans that are complete in the bytes read.
    read_scans: usize,
    scans: usize,
}

/// A photograph that the recovery did not use.
#[derive(Serialize)]
struct HeldOutPhotograph {
    /// Index in `shots`.
    shot: usize,
    photo: String,
    /// Exposure relative to the prediction.
    gain: f64,
    /// Light that the prediction lacks everywhere, as a share of white.
    stray_light: f64,
    snr_db: Option<Decibels>,
    fitted_snr_db: Option<Decibels>,
}

/// SNR on held-out photographs below which they are not of the file's object.
const MIN_SAME_OBJECT_SNR: Decibels = Decibels(3.0);

pub fn run(args: &EvaluateArgs) -> Result<()> {
    let report = evaluate(args)?;
    match args.json {
        true => print_json(&report),
        false => report.print(),
    }
}

/// Compares the file of `args` with its capture.
pub fn evaluate(args: &EvaluateArgs) -> Result<EvaluateReport> {
    let mut file = FinestLevel::open(&args.file, args.first)?;
    let folder = CaptureFolder::open(&args.capture)?;
    ensure_same_geometry(&file.geometry, &args.file, &folder)?;
    let mut report = EvaluateReport {
        file_bytes: file.file_bytes,
        read_bytes: file.read_bytes,
        read_scans: file.read_scans,
        scans: file.scans,
        ..EvaluateReport::default()
    };
    if let Some(truth) = folder.truth()? {
        report.compare_with_truth(&mut file, truth)?;
    }
    let used = file.metadata.read()?.shots_used;
    report.compare_with_photographs(&mut file, &folder, &used)?;
    Ok(report)
}

/// Refuses a file at `path` whose camera or light plane is not that of the capture.
pub fn ensure_same_geometry(
    geometry: &Geometry,
    path: &Path,
    folder: &CaptureFolder,
) -> Result<()> {
    let manifest = folder.manifest();
    for (name, found, expected) in [
        ("camera", geometry.camera, manifest.camera.extent()),
        ("light", geometry.light, manifest.light.extent()),
    ] {
        ensure!(
            found == expected,
            "{} has {name} {found}, but {} has {expected}: it was not recovered from this capture",
            path.display(),
            folder.root().display(),
        );
    }
    Ok(())
}

impl EvaluateReport {
    fn compare_with_truth(&mut self, file: &mut FinestLevel, truth: GroundTruth) -> Result<()> {
        let geometry = file.geometry.clone();
        for name in truth.lights()? {
            let light = Light::from_linear_rgb(geometry.light, &truth.light(&name)?.rgb())?;
            let picture = file.picture(&light)?.into_iter();
            let relit: Vec<_> = picture.map(|pixel| pixel.map(f64::from)).collect();
            let psnr = psnr(&truth.relit(&name)?, &relit);
            self.relit.insert(name, psnr);
        }
        let known = CaptureTruth::new(truth, geometry.correspondence.clone())?;
        let error = |functions: &_| transport_error(&known, &geometry, functions);
        self.snr_db = file.sum_over_tiles(error)?.snr();
        Ok(())
    }

    /// Compares predicted pictures with the flood photograph and with those of the shots not in `used`.
    fn compare_with_photographs(
        &mut self,
        file: &mut FinestLevel,
        folder: &CaptureFolder,
        used: &[usize],
    ) -> Result<()> {
        let plane = file.geometry.light;
        let dark = folder.read_dark(&CameraPixelSet::all(file.geometry.camera))?;
        let mut errors = [SnrAccumulator::default(); CHANNELS];
        let mut fitted_errors = SnrAccumulator::default();
        for i in (0..folder.manifest().shots.len()).filter(|i| !used.contains(i)) {
            let light = Light::from_linear_rgb(plane, &folder.read_pattern(i)?.rgb())?;
            let mut of_photo = [SnrAccumulator::default(); CHANNELS];
            let photo = folder.open_shot(i)?;
            let moments = add_error(&mut of_photo, file, &light, photo, &dark)?;
            let (gain, stray_light) = moments.fit_line();
            let fitted = moments.error_of_line(gain, stray_light);
            self.heldout_table.push(HeldOutPhotograph {
                shot: i,
                photo: folder.manifest().shots[i].photo.clone(),
                gain,
                stray_light,
                snr_db: of_photo.into_iter().sum::<SnrAccumulator>().snr(),
                fitted_snr_db: fitted.snr(),
            });
            for (sum, error) in errors.iter_mut().zip(of_photo) {
                sum.merge(error);
            }
            fitted_errors.merge(fitted);
        }
        self.heldout_shots = self.heldout_table.len();
        self.heldout_rgb_snr_db = errors.map(|e| e.snr());
        self.heldout_snr_db = errors.into_iter().sum::<SnrAccumulator>().snr();
        self.heldout_fitted_snr_db = fitted_errors.snr();
        if self
            .heldout_fitted_snr_db
            .is_some_and(|snr| snr < MIN_SAME_OBJECT_SNR)
        {
            eprintln!(
                "warning: the file hardly predicts these photographs: is it of another object, or has the camera \
                 moved since?"
            );
        }
        if let Some(photo) = folder.open_flood()? {
            let light = BuiltinLight::Flood.render(plane);
            let mut errors = [SnrAccumulator::default(); CHANNELS];
            add_error(&mut errors, file, &light, photo, &dark)?;
            self.flood_snr_db = errors.into_iter().sum::<SnrAccumulator>().snr();
        }
        Ok(())
    }

    fn print(&self) -> Result<()> {
        let line = |name: &str, value: &str| print_line(&format!("{name:28} {value}"));
        let decibels = |name: &str, value: Option<Decibels>| {
            line(name, &value.map_or("-".to_owned(), |db| db.to_string()))
        };
        if self.snr_db.is_some() {
            decibels("SNR of the transport", self.snr_db)?;
        }
        let heldout = format!("SNR on {} held-out shots", self.heldout_shots);
        decibels(&heldout, self.heldout_snr_db)?;
        decibels("  with exposures fitted", self.heldout_fitted_snr_db)?;
        decibels("SNR on the flood photograph", self.flood_snr_db)?;
        for (name, psnr) in &self.relit {
            decibels(&format!("PSNR relit under {name}"), *psnr)?;
        }
        let [read, all] = [self.read_bytes, self.file_bytes].map(format_bytes);
        let (complete, scans) = (self.read_scans, self.scans);
        let part = format!("the first {read} of {all}: {complete} of {scans} scans complete");
        let is_part = self.read_bytes < self.file_bytes;
        line("File", if is_part { &part } else { &all })
    }
}

/// Sums over samples.
#[derive(Default)]
pub struct SampleMoments {
    count: f64,
    predicted: f64,
    measured: f64,
    predicted_energy: f64,
    measured_energy: f64,
    product: f64,
}

impl SampleMoments {
    pub fn add(&mut self, predicted: f64, measured: f64) {
        self.count += 1.0;
        self.predicted += predicted;
        self.measured += measured;
        self.predicted_energy += predicted * predicted;
        self.measured_energy += measured * measured;
        self.product += predicted * measured;
    }

    /// Gain and offset of the line from predicted to measured samples, by least squares.
    pub fn fit_line(&self) -> (f64, f64) {
        let covariance = self.product - self.predicted * self.measured / self.count;
        let gain = covariance / (self.predicted_energy - self.predicted.powi(2) / self.count);
        match gain.is_finite() {
            true => (gain, (self.measured - gain * self.predicted) / self.count),
            false => (1.0, 0.0),
        }
    }

    /// Correlation of predicted and measured samples; `None` if either is constant.
    pub fn correlation(&self) -> Option<f64> {
        let covariance = self.product - self.predicted * self.measured / self.count;
        let variances = (self.predicted_energy - self.predicted.powi(2) / self.count)
            * (self.measured_energy - self.measured.powi(2) / self.count);
        let correlation = covariance / variances.sqrt();
        correlation.is_finite().then_some(correlation)
    }

    /// Error of a line from predicted to measured samples.
    pub fn error_of_line(&self, gain: f64, offset: f64) -> SnrAccumulator {
        let line = gain * gain * self.predicted_energy
            + 2.0 * gain * offset * self.predicted
            + offset * offset * self.count;
        let product = gain * self.product + offset * self.measured;
        let error = (self.measured_energy - 2.0 * product + line).max(0.0);
        SnrAccumulator::from_energies(self.measured_energy, error)
    }
}

/// Adds the error of the picture predicted under `light`, without saturated samples. Returns the moments of predicted and
/// measured samples.
fn add_error(
    errors: &mut [SnrAccumulator; CHANNELS],
    file: &mut FinestLevel,
    light: &Light,
    mut reader: PhotographRowReader,
    dark: &DarkFrame,
) -> Result<SampleMoments> {
    let mut moments = SampleMoments::default();
    let mut photo = Vec::new();
    let width = file.geometry.camera.width;
    file.relight(light, |rows, picture| {
        photo.clear();
        reader.read(&CameraPixelSet::row_range(rows, width), dark, &mut photo)?;
        for (predicted, measured) in picture.iter().zip(&photo) {
            for c in 0..CHANNELS {
                if measured[c].is_finite() {
                    let sample = [f64::from(predicted[c]), f64::from(measured[c])];
                    errors[c].add(sample[1], sample[0]);
                    moments.add(sample[0], sample[1]);
                }
            }
        }
        Ok(())
    })?;
    reader.finish()?;
    Ok(moments)
}
