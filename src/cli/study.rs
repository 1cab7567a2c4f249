//! `ltm-export study`: the accuracy of recovery on scenes and captures with known transport.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;

use super::measurement_reader::{MeasurementReader, read_patterns};
use super::output_folder;
use super::process_resources::AllCoresExecutor;
use super::recover::MethodName;
use super::study_faults::FaultStudy;
use super::value_parsers::{UsageError, value_name};
use crate::capture::{CameraPixelSet, CameraRowSet, CaptureFolder, Measurements};
use crate::relight::Light;
use crate::simulate::{SceneKind, SimulatedCapture, SimulatedScene, WINDOW_SIDE, first_shots};
use crate::study::{self, CaptureTruth, EvaluationLight, ProgressLog, ReportSection, SNR_PATTERNS};
use crate::transport::{Extent, KnownTransport};

const PARTS: [&str; 5] = ["stained-glass", "cookies", "comparison", "scenes", "faults"];
/// The paper's scale for glass: N = 262,144 and M = 65,536.
const PAPER_CAMERA: Extent = Extent::new(512, 512);
const PAPER_LIGHT: Extent = Extent::new(256, 256);
/// Scale of the comparison.
const COMPARISON_CAMERA: Extent = Extent::new(64, 64);
const COMPARISON_LIGHT: Extent = Extent::new(32, 32);
/// Number of patterns for relit pictures, as in the paper.
const RELIT_PATTERNS: usize = 80;
/// Default number of camera pixels on which slow methods are evaluated.
const DEFAULT_PIXELS: usize = 8192;
const ELECTRONS: f64 = 40_000.0;
const SEED: u64 = 2014;
const CORES: &AllCoresExecutor = &AllCoresExecutor;

const INTRODUCTION: &str = "# Results\n\n\
    SNR is 20 log10(‖T‖ / ‖T − T̂‖) over the whole matrix, with Frobenius norms; elements outside the \
    window count as error. L is the number of patterns, M the number of light elements, N the number of \
    camera pixels. Figures are numbered as in the paper (Thanikachalam et al. 2014). \
    `ltm-export study` writes this page.\n";

/// Measure the accuracy of recovery with known transport: the paper's figures, its comparison, many scenes, faults of rigs
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// Capture folders with truth/, or parts of the study: stained-glass, cookies (figures at the paper's scale),
    /// comparison, scenes, faults [default: these five]
    #[arg(value_name = "CAPTURE|PART", default_values = PARTS, hide_default_value = true)]
    subjects: Vec<PathBuf>,
    /// Folder for results.md, images and CSV; must be new or empty
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Camera pixels on which nnls and bpdn-identity are evaluated. learned uses four times as many, in whole tiles,
    /// bpdn-dct and bpdn-haar an eighth. Fewer are faster and less accurate
    #[arg(long, value_name = "N", default_value_t = DEFAULT_PIXELS as u32,
          value_parser = clap::value_parser!(u32).range(1..))]
    pixels: u32,
    /// Photograph the captures again with each fault of `photograph --fault`, and recover them, rather than draw figures
    #[arg(long)]
    faults: bool,
    /// Recovery method with --faults
    #[arg(long, value_enum, default_value_t = MethodName::Learned, requires = "faults")]
    method: MethodName,
}

pub fn run(args: &StudyArgs) -> Result<()> {
    if args.faults && args.subjects.iter().any(|path| is_part(path)) {
        bail!(UsageError(
            "--faults is for captures; the part \"faults\" is for the built-in scenes"
        ));
    }
    let start = Instant::now();
    let progress = |text: &str| eprintln!("[{:7.1} s] {text}", start.elapsed().as_secs_f64());
    // Errors are found before the work, which may take an hour.
    let mut subjects: Vec<StudySubject> = Vec::new();
    for path in &args.subjects {
        let subject = StudySubject::new(path, args, &progress)?;
        let name = &subject.name;
        ensure!(
            subjects.iter().all(|other| other.name != *name),
            "{name} is named twice, and its results would have the same names; rename one of the folders"
        );
        subjects.push(subject);
    }
    output_folder::write_in_place(&args.output, |root| {
        let results = root.join("results.md");
        let mut text = INTRODUCTION.to_owned();
        for subject in &subjects {
            let part_start = Instant::now();
            let mut option = match subject.pixels {
                DEFAULT_PIXELS => String::new(),
                other => format!(" --pixels {other}"),
            };
            if let Some(method) = subject.fault_method {
                option += &format!(" --faults --method {}", value_name(method));
            }
            let name = &subject.name;
            text += &format!("\nFrom `ltm-export study {name} -o DIR{option}`:\n");
            for section in subject.study(root)? {
                for (path, bytes) in &section.files {
                    write(&root.join(path), bytes)?;
                }
                text += &format!("\n{}", section.markdown);
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

fn is_part(path: &Path) -> bool {
    PARTS.iter().any(|part| Path::new(part) == path)
}

/// A built-in part of the study, or a capture to study.
struct StudySubject<'a> {
    /// The name of a part, or the path of a capture folder; of one named like a part, for instance `./cookies`.
    path: &'a Path,
    is_part: bool,
    name: String,
    pixels: usize,
    /// With which method a capture's faults are studied; none for its figures.
    fault_method: Option<MethodName>,
    progress: ProgressLog<'a>,
}

impl<'a> StudySubject<'a> {
    fn new(path: &'a Path, args: &StudyArgs, progress: ProgressLog<'a>) -> Result<Self> {
        let is_part = is_part(path);
        let folder = match is_part {
            true => path.to_owned(),
            false => {
                CaptureFolder::open(path)?;
                path.canonicalize().unwrap_or_default()
            }
        };
        let name = folder.file_name().with_context(|| {
            let path = path.display();
            format!("{path}: the path has no folder name; give the name of the folder")
        })?;
        Ok(Self {
            path,
            is_part,
            name: name.to_string_lossy().into_owned(),
            pixels: args.pixels as usize,
            fault_method: args.faults.then_some(args.method),
            progress,
        })
    }

    /// Temporary files are written into folders in `root`.
    fn study(&self, root: &Path) -> Result<Vec<ReportSection>> {
        if !self.is_part {
            let sections = match self.fault_method {
                Some(method) => self.study_faults(method, root),
                None => self.study_capture(),
            };
            return sections.with_context(|| self.path.display().to_string());
        }
        match self.name.as_str() {
            "stained-glass" => self.study_scene(SceneKind::StainedGlass),
            "cookies" => self.study_scene(SceneKind::Cookies),
            "comparison" => {
                let kinds = [SceneKind::StainedGlass, SceneKind::Cookies].into_iter();
                let compare = |(kind, name): (SceneKind, &str)| {
                    let scene = kind.build(COMPARISON_CAMERA, COMPARISON_LIGHT)?;
                    let (camera, ensemble) = (simulated_capture(scene.as_ref()), kind.ensemble());
                    let section = study::comparison(name, camera, ensemble, CORES, self.progress)?;
                    Ok(section)
                };
                kinds.zip(PARTS).map(compare).collect()
            }
            "faults" => {
                let study = FaultStudy::new(root, MethodName::Learned, self.progress)?;
                Ok(vec![study.study_scenes()?])
            }
            _ => {
                let section = study::scenes_table(self.pixels, CORES, self.progress)?;
                Ok(vec![section])
            }
        }
    }

    /// The paper's figures for a built-in scene at the paper's scale.
    fn study_scene(&self, kind: SceneKind) -> Result<Vec<ReportSection>> {
        let scene = kind.build(PAPER_CAMERA, PAPER_LIGHT)?;
        let max_patterns = SNR_PATTERNS[SNR_PATTERNS.len() - 1];
        (self.progress)(&format!(
            "{}: photographing under {max_patterns} patterns, window {WINDOW_SIDE}",
            self.name
        ));
        let camera = simulated_capture(scene.as_ref());
        let measurements = camera.measure(kind.ensemble(), max_patterns, CORES);
        let lights = study::built_in_lights(PAPER_LIGHT);
        self.figures(&camera, measurements, lights)
    }

    /// The faults of rigs for a capture with known transport.
    fn study_faults(&self, method: MethodName, root: &Path) -> Result<Vec<ReportSection>> {
        let study = FaultStudy::new(root, method, self.progress)?;
        Ok(vec![study.study_capture(&self.name, self.path)?])
    }

    /// The paper's figures for a capture with known transport.
    fn study_capture(&self) -> Result<Vec<ReportSection>> {
        let folder = CaptureFolder::open(self.path)?;
        let truth = folder
            .truth()?
            .context("has no truth/ folder, so its transport is unknown; use evaluate instead")?;
        let mut lights = Vec::new();
        for name in truth.lights()? {
            lights.push(EvaluationLight {
                light: Light::from_linear_rgb(truth.light_plane, &truth.light(&name)?.rgb())?,
                photographed: Some(truth.relit(&name)?),
                name,
            });
        }
        // The flood light shows most of the object.
        lights.sort_by_key(|light| light.name != "flood");
        let measurements = read_measurements(&folder)?;
        let known = CaptureTruth::new(truth, measurements.correspondence.clone())?;
        self.figures(&known, measurements, lights)
    }

    fn figures(
        &self,
        known: &impl KnownTransport,
        measurements: Measurements,
        lights: Vec<EvaluationLight>,
    ) -> Result<Vec<ReportSection>> {
        let (name, pixels, progress) = (&self.name, self.pixels, self.progress);
        let sparsity = study::sparsity(name, known, CORES, progress)?;
        let first = first_shots(&measurements, RELIT_PATTERNS);
        let relit = study::relit_pictures(name, known, &first, lights, CORES, progress)?;
        drop(first);
        let curves = study::snr_curves(name, known, measurements, pixels, CORES, progress)?;
        Ok(vec![sparsity, curves, relit])
    }
}

fn simulated_capture(scene: &dyn SimulatedScene) -> SimulatedCapture<'_> {
    SimulatedCapture {
        scene,
        electrons: ELECTRONS,
        seed: SEED,
    }
}

fn read_measurements(folder: &CaptureFolder) -> Result<Measurements> {
    let shots: Vec<usize> = (0..folder.manifest().shots.len()).collect();
    let camera = folder.manifest().camera.extent();
    let pixels = CameraPixelSet::all(camera);
    let dark = folder.read_dark(&pixels)?;
    let gray_code_rows = CameraRowSet::all(camera.height);
    let mut measurements = read_patterns(folder, dark.noise(&pixels), &shots, &gray_code_rows)?;
    let reader = MeasurementReader::open(folder, &shots)?;
    reader.read_sample(&mut measurements, &dark, &pixels, CORES)?;
    Ok(measurements)
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
