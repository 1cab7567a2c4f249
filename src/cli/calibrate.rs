//! `ltm-export calibrate`: the correspondence of a capture from its Gray code, reported and written into its manifest; and what its
//! photographs say of noise and drift.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use serde::Serialize;

use super::check::{CheckReport, check_capture};
use super::object_text::ObjectText;
use super::output_file::{OutputFile, PNG, temporary_beside};
use super::process_resources::{Interrupted, InterruptibleCores};
use super::progress;
use super::report::{print_json, print_line};
use crate::calibrate::{GrayCodeFit, ResidualSummary};
use crate::capture::{CameraRowSet, CaptureFolder, Manifest, ManifestCamera, NoiseModel};
use crate::job_executor::Cancelled;
use crate::transport::{CHANNELS, CameraPixel, Correspondence, Extent};

/// Memory for the photographs of the Gray code, in bytes. Rows are left out of larger ones.
const MAX_GRAY_CODE_BYTES: u64 = 1 << 30;
/// Memory for the decoded position of a camera pixel, in bytes.
const POSITION_BYTES: u64 = 64;

/// Median of the residuals, in light elements, above which the Gray code is wrong: scattering leaves about one.
const MAX_RESIDUAL: f64 = 2.0;
/// The error of such a fit.
pub const IMPLAUSIBLE_FIT: &str = "the Gray code fits no smooth correspondence, as half of the camera pixels lie more than two \
                                   light elements from it. Is each photograph that of its bit, none exchanged with its inverse, \
                                   and is the object nearly flat?";

/// Whether a fit is so bad that the Gray code must be wrong.
pub fn is_implausible(fit: &GrayCodeFit) -> bool {
    (fit.residual).is_some_and(|residual| residual.median > MAX_RESIDUAL)
}

/// Find the correspondence of a capture from its Gray code, report how well it fits, and write it into capture.json; report noise and
/// drift of the photographs
#[derive(Debug, Args)]
pub struct CalibrateArgs {
    /// Capture folder
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Draw how far the correspondence bends from its affine part, along the display's columns in red and along its rows in
    /// green: half bright is nothing, black and full brightness are the largest displacement to either side
    #[arg(long, value_name = "FILE.png")]
    map: Option<PathBuf>,
    /// Replace the correspondence that capture.json has, and write one that hardly fits
    #[arg(long)]
    force: bool,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct CalibrationReport {
    /// Share of the camera pixels that are decoded along both axes.
    decoded: f64,
    affine: [[f64; 3]; 2],
    /// Largest displacement, in light elements; 0 if the correspondence is affine.
    largest_displacement: f64,
    /// Distances between the correspondence and decoded positions, in light elements.
    residual: Option<Distances>,
    /// Those of the affine map alone.
    affine_residual: Option<Distances>,
    /// Variances of the measurements, as `check` estimates them; null, as is `exposure`, if the patterns' photographs cannot be
    /// examined.
    noise: Option<NoiseModel>,
    exposure: Option<ExposureStability>,
}

/// How the exposures of a session change, from the gains of its photographs.
#[derive(Debug, PartialEq, Serialize)]
struct ExposureStability {
    /// From the first photograph to the last, along a straight line, as a share of the exposure.
    drift: f64,
    /// Standard deviation from this line: of the shutter, for instance.
    jitter: f64,
}

impl ExposureStability {
    /// Of shots by their indices, with their gains.
    fn new(gains: &[(usize, f64)]) -> Option<Self> {
        if gains.len() < 3 {
            return None;
        }
        let count = gains.len() as f64;
        let mean =
            |value: &dyn Fn(&(usize, f64)) -> f64| gains.iter().map(value).sum::<f64>() / count;
        let at = |(shot, _): &(usize, f64)| *shot as f64;
        let (middle, gain) = (mean(&at), mean(&|(_, gain)| *gain));
        let square = mean(&|own| (at(own) - middle).powi(2));
        let slope = mean(&|own| (at(own) - middle) * (own.1 - gain)) / square;
        let error = |own: &(usize, f64)| own.1 - gain - slope * (at(own) - middle);
        // Two parameters are fitted.
        let variance = mean(&|own| error(own).powi(2)) * count / (count - 2.0);
        let (first, last) = (at(&gains[0]), at(&gains[gains.len() - 1]));
        Some(Self {
            drift: slope * (last - first) / gain,
            jitter: variance.sqrt() / gain,
        })
    }
}

/// Distances in light elements.
#[derive(Serialize)]
pub struct Distances {
    pub median: f64,
    pub percentile_95: f64,
}

impl From<ResidualSummary> for Distances {
    fn from(summary: ResidualSummary) -> Self {
        let ResidualSummary {
            median,
            percentile_95,
        } = summary;
        Self {
            median,
            percentile_95,
        }
    }
}

pub fn run(args: &CalibrateArgs) -> Result<()> {
    let folder = CaptureFolder::open(&args.folder)?;
    let (manifest, path) = (folder.manifest(), folder.manifest_path());
    ensure!(
        !manifest.graycode.is_empty(),
        "{}: has no \"graycode\"; photograph the Gray code, or give \"correspondence\"",
        path.display()
    );
    ensure!(
        manifest.correspondence.is_none() || args.force,
        "{}: has a \"correspondence\" already; --force replaces it",
        path.display()
    );
    let map = args.map.as_ref();
    let map = map.map(|path| OutputFile::create(path, &PNG)).transpose()?;
    let spinner = progress::spinner("decoding Gray code");
    let camera = manifest.camera.extent();
    let rows = rows(manifest);
    let gray_code = folder.read_gray_code(&folder.read_dark_rows(&rows)?, &rows)?;
    let fit = gray_code
        .fit(camera)
        .with_context(|| path.display().to_string())?;
    drop(spinner);
    ensure!(
        args.force || !is_implausible(&fit),
        "{}: {IMPLAUSIBLE_FIT}. --force writes it nevertheless",
        path.display()
    );
    if let Some(map) = map {
        draw_map(map, camera, &fit.correspondence)?;
    }
    write_correspondence(&path, &fit.correspondence)?;
    let spinner = progress::spinner("examining photographs");
    let examined = examine(&args.folder)?;
    drop(spinner);
    let gains = examined.shot_reports.iter();
    let gains: Vec<(usize, f64)> = gains
        .filter(|shot| shot.verdict == Some("used"))
        .filter_map(|shot| Some((shot.shot, shot.gain?)))
        .collect();
    let report = CalibrationReport {
        decoded: fit.decoded,
        affine: fit.correspondence.affine,
        largest_displacement: largest_displacement(&fit.correspondence),
        residual: fit.residual.map(Distances::from),
        affine_residual: fit.affine_residual.map(Distances::from),
        noise: examined.examined.map(|examined| examined.noise),
        exposure: ExposureStability::new(&gains),
    };
    match args.json {
        true => print_json(&report),
        false => print(&fit, &report, &manifest.camera),
    }
}

/// The rows of the Gray code that fit in memory, evenly spaced.
fn rows(manifest: &Manifest) -> CameraRowSet {
    let Extent { width, height } = manifest.camera.extent();
    let row_bytes = u64::from(width) * (CHANNELS * size_of::<f32>()) as u64;
    let photographs = manifest.graycode.len().max(1) as u64;
    let row_bytes = row_bytes * photographs + u64::from(width) * POSITION_BYTES;
    let count = (MAX_GRAY_CODE_BYTES / row_bytes).clamp(1, height.into());
    let row = |i: u64| (i * u64::from(height) / count) as u32;
    CameraRowSet::from_strips((0..count).map(|i| row(i)..row(i) + 1))
}

fn print(fit: &GrayCodeFit, report: &CalibrationReport, camera: &ManifestCamera) -> Result<()> {
    let line = |name: &str, value: &str| print_line(&format!("{name:15} {value}"));
    let decoded = format!("{:.0} % of the camera pixels", 100.0 * report.decoded);
    line("decoded", &decoded)?;
    let shape = match fit.correspondence.displacement {
        None => "affine".to_owned(),
        Some(_) => format!(
            "bends, by up to {:.1} light elements from an affine map",
            report.largest_displacement
        ),
    };
    line("correspondence", &shape)?;
    let distances = |distances: &Option<Distances>| match distances {
        None => "unknown: no pixel is decoded to a single light element".to_owned(),
        Some(Distances {
            median,
            percentile_95,
        }) => {
            format!("median {median:.2}, 95 % below {percentile_95:.2} light elements")
        }
    };
    line("residual", &distances(&report.residual))?;
    if fit.correspondence.displacement.is_some() {
        line("affine alone", &distances(&report.affine_residual))?;
    }
    if let Some(noise) = &report.noise {
        let codes = |variance: f64| variance.sqrt() * (camera.white - camera.black);
        let [red, green, blue] = noise.floor.map(codes);
        line(
            "read noise",
            &format!("{red:.1}, {green:.1} and {blue:.1} codes of red, green and blue"),
        )?;
        let [red, green, blue] = noise.gain.map(|gain| 100.0 * gain.sqrt());
        line(
            "shot noise",
            &format!("{red:.2}, {green:.2} and {blue:.2} % of white, at white"),
        )?;
    }
    match &report.exposure {
        None => {}
        // No gain differs from 1 by more than chance.
        Some(ExposureStability { drift, jitter }) if *drift == 0.0 && *jitter == 0.0 => {
            line("exposure", "steady, as far as the noise shows")?;
        }
        Some(ExposureStability { drift, jitter }) => {
            let (drift, jitter) = (100.0 * drift, 100.0 * jitter);
            line(
                "exposure",
                &format!("drifts by {drift:+.1} % over the session, and jitters by {jitter:.1} %"),
            )?;
        }
    }
    Ok(())
}

/// What the photographs of patterns say.
fn examine(folder: &Path) -> Result<CheckReport> {
    let cores = InterruptibleCores::listen()?;
    let examined = check_capture(folder, None, &cores);
    examined.map_err(|error| match error.is::<Cancelled>() {
        true => Interrupted(
            "interrupted; the correspondence is written, noise and drift are not known".to_owned(),
        )
        .into(),
        false => error,
    })
}

/// Largest displacement at a control point, in light elements.
fn largest_displacement(correspondence: &Correspondence) -> f64 {
    let grid = correspondence.displacement.as_ref();
    grid.map_or(0.0, |grid| grid.largest())
}

/// Draws the displacement of every camera pixel, grey where there is none.
fn draw_map(output: OutputFile, camera: Extent, correspondence: &Correspondence) -> Result<()> {
    let affine = Correspondence::from_affine(correspondence.affine);
    let largest = largest_displacement(correspondence).max(f64::MIN_POSITIVE);
    let code = |d: f64| (127.5 + 127.5 * d / largest).round() as u8;
    let pixels = camera.cells().map(|(x, y)| {
        let pixel = CameraPixel { x, y };
        let (bent, straight) = (correspondence.at(pixel), affine.at(pixel));
        [code(bent.u - straight.u), code(bent.v - straight.v), 128]
    });
    let pixels: Vec<[u8; CHANNELS]> = pixels.collect();
    output.finish(|out| {
        PngEncoder::new(out)
            .write_image(
                pixels.as_flattened(),
                camera.width,
                camera.height,
                ExtendedColorType::Rgb8,
            )
            .context("cannot be encoded")
    })?;
    Ok(())
}

/// Sets "correspondence" in the manifest at `path`, and keeps the text of all other fields.
fn write_correspondence(path: &Path, correspondence: &Correspondence) -> Result<()> {
    let write = || -> Result<()> {
        let mut manifest = ObjectText::read(path)?;
        manifest.remove("correspondence");
        manifest.push("correspondence", correspondence)?;
        let (builder, parent) = temporary_beside(path, 0o666);
        let file = builder.tempfile_in(parent)?;
        std::fs::write(file.path(), manifest.pretty()?)?;
        file.persist(path)?;
        Ok(())
    };
    write().with_context(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposures_drift_along_a_line_and_jitter_about_it() {
        let gain = |i: usize| 2.0 * (1.0 + 0.001 * i as f64 + [0.01, -0.01][i % 2]);
        let gains: Vec<(usize, f64)> = (0..41).map(|i| (i, gain(i))).collect();
        let ExposureStability { drift, jitter } = ExposureStability::new(&gains).unwrap();
        assert!((drift - 0.04 / 1.02).abs() < 1e-3, "{drift}");
        assert!((jitter - 0.01).abs() < 5e-4, "{jitter}");
        assert_eq!(ExposureStability::new(&gains[..2]), None);
    }

    #[test]
    fn other_fields_of_the_manifest_keep_their_text() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("capture.json");
        let shots = "[{\"pattern\":   \"p.png\"}]";
        let json = format!("{{\"version\": 1, \"note\": \"mine\", \"shots\": {shots}}}");
        std::fs::write(&path, json).unwrap();
        let affine = [[0.5, 0.0, 1.25], [0.0, 0.5, -3.0]];
        let correspondence = Correspondence::from_affine(affine);
        for _ in 0..2 {
            write_correspondence(&path, &correspondence).unwrap();
        }
        let json = std::fs::read_to_string(&path).unwrap();
        assert!(
            json.contains("\"note\": \"mine\"") && json.contains(shots),
            "{json}"
        );
        let value: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(
            value["correspondence"],
            serde_json::json!({ "affine": affine })
        );
    }
}
