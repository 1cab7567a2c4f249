//! Writes a file of several levels: level 0 shard by shard, then each level from the one before. Several processes may make
//! the shards of the coarser levels.

use std::io::{ErrorKind, Read, Seek, Write};
use std::ops::Range;

use super::level_encoder::{FineLevel, LevelEncoder, PyramidSource, SpooledLevel, WholeFile};
use super::level_shares::LevelShares;
use crate::format::{FormatError, LevelTable, ShardId, Spool};
use crate::job_executor::Executor;
use crate::transport::{Extent, Geometry};

/// Side up to which a picture has one level.
const MAX_SINGLE_SIDE: u32 = 1024;
/// Maximum side of the root: a first picture comes as fast as that of a small file.
const MAX_ROOT_SIDE: u32 = 512;
/// Usual side of shards: a screen shows a dozen, most of them whole, and the index of a gigapixel has few thousand.
pub const SHARD_SIDE: u32 = 512;

/// How many levels a file has, and how they are cut.
#[derive(Clone, Copy, Debug)]
pub struct PyramidLayout {
    /// Number of levels, at least two; [`level_count`] gives the usual one.
    pub levels: u32,
    /// Side of the shards in pixels, a power of two; usually [`SHARD_SIDE`].
    pub shard_side: u32,
    /// The largest file.
    pub max_bytes: u64,
}

impl PyramidLayout {
    /// So many levels of the usual shards, in a file of any size.
    pub fn of_levels(levels: u32) -> Self {
        Self {
            levels,
            shard_side: SHARD_SIDE,
            max_bytes: u64::MAX,
        }
    }

    /// The table of a picture with this geometry; its shards have no bytes yet.
    ///
    /// # Errors
    /// [`FormatError::DamagedSection`] if the last level would have more than one shard or a number is out of range.
    pub fn table(&self, geometry: &Geometry) -> Result<LevelTable, FormatError> {
        let Geometry { camera, light, .. } = geometry;
        LevelTable::new(*camera, *light, self.levels, self.shard_side)
    }
}

/// Number of levels that a picture of `camera` pixels should have.
pub fn level_count(camera: Extent) -> u32 {
    match camera.width.max(camera.height) <= MAX_SINGLE_SIDE {
        true => 1,
        false => least_level_count(camera, MAX_ROOT_SIDE),
    }
}

/// The smallest number of levels of which the last has sides of at most `max_side` pixels.
pub fn least_level_count(camera: Extent, max_side: u32) -> u32 {
    let side = camera.width.max(camera.height);
    1 + side.div_ceil(max_side).next_power_of_two().ilog2()
}

/// Gives the file of a shard that is made already, if it is.
pub type FetchShard<'a> = dyn Fn(ShardId) -> Result<Option<Vec<u8>>, FormatError> + 'a;

/// A [`FetchShard`] where none is made already.
///
/// # Errors
/// Never.
pub fn no_shard(_: ShardId) -> Result<Option<Vec<u8>>, FormatError> {
    Ok(None)
}

/// Writes a file of one level as one of several. `made` gives the shards that [`make_coarser_shards`] has made; the others
/// are made here. `spools` are two temporary files.
///
/// # Errors
/// Those of [`PyramidLayout::table`], [`FormatError::InvalidGeometry`] if no window covers those of a finer level,
/// [`FormatError::Source`] if the side of a tile is not a power of two ([`ErrorKind::InvalidInput`]) or the work is
/// cancelled ([`ErrorKind::Interrupted`]), [`FormatError::TooLarge`], [`FormatError::Spool`], [`FormatError::Write`], also for
/// a shard of more than 4 GiB ([`ErrorKind::FileTooLarge`]), and the errors of the source, of `made` and of
/// [`EncodedFile`](crate::format::EncodedFile).
pub fn write_pyramid<F: Read + Write + Seek + Send>(
    source: PyramidSource<'_>,
    made: &FetchShard<'_>,
    layout: PyramidLayout,
    spools: [Spool<F>; 2],
    executor: &impl Executor,
    out: &mut impl Write,
) -> Result<LevelTable, FormatError> {
    let mut table = layout.table(&source.index.header.geometry)?;
    let unfilled = table.clone();
    let encoder = LevelEncoder::new(source, &unfilled, spools, executor)?;
    // `[number in file order]`.
    let mut places = vec![0..0; table.shards().len()];
    for (place, id) in places.iter_mut().zip(table.shards()) {
        if id.level == 0 {
            *place = encoder.copy_finest(*id)?;
        }
    }
    let whole = WholeFile::new(source)?;
    let mut finer: Option<SpooledLevel<'_, F>> = None;
    for level in 1..table.levels() - 1 {
        let ids = table.shards_of(level);
        let coarse = encoder.level(level, level_or_whole(&finer, &whole), ids, made)?;
        for shard in coarse.shards() {
            if let Some(at) = table.number(shard.id) {
                places[at] = shard.place.clone();
            }
        }
        finer = Some(coarse);
    }
    for (i, Range { start, end }) in places.iter().enumerate() {
        let bytes = u32::try_from(end - start).map_err(|_| ErrorKind::FileTooLarge.into());
        table.set_bytes(i, bytes.map_err(FormatError::Write)?);
    }
    let root = encoder.root(level_or_whole(&finer, &whole), &table)?;
    let (smallest, limit) = (root.bytes() + table.bytes(), layout.max_bytes);
    if smallest > limit {
        return Err(FormatError::TooLarge { limit, smallest });
    }
    root.write(out)?;
    for place in places {
        encoder.copy_shard(place, out)?;
    }
    Ok(table)
}

/// Makes the shards of coarser levels that one of several processes has, as [`write_pyramid`] would. `take` gets the number
/// of each in `shares`, in order, and its file.
///
/// # Errors
/// As [`write_pyramid`], and those of `take`. Only the tiles that are below the process's shards are fetched.
pub fn make_coarser_shards<F: Read + Write + Seek + Send, E: From<FormatError>>(
    source: PyramidSource<'_>,
    shares: &LevelShares,
    process: usize,
    spools: [Spool<F>; 2],
    executor: &impl Executor,
    mut take: impl FnMut(usize, Vec<u8>) -> Result<(), E>,
) -> Result<(), E> {
    let mut encoder = LevelEncoder::new(source, shares.table(), spools, executor)?;
    let whole = WholeFile::new(source)?;
    for subtree in shares.subtrees(process) {
        encoder.clear();
        let mut finer: Option<SpooledLevel<'_, F>> = None;
        for level in 1..=subtree.level {
            let ids = shares.below(subtree, level);
            let fine = level_or_whole(&finer, &whole);
            let coarse = encoder.level(level, fine, ids, no_shard)?;
            for shard in coarse.shards() {
                if let Some(at) = shares.number(shard.id) {
                    take(at, coarse.read(shard)?)?;
                }
            }
            finer = Some(coarse);
        }
    }
    Ok(())
}

/// A level that is made already; level 0 before the first.
fn level_or_whole<'a, F: Read + Write + Seek + Send>(
    level: &'a Option<SpooledLevel<'_, F>>,
    whole: &'a WholeFile<'_>,
) -> &'a dyn FineLevel {
    match level {
        Some(level) => level,
        None => whole,
    }
}
