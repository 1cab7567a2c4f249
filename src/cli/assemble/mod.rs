//! `ltm-export assemble`: pairs photographs with the pictures of a sequence, and makes a capture folder of them.

mod color_matrix;
mod develop_all;
mod lens_distortion;
mod level_warnings;
mod line_sharpness;
mod photograph_file;
mod photograph_list;
mod rotation;
mod session;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use tempfile::TempDir;

pub use self::color_matrix::raw_color_matrix;
pub use self::develop_all::{check_cancelled, develop_all};
use self::lens_distortion::LensDistortion;
pub use self::level_warnings::{PhotographLevels, warn_of_clipping};
pub use self::photograph_file::{
    DevelopSettings, DevelopedPhotograph, SampleKind, develop, thumbnail_part,
};
pub use self::photograph_list::{is_photograph, photographs};
use self::rotation::Rotation;
use self::session::wrong_count;
pub use self::session::{FOLDERS, Session, fault_text};
use super::progress;
use super::value_parsers::UsageError;
use crate::acquisition::{PatternSequence, SEQUENCE_NAME};
use crate::calibrate::GrayCodeFit;
use crate::capture::{CameraResponse, CameraRowSet, CaptureFolder, MANIFEST_NAME};
use crate::transport::{Extent, TileRect};

/// Rows of the Gray code that are decoded, at most.
const GRAY_CODE_ROWS: u32 = 64;

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
    /// Undo the distortion of a lens, given as OpenCV's calibrateCamera does, in pixels of the photographs, before --crop; the last four
    /// numbers may be left out
    #[arg(long, value_name = "FX,FY,CX,CY,K1,K2,P1,P2,K3")]
    undistort: Option<LensDistortion>,
    /// Keep a part of the picture, in pixels before averaging
    #[arg(long, value_name = "X,Y,WxH", value_parser = parse_rect)]
    crop: Option<TileRect>,
    /// Turn the picture clockwise by 90, 180 or 270 degrees, after --crop
    #[arg(long, value_name = "DEGREES", value_parser = parse_rotation)]
    rotate: Option<Rotation>,
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
            undistort: self.undistort,
            crop: self.crop,
            rotate: self.rotate.unwrap_or(Rotation::NONE),
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

fn parse_rotation(text: &str) -> Result<Rotation, String> {
    let rotation = text.parse().ok().and_then(Rotation::from_degrees);
    rotation.ok_or_else(|| "give 90, 180 or 270".to_owned())
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
    let developed = TempDir::with_prefix_in(".ltm-export-", &args.folder)
        .with_context(|| args.folder.display().to_string())?;
    let session = Session::develop(developed.path(), sequence, paths, &settings)?;
    let faults = session.check_pairing(args.force)?;
    faults
        .iter()
        .for_each(|fault| eprintln!("warning: {fault}"));
    session.complete(&args.folder)
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
pub fn ensure_new(folder: &Path) -> Result<()> {
    for name in FOLDERS.into_iter().chain([MANIFEST_NAME]) {
        let path = folder.join(name);
        let is_empty = || {
            path.read_dir()
                .is_ok_and(|mut entries| entries.next().is_none())
        };
        ensure!(
            !path.exists() || is_empty(),
            "{}: is there already, but photos/, graycode/ and capture.json are what this command writes; move these out of the folder \
             first",
            path.display()
        );
    }
    Ok(())
}

/// Decodes some rows of the Gray code of a capture folder.
pub fn fit_gray_code(folder: &Path) -> Result<GrayCodeFit> {
    let folder = CaptureFolder::open(folder)?;
    let _spinner = progress::spinner("decoding");
    let camera = folder.manifest().camera.extent();
    let count = GRAY_CODE_ROWS.min(camera.height);
    let row = |i: u32| (u64::from(i) * u64::from(camera.height) / u64::from(count)) as u32;
    let rows = (0..count).map(|i| row(i)..row(i) + 1);
    let rows = CameraRowSet::from_strips(rows);
    let gray_code = folder.read_gray_code(&folder.read_dark_rows(&rows)?, &rows)?;
    let fit = gray_code.fit(camera);
    fit.with_context(|| folder.manifest_path().display().to_string())
}
