//! `ltm-export photograph`: photographs a capture's known transport again, with faults.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::assemble::read_sequence;
use super::capture_writer::{MAX_ELECTRONS, write_png};
use super::output_file::{OutputFile, PHOTOGRAPH};
use super::shoot::Exposure;
use super::{output_folder, progress};
use crate::acquisition::{DisplayLayout, PatternSequence, PictureRole, SEQUENCE_NAME};
use crate::capture::{
    CaptureFolder, GroundTruth, LinearPhoto, MANIFEST_NAME, Manifest, ManifestCamera, Pattern, Shot,
};
use crate::simulate::{
    Camera, GrayCodePattern, PatternImage, RandomStreamId, SessionFault, emission,
};
use crate::transport::{CHANNELS, Extent};

/// Exposure time in seconds with which a photograph has the measurements of the transport.
const REFERENCE_EXPOSURE: f64 = 1.0 / 15.0;

/// Photograph the known transport of a capture again, with faults of rigs
#[derive(Debug, Args)]
pub struct PhotographArgs {
    /// Capture folder with truth/
    #[arg(value_name = "CAPTURE")]
    capture: PathBuf,
    /// Capture folder to write; must be new or empty
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Photograph the pictures of this folder, which `ltm-export patterns` wrote, in their order, instead of the capture's own
    /// patterns; the output is a folder of numbered photographs
    #[arg(long, value_name = "DIR")]
    sequence: Option<PathBuf>,
    /// Photograph only this one: a file with the pixels of the display, for instance a screenshot. The output is a PNG. Stands in for a
    /// camera: `ltm-export shoot --camera 'ltm-export photograph ... --picture {picture} -o {file} --seed {photograph}'`
    #[arg(long, value_name = "FILE", requires = "sequence")]
    picture: Option<PathBuf>,
    /// Exposure time of that photograph in seconds, or a fraction of them
    #[arg(long, value_name = "TIME", requires = "picture", default_value = "1/15", value_parser = Exposure::parse)]
    exposure: Exposure,
    #[arg(long = "fault", value_name = "NAME[=SIZE]", help = fault_help())]
    faults: Vec<SessionFault>,
    /// Seed of noise and faults
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Electrons at full scale; fewer mean more noise
    #[arg(long, value_name = "N", default_value_t = 40_000,
          value_parser = clap::value_parser!(u64).range(1..=MAX_ELECTRONS))]
    electrons: u64,
}

fn fault_help() -> String {
    let faults: Vec<String> = SessionFault::all().map(|fault| fault.to_string()).collect();
    format!(
        "Fault, with its size if it is not this one; can be given several times: {}",
        faults.join(", ")
    )
}

pub fn run(args: &PhotographArgs) -> Result<()> {
    if let Some(sequence) = &args.sequence {
        return match &args.picture {
            Some(picture) => photograph_picture(args, sequence, picture),
            None => photograph_sequence(args, sequence),
        };
    }
    let shots = write_capture(args)?;
    eprintln!(
        "{}: {shots} shots, {} faults",
        args.output.display(),
        args.faults.len()
    );
    Ok(())
}

/// Writes the new capture. Returns its number of shots.
pub fn write_capture(args: &PhotographArgs) -> Result<usize> {
    let folder = CaptureFolder::open(&args.capture)?;
    let truth = known_transport(args, &folder)?;
    let session = photograph(args, &folder, &truth)?;
    output_folder::write_atomically(&args.output, |root| session.write(&args.capture, root))?;
    Ok(session.manifest.shots.len())
}

/// The sequence in `folder`, whose light elements are those of the transport.
fn sequence_of(
    args: &PhotographArgs,
    truth: &GroundTruth,
    folder: &Path,
) -> Result<PatternSequence> {
    let sequence = read_sequence(folder)?;
    let light = sequence.layout.light;
    ensure!(
        light == truth.light_plane,
        "{}: has {light} light elements, but the transport of {} has {}",
        folder.join(SEQUENCE_NAME).display(),
        args.capture.display(),
        truth.light_plane
    );
    Ok(sequence)
}

/// Emissions `[M]` of each primary of the light elements in a picture of the display.
fn read_emissions(layout: &DisplayLayout, path: &Path) -> Result<[Vec<f32>; CHANNELS]> {
    let read = || -> Result<[Vec<f32>; CHANNELS]> {
        let shown = image::open(path)?.into_rgb8();
        ensure!(
            shown.dimensions() == (layout.display.width, layout.display.height),
            "has another size than the display, {}",
            layout.display
        );
        let emitted = |c: usize| {
            let cells = layout.light.cells();
            let of_cell = |(u, v): (u32, u32)| {
                let [x, y] = layout.centre(u, v);
                emission(shown.get_pixel(x, y).0[c]) as f32
            };
            cells.map(of_cell).collect()
        };
        Ok(std::array::from_fn(emitted))
    };
    read().with_context(|| path.display().to_string())
}

/// Writes a photograph of the picture at `path`, of the sequence in `folder`.
fn photograph_picture(args: &PhotographArgs, folder: &Path, path: &Path) -> Result<()> {
    if let Some(fault) = args.faults.iter().find(|fault| fault.is_of_session()) {
        bail!(
            "--fault {fault} needs more photographs than one; photograph a sequence or a capture with it"
        );
    }
    let output = OutputFile::create(&args.output, &PHOTOGRAPH)?;
    let truth = known_transport(args, &CaptureFolder::open(&args.capture)?)?;
    let sequence = sequence_of(args, &truth, folder)?;
    let light = sequence.layout.light;
    let mut lights = read_emissions(&sequence.layout, path)?.map(|emissions| vec![emissions]);
    let mut random = RandomStreamId::Fault.start(args.seed);
    for lights in &mut lights {
        random = change_emissions(args, light, lights, &mut []);
    }
    let mut pictures = faulty_pictures(args, &truth, &lights, &mut random);
    let picture = pictures.first_mut().context("no picture")?;
    let gain = (args.exposure.seconds / REFERENCE_EXPOSURE) as f32;
    picture
        .as_flattened_mut()
        .iter_mut()
        .for_each(|y| *y *= gain);
    let codes = expose(args, 0, picture);
    let Extent { width, height } = truth.camera;
    output.finish(|out| {
        let bytes = bytemuck::cast_slice(&codes);
        PngEncoder::new(out)
            .write_image(bytes, width, height, ExtendedColorType::Rgb16)
            .context("cannot be encoded")
    })?;
    Ok(())
}

/// Writes a photograph of each picture of the sequence in `folder`.
fn photograph_sequence(args: &PhotographArgs, folder: &Path) -> Result<()> {
    let truth = known_transport(args, &CaptureFolder::open(&args.capture)?)?;
    let sequence = sequence_of(args, &truth, folder)?;
    let layout = sequence.layout;
    let pictures = sequence.pictures.par_iter();
    let emissions = pictures.map(|picture| read_emissions(&layout, &folder.join(&picture.picture)));
    let emissions = emissions.collect::<Result<Vec<[Vec<f32>; CHANNELS]>>>()?;
    let declared = |fault: &&SessionFault| fault.is_declared();
    if let Some(fault) = args.faults.iter().find(declared) {
        bail!(
            "--fault {fault} is in capture.json, which a sequence does not have yet; photograph a capture with it"
        );
    }
    let is_pattern = |i: &usize| matches!(sequence.pictures[*i].role, PictureRole::Pattern { .. });
    // What displays do to patterns in particular.
    let (patterns, others): (Vec<usize>, Vec<usize>) = (0..emissions.len()).partition(is_pattern);
    let mut random = RandomStreamId::Fault.start(args.seed);
    let mut changed: [Vec<Vec<f32>>; CHANNELS] = Default::default();
    for (c, changed) in changed.iter_mut().enumerate() {
        let lights_of = |list: &Vec<usize>| -> Vec<Vec<f32>> {
            list.iter().map(|i| emissions[*i][c].clone()).collect()
        };
        let [mut lights, mut other_lights] = [&patterns, &others].map(lights_of);
        random = change_emissions(args, layout.light, &mut lights, &mut other_lights);
        changed.resize(emissions.len(), Vec::new());
        let order = patterns.iter().chain(&others);
        for (i, light) in order.zip(lights.into_iter().chain(other_lights)) {
            changed[*i] = light;
        }
    }
    let pictures = faulty_pictures(args, &truth, &changed, &mut random);
    output_folder::write_atomically(&args.output, |root| {
        pictures
            .par_iter()
            .enumerate()
            .try_for_each(|(i, picture)| {
                let codes = expose(args, i, picture);
                let path = root.join(format!("IMG_{:04}.png", i + 1));
                write_png(
                    &path,
                    truth.camera,
                    bytemuck::cast_slice(&codes),
                    ExtendedColorType::Rgb16,
                )
            })
    })?;
    eprintln!("{}: {} photographs", args.output.display(), pictures.len());
    Ok(())
}

/// Adds the display's faults to the emissions of one primary, `[light][M]`, under patterns and under other lights: those of each primary
/// are the same. Returns the random numbers for further faults.
fn change_emissions(
    args: &PhotographArgs,
    light: Extent,
    patterns: &mut [Vec<f32>],
    others: &mut [Vec<f32>],
) -> ChaCha8Rng {
    let mut random = RandomStreamId::Fault.start(args.seed);
    for fault in &args.faults {
        fault.change_emissions(light, patterns, others, &mut random);
    }
    random
}

/// The known transport of the capture.
fn known_transport(args: &PhotographArgs, folder: &CaptureFolder) -> Result<GroundTruth> {
    let missing =
        "has no truth/ folder, so its transport is unknown and it cannot be photographed again";
    let truth = folder.truth()?.context(missing);
    truth.with_context(|| args.capture.display().to_string())
}

/// The pictures under lights, of each primary `[picture][M]`, in the order in which they are taken, with the faults of pictures.
fn faulty_pictures(
    args: &PhotographArgs,
    truth: &GroundTruth,
    lights: &[Vec<Vec<f32>>; CHANNELS],
    random: &mut ChaCha8Rng,
) -> Vec<LinearPhoto> {
    let channels: Vec<_> = (0..CHANNELS)
        .map(|c| channel_pictures(truth, c, &lights[c]))
        .collect();
    let mut pictures = interleave(&channels);
    for fault in &args.faults {
        fault.change_pictures(truth.camera, &mut pictures, random);
    }
    pictures
}

/// The codes of photograph `i`, with noise and faults.
fn expose(args: &PhotographArgs, i: usize, picture: &LinearPhoto) -> Vec<[u16; CHANNELS]> {
    let sensor = Camera {
        electrons: args.electrons as f64,
    };
    let mut noise = RandomStreamId::Photograph(i as u32).start(args.seed);
    let mut codes = sensor.photograph(picture, &mut noise);
    args.faults
        .iter()
        .for_each(|fault| fault.change_codes(&mut codes));
    codes
}

/// A session of photographs, in memory.
struct Session {
    manifest: Manifest,
    /// Pattern files of the original capture, with their new names.
    patterns: Vec<(String, String)>,
    /// Names and codes.
    photographs: Vec<(String, Vec<[u16; CHANNELS]>)>,
    camera: Extent,
}

fn photograph(
    args: &PhotographArgs,
    folder: &CaptureFolder,
    truth: &GroundTruth,
) -> Result<Session> {
    let original = folder.manifest();
    ensure!(
        original.correspondence.is_some()
            || args
                .faults
                .iter()
                .all(|fault| !fault.is_of_correspondence()),
        "{}: has no \"correspondence\" that could be mirrored",
        folder.manifest_path().display()
    );
    let (light, camera) = (truth.light_plane, truth.camera);
    let mut manifest = original.clone();
    // These photographs are of another camera, and of a display that does not dim.
    manifest.camera = ManifestCamera {
        width: camera.width,
        height: camera.height,
        black: Camera::BLACK,
        white: Camera::WHITE,
        ..ManifestCamera::default()
    };
    manifest.light.dimming = None;
    let folder = &folder.with_manifest(manifest.clone());
    manifest.dark = Some("photos/dark.png".to_owned());
    manifest.flood = Some("photos/flood.png".to_owned());
    let gray_code = GrayCodePattern::all(light);
    let is_listed = |code: &GrayCodePattern| {
        let mut shots = original.graycode.iter();
        shots.any(|shot| {
            (shot.axis, shot.bit, shot.inverted) == (code.axis, code.bit, code.inverted)
        })
    };
    let gray_code: Vec<GrayCodePattern> = gray_code.into_iter().filter(is_listed).collect();
    let shots = 0..original.shots.len();
    let patterns = shots
        .clone()
        .into_par_iter()
        .map(|i| folder.read_pattern(i));
    let patterns = patterns.collect::<Result<Vec<Pattern>, _>>()?;
    let mut pictures: Vec<Vec<Vec<f32>>> = Vec::new();
    let uniform = |emission: f32| vec![emission; light.area()];
    let mut others = vec![uniform(0.0), uniform(1.0)];
    others.extend(gray_code.iter().map(|code| match code.codes(light) {
        PatternImage::Grey(codes) => codes.iter().map(|&code| f32::from(code) / 255.0).collect(),
        PatternImage::Rgb(_) => Vec::new(),
    }));
    let bar = progress::bar("photographing", CHANNELS);
    for c in 0..CHANNELS {
        let mut emissions: Vec<Vec<f32>> = patterns
            .iter()
            .map(|pattern| pattern.plane(c).to_vec())
            .collect();
        let mut others = others.clone();
        change_emissions(args, light, &mut emissions, &mut others);
        emissions.extend(others);
        pictures.push(channel_pictures(truth, c, &emissions));
        bar.inc(1);
    }
    let mut pictures = interleave(&pictures);
    let mut others = pictures.split_off(original.shots.len());
    let mut random = RandomStreamId::Fault.start(args.seed);
    for fault in &args.faults {
        fault.change_pictures(camera, &mut pictures, &mut random);
        fault.change_manifest(&mut manifest);
    }
    for (picture, shot) in pictures.iter_mut().zip(&original.shots) {
        let exposure = shot.exposure.unwrap_or(1.0) as f32;
        picture
            .as_flattened_mut()
            .iter_mut()
            .for_each(|y| *y *= exposure);
    }
    let mut names: Vec<String> = (0..pictures.len())
        .map(|i| format!("photos/{i:04}.png"))
        .collect();
    names.extend(["photos/dark.png", "photos/flood.png"].map(str::to_owned));
    manifest.graycode = gray_code.iter().map(|code| code.shot()).collect();
    names.extend(manifest.graycode.iter().map(|shot| shot.photo.clone()));
    pictures.append(&mut others);
    let named: Vec<(String, LinearPhoto)> = names.into_iter().zip(pictures).collect();
    let photographs = named.into_par_iter().enumerate();
    let photographs = photographs.map(|(i, (name, picture))| (name, expose(args, i, &picture)));
    let photographs = photographs.collect();
    // Exposures of one pattern share its file.
    let first = |shot: &Shot| {
        let same = |other: &Shot| other.pattern == shot.pattern;
        original.shots.iter().position(same).unwrap_or(0)
    };
    let renamed = |(i, shot): (usize, &Shot)| Shot {
        pattern: format!("patterns/{:04}.png", first(shot)),
        photo: format!("photos/{i:04}.png"),
        exposure: shot.exposure,
    };
    manifest.shots = original.shots.iter().enumerate().map(renamed).collect();
    let patterns = original.shots.iter().zip(&manifest.shots);
    let patterns = patterns.map(|(old, new)| (old.pattern.clone(), new.pattern.clone()));
    Ok(Session {
        patterns: patterns.collect(),
        manifest,
        photographs,
        camera,
    })
}

/// Pictures `[light][N]` of channel `c` under lights with `emissions`, `[light][M]`.
fn channel_pictures(truth: &GroundTruth, c: usize, emissions: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let (count, light) = (emissions.len(), truth.light_plane);
    // The lights' emissions of one element are contiguous.
    let by_element: Vec<f32> = (0..light.area())
        .flat_map(|m| emissions.iter().map(move |light| light[m]))
        .collect();
    let pixel = |n: usize| {
        let mut sums = vec![0.0f32; count];
        for (slot, tau) in truth.tau(n).iter().enumerate() {
            let tau = tau[c].to_f32();
            let element = truth.window.element(truth.window_origin(n), slot);
            if let Some(m) = element.index_in(light).filter(|_| tau != 0.0) {
                let emissions = &by_element[m * count..(m + 1) * count];
                sums.iter_mut()
                    .zip(emissions)
                    .for_each(|(sum, e)| *sum += tau * e);
            }
        }
        sums
    };
    let by_pixel: Vec<Vec<f32>> = (0..truth.camera.area())
        .into_par_iter()
        .map(pixel)
        .collect();
    (0..count)
        .map(|i| by_pixel.iter().map(|sums| sums[i]).collect())
        .collect()
}

/// Pictures of all channels from those of each, `[channel][light][N]`.
fn interleave(channels: &[Vec<Vec<f32>>]) -> Vec<LinearPhoto> {
    let picture = |i: usize| {
        let pixels = 0..channels[0][i].len();
        pixels
            .map(|n| std::array::from_fn(|c| channels[c][i][n]))
            .collect()
    };
    (0..channels[0].len()).map(picture).collect()
}

impl Session {
    fn write(&self, original: &Path, root: &Path) -> Result<()> {
        for folder in ["patterns", "photos", "graycode", "truth"] {
            std::fs::create_dir(root.join(folder)).context(folder)?;
        }
        let json = serde_json::to_string_pretty(&self.manifest)?;
        std::fs::write(root.join(MANIFEST_NAME), json + "\n").context(MANIFEST_NAME)?;
        for (old, new) in &self.patterns {
            std::fs::copy(original.join(old), root.join(new)).with_context(|| old.clone())?;
        }
        for entry in std::fs::read_dir(original.join("truth")).context("truth")? {
            let path = entry.context("truth")?.path();
            if let Some(name) = path.file_name().filter(|_| path.is_file()) {
                let copy = std::fs::copy(&path, root.join("truth").join(name));
                copy.with_context(|| path.display().to_string())?;
            }
        }
        self.photographs.par_iter().try_for_each(|(name, codes)| {
            let bytes = bytemuck::cast_slice(codes);
            write_png(
                &root.join(name),
                self.camera,
                bytes,
                ExtendedColorType::Rgb16,
            )
        })
    }
}
