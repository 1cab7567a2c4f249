//! Every method on scenes that nothing was tuned on, and how far the default falls short.

use super::accuracy::judge;
use super::known::SceneTruth;
use super::methods::{self, DEFAULT, METHODS};
use super::report::{Section, Table, cell};
use super::{Photographer, Progress, StudyError};
use crate::executor::Executor;
use crate::simulate::{Ensemble, SceneKind};
use crate::transport::Extent;

/// What is photographed, and how.
struct Setting {
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
) -> Setting {
    Setting {
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

/// Both scenes, both ensembles, few photographs and many, dim and bright, one, two and three camera
/// pixels a light element, a seed each.
const SETTINGS: [Setting; 14] = [
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

/// How far the default may fall short of the best other method, in dB.
const ALLOWED: f64 = 0.3;

/// The table of scenes. Methods that recover each pixel on its own are judged on about `pixels`.
pub fn scenes_table(
    pixels: usize,
    executor: &impl Executor,
    progress: Progress,
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
    header.extend(METHODS.iter().map(|&m| methods::name(m)));
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
        let photographer = Photographer {
            scene: scene.as_ref(),
            electrons: setting.electrons,
            seed: setting.seed,
        };
        let measurements = photographer.measure(setting.ensemble, setting.patterns, executor)?;
        let mut levels = Vec::new();
        for &method in METHODS {
            let known = SceneTruth(scene.as_ref());
            levels.push(judge(&known, &measurements, method, pixels, executor)?.snr);
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
        row.extend(levels.iter().map(|&snr| cell(snr)));
        progress(&format!("scenes: {}", row.join(", ")));
        let of = |default: bool| {
            let levels = METHODS.iter().zip(&levels);
            let chosen = levels.filter(|(method, _)| (**method == DEFAULT) == default);
            chosen
                .filter_map(|(_, snr)| Some((*snr)?.0))
                .reduce(f64::max)
        };
        let shortfall = of(false).zip(of(true)).map(|(other, ours)| other - ours);
        worst = worst.max(shortfall.unwrap_or(worst));
        row.push(methods::name(DEFAULT).to_owned());
        row.push(shortfall.map_or(String::new(), |db| format!("{db:.2}")));
        table.row(row);
    }
    let mut section = Section::new("Scenes");
    section.paragraph(
        "SNR of T in dB by each method, and by how many dB the default falls short of the best \
         other one (less than nothing: it is ahead). No parameter of any method was chosen on these \
         scenes, seeds or settings.",
    );
    section.paragraph(&table.markdown());
    if worst.is_finite() {
        section.paragraph(&format!(
            "The default's largest shortfall is {worst:.2} dB; {ALLOWED} dB are allowed."
        ));
    }
    section.data("scenes", &table)?;
    Ok(section)
}

/// The name by which commands call a scene.
fn scene_name(kind: SceneKind) -> &'static str {
    match kind {
        StainedGlass => "stained-glass",
        Cookies => "cookies",
    }
}
