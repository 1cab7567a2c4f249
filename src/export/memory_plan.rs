//! Shares the memory limit of a recovery out between photographs and tiles.
//!
//! All photographs are loaded if they fit beside one tile. Otherwise half of what remains after the fixed costs holds
//! strips of rows, the rest tiles. Only the number of tiles at once depends on the number of threads, so that the
//! loaded rows, and the result, do not.

use std::ops::Range;

use thiserror::Error;

use crate::capture::CameraRowSet;
use crate::recover::Method;
use crate::transport::{CHANNELS, Extent, Geometry, Window};

/// Camera pixels along a side of a tile in the file. Larger tiles than those of the recovery compress better; these are
/// still small enough to load only the visible ones.
pub(super) const FILE_TILE_SIDE: u32 = 128;
/// Camera pixels along a side of a recovered tile.
const TILE_SIDE: u32 = Geometry::DEFAULT_TILE_SIDE;
/// All channels of one camera pixel or light element.
const PIXEL_BYTES: u64 = (CHANNELS * size_of::<f32>()) as u64;
/// The program itself, its buffers, and what the allocator retains.
const PROGRAM_BYTES: u64 = 32 << 20;
/// Reading one photograph, beside its rows: a buffer and the decompressor's window.
const READER_BYTES: u64 = 320 << 10;
/// Compressing one recovered tile for the checkpoint, beside the tile.
const COMPRESSOR_BYTES: u64 = 24 << 20;
/// One coefficient or element of all channels while its tile of the file is encoded: the value, its rounding error,
/// quantised values of two scans, and their tokens.
const ENCODED_VALUE_BYTES: u64 = 60;
/// Choosing the quantisation step of the file.
const RATE_CONTROL_BYTES: u64 = 64 << 20;

/// A memory limit that is too low for a capture, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("a memory limit of {limit} bytes is too little for this capture; it takes at least {min}")]
pub struct TooLittleMemory {
    /// The limit.
    pub limit: u64,
    /// The lowest limit that is enough.
    pub min: u64,
}

/// How the memory limit is used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryPlan {
    /// Bytes for rows of photographs.
    photograph_bytes: u64,
    /// Bytes of one camera row of all photographs.
    row_bytes: u64,
    camera: Extent,
    /// Number of tiles recovered at once.
    tiles_at_once: usize,
    threads: usize,
    limit: u64,
    fixed_bytes: u64,
}

impl MemoryPlan {
    /// A plan for recovery by `method` in `window` from `shots` photographs on at most `threads` threads, within
    /// `limit` bytes.
    ///
    /// # Errors
    /// If the limit is too low for one tile.
    pub fn new(
        limit: u64,
        (camera, light): (Extent, Extent),
        shots: usize,
        method: Method,
        window: Window,
        threads: usize,
    ) -> Result<Self, TooLittleMemory> {
        let photographs = shots as u64;
        let width = u64::from(camera.width);
        let fixed_bytes = PROGRAM_BYTES
            + method.preparation_bytes(window, shots) as u64
            + PIXEL_BYTES * camera.area() as u64 // the dark frame
            + PIXEL_BYTES * (shots * light.area()) as u64 // patterns, of any colour
            + photographs * (READER_BYTES + 4 * 2 * CHANNELS as u64 * width);
        // The functions of a tile as real numbers, as codes, and as byte planes to compress.
        let element = PIXEL_BYTES + 8 + 2 * CHANNELS as u64;
        let tile = COMPRESSOR_BYTES
            + method.tile_bytes(window, shots) as u64
            + element * u64::from(TILE_SIDE * TILE_SIDE) * window.area() as u64;
        let mut plan = Self {
            photograph_bytes: 0,
            row_bytes: (photographs + 1) * PIXEL_BYTES * width, // and the flood photograph
            camera,
            tiles_at_once: 0,
            threads,
            limit,
            fixed_bytes,
        };
        let all = plan.row_bytes * u64::from(camera.height);
        // Beside the loaded rows: a tile, or while the recovery is prepared, these rows resampled.
        let resampled = Method::resampled_bytes(shots) as u64;
        let beside = |rows: u64| tile.max(rows.min(resampled));
        let min_rows = (TILE_SIDE + 2 * method.max_halo()).min(camera.height);
        let min_bytes = plan.row_bytes * u64::from(min_rows);
        plan.ensure_limit(fixed_bytes + min_bytes + beside(min_bytes))?;
        let free = limit - fixed_bytes;
        plan.photograph_bytes = match all + beside(all) <= free {
            true => all,
            false => (free / 2).clamp(min_bytes, free - beside(min_bytes)),
        };
        plan.tiles_at_once = threads.min(((free - plan.photograph_bytes) / tile) as usize);
        Ok(plan)
    }

    /// Number of tiles of the file encoded at once, after the photographs are unloaded, for `rank` components and
    /// functions of `window`. The encoded file is not included.
    ///
    /// # Errors
    /// If the limit is too low for one tile.
    pub fn tiles_encoded_at_once(
        &self,
        window: Window,
        rank: usize,
    ) -> Result<usize, TooLittleMemory> {
        let pixels = self.camera.area() as u64;
        let value = ENCODED_VALUE_BYTES * (window.area() + rank) as u64;
        let tile = value * pixels.min(u64::from(FILE_TILE_SIDE).pow(2));
        let fixed = PROGRAM_BYTES + RATE_CONTROL_BYTES.min(value * pixels);
        self.ensure_limit(fixed + tile)?;
        Ok(self.threads.min(((self.limit - fixed) / tile) as usize))
    }

    fn ensure_limit(&self, min: u64) -> Result<(), TooLittleMemory> {
        match self.limit {
            limit if limit < min => Err(TooLittleMemory { limit, min }),
            _ => Ok(()),
        }
    }

    /// Number of tiles to recover at once.
    pub fn tiles_at_once(&self) -> usize {
        self.tiles_at_once
    }

    /// Number of tiles of the recovery.
    pub fn tiles(&self) -> usize {
        (self.tile_rows() * self.camera.width.div_ceil(TILE_SIDE)) as usize
    }

    fn tile_rows(&self) -> u32 {
        self.camera.height.div_ceil(TILE_SIDE)
    }

    /// Whether all photographs fit in memory.
    pub fn fits_photographs(&self) -> bool {
        self.max_rows() >= self.camera.height
    }

    fn max_rows(&self) -> u32 {
        u32::try_from(self.photograph_bytes / self.row_bytes.max(1)).unwrap_or(u32::MAX)
    }

    /// The camera rows to prepare the recovery from: all if they fit, otherwise rows of tiles spread evenly over the
    /// picture.
    pub fn sample_rows(&self) -> CameraRowSet {
        spread_tile_rows(self.camera, self.max_rows())
    }

    /// Strips of tile rows from the top down, each with the camera rows to load for it: its own and `halo` more on
    /// either side.
    pub fn strips(&self, halo: u32) -> Vec<(Range<u32>, CameraRowSet)> {
        let tile_rows = self.tile_rows();
        if self.fits_photographs() {
            return vec![(0..tile_rows, CameraRowSet::all(self.camera.height))];
        }
        let count = (self.max_rows().saturating_sub(2 * halo) / TILE_SIDE).max(1);
        let strip = |first: u32| {
            let strip = first..(first + count).min(tile_rows);
            let rows = self.pixel_rows(strip.clone(), halo);
            (strip, CameraRowSet::from_strips([rows]))
        };
        (0..tile_rows).step_by(count as usize).map(strip).collect()
    }

    /// Whether so many Gray code photographs fit in memory whole.
    pub fn fits_gray_code(&self, photographs: usize) -> bool {
        self.gray_code_rows(photographs).count() == self.camera.height as usize
    }

    /// The camera rows to decode of so many Gray code photographs: all if they fit, otherwise rows spread evenly over
    /// the picture.
    pub fn gray_code_rows(&self, photographs: usize) -> CameraRowSet {
        // The samples of a pixel and its decoded position.
        let pixel = photographs as u64 * PIXEL_BYTES + 64;
        let max_rows = (self.limit - self.fixed_bytes) / (pixel * u64::from(self.camera.width));
        let interval = u64::from(self.camera.height).div_ceil(max_rows.max(1));
        let rows = (0..self.camera.height).step_by(interval as usize);
        CameraRowSet::from_strips(rows.map(|y| y..y + 1))
    }

    fn pixel_rows(&self, tile_rows: Range<u32>, halo: u32) -> Range<u32> {
        let start = (tile_rows.start * TILE_SIDE).saturating_sub(halo);
        start..(tile_rows.end * TILE_SIDE + halo).min(self.camera.height)
    }
}

/// All rows if they are at most `max_rows`, otherwise rows of tiles spread evenly over the picture, at least one.
pub fn spread_tile_rows(camera: Extent, max_rows: u32) -> CameraRowSet {
    if max_rows >= camera.height {
        return CameraRowSet::all(camera.height);
    }
    let tile_rows = camera.height.div_ceil(TILE_SIDE);
    let count = (max_rows / TILE_SIDE).clamp(1, tile_rows);
    // The middles of `count` equal parts.
    let first_row = |i: u32| (2 * i + 1) * tile_rows / (2 * count) * TILE_SIDE;
    let strips = (0..count).map(first_row);
    CameraRowSet::from_strips(strips.map(|y| y..(y + TILE_SIDE).min(camera.height)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(megabytes: u64, threads: usize) -> Result<MemoryPlan, TooLittleMemory> {
        let extents = (Extent::new(500, 300), Extent::new(64, 64));
        let window = Window::new(9).unwrap();
        MemoryPlan::new(megabytes << 20, extents, 80, Method::Nnls, window, threads)
    }

    #[test]
    fn strips_fit_the_limit_and_cover_every_tile_once() {
        for megabytes in [190, 210, 250, 400, 4000] {
            let plan = plan(megabytes, 8).unwrap();
            assert!((1..=8).contains(&plan.tiles_at_once));
            for halo in [0, 8] {
                let mut next = 0;
                for (strip, rows) in plan.strips(halo) {
                    assert_eq!(strip.start, next);
                    next = strip.end;
                    let needed =
                        (strip.start * 32).saturating_sub(halo)..(strip.end * 32 + halo).min(300);
                    assert!(rows.contains_all(needed));
                    assert!(rows.count() as u64 * plan.row_bytes <= plan.photograph_bytes);
                }
                assert_eq!(next, 10);
            }
            let sample = plan.sample_rows();
            assert!(sample.count() as u64 * plan.row_bytes <= plan.photograph_bytes);
            assert_eq!(plan.fits_photographs(), sample == CameraRowSet::all(300));
            assert!(sample.iter().all(|y| y < 300));
            assert_eq!(
                sample,
                super::tests::plan(megabytes, 1).unwrap().sample_rows()
            );
        }
        assert!(plan(4000, 2).unwrap().fits_photographs());
        // All rows if they fit, and never more than fit.
        for photographs in [12, 44, 2000] {
            let plan = plan(4000, 2).unwrap();
            let rows = plan.gray_code_rows(photographs).count() as u64;
            let bytes = rows * 500 * photographs as u64 * PIXEL_BYTES;
            assert!(bytes < 4000 << 20);
            assert!(rows == 300 || photographs == 2000);
        }
        assert!(!plan(190, 2).unwrap().fits_photographs());
    }

    #[test]
    fn too_little_memory_is_refused_with_the_minimum() {
        let TooLittleMemory { limit, min } = plan(30, 2).unwrap_err();
        assert_eq!(limit, 30 << 20);
        let min = min.div_ceil(1 << 20);
        assert!(plan(min, 2).is_ok());
        assert!(plan(min - 1, 2).is_err());
    }
}
