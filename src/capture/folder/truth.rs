//! `truth/`: the known transport of a simulated capture, and pictures relit by it.
//!
//! `tau.npy` has τ as float16 `[N, w, w, 3]`, `uv.npy` the correspondence as float32 `[N, 2]`.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use half::f16;
use npyz::NpyFile;

use super::image_file::ImageFile;
use crate::capture::error::CaptureError;
use crate::capture::manifest::Manifest;
use crate::transport::{CHANNELS, Element, Extent, LightPx, Window};

/// Code in `relit_NAME.png` for a measurement of 1.
pub const RELIT_FULL_SCALE: f64 = 0.9 * 65535.0;

/// Known transport, and pictures under lights that recovery does not use.
#[derive(Debug)]
pub struct Truth {
    root: PathBuf,
    camera: Extent,
    light: Extent,
    emission: [f64; 256],
    window: Window,
    origins: Vec<Element>,
    tau: Vec<[f16; CHANNELS]>,
}

impl Truth {
    /// Reads `tau.npy` and `uv.npy` from the folder `root`; `None` where there is no such folder.
    pub(super) fn open(root: &Path, manifest: &Manifest) -> Result<Option<Self>, CaptureError> {
        if !root.is_dir() {
            return Ok(None);
        }
        let camera = manifest.camera.extent();
        let n = camera.area() as u64;
        let (tau_path, uv_path) = (root.join("tau.npy"), root.join("uv.npy"));
        let tau = open_npy(&tau_path)?;
        let window = match *tau.shape() {
            [pixels, h, w, 3] if pixels == n && h == w => {
                u32::try_from(w).ok().and_then(|w| Window::new(w).ok())
            }
            _ => None,
        };
        let Some(window) = window else {
            let found = tau.shape();
            let problem = format!("has shape {found:?}, not [{n}, w, w, 3] with w odd");
            return Err(truth_error(&tau_path, problem));
        };
        let tau: Vec<f16> = read_npy(&tau_path, tau)?;
        let uv = open_npy(&uv_path)?;
        if uv.shape() != [n, 2] {
            let problem = format!("has shape {:?}, not [{n}, 2]", uv.shape());
            return Err(truth_error(&uv_path, problem));
        }
        let uv: Vec<f32> = read_npy(&uv_path, uv)?;
        let origins = uv.chunks_exact(2).map(|uv| {
            window.origin(LightPx {
                u: f64::from(uv[0]),
                v: f64::from(uv[1]),
            })
        });
        Ok(Some(Self {
            root: root.to_owned(),
            camera,
            light: manifest.light.extent(),
            emission: manifest.light.emission(),
            window,
            origins: origins.collect(),
            tau: tau.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        }))
    }

    /// Camera grid.
    pub fn camera(&self) -> Extent {
        self.camera
    }

    /// Light grid.
    pub fn light_plane(&self) -> Extent {
        self.light
    }

    /// The window of τ.
    pub fn window(&self) -> Window {
        self.window
    }

    /// Window origin of pixel `n`.
    pub fn window_origin(&self, n: usize) -> Element {
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
        let io = |source| CaptureError::Io {
            path: self.root.clone(),
            source,
        };
        let mut names = Vec::new();
        for entry in std::fs::read_dir(&self.root).map_err(io)? {
            let name = entry.map_err(io)?.file_name();
            let light = name.to_str().and_then(|n| n.strip_prefix("light_"));
            if let Some(name) = light.and_then(|n| n.strip_suffix(".png")) {
                names.push(name.to_owned());
            }
        }
        names.sort();
        Ok(names)
    }

    /// The emission of light `name`, `[M, 3]`.
    ///
    /// # Errors
    /// If its picture cannot be read.
    pub fn light(&self, name: &str) -> Result<Vec<f32>, CaptureError> {
        let path = self.root.join(format!("light_{name}.png"));
        let planes = ImageFile::new(path, self.light, None).read_pattern()?;
        let rgb = (0..self.light.area())
            .flat_map(|m| [0, 1, 2].map(|c| planes[c.min(planes.len() - 1)][m]))
            .map(|code| self.emission[usize::from(code)] as f32);
        Ok(rgb.collect())
    }

    /// The true picture under light `name`, `[N]`, in units of the measurement.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn relit(&self, name: &str) -> Result<Vec<[f64; CHANNELS]>, CaptureError> {
        let path = self.root.join(format!("relit_{name}.png"));
        let codes = ImageFile::new(path, self.camera, None).read_rgb16()?;
        let linear = |code| f64::from(code) / RELIT_FULL_SCALE;
        Ok(codes.into_iter().map(|codes| codes.map(linear)).collect())
    }
}

fn truth_error(path: &Path, problem: impl ToString) -> CaptureError {
    CaptureError::Truth {
        path: path.to_owned(),
        problem: problem.to_string(),
    }
}

fn open_npy(path: &Path) -> Result<NpyFile<BufReader<File>>, CaptureError> {
    let file = File::open(path).map_err(|source| CaptureError::Io {
        path: path.to_owned(),
        source,
    })?;
    NpyFile::new(BufReader::new(file)).map_err(|e| truth_error(path, e))
}

fn read_npy<T: npyz::Deserialize>(
    path: &Path,
    npy: NpyFile<BufReader<File>>,
) -> Result<Vec<T>, CaptureError> {
    if npy.order() != npyz::Order::C {
        return Err(truth_error(path, "is in Fortran order; C order is needed"));
    }
    let values = npy.data::<T>().map_err(|e| truth_error(path, e))?;
    let values: Result<Vec<T>, _> = values.collect();
    values.map_err(|e| truth_error(path, e))
}
