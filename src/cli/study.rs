//! `ltm-export study`: the accuracy of recovery on scenes and captures with known transport.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;

use super::process::AllCores;
use super::shot_reader::{ShotReader, read_patterns};
use super::{output_folder, progress};
use crate::capture::{CaptureFolder, Measurements, NoiseModel, RowSet};
use crate::relight::Light;
use crate::simulate::{SceneKind, WINDOW_SIDE};
use crate::study::{
    self, CaptureTruth, KnownTransport, RelitLight, SNR_PATTERNS, SceneCamera, Section,
};
use crate::transport::Extent;

/// The built-in parts of the study.
const PARTS: [&str; 4] = ["stained-glass", "cookies", "comparison", "scenes"];
/// The paper's scale for glass: N = 262,144 and M = 65,536.
const PAPER_CAMERA: u32 = 512;
const PAPER_LIGHT: u32 = 256;
/// Scale of the comparison.
const COMPARISON_CAMERA: u32 = 64;
const COMPARISON_LIGHT: u32 = 32;
/// Number of patterns for relit pictures, as in the paper.
const RELIT_PATTERNS: usize = 80;
/// Default number of camera pixels on which slow methods are evaluated.
const DEFAULT_PIXELS: usize = 8192;
const ELECTRONS: f64 = 40_000.0;
const SEED: u64 = 2014;

const INTRODUCTION: &str = "# Results\n\n\
    SNR is 20 log10(‖T‖ / ‖T − T̂‖) over the whole matrix, with Frobenius norms; elements outside the \
    window count as error. L is the number of patterns, M the number of light elements, N the number of \
    camera pixels. Figures are numbered as in the paper (Thanikachalam et al. 2014). \
    `ltm-export study` writes this page.\n";

/// Measure the accuracy of recovery with known transport: the paper's figures, its comparison, many scenes
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// Capture folders with truth/, or parts of the study: stained-glass, cookies (figures at the paper's scale),
    /// comparison, scenes [default: these four]
    #[arg(value_name = "CAPTURE|PART")]
    subjects: Vec<PathBuf>,
    /// Folder for results.md, images and CSV; must be new or empty
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Camera pixels on which nnls and bpdn-identity are evaluated. learned uses four times as many, in whole tiles,
    /// bpdn-dct and bpdn-haar an eighth. Fewer are faster and less accurate
    #[arg(long, value_name = "N", default_value_t = DEFAULT_PIXELS as u32,
          value_parser = clap::value_parser!(u32).range(1..))]
    pixels: u32,
}

pub fn run(args: &StudyArgs) -> Result<()> {
    let named = args.subjects.iter().map(PathBuf::as_path);
    let subjects: Vec<&Path> = match args.subjects.is_empty() {
        true => PARTS.iter().map(Path::new).collect(),
        false => named.collect(),
    };
    // Errors are found before the work, which may take an hour.
    let mut names = Vec::new();
    for subject in &subjects {
        if !is_part(subject) {
            CaptureFolder::open(subject)?;
        }
        let name = result_name(subject)?;
        ensure!(
            !names.contains(&name),
            "{name} is named twice, and its results would have the same names; rename one of the folders"
        );
        names.push(name);
    }
    let start = Instant::now();
    let progress = |text: &str| eprintln!("[{:7.1} s] {text}", start.elapsed().as_secs_f64());
    output_folder::write_in_place(&args.output, |root| {
        let results = root.join("results.md");
        let mut text = INTRODUCTION.to_owned();
        for (subject, name) in subjects.iter().zip(&names) {
            let pixels = args.pixels as usize;
            let part_start = Instant::now();
            let option = match pixels {
                DEFAULT_PIXELS => String::new(),
                other => format!(" --pixels {other}"),
            };
            text += &format!("\nFrom `ltm-export study {name} -o DIR{option}`:\n");
            for section in study_one(subject, name, pixels, &progress)? {
                for (path, bytes) in &section.files {
                    write(&root.join(path), bytes)?;
                }
                text += "\n";
                text += &section.markdown;
            }
            text += &format!(
                "\nThis took {:.0} s on {} threads.\n",
                part_start.elapsed().as_secs_f64(),
                rayon::current_num_threads()
            );
            // Rewritten after each part, so that a later failure does not lose it.
            write(&results, text.as_bytes())?;
        }
        Ok(())
    })?;
    progress(&format!("{}: done", args.output.display()));
    Ok(())
}

/// Whether `subject` is the name of a part. A capture folder of that name can be given as `./cookies`.
fn is_part(subject: &Path) -> bool {
    PARTS.iter().any(|part| Path::new(part) == subject)
}

/// Name of the results of `subject`.
fn result_name(subject: &Path) -> Result<String> {
    let name = subject
        .canonicalize()
        .ok()
        .filter(|_| !is_part(subject))
        .and_then(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
    match name {
        Some(name) => Ok(name),
        None if is_part(subject) => Ok(subject.to_string_lossy().into_owned()),
        None => bail!(
            "{}: the path has no folder name; give the name of the folder",
            subject.display()
        ),
    }
}

fn study_one(
    subject: &Path,
    name: &str,
    pixels: usize,
    progress: study::ProgressCallback,
) -> Result<Vec<Section>> {
    if !is_part(subject) {
        return study_capture(subject, name, pixels, progress)
            .with_context(|| subject.display().to_string());
    }
    Ok(match name {
        "stained-glass" => study_scene(SceneKind::StainedGlass, name, pixels, progress)?,
        "cookies" => study_scene(SceneKind::Cookies, name, pixels, progress)?,
        "comparison" => [
            (SceneKind::StainedGlass, PARTS[0]),
            (SceneKind::Cookies, PARTS[1]),
        ]
        .into_iter()
        .map(|(kind, name)| {
            let scene = kind.build(square(COMPARISON_CAMERA), square(COMPARISON_LIGHT))?;
            let scene_camera = SceneCamera {
                scene: scene.as_ref(),
                electrons: ELECTRONS,
                seed: SEED,
            };
            let section =
                study::comparison(name, scene_camera, kind.ensemble(), &AllCores, progress)?;
            Ok(section)
        })
        .collect::<Result<_>>()?,
        _ => vec![study::scenes_table(pixels, &AllCores, progress)?],
    })
}

fn square(side: u32) -> Extent {
    Extent::new(side, side)
}

/// The paper's figures for a built-in scene at the paper's scale.
fn study_scene(
    kind: SceneKind,
    name: &str,
    pixels: usize,
    progress: study::ProgressCallback,
) -> Result<Vec<Section>> {
    let light = square(PAPER_LIGHT);
    let scene = kind.build(square(PAPER_CAMERA), light)?;
    let scene_camera = SceneCamera {
        scene: scene.as_ref(),
        electrons: ELECTRONS,
        seed: SEED,
    };
    let max_patterns = SNR_PATTERNS[SNR_PATTERNS.len() - 1];
    progress(&format!(
        "{name}: photographing under {max_patterns} patterns, window {WINDOW_SIDE}"
    ));
    let measurements = scene_camera.measure(kind.ensemble(), max_patterns, &AllCores)?;
    let lights = study::built_in_lights(light);
    figures(name, &scene_camera, measurements, lights, pixels, progress)
}

/// The paper's figures for a capture with known transport.
fn study_capture(
    path: &Path,
    name: &str,
    pixels: usize,
    progress: study::ProgressCallback,
) -> Result<Vec<Section>> {
    let folder = CaptureFolder::open(path)?;
    let truth = folder
        .truth()?
        .context("has no truth/ folder, so its transport is unknown; use evaluate instead")?;
    let mut lights = Vec::new();
    for light in truth.lights()? {
        lights.push(RelitLight {
            light: Light::from_linear_rgb(folder.manifest().light.extent(), &truth.light(&light)?)?,
            photographed: Some(truth.relit(&light)?),
            name: light,
        });
    }
    // The flood light shows most of the object.
    lights.sort_by_key(|light| light.name != "flood");
    let shots: Vec<usize> = (0..folder.manifest().shots.len()).collect();
    let measurements = read_measurements(&folder, &shots)?;
    let known = CaptureTruth::new(truth, measurements.correspondence)?;
    figures(name, &known, measurements, lights, pixels, progress)
}

/// Reads all rows of `shots`.
fn read_measurements(folder: &CaptureFolder, shots: &[usize]) -> Result<Measurements> {
    let rows = RowSet::all(folder.manifest().camera.height);
    let dark = folder.read_dark()?;
    let mut measurements = read_patterns(folder, &dark, shots, &rows)?;
    let mut reader = ShotReader::open(folder, &dark, shots)?;
    let bar = progress::bar("reading", shots.len());
    reader.load_rows(&mut measurements, &rows, || {
        bar.inc(1);
        true
    })?;
    bar.finish_and_clear();
    reader.finish()?;
    measurements.noise = NoiseModel::with_gain_from(&measurements);
    Ok(measurements)
}

/// All figures for one scene or capture.
fn figures(
    name: &str,
    known: &impl KnownTransport,
    measurements: Measurements,
    lights: Vec<RelitLight>,
    pixels: usize,
    progress: study::ProgressCallback,
) -> Result<Vec<Section>> {
    let mut sections = vec![study::sparsity(name, known, &AllCores, progress)?];
    let relit_from = study::first_shots(&measurements, RELIT_PATTERNS);
    let relit = study::relit_pictures(name, known, &relit_from, lights, &AllCores, progress)?;
    drop(relit_from);
    sections.push(study::snr_curves(
        name,
        known,
        measurements,
        pixels,
        &AllCores,
        progress,
    )?);
    sections.push(relit);
    Ok(sections)
}

/// Writes a file, and creates its folder if necessary.
fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let write = || {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::write(path, bytes)
    };
    write().with_context(|| format!("{}: cannot be written", path.display()))
}
