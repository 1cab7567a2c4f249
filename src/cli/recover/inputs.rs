//! What a recovery reads: the capture's shots, and the options.

use anyhow::{Context, Result, bail};

use super::args::RecoveryOptions;
use super::messages;
use crate::capture::CaptureFolder;
use crate::cli::levels_output::levels_of;
use crate::cli::value_parsers::ByteCount;
use crate::export::{
    CaptureSize, EncodingMemory, FILE_TILE_SIDE, MemoryPlan, TooLittleMemory, select_shots,
};
use crate::recover::{MIN_PATTERNS, RecoverError};
use crate::transport::{CHANNELS, Geometry, Window};

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
        let (capture, method) = (self.capture_size(), self.options.method());
        let window = self.options.window;
        // The file of an estimated window may take more.
        let encoding = window.map_or(0, |window| {
            let components = encoded_components(self.levels, window, method.max_rank(window));
            EncodingMemory::min_bytes(capture.camera, window, components)
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

    /// How the recovery of tiles in `window` uses at most `limit` bytes.
    ///
    /// # Errors
    /// If they are too few.
    pub fn tiles_memory_plan(&self, limit: ByteCount, window: Window) -> Result<MemoryPlan> {
        let (capture, method) = (self.capture_size(), self.options.method());
        let threads = rayon::current_num_threads();
        MemoryPlan::of_tiles(limit.0, capture, method, window, threads)
            .map_err(messages::too_little_memory)
    }

    /// Planes of the pattern of a shot; of one that cannot be read the most there may be, and who reads it tells the error.
    fn pattern_planes(&self, shot: usize) -> usize {
        self.folder.pattern_planes(shot).unwrap_or(CHANNELS)
    }

    fn capture_size(&self) -> CaptureSize {
        let manifest = self.folder.manifest();
        CaptureSize {
            camera: manifest.camera.extent(),
            light: manifest.light.extent(),
            shots: self.shots.len(),
            pattern_planes: self.shots.iter().map(|&i| self.pattern_planes(i)).sum(),
            gray_code: match manifest.correspondence {
                Some(_) => 0,
                None => manifest.graycode.len(),
            },
        }
    }
}

/// The memory for encoding within `limit` bytes, by all threads of the present pool.
pub fn encoding_memory(limit: ByteCount) -> EncodingMemory {
    EncodingMemory {
        limit: limit.0,
        threads: rayon::current_num_threads(),
    }
}

/// Number of tiles of a file of so many levels that are encoded at once, if those of the recovery have `rank` components.
///
/// # Errors
/// If the memory is too little for one.
pub fn encoders(
    memory: EncodingMemory,
    geometry: &Geometry,
    levels: u32,
    rank: usize,
) -> Result<usize> {
    let components = encoded_components(levels, geometry.window, rank);
    let encoders = memory.tiles_at_once(geometry.camera, geometry.window, components);
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
