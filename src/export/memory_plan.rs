//! Shares the memory limit of a recovery out between photographs and tiles.
//!
//! All photographs are loaded if they fit beside one tile. Otherwise the recovery is prepared from the pixels that this
//! takes, then half of what remains after the fixed costs holds strips of rows, the rest tiles. What a recovery is prepared
//! from depends on the capture alone, and so does its result: not on the limit, nor on the number of threads.

use std::ops::Range;

use thiserror::Error;

use super::encoding::FILE_TILE_SIDE;
use crate::capture::{CameraPixelSet, CameraRowSet};
use crate::recover::{Method, PreparedRecovery, WindowSizeEstimate, preparation_pixels};
use crate::transport::{CHANNELS, Extent, Geometry, Window};

/// Camera pixels along a side of a recovered tile.
const TILE_SIDE: u32 = Geometry::DEFAULT_TILE_SIDE;
/// All channels of one camera pixel or light element.
const PIXEL_BYTES: u64 = (CHANNELS * size_of::<f32>()) as u64;
/// The program itself, its buffers, and what the allocator retains.
const PROGRAM_BYTES: u64 = 32 << 20;
/// Pixels of a block of resampled photographs, and what a block takes that is not resampled.
const RESAMPLED_BLOCK_PIXELS: u64 = 64;
const RESAMPLED_BLOCK_BYTES: u64 = 32;
/// Reading one photograph, beside its rows: a buffer and the decompressor's window.
const READER_BYTES: u64 = 320 << 10;
/// Pixels of a tile of an ingested photograph, at least, and its place, length and checksum.
const TIFF_TILE_PIXELS: u64 = 16 * 512;
const TIFF_TILE_BYTES: u64 = 20;
/// Compressing one recovered tile for the checkpoint, beside the tile.
const COMPRESSOR_BYTES: u64 = 24 << 20;
/// One coefficient or element of all channels while its tile of the file is encoded: the value, its rounding error,
/// quantised values of two scans, and their tokens.
const ENCODED_VALUE_BYTES: u64 = 60;
/// Choosing the quantisation step of the file.
const RATE_CONTROL_BYTES: u64 = 64 << 20;
/// Pixels of the Gray code photographs that are decoded: several for each control point of a displacement.
const MAX_GRAY_CODE_PIXELS: usize = 1 << 20;
/// Rows that are decoded at least, so that the correspondence is known along columns.
const MIN_GRAY_CODE_ROWS: usize = 16;
/// The decoded position of a camera pixel.
const POSITION_BYTES: u64 = 64;

/// A memory limit that is too low for a capture, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("a memory limit of {limit} bytes is too little for this capture; it takes at least {min}")]
pub struct TooLittleMemory {
    /// The limit.
    pub limit: u64,
    /// The lowest limit that is enough.
    pub min: u64,
}

/// What a capture takes memory by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CaptureSize {
    /// The camera grid.
    pub camera: Extent,
    /// The light plane.
    pub light: Extent,
    /// Number of photographs to recover from.
    pub shots: usize,
    /// Number of planes of their patterns: one of a grey pattern, three of a coloured one.
    pub pattern_planes: usize,
    /// Number of Gray code photographs to decode.
    pub gray_code: usize,
}

/// How the memory limit is used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryPlan {
    camera: Extent,
    /// The pixels to prepare the recovery from.
    prepared: CameraPixelSet,
    /// The pixels that are loaded for that.
    sample: CameraPixelSet,
    gray_code_rows: CameraRowSet,
    /// Number of camera rows of the photographs that are loaded at once.
    rows_at_once: u32,
    /// Number of tiles recovered at once.
    tiles_at_once: usize,
}

/// The memory limit of encoding a file, once the photographs are unloaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncodingMemory {
    /// In bytes.
    pub limit: u64,
    /// Most tiles that are encoded at once.
    pub threads: usize,
}

impl EncodingMemory {
    /// Number of tiles of the file encoded at once: of a picture of this size, with functions of `window` and `rank` components.
    /// The encoded file is not included.
    ///
    /// # Errors
    /// If the limit is too low for one tile.
    pub fn tiles_at_once(
        self,
        camera: Extent,
        window: Window,
        rank: usize,
    ) -> Result<usize, TooLittleMemory> {
        let (fixed, tile) = encoding_bytes(camera, window, rank);
        let (limit, min) = (self.limit, fixed + tile);
        match limit < min {
            true => Err(TooLittleMemory { limit, min }),
            false => Ok(self.threads.min(((limit - fixed) / tile) as usize)),
        }
    }

    /// The lowest limit, in bytes, with which a tile can be encoded.
    pub fn min_bytes(camera: Extent, window: Window, rank: usize) -> u64 {
        let (fixed, tile) = encoding_bytes(camera, window, rank);
        fixed + tile
    }
}

impl MemoryPlan {
    /// A plan for recovery of a capture of this `size` by `method` on at most `threads` threads, within `limit` bytes;
    /// `window` is `None` if it is estimated.
    ///
    /// # Errors
    /// If the limit is too low for what the recovery is prepared from, or for one tile.
    pub fn new(
        limit: u64,
        size: CaptureSize,
        method: Method,
        window: Option<Window>,
        threads: usize,
    ) -> Result<Self, TooLittleMemory> {
        let sample = preparation_pixels(size.camera, method, window);
        Self::with_sample(limit, size, method, window, threads, sample)
    }

    /// A plan for the tiles alone of a recovery in `window` that is prepared already.
    ///
    /// # Errors
    /// If the limit is too low for one tile.
    pub fn of_tiles(
        limit: u64,
        size: CaptureSize,
        method: Method,
        window: Window,
        threads: usize,
    ) -> Result<Self, TooLittleMemory> {
        let size = CaptureSize {
            gray_code: 0,
            ..size
        };
        let none = CameraPixelSet::row_range(0..0, size.camera.width);
        Self::with_sample(limit, size, method, Some(window), threads, none)
    }

    fn with_sample(
        limit: u64,
        size: CaptureSize,
        method: Method,
        window: Option<Window>,
        threads: usize,
        sample: CameraPixelSet,
    ) -> Result<Self, TooLittleMemory> {
        let CaptureSize {
            camera,
            light,
            shots,
            pattern_planes,
            gray_code,
        } = size;
        let max_window = window.unwrap_or(WindowSizeEstimate::MAX_WINDOW);
        let photographs = shots as u64;
        let width = u64::from(camera.width);
        let fixed_bytes = PROGRAM_BYTES
            + method
                .preparation_bytes(max_window, shots)
                .max(PreparedRecovery::sample_bytes(max_window)) as u64
            + (size_of::<f32>() * pattern_planes * light.area()) as u64
            + photographs * (READER_BYTES + 4 * 2 * CHANNELS as u64 * width)
            + photographs * (camera.area() as u64 / TIFF_TILE_PIXELS * TIFF_TILE_BYTES);
        // The functions of a tile as real numbers, as codes, and as byte planes to compress.
        let element = PIXEL_BYTES + 8 + 2 * CHANNELS as u64;
        let tile = COMPRESSOR_BYTES
            + method.tile_bytes(max_window, shots) as u64
            + element * u64::from(TILE_SIDE * TILE_SIDE) * max_window.area() as u64;
        let pixel_bytes = (photographs + 2) * PIXEL_BYTES; // and the flood photograph and the dark frame
        let row_bytes = pixel_bytes * width;
        // Photographs may be resampled while the recovery is prepared.
        let resampled = Method::resampled_bytes(shots) as u64;
        let prepared = |bytes: u64| {
            bytes
                + bytes.min(resampled)
                + camera.area() as u64 / RESAMPLED_BLOCK_PIXELS * RESAMPLED_BLOCK_BYTES
        };
        let gray_code_rows = gray_code_rows(camera);
        let gray_code_pixel = (gray_code as u64 + 1) * PIXEL_BYTES + POSITION_BYTES;
        let gray_code_bytes = match gray_code {
            0 => 0,
            _ => gray_code_pixel * width * gray_code_rows.count() as u64,
        };
        let sample_bytes = pixel_bytes * sample.count() as u64;
        let all_bytes = row_bytes * u64::from(camera.height);
        let min_rows = (TILE_SIDE + 2 * method.max_halo()).min(camera.height);
        let min_bytes = row_bytes * u64::from(min_rows);
        // One after the other: Gray code, the preparation, and the tiles.
        let least = |loaded: u64, sample: u64| {
            fixed_bytes + (loaded + tile).max(prepared(sample)).max(gray_code_bytes)
        };
        let min = match sample_bytes == all_bytes {
            true => least(all_bytes, all_bytes),
            false => least(min_bytes, sample_bytes),
        };
        if limit < min {
            return Err(TooLittleMemory { limit, min });
        }
        let free = limit - fixed_bytes;
        let fits_all = least(all_bytes, all_bytes) <= limit;
        let loaded_bytes = match fits_all {
            true => all_bytes,
            false => (free / 2).clamp(min_bytes, free - tile),
        };
        Ok(Self {
            camera,
            sample: match fits_all {
                true => CameraPixelSet::all(camera),
                false => sample.clone(),
            },
            prepared: sample,
            gray_code_rows,
            rows_at_once: match fits_all {
                true => camera.height,
                false => u32::try_from(loaded_bytes / row_bytes.max(1)).unwrap_or(u32::MAX),
            },
            tiles_at_once: threads.min(((free - loaded_bytes) / tile) as usize),
        })
    }

    /// Number of tiles to recover at once.
    pub fn tiles_at_once(&self) -> usize {
        self.tiles_at_once
    }

    /// Number of tiles of the recovery.
    pub fn tiles(&self) -> usize {
        (self.tile_rows() * self.camera.width.div_ceil(TILE_SIDE)) as usize
    }

    /// Number of rows of tiles.
    fn tile_rows(&self) -> u32 {
        self.camera.height.div_ceil(TILE_SIDE)
    }

    /// Whether all photographs fit in memory.
    pub fn fits_photographs(&self) -> bool {
        self.rows_at_once >= self.camera.height
    }

    /// The camera pixels that the preparation reads, whatever the limit.
    pub fn prepared(&self) -> &CameraPixelSet {
        &self.prepared
    }

    /// The camera pixels to load for the preparation: all if they fit, otherwise those that it reads.
    pub fn sample(&self) -> &CameraPixelSet {
        &self.sample
    }

    /// The camera rows of Gray code photographs to decode, whatever the limit.
    pub fn gray_code_rows(&self) -> &CameraRowSet {
        &self.gray_code_rows
    }

    /// Strips of these rows of tiles from the top down, each with the camera rows to load for it: its own and `halo` more on
    /// either side.
    pub fn strips(&self, tile_rows: Range<u32>, halo: u32) -> Vec<(Range<u32>, Range<u32>)> {
        let count = match self.fits_photographs() {
            true => tile_rows.len() as u32,
            false => self.rows_at_once.saturating_sub(2 * halo) / TILE_SIDE,
        };
        let count = count.max(1);
        let strip = |first: u32| {
            let strip = first..first.saturating_add(count).min(tile_rows.end);
            let start = (strip.start * TILE_SIDE).saturating_sub(halo);
            let end = (strip.end * TILE_SIDE + halo).min(self.camera.height);
            (strip, start..end)
        };
        tile_rows
            .clone()
            .step_by(count as usize)
            .map(strip)
            .collect()
    }
}

/// Memory of encoding a file, and of each of its tiles, in bytes.
fn encoding_bytes(camera: Extent, window: Window, rank: usize) -> (u64, u64) {
    let pixels = camera.area() as u64;
    let value = ENCODED_VALUE_BYTES * (window.area() + rank) as u64;
    let tile = value * pixels.min(u64::from(FILE_TILE_SIDE).pow(2));
    (PROGRAM_BYTES + RATE_CONTROL_BYTES.min(value * pixels), tile)
}

/// The camera rows of Gray code photographs to decode: all of at most [`MAX_GRAY_CODE_PIXELS`], otherwise so many, evenly
/// spaced, and at least [`MIN_GRAY_CODE_ROWS`].
fn gray_code_rows(camera: Extent) -> CameraRowSet {
    let max_rows = (MAX_GRAY_CODE_PIXELS / camera.width as usize).max(MIN_GRAY_CODE_ROWS);
    let interval = (camera.height as usize).div_ceil(max_rows);
    let rows = (0..camera.height).step_by(interval);
    CameraRowSet::from_strips(rows.map(|y| y..y + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// More than a small picture, of which the preparation reads less than half.
    const CAMERA: Extent = Extent::new(900, 800);

    fn plan(megabytes: u64, camera: Extent, threads: usize) -> Result<MemoryPlan, TooLittleMemory> {
        let size = CaptureSize {
            camera,
            light: Extent::new(64, 64),
            shots: 80,
            pattern_planes: 80,
            gray_code: 24,
        };
        let window = Window::new(9).ok();
        MemoryPlan::new(megabytes << 20, size, Method::Nnls, window, threads)
    }

    fn min_megabytes(camera: Extent) -> u64 {
        let TooLittleMemory { limit, min } = plan(30, camera, 2).unwrap_err();
        assert_eq!(limit, 30 << 20);
        min.div_ceil(1 << 20)
    }

    #[test]
    fn strips_cover_every_tile_once_with_its_halo() {
        let least = min_megabytes(CAMERA);
        for megabytes in [least, least + 50, least + 200, 4000] {
            let plan = plan(megabytes, CAMERA, 8).unwrap();
            assert!((1..=8).contains(&plan.tiles_at_once));
            for halo in [0, 8] {
                let mut next = 0;
                for (strip, rows) in plan.strips(0..25, halo) {
                    assert_eq!(strip.start, next);
                    next = strip.end;
                    let start = (strip.start * 32).saturating_sub(halo);
                    assert!(rows.start <= start && (strip.end * 32 + halo).min(800) <= rows.end);
                    assert!(rows.len() <= plan.rows_at_once as usize);
                }
                assert_eq!(next, 25);
            }
            assert_eq!(plan.fits_photographs(), megabytes == 4000);
            if plan.fits_photographs() {
                // One strip, also of a part of the picture; none of no rows.
                assert_eq!(plan.strips(0..25, 8), [(0..25, 0..800)]);
                assert_eq!(plan.strips(4..8, 8), [(4..8, 120..264)]);
                assert_eq!(plan.strips(4..4, 8), []);
            }
        }
    }

    #[test]
    fn what_is_read_does_not_depend_on_the_limit() {
        let least = min_megabytes(CAMERA);
        let (low, high) = (
            plan(least, CAMERA, 2).unwrap(),
            plan(least + 99, CAMERA, 8).unwrap(),
        );
        assert!(!high.fits_photographs());
        assert_eq!(low.sample, high.sample);
        assert!(2 * low.sample.count() < CAMERA.area());
        assert_eq!(low.gray_code_rows, high.gray_code_rows);
        let whole = plan(4000, CAMERA, 2).unwrap();
        assert_eq!(whole.sample.count(), CAMERA.area());
        assert_eq!(whole.prepared, low.prepared);
        // A small picture is prepared from all of it.
        let small = Extent::new(500, 300);
        assert!(
            plan(min_megabytes(small), small, 2)
                .unwrap()
                .fits_photographs()
        );
    }

    #[test]
    fn gray_code_is_decoded_in_rows_over_the_whole_picture() {
        for (camera, expected) in [
            ([500, 300], 300),
            ([1024, 1024], 1024),
            ([4096, 3000], 250),
            ([1 << 18, 3200], 16),
        ] {
            let camera = Extent::new(camera[0], camera[1]);
            let rows = gray_code_rows(camera);
            assert_eq!(rows.count(), expected);
            let interval = camera.height / expected as u32;
            assert!(
                rows.iter()
                    .eq((0..camera.height).step_by(interval as usize))
            );
        }
    }

    #[test]
    fn coloured_patterns_take_three_times_as_much_as_grey_ones() {
        let min = |pattern_planes: usize| {
            let size = CaptureSize {
                camera: Extent::new(4000, 4000),
                light: Extent::new(1000, 1000),
                shots: 80,
                pattern_planes,
                gray_code: 0,
            };
            let plan = MemoryPlan::new(0, size, Method::Nnls, Window::new(9).ok(), 2);
            plan.unwrap_err().min
        };
        assert_eq!(min(240) - min(80), 160 * 4_000_000);
    }

    #[test]
    fn tiles_alone_take_less_memory_than_a_recovery() {
        let window = Window::new(9).unwrap();
        let size = CaptureSize {
            camera: Extent::new(4000, 4000),
            light: Extent::new(64, 64),
            shots: 80,
            pattern_planes: 80,
            gray_code: 24,
        };
        let method = Method::Learned;
        let of_tiles = |limit| MemoryPlan::of_tiles(limit, size, method, window, 2);
        let whole = MemoryPlan::new(0, size, method, Some(window), 2).unwrap_err();
        let min = of_tiles(0).unwrap_err().min;
        assert!(min < whole.min, "{min} {}", whole.min);
        let halo = method.max_halo();
        assert_eq!(
            of_tiles(min).unwrap().strips(0..25, halo)[0],
            (0..1, 0..32 + halo)
        );
        let memory = |limit| EncodingMemory { limit, threads: 8 };
        let encoders = |limit| memory(limit).tiles_at_once(size.camera, window, 20);
        let least = EncodingMemory::min_bytes(size.camera, window, 20);
        assert!(least < min);
        assert_eq!(encoders(least), Ok(1));
        assert_eq!(encoders(least - 1).unwrap_err().min, least);
        assert_eq!(encoders(4 << 30), Ok(8));
    }

    #[test]
    fn too_little_memory_is_refused_with_the_minimum() {
        for camera in [CAMERA, Extent::new(500, 300)] {
            let min = min_megabytes(camera);
            assert!(plan(min, camera, 2).is_ok());
            assert!(plan(min - 1, camera, 2).is_err());
        }
    }
}
