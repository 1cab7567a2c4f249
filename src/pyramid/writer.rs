//! Writes a file of several levels: level 0 shard by shard, then each level from the one before as a reader decodes it.
//!
//! Shards are kept in a temporary file until all lengths are known. Memory holds the coded chunks of one shard and the
//! index of each.

use std::io::{self, ErrorKind, Read, Seek, Write};
use std::ops::Range;

use super::coarsening::{Coarsening, unit_basis};
use super::geometry;
use crate::export::{decode_tile as decode_record, encode_tile as encode_record};
use crate::format::{
    ChunkId, EncodedFile, EncoderInput, EncodingTarget, FileIndex, FormatError, FormatExtension,
    LevelTable, Metadata, MetadataText, ShardId, ShardPlace, Spool, decode_basis, decode_tile,
};
use crate::job_executor::Executor;
use crate::transport::{Basis, Extent, FloatTile, Geometry, TileRect};

/// Side up to which a picture has one level.
const MAX_SINGLE_SIDE: u32 = 1024;
/// Maximum side of the root: a first picture comes as fast as that of a small file.
const MAX_ROOT_SIDE: u32 = 512;
/// Usual side of shards: a screen shows a dozen, most of them whole, and the index of a gigapixel has few thousand.
pub const SHARD_SIDE: u32 = 512;
/// Number of tiles that are made at a time.
const BATCH_TILES: usize = 64;

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

/// Gives the bytes of a chunk.
type FetchChunk<'a> = dyn Fn(ChunkId) -> Result<Vec<u8>, FormatError> + Sync + 'a;

/// Writes a file of one level, whose index is `index`, as one of several. `fetch` gives the bytes of its chunks, which are
/// copied; `spools` are two temporary files.
///
/// # Errors
/// [`FormatError::DamagedSection`] if the last level would have more than one shard or a number is out of range,
/// [`FormatError::InvalidGeometry`] if no window covers those of a finer level, [`FormatError::Source`] if the side of a tile is
/// not a power of two ([`ErrorKind::InvalidInput`]) or the work is cancelled ([`ErrorKind::Interrupted`]),
/// [`FormatError::TooLarge`], [`FormatError::Spool`], [`FormatError::Write`], also for a shard of more than 4 GiB ([`ErrorKind::FileTooLarge`]), and the
/// errors of `fetch` and of [`EncodedFile`].
pub fn write_pyramid<F: Read + Write + Seek + Send>(
    index: &FileIndex,
    fetch: &FetchChunk<'_>,
    layout: PyramidLayout,
    spools: [Spool<F>; 2],
    executor: &impl Executor,
    out: &mut impl Write,
) -> Result<LevelTable, FormatError> {
    let geometry = &index.header.geometry;
    let PyramidLayout {
        levels,
        shard_side,
        max_bytes,
    } = layout;
    let table = LevelTable::new(geometry.camera, geometry.light, levels, shard_side)?;
    if !geometry.tile_side.is_power_of_two() {
        let reason = "the side of its tiles is not a power of two; recover the photograph again";
        let error = io::Error::new(ErrorKind::InvalidInput, reason);
        return Err(FormatError::Source(error));
    }
    let [shards, tiles] = spools;
    let writer = PyramidWriter {
        index,
        fetch,
        step: index.quantisation_step(),
        shard_metadata: shard_metadata(&index.metadata)?,
        table,
        shards,
        tiles,
        executor,
        max_bytes,
    };
    writer.write(out)
}

/// Numbers of the tiles of a picture that cover a shard of it, row by row.
fn tiles_of_shard(whole: &Geometry, shard: &Geometry) -> Vec<usize> {
    let (side, grid) = (whole.tile_side, whole.tile_grid());
    let [column, row] = shard.correspondence.origin.camera.map(|first| first / side);
    let cells = shard.tile_grid().cells();
    cells
        .map(|(x, y)| ((row + y) * grid.width + column + x) as usize)
        .collect()
}

/// What the metadata of a shard say: all that affects its picture.
fn shard_metadata(metadata: &MetadataText) -> Result<Metadata, FormatError> {
    let Metadata {
        writer,
        method,
        units,
        color_matrix,
        ..
    } = metadata.read()?;
    Ok(Metadata {
        writer,
        method,
        units,
        color_matrix,
        ..Metadata::default()
    })
}

struct PyramidWriter<'a, F, E> {
    /// Of the file of one level.
    index: &'a FileIndex,
    fetch: &'a FetchChunk<'a>,
    /// Quantisation step of all levels; `None` for lossless files.
    step: Option<f32>,
    shard_metadata: Metadata,
    table: LevelTable,
    /// Files of shards.
    shards: Spool<F>,
    /// Tiles of one shard.
    tiles: Spool<F>,
    executor: &'a E,
    max_bytes: u64,
}

/// A shard in the temporary file.
struct SpooledShard {
    rect: TileRect,
    place: Range<u64>,
    index: FileIndex,
    basis: Basis,
}

/// The shards of a level, row by row.
struct SpooledLevel {
    geometry: Geometry,
    grid: Extent,
    shards: Vec<SpooledShard>,
}

impl<F: Read + Write + Seek + Send, E: Executor> PyramidWriter<'_, F, E> {
    fn write(mut self, out: &mut impl Write) -> Result<LevelTable, FormatError> {
        let mut level = self.finest_level()?;
        let mut places = vec![0..0; self.table.shards().len()];
        let root = self.table.levels() - 1;
        for number in 1..=root {
            self.record_places(number - 1, &level, &mut places);
            let coarse = geometry::halved(&level.geometry).map_err(FormatError::InvalidGeometry)?;
            if number < root {
                level = self.level(number, &level, coarse)?;
                continue;
            }
            for (i, place) in places.iter().enumerate() {
                let bytes = u32::try_from(place.end - place.start);
                let bytes = bytes.map_err(|_| ErrorKind::FileTooLarge.into());
                self.table.set_bytes(i, bytes.map_err(FormatError::Write)?);
            }
            let root = self.root(&level, coarse)?;
            let (bytes, limit) = (root.bytes() + self.table.bytes(), self.max_bytes);
            if bytes > limit {
                let smallest = bytes;
                return Err(FormatError::TooLarge { limit, smallest });
            }
            root.write(out)?;
        }
        for place in places {
            self.shards.copy(place, out)?;
        }
        Ok(self.table)
    }

    /// Records where the shards of a level are in the temporary file, `[number in file order]`.
    fn record_places(&self, number: u32, level: &SpooledLevel, places: &mut [Range<u64>]) {
        for (shard, (x, y)) in level.shards.iter().zip(level.grid.cells()) {
            let id = ShardId {
                level: number,
                x,
                y,
            };
            if let Some(at) = self.table.number(id) {
                places[at] = shard.place.clone();
            }
        }
    }

    /// Level 0, whose shards are copies.
    fn finest_level(&self) -> Result<SpooledLevel, FormatError> {
        let whole = &self.index.header.geometry;
        self.shards(0, whole.clone(), |shard, extensions| {
            if self.executor.is_cancelled() {
                return Err(FormatError::Source(ErrorKind::Interrupted.into()));
            }
            let metadata = MetadataText::encode(&self.shard_metadata)?;
            let tiles = tiles_of_shard(whole, &shard);
            EncodedFile::copy_of(self.index, shard, &tiles, extensions, metadata, self.fetch)
        })
    }

    /// The level with this number, from the finer one before it.
    fn level(
        &self,
        number: u32,
        fine: &SpooledLevel,
        coarse: Geometry,
    ) -> Result<SpooledLevel, FormatError> {
        let levels = Coarsening {
            fine: &fine.geometry,
            coarse: &coarse,
        };
        self.shards(number, coarse.clone(), |shard, extensions| {
            self.coarse_shard(&levels, fine, &shard, extensions)
        })
    }

    /// The root, with the table of all shards.
    fn root(&self, fine: &SpooledLevel, coarse: Geometry) -> Result<EncodedFile, FormatError> {
        let levels = Coarsening {
            fine: &fine.geometry,
            coarse: &coarse,
        };
        let root = self.coarse_shard(&levels, fine, &coarse, Vec::new())?;
        let mut extensions = self.index.extensions.clone();
        extensions.push(self.table.extension());
        root.with_extensions(extensions, self.index.metadata.clone())
    }

    /// Makes all shards of a level: `make` gets the geometry and the extensions of each.
    fn shards(
        &self,
        number: u32,
        geometry: Geometry,
        make: impl Fn(Geometry, Vec<FormatExtension>) -> Result<EncodedFile, FormatError>,
    ) -> Result<SpooledLevel, FormatError> {
        let grid = self.table.shard_grid(number);
        let mut shards = Vec::with_capacity(grid.area());
        for (x, y) in grid.cells() {
            let id = ShardId {
                level: number,
                x,
                y,
            };
            let rect = self.table.rect(id);
            let shard = geometry::shard(&geometry, rect);
            let place = ShardPlace {
                level: number,
                origin: shard.correspondence.origin,
            };
            let file = make(shard, vec![place.extension()])?;
            let place = self.shards.append(|out| file.write(out).map_err(into_io))?;
            let index = file.index().clone();
            drop(file);
            let fetch = |chunk| self.fetch(&place, index.range(chunk));
            let basis = decode_basis(&index, fetch)?;
            shards.push(SpooledShard {
                rect,
                place,
                index,
                basis,
            });
        }
        Ok(SpooledLevel {
            geometry,
            grid,
            shards,
        })
    }

    /// Bytes of a shard in the temporary file.
    fn fetch(&self, place: &Range<u64>, range: Range<u64>) -> Result<Vec<u8>, FormatError> {
        let range = place.start + range.start..place.start + range.end;
        self.shards.read(range).map_err(FormatError::Spool)
    }

    /// Encodes a shard, with this geometry, of the coarser of two levels.
    fn coarse_shard(
        &self,
        levels: &Coarsening<'_>,
        fine: &SpooledLevel,
        shard: &Geometry,
        extensions: Vec<FormatExtension>,
    ) -> Result<EncodedFile, FormatError> {
        let basis = unit_basis(shard.window);
        let (rank, area) = (basis.as_ref().map_or(0, Basis::rank), shard.window.area());
        self.tiles.clear();
        let count = shard.tile_grid().area();
        let mut places = Vec::with_capacity(count);
        let origin = shard.correspondence.origin.camera;
        // A job returns the place of its tile, not the tile, which can take a hundred megabytes.
        let make = |i: usize| {
            let tile = self.coarse_tile(levels, fine, moved(shard.tile(i), origin));
            let tile = tile.map_err(FormatError::Source)?;
            let place = (!tile.is_dark()).then(|| {
                let record = encode_record(&tile);
                self.tiles.append(|out| out.write_all(&record))
            });
            place.transpose()
        };
        for first in (0..count).step_by(BATCH_TILES) {
            let batch = BATCH_TILES.min(count - first);
            for place in self.executor.map(batch, |i| make(first + i)) {
                places.push(place?);
            }
        }
        let tile = |i: usize| {
            let rect = shard.tile(i);
            match &places[i] {
                None => Ok(FloatTile::dark(rect)),
                Some(place) => decode_record(rect, rank, area, &self.tiles.read(place.clone())?),
            }
        };
        let input = EncoderInput {
            geometry: shard.clone(),
            basis: basis.as_ref(),
            tile: &tile,
            metadata: self.shard_metadata.clone(),
            extensions,
        };
        match self.step {
            Some(step) => EncodedFile::with_step(input, step, self.executor),
            None => EncodedFile::new(input, EncodingTarget::Lossless, self.executor),
        }
    }

    /// The tile with the pixels `rect` of the coarser of two levels.
    fn coarse_tile(
        &self,
        levels: &Coarsening<'_>,
        fine: &SpooledLevel,
        rect: TileRect,
    ) -> io::Result<FloatTile> {
        if self.executor.is_cancelled() {
            return Err(ErrorKind::Interrupted.into());
        }
        let within = levels.fine_rect(rect);
        let (shard_side, tile_side) = (self.table.shard_side(), levels.fine.tile_side);
        let steps = |first: u32, count: u32| (first..first + count).step_by(tile_side as usize);
        let corners = steps(within.y, within.extent.height)
            .flat_map(|y| steps(within.x, within.extent.width).map(move |x| [x, y]));
        let tiles = corners.map(|[x, y]| {
            let [column, row] = [x, y].map(|at| at / shard_side);
            let shard = &fine.shards[(row * fine.grid.width + column) as usize];
            let geometry = &shard.index.header.geometry;
            let [column, row] = [x - shard.rect.x, y - shard.rect.y].map(|at| at / tile_side);
            let number = (row * geometry.tile_grid().width + column) as usize;
            let fetch = |chunk| self.fetch(&shard.place, shard.index.range(chunk));
            let mut tile = decode_tile(&shard.index, number, fetch).map_err(into_io)?;
            tile.rect = moved(tile.rect, [shard.rect.x, shard.rect.y]);
            Ok((tile, &shard.basis))
        });
        levels.tile(rect, tiles)
    }
}

fn moved(rect: TileRect, [x, y]: [u32; 2]) -> TileRect {
    TileRect {
        x: rect.x + x,
        y: rect.y + y,
        ..rect
    }
}

fn into_io(error: FormatError) -> io::Error {
    match error {
        FormatError::Source(error) | FormatError::Write(error) | FormatError::Spool(error) => error,
        other => io::Error::other(other),
    }
}
