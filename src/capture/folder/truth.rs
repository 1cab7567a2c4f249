//! `truth/`: the known transport of a simulated capture, and pictures relit by it.
//!
//! `tau.npy` has τ as float16 `[N, w, w, 3]`, `uv.npy` the correspondence as float32 `[N, 2]`.

use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;

use half::f16;
use npyz::NpyFile;

use super::disk_files::DiskFiles;
use super::picture_file::PictureFile;
use crate::capture::error::{CaptureError, CaptureErrorKind};
use crate::capture::manifest::Manifest;
use crate::capture::measurements::Pattern;
use crate::transport::{CHANNELS, Extent, LightElement, LightPosition, Window};

/// Code in `relit_NAME.png` for a measurement of 1.
pub const RELIT_FULL_SCALE: f64 = 0.9 * 65535.0;

/// Known transport, and pictures under lights that recovery does not use.
#[derive(Debug)]
pub struct GroundTruth {
    files: DiskFiles,
    emission: [f64; 256],
    /// Camera grid.
    pub camera: Extent,
    /// Light plane.
    pub light_plane: Extent,
    /// The window of τ.
    pub window: Window,
    origins: Vec<LightElement>,
    tau: Vec<[f16; CHANNELS]>,
}

impl GroundTruth {
    /// Reads `tau.npy` and `uv.npy` from the folder `root`; `None` where there is no such folder.
    pub(super) fn open(root: &Path, manifest: &Manifest) -> Result<Option<Self>, CaptureError> {
        if !root.is_dir() {
            return Ok(None);
        }
        let camera = manifest.camera.extent();
        let n = camera.area() as u64;
        let tau_path = root.join("tau.npy");
        let (window, tau) = read_npy::<f16, _>(&tau_path, |shape| {
            let window = match *shape {
                [pixels, h, w, 3] if pixels == n && h == w => {
                    u32::try_from(w).ok().and_then(|w| Window::new(w).ok())
                }
                _ => None,
            };
            window.ok_or_else(|| format!("has shape {shape:?}, not [{n}, w, w, 3] with w odd"))
        })?;
        let uv_path = root.join("uv.npy");
        let ((), uv) = read_npy::<f32, _>(&uv_path, |shape| match shape == [n, 2] {
            true => Ok(()),
            false => Err(format!("has shape {shape:?}, not [{n}, 2]")),
        })?;
        let (uv, _) = uv.as_chunks();
        let origin = |uv: &[f32; 2]| {
            let [u, v] = uv.map(f64::from);
            window.origin(LightPosition { u, v })
        };
        Ok(Some(Self {
            files: DiskFiles {
                root: root.to_owned(),
            },
            emission: manifest.light.emission(),
            camera,
            light_plane: manifest.light.extent(),
            window,
            origins: uv.iter().map(origin).collect(),
            tau: tau.as_chunks().0.to_vec(),
        }))
    }

    /// Window origin of pixel `n`.
    pub fn window_origin(&self, n: usize) -> LightElement {
        self.origins[n]
    }

    /// τ of pixel `n`, `[S]` by window rows then columns.
    pub fn tau(&self, n: usize) -> &[[f16; CHANNELS]] {
        let area = self.window.area();
        &self.tau[n * area..(n + 1) * area]
    }

    /// Names of the lights with a true picture, sorted.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn lights(&self) -> Result<Vec<String>, CaptureError> {
        let io = |e| CaptureError::new(&self.files.root, CaptureErrorKind::Io(e));
        let mut names = Vec::new();
        for entry in std::fs::read_dir(&self.files.root).map_err(io)? {
            let name = entry.map_err(io)?.file_name();
            let light = name.to_str().and_then(|n| n.strip_prefix("light_"));
            if let Some(name) = light.and_then(|n| n.strip_suffix(".png")) {
                names.push(name.to_owned());
            }
        }
        names.sort();
        Ok(names)
    }

    /// The emission of light `name`.
    ///
    /// # Errors
    /// If its picture cannot be read.
    pub fn light(&self, name: &str) -> Result<Pattern, CaptureError> {
        let name = format!("light_{name}.png");
        let file = PictureFile::new(&self.files, &name, self.light_plane, None);
        Ok(file.read_pattern(&self.emission)?.1)
    }

    /// The true picture under light `name`, `[N]`, in units of the measurement.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn relit(&self, name: &str) -> Result<Vec<[f64; CHANNELS]>, CaptureError> {
        let name = format!("relit_{name}.png");
        let file = PictureFile::new(&self.files, &name, self.camera, None);
        let codes = file.read_codes()?.1.into_iter();
        let linear = |code| f64::from(code) / RELIT_FULL_SCALE;
        Ok(codes.map(|codes| codes.map(linear)).collect())
    }
}

fn truth_error(path: &Path, problem: String) -> CaptureError {
    CaptureError::new(path, CaptureErrorKind::InvalidTruth(problem))
}

/// Reads a NumPy file: what `check` makes of its shape, before the values are read, and the values.
fn read_npy<T: npyz::Deserialize, S>(
    path: &Path,
    check: impl FnOnce(&[u64]) -> Result<S, String>,
) -> Result<(S, Vec<T>), CaptureError> {
    let file = File::open(path).map_err(|e| CaptureError::new(path, CaptureErrorKind::Io(e)))?;
    let read = || {
        let npy = NpyFile::new(BufReader::new(file))?;
        if npy.order() != npyz::Order::C {
            let problem = "is in Fortran order; C order is needed";
            return Err(io::Error::other(problem));
        }
        let shape = check(npy.shape()).map_err(io::Error::other)?;
        Ok((shape, npy.into_vec()?))
    };
    read().map_err(|e| match e.raw_os_error() {
        Some(_) => CaptureError::new(path, CaptureErrorKind::Io(e)),
        None => truth_error(path, e.to_string()),
    })
}
