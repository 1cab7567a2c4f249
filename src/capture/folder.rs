//! A capture folder on disk.

use std::path::{Path, PathBuf};

use super::images;
use super::noise::{self, Noise};
use super::{CaptureError, MANIFEST_NAME, Manifest, Measurements, Pattern, Picture, Truth};
use crate::calibrate::{BitPair, GrayCode};
use crate::transport::{CHANNELS, Correspondence};

/// An opened capture folder: its manifest is checked, its pictures are not yet read.
#[derive(Debug)]
pub struct CaptureFolder {
    root: PathBuf,
    manifest: Manifest,
    emission: [f64; 256],
}

/// One shot, linear.
#[derive(Clone, Debug)]
pub struct Exposed {
    /// What was shown.
    pub pattern: Pattern,
    /// Measurement at which a sample saturates.
    pub full_scale: f32,
    /// What was seen.
    pub picture: Picture,
}

/// What is seen while the display is dark.
#[derive(Clone, Debug)]
pub struct DarkFrame {
    light: Picture,
    /// Variance of a sample without light, by channel.
    floor: [f64; CHANNELS],
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

    /// Reads the photographs of Gray code. Every bit needs its inverse.
    pub fn read_gray_code(&self, dark: &DarkFrame) -> Result<GrayCode, CaptureError> {
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
                self.read_photo(&shot.photo, &format!("graycode[{i}].photo"), 1.0, dark)
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
        })
    }

    /// Reads the dark frame; without one, nothing is seen in the dark.
    pub fn read_dark(&self) -> Result<DarkFrame, CaptureError> {
        let camera = &self.manifest.camera;
        let light = match &self.manifest.dark {
            None => vec![[0.0; CHANNELS]; camera.extent().area()],
            Some(name) => images::rgb16(&self.root.join(name), camera.extent(), "dark")?
                .into_iter()
                .map(|codes| codes.map(|code| self.linear(code, 1.0)))
                .collect(),
        };
        let code = 1.0 / (camera.white - camera.black);
        let floor = noise::floor(&light, camera.width, code);
        Ok(DarkFrame { light, floor })
    }

    /// Reads the flood photograph, where the manifest names one.
    pub fn read_flood(&self, dark: &DarkFrame) -> Result<Option<Picture>, CaptureError> {
        let flood = self.manifest.flood.as_ref();
        flood
            .map(|name| self.read_photo(name, "flood", 1.0, dark))
            .transpose()
    }

    /// Reads shot `i`: its pattern as emitted light, its photograph as measurement less the dark.
    ///
    /// # Panics
    /// If there is no such shot.
    pub fn read_shot(&self, i: usize, dark: &DarkFrame) -> Result<Exposed, CaptureError> {
        let shot = &self.manifest.shots[i];
        let light = &self.manifest.light;
        let named = format!("shots[{i}].pattern");
        let planes = images::codes8(&self.root.join(&shot.pattern), light.extent(), &named)?;
        let mut planes = planes.into_iter().map(|codes| {
            let emitted = codes
                .into_iter()
                .map(|c| self.emission[usize::from(c)] as f32);
            emitted.collect::<Vec<_>>()
        });
        let pattern = match (planes.next(), planes.next(), planes.next()) {
            (Some(r), Some(g), Some(b)) => Pattern::Rgb([r, g, b]),
            (grey, ..) => Pattern::Grey(grey.unwrap_or_default()),
        };
        let named = format!("shots[{i}].photo");
        let exposure = shot.exposure.unwrap_or(1.0);
        Ok(Exposed {
            pattern,
            full_scale: (1.0 / exposure) as f32,
            picture: self.read_photo(&shot.photo, &named, exposure, dark)?,
        })
    }

    /// Reads a photograph as measurement less the dark, NaN where saturated.
    fn read_photo(
        &self,
        name: &str,
        named_by: &str,
        exposure: f64,
        dark: &DarkFrame,
    ) -> Result<Picture, CaptureError> {
        let camera = &self.manifest.camera;
        let codes = images::rgb16(&self.root.join(name), camera.extent(), named_by)?;
        let picture = codes.into_iter().zip(&dark.light).map(|(codes, dark)| {
            std::array::from_fn(|c| match f64::from(codes[c]) >= camera.white {
                true => f32::NAN,
                false => self.linear(codes[c], exposure) - dark[c],
            })
        });
        Ok(picture.collect())
    }

    fn field_error(&self, field: &str, problem: String) -> CaptureError {
        CaptureError::Field {
            path: self.manifest_path(),
            field: field.to_owned(),
            problem,
        }
    }

    /// Joins shots into measurements, and finds out how noisy they are.
    pub fn measurements(
        &self,
        shots: Vec<Exposed>,
        correspondence: Correspondence,
        dark: &DarkFrame,
        flood: Option<Picture>,
    ) -> Measurements {
        let full_scale = shots.iter().map(|s| s.full_scale).collect();
        let (patterns, pictures) = shots.into_iter().map(|s| (s.pattern, s.picture)).unzip();
        let mut measurements = Measurements {
            camera: self.manifest.camera.extent(),
            light: self.manifest.light.extent(),
            correspondence,
            patterns,
            full_scale,
            pictures,
            flood,
            noise: Noise {
                gain: [0.0; CHANNELS],
                floor: dark.floor,
            },
        };
        measurements.noise = Noise::with_gain_from(&measurements);
        measurements
    }

    /// `(code − black) / (white − black)` at unit exposure. The dark frame holds light, which grows
    /// with exposure, so it is subtracted after this, not from the code.
    fn linear(&self, code: u16, exposure: f64) -> f32 {
        let camera = &self.manifest.camera;
        ((f64::from(code) - camera.black) / (camera.white - camera.black) / exposure) as f32
    }
}
