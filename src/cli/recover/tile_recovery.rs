//! Recovers tiles, strip by strip of the photographs.

use std::ops::{AddAssign, Range};

use anyhow::{Context, Result};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::capture_sample::{CaptureSample, SampleSource};
use super::prepared_job::PreparedJob;
use crate::capture::{CameraPixelSet, CaptureFolder, DefectivePixels, Measurements};
use crate::cli::measurement_reader::MeasurementReader;
use crate::cli::progress;
use crate::export;
use crate::job_executor::Executor;
use crate::recover::MIN_PATTERNS;

/// Level of zstd for tiles: the fastest, as each is read a few times and then deleted.
const ZSTD_LEVEL: i32 = 1;

/// Where recovered tiles go.
pub trait TileSink: Sync {
    /// Number of tiles that are there.
    fn count(&self) -> usize;

    /// Whether tile `i` is there.
    fn has(&self, i: usize) -> bool;

    /// Keeps tile `i` as [`decompress_tile`] reads it.
    fn add(&self, i: usize, content: &[u8]) -> Result<()>;
}

/// The record of a tile, from its bytes in a sink.
///
/// # Errors
/// If they are damaged.
pub fn decompress_tile(content: &[u8]) -> std::io::Result<Vec<u8>> {
    zstd::decode_all(content)
}

/// What is counted while tiles are recovered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TileCounts {
    /// Pixels saturated in nearly all photographs.
    pub overexposed: usize,
    /// Pixels that are filled from their neighbours.
    pub defects: DefectivePixels,
    /// Strips in which the photographs were read.
    pub strips: usize,
}

impl AddAssign for TileCounts {
    fn add_assign(&mut self, other: Self) {
        self.overexposed = self.overexposed.saturating_add(other.overexposed);
        self.defects += other.defects;
        self.strips = self.strips.saturating_add(other.strips);
    }
}

/// Recovers tiles from the photographs of a capture.
pub struct TileRecovery<'a> {
    pub job: &'a PreparedJob,
    pub source: SampleSource<'a>,
}

/// Photographs to recover tiles from.
pub struct TilePhotographs {
    /// With the manifest that they are read by.
    folder: CaptureFolder,
    measurements: Measurements,
    /// Defects of the photographs, if they are loaded whole.
    loaded_defects: Option<DefectivePixels>,
}

impl TilePhotographs {
    /// Those that the recovery was prepared from, if they were loaded whole.
    pub fn of_sample(sample: CaptureSample) -> Self {
        let mut measurements = sample.measurements;
        let is_whole = measurements.loaded.count() == measurements.camera.area();
        if !is_whole {
            measurements.unload();
        }
        Self {
            folder: sample.folder,
            measurements,
            loaded_defects: is_whole.then_some(sample.read.defects),
        }
    }

    /// Those of a capture whose recovery was prepared elsewhere.
    ///
    /// # Errors
    /// If patterns cannot be read.
    pub fn of_capture(capture: &CaptureFolder, job: &PreparedJob) -> Result<Self> {
        let folder = capture.with_manifest(job.manifest.clone());
        Ok(Self {
            measurements: job.empty_measurements(&folder)?,
            folder,
            loaded_defects: None,
        })
    }
}

impl TileRecovery<'_> {
    /// Recovers the tiles of these rows of tiles that `sink` lacks.
    ///
    /// # Errors
    /// If a photograph cannot be read or a tile not kept, and if the executor is cancelled.
    pub fn run(
        &self,
        photographs: TilePhotographs,
        tile_rows: Range<u32>,
        sink: &impl TileSink,
    ) -> Result<TileCounts> {
        let TilePhotographs {
            folder,
            mut measurements,
            loaded_defects,
        } = photographs;
        let (SampleSource { plan, cores }, job) = (self.source, self.job);
        let (recovery, codes) = (&job.recovery, &job.codes);
        let geometry = recovery.geometry();
        let columns = geometry.tile_grid().width;
        let bar = progress::bar("recovering", tile_rows.len() * columns as usize);
        bar.set_position(sink.count() as u64);
        bar.reset_eta(); // these tiles took no time
        let mut reader = match loaded_defects {
            Some(_) => None,
            None => Some((
                MeasurementReader::open(&folder, &job.shots)?,
                folder.open_dark()?,
            )),
        };
        let mut counts = TileCounts {
            defects: loaded_defects.unwrap_or_default(),
            ..TileCounts::default()
        };
        let own_rows = [tile_rows.start, tile_rows.end].map(|row| row * geometry.tile_side);
        let mut next_row = 0;
        for (tile_rows, rows) in plan.strips(tile_rows, recovery.halo()) {
            if let Some((reader, dark)) = &mut reader {
                let check = || Ok(cores.check_cancelled()?);
                let pixels = CameraPixelSet::row_range(rows.clone(), geometry.camera.width);
                let dark_rows = dark.read(&pixels)?;
                dark.release();
                reader.load(&mut measurements, &dark_rows, &pixels, check)?;
                // Rows that were loaded before are filled already, and those above and below the shard are counted by others.
                let [start, end] = own_rows.map(|row| row.clamp(next_row, rows.end.max(next_row)));
                reader.fill_defects(&mut measurements, next_row..start, codes);
                counts.defects += reader.fill_defects(&mut measurements, start..end, codes);
                reader.fill_defects(&mut measurements, end..rows.end, codes);
                next_row = rows.end;
            }
            let recover_tile = |i: u32| -> Result<usize> {
                let (i, rect) = (i as usize, geometry.tile(i as usize));
                if !sink.has(i) {
                    cores.check_cancelled()?;
                    let tile = recovery.tile(&measurements, rect);
                    let record = zstd::bulk::compress(&export::encode_tile(&tile), ZSTD_LEVEL)
                        .context("a tile cannot be compressed")?;
                    sink.add(i, &record)?;
                    bar.inc(1);
                }
                Ok(match codes.saturated > 0 {
                    true => measurements.count_overexposed_pixels(rect, MIN_PATTERNS),
                    false => 0,
                })
            };
            let tiles = tile_rows.start * columns..tile_rows.end * columns;
            let overexposed = tiles.into_par_iter().map(recover_tile);
            counts.overexposed += overexposed.try_reduce(|| 0, |a, b| Ok(a + b))?;
            counts.strips += 1;
        }
        drop(bar);
        Ok(counts)
    }
}
