//! The finest level of a file, which is relit and compared: whole, or one row of shards at a time.

use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use rayon::prelude::*;

use super::ltm_file::{LIMITS, LtmFile, PrefixLength, open_ltm, read_ltm, read_range};
use super::process_resources::AllCoresExecutor;
use super::value_parsers::UsageError;
use crate::format::{MetadataText, ShardId};
use crate::pyramid::{PyramidReader, Shard};
use crate::relight::Light;
use crate::relight::cpu::LinearRelighter;
use crate::transport::{
    CHANNELS, Decibels, Extent, Geometry, SnrAccumulator, TileRect, TileTransportFunctions,
    Transport,
};

/// Gets rows of a picture, and their pixels.
type TakeRows<'a> = dyn FnMut(Range<u32>, &[[f32; CHANNELS]]) -> Result<()> + 'a;

/// The finest level of a file.
pub struct FinestLevel {
    pub geometry: Geometry,
    /// SNR relative to the recovered light transport.
    pub snr: Option<Decibels>,
    pub metadata: MetadataText,
    pub file_bytes: u64,
    /// Bytes that it is read from; fewer than `file_bytes` for a prefix.
    pub read_bytes: u64,
    /// Scans that are complete in the bytes read.
    pub read_scans: usize,
    pub scans: usize,
    source: Source,
}

enum Source {
    Whole(Box<LinearRelighter>),
    Shards(Box<ShardFile>),
}

/// A file of several levels.
struct ShardFile {
    path: PathBuf,
    file: File,
    reader: PyramidReader,
}

impl FinestLevel {
    /// Opens a file, or its prefix `first`.
    pub fn open(path: &Path, first: Option<PrefixLength>) -> Result<Self> {
        let (file, index) = open_ltm(path)?;
        let name = || path.display().to_string();
        let Some(reader) = PyramidReader::new(index, LIMITS).with_context(name)? else {
            return Ok(Self::whole(read_ltm(path, first)?));
        };
        if first.is_some() {
            return Err(UsageError("--first goes with files of one level").into());
        }
        let path = path.to_owned();
        let mut file = ShardFile { path, file, reader };
        let ShardFile {
            file: bytes,
            reader,
            ..
        } = &mut file;
        let mut fetch = |range| read_range(bytes, range);
        let first = ShardId {
            level: 0,
            x: 0,
            y: 0,
        };
        let index = reader.index(first, &mut fetch).with_context(name)?;
        Ok(Self {
            geometry: reader.finest_geometry(fetch).with_context(name)?,
            // All shards of level 0 have the scans of the file that they were copied from.
            snr: index.scans.last().map(|scan| scan.snr),
            metadata: reader.root().metadata.clone(),
            file_bytes: reader.file_bytes(),
            read_bytes: reader.file_bytes(),
            read_scans: index.scans.len(),
            scans: index.scans.len(),
            source: Source::Shards(Box::new(file)),
        })
    }

    fn whole(file: LtmFile) -> Self {
        let LtmFile {
            index,
            transport,
            progress,
        } = file;
        Self {
            geometry: transport.geometry.clone(),
            snr: index.scans.last().map(|scan| scan.snr),
            file_bytes: index.header.file_bytes,
            read_bytes: progress.bytes,
            read_scans: progress.scans,
            scans: index.scans.len(),
            metadata: index.metadata,
            source: Source::Whole(Box::new(LinearRelighter::new(Arc::new(transport)))),
        }
    }

    /// Relights it. `take` gets the picture in linear light from the top down: rows, and their pixels.
    ///
    /// # Panics
    /// If the light's extent is not that of the level's light plane.
    pub fn relight(
        &mut self,
        light: &Light,
        mut take: impl FnMut(Range<u32>, &[[f32; CHANNELS]]) -> Result<()>,
    ) -> Result<()> {
        match &mut self.source {
            Source::Whole(relighter) => {
                relighter.relight(light, &AllCoresExecutor);
                take(0..self.geometry.camera.height, &linear_rgb(relighter))
            }
            Source::Shards(file) => file.relight(light, &mut take),
        }
    }

    /// The whole picture under a light, in linear light.
    pub fn picture(&mut self, light: &Light) -> Result<Vec<[f32; CHANNELS]>> {
        let (mut picture, camera) = (Vec::new(), self.geometry.camera);
        let reserved = picture.try_reserve_exact(camera.area());
        reserved.with_context(|| format!("there is no memory for a picture of {camera} pixels"))?;
        self.relight(light, |_, pixels| {
            picture.extend_from_slice(pixels);
            Ok(())
        })?;
        Ok(picture)
    }

    /// Adds up the errors of all light transport functions, a tile at a time.
    pub fn sum_over_tiles(
        &mut self,
        error: impl Fn(&TileTransportFunctions) -> SnrAccumulator + Sync,
    ) -> Result<SnrAccumulator> {
        let sum = |transport: &Transport, [x, y]: [u32; 2]| -> SnrAccumulator {
            let tiles = transport.tiles.par_iter().map(|tile| {
                let mut functions = tile.functions(&transport.geometry, &transport.basis);
                functions.rect.x += x;
                functions.rect.y += y;
                error(&functions)
            });
            tiles.sum()
        };
        match &mut self.source {
            Source::Whole(relighter) => Ok(sum(relighter.transport(), [0; 2])),
            Source::Shards(file) => {
                let mut total = SnrAccumulator::default();
                for id in file.shards(0..u32::MAX) {
                    let Shard { rect, transport } = file.shard(id)?;
                    total.merge(sum(&transport, [rect.x, rect.y]));
                }
                Ok(total)
            }
        }
    }
}

impl ShardFile {
    /// The shards of level 0 with pixels in these rows.
    fn shards(&self, rows: Range<u32>) -> impl Iterator<Item = ShardId> + use<> {
        let whole = TileRect {
            x: 0,
            y: rows.start,
            extent: Extent::new(u32::MAX, rows.end - rows.start),
        };
        self.reader.shards_in(0, whole)
    }

    fn shard(&mut self, id: ShardId) -> Result<Shard> {
        let rect = self.reader.table().rect(id);
        let fetch = |range| read_range(&mut self.file, range);
        let shard = self.reader.shard(id, rect, fetch);
        shard.with_context(|| format!("{}: {id}", self.path.display()))
    }

    fn relight(&mut self, light: &Light, take: &mut TakeRows<'_>) -> Result<()> {
        let (camera, side) = (
            self.reader.table().camera(0),
            self.reader.table().shard_side(),
        );
        let width = camera.width as usize;
        for first in (0..camera.height).step_by(side as usize) {
            let rows = first..camera.height.min(first + side);
            let mut pixels = vec![[0.0; CHANNELS]; rows.len() * width];
            for id in self.shards(rows.clone()) {
                let Shard { rect, transport } = self.shard(id)?;
                let light = light.part(transport.geometry.light_region());
                let mut relighter = LinearRelighter::new(Arc::new(transport));
                relighter.relight(&light, &AllCoresExecutor);
                let relit = linear_rgb(&relighter);
                let columns = rect.x as usize..(rect.x + rect.extent.width) as usize;
                let shard_rows = relit.chunks_exact(columns.len());
                for (to, from) in pixels.chunks_exact_mut(width).zip(shard_rows) {
                    to[columns.clone()].copy_from_slice(from);
                }
            }
            take(rows, &pixels)?;
        }
        Ok(())
    }
}

/// The relit picture; the relighter has a fourth number a pixel.
fn linear_rgb(relighter: &LinearRelighter) -> Vec<[f32; CHANNELS]> {
    let pixels = relighter.linear().pixels.into_iter();
    pixels
        .map(|[red, green, blue, _]| [red, green, blue])
        .collect()
}
