//! `ltm-export simulate`: a built-in scene, photographed into a capture folder.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use half::f16;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use npyz::WriterBuilder;
use rayon::prelude::*;

use super::{new_folder, process};
use crate::capture::{
    AffineSpec, CameraSpec, GrayCodeShot, LightSpec, MANIFEST_NAME, Manifest, RELIT_FULL_SCALE,
    Shot,
};
use crate::simulate::{
    self, Camera, EmissionMatrix, GrayCodePattern, LightCodes, MONITOR_GAMMA, RandomStream,
    SceneKind, SimulatedScene, TruthLight,
};
use crate::transport::{CHANNELS, Extent, TileRect, TransportFunctions};

/// Camera pixel rows whose transport is in memory at once, per thread.
const STRIP: u32 = 4;
/// Sides below which there is no picture, and above which no simulation is worth its time.
const CAMERA_SIDES: [u32; 2] = [8, 1024];
const LIGHT_SIDES: [u32; 2] = [4, 512];
/// Files are numbered with four digits.
const MOST_PATTERNS: i64 = 10_000;
/// All photographs are exposed while the transport passes by, so all are in memory.
const MOST_PICTURE_BYTES: usize = 3 << 30;
/// Beyond, shot noise is long below a code and Poisson sampling only loses precision.
const MOST_ELECTRONS: u64 = 1_000_000_000_000;

/// Photograph a built-in scene whose transport is known into a capture folder
#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// Scene
    #[arg(value_enum)]
    scene: SceneName,
    /// Capture folder to write; must be new or empty
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Camera pixels
    #[arg(long, value_name = "WxH", default_value = "128x128", value_parser = extent::<0>)]
    camera: Extent,
    /// Light elements
    #[arg(long, value_name = "WxH", default_value = "64x64", value_parser = extent::<1>)]
    light: Extent,
    /// Patterns to photograph
    #[arg(long, value_name = "N", default_value_t = 80,
          value_parser = clap::value_parser!(u32).range(1..=MOST_PATTERNS))]
    patterns: u32,
    /// Kind of patterns [default: gaussian for stained-glass, bernoulli for cookies]
    #[arg(long, value_enum)]
    ensemble: Option<EnsembleName>,
    /// Seed of patterns and noise: the same seed writes the same bytes
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Electrons at full scale; fewer are noisier
    #[arg(long, value_name = "N", default_value_t = 40_000,
          value_parser = clap::value_parser!(u64).range(1..=MOST_ELECTRONS))]
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

/// Parses `WxH`; `KIND` 0 is a camera, 1 a light.
fn extent<const KIND: usize>(text: &str) -> Result<Extent, String> {
    let [least, most] = [CAMERA_SIDES, LIGHT_SIDES][KIND];
    let side = |s: &str| {
        let side = s.parse().ok().filter(|n| (least..=most).contains(n));
        side.ok_or_else(|| format!("each side must lie between {least} and {most}"))
    };
    let (width, height) = text
        .split_once('x')
        .ok_or("give it as WIDTHxHEIGHT, for instance 128x128")?;
    Ok(Extent {
        width: side(width)?,
        height: side(height)?,
    })
}

pub fn run(args: &SimulateArgs) -> Result<()> {
    let plan = Plan::new(args)?;
    let bytes = plan.lights.len() * args.camera.area() * size_of::<[f32; CHANNELS]>();
    ensure!(
        bytes <= MOST_PICTURE_BYTES,
        "{} photographs of {} would need {} of memory: use a smaller --camera or fewer --patterns",
        plan.lights.len(),
        args.camera,
        indicatif::DecimalBytes(bytes as u64),
    );
    new_folder::write_folder_whole(&args.output, |root| write(&plan, root))?;
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

/// What is photographed under a light, and where it goes.
enum Purpose {
    /// A photograph with noise, at this path.
    Photograph(String),
    /// The true picture under a truth light.
    Truth(TruthLight),
}

/// A whole capture, decided on but not yet computed.
struct Plan {
    scene: Box<dyn SimulatedScene>,
    camera: Camera,
    seed: u64,
    manifest: Manifest,
    /// Every light, in step with `purposes`; patterns are the photographs' from `shots_from` on.
    lights: Vec<LightCodes>,
    purposes: Vec<Purpose>,
}

impl Plan {
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
            plan.photograph(codes, photo.clone());
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

    /// Dark, flood and Gray code. They come first, so that their noise and that of the first
    /// shots does not depend on how many shots there are.
    fn add_calibration(&mut self, light: Extent) {
        self.photograph(LightCodes::uniform(light, 0), "photos/dark.png".to_owned());
        self.photograph(
            LightCodes::uniform(light, 255),
            "photos/flood.png".to_owned(),
        );
        for code in GrayCodePattern::all(light) {
            let sign = if code.inverted { 'n' } else { 'p' };
            let photo = format!("graycode/{}{}{sign}.png", code.axis(), code.bit);
            self.photograph(code.codes(light), photo.clone());
            self.manifest.graycode.push(GrayCodeShot {
                photo,
                axis: code.axis().to_owned(),
                bit: code.bit,
                inverted: code.inverted,
            });
        }
    }

    fn photograph(&mut self, codes: LightCodes, path: String) {
        self.lights.push(codes);
        self.purposes.push(Purpose::Photograph(path));
    }
}

/// Computes everything and writes it into the folder `root`.
fn write(plan: &Plan, root: &Path) -> Result<()> {
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
        let mut of_shot = shot_lights.clone().filter(|(_, path)| **path == shot.photo);
        if let Some((codes, _)) = of_shot.next() {
            write_codes(&root.join(&shot.pattern), light, codes)?;
        }
    }
    let pictures = write_transport(plan, &root.join("truth"))?;
    let bar = process::progress("photographing", pictures.len());
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
fn write_transport(plan: &Plan, truth: &Path) -> Result<Vec<Vec<[f32; CHANNELS]>>> {
    let geometry = plan.scene.geometry();
    let (camera, side) = (geometry.camera, u64::from(geometry.window.side()));
    let emissions = EmissionMatrix::new(geometry.light, &plan.lights);
    let mut pictures = vec![Vec::with_capacity(camera.area()); plan.lights.len()];
    let n = camera.area() as u64;
    let mut tau_file = npy::<f16>(&truth.join("tau.npy"), &[n, side, side, CHANNELS as u64])?;
    let strips: Vec<_> = (0..camera.height)
        .step_by(STRIP as usize)
        .map(|y| TileRect {
            x: 0,
            y,
            extent: Extent {
                width: camera.width,
                height: STRIP.min(camera.height - y),
            },
        })
        .collect();
    let bar = process::progress("computing transport", strips.len());
    // A few strips for each thread at a time bounds memory; all are written in order.
    for strips in strips.chunks(2 * rayon::current_num_threads()) {
        let computed: Vec<_> = strips
            .par_iter()
            .map(|&rect| {
                let mut functions = plan.scene.tile(rect);
                let rounded = round_to_f16(&mut functions);
                (rounded, emissions.pictures(geometry, &functions))
            })
            .collect();
        for (tau, seen) in computed {
            tau_file
                .write_all(&tau)
                .context("truth/tau.npy cannot be written")?;
            for (picture, strip) in pictures.iter_mut().zip(seen) {
                picture.extend(strip);
            }
            bar.inc(1);
        }
    }
    tau_file
        .flush()
        .context("truth/tau.npy cannot be written")?;
    bar.finish_and_clear();
    let mut uv_file = npy::<f32>(&truth.join("uv.npy"), &[n, 2])?;
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

/// Rounds τ to what `tau.npy` can hold, so that the file is the truth about the pictures to the
/// bit, and returns its bytes.
fn round_to_f16(functions: &mut TransportFunctions) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(functions.tau.len() * CHANNELS * size_of::<f16>());
    for value in functions.tau.iter_mut().flatten() {
        let rounded = f16::from_f32(*value);
        *value = rounded.to_f32();
        bytes.extend(rounded.to_le_bytes());
    }
    bytes
}

/// Starts a little-endian NumPy file; the values are to follow.
fn npy<T: npyz::AutoSerialize>(path: &Path, shape: &[u64]) -> Result<BufWriter<File>> {
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
    // The encoder takes native-endian samples.
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
        // Photographs are mostly noise: compressing harder takes long and gains little.
        PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Sub)
            .write_image(bytes, extent.width, extent.height, kind)?;
        Ok(file.flush()?)
    };
    write().with_context(|| path.display().to_string())
}
