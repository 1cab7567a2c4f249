//! A capture folder on disk.

use std::path::{Path, PathBuf};

use super::images::{self, Rgb16Rows};
use super::{
    CaptureError, MANIFEST_NAME, Manifest, Measurements, Noise, Pattern, Photo, Picture, Rows,
    Truth,
};
use crate::calibrate::{BitPair, GrayCode};
use crate::transport::{CHANNELS, Correspondence};

/// An opened capture folder: its manifest is checked, its pictures are not yet read.
#[derive(Debug)]
pub struct CaptureFolder {
    root: PathBuf,
    manifest: Manifest,
    emission: [f64; 256],
}

/// What is seen while the display is dark.
#[derive(Clone, Debug)]
pub struct DarkFrame {
    light: Picture,
    /// What it tells of noise.
    noise: Noise,
}

impl DarkFrame {
    /// What was seen, `[N]`, in units of the measurement.
    pub(super) fn light(&self) -> &[[f32; CHANNELS]] {
        &self.light
    }
}

impl CaptureFolder {
    /// Opens the folder `root` and reads its manifest.
    pub fn open(root: &Path) -> Result<Self, CaptureError> {
        let path = root.join(MANIFEST_NAME);
        let problem = match (root.exists(), root.is_dir(), path.exists()) {
            (false, ..) => Some("there is no such folder"),
            (_, false, _) => Some("is a file"),
            (.., false) => Some("is not a capture folder: it has no capture.json"),
            _ => None,
        };
        if let Some(problem) = problem {
            return Err(CaptureError::NotACapture {
                path: root.to_owned(),
                problem,
            });
        }
        let text = std::fs::read_to_string(&path).map_err(|source| CaptureError::Io {
            path: path.clone(),
            source,
        })?;
        // Some editors put a byte order mark first, which is no JSON.
        let json = text.strip_prefix('\u{feff}').unwrap_or(&text);
        let manifest = Manifest::parse(json, &path)?;
        Ok(Self {
            root: root.to_owned(),
            emission: manifest.light.emission(),
            manifest,
        })
    }

    /// The manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The files that recovery from `shots` reads, by their names in the manifest, with where they
    /// lie.
    pub fn files(&self, shots: &[usize]) -> Vec<(&str, PathBuf)> {
        let manifest = &self.manifest;
        let shots = shots.iter().map(|&i| &manifest.shots[i]);
        let shots = shots.flat_map(|shot| [&shot.pattern, &shot.photo]);
        let gray_code = match manifest.correspondence {
            Some(_) => &[][..],
            None => &manifest.graycode,
        };
        let gray_code = gray_code.iter().map(|shot| &shot.photo);
        let names = manifest
            .dark
            .iter()
            .chain(shots)
            .chain(gray_code)
            .map(String::as_str);
        std::iter::once(MANIFEST_NAME)
            .chain(names)
            .map(|name| (name, self.root.join(name)))
            .collect()
    }

    /// Where the manifest lies.
    pub fn manifest_path(&self) -> PathBuf {
        self.root.join(MANIFEST_NAME)
    }

    /// Known transport, where the folder has any.
    pub fn truth(&self) -> Result<Option<Truth>, CaptureError> {
        Truth::open(&self.root.join("truth"), &self.manifest)
    }

    /// Camera pixels to light elements, where the manifest gives it.
    pub fn correspondence(&self) -> Option<Correspondence> {
        self.manifest.correspondence.as_ref().map(Into::into)
    }

    /// Reads `rows` of the photographs of Gray code. Every bit needs its inverse.
    pub fn read_gray_code(&self, dark: &DarkFrame, rows: &Rows) -> Result<GrayCode, CaptureError> {
        let bits = |axis: &str, side: u32| -> Result<Vec<BitPair>, CaptureError> {
            let shots = || self.manifest.graycode.iter().enumerate();
            let photo = |bit, inverted| {
                let wanted = shots().find(|(_, shot)| {
                    shot.axis == axis && shot.bit == bit && shot.inverted == inverted
                });
                let Some((i, shot)) = wanted else {
                    return Err(self.field_error(
                        "graycode",
                        format!(
                            "has no photograph of axis {axis}, bit {bit}, inverted {inverted}; \
                             add it, or give \"correspondence\""
                        ),
                    ));
                };
                let named = format!("graycode[{i}].photo");
                let mut photo = self.photo(&shot.photo, &named, 1.0, dark)?;
                let mut picture = Picture::new();
                photo.read(rows, &mut picture)?;
                photo.finish()?;
                Ok(picture)
            };
            let pair = |bit| {
                Ok(BitPair {
                    plain: photo(bit, false)?,
                    inverted: photo(bit, true)?,
                })
            };
            // Most significant first, and none left out: a gap would shift all bits below it.
            let numbers = 0..side.next_power_of_two().ilog2().max(1);
            numbers.rev().map(pair).collect()
        };
        Ok(GrayCode {
            x: bits("x", self.manifest.light.width)?,
            y: bits("y", self.manifest.light.height)?,
            rows: rows.iter().collect(),
        })
    }

    /// Reads the dark frame; without one, nothing is seen in the dark.
    pub fn read_dark(&self) -> Result<DarkFrame, CaptureError> {
        let camera = &self.manifest.camera;
        let light = match &self.manifest.dark {
            None => vec![[0.0; CHANNELS]; camera.extent().area()],
            Some(name) => images::rgb16(&self.root.join(name), camera.extent(), "dark")?
                .into_iter()
                .map(|codes| codes.map(|code| camera.linear(code, 1.0)))
                .collect(),
        };
        let code = 1.0 / (camera.white - camera.black);
        let noise = Noise::from_dark(&light, camera.width, code);
        Ok(DarkFrame { light, noise })
    }

    /// Opens the flood photograph, where the manifest names one.
    pub fn flood<'a>(&'a self, dark: &'a DarkFrame) -> Result<Option<Photo<'a>>, CaptureError> {
        let flood = self.manifest.flood.as_ref();
        let open = |name: &String| self.photo(name, "flood", 1.0, dark);
        flood.map(open).transpose()
    }

    /// Opens the photograph of shot `i`.
    ///
    /// # Panics
    /// If there is no such shot.
    pub fn shot<'a>(&'a self, i: usize, dark: &'a DarkFrame) -> Result<Photo<'a>, CaptureError> {
        let shot = &self.manifest.shots[i];
        let named = format!("shots[{i}].photo");
        self.photo(&shot.photo, &named, self.exposure(i), dark)
    }

    /// Reads the pattern of shot `i`, as emitted light.
    ///
    /// # Panics
    /// If there is no such shot.
    pub fn read_pattern(&self, i: usize) -> Result<Pattern, CaptureError> {
        let path = self.root.join(&self.manifest.shots[i].pattern);
        let named = format!("shots[{i}].pattern");
        let planes = images::codes8(&path, self.manifest.light.extent(), &named)?;
        let mut planes = planes.into_iter().map(|codes| {
            let emitted = codes
                .into_iter()
                .map(|c| self.emission[usize::from(c)] as f32);
            emitted.collect::<Vec<_>>()
        });
        Ok(match (planes.next(), planes.next(), planes.next()) {
            (Some(r), Some(g), Some(b)) => Pattern::Rgb([r, g, b]),
            (grey, ..) => Pattern::Grey(grey.unwrap_or_default()),
        })
    }

    /// Relative exposure of shot `i`.
    fn exposure(&self, i: usize) -> f64 {
        self.manifest.shots[i].exposure.unwrap_or(1.0)
    }

    fn photo<'a>(
        &'a self,
        name: &str,
        named_by: &str,
        exposure: f64,
        dark: &'a DarkFrame,
    ) -> Result<Photo<'a>, CaptureError> {
        let camera = &self.manifest.camera;
        let codes = Rgb16Rows::open(&self.root.join(name), camera.extent(), named_by)?;
        Ok(Photo::new(camera, dark, exposure, codes))
    }

    fn field_error(&self, field: &str, problem: String) -> CaptureError {
        CaptureError::Field {
            path: self.manifest_path(),
            field: field.to_owned(),
            problem,
        }
    }

    /// Measurements of `shots` that have no camera row yet, and of whose noise the floor is known.
    pub fn no_rows(
        &self,
        shots: &[usize],
        patterns: Vec<Pattern>,
        correspondence: Correspondence,
        dark: &DarkFrame,
    ) -> Measurements {
        let full_scale = shots.iter().map(|&i| (1.0 / self.exposure(i)) as f32);
        Measurements {
            camera: self.manifest.camera.extent(),
            light: self.manifest.light.extent(),
            correspondence,
            patterns,
            full_scale: full_scale.collect(),
            rows: Rows::from_strips([]),
            pictures: vec![Picture::new(); shots.len()],
            noise: dark.noise,
        }
    }
}
