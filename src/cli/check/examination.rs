//! What the photographs of a capture say together: the preparation of a recovery, as far as `recover` would come.

use anyhow::Result;

use super::photograph_findings;
use super::report::ExaminedCapture;
use super::scanned_capture::ScannedCapture;
use crate::capture::{CaptureFolder, group_count, group_ids};
use crate::cli::advice::error_with_remedy;
use crate::cli::finding::{Finding, Severity};
use crate::cli::recover::capture_sample::CaptureSample;
use crate::cli::recover::findings::Findings;
use crate::cli::recover::preparation::{
    Attempt, CapturePreparation, MIN_USABLE_SNR, PreparationSettings,
};
use crate::cli::recover::report::{PhotographReport, photograph_reports};
use crate::cli::recover::{TrustedCalibration, messages};
use crate::export::PreparedExport;
use crate::recover::{Method, RecoverError};
use crate::transport::Window;

/// Prepares a recovery from the scanned photographs.
pub struct Examination<'a> {
    pub folder: &'a CaptureFolder,
    /// `None` to estimate it.
    pub window: Option<Window>,
    pub scanned: &'a ScannedCapture<'a>,
}

impl<'a> Examination<'a> {
    /// Examines the photographs of `shots`, which were read, and adds the findings. Returns what the photographs say as a
    /// whole, and what was found of each.
    ///
    /// # Errors
    /// If the command is interrupted.
    pub fn run(
        &self,
        shots: Vec<usize>,
        findings: &mut Findings,
    ) -> Result<(ExaminedCapture, Vec<PhotographReport>)> {
        let sample = self.scanned.sample(self.folder.clone(), shots)?;
        let preparation = CapturePreparation {
            settings: PreparationSettings {
                // Least squares take the least time and memory.
                method: Method::Nnls,
                fallback: Some(Method::Learned),
                window: self.window,
                trust: TrustedCalibration::Declared,
                is_registered: true,
            },
            folder: self.folder,
            source: self.scanned,
        };
        let Attempt {
            sample,
            prepared,
            cause,
            ..
        } = preparation.examine(sample, findings)?;
        let prepared = self.conclude(&preparation, &sample, prepared, cause, findings);
        self.add_pixels_and_noise(&sample, findings);
        let patterns = &self.folder.manifest().shots;
        let patterns = sample.shots.iter().map(|&i| &patterns[i].pattern);
        let patterns = group_count(&group_ids(patterns));
        let window = prepared
            .as_ref()
            .map(|prepared| prepared.recovery.geometry().window);
        let window = window.or(self.window);
        findings.add(window.and_then(|window| photograph_findings::few_patterns(patterns, window)));
        let reports = prepared.as_ref().map(|prepared| {
            let moved = &findings.moved_shots;
            photograph_reports(
                sample.folder.manifest(),
                &sample.shots,
                &prepared.recovery,
                moved,
            )
        });
        let (camera, light) = (sample.measurements.camera, sample.measurements.light);
        let examined = ExaminedCapture {
            patterns,
            photographs: sample.shots.len(),
            camera: [camera.width, camera.height],
            light: [light.width, light.height],
            pixels: self.scanned.shot_pixels().count(),
            window: window.map(Window::side),
            expected_snr_db: prepared.as_ref().and_then(PreparedExport::expected_snr),
            noise: sample.measurements.noise,
            gray_code: None,
            saturated_samples: sample.read.codes.saturated,
            hot_pixels: sample.read.defects.hot,
            dead_pixels: sample.read.defects.dead,
            estimated_fields: findings.estimated_fields.clone(),
        };
        Ok((examined, reports.unwrap_or_default()))
    }

    /// Adds whether `recover` would refuse the capture, and why.
    fn conclude(
        &self,
        preparation: &CapturePreparation<'_, &ScannedCapture<'_>>,
        sample: &CaptureSample,
        prepared: Result<PreparedExport, RecoverError>,
        cause: Option<Finding>,
        findings: &mut Findings,
    ) -> Option<PreparedExport> {
        let snr = prepared
            .as_ref()
            .ok()
            .and_then(PreparedExport::expected_snr);
        let is_refused = prepared.is_err() || snr.is_some_and(|snr| snr < MIN_USABLE_SNR);
        let as_refusal = |finding: Finding| match is_refused {
            true => Finding {
                severity: Severity::Error,
                ..finding
            },
            false => finding,
        };
        match (prepared, cause) {
            (prepared, Some(cause)) => {
                findings.add([as_refusal(cause)]);
                prepared.ok()
            }
            (Ok(prepared), None) => {
                let of_preparation = messages::preparation(&prepared).into_iter();
                findings.add(of_preparation.map(|finding| match &*finding.code {
                    "low-snr" => as_refusal(finding),
                    _ => finding,
                }));
                Some(prepared)
            }
            (Err(error), None) => {
                let code = code(&error);
                let shots = match &error {
                    RecoverError::MismatchedPatterns { pattern_indices } => {
                        pattern_indices.iter().map(|&l| sample.shots[l]).collect()
                    }
                    _ => Vec::new(),
                };
                let error = preparation.recover_error(error, &sample.shots);
                findings.add([Finding::error(code, error_with_remedy(&error)).of_shots(shots)]);
                None
            }
        }
    }

    fn add_pixels_and_noise(&self, sample: &CaptureSample, findings: &mut Findings) {
        let (pixels, area) = (
            self.scanned.shot_pixels().count(),
            sample.measurements.camera.area(),
        );
        let notes = messages::defective_pixels(sample.read.defects).into_iter();
        findings.add(notes.map(|note| match pixels == area {
            true => note,
            false => Finding {
                message: format!(
                    "{}, in the {pixels} of {area} camera pixels that were examined",
                    note.message
                ),
                ..note
            },
        }));
        findings.add(photograph_findings::noisy(&sample.measurements.noise));
    }
}

/// The code of a recovery's error, as of a finding.
fn code(error: &RecoverError) -> &'static str {
    match error {
        RecoverError::TooFewPatterns(_) => "too-few-patterns",
        RecoverError::Geometry(_) => "geometry",
        RecoverError::CorrespondenceOffLightPlane => "correspondence-off-light-plane",
        RecoverError::NoSignal => "no-light",
        RecoverError::UncorrelatedPatterns => "patterns-uncorrelated",
        RecoverError::MismatchedPatterns { .. } => "patterns-mismatched",
        RecoverError::IndistinctPhotographs => "photographs-indistinct",
        RecoverError::Overexposed => "overexposed",
        RecoverError::Cancelled(_) => "interrupted",
    }
}
