//! The result of `ltm-export recover`.

use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use serde::Serialize;

use super::calibration::EstimatedField;
use super::inputs::RecoveryInputs;
use super::ltm_writer::WrittenFile;
use super::prepared_job::PreparedJob;
use super::tile_recovery::TileCounts;
use crate::capture::{Manifest, NoiseModel};
use crate::cli::finding::Finding;
use crate::cli::process_resources::peak_rss_bytes;
use crate::cli::report::{format_bytes, format_shots, print_line};
use crate::export::{MIN_PLAUSIBLE_SNR, Provenance};
use crate::recover::{
    CommonModeWeight, MOVED_CODE, Method, PhotographCorrection, PhotographFault, PreparedRecovery,
    SparsityBasis,
};
use crate::transport::Decibels;

/// SNR on held-out patterns from which on a result is good for any light.
const MIN_GOOD_SNR: Decibels = Decibels(20.0);

/// Fields of `recover --json`; see docs/capture.md.
#[derive(Serialize)]
pub struct RecoverReport {
    pub seconds: f64,
    pub peak_rss_bytes: Option<u64>,
    pub method: Method,
    /// Of bpdn only.
    pub basis: Option<SparsityBasis>,
    pub window: u32,
    /// With `--window auto`: estimated share of light from outside the window.
    pub leak: Option<f64>,
    /// None if every tile is direct.
    pub rank: Option<usize>,
    pub patterns: usize,
    /// More than `patterns` if some were photographed at several exposures.
    pub photographs: usize,
    /// SNR of the recovered transport against the object, estimated on held-out patterns.
    pub expected_snr_db: Option<Decibels>,
    /// SNR of the file relative to the recovered transport.
    pub file_snr_db: Option<Decibels>,
    pub common_mode: Option<CommonModeWeight>,
    pub noise: NoiseModel,
    /// Number of strips in which the photographs were read; 1 if they fit in memory whole.
    pub strips: usize,
    pub saturated_samples: usize,
    /// Pixels saturated in nearly all photographs.
    pub overexposed_pixels: usize,
    /// Number of hot pixels, which are filled from their neighbours.
    pub hot_pixels: usize,
    /// Number of dead pixels, which are filled likewise.
    pub dead_pixels: usize,
    /// Fields of the manifest that the photographs contradict.
    pub estimated_fields: Vec<EstimatedField>,
    pub file_bytes: u64,
    /// Number of levels of the file.
    pub levels: u32,
    /// One for each photograph that was read.
    #[serde(rename = "photograph_table")]
    pub photograph_reports: Vec<PhotographReport>,
    pub warnings: Vec<Finding>,
}

/// The findings of one photograph.
#[derive(Serialize)]
pub struct PhotographReport {
    /// Index in `shots`.
    pub shot: usize,
    pub photo: String,
    /// Exposure relative to the declared one, and to the other photographs.
    pub gain: f64,
    /// Light in the photograph that does not come from the light plane, as a share of white.
    pub stray_light: f64,
    /// Shift of the picture in camera pixels, to the right and down; none where the camera had moved by pixels.
    pub shift: Option<[f64; 2]>,
    /// "used", or the code of the fault for which it is left out.
    pub verdict: &'static str,
}

/// Reports of the photographs of `shots`, and of the `moved` ones that were left out before.
pub fn photograph_reports(
    manifest: &Manifest,
    shots: &[usize],
    recovery: &PreparedRecovery,
    moved: &[usize],
) -> Vec<PhotographReport> {
    let listed = &manifest.shots;
    let left_out = |&shot: &usize| PhotographReport {
        shot,
        photo: listed[shot].photo.clone(),
        gain: 1.0,
        stray_light: 0.0,
        shift: None,
        verdict: MOVED_CODE,
    };
    let report = |(l, &shot): (usize, &usize)| {
        let correction = recovery.corrections().get(l).copied();
        let correction = correction.unwrap_or(PhotographCorrection::IDENTITY);
        let fault = recovery.faults().iter().find(|fault| fault.0 == l);
        let shift = match fault {
            Some((_, PhotographFault::Moved { shift })) => *shift,
            _ => correction.shift,
        };
        PhotographReport {
            shot,
            photo: listed[shot].photo.clone(),
            gain: correction.gain(),
            stray_light: correction.stray_light(),
            shift: Some(shift),
            verdict: fault.map_or("used", |(_, fault)| fault.code()),
        }
    };
    let mut reports: Vec<PhotographReport> = shots.iter().enumerate().map(report).collect();
    reports.extend(moved.iter().map(left_out));
    reports.sort_by_key(|report| report.shot);
    reports
}

impl RecoverReport {
    /// Of a recovery that began at `start`.
    pub fn new(
        start: Instant,
        inputs: &RecoveryInputs<'_>,
        job: &PreparedJob,
        counts: TileCounts,
        written: &WrittenFile,
    ) -> Self {
        let (recovery, findings) = (&job.recovery, &job.findings);
        let method = inputs.options.method();
        Self {
            seconds: start.elapsed().as_secs_f64(),
            peak_rss_bytes: peak_rss_bytes(),
            method,
            basis: method.basis(),
            window: recovery.geometry().window.side(),
            leak: job.leak,
            rank: job.rank(),
            patterns: Provenance::new(&job.manifest, &inputs.shots).patterns,
            photographs: job.shots.len(),
            expected_snr_db: job.expected_snr(),
            file_snr_db: written.snr,
            common_mode: recovery.common_mode(),
            noise: job.noise,
            strips: counts.strips,
            saturated_samples: job.codes.saturated,
            overexposed_pixels: counts.overexposed,
            hot_pixels: counts.defects.hot,
            dead_pixels: counts.defects.dead,
            estimated_fields: findings.estimated_fields.clone(),
            file_bytes: written.bytes,
            levels: inputs.levels,
            photograph_reports: photograph_reports(
                &job.manifest,
                &job.shots,
                recovery,
                &findings.moved_shots,
            ),
            warnings: findings.warnings().cloned().collect(),
        }
    }

    /// `output` is the file that was written, and `manifest` that of the capture.
    pub fn print(&self, output: &Path, manifest: &Manifest) -> Result<()> {
        print_line(&format!(
            "{}: {} camera pixels, {} light elements, window {}, from {} in {:.1} s, {}",
            output.display(),
            manifest.camera.extent(),
            manifest.light.extent(),
            self.window,
            format_shots(self.patterns, self.photographs),
            self.seconds,
            format_bytes(self.file_bytes),
        ))?;
        print_line(&verdict(self.expected_snr_db, self.file_snr_db))
    }
}

/// What the result is worth: `expected` is the SNR of the recovered light transport, estimated on held-out patterns, and `file`
/// that of the file relative to it.
fn verdict(expected: Option<Decibels>, file: Option<Decibels>) -> String {
    let Some(expected) = expected else {
        return "unknown: with fewer than 20 patterns none is held out to test the result with"
            .to_owned();
    };
    let word = match expected {
        snr if snr < MIN_PLAUSIBLE_SNR => "poor",
        snr if snr < MIN_GOOD_SNR => "fair",
        _ => "good",
    };
    let error = |snr: Decibels| 10f64.powf(-snr.0 / 10.0);
    let kept = file.map(|file| -10.0 * (error(expected) + error(file)).log10());
    let loss = kept.map(|kept| match expected.0 - kept {
        loss if loss < 0.05 => "; the file keeps all of it".to_owned(),
        loss => format!("; the file keeps {loss:.1} dB less"),
    });
    format!(
        "{word}: predicts patterns that it has not seen to about {:.1} dB{}",
        expected.0,
        loss.unwrap_or_default()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_says_what_the_file_costs() {
        let said = |expected, file| verdict(Some(Decibels(expected)), Some(Decibels(file)));
        assert_eq!(
            said(33.0, 42.0),
            "good: predicts patterns that it has not seen to about 33.0 dB; the file keeps 0.5 dB less"
        );
        assert!(said(16.0, 60.0).starts_with("fair"));
        assert!(said(16.0, 60.0).ends_with("the file keeps all of it"));
        assert!(said(3.0, 20.0).starts_with("poor"));
        assert!(verdict(None, Some(Decibels(40.0))).starts_with("unknown"));
    }
}
