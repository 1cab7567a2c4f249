//! `ltm-export recover`: a capture folder to an `.ltm` file.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use serde::Serialize;

use super::process::AllCores;
use super::{files, process, report};
use crate::capture::{CaptureFolder, Measurements};
use crate::format::{self, EncodedTile, Metadata};
use crate::recover::{self, Method, Recovery, Settings};
use crate::transport::{CHANNELS, DirectTile, Geometry, Window};

/// Every how many shots one is kept from recovery, for `evaluate` to hold against the result.
const HOLD_OUT_EVERY: usize = 10;

/// Percentage of saturated samples past which a wrong manifest is likelier than a few highlights.
const MUCH_SATURATED: f64 = 2.0;

/// Recover the light transport of an object from a folder of photographs
#[derive(Debug, Args)]
pub struct RecoverArgs {
    /// Capture folder: capture.json and the pictures it names
    capture: PathBuf,
    /// File to write
    #[arg(short, long, value_name = "FILE.ltm")]
    output: PathBuf,
    /// How each light transport function is recovered
    #[arg(long, value_enum, default_value_t = MethodName::Nnls)]
    method: MethodName,
    /// Side of the window of light elements each camera pixel may see; odd
    #[arg(long, value_name = "W", default_value = "15", value_parser = parse_window)]
    window: Window,
    /// Use the first K shots only [default: all but every tenth, which are held out]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    patterns: Option<u32>,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

fn parse_window(text: &str) -> Result<Window, String> {
    let side = text.parse::<u32>().map_err(|e| e.to_string())?;
    Window::new(side).map_err(|e| e.to_string())
}

/// Recovery methods by name.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum MethodName {
    /// Non-negative least squares
    Nnls,
}

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::Nnls => Self::Nnls,
        }
    }
}

#[derive(Serialize)]
struct Report {
    seconds: f64,
    peak_rss_bytes: Option<u64>,
    method: Method,
    window: u32,
    /// None: every tile is direct.
    rank: Option<u32>,
    patterns: usize,
    common_mode: crate::recover::CommonMode,
    saturated_samples: usize,
    /// Pixels of which nothing but white is known.
    overexposed_pixels: usize,
    file_bytes: u64,
}

pub fn run(args: &RecoverArgs) -> Result<()> {
    let start = Instant::now();
    let output = files::Output::create(&args.output, files::Kind::Ltm)?;
    let folder = CaptureFolder::open(&args.capture)?;
    let shots = choose_shots(folder.manifest().shots.len(), args.patterns)?;
    let measurements = read(&folder, &shots)?;
    let saturated = measurements.saturated();
    if saturated > 0 {
        let samples = shots.len() * measurements.camera.area() * CHANNELS;
        let percent = 100.0 * saturated as f64 / samples as f64;
        eprintln!("note: {saturated} saturated samples ({percent:.1} %) are left out");
        if percent > MUCH_SATURATED {
            eprintln!(
                "warning: that is much; check \"camera.white\" in the manifest, or photograph \
                 with less exposure"
            );
        }
    }
    let settings = Settings {
        method: args.method.into(),
        window: args.window,
    };
    let recovery = Recovery::prepare(&measurements, settings, &AllCores)
        .with_context(|| args.capture.display().to_string())?;
    let overexposed = match saturated {
        0 => 0,
        _ => measurements.overexposed_pixels(recover::FEWEST_PATTERNS),
    };
    if overexposed > 0 {
        eprintln!(
            "warning: {overexposed} pixels are saturated in nearly all photographs and will be \
             white under any light; photograph with less exposure"
        );
    }
    let geometry = *recovery.geometry();
    let bar = process::progress("recovering", geometry.tile_grid().area());
    let tiles = (0..geometry.tile_grid().area())
        .into_par_iter()
        .map(|i| {
            let tile = recovery.tile(&measurements, geometry.tile(i));
            let functions = tile.functions(&geometry, recovery.basis());
            let tile = DirectTile::quantise(&functions);
            let encoded = EncodedTile::new(&geometry, &tile);
            bar.inc(1);
            encoded
        })
        .collect::<Result<Vec<_>, _>>()?;
    bar.finish_and_clear();
    let file_bytes = write(output, settings.method, &geometry, shots.clone(), &tiles)?;
    let report = Report {
        seconds: start.elapsed().as_secs_f64(),
        peak_rss_bytes: process::peak_rss_bytes(),
        method: settings.method,
        window: args.window.side(),
        rank: None,
        patterns: shots.len(),
        common_mode: recovery.common_mode(),
        saturated_samples: saturated,
        overexposed_pixels: overexposed,
        file_bytes,
    };
    if args.json {
        return report::print_json(&report);
    }
    report::print_line(&format!(
        "{}: {} camera pixels, {} light elements, window {}, from {} patterns in {:.1} s, {}",
        args.output.display(),
        geometry.camera,
        geometry.light,
        report.window,
        report.patterns,
        report.seconds,
        report::bytes(file_bytes),
    ))
}

/// Which of `available` shots to recover from.
fn choose_shots(available: usize, first: Option<u32>) -> Result<Vec<usize>> {
    match first.map(|k| k as usize) {
        Some(k) if k > available => {
            bail!("--patterns is {k}, but the capture has {available} shots")
        }
        Some(k) => Ok((0..k).collect()),
        None => Ok((0..available)
            .filter(|l| l % HOLD_OUT_EVERY != HOLD_OUT_EVERY - 1)
            .collect()),
    }
}

/// Reads shots with the correspondence that goes with them.
pub(super) fn read(folder: &CaptureFolder, shots: &[usize]) -> Result<Measurements> {
    let dark = folder.read_dark()?;
    // Least squares has no use for it, but a capture that names a flood is not whole without it.
    folder.read_flood(&dark)?;
    let bar = process::progress("reading", shots.len());
    let exposed = shots
        .par_iter()
        .map(|&i| {
            let shot = folder.read_shot(i, &dark);
            bar.inc(1);
            shot
        })
        .collect::<Result<Vec<_>, _>>()?;
    bar.finish_and_clear();
    let correspondence = match folder.correspondence() {
        Some(given) => given,
        None => folder
            .read_gray_code(&dark)?
            .correspondence(folder.manifest().camera.extent())
            .with_context(|| folder.manifest_path().display().to_string())?,
    };
    Ok(folder.measurements(exposed, correspondence))
}

fn write(
    output: files::Output,
    method: Method,
    geometry: &Geometry,
    shots_used: Vec<usize>,
    tiles: &[EncodedTile],
) -> Result<u64> {
    let metadata = Metadata {
        writer: concat!("ltm-export ", env!("CARGO_PKG_VERSION")).to_owned(),
        method: method.name().to_owned(),
        shots_used,
    };
    output.finish(|out| Ok(format::write(geometry, &metadata, tiles, out)?))
}
