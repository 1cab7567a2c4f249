//! The result of `ltm-export check`.

use anyhow::Result;
use serde::Serialize;

use super::photograph_findings::{Brightness, relative_noise, saturated_share};
use crate::calibrate::GrayCodeQuality;
use crate::capture::{CaptureFolder, NoiseModel, PhotographScan};
use crate::cli::finding::{Finding, Severity};
use crate::cli::recover::calibration::EstimatedField;
use crate::cli::recover::report::PhotographReport;
use crate::cli::report::{format_shots, print_line};
use crate::transport::Decibels;

/// Fields of `check --json`; see docs/capture.md.
#[derive(Default, Serialize)]
pub struct CheckReport {
    pub ready: bool,
    /// The last line of the text.
    pub verdict: String,
    pub errors: usize,
    pub warnings: usize,
    pub notes: usize,
    pub findings: Vec<Finding>,
    pub seconds: f64,
    pub peak_rss_bytes: Option<u64>,
    /// What the photographs say as a whole; null if that cannot be told.
    pub examined: Option<ExaminedCapture>,
    /// One for each shot.
    #[serde(rename = "photograph_table")]
    pub shot_reports: Vec<ShotReport>,
}

/// What the photographs of a capture say as a whole.
#[derive(Serialize)]
pub struct ExaminedCapture {
    /// Of those that can be read, and of their photographs.
    pub patterns: usize,
    pub photographs: usize,
    pub camera: [u32; 2],
    pub light: [u32; 2],
    /// Number of camera pixels from which the capture was examined as a whole.
    pub pixels: usize,
    pub window: Option<u32>,
    /// SNR of the transport as the check recovers it from these pixels, estimated on held-out patterns.
    pub expected_snr_db: Option<Decibels>,
    pub noise: NoiseModel,
    /// Along columns and rows of the light plane; null without Gray code that can be read.
    pub gray_code: Option<[GrayCodeQuality; 2]>,
    pub saturated_samples: usize,
    /// Of these pixels.
    pub hot_pixels: usize,
    pub dead_pixels: usize,
    pub estimated_fields: Vec<EstimatedField>,
}

/// The findings of one shot.
#[derive(Serialize)]
pub struct ShotReport {
    /// Index in `shots`.
    pub shot: usize,
    pub photo: String,
    /// Share of its samples that are saturated; this and the next three are null if it cannot be read.
    pub saturated_share: Option<f64>,
    /// Mean measurement at exposure 1.
    pub mean: Option<f64>,
    /// Share of the range of codes that the brightest samples use.
    pub used_range: Option<f64>,
    /// Exposure, stray light and shift as in `recover --json`; null if they are not known.
    pub gain: Option<f64>,
    pub stray_light: Option<f64>,
    pub shift: Option<[f64; 2]>,
    /// "used", the code of the fault for which `recover` leaves the photograph out, or null.
    pub verdict: Option<&'static str>,
}

impl ShotReport {
    /// A shot of which nothing else is known.
    pub fn new(
        folder: &CaptureFolder,
        shot: usize,
        scan: Option<&PhotographScan>,
        brightness: Option<Brightness>,
    ) -> Self {
        Self {
            shot,
            photo: folder.manifest().shots[shot].photo.clone(),
            saturated_share: scan.map(|scan| saturated_share(folder, scan)),
            mean: brightness.map(|own| own.mean),
            used_range: brightness.map(|own| own.used_range),
            gain: None,
            stray_light: None,
            shift: None,
            verdict: None,
        }
    }

    /// Adds what the preparation of a recovery found.
    pub fn add(&mut self, found: &PhotographReport) {
        self.gain = Some(found.gain);
        self.stray_light = Some(found.stray_light);
        self.shift = found.shift;
        self.verdict = Some(found.verdict);
    }
}

impl CheckReport {
    /// The report of these findings, sorted by severity.
    pub fn new(
        mut findings: Vec<Finding>,
        examined: Option<ExaminedCapture>,
        strict: bool,
    ) -> Self {
        findings.sort_by_key(|finding| finding.severity);
        let count = |severity| {
            findings
                .iter()
                .filter(|own| own.severity == severity)
                .count()
        };
        let [errors, warnings, notes] =
            [Severity::Error, Severity::Warning, Severity::Note].map(count);
        let mut report = Self {
            ready: errors == 0 && (warnings == 0 || !strict),
            errors,
            warnings,
            notes,
            findings,
            examined,
            ..Self::default()
        };
        report.verdict = report.verdict();
        report
    }

    fn verdict(&self) -> String {
        let [errors, warnings] = [(self.errors, "error"), (self.warnings, "warning")].map(plural);
        if self.errors > 0 {
            let advice = match self.examined {
                Some(_) => "",
                None => "; then check again, as photographs were not compared with one another",
            };
            return format!("{errors}, {warnings}: correct the errors before you recover{advice}");
        }
        if !self.ready {
            return format!("{errors}, {warnings}: not ready, as --strict allows no warning");
        }
        let mut text = "ready to recover".to_owned();
        if let Some(examined) = &self.examined {
            let size = |[width, height]: [u32; 2]| format!("{width}x{height}");
            text += &format!(
                ": {}, {} camera pixels, {} light elements",
                format_shots(examined.patterns, examined.photographs),
                size(examined.camera),
                size(examined.light),
            );
            if let Some(window) = examined.window {
                text += &format!(", window {window}");
            }
            if let Some(snr) = examined.expected_snr_db {
                text += &format!(", SNR on held-out patterns at least {snr}");
            }
            let noise = 100.0 * relative_noise(&examined.noise);
            text += &format!(", noise {noise:.1} % at half of white");
        }
        if self.warnings > 0 {
            text += &format!("; {warnings}");
        }
        text
    }

    /// Prints a line for each finding, and the verdict.
    pub fn print(&self) -> Result<()> {
        for Finding {
            severity,
            code,
            message,
            ..
        } in &self.findings
        {
            print_line(&format!("{severity} [{code}]: {message}"))?;
        }
        print_line(&self.verdict)
    }
}

/// For instance "1 error" or "2 errors".
fn plural((count, noun): (usize, &str)) -> String {
    let ending = if count == 1 { "" } else { "s" };
    format!("{count} {noun}{ending}")
}
