//! What a file may be used for, and what limits it.

use serde::Serialize;

use super::predictions::{HeldOutAccuracy, Predictions};
use crate::cli::check::CheckReport;
use crate::cli::finding::Severity;
use crate::export::MIN_PLAUSIBLE_SNR;
use crate::transport::Decibels;

/// SNR on held-out photographs from which on brightness can be compared.
const MIN_COMPARABLE: Decibels = Decibels(30.0);
/// SNR from which on pictures look right under any light.
const MIN_GOOD: Decibels = Decibels(20.0);
/// SNR of the light transport from which on small lights can be compared as well.
const MIN_COMPARABLE_TRANSPORT: Decibels = Decibels(20.0);
/// By how many dB noise alone would leave a better prediction, if another cause is worth naming.
const MIN_EXCESS: f64 = 3.0;
/// Gain of SNR by fitted exposures from which on exposures are the cause.
const MIN_EXPOSURE_LOSS: f64 = 1.5;
/// By how many dB a photograph is predicted worse than most, if it is itself at fault.
const MIN_OUTLIER: f64 = 6.0;
/// Correlation of errors with edges from which on something has moved.
const MIN_EDGE_CORRELATION: f64 = 0.5;

/// SNR of the file against the recovered transport, less that of the transport, below which compression shows in held-out
/// photographs.
const MIN_FILE_LEAD: f64 = 15.0;
/// The remark on a capture that is not that of the file.
pub const OTHER_INPUTS: &str = "the photographs, the patterns or the manifest are not what they were when the file was recovered: is this \
                                its capture? If not, nothing here is of the file";

/// What the file itself says of its quality.
pub struct FileQuality {
    /// SNR of the light transport on held-out patterns, before it was encoded.
    pub transport_snr: Option<Decibels>,
    /// SNR of the file against the recovered transport.
    pub file_snr: Option<Decibels>,
    /// Whether the capture is unchanged since then.
    pub are_inputs_unchanged: Option<bool>,
}

/// The grades of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grade {
    /// Brightness under different lights can be compared.
    Measurement,
    /// Pictures look right under any light.
    Display,
    /// Pictures look right under broad lights.
    Preview,
    /// Not to be used.
    Unusable,
    /// Nothing was held out to test it with.
    Untested,
}

/// What a file may be used for.
#[derive(Clone, Debug, Serialize)]
pub struct Conclusion {
    pub grade: Grade,
    /// In one sentence.
    pub sentence: String,
    /// Why predictions are worse than noise explains, if they are.
    pub cause: Option<String>,
    /// What the numbers do not show, or what limits the use.
    pub limits: Vec<String>,
}

impl Conclusion {
    /// From the accuracy on held-out photographs, what the file says, and the check of the capture.
    pub fn new(
        accuracy: Option<&HeldOutAccuracy>,
        file: &FileQuality,
        check: &CheckReport,
        predictions: &Predictions,
    ) -> Self {
        let snr = accuracy.and_then(|accuracy| accuracy.fitted_snr_db);
        let (mut grade, mut sentence) = grade(snr, file.transport_snr);
        let mut limits = Vec::new();
        if file.are_inputs_unchanged == Some(false) {
            (grade, sentence) = (Grade::Untested, format!("Untested: {OTHER_INPUTS}."));
        }
        if let Some(snr) = file.transport_snr {
            limits.push(format!(
                "Patterns light half of the elements, and errors of elements cancel. Under a light of a few elements the error is about \
                 {:.0} %: the SNR of the light transport itself is {snr}.",
                percent(snr)
            ));
        }
        if accuracy.is_some() {
            limits.push(
                "Held-out photographs show patterns of the same display: they cannot show light from outside the window, or a blur \
                 of the display itself."
                    .to_owned(),
            );
        }
        if predictions.flood.is_none() {
            limits.push("There is no flood photograph to compare with.".to_owned());
        }
        let warnings = check
            .findings
            .iter()
            .filter(|finding| finding.severity < Severity::Note);
        limits.extend(warnings.map(|finding| finding.message.clone()));
        Self {
            grade,
            sentence,
            cause: accuracy.and_then(|accuracy| cause(accuracy, file)),
            limits,
        }
    }
}

/// The error of this SNR, in per cent.
fn percent(snr: Decibels) -> f64 {
    100.0 * 10f64.powf(-snr.0 / 20.0)
}

fn grade(snr: Option<Decibels>, transport_snr: Option<Decibels>) -> (Grade, String) {
    let Some(snr) = snr else {
        let text = "Untested: the recovery used all photographs, so that none is left to test it with. Recover with fewer patterns.";
        return (Grade::Untested, text.to_owned());
    };
    let predicted = format!(
        "photographs that the recovery did not use are predicted to {snr}, an error of {:.1} % of their brightness",
        percent(snr)
    );
    let is_comparable = transport_snr.is_none_or(|snr| snr >= MIN_COMPARABLE_TRANSPORT);
    match snr {
        snr if snr >= MIN_COMPARABLE && is_comparable => (
            Grade::Measurement,
            format!(
                "Fit for display and for comparing brightness under different lights: {predicted}. Smaller differences mean nothing."
            ),
        ),
        snr if snr >= MIN_GOOD => (
            Grade::Display,
            format!("Fit for display under any light, not for measuring: {predicted}."),
        ),
        snr if snr >= MIN_PLAUSIBLE_SNR => (
            Grade::Preview,
            format!(
                "Fit for a preview under broad lights: {predicted}. Small lights show artefacts."
            ),
        ),
        _ => (Grade::Unusable, format!("Not fit for use: {predicted}.")),
    }
}

/// The cause that fits best, if predictions are worse than noise explains.
fn cause(accuracy: &HeldOutAccuracy, file: &FileQuality) -> Option<String> {
    let fitted = accuracy.fitted_snr_db?.0;
    let plain = accuracy.snr_db?.0;
    let limit = accuracy.noise_limit_db?.0;
    if fitted - plain > MIN_EXPOSURE_LOSS {
        return Some(format!(
            "Exposures differ between photographs: with the exposure of each fitted, the SNR rises from {plain:.1} to {fitted:.1} dB. \
             This does not change the file."
        ));
    }
    if limit - fitted < MIN_EXCESS {
        return None;
    }
    let excess = format!(
        "Noise alone would leave {limit:.1} dB, {:.1} dB more.",
        limit - fitted
    );
    let mut snrs: Vec<f64> = accuracy
        .photographs
        .iter()
        .filter_map(|photo| Some(photo.fitted_snr_db?.0))
        .collect();
    snrs.sort_by(f64::total_cmp);
    let median = *snrs.get(snrs.len() / 2)?;
    let is_outlier = |snr: Option<Decibels>| snr.is_some_and(|snr| snr.0 < median - MIN_OUTLIER);
    let outliers: Vec<&str> = accuracy
        .photographs
        .iter()
        .filter(|photo| is_outlier(photo.fitted_snr_db))
        .map(|photo| photo.photo.as_str())
        .collect();
    if !outliers.is_empty() && 2 * outliers.len() < snrs.len() {
        return Some(format!(
            "{excess} Some photographs are predicted far worse than the others, and may themselves be wrong: {}.",
            outliers.join(", ")
        ));
    }
    if accuracy
        .edge_correlation
        .is_some_and(|found| found > MIN_EDGE_CORRELATION)
    {
        return Some(format!(
            "{excess} The error is largest at edges: camera or object have probably moved between photographs."
        ));
    }
    let lead = file.file_snr.zip(file.transport_snr);
    let lead = lead.map(|(file, transport)| file.0 - transport.0);
    if lead.is_some_and(|lead| lead < MIN_FILE_LEAD) {
        return Some(format!(
            "{excess} The file is compressed, which costs most under many light elements: recover once with --quality 50 to see whether \
             this is the cause. If not, the object scatters light from outside the window, or more patterns are needed."
        ));
    }
    Some(format!(
        "{excess} The error follows no edges and no single photographs: the object scatters light from outside the window, or more \
         patterns are needed."
    ))
}

#[cfg(test)]
mod tests {
    use super::super::predictions::PredictedPhotograph;
    use super::*;
    use crate::transport::SnrAccumulator;

    fn accuracy(fitted: &[f64], plain: f64, limit: f64, edges: f64) -> HeldOutAccuracy {
        let mean = fitted.iter().sum::<f64>() / fitted.len() as f64;
        let photograph = |(shot, snr): (usize, &f64)| PredictedPhotograph {
            shot,
            photo: format!("photos/{shot:04}.png"),
            gain: 1.0,
            stray_light: 0.0,
            snr_db: Some(Decibels(*snr)),
            fitted_snr_db: Some(Decibels(*snr)),
            fitted: SnrAccumulator::default(),
            noise: 0.0,
        };
        HeldOutAccuracy {
            snr_db: Some(Decibels(plain)),
            fitted_snr_db: Some(Decibels(mean)),
            standard_error_db: None,
            noise_limit_db: Some(Decibels(limit)),
            edge_correlation: Some(edges),
            flood_snr_db: None,
            photographs: fitted.iter().enumerate().map(photograph).collect(),
        }
    }

    #[test]
    fn grades_say_what_a_file_is_for() {
        for (snr, expected, part) in [
            (33.0, Grade::Measurement, "an error of 2.2 %"),
            (24.0, Grade::Display, "not for measuring"),
            (15.0, Grade::Preview, "broad lights"),
            (5.0, Grade::Unusable, "Not fit"),
        ] {
            let (grade, sentence) = grade(Some(Decibels(snr)), Some(Decibels(22.0)));
            assert_eq!(grade, expected);
            assert!(sentence.contains(part), "{sentence}");
        }
        assert_eq!(grade(None, None).0, Grade::Untested);
        let small_lights = grade(Some(Decibels(33.0)), Some(Decibels(17.0)));
        assert_eq!(small_lights.0, Grade::Display);
    }

    #[test]
    fn the_cause_that_fits_is_named() {
        let file = |file_snr: f64| FileQuality {
            transport_snr: Some(Decibels(22.0)),
            file_snr: Some(Decibels(file_snr)),
            are_inputs_unchanged: Some(true),
        };
        let good = accuracy(&[30.0; 8], 29.9, 31.0, 0.9);
        assert_eq!(cause(&good, &file(30.0)), None);
        let compressed = cause(&accuracy(&[24.0; 8], 24.0, 31.0, 0.1), &file(30.0));
        assert!(compressed.unwrap().contains("--quality 50"));
        for (accuracy, part) in [
            (accuracy(&[30.0; 8], 22.0, 31.0, 0.1), "Exposures differ"),
            (
                accuracy(&[30.0, 30.0, 30.0, 12.0, 30.0], 26.0, 33.0, 0.1),
                "photos/0003.png",
            ),
            (accuracy(&[24.0; 8], 24.0, 31.0, 0.7), "moved"),
            (accuracy(&[24.0; 8], 24.0, 31.0, 0.1), "outside the window"),
        ] {
            let cause = cause(&accuracy, &file(60.0)).unwrap();
            assert!(cause.contains(part), "{cause}");
        }
    }
}
