//! `ltm-export evaluate`: an `.ltm` file against what is known of the object.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Result, ensure};
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;

use super::process::AllCores;
use super::{files, report};
use crate::capture::{CaptureFolder, DarkFrame, Pattern, Photo, Picture, Rows, Truth};
use crate::relight::cpu::CpuRelighter;
use crate::relight::{BuiltinLight, Light};
use crate::transport::{CHANNELS, Decibels, Geometry, Transport, TransportError};

/// Hold a file against a capture's known transport, relit pictures and unused photographs
#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// File to evaluate
    #[arg(value_name = "FILE.ltm")]
    file: PathBuf,
    /// Capture folder it was recovered from
    capture: PathBuf,
    /// Only the file's first so many bytes, or hundredths, as a visitor sees it while it loads: 20K, 10%
    #[arg(long, value_name = "BYTES|PERCENT", value_parser = files::Share::parse)]
    first: Option<files::Share>,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report {
    /// SNR of the whole matrix against the truth; null without truth.
    snr_db: Option<Decibels>,
    /// PSNR of relit pictures against true ones, peak 1 in units of the measurement.
    relit: BTreeMap<String, Option<Decibels>>,
    /// SNR of predicted against photographed pictures on shots not used in recovery.
    heldout_snr_db: Option<Decibels>,
    /// The same by camera channel.
    heldout_rgb_snr_db: [Option<Decibels>; CHANNELS],
    heldout_shots: usize,
    /// SNR of the predicted against the flood photograph, which recovery does not look at; null
    /// without one.
    flood_snr_db: Option<Decibels>,
    file_bytes: u64,
    /// Bytes that were looked at, and scans that are whole in them.
    read_bytes: u64,
    read_scans: usize,
    scans: usize,
}

pub fn run(args: &EvaluateArgs) -> Result<()> {
    let file = files::read_ltm(&args.file, args.first)?;
    let header = &file.head.header;
    let folder = CaptureFolder::open(&args.capture)?;
    let (geometry, manifest) = (&header.geometry, folder.manifest());
    for (what, ours, theirs) in [
        ("camera", geometry.camera, manifest.camera.extent()),
        ("light", geometry.light, manifest.light.extent()),
    ] {
        ensure!(
            ours == theirs,
            "{} has {what} {ours}, but {} has {theirs}: it was not recovered from this capture",
            args.file.display(),
            args.capture.display(),
        );
    }
    let mut report = Report {
        snr_db: None,
        relit: BTreeMap::new(),
        heldout_snr_db: None,
        heldout_rgb_snr_db: [None; CHANNELS],
        heldout_shots: 0,
        flood_snr_db: None,
        file_bytes: header.file_bytes,
        read_bytes: file.bytes,
        read_scans: file.scans,
        scans: file.head.scans.len(),
    };
    let mut relighter = CpuRelighter::new(Arc::new(file.transport));
    if let Some(truth) = folder.truth()? {
        report.snr_db = against_truth(relighter.transport(), &truth).snr();
        for name in truth.lights()? {
            let light = Light::from_linear_rgb(geometry.light, &truth.light(&name)?)?;
            let psnr = relit_psnr(&mut relighter, &light, &truth.relit(&name)?);
            report.relit.insert(name, psnr);
        }
    }
    let used = file.head.metadata.read()?.shots_used;
    let held: Vec<usize> = (0..manifest.shots.len())
        .filter(|i| !used.contains(i))
        .collect();
    let dark = folder.read_dark()?;
    let errors = against_shots(&mut relighter, &folder, &dark, &held)?;
    report.flood_snr_db = against_flood(&mut relighter, &folder, &dark)?;
    report.heldout_snr_db = together(&errors).snr();
    report.heldout_rgb_snr_db = errors.map(|e| e.snr());
    report.heldout_shots = held.len();
    if args.json {
        return report::print_json(&report);
    }
    print(&report)
}

fn print(report: &Report) -> Result<()> {
    let line = |name: &str, value: &str| report::print_line(&format!("{name:28} {value}"));
    let snr = |name: &str, of: Option<Decibels>| {
        line(name, &of.map_or("-".to_owned(), |snr| snr.to_string()))
    };
    snr("SNR against the truth", report.snr_db)?;
    let held = format!("SNR on {} held-out shots", report.heldout_shots);
    snr(&held, report.heldout_snr_db)?;
    snr("SNR on the flood photo", report.flood_snr_db)?;
    for (name, psnr) in &report.relit {
        snr(&format!("PSNR relit under {name}"), *psnr)?;
    }
    let bytes = report::bytes;
    match report.read_bytes < report.file_bytes {
        true => line(
            "File",
            &format!(
                "the first {} of {}: {} of {} scans whole",
                bytes(report.read_bytes),
                bytes(report.file_bytes),
                report.read_scans,
                report.scans
            ),
        ),
        false => line("File", &bytes(report.file_bytes)),
    }
}

/// Adds up the error over every element that either transport has for any pixel.
fn against_truth(transport: &Transport, truth: &Truth) -> TransportError {
    let geometry = &transport.geometry;
    let window = geometry.window;
    let tiles = transport.tiles.par_iter().map(|tile| {
        let mut sum = TransportError::default();
        let functions = tile.functions(geometry, &transport.basis).tau;
        let functions = functions.chunks_exact(window.area());
        for (pixel, function) in tile.rect().pixels().zip(functions) {
            let n = geometry.camera.index(pixel);
            let (ours, theirs) = (geometry.window_origin(pixel), truth.window_origin(n));
            let tau = truth.tau(n);
            for (s, tau) in tau.iter().enumerate() {
                let here = window.slot(ours, truth.window().element(theirs, s));
                let estimate = here.map_or([0.0; CHANNELS], |s| function[s]);
                for c in 0..CHANNELS {
                    sum.add(tau[c].to_f64(), f64::from(estimate[c]));
                }
            }
            for s in 0..window.area() {
                let element = window.element(ours, s);
                if truth.window().slot(theirs, element).is_none() {
                    for estimate in function[s] {
                        sum.add(0.0, f64::from(estimate));
                    }
                }
            }
        }
        sum
    });
    tiles.reduce(TransportError::default, |mut a, b| {
        a.merge(b);
        a
    })
}

/// 10 log10(1 / mean squared error) over all pixels and channels.
fn relit_psnr(
    relighter: &mut CpuRelighter,
    light: &Light,
    truth: &[[f64; CHANNELS]],
) -> Option<Decibels> {
    relighter.relight(light, &AllCores);
    let ours = relighter.linear();
    let squares = ours.pixels.iter().zip(truth).flat_map(|(ours, truth)| {
        (0..CHANNELS).map(move |c| (f64::from(ours[c]) - truth[c]).powi(2))
    });
    let mse = squares.sum::<f64>() / (truth.len() * CHANNELS) as f64;
    (mse > 0.0).then(|| Decibels(-10.0 * mse.log10()))
}

/// Error of predicted against photographed pictures, by channel.
fn against_shots(
    relighter: &mut CpuRelighter,
    folder: &CaptureFolder,
    dark: &DarkFrame,
    shots: &[usize],
) -> Result<[TransportError; CHANNELS]> {
    let mut errors = [TransportError::default(); CHANNELS];
    for &i in shots {
        let light = pattern_light(&relighter.transport().geometry, &folder.read_pattern(i)?)?;
        add_photo(&mut errors, relighter, &light, folder.shot(i, dark)?)?;
    }
    Ok(errors)
}

/// SNR of the predicted against the flood photograph, if there is one.
fn against_flood(
    relighter: &mut CpuRelighter,
    folder: &CaptureFolder,
    dark: &DarkFrame,
) -> Result<Option<Decibels>> {
    let Some(photo) = folder.flood(dark)? else {
        return Ok(None);
    };
    let light = BuiltinLight::Flood.render(relighter.transport().geometry.light);
    let mut errors = [TransportError::default(); CHANNELS];
    add_photo(&mut errors, relighter, &light, photo)?;
    Ok(together(&errors).snr())
}

/// The error over all channels.
fn together(errors: &[TransportError; CHANNELS]) -> TransportError {
    let mut all = TransportError::default();
    errors.iter().for_each(|&e| all.merge(e));
    all
}

/// Adds what is predicted under `light` against what was photographed, saturated samples left out.
fn add_photo(
    errors: &mut [TransportError; CHANNELS],
    relighter: &mut CpuRelighter,
    light: &Light,
    mut photo: Photo,
) -> Result<()> {
    relighter.relight(light, &AllCores);
    let ours = relighter.linear();
    let mut picture = Picture::new();
    photo.read(&Rows::all(ours.extent.height), &mut picture)?;
    photo.finish()?;
    for (ours, seen) in ours.pixels.iter().zip(&picture) {
        for c in 0..CHANNELS {
            if seen[c].is_finite() {
                errors[c].add(f64::from(seen[c]), f64::from(ours[c]));
            }
        }
    }
    Ok(())
}

fn pattern_light(geometry: &Geometry, pattern: &Pattern) -> Result<Light> {
    let values: Vec<f32> = (0..geometry.light.area())
        .flat_map(|m| [0, 1, 2].map(|c| pattern.plane(c)[m]))
        .collect();
    Ok(Light::from_linear_rgb(geometry.light, &values)?)
}
