//! Encodes recovered tiles as an `.ltm` file.

use std::io::{self, ErrorKind};
use std::ops::Range;

use super::tile_record;
#[cfg(not(target_arch = "wasm32"))]
use crate::capture::Measurements;
use crate::format::{
    ChunkStore, DistortionMetric, EncodedFile, EncoderInput, EncodingTarget, FormatError, Metadata,
};
#[cfg(not(target_arch = "wasm32"))]
use crate::format::{CodingPlan, EncodedTile, TileEncoder, TileSample};
use crate::job_executor::Executor;
use crate::recover::{HoldoutValidation, PreparedRecovery};
use crate::transport::{Basis, Decibels, FloatTile, Geometry, TileTransportFunctions};

/// Camera pixels along a side of a tile in the file. Larger tiles than those of the recovery compress better; these are
/// still small enough to load only the visible ones.
pub const FILE_TILE_SIDE: u32 = 128;
/// Default loss of SNR by the file, as hold-out validation estimates it. Validation recovers from fewer patterns, and
/// so with slightly more noise.
const DEFAULT_LOSS: Decibels = Decibels(0.5);
/// Default SNR of the file relative to the recovered transport without hold-out validation. With so few patterns the
/// transport is noisy.
const DEFAULT_SNR: Decibels = Decibels(32.0);

/// Camera pixels of a picture that is no larger than the sample, so that all of its tiles are analysed before one is encoded.
#[cfg(not(target_arch = "wasm32"))]
const MAX_WHOLLY_ANALYSED: usize = 1 << 14;

/// The quality of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FileQuality {
    /// As much as the noise of the photographs justifies.
    #[default]
    ByNoise,
    /// This SNR of the file relative to the recovered transport.
    Snr(Decibels),
    /// The best file of at most so many bytes.
    MaxBytes(u64),
    /// Eleven bits of every value, for archives.
    Lossless,
}

impl FileQuality {
    fn target(self, metric: Option<&HoldoutValidation>) -> EncodingTarget<'_> {
        match (self, metric) {
            (Self::ByNoise, Some(metric)) => EncodingTarget::Loss(DEFAULT_LOSS, metric),
            (Self::ByNoise, None) => EncodingTarget::Snr(DEFAULT_SNR),
            (Self::Snr(snr), _) => EncodingTarget::Snr(snr),
            (Self::MaxBytes(bytes), _) => EncodingTarget::Bytes(bytes),
            (Self::Lossless, _) => EncodingTarget::Lossless,
        }
    }
}

/// The loss of SNR on held-out patterns.
impl DistortionMetric for HoldoutValidation {
    fn tiles(&self) -> Vec<FloatTile> {
        self.tiles().cloned().collect()
    }

    fn loss(&self, functions: &[TileTransportFunctions]) -> Decibels {
        self.loss(functions)
    }
}

/// Encodes the tiles of `recovery`; `record` gives that of a tile, as [`encode_tile`](super::encode_tile) made it, and
/// `new_store` a store for the chunks.
///
/// # Errors
/// Those of [`EncodedFile::new_in`]. A record that cannot be read is [`FormatError::Source`], and so is cancellation, as
/// [`ErrorKind::Interrupted`].
pub fn encode_file<S: ChunkStore>(
    recovery: &PreparedRecovery,
    record: &(dyn Fn(usize) -> io::Result<Vec<u8>> + Sync),
    metadata: Metadata,
    quality: FileQuality,
    executor: &impl Executor,
    new_store: impl Fn() -> Result<S, FormatError> + Sync,
) -> Result<EncodedFile<S>, FormatError> {
    let tile = |i| unless_cancelled(executor, || file_tile(recovery, record, i));
    let source = EncoderInput {
        geometry: file_geometry(recovery),
        basis: recovery.basis(),
        tile: &tile,
        metadata,
        extensions: Vec::new(),
    };
    EncodedFile::new_in(
        new_store,
        source,
        quality.target(recovery.holdout_validation()),
        executor,
    )
}

/// Plans the file from squares of the picture, so that its tiles can be encoded one by one. `measurements` are those that the
/// recovery was prepared from. Returns `None` where all tiles decide: for a number of bytes, and for small pictures.
///
/// # Errors
/// Those of [`CodingPlan::new`].
#[cfg(not(target_arch = "wasm32"))]
pub fn plan_file(
    recovery: &PreparedRecovery,
    measurements: &Measurements,
    quality: FileQuality,
    executor: &impl Executor,
) -> Result<Option<CodingPlan>, FormatError> {
    let geometry = file_geometry(recovery);
    if matches!(quality, FileQuality::MaxBytes(_)) || geometry.camera.area() <= MAX_WHOLLY_ANALYSED
    {
        return Ok(None);
    }
    let sample = TileSample {
        geometry: &geometry,
        basis: recovery.basis(),
        tiles: recovery.sample_tiles(measurements, executor),
        may_have_functions: recovery.may_have_functions(),
        max_measurement: measurements.full_scale.iter().copied().fold(0.0, f32::max),
    };
    let target = quality.target(recovery.holdout_validation());
    CodingPlan::new(sample, target, executor).map(Some)
}

/// Encodes all tiles of `recovery` by a plan. `record` gives that of a tile, as [`encode_tile`](super::encode_tile) made it, and
/// `store` takes the chunks.
///
/// # Errors
/// [`FormatError::Source`] as those of [`encode_file`], [`FormatError::Compress`], and those of the store and of metadata.
#[cfg(not(target_arch = "wasm32"))]
pub fn encode_planned<S: ChunkStore>(
    recovery: &PreparedRecovery,
    plan: &CodingPlan,
    record: &(dyn Fn(usize) -> io::Result<Vec<u8>> + Sync),
    metadata: &Metadata,
    executor: &impl Executor,
    mut store: S,
) -> Result<EncodedFile<S>, FormatError> {
    let geometry = file_geometry(recovery);
    let tiles = geometry.tile_grid().area();
    let mut heads = Vec::with_capacity(tiles);
    for_encoded_tiles(
        recovery,
        plan,
        record,
        0..tiles,
        executor,
        |tile, encoded| {
            heads.push(encoded.head);
            store.put_tile(tile, tiles, encoded.chunks.into_iter())
        },
    )?;
    EncodedFile::of_tiles(plan, geometry, heads.iter(), store, metadata)
}

/// Encodes these `tiles` of the file by a plan, and gives them to `take` in order.
///
/// # Errors
/// [`FormatError::Source`] as those of [`encode_file`], [`FormatError::Compress`], and those of `take`.
#[cfg(not(target_arch = "wasm32"))]
pub fn for_encoded_tiles<E: From<FormatError>>(
    recovery: &PreparedRecovery,
    plan: &CodingPlan,
    record: &(dyn Fn(usize) -> io::Result<Vec<u8>> + Sync),
    tiles: Range<usize>,
    executor: &impl Executor,
    take: impl FnMut(usize, EncodedTile) -> Result<(), E>,
) -> Result<(), E> {
    let geometry = file_geometry(recovery);
    let encoder = TileEncoder::new(plan, &geometry, recovery.basis())?;
    let tile = |i| unless_cancelled(executor, || file_tile(recovery, record, i));
    encoder.encode_each(tiles, tile, executor, take)
}

/// What `read` gives, or [`ErrorKind::Interrupted`] once the executor is cancelled.
fn unless_cancelled<T>(
    executor: &impl Executor,
    read: impl FnOnce() -> io::Result<T>,
) -> io::Result<T> {
    match executor.is_cancelled() {
        true => Err(ErrorKind::Interrupted.into()),
        false => read(),
    }
}

/// The geometry of the file, whose tiles are larger than those of `recovery`.
pub fn file_geometry(recovery: &PreparedRecovery) -> Geometry {
    Geometry {
        tile_side: FILE_TILE_SIDE,
        ..recovery.geometry().clone()
    }
}

/// A tile of the file, from the records of those of `recovery`.
///
/// # Errors
/// If a record cannot be read or is damaged.
pub fn file_tile(
    recovery: &PreparedRecovery,
    record: &dyn Fn(usize) -> io::Result<Vec<u8>>,
    index: usize,
) -> io::Result<FloatTile> {
    let recovered = recovery.geometry();
    let rank = recovery.basis().map_or(0, Basis::rank);
    let area = recovered.window.area();
    let rect = file_geometry(recovery).tile(index);
    let mut tile = FloatTile::dark(rect);
    let columns = tile_indices(rect.x, rect.extent.width, recovered.tile_side);
    let rows = tile_indices(rect.y, rect.extent.height, recovered.tile_side);
    for (x, y) in columns.flat_map(|x| rows.clone().map(move |y| (x, y))) {
        let i = (y * recovered.tile_grid().width + x) as usize;
        let part = tile_record::decode(recovered.tile(i), rank, area, &record(i)?)?;
        tile.insert(&part);
    }
    Ok(tile)
}

/// Columns or rows of the recovered tiles that cover `length` pixels from `start`.
fn tile_indices(start: u32, length: u32, side: u32) -> Range<u32> {
    start / side..(start + length).div_ceil(side)
}
