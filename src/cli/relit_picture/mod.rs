//! A picture of the object under a light, for the commands that write pictures. Of a file of several levels, which may be larger
//! than memory, it is drawn one row of shards at a time.

mod level;
mod light_image;

use std::num::ParseFloatError;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};

use self::level::Level;
use self::light_image::LightSource;
use super::ltm_file::{LIMITS, LtmFile, PrefixLength, open_ltm, read_ltm};
use super::output_file::InputError;
use super::process_resources::AllCoresExecutor;
use super::value_parsers::{UsageError, parse_number};
use crate::format::FileIndex;
use crate::pyramid::PyramidReader;
use crate::relight::cpu::LinearRelighter;
use crate::relight::{Light, OutputTransform, Rgba8Picture, TorchSpot, reference};
use crate::transport::{ColorMatrix, Extent, LightRegion, TileRect, Transport, light_color_matrix};

/// A file, and the light to show it under.
#[derive(Debug, Args)]
pub struct PictureArgs {
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
    /// Level of a file of several: each has half the pixels of the one before
    #[arg(long, value_name = "K", default_value_t = 0)]
    level: u32,
    /// Implementation that computes the picture
    #[arg(long, value_enum, default_value_t = RelightImplementation::Cpu)]
    backend: RelightImplementation,
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

impl PictureArgs {
    /// Refuses options that do not go with the light.
    pub fn check(&self) -> Result<(), UsageError> {
        if self.at.is_some() && self.light != "torch" {
            return Err(UsageError("--at goes with --light torch"));
        }
        match self.time.is_some() && self.light != "fire" {
            true => Err(UsageError("--time goes with --light fire")),
            false => Ok(()),
        }
    }

    /// The light, but a torch that was placed, on a part of a light plane. `source` is that of the light.
    fn light_on(&self, source: &LightSource, region: LightRegion) -> Result<Light> {
        match self.time {
            Some(seconds) => Ok(Light::fire(region, seconds)),
            None => source.on(region),
        }
    }
}

/// The part of a file to show.
#[derive(Clone, Copy, Debug, Default)]
pub struct PicturePart {
    /// Pixels; all if left out.
    pub region: Option<TileRect>,
    /// Of a file of one level.
    pub first: Option<PrefixLength>,
}

impl PicturePart {
    /// The pixels of the level of `args`, which has `camera`.
    fn region_in(&self, args: &PictureArgs, camera: Extent) -> Result<TileRect> {
        let Some(region) = self.region else {
            let (x, y, extent) = (0, 0, camera);
            return Ok(TileRect { x, y, extent });
        };
        let TileRect { x, y, extent } = region;
        ensure!(
            region.is_within(camera),
            "{}: level {} has {camera} pixels; --region {x},{y},{},{} is not within them",
            args.file.display(),
            args.level,
            extent.width,
            extent.height
        );
        Ok(region)
    }
}

/// A picture that is about to be drawn.
pub struct RelitPicture<'a> {
    args: &'a PictureArgs,
    source: Source<'a>,
    region: TileRect,
}

enum Source<'a> {
    Whole(Box<LtmFile>),
    Level(Box<Level<'a>>),
}

impl<'a> RelitPicture<'a> {
    /// Opens the file of `args`.
    pub fn open(args: &'a PictureArgs, part: &PicturePart) -> Result<Self> {
        let (file, index) = open_ltm(&args.file)?;
        let name = || args.file.display().to_string();
        if let Some(reader) = PyramidReader::new(index, LIMITS).with_context(name)? {
            if part.first.is_some() {
                return Err(UsageError("--first goes with files of one level").into());
            }
            let level = Level::new(args, file, reader)?;
            return Ok(Self {
                args,
                region: part.region_in(args, level.camera())?,
                source: Source::Level(Box::new(level)),
            });
        }
        ensure!(
            args.level == 0,
            "{}: has one level; leave out --level {}",
            name(),
            args.level
        );
        let file = read_ltm(&args.file, part.first)?;
        if part.first.is_some() {
            let (bytes, complete) = (file.progress.bytes, file.progress.scans);
            let scans = file.index.scans.len();
            eprintln!("note: {complete} of {scans} scans are complete in these {bytes} bytes");
        }
        Ok(Self {
            args,
            region: part.region_in(args, file.index.header.geometry.camera)?,
            source: Source::Whole(Box::new(file)),
        })
    }

    /// Width and height.
    pub fn extent(&self) -> Extent {
        self.region.extent
    }

    /// Draws the picture: calls `row` with each row of pixels from top to bottom. Errors of the file are [`InputError`]s.
    pub fn draw(self, row: &mut dyn FnMut(&[[u8; 4]]) -> Result<()>) -> Result<()> {
        let Self {
            args,
            source,
            region,
        } = self;
        match source {
            Source::Level(level) => level.draw(region, row),
            Source::Whole(file) => {
                let (picture, region) = (relight(args, *file).map_err(InputError)?, region);
                (region.y..region.y + region.extent.height).try_for_each(|y| {
                    let start = y as usize * picture.extent.width as usize + region.x as usize;
                    row(&picture.pixels[start..start + region.extent.width as usize])
                })
            }
        }
    }
}

/// The whole picture of a file of one level.
fn relight(args: &PictureArgs, file: LtmFile) -> Result<Rgba8Picture> {
    let geometry = &file.index.header.geometry;
    let colors = Colors::new(args, &file.index)?;
    let light = colors.convert(match args.at {
        Some([x, y]) => Light::torch(geometry.light, TorchSpot::behind(geometry, x, y)),
        None => args.light_on(&LightSource::load(&args.light)?, geometry.light.into())?,
    });
    Ok(args.backend.picture(file.transport, &light, &colors))
}

/// How lights and pictures of a file are coloured.
struct Colors {
    transform: OutputTransform,
    /// Converts lights.
    light_matrix: Option<ColorMatrix>,
}

impl Colors {
    fn new(args: &PictureArgs, index: &FileIndex) -> Result<Self> {
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
                let mut relighter = LinearRelighter::new(Arc::new(transport));
                relighter.relight(light, &AllCoresExecutor);
                relighter.picture(transform, &AllCoresExecutor)
            }
            Self::Reference => reference::picture(&transport, light, transform),
        }
    }
}
