//! `ltm-export assemble`: pairs photographs with the pictures of a sequence, and makes a capture folder of them.

mod develop_all;
mod level_warnings;
mod photograph_file;
mod photograph_list;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use tempfile::TempDir;

pub use self::develop_all::{check_cancelled, develop_all};
pub use self::level_warnings::{PhotographLevels, warn_of_clipping};
pub use self::photograph_file::DevelopSettings;
pub use self::photograph_list::photographs;
use super::advice::error_with_remedy;
use super::process_resources::InterruptibleCores;
use super::progress;
use super::value_parsers::UsageError;
use crate::acquisition::{
    PairingFault, PatternSequence, PictureRole, SEQUENCE_NAME, SequenceBrightness,
};
use crate::calibrate::GrayCodeFit;
use crate::capture::{
    CameraResponse, CameraRowSet, CaptureFolder, MANIFEST_NAME, Manifest, ManifestCamera,
};
use crate::transport::{Extent, TileRect};

/// Folders that photographs are written into.
const FOLDERS: [&str; 2] = ["photos", "graycode"];
/// Rows of the Gray code that are decoded, at most.
const GRAY_CODE_ROWS: u32 = 64;
/// Most faults that are listed.
const MAX_LISTED: usize = 5;
/// Brightness of the brightest part of the flood photograph, relative to white, below which noise is needlessly high.
const MIN_FLOOD: f64 = 0.3;
/// Change of the reference photographs' brightness that is worth a note.
const MIN_DRIFT: f64 = 0.005;
/// Brightness relative to the flood's, at most, of parts of the picture that do not count for the display's response.
const MIN_RAMP_BRIGHTNESS: f64 = 0.2;

/// Pair photographs with the pictures of a sequence, and make a capture folder of them
#[derive(Debug, Args)]
pub struct AssembleArgs {
    /// Folder that `ltm-export patterns` wrote
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Photographs in the order in which they were taken, or a folder of them, which is sorted by the numbers in their names: a camera's raw
    /// files, or linear PNG, TIFF or OpenEXR
    #[arg(long, value_name = "PATH", num_args = 1.., required = true)]
    photos: Vec<PathBuf>,
    #[command(flatten)]
    develop: DevelopArgs,
    /// Write the capture although photographs seem not to show their pictures
    #[arg(long)]
    force: bool,
}

/// How photographs become linear measurements.
#[derive(Debug, Args)]
pub struct DevelopArgs {
    /// Tone curve of the photographs: linear, srgb, or gamma=2.2; must be given for 8 bits [default: linear]
    #[arg(long, value_name = "CURVE", value_parser = parse_response)]
    response: Option<CameraResponse>,
    /// Sample without light: a code of 16 bits, or a floating-point number; not for raw files [default: 0]
    #[arg(long, value_name = "NUMBER", value_parser = parse_level, allow_negative_numbers = true)]
    black: Option<f64>,
    /// Sample from which on light is saturated: a code of 16 bits, or a floating-point number [default: 65535; 65000 of raw files, 1 of
    /// floating-point samples]
    #[arg(long, value_name = "NUMBER", value_parser = parse_level)]
    white: Option<f64>,
    /// Average squares of N x N pixels; a raw file has one pixel for each 2 x 2 of the sensor
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=64))]
    bin: u32,
    /// Keep a part of the picture, in pixels before averaging
    #[arg(long, value_name = "X,Y,WxH", value_parser = parse_rect)]
    crop: Option<TileRect>,
}

impl DevelopArgs {
    /// The settings.
    ///
    /// # Errors
    /// [`UsageError`] if white is not above black.
    pub fn settings(&self) -> Result<DevelopSettings> {
        let black = self.black.unwrap_or(0.0);
        if self.white.is_some_and(|white| white <= black) {
            bail!(UsageError("--white must be above --black"));
        }
        Ok(DevelopSettings {
            response: self.response,
            black: self.black,
            white: self.white,
            bin: self.bin,
            crop: self.crop,
        })
    }
}

fn parse_response(text: &str) -> Result<CameraResponse, String> {
    match text {
        "linear" => Ok(CameraResponse::Linear),
        "srgb" => Ok(CameraResponse::Srgb),
        _ => {
            let gamma = text.strip_prefix("gamma=").and_then(|n| n.parse().ok());
            let gamma = gamma.filter(|gamma| (0.1..=10.0).contains(gamma));
            gamma
                .map(CameraResponse::Gamma)
                .ok_or_else(|| "give linear, srgb, or gamma=N with N from 0.1 to 10".to_owned())
        }
    }
}

fn parse_level(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| "it must be a number".to_owned())
}

fn parse_rect(text: &str) -> Result<TileRect, String> {
    let parse = || {
        let (x, rest) = text.split_once(',')?;
        let (y, size) = rest.split_once(',')?;
        let (width, height) = size.split_once('x')?;
        let number = |text: &str| text.trim().parse::<u32>().ok();
        let extent = Extent::new(
            number(width).filter(|n| *n > 0)?,
            number(height).filter(|n| *n > 0)?,
        );
        Some(TileRect {
            x: number(x)?,
            y: number(y)?,
            extent,
        })
    };
    parse().ok_or_else(|| "give it as X,Y,WIDTHxHEIGHT, for instance 100,50,3000x2000".to_owned())
}

pub fn run(args: &AssembleArgs) -> Result<()> {
    let settings = args.develop.settings()?;
    let sequence = read_sequence(&args.folder)?;
    ensure_new(&args.folder)?;
    let paths = photographs(&args.photos)?;
    // One may be found; for more there is no need to read them.
    if paths.len().abs_diff(sequence.pictures.len()) > 1 {
        bail!(wrong_count(paths.len(), sequence.pictures.len(), ""));
    }
    let session = Session::develop(&args.folder, sequence, paths, &settings)?;
    let faults = session.check_pairing(args.force)?;
    faults
        .iter()
        .for_each(|fault| eprintln!("warning: {fault}"));
    session.note_exposure();
    let paths = session.paths.iter().map(PathBuf::as_path);
    warn_of_clipping(session.levels.iter().zip(paths));
    let response = session.display_response();
    let manifest = session.sequence.manifest(session.camera.clone(), response);
    session.move_into_place(&args.folder, &manifest)?;
    let summary = format!(
        "{}: {} shots of {} pixels",
        args.folder.display(),
        manifest.shots.len(),
        session.camera.extent()
    );
    match fit_gray_code(&args.folder) {
        Ok(_) => eprintln!("{summary}; `ltm-export recover` takes this folder"),
        Err(error) => {
            eprintln!("warning: {}", error_with_remedy(&error));
            eprintln!(
                "{summary}; it cannot be recovered without \"correspondence\". Are --black, --white, --bin and --crop right?"
            );
        }
    }
    Ok(())
}

/// The sequence in a folder that `patterns` wrote.
pub fn read_sequence(folder: &Path) -> Result<PatternSequence> {
    let path = folder.join(SEQUENCE_NAME);
    let read = || -> Result<PatternSequence> {
        let json = std::fs::read_to_string(&path)
            .context("cannot be read; is this a folder that `ltm-export patterns` wrote?")?;
        Ok(PatternSequence::parse(&json)?)
    };
    read().with_context(|| path.display().to_string())
}

/// Refuses a folder that has something where the photographs will be: the result of an earlier call, or the user's own files.
fn ensure_new(folder: &Path) -> Result<()> {
    for name in FOLDERS.into_iter().chain([MANIFEST_NAME]) {
        let path = folder.join(name);
        let is_empty = || {
            path.read_dir()
                .is_ok_and(|mut entries| entries.next().is_none())
        };
        ensure!(
            !path.exists() || is_empty(),
            "{}: is there already, but assemble writes photos/, graycode/ and capture.json itself; move these out of the folder \
             first",
            path.display()
        );
    }
    Ok(())
}

/// Developed photographs, in a temporary folder.
struct Session {
    sequence: PatternSequence,
    paths: Vec<PathBuf>,
    /// Size and levels of the developed photographs.
    camera: ManifestCamera,
    /// Holds the developed photographs, by their numbers.
    developed: TempDir,
    brightness: SequenceBrightness,
    /// One for each photograph.
    levels: Vec<PhotographLevels>,
}

impl Session {
    fn develop(
        folder: &Path,
        sequence: PatternSequence,
        paths: Vec<PathBuf>,
        settings: &DevelopSettings,
    ) -> Result<Self> {
        let developed = TempDir::with_prefix_in(".ltm-export-", folder)
            .with_context(|| folder.display().to_string())?;
        for folder in FOLDERS {
            std::fs::create_dir(developed.path().join(folder)).context(folder)?;
        }
        let cores = InterruptibleCores::listen()?;
        let name = |i: usize| {
            // A photograph too many has no name.
            let picture = sequence.pictures.get(i)?;
            Some(picture.photo.clone())
        };
        let photos = develop_all(&paths, settings, developed.path(), name, &cores)?;
        Ok(Self {
            sequence,
            paths,
            camera: photos.camera,
            developed,
            levels: photos.levels,
            brightness: SequenceBrightness {
                thumbnails: photos.thumbnails,
            },
        })
    }

    /// The faults that `force` allows.
    ///
    /// # Errors
    /// If the number of photographs is not that of the pictures, and of faults without `force`.
    fn check_pairing(&self, force: bool) -> Result<Vec<String>> {
        let (photos, pictures) = (self.paths.len(), self.sequence.pictures.len());
        if photos != pictures {
            bail!(wrong_count(photos, pictures, &self.gap_text()));
        }
        let faults = self.brightness.faults(&self.sequence);
        let texts: Vec<String> = faults
            .iter()
            .map(|&(i, fault)| self.fault_text(i, fault))
            .collect();
        if texts.is_empty() || force {
            return Ok(texts);
        }
        let mut message = texts[..texts.len().min(MAX_LISTED)].join("; ");
        if texts.len() > MAX_LISTED {
            message += &format!("; and {} more", texts.len() - MAX_LISTED);
        }
        bail!(
            "{message}. Are the photographs linear (see --response), neither too dark nor saturated, and in the order of the \
             pictures? A camera that counts from 9999 to 0001 needs its photographs listed in order. --force writes the capture \
             nevertheless"
        )
    }

    /// Where a photograph is missing, or which may be too many.
    fn gap_text(&self) -> String {
        let Some(gap) = self.brightness.gap(&self.sequence) else {
            return String::new();
        };
        let (first, last) = (*gap.start(), *gap.end());
        if self.paths.len() > self.sequence.pictures.len() {
            return format!(
                ": one is too many, {}",
                range(&self.path(first), &self.path(last))
            );
        }
        let pictures = range(&self.picture(first), &self.picture(last));
        let before = first
            .checked_sub(1)
            .map(|i| format!("after {}", self.path(i)));
        let after = (last < self.paths.len()).then(|| format!("before {}", self.path(last)));
        let place: Vec<String> = before.into_iter().chain(after).collect();
        format!(": one is missing, of {pictures}, {}", place.join(" and "))
    }

    fn fault_text(&self, i: usize, fault: PairingFault) -> String {
        let (path, picture) = (self.path(i), self.picture(i));
        match fault {
            PairingFault::NotDark => format!("{path} is not dark, as {picture} is"),
            PairingFault::NotLit(relative) => format!(
                "{path} is {relative:.2} times as bright as the flood photograph, and should be equally bright, as {picture} is"
            ),
            PairingFault::NotRising => {
                format!("{path} is not between its neighbours in brightness, as {picture} is")
            }
            PairingFault::NotInverse(deviation) => format!(
                "{path} is not the inverse of the photograph before, as {picture} is: their sum differs from the flood \
                 photograph by {:.0} %",
                (100.0 * deviation).min(999.0)
            ),
        }
    }

    fn path(&self, photo: usize) -> String {
        self.paths[photo].display().to_string()
    }

    fn picture(&self, i: usize) -> String {
        self.sequence.pictures[i].picture.clone()
    }

    /// Photographs of a role, by their numbers.
    fn photos_of(&self, is_of_role: impl Fn(&PictureRole) -> bool) -> Vec<usize> {
        let pictures = self.sequence.pictures.iter().enumerate();
        let found = pictures.filter(|(_, picture)| is_of_role(&picture.role));
        found.map(|(i, _)| i).collect()
    }

    /// Notes exposures that cost accuracy, and a lamp that drifts.
    fn note_exposure(&self) {
        let thumbnail = |i: &usize| &self.brightness.thumbnails[*i];
        let mean = |i: &usize| thumbnail(i).iter().sum::<f64>() / thumbnail(i).len() as f64;
        let floods = self.photos_of(|role| *role == PictureRole::Flood);
        let dark: f64 = self
            .photos_of(|role| *role == PictureRole::Dark)
            .iter()
            .map(mean)
            .sum();
        for flood in &floods {
            let brightest = thumbnail(flood).iter().copied().fold(0.0, f64::max);
            let levels = &self.levels[*flood];
            levels.warn_of_flood(&self.paths[*flood]);
            if !levels.is_saturated() && brightest < MIN_FLOOD {
                eprintln!(
                    "note: the brightest part of {} is at {:.0} % of white; more exposure would lower the noise",
                    self.path(*flood),
                    100.0 * brightest
                );
            }
            let references = self.photos_of(|role| *role == PictureRole::Reference);
            let white = mean(flood) - dark;
            let changes = references.iter().map(|i| (mean(i) - dark) / white - 1.0);
            let drift = changes.fold(0.0, |most: f64, change| {
                if change.abs() > most.abs() {
                    change
                } else {
                    most
                }
            });
            if drift.abs() > MIN_DRIFT {
                eprintln!(
                    "note: the flood's brightness changed by {:+.1} % in the session; `recover` corrects the exposures",
                    100.0 * drift
                );
            }
        }
    }

    /// Pairs of code and emission that the ramp shows; `None` if they do not rise.
    fn display_response(&self) -> Option<Vec<[f64; 2]>> {
        let thumbnail = |i: usize| &self.brightness.thumbnails[i];
        let [dark, flood] = [PictureRole::Dark, PictureRole::Flood]
            .map(|role| self.photos_of(|other| *other == role).first().copied());
        let (dark, flood) = (thumbnail(dark?), thumbnail(flood?));
        let brightest = flood.iter().copied().fold(0.0, f64::max);
        let parts = (0..flood.len()).filter(|&n| flood[n] > MIN_RAMP_BRIGHTNESS * brightest);
        let light = |thumbnail: &[f64]| parts.clone().map(|n| thumbnail[n] - dark[n]).sum::<f64>();
        let white = light(flood);
        let mut response = vec![[0.0, 0.0]];
        for (i, picture) in self.sequence.pictures.iter().enumerate() {
            if let PictureRole::Ramp { code } = picture.role {
                let emission = (light(thumbnail(i)) / white * 1e5).round() / 1e5;
                response.push([f64::from(code), emission.max(0.0)]);
            }
        }
        response.push([f64::from(u8::MAX), 1.0]);
        let is_rising = response
            .windows(2)
            .all(|pair| pair[0][0] < pair[1][0] && pair[0][1] <= pair[1][1]);
        (is_rising && response.len() > 2).then_some(response)
    }

    /// Moves the photographs into `folder`, and then `manifest`, without which it is no capture folder.
    fn move_into_place(&self, folder: &Path, manifest: &Manifest) -> Result<()> {
        let json = serde_json::to_string_pretty(manifest)?;
        let developed = self.developed.path();
        std::fs::write(developed.join(MANIFEST_NAME), json + "\n").context(MANIFEST_NAME)?;
        for name in FOLDERS.into_iter().chain([MANIFEST_NAME]) {
            let target = folder.join(name);
            if target.is_dir() {
                std::fs::remove_dir(&target).with_context(|| target.display().to_string())?; // it is empty
            }
            let moved = std::fs::rename(developed.join(name), &target);
            moved.with_context(|| target.display().to_string())?;
        }
        Ok(())
    }
}

/// The message of a wrong number of photographs, with the `place` where one is missing or too many.
fn wrong_count(photos: usize, pictures: usize, place: &str) -> String {
    format!(
        "there are {photos} photographs of {pictures} pictures{place}. Give one photograph for each picture of display/, in order"
    )
}

/// Decodes some rows of the Gray code of a capture folder.
pub fn fit_gray_code(folder: &Path) -> Result<GrayCodeFit> {
    let folder = CaptureFolder::open(folder)?;
    let _spinner = progress::spinner("decoding");
    let dark = folder.read_dark()?;
    let camera = folder.manifest().camera.extent();
    let count = GRAY_CODE_ROWS.min(camera.height);
    let row = |i: u32| (u64::from(i) * u64::from(camera.height) / u64::from(count)) as u32;
    let rows = (0..count).map(|i| row(i)..row(i) + 1);
    let rows = CameraRowSet::from_strips(rows);
    let gray_code = folder.read_gray_code(&dark, &rows)?;
    let fit = gray_code.fit(camera);
    fit.with_context(|| folder.manifest_path().display().to_string())
}

/// For instance "a", or "a to b".
fn range(first: &str, last: &str) -> String {
    match first == last {
        true => first.to_owned(),
        false => format!("{first} to {last}"),
    }
}
