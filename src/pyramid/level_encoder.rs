//! Encodes the shards of the levels: those of level 0 are copies, those of a coarser level are made from the finer one as
//! a reader decodes it.
//!
//! Files of shards are kept in a temporary file. Memory holds the coded chunks of one shard and the index of each.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::ops::Range;

use super::coarsening::{Coarsening, unit_basis};
use super::geometry;
use super::reader::read_index;
use crate::export::{decode_tile as decode_record, encode_tile as encode_record};
use crate::format::{
    ChunkId, EncodedFile, EncoderInput, EncodingTarget, FileIndex, FormatError, FormatExtension,
    LevelTable, Metadata, MetadataText, ShardId, ShardPlace, Spool, decode_basis, decode_tile,
};
use crate::job_executor::Executor;
use crate::transport::{Basis, FloatTile, Geometry, TileRect};

/// Number of tiles that are made at a time.
const BATCH_TILES: usize = 64;

/// Gives the bytes of a chunk.
pub type FetchChunk<'a> = dyn Fn(ChunkId) -> Result<Vec<u8>, FormatError> + Sync + 'a;

/// A file of one level, from which those of several levels are made.
#[derive(Clone, Copy)]
pub struct PyramidSource<'a> {
    /// Its index.
    pub index: &'a FileIndex,
    /// Gives the bytes of its chunks, which are copied.
    pub fetch: &'a FetchChunk<'a>,
}

impl std::fmt::Debug for PyramidSource<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PyramidSource")
            .field("index", self.index)
            .finish_non_exhaustive()
    }
}

/// A level that the next is made from.
pub(super) trait FineLevel: Sync {
    /// The tile whose first pixel this is, in the level, with the basis of its coefficients.
    fn tile(&self, first: [u32; 2]) -> io::Result<(FloatTile, &Basis)>;
}

/// Level 0, in the file of one level.
pub(super) struct WholeFile<'a> {
    source: PyramidSource<'a>,
    basis: Basis,
}

impl<'a> WholeFile<'a> {
    pub(super) fn new(source: PyramidSource<'a>) -> Result<Self, FormatError> {
        let basis = decode_basis(source.index, source.fetch)?;
        Ok(Self { source, basis })
    }
}

impl FineLevel for WholeFile<'_> {
    fn tile(&self, first: [u32; 2]) -> io::Result<(FloatTile, &Basis)> {
        let PyramidSource { index, fetch } = self.source;
        let number = tile_number(&index.header.geometry, first);
        let tile = decode_tile(index, number, fetch).map_err(into_io)?;
        Ok((tile, &self.basis))
    }
}

/// The number of the tile with this first pixel.
fn tile_number(geometry: &Geometry, first: [u32; 2]) -> usize {
    let [column, row] = first.map(|at| at / geometry.tile_side);
    (row * geometry.tile_grid().width + column) as usize
}

/// A shard in the temporary file.
pub(super) struct SpooledShard {
    pub(super) id: ShardId,
    pub(super) place: Range<u64>,
    rect: TileRect,
    index: FileIndex,
    basis: Basis,
}

/// Shards of a level in the temporary file.
pub(super) struct SpooledLevel<'a, F> {
    spool: &'a Spool<F>,
    shard_side: u32,
    /// By row and column.
    shards: BTreeMap<[u32; 2], SpooledShard>,
}

impl<F: Read + Write + Seek + Send> SpooledLevel<'_, F> {
    /// The shards that are there, row by row.
    pub(super) fn shards(&self) -> impl Iterator<Item = &SpooledShard> {
        self.shards.values()
    }

    /// The file of a shard.
    pub(super) fn read(&self, shard: &SpooledShard) -> Result<Vec<u8>, FormatError> {
        let place = shard.place.clone();
        self.spool.read(place).map_err(FormatError::Spool)
    }
}

impl<F: Read + Write + Seek + Send> FineLevel for SpooledLevel<'_, F> {
    fn tile(&self, [x, y]: [u32; 2]) -> io::Result<(FloatTile, &Basis)> {
        let place = [y, x].map(|at| at / self.shard_side);
        let shard = self.shards.get(&place).ok_or(ErrorKind::NotFound)?;
        let geometry = &shard.index.header.geometry;
        let number = tile_number(geometry, [x - shard.rect.x, y - shard.rect.y]);
        let fetch = |chunk| fetch_within(self.spool, &shard.place, shard.index.range(chunk));
        let mut tile = decode_tile(&shard.index, number, fetch).map_err(into_io)?;
        tile.rect = moved(tile.rect, [shard.rect.x, shard.rect.y]);
        Ok((tile, &shard.basis))
    }
}

pub(super) struct LevelEncoder<'a, F, E> {
    source: PyramidSource<'a>,
    table: &'a LevelTable,
    /// `[level]`.
    geometries: Vec<Geometry>,
    /// Quantisation step of all levels; `None` for lossless files.
    step: Option<f32>,
    shard_metadata: Metadata,
    /// Files of shards.
    shards: Spool<F>,
    /// Tiles of one shard.
    tiles: Spool<F>,
    executor: &'a E,
}

impl<'a, F: Read + Write + Seek + Send, E: Executor> LevelEncoder<'a, F, E> {
    /// # Errors
    /// As [`write_pyramid`](super::write_pyramid).
    pub(super) fn new(
        source: PyramidSource<'a>,
        table: &'a LevelTable,
        [shards, tiles]: [Spool<F>; 2],
        executor: &'a E,
    ) -> Result<Self, FormatError> {
        let mut geometry = source.index.header.geometry.clone();
        if !geometry.tile_side.is_power_of_two() {
            let reason =
                "the side of its tiles is not a power of two; recover the photograph again";
            let error = io::Error::new(ErrorKind::InvalidInput, reason);
            return Err(FormatError::Source(error));
        }
        let mut geometries = Vec::new();
        for _ in 1..table.levels() {
            let coarse =
                geometry::halved(&geometry, executor).map_err(FormatError::InvalidGeometry)?;
            geometries.push(std::mem::replace(&mut geometry, coarse));
        }
        geometries.push(geometry);
        Ok(Self {
            source,
            table,
            geometries,
            step: source.index.quantisation_step(),
            shard_metadata: shard_metadata(&source.index.metadata)?,
            shards,
            tiles,
            executor,
        })
    }

    /// Appends a shard of level 0, a copy, to the temporary file.
    pub(super) fn copy_finest(&self, id: ShardId) -> Result<Range<u64>, FormatError> {
        if self.executor.is_cancelled() {
            return Err(FormatError::Source(ErrorKind::Interrupted.into()));
        }
        let PyramidSource { index, fetch } = self.source;
        let shard = self.shard_geometry(id);
        let tiles = tiles_of_shard(&self.geometries[0], &shard);
        let metadata = MetadataText::encode(&self.shard_metadata)?;
        let extensions = vec![place_of(id, &shard).extension()];
        let file = EncodedFile::copy_of(index, shard, &tiles, extensions, metadata, fetch)?;
        self.append(&file)
    }

    /// Makes the shards `ids` of a level below the root, from all tiles of `fine` that they cover. `made` gives those that are
    /// made already.
    pub(super) fn level(
        &self,
        level: u32,
        fine: &dyn FineLevel,
        ids: impl Iterator<Item = ShardId>,
        made: impl Fn(ShardId) -> Result<Option<Vec<u8>>, FormatError>,
    ) -> Result<SpooledLevel<'_, F>, FormatError> {
        let mut shards = BTreeMap::new();
        for id in ids {
            let geometry = self.shard_geometry(id);
            let (place, index) = match made(id)? {
                Some(bytes) => self.append_made(id, &bytes)?,
                None => {
                    let extensions = vec![place_of(id, &geometry).extension()];
                    let file = self.coarse_shard(level, fine, &geometry, extensions)?;
                    (self.append(&file)?, file.index().clone())
                }
            };
            let fetch = |chunk| fetch_within(&self.shards, &place, index.range(chunk));
            let basis = decode_basis(&index, fetch)?;
            let shard = SpooledShard {
                id,
                place,
                rect: self.table.rect(id),
                index,
                basis,
            };
            shards.insert([id.y, id.x], shard);
        }
        Ok(SpooledLevel {
            spool: &self.shards,
            shard_side: self.table.shard_side(),
            shards,
        })
    }

    /// The root, with the table of all shards.
    pub(super) fn root(
        &self,
        fine: &dyn FineLevel,
        table: &LevelTable,
    ) -> Result<EncodedFile, FormatError> {
        let level = table.levels() - 1;
        let root = self.coarse_shard(level, fine, &self.geometries[level as usize], Vec::new())?;
        let index = self.source.index;
        let mut extensions = index.extensions.clone();
        extensions.push(table.extension());
        root.with_extensions(extensions, index.metadata.clone())
    }

    /// Copies a shard from the temporary file.
    pub(super) fn copy_shard(
        &self,
        place: Range<u64>,
        out: &mut impl Write,
    ) -> Result<(), FormatError> {
        self.shards.copy(place, out)
    }

    /// Empties the temporary file: no level of it is needed any longer.
    pub(super) fn clear(&mut self) {
        self.shards.clear();
    }

    fn shard_geometry(&self, id: ShardId) -> Geometry {
        geometry::shard(&self.geometries[id.level as usize], self.table.rect(id))
    }

    fn append(&self, file: &EncodedFile) -> Result<Range<u64>, FormatError> {
        self.shards.append(|out| file.write(out).map_err(into_io))
    }

    fn append_made(
        &self,
        id: ShardId,
        bytes: &[u8],
    ) -> Result<(Range<u64>, FileIndex), FormatError> {
        let index = read_index(bytes)?;
        ShardPlace::check(&index, self.table, id, bytes.len() as u64)?;
        let place = self.shards.append(|out| out.write_all(bytes))?;
        Ok((place, index))
    }

    /// Encodes a shard, with this geometry, of a level.
    fn coarse_shard(
        &self,
        level: u32,
        fine: &dyn FineLevel,
        shard: &Geometry,
        extensions: Vec<FormatExtension>,
    ) -> Result<EncodedFile, FormatError> {
        let levels = Coarsening {
            fine: &self.geometries[level as usize - 1],
            coarse: &self.geometries[level as usize],
        };
        let basis = unit_basis(shard.window);
        let (rank, area) = (basis.as_ref().map_or(0, Basis::rank), shard.window.area());
        self.tiles.clear();
        let count = shard.tile_grid().area();
        let mut places = Vec::with_capacity(count);
        let origin = shard.correspondence.origin.camera;
        // A job returns the place of its tile, not the tile, which can take a hundred megabytes.
        let make = |i: usize| {
            let tile = self.coarse_tile(&levels, fine, moved(shard.tile(i), origin));
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
        fine: &dyn FineLevel,
        rect: TileRect,
    ) -> io::Result<FloatTile> {
        if self.executor.is_cancelled() {
            return Err(ErrorKind::Interrupted.into());
        }
        let within = levels.fine_rect(rect);
        let side = levels.fine.tile_side as usize;
        let steps = |first: u32, count: u32| (first..first + count).step_by(side);
        let corners = steps(within.y, within.extent.height)
            .flat_map(|y| steps(within.x, within.extent.width).map(move |x| [x, y]));
        levels.tile(rect, corners.map(|first| fine.tile(first)))
    }
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

fn place_of(id: ShardId, shard: &Geometry) -> ShardPlace {
    ShardPlace {
        level: id.level,
        origin: shard.correspondence.origin,
    }
}

/// Bytes of a shard in the temporary file.
fn fetch_within<F: Read + Write + Seek + Send>(
    spool: &Spool<F>,
    place: &Range<u64>,
    range: Range<u64>,
) -> Result<Vec<u8>, FormatError> {
    let range = place.start + range.start..place.start + range.end;
    spool.read(range).map_err(FormatError::Spool)
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
