//! `ltm-export relight`: a picture of the object under a light, as a PNG.

mod level;
mod light_image;

use std::io::Write;
use std::num::{ParseFloatError, ParseIntError};
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};

use self::level::Level;
use self::light_image::load_light;
use super::ltm_file::{LIMITS, PrefixLength, open_ltm, read_ltm};
use super::output_file::{OutputFile, PNG};
use super::process_resources::AllCoresExecutor;
use super::value_parsers::{UsageError, parse_number};
use crate::format::FileIndex;
use crate::pyramid::PyramidReader;
use crate::relight::cpu::CpuRelighter;
use crate::relight::{Light, OutputTransform, Rgba8Picture, TorchSpot, reference};
use crate::transport::{ColorMatrix, Extent, TileRect, Transport, light_color_matrix};

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
    /// Level of a file of several: each has half the pixels of the one before
    #[arg(long, value_name = "K", default_value_t = 0)]
    level: u32,
    /// Pixels of the level to write: column and row of the first, width and height [default: all]
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_region)]
    region: Option<TileRect>,
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

fn parse_region(text: &str) -> Result<TileRect, String> {
    let parts: Result<Vec<u32>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match parts.map_err(|e: ParseIntError| e.to_string())?[..] {
        [x, y, width, height] if width > 0 && height > 0 => {
            let extent = Extent { width, height };
            Ok(TileRect { x, y, extent })
        }
        _ => Err("expected four whole numbers, as in 0,0,800,600".to_owned()),
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
    let (file, index) = open_ltm(&args.file)?;
    let name = || args.file.display().to_string();
    if let Some(reader) = PyramidReader::new(index, LIMITS).with_context(name)? {
        if args.first.is_some() {
            return Err(UsageError("--first goes with files of one level").into());
        }
        let level = Level::new(args, file, reader)?;
        output.finish_from_input(|out| level.write(args, out))?;
        return Ok(());
    }
    ensure!(
        args.level == 0,
        "{}: has one level; leave out --level {}",
        name(),
        args.level
    );
    let file = read_ltm(&args.file, args.first)?;
    if args.first.is_some() {
        let (bytes, complete) = (file.progress.bytes, file.progress.scans);
        let scans = file.index.scans.len();
        eprintln!("note: {complete} of {scans} scans are complete in these {bytes} bytes");
    }
    let geometry = &file.index.header.geometry;
    let region = args.region_in(geometry.camera)?;
    let colors = Colors::new(args, &file.index)?;
    let light = colors.convert(match args.at {
        Some([x, y]) => Light::torch(geometry.light, TorchSpot::behind(geometry, x, y)),
        None => args.light_on(geometry.light)?,
    });
    let picture = args.backend.picture(file.transport, &light, &colors);
    output.finish(|out| write_png(out, region.extent, |rows| rows(&picture, region)))?;
    Ok(())
}

impl RelightArgs {
    /// The light, but a torch that was placed, on a light plane.
    fn light_on(&self, plane: Extent) -> Result<Light> {
        match self.time {
            Some(seconds) => Ok(Light::fire(plane, seconds)),
            None => load_light(&self.light, plane),
        }
    }

    /// The pixels to write of a picture.
    fn region_in(&self, camera: Extent) -> Result<TileRect> {
        let Some(region) = self.region else {
            let (x, y, extent) = (0, 0, camera);
            return Ok(TileRect { x, y, extent });
        };
        let TileRect { x, y, extent } = region;
        ensure!(
            region.is_within(camera),
            "{}: level {} has {camera} pixels; --region {x},{y},{},{} is not within them",
            self.file.display(),
            self.level,
            extent.width,
            extent.height
        );
        Ok(region)
    }
}

/// How lights and pictures of a file are coloured.
struct Colors {
    transform: OutputTransform,
    /// Converts lights.
    light_matrix: Option<ColorMatrix>,
}

impl Colors {
    fn new(args: &RelightArgs, index: &FileIndex) -> Result<Self> {
        let mut transform = OutputTransform::srgb(args.exposure);
        let color_matrix = index.metadata.read()?.color_matrix;
        if let Some(color_matrix) = &color_matrix {
            transform = transform.with_color_matrix(color_matrix);
        }
        Ok(Self {
            transform,
            light_matrix: color_matrix.as_ref().and_then(light_color_matrix),
        })
    }

    fn convert(&self, light: Light) -> Light {
        match &self.light_matrix {
            Some(matrix) => light.converted(matrix),
            None => light,
        }
    }
}

impl RelightImplementation {
    fn picture(self, transport: Transport, light: &Light, colors: &Colors) -> Rgba8Picture {
        let transform = &colors.transform;
        match self {
            Self::Cpu => {
                let mut relighter = CpuRelighter::new(Arc::new(transport));
                relighter.relight(light, &AllCoresExecutor);
                relighter.picture(transform, &AllCoresExecutor)
            }
            Self::Reference => reference::picture(&transport, light, transform),
        }
    }
}

/// Writes a PNG, whose rows `draw` gives from top to bottom: parts of pictures.
fn write_png(
    out: &mut impl Write,
    extent: Extent,
    draw: impl FnOnce(&mut dyn FnMut(&Rgba8Picture, TileRect) -> Result<()>) -> Result<()>,
) -> Result<()> {
    const FAILED: &str = "cannot be encoded";
    let mut encoder = png::Encoder::new(out, extent.width, extent.height);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().context(FAILED)?;
    let mut stream = writer.stream_writer().context(FAILED)?;
    let mut row = Vec::with_capacity(3 * extent.width as usize);
    draw(&mut |picture, part| {
        for y in part.y..part.y + part.extent.height {
            let start = y as usize * picture.extent.width as usize + part.x as usize;
            let pixels = &picture.pixels[start..start + part.extent.width as usize];
            row.clear();
            row.extend(pixels.iter().flat_map(|&[r, g, b, _]| [r, g, b]));
            stream.write_all(&row).context(FAILED)?;
        }
        Ok(())
    })?;
    stream.finish().context(FAILED)
}
