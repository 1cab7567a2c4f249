//! `ltm-export study`: how well recovery does where the transport is known.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;

use super::photographs::Photographs;
use super::process::{self, AllCores};
use super::{new_folder, recover};
use crate::capture::{CaptureFolder, Measurements, Noise, Rows};
use crate::relight::Light;
use crate::simulate::{SceneKind, WINDOW_SIDE};
use crate::study::{
    self, CaptureTruth, KnownTransport, RelitLight, SNR_PATTERNS, SceneCamera, SceneTruth, Section,
};
use crate::transport::Extent;

/// What is studied unless captures or parts are named.
const PARTS: [&str; 4] = ["stained-glass", "cookies", "comparison", "scenes"];
/// The paper's scale for glass: N = 262,144 and M = 65,536.
const PAPER_CAMERA: u32 = 512;
const PAPER_LIGHT: u32 = 256;
/// Scale of the comparison.
const COMPARISON_CAMERA: u32 = 64;
const COMPARISON_LIGHT: u32 = 32;
/// Patterns that pictures are relit from: the paper's number.
const RELIT_PATTERNS: usize = 80;
/// Camera pixels that slow methods are judged on unless it is said.
const PIXELS: usize = 8192;
const ELECTRONS: f64 = 40_000.0;
const SEED: u64 = 2014;

const INTRODUCTION: &str = "# Results\n\n\
    SNR is 20 log10(‖T‖ / ‖T − T̂‖) over the whole matrix, with Frobenius norms; elements outside the \
    window count as error. L is the number of patterns, M the number of light elements, N the number of \
    camera pixels. Figures are numbered as in the paper (Thanikachalam et al. 2014). \
    `ltm-export study` writes this page.\n";

/// Measure recovery where the transport is known: the paper's figures, its comparison, many scenes
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// Capture folders with truth/, or parts by name: stained-glass, cookies (figures at the paper's
    /// scale), comparison, scenes [default: those four]
    #[arg(value_name = "CAPTURE|PART")]
    subjects: Vec<PathBuf>,
    /// Folder to write results.md, images and CSV to; must be new or empty
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Camera pixels that nnls and bpdn-identity are judged on: learned on four times as many, by whole
    /// tiles, bpdn-dct and bpdn-haar on an eighth. Fewer are quicker and less exact
    #[arg(long, value_name = "N", default_value_t = PIXELS as u32,
          value_parser = clap::value_parser!(u32).range(1..))]
    pixels: u32,
}

pub fn run(args: &StudyArgs) -> Result<()> {
    let named = args.subjects.iter().map(PathBuf::as_path);
    let subjects: Vec<&Path> = match args.subjects.is_empty() {
        true => PARTS.iter().map(Path::new).collect(),
        false => named.collect(),
    };
    // What cannot work is refused before the hour that the rest may take.
    let mut names = Vec::new();
    for subject in &subjects {
        if !is_part(subject) {
            CaptureFolder::open(subject)?;
        }
        let name = name_of(subject)?;
        ensure!(
            !names.contains(&name),
            "{name} is named twice, and its results would have the same names; give one of them \
             another name"
        );
        names.push(name);
    }
    let start = Instant::now();
    let progress = |text: &str| eprintln!("[{:7.1} s] {text}", start.elapsed().as_secs_f64());
    new_folder::fill_new_folder(&args.output, |root| {
        let results = root.join("results.md");
        let mut text = INTRODUCTION.to_owned();
        for (subject, name) in subjects.iter().zip(&names) {
            let pixels = args.pixels as usize;
            let begun = Instant::now();
            let option = match pixels {
                PIXELS => String::new(),
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
                begun.elapsed().as_secs_f64(),
                rayon::current_num_threads()
            );
            // Rewritten after each: an hour's work should not hang on its last minute.
            write(&results, text.as_bytes())?;
        }
        Ok(())
    })?;
    progress(&format!("{}: done", args.output.display()));
    Ok(())
}

/// Whether `subject` names a part; a capture folder of that name is given as `./cookies`.
fn is_part(subject: &Path) -> bool {
    PARTS.iter().any(|part| Path::new(part) == subject)
}

/// What results of `subject` are called.
fn name_of(subject: &Path) -> Result<String> {
    let name = subject
        .canonicalize()
        .ok()
        .filter(|_| !is_part(subject))
        .and_then(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
    match name {
        Some(name) => Ok(name),
        None if is_part(subject) => Ok(subject.to_string_lossy().into_owned()),
        None => bail!(
            "{}: has no name; give the folder by its name",
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
    Extent {
        width: side,
        height: side,
    }
}

/// The paper's figures of a built-in scene at the paper's scale.
fn study_scene(
    kind: SceneKind,
    name: &str,
    pixels: usize,
    progress: study::ProgressCallback,
) -> Result<Vec<Section>> {
    let light = square(PAPER_LIGHT);
    let scene = kind.build(square(PAPER_CAMERA), light)?;
    let known = SceneTruth(scene.as_ref());
    let scene_camera = SceneCamera {
        scene: scene.as_ref(),
        electrons: ELECTRONS,
        seed: SEED,
    };
    let most = SNR_PATTERNS[SNR_PATTERNS.len() - 1];
    progress(&format!(
        "{name}: photographing under {most} patterns, window {WINDOW_SIDE}"
    ));
    let measurements = scene_camera.measure(kind.ensemble(), most, &AllCores)?;
    let lights = study::built_in_lights(light);
    figures(name, &known, measurements, lights, pixels, progress)
}

/// The paper's figures of a capture whose transport is known.
fn study_capture(
    path: &Path,
    name: &str,
    pixels: usize,
    progress: study::ProgressCallback,
) -> Result<Vec<Section>> {
    let folder = CaptureFolder::open(path)?;
    let truth = folder
        .truth()?
        .context("has no truth/ folder: its transport is not known, and there is nothing to hold a recovery against; use evaluate")?;
    let mut lights = Vec::new();
    for light in truth.lights()? {
        lights.push(RelitLight {
            light: Light::from_linear_rgb(folder.manifest().light.extent(), &truth.light(&light)?)?,
            photographed: Some(truth.relit(&light)?),
            name: light,
        });
    }
    // The light that shows most comes first.
    lights.sort_by_key(|light| light.name != "flood");
    let shots: Vec<usize> = (0..folder.manifest().shots.len()).collect();
    let measurements = read(&folder, &shots)?;
    let known = CaptureTruth::new(truth, measurements.correspondence)?;
    figures(name, &known, measurements, lights, pixels, progress)
}

/// Reads shots whole.
fn read(folder: &CaptureFolder, shots: &[usize]) -> Result<Measurements> {
    let rows = Rows::all(folder.manifest().camera.height);
    let dark = folder.read_dark()?;
    let mut measurements = recover::no_rows(folder, &dark, shots, &rows)?;
    let mut photographs = Photographs::open(folder, &dark, shots)?;
    let bar = process::progress("reading", shots.len());
    photographs.advance(&mut measurements, &rows, || {
        bar.inc(1);
        true
    })?;
    bar.finish_and_clear();
    photographs.finish()?;
    measurements.noise = Noise::with_gain_from(&measurements);
    Ok(measurements)
}

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

/// Writes a file, in a folder that is made if need be.
fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let write = || {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::write(path, bytes)
    };
    write().with_context(|| format!("{}: cannot be written", path.display()))
}
