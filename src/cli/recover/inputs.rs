//! What a recovery reads: the capture's shots, and the options.

use anyhow::{Context, Result, bail};

use super::args::RecoveryOptions;
use super::messages;
use crate::capture::CaptureFolder;
use crate::cli::levels_output::levels_of;
use crate::cli::value_parsers::ByteCount;
use crate::export::{CaptureSize, FILE_TILE_SIDE, MemoryPlan, TooLittleMemory, select_shots};
use crate::recover::{MIN_PATTERNS, RecoverError};
use crate::transport::Window;

/// A capture, and what is recovered from it.
pub struct RecoveryInputs<'a> {
    /// As it is declared.
    pub folder: &'a CaptureFolder,
    pub options: &'a RecoveryOptions,
    /// Indices of the shots to recover from.
    pub shots: Vec<usize>,
    /// Number of levels of the file.
    pub levels: u32,
}

impl<'a> RecoveryInputs<'a> {
    /// The shots and levels by `options`.
    ///
    /// # Errors
    /// If options contradict one another or the capture.
    pub fn new(folder: &'a CaptureFolder, options: &'a RecoveryOptions) -> Result<Self> {
        options.check()?;
        let manifest = folder.manifest();
        let path = || folder.manifest_path().display().to_string();
        let shots = select_shots(&manifest.shots, options.patterns.map(|k| k as usize))
            .map_err(messages::too_few_shots)?;
        if shots.len() < MIN_PATTERNS {
            if let Some(patterns) = options.patterns {
                bail!("--patterns is {patterns}, but recovery needs at least {MIN_PATTERNS}");
            }
            return Err(RecoverError::TooFewPatterns(shots.len())).with_context(path);
        }
        let levels = levels_of(options.levels, manifest.camera.extent()).with_context(path)?;
        Ok(Self {
            folder,
            options,
            shots,
            levels,
        })
    }

    /// Rows of tiles of the file.
    pub fn file_tile_rows(&self) -> u32 {
        self.folder
            .manifest()
            .camera
            .height
            .div_ceil(FILE_TILE_SIDE)
    }

    /// How recovery and encoding use at most `limit` bytes.
    ///
    /// # Errors
    /// If they are too few.
    pub fn memory_plan(&self, limit: ByteCount) -> Result<MemoryPlan> {
        let (manifest, method) = (self.folder.manifest(), self.options.method());
        let window = self.options.window;
        let capture = CaptureSize {
            camera: manifest.camera.extent(),
            light: manifest.light.extent(),
            shots: self.shots.len(),
            gray_code: match manifest.correspondence {
                Some(_) => 0,
                None => manifest.graycode.len(),
            },
        };
        // The file of an estimated window may take more.
        let encoding = window.map_or(0, |window| {
            let components = encoded_components(self.levels, window, method.max_rank(window));
            MemoryPlan::min_encoding_bytes(capture.camera, window, components)
        });
        let (limit, threads) = (limit.0, rayon::current_num_threads());
        match MemoryPlan::new(limit, capture, method, window, threads) {
            Ok(plan) if limit >= encoding => Ok(plan),
            plan => {
                let min = plan.map_or_else(|error| error.min, |_| 0).max(encoding);
                Err(messages::too_little_memory(TooLittleMemory { limit, min }))
            }
        }
    }
}

/// Number of tiles of a file of so many levels that are encoded at once, if those of the recovery have `rank` components.
///
/// # Errors
/// If the memory is too little for one.
pub fn encoders(plan: &MemoryPlan, levels: u32, window: Window, rank: usize) -> Result<usize> {
    let encoders = plan.tiles_encoded_at_once(window, encoded_components(levels, window, rank));
    encoders.map_err(messages::too_little_memory)
}

/// Number of components of the tiles that are encoded.
fn encoded_components(levels: u32, window: Window, rank: usize) -> usize {
    match levels {
        1 => rank,
        // The tiles of coarser levels have one for each element of the window.
        _ => window.area(),
    }
}
