//! A capture folder, on disk or in other files.
//!
//! The manifest is checked when the folder is opened; patterns and photographs are read one by one, so that callers may
//! read them in parallel.

mod dark_frame;
mod disk_files;
mod files;
#[cfg(not(target_arch = "wasm32"))]
mod ingest;
#[cfg(not(target_arch = "wasm32"))]
mod ingest_record;
mod photograph_codes;
mod photograph_row_reader;
#[cfg(not(target_arch = "wasm32"))]
mod photograph_scan;
mod picture_file;
mod picture_png;
#[cfg(not(target_arch = "wasm32"))]
mod picture_tiff;
#[cfg(not(target_arch = "wasm32"))]
mod tiff_layout;
#[cfg(not(target_arch = "wasm32"))]
mod tiled_tiff;
#[cfg(not(target_arch = "wasm32"))]
mod truth;

use std::io::Read;
use std::path::{Path, PathBuf};

pub use self::dark_frame::{DarkFrame, DarkFrameReader};
pub use self::disk_files::DiskFiles;
pub use self::files::CaptureFiles;
#[cfg(not(target_arch = "wasm32"))]
pub use self::ingest::{IngestError, IngestedPhotograph};
#[cfg(not(target_arch = "wasm32"))]
pub use self::ingest_record::IngestSource;
pub use self::photograph_row_reader::PhotographRowReader;
#[cfg(not(target_arch = "wasm32"))]
pub use self::photograph_scan::PhotographScan;
#[cfg(not(target_arch = "wasm32"))]
pub use self::truth::{GroundTruth, RELIT_FULL_SCALE};

use self::files::CaptureFile;
use self::picture_file::PictureFile;
use super::camera_pixel_set::CameraPixelSet;
use super::camera_row_set::CameraRowSet;
use super::code_statistics::CodeStatistics;
use super::error::{CaptureError, CaptureErrorKind, MANIFEST_NAME};
use super::manifest::Manifest;
use super::measurements::{LinearPhoto, Measurements, Pattern};
use super::noise_model::NoiseModel;
use crate::calibrate::{BitPair, GrayCodePhotos, LightPlaneAxis};
use crate::transport::{CHANNELS, Correspondence, Extent};

/// Reads the size and the codes of a photograph that no manifest lists.
///
/// # Errors
/// If it is missing or not a 16-bit photograph.
pub fn read_unlisted_photo<F: CaptureFiles>(
    files: &F,
    name: &str,
) -> Result<(Extent, Vec<[u16; CHANNELS]>), CaptureError> {
    PictureFile::unlisted(files, name).read_codes()
}

/// Reads the size and the emission of a pattern that no manifest lists; `emission` is that of each code.
///
/// # Errors
/// If it is missing or not an 8-bit PNG.
pub fn read_unlisted_pattern<F: CaptureFiles>(
    files: &F,
    name: &str,
    emission: &[f64; 256],
) -> Result<(Extent, Pattern), CaptureError> {
    PictureFile::unlisted(files, name).read_pattern(emission)
}

/// A capture folder with its checked manifest.
#[derive(Clone, Debug)]
pub struct CaptureFolder<F = DiskFiles> {
    files: F,
    manifest: Manifest,
    emission: [f64; 256],
}

impl CaptureFolder {
    /// Opens the folder `root` and reads its manifest.
    ///
    /// # Errors
    /// If `root` is not a folder with a valid `capture.json`.
    pub fn open(root: &Path) -> Result<Self, CaptureError> {
        Self::from_files(files_in(root)?)
    }

    /// The same without a look at the [values](Manifest::problems) of the manifest's fields.
    ///
    /// # Errors
    /// If `root` is not a folder with a `capture.json` that can be parsed.
    pub fn open_unchecked(root: &Path) -> Result<Self, CaptureError> {
        Self::from_files_unchecked(files_in(root)?)
    }

    /// The folder.
    pub fn root(&self) -> &Path {
        &self.files.root
    }

    /// The known transport, if the folder has any.
    ///
    /// # Errors
    /// If its files cannot be read or have the wrong shape.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn truth(&self) -> Result<Option<GroundTruth>, CaptureError> {
        GroundTruth::open(&self.files.root.join("truth"), &self.manifest)
    }
}

/// The files of the folder `root`, which must have a manifest.
fn files_in(root: &Path) -> Result<DiskFiles, CaptureError> {
    let path = root.join(MANIFEST_NAME);
    let problem = match (root.exists(), root.is_dir(), path.exists()) {
        (false, ..) => Some("there is no such folder"),
        (_, false, _) => Some("is a file"),
        (.., false) => Some("is not a capture folder: it has no capture.json"),
        _ => None,
    };
    if let Some(problem) = problem {
        let problem = CaptureErrorKind::NotACapture(problem);
        return Err(CaptureError::new(root, problem));
    }
    let root = root.to_owned();
    Ok(DiskFiles { root })
}

impl<F: CaptureFiles> CaptureFolder<F> {
    /// Reads the manifest of a folder with these files.
    ///
    /// # Errors
    /// If there is no valid `capture.json`.
    pub fn from_files(files: F) -> Result<Self, CaptureError> {
        let folder = Self::from_files_unchecked(files)?;
        match folder.manifest.problems().into_iter().next() {
            Some(problem) => Err(CaptureError::new(folder.manifest_path(), problem)),
            None => Ok(folder),
        }
    }

    fn from_files_unchecked(files: F) -> Result<Self, CaptureError> {
        let path = files.path(MANIFEST_NAME);
        let mut text = String::new();
        CaptureFile::open(&files, MANIFEST_NAME)
            .and_then(|mut file| file.read_to_string(&mut text))
            .map_err(|e| CaptureError::new(&path, CaptureErrorKind::Io(e)))?;
        // Some editors write a byte order mark, which is not JSON.
        let json = text.strip_prefix('\u{feff}').unwrap_or(&text);
        let manifest = Manifest::parse_unchecked(json, &path)?;
        Ok(Self::new(files, manifest))
    }

    fn new(files: F, manifest: Manifest) -> Self {
        Self {
            files,
            emission: manifest.light.emission(),
            manifest,
        }
    }

    /// The same folder with another manifest.
    pub fn with_manifest(&self, manifest: Manifest) -> Self
    where
        F: Clone,
    {
        Self::new(self.files.clone(), manifest)
    }

    /// The manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Path of the manifest.
    pub fn manifest_path(&self) -> PathBuf {
        self.files.path(MANIFEST_NAME)
    }

    /// Names and paths of all files that recovery from `shots` reads.
    pub fn files(&self, shots: &[usize]) -> Vec<(&str, PathBuf)> {
        let manifest = &self.manifest;
        let shots = shots.iter().map(|&i| &manifest.shots[i]);
        let mut names = vec![MANIFEST_NAME];
        names.extend(manifest.dark.as_deref());
        names.extend(manifest.flood.as_deref());
        names.extend(shots.flat_map(|shot| [shot.pattern.as_str(), &shot.photo]));
        if manifest.correspondence.is_none() {
            names.extend(manifest.graycode.iter().map(|shot| shot.photo.as_str()));
        }
        let path = |name| (name, self.files.path(name));
        names.into_iter().map(path).collect()
    }

    /// Reads `rows` of the Gray code photographs; `dark` was read there.
    ///
    /// # Errors
    /// If the manifest lacks one of the bits, plain or inverted, or a photograph cannot be read.
    pub fn read_gray_code(
        &self,
        dark: &DarkFrame,
        rows: &CameraRowSet,
    ) -> Result<GrayCodePhotos, CaptureError> {
        let light = &self.manifest.light;
        let listed = rows.iter().collect();
        GrayCodePhotos::collect(light.extent(), listed, |axis, bit, inverted| {
            self.read_gray_code_photo(dark, rows, (axis, bit, inverted))
        })
    }

    /// Reads `rows` of the photographs of one bit of an axis; `dark` was read there.
    ///
    /// # Errors
    /// Those of [`read_gray_code`](Self::read_gray_code).
    pub fn read_gray_code_bit(
        &self,
        dark: &DarkFrame,
        rows: &CameraRowSet,
        axis: LightPlaneAxis,
        bit: u32,
    ) -> Result<BitPair, CaptureError> {
        let photo = |inverted| self.read_gray_code_photo(dark, rows, (axis, bit, inverted));
        Ok(BitPair {
            plain: photo(false)?,
            inverted: photo(true)?,
        })
    }

    fn read_gray_code_photo(
        &self,
        dark: &DarkFrame,
        rows: &CameraRowSet,
        (axis, bit, inverted): (LightPlaneAxis, u32, bool),
    ) -> Result<LinearPhoto, CaptureError> {
        let Some(i) = self.manifest.gray_code_index(axis, bit, inverted) else {
            let problem = CaptureErrorKind::MissingGrayCode {
                axis,
                bit,
                inverted,
            };
            return Err(CaptureError::new(self.manifest_path(), problem));
        };
        let field = format!("graycode[{i}].photo");
        let mut reader = self.open_photo(&self.manifest.graycode[i].photo, field, 1.0)?;
        let mut photo = LinearPhoto::new();
        reader.read(&self.pixels_of(rows), dark, &mut photo)?;
        reader.finish()?;
        Ok(photo)
    }

    /// Reads `pixels` of the dark frame; zeros if there is none.
    ///
    /// # Errors
    /// If the photograph cannot be read.
    pub fn read_dark(&self, pixels: &CameraPixelSet) -> Result<DarkFrame, CaptureError> {
        let mut reader = self.open_dark()?;
        let dark = reader.read(pixels)?;
        reader.finish()?;
        Ok(dark)
    }

    /// Reads these rows of the dark frame, as [`read_dark`](Self::read_dark) does.
    ///
    /// # Errors
    /// If the photograph cannot be read.
    pub fn read_dark_rows(&self, rows: &CameraRowSet) -> Result<DarkFrame, CaptureError> {
        self.read_dark(&self.pixels_of(rows))
    }

    /// Opens the dark frame, if there is one.
    ///
    /// # Errors
    /// If it is missing, or not a 16-bit photograph of the camera's size.
    pub fn open_dark(&self) -> Result<DarkFrameReader<'_, F>, CaptureError> {
        let camera = &self.manifest.camera;
        let open = |name| self.photograph(name, "dark".to_owned()).open_codes();
        let dark = self.manifest.dark.as_deref();
        Ok(DarkFrameReader {
            camera,
            codes: dark.map(open).transpose()?,
            next_row: 0,
        })
    }

    /// Opens the flood photograph, if the manifest names one, as it were if the display did not dim.
    ///
    /// # Errors
    /// If it is missing or not a 16-bit photograph of the camera's size.
    pub fn open_flood(&self) -> Result<Option<PhotographRowReader<'_, F>>, CaptureError> {
        let flood = self.manifest.flood.as_deref();
        let brightness = 1.0 - self.manifest.light.dimming.unwrap_or(0.0);
        let open = |name| self.open_photo(name, "flood".to_owned(), brightness);
        flood.map(open).transpose()
    }

    /// Opens the photograph of shot `i`.
    ///
    /// # Errors
    /// If it is missing or not a 16-bit photograph of the camera's size.
    ///
    /// # Panics
    /// If there is no such shot.
    pub fn open_shot(&self, i: usize) -> Result<PhotographRowReader<'_, F>, CaptureError> {
        let field = format!("shots[{i}].photo");
        let name = &self.manifest.shots[i].photo;
        self.open_photo(name, field, self.exposure(i))
    }

    /// Reads the pattern of shot `i`, as emission.
    ///
    /// # Errors
    /// If it is missing or not an 8-bit PNG of the light plane's size.
    ///
    /// # Panics
    /// If there is no such shot.
    pub fn read_pattern(&self, i: usize) -> Result<Pattern, CaptureError> {
        let (_, mut pattern) = self.pattern(i).read_pattern(&self.emission)?;
        self.manifest.light.dim(&mut pattern);
        Ok(pattern)
    }

    /// Number of planes of the pattern of shot `i`, by the head of its file: 1 if it is grey, 3 if it is coloured.
    ///
    /// # Errors
    /// If the file cannot be read, or is no pattern of the light plane's size.
    pub fn pattern_planes(&self, i: usize) -> Result<usize, CaptureError> {
        self.pattern(i).pattern_planes()
    }

    fn pattern(&self, i: usize) -> PictureFile<'_, F> {
        let light = self.manifest.light.extent();
        let (name, field) = (
            &self.manifest.shots[i].pattern,
            format!("shots[{i}].pattern"),
        );
        PictureFile::new(&self.files, name, light, Some(field))
    }

    /// Measurements of `shots` without any camera pixels yet. Their noise has only its floor.
    pub fn empty_measurements(
        &self,
        shots: &[usize],
        patterns: Vec<Pattern>,
        correspondence: Correspondence,
        noise: NoiseModel,
    ) -> Measurements {
        let full_scale = shots.iter().map(|&i| (1.0 / self.exposure(i)) as f32);
        Measurements {
            camera: self.manifest.camera.extent(),
            light: self.manifest.light.extent(),
            correspondence,
            patterns,
            full_scale: full_scale.collect(),
            loaded: CameraPixelSet::row_range(0..0, self.manifest.camera.width),
            photos: vec![LinearPhoto::new(); shots.len()],
            flood: None,
            noise,
        }
    }

    /// Relative exposure of shot `i`.
    ///
    /// # Panics
    /// If there is no such shot.
    pub fn exposure(&self, i: usize) -> f64 {
        self.manifest.shots[i].exposure.unwrap_or(1.0)
    }

    fn open_photo<'a>(
        &'a self,
        name: &'a str,
        field: String,
        exposure: f64,
    ) -> Result<PhotographRowReader<'a, F>, CaptureError> {
        Ok(PhotographRowReader {
            camera: &self.manifest.camera,
            exposure,
            codes: self.photograph(name, field).open_codes()?,
            next_row: 0,
            statistics: CodeStatistics::of_photograph(),
        })
    }

    /// All pixels of these rows.
    fn pixels_of(&self, rows: &CameraRowSet) -> CameraPixelSet {
        CameraPixelSet::of_rows(rows.clone(), self.manifest.camera.width)
    }

    /// The photograph `name`, which `field` of the manifest names.
    fn photograph<'a>(&'a self, name: &'a str, field: String) -> PictureFile<'a, F> {
        let extent = self.manifest.camera.extent();
        PictureFile::new(&self.files, name, extent, Some(field))
    }
}
