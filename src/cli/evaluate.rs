//! `ltm-export evaluate`: the accuracy of an `.ltm` file, against the known transport of a simulated capture and
//! against photographs that the recovery did not use.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Result, ensure};
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;

use super::ltm_file::{PrefixLength, read_ltm};
use super::process::AllCores;
use super::report::{format_bytes, print_json, print_line};
use crate::capture::{CaptureFolder, DarkFrame, LinearPhoto, Pattern, PhotoReader, RowSet, Truth};
use crate::relight::cpu::CpuRelighter;
use crate::relight::{BuiltinLight, Light};
use crate::transport::{CHANNELS, Decibels, Geometry, Transport, TransportError};

/// Compare a file with the known transport, the relit pictures and the unused photographs of a capture
#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// File to evaluate
    #[arg(value_name = "FILE.ltm")]
    file: PathBuf,
    /// Capture folder that it was recovered from
    capture: PathBuf,
    /// Use only the first part of the file, as a page does while it loads: 20K, 10%
    #[arg(long, value_name = "BYTES|PERCENT", value_parser = PrefixLength::parse)]
    first: Option<PrefixLength>,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct EvaluateReport {
    /// SNR of the whole matrix against the known transport; null without one.
    snr_db: Option<Decibels>,
    /// PSNR of relit pictures against the true ones, peak 1 in units of the measurement.
    relit: BTreeMap<String, Option<Decibels>>,
    /// SNR of predicted pictures against photographs that the recovery did not use.
    heldout_snr_db: Option<Decibels>,
    /// The same by camera channel.
    heldout_rgb_snr_db: [Option<Decibels>; CHANNELS],
    heldout_shots: usize,
    /// SNR of the predicted picture against the flood photograph, which the recovery does not use; null without one.
    flood_snr_db: Option<Decibels>,
    file_bytes: u64,
    /// Bytes read.
    read_bytes: u64,
    /// Scans that are complete in them.
    read_scans: usize,
    scans: usize,
}

pub fn run(args: &EvaluateArgs) -> Result<()> {
    let file = read_ltm(&args.file, args.first)?;
    let header = &file.index.header;
    let folder = CaptureFolder::open(&args.capture)?;
    let (geometry, manifest) = (&header.geometry, folder.manifest());
    for (name, found, expected) in [
        ("camera", geometry.camera, manifest.camera.extent()),
        ("light", geometry.light, manifest.light.extent()),
    ] {
        ensure!(
            found == expected,
            "{} has {name} {found}, but {} has {expected}: it was not recovered from this capture",
            args.file.display(),
            args.capture.display(),
        );
    }
    let mut report = EvaluateReport {
        snr_db: None,
        relit: BTreeMap::new(),
        heldout_snr_db: None,
        heldout_rgb_snr_db: [None; CHANNELS],
        heldout_shots: 0,
        flood_snr_db: None,
        file_bytes: header.file_bytes,
        read_bytes: file.bytes,
        read_scans: file.scans,
        scans: file.index.scans.len(),
    };
    let mut relighter = CpuRelighter::new(Arc::new(file.transport));
    if let Some(truth) = folder.truth()? {
        report.snr_db = transport_error(relighter.transport(), &truth).snr();
        for name in truth.lights()? {
            let light = Light::from_linear_rgb(geometry.light, &truth.light(&name)?)?;
            let psnr = relit_psnr(&mut relighter, &light, &truth.relit(&name)?);
            report.relit.insert(name, psnr);
        }
    }
    let used = file.index.metadata.read()?.shots_used;
    let heldout: Vec<usize> = (0..manifest.shots.len())
        .filter(|i| !used.contains(i))
        .collect();
    let dark = folder.read_dark()?;
    let errors = shot_errors(&mut relighter, &folder, &dark, &heldout)?;
    report.flood_snr_db = flood_snr(&mut relighter, &folder, &dark)?;
    report.heldout_snr_db = sum(&errors).snr();
    report.heldout_rgb_snr_db = errors.map(|e| e.snr());
    report.heldout_shots = heldout.len();
    if args.json {
        return print_json(&report);
    }
    print(&report)
}

fn print(report: &EvaluateReport) -> Result<()> {
    let line = |name: &str, value: &str| print_line(&format!("{name:28} {value}"));
    let decibels = |name: &str, value: Option<Decibels>| {
        line(name, &value.map_or("-".to_owned(), |db| db.to_string()))
    };
    decibels("SNR of the transport", report.snr_db)?;
    let heldout = format!("SNR on {} held-out shots", report.heldout_shots);
    decibels(&heldout, report.heldout_snr_db)?;
    decibels("SNR on the flood photograph", report.flood_snr_db)?;
    for (name, psnr) in &report.relit {
        decibels(&format!("PSNR relit under {name}"), *psnr)?;
    }
    match report.read_bytes < report.file_bytes {
        true => line(
            "File",
            &format!(
                "the first {} of {}: {} of {} scans complete",
                format_bytes(report.read_bytes),
                format_bytes(report.file_bytes),
                report.read_scans,
                report.scans
            ),
        ),
        false => line("File", &format_bytes(report.file_bytes)),
    }
}

/// The error over every light element in the window of either transport, for all pixels.
fn transport_error(transport: &Transport, truth: &Truth) -> TransportError {
    let geometry = &transport.geometry;
    let window = geometry.window;
    let tiles = transport.tiles.par_iter().map(|tile| {
        let mut sum = TransportError::default();
        let functions = tile.functions(geometry, &transport.basis).tau;
        let functions = functions.chunks_exact(window.area());
        for (pixel, function) in tile.rect().pixels().zip(functions) {
            let n = geometry.camera.index(pixel);
            let origin = geometry.window_origin(pixel);
            let (true_origin, true_window) = (truth.window_origin(n), truth.window());
            for (s, tau) in truth.tau(n).iter().enumerate() {
                let slot = window.slot(origin, true_window.element(true_origin, s));
                let estimate = slot.map_or([0.0; CHANNELS], |s| function[s]);
                for c in 0..CHANNELS {
                    sum.add(tau[c].to_f64(), f64::from(estimate[c]));
                }
            }
            for s in 0..window.area() {
                let element = window.element(origin, s);
                if true_window.slot(true_origin, element).is_none() {
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

/// PSNR 10 log10(1 / mean squared error) over all pixels and channels.
fn relit_psnr(
    relighter: &mut CpuRelighter,
    light: &Light,
    truth: &[[f64; CHANNELS]],
) -> Option<Decibels> {
    relighter.relight(light, &AllCores);
    let picture = relighter.linear();
    let squares = picture.pixels.iter().zip(truth).flat_map(|(pixel, truth)| {
        (0..CHANNELS).map(move |c| (f64::from(pixel[c]) - truth[c]).powi(2))
    });
    let mse = squares.sum::<f64>() / (truth.len() * CHANNELS) as f64;
    (mse > 0.0).then(|| Decibels(-10.0 * mse.log10()))
}

/// Error of the predicted pictures of `shots`, by channel.
fn shot_errors(
    relighter: &mut CpuRelighter,
    folder: &CaptureFolder,
    dark: &DarkFrame,
    shots: &[usize],
) -> Result<[TransportError; CHANNELS]> {
    let mut errors = [TransportError::default(); CHANNELS];
    for &i in shots {
        let light = pattern_light(&relighter.transport().geometry, &folder.read_pattern(i)?)?;
        add_error(&mut errors, relighter, &light, folder.open_shot(i, dark)?)?;
    }
    Ok(errors)
}

/// SNR of the predicted flood photograph, if there is one.
fn flood_snr(
    relighter: &mut CpuRelighter,
    folder: &CaptureFolder,
    dark: &DarkFrame,
) -> Result<Option<Decibels>> {
    let Some(photo) = folder.open_flood(dark)? else {
        return Ok(None);
    };
    let light = BuiltinLight::Flood.render(relighter.transport().geometry.light);
    let mut errors = [TransportError::default(); CHANNELS];
    add_error(&mut errors, relighter, &light, photo)?;
    Ok(sum(&errors).snr())
}

/// The error over all channels.
fn sum(errors: &[TransportError; CHANNELS]) -> TransportError {
    let mut all = TransportError::default();
    errors.iter().for_each(|&e| all.merge(e));
    all
}

/// Adds the error of the picture predicted under `light`, without saturated samples.
fn add_error(
    errors: &mut [TransportError; CHANNELS],
    relighter: &mut CpuRelighter,
    light: &Light,
    mut reader: PhotoReader,
) -> Result<()> {
    relighter.relight(light, &AllCores);
    let picture = relighter.linear();
    let mut photo = LinearPhoto::new();
    reader.read(&RowSet::all(picture.extent.height), &mut photo)?;
    reader.finish()?;
    for (predicted, measured) in picture.pixels.iter().zip(&photo) {
        for c in 0..CHANNELS {
            if measured[c].is_finite() {
                errors[c].add(f64::from(measured[c]), f64::from(predicted[c]));
            }
        }
    }
    Ok(())
}

/// A pattern as a light.
fn pattern_light(geometry: &Geometry, pattern: &Pattern) -> Result<Light> {
    let values: Vec<f32> = (0..geometry.light.area())
        .flat_map(|m| [0, 1, 2].map(|c| pattern.plane(c)[m]))
        .collect();
    Ok(Light::from_linear_rgb(geometry.light, &values)?)
}
