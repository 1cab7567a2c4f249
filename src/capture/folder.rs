//! A capture folder on disk.

use std::path::{Path, PathBuf};

use super::images;
use super::{CaptureError, MANIFEST_NAME, Manifest, Measurements, Pattern, Truth};
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
    /// What was seen, `[N]`, in units of the measurement; NaN where saturated.
    pub picture: Vec<[f32; CHANNELS]>,
}

/// Light seen while the display is dark, `[N]`, in units of the measurement.
#[derive(Clone, Debug)]
pub struct DarkFrame(Vec<[f32; CHANNELS]>);

impl CaptureFolder {
    /// Opens the folder `root` and reads its manifest.
    pub fn open(root: &Path) -> Result<Self, CaptureError> {
        let path = root.join(MANIFEST_NAME);
        let json = std::fs::read_to_string(&path).map_err(|source| match source.kind() {
            std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory => {
                CaptureError::Missing {
                    path: path.clone(),
                    named_by: String::new(),
                }
            }
            _ => CaptureError::Io {
                path: path.clone(),
                source,
            },
        })?;
        let manifest = Manifest::parse(&json, &path)?;
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

    /// Known transport, where the folder has any.
    pub fn truth(&self) -> Result<Option<Truth>, CaptureError> {
        Truth::open(&self.root.join("truth"), &self.manifest)
    }

    /// Camera pixels to light elements.
    pub fn correspondence(&self) -> Result<Correspondence, CaptureError> {
        match &self.manifest.correspondence {
            Some(spec) => Ok(spec.into()),
            None => Err(CaptureError::Field {
                path: self.root.join(MANIFEST_NAME),
                field: "correspondence".to_owned(),
                problem: "is missing; give its \"affine\" map (decoding Gray code is not yet \
                          supported)"
                    .to_owned(),
            }),
        }
    }

    /// Reads the dark frame; without one, nothing is seen in the dark.
    pub fn read_dark(&self) -> Result<DarkFrame, CaptureError> {
        let camera = &self.manifest.camera;
        Ok(DarkFrame(match &self.manifest.dark {
            None => vec![[0.0; CHANNELS]; camera.extent().area()],
            Some(name) => images::rgb16(&self.root.join(name), camera.extent(), "dark")?
                .into_iter()
                .map(|codes| codes.map(|code| self.linear(code, 1.0)))
                .collect(),
        }))
    }

    /// Reads shot `i`: its pattern as emitted light, its photograph as measurement less the dark.
    ///
    /// # Panics
    /// If there is no such shot.
    pub fn read_shot(&self, i: usize, dark: &DarkFrame) -> Result<Exposed, CaptureError> {
        let shot = &self.manifest.shots[i];
        let (light, camera) = (&self.manifest.light, &self.manifest.camera);
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
        let codes = images::rgb16(&self.root.join(&shot.photo), camera.extent(), &named)?;
        let exposure = shot.exposure.unwrap_or(1.0);
        let picture = codes.into_iter().zip(&dark.0).map(|(codes, dark)| {
            std::array::from_fn(|c| match f64::from(codes[c]) >= camera.white {
                true => f32::NAN,
                false => self.linear(codes[c], exposure) - dark[c],
            })
        });
        Ok(Exposed {
            pattern,
            picture: picture.collect(),
        })
    }

    /// Joins shots into measurements.
    pub fn measurements(&self, shots: Vec<Exposed>) -> Result<Measurements, CaptureError> {
        let (patterns, pictures) = shots.into_iter().map(|s| (s.pattern, s.picture)).unzip();
        Ok(Measurements {
            camera: self.manifest.camera.extent(),
            light: self.manifest.light.extent(),
            correspondence: self.correspondence()?,
            patterns,
            pictures,
        })
    }

    /// `(code − black) / (white − black)` at unit exposure. The dark frame holds light, which grows
    /// with exposure, so it is subtracted after this, not from the code.
    fn linear(&self, code: u16, exposure: f64) -> f32 {
        let camera = &self.manifest.camera;
        ((f64::from(code) - camera.black) / (camera.white - camera.black) / exposure) as f32
    }
}
