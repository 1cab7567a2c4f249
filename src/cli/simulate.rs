//! `ltm-export simulate`: photographs a built-in scene into a capture folder with its known transport.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use half::f16;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use npyz::WriterBuilder;
use rayon::prelude::*;

use super::report::format_bytes;
use super::{output_folder, progress};
use crate::capture::{
    AffineSpec, CameraSpec, GrayCodeShot, LightSpec, MANIFEST_NAME, Manifest, RELIT_FULL_SCALE,
    Shot,
};
use crate::simulate::{
    self, Camera, EmissionMatrix, GrayCodePattern, LightCodes, MONITOR_GAMMA, RandomStream,
    SceneKind, SimulatedScene, TruthLight,
};
use crate::transport::{CHANNELS, Extent, TileRect, TransportFunctions};

/// Camera rows whose transport is computed as one job.
const STRIP_ROWS: u32 = 4;
/// Range of the sides of the camera grid.
const CAMERA_SIDES: RangeInclusive<u32> = 8..=1024;
/// Range of the sides of the light plane.
const LIGHT_SIDES: RangeInclusive<u32> = 4..=512;
/// File names have four digits.
const MAX_PATTERNS: i64 = 10_000;
/// All pictures are in memory, as each strip of transport is computed once and exposes all of them.
const MAX_PICTURE_BYTES: usize = 3 << 30;
/// With more electrons photon noise is far below a code, and Poisson sampling loses precision.
const MAX_ELECTRONS: u64 = 1_000_000_000_000;

/// Photograph a built-in scene with known transport into a capture folder
#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// Scene
    #[arg(value_enum)]
    scene: SceneName,
    /// Capture folder to write; must be new or empty
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Camera pixels
    #[arg(long, value_name = "WxH", default_value = "128x128", value_parser = |text: &str| parse_extent(text, CAMERA_SIDES))]
    camera: Extent,
    /// Light elements
    #[arg(long, value_name = "WxH", default_value = "64x64", value_parser = |text: &str| parse_extent(text, LIGHT_SIDES))]
    light: Extent,
    /// Number of patterns
    #[arg(long, value_name = "N", default_value_t = 80,
          value_parser = clap::value_parser!(u32).range(1..=MAX_PATTERNS))]
    patterns: u32,
    /// Distribution of the patterns [default: gaussian for stained-glass, bernoulli for cookies]
    #[arg(long, value_enum)]
    ensemble: Option<EnsembleName>,
    /// Seed of patterns and noise; the same seed writes the same bytes
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Electrons at full scale; fewer mean more noise
    #[arg(long, value_name = "N", default_value_t = 40_000,
          value_parser = clap::value_parser!(u64).range(1..=MAX_ELECTRONS))]
    electrons: u64,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SceneName {
    /// A rose window lit from behind
    StainedGlass,
    /// Cookies on a tray under a tilted projector
    Cookies,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum EnsembleName {
    /// Clipped Gaussian around half brightness
    Gaussian,
    /// Each element on or off
    Bernoulli,
}

/// Parses `WxH` with both sides in the range `sides`.
fn parse_extent(text: &str, sides: RangeInclusive<u32>) -> Result<Extent, String> {
    let side = |s: &str| {
        let side = s.parse().ok().filter(|n| sides.contains(n));
        side.ok_or_else(|| {
            let (min, max) = (sides.start(), sides.end());
            format!("each side must be between {min} and {max}")
        })
    };
    let (width, height) = text
        .split_once('x')
        .ok_or("give it as WIDTHxHEIGHT, for instance 128x128")?;
    Ok(Extent::new(side(width)?, side(height)?))
}

pub fn run(args: &SimulateArgs) -> Result<()> {
    let plan = CapturePlan::new(args)?;
    let bytes = plan.lights.len() * args.camera.area() * size_of::<[f32; CHANNELS]>();
    ensure!(
        bytes <= MAX_PICTURE_BYTES,
        "{} photographs of {} need {} of memory; use a smaller --camera or fewer --patterns",
        plan.lights.len(),
        args.camera,
        format_bytes(bytes as u64),
    );
    output_folder::write_atomically(&args.output, |root| write(&plan, root))?;
    eprintln!(
        "{}: {} shots of {}, camera {}, light {}",
        args.output.display(),
        args.patterns,
        args.scene
            .to_possible_value()
            .map_or_else(String::new, |v| v.get_name().to_owned()),
        args.camera,
        args.light,
    );
    Ok(())
}

/// What to write of the object under one light.
enum Purpose {
    /// A photograph with noise, to this path.
    Photograph(String),
    /// The true picture under a truth light.
    Truth(TruthLight),
}

/// Everything to photograph.
struct CapturePlan {
    scene: Box<dyn SimulatedScene>,
    camera: Camera,
    seed: u64,
    manifest: Manifest,
    /// All lights.
    lights: Vec<LightCodes>,
    /// For each light, what to write.
    purposes: Vec<Purpose>,
}

impl CapturePlan {
    fn new(args: &SimulateArgs) -> Result<Self> {
        let kind = match args.scene {
            SceneName::StainedGlass => SceneKind::StainedGlass,
            SceneName::Cookies => SceneKind::Cookies,
        };
        let ensemble = args.ensemble.map_or(kind.ensemble(), |name| match name {
            EnsembleName::Gaussian => simulate::Ensemble::Gaussian,
            EnsembleName::Bernoulli => simulate::Ensemble::Bernoulli,
        });
        let camera = Camera {
            black: 512.0,
            white: 60_000.0,
            electrons: args.electrons as f64,
            read_noise: 8.0,
        };
        let scene = kind.build(args.camera, args.light)?;
        let mut plan = Self {
            manifest: Manifest {
                unknown: Vec::new(),
                version: 1,
                title: String::new(),
                creator: String::new(),
                rights: String::new(),
                light: LightSpec {
                    width: args.light.width,
                    height: args.light.height,
                    gamma: Some(MONITOR_GAMMA),
                    response: None,
                },
                camera: CameraSpec {
                    width: args.camera.width,
                    height: args.camera.height,
                    black: camera.black,
                    white: camera.white,
                },
                dark: Some("photos/dark.png".to_owned()),
                flood: Some("photos/flood.png".to_owned()),
                shots: Vec::new(),
                graycode: Vec::new(),
                correspondence: Some(AffineSpec {
                    affine: scene.geometry().correspondence.affine,
                }),
            },
            scene,
            camera,
            seed: args.seed,
            lights: Vec::new(),
            purposes: Vec::new(),
        };
        plan.add_calibration(args.light);
        for i in 0..args.patterns {
            let mut stream = RandomStream::Pattern(i).start(args.seed);
            let (pattern, photo) = (format!("patterns/{i:04}.png"), format!("photos/{i:04}.png"));
            let codes = ensemble.draw(args.light, &mut stream)?;
            plan.add_photograph(codes, photo.clone());
            plan.manifest.shots.push(Shot {
                pattern,
                photo,
                exposure: None,
            });
        }
        for light in TruthLight::ALL {
            plan.lights.push(light.codes(args.light));
            plan.purposes.push(Purpose::Truth(light));
        }
        Ok(plan)
    }

    /// Adds dark, flood and Gray code. They come first, so that the noise of a shot does not depend on the number of
    /// shots.
    fn add_calibration(&mut self, light: Extent) {
        self.add_photograph(LightCodes::uniform(light, 0), "photos/dark.png".to_owned());
        self.add_photograph(
            LightCodes::uniform(light, 255),
            "photos/flood.png".to_owned(),
        );
        for code in GrayCodePattern::all(light) {
            let sign = if code.inverted { 'n' } else { 'p' };
            let photo = format!("graycode/{}{}{sign}.png", code.axis(), code.bit);
            self.add_photograph(code.codes(light), photo.clone());
            self.manifest.graycode.push(GrayCodeShot {
                photo,
                axis: code.axis().to_owned(),
                bit: code.bit,
                inverted: code.inverted,
            });
        }
    }

    fn add_photograph(&mut self, codes: LightCodes, path: String) {
        self.lights.push(codes);
        self.purposes.push(Purpose::Photograph(path));
    }
}

/// Computes everything and writes it into the folder `root`.
fn write(plan: &CapturePlan, root: &Path) -> Result<()> {
    for folder in ["patterns", "photos", "graycode", "truth"] {
        std::fs::create_dir(root.join(folder)).context(folder)?;
    }
    let json = serde_json::to_string_pretty(&plan.manifest)?;
    std::fs::write(root.join(MANIFEST_NAME), json + "\n").context(MANIFEST_NAME)?;
    let light = plan.manifest.light.extent();
    let shot_lights = plan
        .lights
        .iter()
        .zip(&plan.purposes)
        .filter_map(|(codes, p)| match p {
            Purpose::Photograph(path) => Some((codes, path)),
            Purpose::Truth(_) => None,
        });
    for shot in &plan.manifest.shots {
        let mut lights = shot_lights.clone();
        if let Some((codes, _)) = lights.find(|(_, path)| **path == shot.photo) {
            write_codes(&root.join(&shot.pattern), light, codes)?;
        }
    }
    let pictures = write_transport(plan, &root.join("truth"))?;
    let bar = progress::bar("photographing", pictures.len());
    plan.purposes
        .par_iter()
        .zip(&pictures)
        .enumerate()
        .try_for_each(|(i, (purpose, picture))| -> Result<()> {
            let camera = plan.manifest.camera.extent();
            match purpose {
                Purpose::Photograph(path) => {
                    let mut noise = RandomStream::Photograph(i as u32).start(plan.seed);
                    let codes = plan.camera.photograph(picture, &mut noise)?;
                    write_rgb16(&root.join(path), camera, &codes)?;
                }
                Purpose::Truth(truth) => {
                    let named = |kind| root.join(format!("truth/{kind}_{}.png", truth.name()));
                    let code = |y: f32| (f64::from(y) * RELIT_FULL_SCALE).round() as u16;
                    let codes: Vec<_> = picture.iter().map(|y| y.map(code)).collect();
                    write_rgb16(&named("relit"), camera, &codes)?;
                    write_codes(&named("light"), light, &plan.lights[i])?;
                }
            }
            bar.inc(1);
            Ok(())
        })?;
    bar.finish_and_clear();
    Ok(())
}

/// Writes `tau.npy` and `uv.npy`, and returns the picture under each of the plan's lights.
fn write_transport(plan: &CapturePlan, truth: &Path) -> Result<Vec<Vec<[f32; CHANNELS]>>> {
    let geometry = plan.scene.geometry();
    let (camera, side) = (geometry.camera, u64::from(geometry.window.side()));
    let emissions = EmissionMatrix::new(geometry.light, &plan.lights);
    let mut pictures = vec![Vec::with_capacity(camera.area()); plan.lights.len()];
    let n = camera.area() as u64;
    let mut tau_file =
        create_npy::<f16>(&truth.join("tau.npy"), &[n, side, side, CHANNELS as u64])?;
    let strips: Vec<_> = (0..camera.height)
        .step_by(STRIP_ROWS as usize)
        .map(|y| TileRect {
            x: 0,
            y,
            extent: Extent::new(camera.width, STRIP_ROWS.min(camera.height - y)),
        })
        .collect();
    let bar = progress::bar("computing transport", strips.len());
    // A few strips for each thread bound the memory; they are written in order.
    for strips in strips.chunks(2 * rayon::current_num_threads()) {
        let computed: Vec<_> = strips
            .par_iter()
            .map(|&rect| {
                let mut functions = plan.scene.tile(rect);
                let rounded = round_to_f16(&mut functions);
                (rounded, emissions.pictures(geometry, &functions))
            })
            .collect();
        for (tau, exposed) in computed {
            tau_file
                .write_all(&tau)
                .context("truth/tau.npy cannot be written")?;
            for (picture, strip) in pictures.iter_mut().zip(exposed) {
                picture.extend(strip);
            }
            bar.inc(1);
        }
    }
    tau_file
        .flush()
        .context("truth/tau.npy cannot be written")?;
    bar.finish_and_clear();
    let mut uv_file = create_npy::<f32>(&truth.join("uv.npy"), &[n, 2])?;
    let whole = TileRect {
        x: 0,
        y: 0,
        extent: camera,
    };
    for pixel in whole.pixels() {
        let at = geometry.correspondence.at(pixel);
        for x in [at.u as f32, at.v as f32] {
            uv_file.write_all(&x.to_le_bytes())?;
        }
    }
    uv_file.flush().context("truth/uv.npy cannot be written")?;
    Ok(pictures)
}

/// Rounds τ to float16, the precision of `tau.npy`, so that the pictures follow exactly from the file. Returns its
/// bytes.
fn round_to_f16(functions: &mut TransportFunctions) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(functions.tau.len() * CHANNELS * size_of::<f16>());
    for value in functions.tau.iter_mut().flatten() {
        let rounded = f16::from_f32(*value);
        *value = rounded.to_f32();
        bytes.extend(rounded.to_le_bytes());
    }
    bytes
}

/// Creates a little-endian NumPy file and writes its header.
fn create_npy<T: npyz::AutoSerialize>(path: &Path, shape: &[u64]) -> Result<BufWriter<File>> {
    let start = || -> Result<BufWriter<File>> {
        let mut file = BufWriter::with_capacity(1 << 20, File::create(path)?);
        npyz::WriteOptions::new_header_only()
            .dtype(T::default_dtype())
            .shape(shape)
            .writer(&mut file)
            .write_header_only()?;
        Ok(file)
    };
    start().with_context(|| path.display().to_string())
}

fn write_rgb16(path: &Path, extent: Extent, codes: &[[u16; CHANNELS]]) -> Result<()> {
    // The encoder expects native-endian samples.
    write_png(
        path,
        extent,
        bytemuck::cast_slice(codes),
        ExtendedColorType::Rgb16,
    )
}

fn write_codes(path: &Path, extent: Extent, codes: &LightCodes) -> Result<()> {
    match codes {
        LightCodes::Grey(codes) => write_png(path, extent, codes, ExtendedColorType::L8),
        LightCodes::Rgb(codes) => {
            write_png(path, extent, codes.as_flattened(), ExtendedColorType::Rgb8)
        }
    }
}

fn write_png(path: &Path, extent: Extent, bytes: &[u8], kind: ExtendedColorType) -> Result<()> {
    let write = || -> Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        // Photographs are mostly noise, which no level compresses well.
        PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Sub)
            .write_image(bytes, extent.width, extent.height, kind)?;
        Ok(file.flush()?)
    };
    write().with_context(|| path.display().to_string())
}
