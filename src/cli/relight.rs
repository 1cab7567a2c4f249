//! `ltm-export relight`: a picture of the object under a light.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

use super::process::AllCores;
use super::{Usage, files, lights};
use crate::relight::cpu::CpuRelighter;
use crate::relight::{Light, OutputTransform, TorchPose, reference};

/// Relight an object and write the picture as an 8-bit sRGB PNG
#[derive(Debug, Args)]
pub struct RelightArgs {
    /// Relightable photograph
    #[arg(value_name = "FILE.ltm")]
    file: PathBuf,
    /// flood, torch, checkerboard, stripes, spectrum, fire, or an image file
    #[arg(long, value_name = "NAME|IMAGE")]
    light: String,
    /// Where a torch shines, as fractions of the picture from its top left corner [default: over
    /// the middle of the light]
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = parse_position)]
    at: Option<[f64; 2]>,
    /// The moment at which a fire is shown, in seconds [default: 0]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = parse_seconds)]
    time: Option<f64>,
    /// Factor on the picture's brightness
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true, value_parser = |text: &str| super::number_in(text, 0.0, 1e6))]
    exposure: f32,
    /// Only the file's first so many bytes, or hundredths, as a visitor sees it while it loads: 20K, 10%
    #[arg(long, value_name = "BYTES|PERCENT", value_parser = files::Share::parse)]
    first: Option<files::Share>,
    /// What computes the picture
    #[arg(long, value_enum, default_value_t = Backend::Cpu)]
    backend: Backend,
    /// PNG to write
    #[arg(short, long, value_name = "OUT.png")]
    output: PathBuf,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Backend {
    /// The fast path, in single precision
    Cpu,
    /// Double precision, term by term: what the others are tested against
    Reference,
}

fn parse_position(text: &str) -> Result<[f64; 2], String> {
    let parts: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse::<f64>())
        .collect::<Result<_, _>>()
        .map_err(|e| e.to_string())?;
    match parts[..] {
        [x, y] if [x, y].iter().all(|a| (0.0..=1.0).contains(a)) => Ok([x, y]),
        _ => Err("expected two numbers from 0 to 1, as in 0.5,0.25".to_owned()),
    }
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds.is_finite() => Ok(seconds),
        _ => Err("expected a number of seconds, as in 2.5".to_owned()),
    }
}

pub fn run(args: &RelightArgs) -> Result<()> {
    if args.at.is_some() && args.light != "torch" {
        return Err(Usage("--at goes with --light torch").into());
    }
    if args.time.is_some() && args.light != "fire" {
        return Err(Usage("--time goes with --light fire").into());
    }
    let output = files::Output::create(&args.output, files::Kind::Png)?;
    let file = files::read_ltm(&args.file, args.first)?;
    if args.first.is_some() {
        let scans = file.head.scans.len();
        eprintln!(
            "note: {} of {scans} scans are whole in these {} bytes",
            file.scans, file.bytes
        );
    }
    let geometry = &file.head.header.geometry;
    let light = match (args.at, args.time) {
        (Some([x, y]), _) => Light::torch(geometry.light, TorchPose::behind(geometry, x, y)),
        (None, Some(seconds)) => Light::fire(geometry.light, seconds),
        (None, None) => lights::named(&args.light, geometry.light)?,
    };
    let transform = OutputTransform::srgb(args.exposure);
    let picture = match args.backend {
        Backend::Cpu => {
            let mut relighter = CpuRelighter::new(Arc::new(file.transport));
            relighter.relight(&light, &AllCores);
            relighter.picture(&transform, &AllCores)
        }
        Backend::Reference => reference::picture(&file.transport, &light, &transform),
    };
    let rgb: Vec<u8> = picture
        .pixels
        .iter()
        .flat_map(|p| [p[0], p[1], p[2]])
        .collect();
    let extent = picture.extent;
    output.finish(|out| {
        PngEncoder::new(out)
            .write_image(&rgb, extent.width, extent.height, ExtendedColorType::Rgb8)
            .context("cannot be encoded")
    })?;
    Ok(())
}
