//! A table of all methods on scenes that no parameter was chosen on, and the default method's shortfall.

use super::accuracy::measure_accuracy;
use super::error::StudyError;
use super::method_sample_sizes::{self, DEFAULT_METHOD};
use super::section::{MarkdownTable, ProgressLog, ReportSection, snr_cell};
use crate::job_executor::Executor;
use crate::recover::Method;
use crate::simulate::{PatternEnsemble, SceneKind, SimulatedCapture};
use crate::transport::Extent;

use PatternEnsemble::{Bernoulli, Gaussian};
use SceneKind::{Cookies, StainedGlass};

/// A row of the table: scene, sides of camera and light plane, ensemble, number of patterns, electrons, seed.
type SceneSettings = (SceneKind, [u32; 2], PatternEnsemble, usize, f64, u64);

/// Both scenes, both ensembles, few and many photographs, little and much light, one to three camera pixels for each
/// light element, and a seed for each.
const SETTINGS: [SceneSettings; 14] = [
    (StainedGlass, [128, 64], Gaussian, 80, 4e4, 101),
    (StainedGlass, [128, 64], Bernoulli, 80, 4e4, 102),
    (StainedGlass, [128, 64], Bernoulli, 40, 2e5, 103),
    (StainedGlass, [128, 64], Gaussian, 120, 1e4, 104),
    (StainedGlass, [96, 96], Bernoulli, 60, 1e5, 105),
    (StainedGlass, [144, 48], Bernoulli, 20, 4e4, 106),
    (StainedGlass, [144, 48], Gaussian, 60, 1e5, 107),
    (Cookies, [128, 64], Bernoulli, 80, 4e4, 108),
    (Cookies, [128, 64], Gaussian, 80, 4e4, 109),
    (Cookies, [128, 64], Bernoulli, 40, 2e5, 110),
    (Cookies, [128, 64], Gaussian, 120, 1e4, 111),
    (Cookies, [96, 96], Bernoulli, 60, 1e5, 112),
    (Cookies, [144, 48], Bernoulli, 20, 4e4, 113),
    (Cookies, [144, 48], Gaussian, 60, 1e5, 114),
];

/// Largest accepted shortfall of the default method against the best other one.
const MAX_SHORTFALL_DB: f64 = 0.3;

/// The table of scenes, with samples of about `pixels` pixels for each method.
///
/// # Errors
/// Those of photographing and recovering a scene.
pub fn scenes_table(
    pixels: usize,
    executor: &impl Executor,
    progress: ProgressLog,
) -> Result<ReportSection, StudyError> {
    let mut table = MarkdownTable::new(&format!(
        "scene | camera | light | ensemble | patterns | electrons | seed | {} | default | shortfall",
        method_sample_sizes::names()
    ));
    let mut worst = f64::NEG_INFINITY;
    for (kind, sides, ensemble, patterns, electrons, seed) in SETTINGS {
        let [camera, light] = sides.map(|side| Extent::new(side, side));
        let scene = kind.build(camera, light)?;
        let simulated_capture = SimulatedCapture {
            scene: scene.as_ref(),
            electrons,
            seed,
        };
        let measurements = simulated_capture.measure(ensemble, patterns, executor);
        let mut snrs = Vec::new();
        for &method in Method::ALL {
            let accuracy =
                measure_accuracy(&simulated_capture, &measurements, method, pixels, executor)?;
            snrs.push(accuracy.snr);
        }
        let scene_name = match kind {
            StainedGlass => "stained-glass",
            Cookies => "cookies",
        };
        let ensemble_name = match ensemble {
            Gaussian => "gaussian",
            Bernoulli => "bernoulli",
        };
        let mut row = vec![
            scene_name.to_owned(),
            camera.to_string(),
            light.to_string(),
            ensemble_name.to_owned(),
            patterns.to_string(),
            electrons.to_string(),
            seed.to_string(),
        ];
        row.extend(snrs.iter().map(|&snr| snr_cell(snr)));
        progress(&format!("scenes: {}", row.join(", ")));
        let best_snr = |is_default: bool| {
            let snrs = Method::ALL.iter().zip(&snrs);
            let chosen = snrs.filter(|(method, _)| (**method == DEFAULT_METHOD) == is_default);
            let snrs = chosen.filter_map(|(_, snr)| Some((*snr)?.0));
            snrs.reduce(f64::max)
        };
        let best_snrs = best_snr(false).zip(best_snr(true));
        let shortfall = best_snrs.map(|(other, default)| other - default);
        worst = worst.max(shortfall.unwrap_or(worst));
        row.push(method_sample_sizes::name(DEFAULT_METHOD).to_owned());
        row.push(shortfall.map_or(String::new(), |db| format!("{db:.2}")));
        table.add_row(row);
    }
    let mut section = ReportSection::new("Scenes");
    section.add_paragraph(
        "SNR of T in dB by method, and the shortfall of the default method against the best other one \
         in dB (negative if the default is the best). No parameter of any method was chosen on these \
         scenes, seeds or settings.",
    );
    section.add_paragraph(&table.markdown());
    if worst.is_finite() {
        section.add_paragraph(&format!(
            "The default's largest shortfall is {worst:.2} dB; at most {MAX_SHORTFALL_DB} dB is accepted."
        ));
    }
    section.add_csv("scenes", &table)?;
    Ok(section)
}
