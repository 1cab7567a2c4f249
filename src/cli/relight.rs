//! `ltm-export relight`: a picture of the object under a light, as a PNG.

use std::num::ParseFloatError;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageReader};

use super::ltm_file::{PrefixLength, read_ltm};
use super::output_file::{OutputFile, PNG};
use super::process_resources::AllCoresExecutor;
use super::value_parsers::{UsageError, parse_number};
use crate::relight::cpu::CpuRelighter;
use crate::relight::{
    BuiltinLight, Light, OutputTransform, TorchSpot, area_resample, reference, srgb,
};
use crate::transport::{Extent, light_color_matrix};

/// Relight an object and write the picture as an 8-bit sRGB PNG
#[derive(Debug, Args)]
pub struct RelightArgs {
    /// Relightable photograph
    #[arg(value_name = "FILE.ltm")]
    file: PathBuf,
    /// flood, torch, checkerboard, stripes, spectrum, fire, or an image file
    #[arg(long, value_name = "NAME|IMAGE")]
    light: String,
    /// Position of the torch, as fractions of the picture from its top left corner [default: over the middle of the
    /// light plane]
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = parse_position)]
    at: Option<[f64; 2]>,
    /// Time at which the fire is shown, in seconds [default: 0]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = parse_seconds)]
    time: Option<f64>,
    /// Brightness factor
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true, value_parser = |text: &str| parse_number(text, 0.0, 1e6))]
    exposure: f32,
    /// Use only the first part of the file, as a page does while it loads: 20K, 10%
    #[arg(long, value_name = "BYTES|PERCENT", value_parser = PrefixLength::parse)]
    first: Option<PrefixLength>,
    /// Implementation that computes the picture
    #[arg(long, value_enum, default_value_t = RelightImplementation::Cpu)]
    backend: RelightImplementation,
    /// PNG to write
    #[arg(short, long, value_name = "OUT.png")]
    output: PathBuf,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum RelightImplementation {
    /// Single precision, fast
    Cpu,
    /// Double precision, by the definition; slow
    Reference,
}

fn parse_position(text: &str) -> Result<[f64; 2], String> {
    let parts: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match parts.map_err(|e: ParseFloatError| e.to_string())?[..] {
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
        return Err(UsageError("--at goes with --light torch").into());
    }
    if args.time.is_some() && args.light != "fire" {
        return Err(UsageError("--time goes with --light fire").into());
    }
    let output = OutputFile::create(&args.output, &PNG)?;
    let file = read_ltm(&args.file, args.first)?;
    if args.first.is_some() {
        let (bytes, complete) = (file.progress.bytes, file.progress.scans);
        let scans = file.index.scans.len();
        eprintln!("note: {complete} of {scans} scans are complete in these {bytes} bytes");
    }
    let geometry = &file.index.header.geometry;
    let mut light = match (args.at, args.time) {
        (Some([x, y]), _) => Light::torch(geometry.light, TorchSpot::behind(geometry, x, y)),
        (None, Some(seconds)) => Light::fire(geometry.light, seconds),
        (None, None) => load_light(&args.light, geometry.light)?,
    };
    let mut transform = OutputTransform::srgb(args.exposure);
    if let Some(color_matrix) = file.index.metadata.read()?.color_matrix {
        transform = transform.with_color_matrix(&color_matrix);
        if let Some(matrix) = light_color_matrix(&color_matrix) {
            light = light.converted(&matrix);
        }
    }
    let picture = match args.backend {
        RelightImplementation::Cpu => {
            let mut relighter = CpuRelighter::new(Arc::new(file.transport));
            relighter.relight(&light, &AllCoresExecutor);
            relighter.picture(&transform, &AllCoresExecutor)
        }
        RelightImplementation::Reference => reference::picture(&file.transport, &light, &transform),
    };
    let rgba = picture.pixels.iter();
    let rgb: Vec<u8> = rgba.flat_map(|p| [p[0], p[1], p[2]]).collect();
    let extent = picture.extent;
    output.finish(|out| {
        PngEncoder::new(out)
            .write_image(&rgb, extent.width, extent.height, ExtendedColorType::Rgb8)
            .context("cannot be encoded")
    })?;
    Ok(())
}

/// The built-in light of this name, or the image file at this path, decoded as sRGB, dimmed by its transparency, and
/// resampled to the light plane.
fn load_light(light: &str, plane: Extent) -> Result<Light> {
    if let Some(builtin) = BuiltinLight::from_name(light) {
        return Ok(builtin.render(plane));
    }
    let path = Path::new(light);
    if !path.exists() {
        let names = BuiltinLight::BY_NAME.map(|(name, _)| name).join(", ");
        bail!("--light {light}: neither a file nor one of {names}");
    }
    let read = || ImageReader::open(path)?.with_guessed_format()?.decode();
    let picture = read()
        .with_context(|| format!("--light {light}: is not a readable image"))?
        .into_rgba32f();
    let extent = Extent::new(picture.width(), picture.height());
    let linear = |image::Rgba([rgb @ .., alpha]): &image::Rgba<f32>| -> [f32; 3] {
        rgb.map(|code| srgb::srgb_decode(f64::from(code)) as f32 * alpha)
    };
    let linear: Vec<f32> = picture.pixels().flat_map(linear).collect();
    let resampled = area_resample(&linear, extent, plane);
    Ok(Light::from_linear_rgb(plane, &resampled)?)
}
