//! A table of all methods on scenes that no parameter was chosen on, and the default method's shortfall.

use super::accuracy::measure_accuracy;
use super::error::StudyError;
use super::known_transport::SceneTruth;
use super::methods::{self, DEFAULT_METHOD};
use super::scene_camera::SceneCamera;
use super::section::{ProgressCallback, Section, Table, snr_cell};
use crate::executor::Executor;
use crate::recover::Method;
use crate::simulate::{Ensemble, SceneKind};
use crate::transport::Extent;

/// One row of the table.
struct SceneSetting {
    kind: SceneKind,
    camera: u32,
    light: u32,
    ensemble: Ensemble,
    patterns: usize,
    electrons: f64,
    seed: u64,
}

const fn setting(
    kind: SceneKind,
    [camera, light]: [u32; 2],
    ensemble: Ensemble,
    patterns: usize,
    electrons: f64,
    seed: u64,
) -> SceneSetting {
    SceneSetting {
        kind,
        camera,
        light,
        ensemble,
        patterns,
        electrons,
        seed,
    }
}

use Ensemble::{Bernoulli, Gaussian};
use SceneKind::{Cookies, StainedGlass};

/// Both scenes, both ensembles, few and many photographs, little and much light, one to three camera pixels
/// for each light element, and a seed for each.
const SETTINGS: [SceneSetting; 14] = [
    setting(StainedGlass, [128, 64], Gaussian, 80, 4e4, 101),
    setting(StainedGlass, [128, 64], Bernoulli, 80, 4e4, 102),
    setting(StainedGlass, [128, 64], Bernoulli, 40, 2e5, 103),
    setting(StainedGlass, [128, 64], Gaussian, 120, 1e4, 104),
    setting(StainedGlass, [96, 96], Bernoulli, 60, 1e5, 105),
    setting(StainedGlass, [144, 48], Bernoulli, 20, 4e4, 106),
    setting(StainedGlass, [144, 48], Gaussian, 60, 1e5, 107),
    setting(Cookies, [128, 64], Bernoulli, 80, 4e4, 108),
    setting(Cookies, [128, 64], Gaussian, 80, 4e4, 109),
    setting(Cookies, [128, 64], Bernoulli, 40, 2e5, 110),
    setting(Cookies, [128, 64], Gaussian, 120, 1e4, 111),
    setting(Cookies, [96, 96], Bernoulli, 60, 1e5, 112),
    setting(Cookies, [144, 48], Bernoulli, 20, 4e4, 113),
    setting(Cookies, [144, 48], Gaussian, 60, 1e5, 114),
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
    progress: ProgressCallback,
) -> Result<Section, StudyError> {
    let mut header = vec![
        "scene",
        "camera",
        "light",
        "ensemble",
        "patterns",
        "electrons",
        "seed",
    ];
    header.extend(Method::ALL.iter().map(|&m| methods::name(m)));
    header.extend(["default", "shortfall"]);
    let mut table = Table::new(&header);
    let mut worst = f64::NEG_INFINITY;
    for setting in &SETTINGS {
        let square = |side| Extent {
            width: side,
            height: side,
        };
        let scene = setting
            .kind
            .build(square(setting.camera), square(setting.light))?;
        let scene_camera = SceneCamera {
            scene: scene.as_ref(),
            electrons: setting.electrons,
            seed: setting.seed,
        };
        let measurements = scene_camera.measure(setting.ensemble, setting.patterns, executor)?;
        let mut levels = Vec::new();
        for &method in Method::ALL {
            let known = SceneTruth(scene.as_ref());
            levels.push(measure_accuracy(&known, &measurements, method, pixels, executor)?.snr);
        }
        let mut row = vec![
            scene_name(setting.kind).to_owned(),
            square(setting.camera).to_string(),
            square(setting.light).to_string(),
            match setting.ensemble {
                Gaussian => "gaussian",
                Bernoulli => "bernoulli",
            }
            .to_owned(),
            setting.patterns.to_string(),
            setting.electrons.to_string(),
            setting.seed.to_string(),
        ];
        row.extend(levels.iter().map(|&snr| snr_cell(snr)));
        progress(&format!("scenes: {}", row.join(", ")));
        let best_snr = |is_default: bool| {
            let levels = Method::ALL.iter().zip(&levels);
            let chosen = levels.filter(|(method, _)| (**method == DEFAULT_METHOD) == is_default);
            chosen
                .filter_map(|(_, snr)| Some((*snr)?.0))
                .reduce(f64::max)
        };
        let shortfall = best_snr(false)
            .zip(best_snr(true))
            .map(|(other, default)| other - default);
        worst = worst.max(shortfall.unwrap_or(worst));
        row.push(methods::name(DEFAULT_METHOD).to_owned());
        row.push(shortfall.map_or(String::new(), |db| format!("{db:.2}")));
        table.add_row(row);
    }
    let mut section = Section::new("Scenes");
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

/// The name of a scene on the command line.
fn scene_name(kind: SceneKind) -> &'static str {
    match kind {
        StainedGlass => "stained-glass",
        Cookies => "cookies",
    }
}
