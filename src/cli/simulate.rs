//! `ltm-export simulate`: photographs a built-in scene into a capture folder with its known transport.

use std::fs::File;
use std::io::BufWriter;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};
use half::f16;
use image::ExtendedColorType;
use npyz::{NpyWriter, WriterBuilder};
use rayon::prelude::*;

use super::capture_writer::{MAX_ELECTRONS, write_png};
use super::report::format_bytes;
use super::value_parsers::{UsageError, parse_extent, parse_number};
use super::{output_folder, progress};
use crate::capture::{
    MANIFEST_NAME, Manifest, ManifestCamera, ManifestLight, RELIT_FULL_SCALE, Shot,
};
use crate::simulate::{
    Camera, CameraView, EmissionMatrix, GrayCodePattern, MONITOR_GAMMA, PatternEnsemble,
    PatternImage, RandomStreamId, SceneKind, SimulatedScene, truth_lights,
};
use crate::transport::{CHANNELS, CameraPixel, Extent, TileRect, TileTransportFunctions};

/// Camera rows whose transport is computed as one job.
const STRIP_ROWS: u32 = 4;
const CAMERA_SIDES: RangeInclusive<u32> = 8..=1024;
const LIGHT_SIDES: RangeInclusive<u32> = 4..=512;
/// File names have four digits.
const MAX_PATTERNS: i64 = 10_000;
/// All pictures are in memory, as each strip of transport is computed once and exposes all of them.
const MAX_PICTURE_BYTES: usize = 3 << 30;
const TAU_ERROR: &str = "truth/tau.npy cannot be written";

/// Photograph a built-in scene with known transport into a capture folder
#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// Scene
    #[arg(value_enum)]
    scene: SceneKind,
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
    ensemble: Option<PatternEnsemble>,
    /// Seed of patterns and noise; the same seed writes the same bytes
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Electrons at full scale; fewer mean more noise
    #[arg(long, value_name = "N", default_value_t = 40_000,
          value_parser = clap::value_parser!(u64).range(1..=MAX_ELECTRONS))]
    electrons: u64,
    /// Radial distortion of the lens at the picture's corners, in percent; of stained-glass
    #[arg(long, value_name = "PERCENT", default_value_t = 0.0, allow_negative_numbers = true,
          value_parser = |text: &str| parse_number(text, -20.0, 20.0))]
    distortion: f32,
    /// Angle at which the camera looks aslant, in degrees; of stained-glass
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true,
          value_parser = |text: &str| parse_number(text, -30.0, 30.0))]
    tilt: f32,
}

impl SimulateArgs {
    fn build_scene(&self) -> Result<Box<dyn SimulatedScene>> {
        let view = CameraView {
            distortion: f64::from(self.distortion) / 100.0,
            tilt: f64::from(self.tilt),
        };
        if view == CameraView::default() {
            return Ok(self.scene.build(self.camera, self.light)?);
        }
        if self.scene != SceneKind::StainedGlass {
            bail!(UsageError("--distortion and --tilt go with stained-glass"));
        }
        Ok(SceneKind::build_stained_glass(
            self.camera,
            self.light,
            view,
        )?)
    }
}

pub fn run(args: &SimulateArgs) -> Result<()> {
    let plan = SimulationPlan::new(args)?;
    let (photographs, camera) = (plan.lights.len(), args.camera);
    let bytes = photographs * camera.area() * size_of::<[f32; CHANNELS]>();
    ensure!(
        bytes <= MAX_PICTURE_BYTES,
        "{photographs} photographs of {camera} need {} of memory; use a smaller --camera or fewer \
         --patterns",
        format_bytes(bytes as u64),
    );
    output_folder::write_atomically(&args.output, |root| write(&plan, root))?;
    let scene = args.scene.to_possible_value();
    eprintln!(
        "{}: {} shots of {}, camera {camera}, light {}",
        args.output.display(),
        args.patterns,
        scene.as_ref().map_or("", |value| value.get_name()),
        args.light,
    );
    Ok(())
}

struct SimulationPlan<'a> {
    args: &'a SimulateArgs,
    scene: Box<dyn SimulatedScene>,
    manifest: Manifest,
    lights: Vec<PatternImage>,
    /// One for each light.
    pictures: Vec<SimulatedPictureFiles>,
}

/// The files to write of the object under one light.
struct SimulatedPictureFiles {
    /// The true picture under a truth light, or else a photograph with noise.
    picture: String,
    is_true: bool,
    /// The codes of a pattern or truth light.
    codes: Option<String>,
}

impl<'a> SimulationPlan<'a> {
    fn new(args: &'a SimulateArgs) -> Result<Self> {
        let scene = args.build_scene()?;
        let mut plan = Self {
            args,
            manifest: Manifest {
                version: 1,
                light: ManifestLight {
                    width: args.light.width,
                    height: args.light.height,
                    gamma: Some(MONITOR_GAMMA),
                    ..ManifestLight::default()
                },
                camera: ManifestCamera {
                    width: args.camera.width,
                    height: args.camera.height,
                    black: Camera::BLACK,
                    white: Camera::WHITE,
                    ..ManifestCamera::default()
                },
                dark: Some("photos/dark.png".to_owned()),
                flood: Some("photos/flood.png".to_owned()),
                correspondence: Some(scene.geometry().correspondence.clone()),
                ..Manifest::default()
            },
            scene,
            lights: Vec::new(),
            pictures: Vec::new(),
        };
        // Calibration first, so that the noise of a shot does not depend on the number of shots.
        for (name, code) in [("dark", 0), ("flood", 255)] {
            let codes = PatternImage::uniform(args.light, code);
            plan.photograph(codes, format!("photos/{name}.png"), None);
        }
        for code in GrayCodePattern::all(args.light) {
            let shot = code.shot();
            plan.photograph(code.codes(args.light), shot.photo.clone(), None);
            plan.manifest.graycode.push(shot);
        }
        let ensemble = args.ensemble.unwrap_or(args.scene.ensemble());
        for i in 0..args.patterns {
            let mut stream = RandomStreamId::Pattern(i).start(args.seed);
            let codes = ensemble.draw(args.light, &mut stream);
            let (pattern, photo) = (format!("patterns/{i:04}.png"), format!("photos/{i:04}.png"));
            plan.photograph(codes, photo.clone(), Some(pattern.clone()));
            plan.manifest.shots.push(Shot {
                pattern,
                photo,
                exposure: None,
            });
        }
        for (name, codes) in truth_lights(args.light) {
            plan.lights.push(codes);
            plan.pictures.push(SimulatedPictureFiles {
                picture: format!("truth/relit_{name}.png"),
                is_true: true,
                codes: Some(format!("truth/light_{name}.png")),
            });
        }
        Ok(plan)
    }

    fn photograph(&mut self, light: PatternImage, picture: String, codes: Option<String>) {
        self.lights.push(light);
        self.pictures.push(SimulatedPictureFiles {
            picture,
            is_true: false,
            codes,
        });
    }
}

/// Computes everything and writes it into the folder `root`.
fn write(plan: &SimulationPlan, root: &Path) -> Result<()> {
    for folder in ["patterns", "photos", "graycode", "truth"] {
        std::fs::create_dir(root.join(folder)).context(folder)?;
    }
    let json = serde_json::to_string_pretty(&plan.manifest)?;
    std::fs::write(root.join(MANIFEST_NAME), json + "\n").context(MANIFEST_NAME)?;
    let (camera, light) = (plan.args.camera, plan.args.light);
    let sensor = Camera {
        electrons: plan.args.electrons as f64,
    };
    let pictures = write_transport(plan, &root.join("truth"))?;
    let bar = progress::bar("photographing", pictures.len());
    let write_picture = |i: usize| -> Result<()> {
        let (picture, files) = (&pictures[i], &plan.pictures[i]);
        let samples: Vec<_> = if files.is_true {
            let code = |y: f32| (f64::from(y) * RELIT_FULL_SCALE).round() as u16;
            picture.iter().map(|y| y.map(code)).collect()
        } else {
            let mut noise = RandomStreamId::Photograph(i as u32).start(plan.args.seed);
            sensor.photograph(picture, &mut noise)
        };
        // The encoder expects native-endian samples.
        let (path, bytes) = (root.join(&files.picture), bytemuck::cast_slice(&samples));
        write_png(&path, camera, bytes, ExtendedColorType::Rgb16)?;
        if let Some(path) = &files.codes {
            let (bytes, color) = match &plan.lights[i] {
                PatternImage::Grey(codes) => (&codes[..], ExtendedColorType::L8),
                PatternImage::Rgb(codes) => (codes.as_flattened(), ExtendedColorType::Rgb8),
            };
            write_png(&root.join(path), light, bytes, color)?;
        }
        bar.inc(1);
        Ok(())
    };
    (0..pictures.len())
        .into_par_iter()
        .try_for_each(write_picture)
}

/// Writes `tau.npy` and `uv.npy`, and returns the picture under each of the plan's lights.
fn write_transport(plan: &SimulationPlan, truth: &Path) -> Result<Vec<Vec<[f32; CHANNELS]>>> {
    let geometry = plan.scene.geometry();
    let (camera, side) = (geometry.camera, u64::from(geometry.window.side()));
    let emissions = EmissionMatrix::new(geometry.light, &plan.lights);
    let mut pictures = vec![Vec::with_capacity(camera.area()); plan.lights.len()];
    let n = camera.area() as u64;
    let tau_shape = [n, side, side, CHANNELS as u64];
    let mut tau_file = create_npy::<f16>(&truth.join("tau.npy"), &tau_shape)?;
    let strip = |y| TileRect {
        x: 0,
        y,
        extent: Extent::new(camera.width, STRIP_ROWS.min(camera.height - y)),
    };
    let strips: Vec<_> = (0..camera.height)
        .step_by(STRIP_ROWS as usize)
        .map(strip)
        .collect();
    let bar = progress::bar("computing transport", strips.len());
    // A few strips for each thread bound the memory; they are written in order.
    for strips in strips.chunks(2 * rayon::current_num_threads()) {
        let computed = strips.par_iter().map(|&rect| {
            let mut functions = plan.scene.tile(rect);
            let rounded = round_to_f16(&mut functions);
            (rounded, emissions.pictures(geometry, &functions))
        });
        for (tau, exposed) in computed.collect::<Vec<_>>() {
            tau_file.extend(tau).context(TAU_ERROR)?;
            for (picture, strip) in pictures.iter_mut().zip(exposed) {
                picture.extend(strip);
            }
            bar.inc(1);
        }
    }
    tau_file.finish().context(TAU_ERROR)?;
    let mut uv_file = create_npy::<f32>(&truth.join("uv.npy"), &[n, 2])?;
    let written = uv_file.extend(camera.cells().flat_map(|(x, y)| {
        let at = geometry.correspondence.at(CameraPixel { x, y });
        [at.u as f32, at.v as f32]
    }));
    written
        .and_then(|()| uv_file.finish())
        .context("truth/uv.npy cannot be written")?;
    Ok(pictures)
}

/// Rounds τ to float16, the precision of `tau.npy`, so that the pictures follow exactly from the file. Returns the
/// rounded values.
fn round_to_f16(functions: &mut TileTransportFunctions) -> Vec<f16> {
    let round = |value: &mut f32| {
        let rounded = f16::from_f32(*value);
        *value = rounded.to_f32();
        rounded
    };
    functions.tau.iter_mut().flatten().map(round).collect()
}

fn create_npy<T: npyz::AutoSerialize>(
    path: &Path,
    shape: &[u64],
) -> Result<NpyWriter<T, BufWriter<File>>> {
    let create = || {
        let file = BufWriter::with_capacity(1 << 20, File::create(path)?);
        let options = npyz::WriteOptions::new().default_dtype().shape(shape);
        options.writer(file).begin_nd()
    };
    create().with_context(|| path.display().to_string())
}
