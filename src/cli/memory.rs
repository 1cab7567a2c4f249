//! How much of the capture may be in memory at once.

use std::fmt;
use std::ops::Range;

use anyhow::{Result, ensure};

use super::encode;
use crate::capture::{Manifest, Rows};
use crate::recover::Method;
use crate::transport::{CHANNELS, Geometry, Window};

/// What the program needs whatever it works on: itself, buffers, what the allocator keeps.
const PROGRAM: u64 = 32 << 20;
/// What reading one photograph takes beside its rows: pieces of the file, and the decoder's memory
/// of what it last decompressed.
const READER: u64 = 320 << 10;
/// What compressing one recovered tile takes beside the tile.
const COMPRESSOR: u64 = 24 << 20;
/// What one coefficient or element of all channels takes while its tile of the file is encoded: itself,
/// what rounding leaves of it, the numbers of two scans, and their tokens.
const ENCODED: u64 = 60;
/// What choosing the file's step takes.
const ENCODER: u64 = 64 << 20;

/// An amount of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bytes(pub u64);

impl Bytes {
    /// Enough for some ten megapixels under 80 patterns on any machine of today. Fixed, not a share
    /// of the machine's memory: the same command gives the same bytes everywhere.
    pub const DEFAULT: &str = "4G";

    /// Parses `512M`, `4GiB`, `500kB` or a number of bytes: units are powers of 1024, or with `B`
    /// alone of 1000, in which amounts are printed.
    pub fn parse(text: &str) -> Result<Self, String> {
        let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
        let unit: u64 = match text[digits.len()..].to_ascii_lowercase().as_str() {
            "" | "b" => 1,
            "kb" => 1_000,
            "mb" => 1_000_000,
            "gb" => 1_000_000_000,
            "tb" => 1_000_000_000_000,
            "k" | "kib" => 1 << 10,
            "m" | "mib" => 1 << 20,
            "g" | "gib" => 1 << 30,
            "t" | "tib" => 1 << 40,
            _ => return Err("give it like 512M, 4G or 4GiB, or as a number of bytes".to_owned()),
        };
        let number: u64 = digits.trim().parse().map_err(|_| {
            format!("{digits:?} is not a whole number; give it like 512M, 4G or 4GiB")
        })?;
        let bytes = number.checked_mul(unit);
        bytes
            .map(Self)
            .ok_or_else(|| "is more than there is".to_owned())
    }
}

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let units = [(30, "G"), (20, "M"), (10, "K")];
        let unit = units
            .into_iter()
            .find(|(shift, _)| self.0 > 0 && self.0.is_multiple_of(1 << shift));
        match unit {
            Some((shift, unit)) => write!(f, "{}{unit}", self.0 >> shift),
            None => write!(f, "{}", self.0),
        }
    }
}

/// What is in memory when.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Bytes for rows of photographs.
    photographs: u64,
    /// Bytes of one camera row in all photographs.
    row: u64,
    height: u32,
    width: u32,
    tile_side: u32,
    /// Tiles that may be worked on at once.
    pub tiles_at_once: usize,
    threads: usize,
    budget: u64,
    fixed: u64,
}

impl Plan {
    /// Shares `budget` out for recovery by `method` from `shots` photographs, on at most `threads`
    /// threads.
    /// Which rows are at hand does not depend on the number of threads.
    pub fn new(
        budget: Bytes,
        manifest: &Manifest,
        shots: usize,
        method: Method,
        window: Window,
        threads: usize,
    ) -> Result<Self> {
        let (camera, light) = (manifest.camera.extent(), manifest.light.extent());
        let tile_side = Geometry::DEFAULT_TILE_SIDE;
        let pixel = (CHANNELS * size_of::<f32>()) as u64;
        let photographs = shots as u64;
        let width = u64::from(camera.width);
        let fixed = PROGRAM
            + method.preparation_bytes(window) as u64
            + pixel * camera.area() as u64 // the dark frame
            + pixel * (shots * light.area()) as u64 // patterns, of any colour
            + photographs * (READER + 4 * 2 * CHANNELS as u64 * width);
        // A tile's functions as real numbers, as codes, and as planes to compress.
        let element = pixel + 8 + 2 * CHANNELS as u64;
        let tile = COMPRESSOR
            + method.tile_bytes(window, shots) as u64
            + element * u64::from(tile_side * tile_side) * window.area() as u64;
        let mut plan = Self {
            photographs: 0,
            row: photographs * pixel * width,
            height: camera.height,
            width: camera.width,
            tile_side,
            tiles_at_once: 0,
            threads,
            budget: budget.0,
            fixed,
        };
        let rows = plan.row * u64::from((tile_side + 2 * method.max_halo()).min(camera.height));
        plan.ensure_at_least(plan.fixed + tile + rows)?;
        // All photographs, or half of what is left, the rest for the tiles worked on: at least one.
        let left = plan.budget - plan.fixed;
        let all = plan.row * u64::from(plan.height);
        plan.photographs = match all <= left - tile {
            true => all,
            false => (left / 2).clamp(rows, left - tile),
        };
        let taken = plan.photographs;
        plan.tiles_at_once = threads.min(((left - taken) / tile) as usize);
        Ok(plan)
    }

    /// Tiles of the file that may be encoded at once, of so many components and functions of that window.
    /// That is once all photographs are gone. The file itself comes on top.
    pub fn encoders(&self, window: Window, rank: usize) -> Result<usize> {
        let pixels = u64::from(self.width) * u64::from(self.height);
        let value = ENCODED * (window.area() + rank) as u64;
        let tile = value * pixels.min(u64::from(encode::TILE_SIDE).pow(2));
        let fixed = PROGRAM + ENCODER.min(value * pixels);
        self.ensure_at_least(fixed + tile)?;
        Ok(self.threads.min(((self.budget - fixed) / tile) as usize))
    }

    fn ensure_at_least(&self, least: u64) -> Result<()> {
        let megabytes = least.div_ceil(1 << 20);
        ensure!(
            self.budget >= least,
            "--memory {} is too little for this capture; it takes at least --memory {megabytes}M",
            Bytes(self.budget),
        );
        Ok(())
    }

    /// Number of tiles.
    pub fn tiles(&self) -> usize {
        let along = |side: u32| side.div_ceil(self.tile_side) as usize;
        along(self.width) * along(self.height)
    }

    /// Whether the photographs fit in memory whole.
    pub fn whole(&self) -> bool {
        self.rows_at_once() >= self.height
    }

    fn rows_at_once(&self) -> u32 {
        u32::try_from(self.photographs / self.row.max(1)).unwrap_or(u32::MAX)
    }

    /// The rows to prepare a recovery from: all where they fit, else rows of tiles spread evenly
    /// over the picture.
    pub fn sample(&self) -> Rows {
        if self.whole() {
            return Rows::all(self.height);
        }
        let tile_rows = self.height.div_ceil(self.tile_side);
        let count = (self.rows_at_once() / self.tile_side).clamp(1, tile_rows);
        // The middle of each of `count` equal parts.
        let middle = |i: u32| ((2 * i + 1) * tile_rows) / (2 * count);
        Rows::from_strips((0..count).map(|i| self.pixel_rows(middle(i)..middle(i) + 1, 0)))
    }

    /// Rows of tiles by strips, from the top down, each with the camera rows to be at hand for it:
    /// its own and `halo` more on either side.
    pub fn strips(&self, halo: u32) -> Vec<(Range<u32>, Rows)> {
        let tile_rows = self.height.div_ceil(self.tile_side);
        if self.whole() {
            return vec![(0..tile_rows, Rows::all(self.height))];
        }
        let count = self.rows_at_once().saturating_sub(2 * halo) / self.tile_side;
        let strips = (0..tile_rows).step_by(count.max(1) as usize).map(|first| {
            let strip = first..(first + count.max(1)).min(tile_rows);
            let rows = self.pixel_rows(strip.clone(), halo);
            (strip, Rows::from_strips([rows]))
        });
        strips.collect()
    }

    /// The rows of Gray code to find the correspondence by, from so many photographs: all where
    /// they fit, else rows spread evenly over the picture.
    pub fn gray_code_rows(&self, photographs: usize) -> Rows {
        // A pixel's samples, and what it says of its place.
        let pixel = photographs as u64 * (CHANNELS * size_of::<f32>()) as u64 + 64;
        let fit = (self.budget - self.fixed) / (pixel * u64::from(self.width));
        let every = u64::from(self.height).div_ceil(fit.max(1));
        let rows = (0..self.height).step_by(every as usize);
        Rows::from_strips(rows.map(|y| y..y + 1))
    }

    fn pixel_rows(&self, tile_rows: Range<u32>, halo: u32) -> Range<u32> {
        let start = (tile_rows.start * self.tile_side).saturating_sub(halo);
        start..(tile_rows.end * self.tile_side + halo).min(self.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(megabytes: u64, threads: usize) -> Result<Plan> {
        let manifest = Manifest::parse(
            r#"{"version": 1, "light": {"width": 64, "height": 64, "gamma": 2},
                "camera": {"width": 500, "height": 300, "black": 0, "white": 60000},
                "shots": [{"pattern": "a.png", "photo": "b.png"}]}"#,
            std::path::Path::new("capture.json"),
        );
        let window = Window::new(9).unwrap();
        Plan::new(
            Bytes(megabytes << 20),
            &manifest.unwrap(),
            80,
            Method::Nnls,
            window,
            threads,
        )
    }

    #[test]
    fn amounts_are_read_with_and_without_units() {
        for (text, bytes) in [
            ("4096", 4096),
            ("512M", 512 << 20),
            ("4G", 4 << 30),
            ("4GiB", 4 << 30),
            ("4gb", 4_000_000_000),
            ("100kB", 100_000),
            ("1 T", 1 << 40),
        ] {
            assert_eq!(Bytes::parse(text), Ok(Bytes(bytes)), "{text}");
            assert_eq!(Bytes::parse(&Bytes(bytes).to_string()), Ok(Bytes(bytes)));
        }
        for text in ["", "G", "4X", "4.5G", "-1G", "99999999999T"] {
            assert!(Bytes::parse(text).is_err(), "{text}");
        }
        assert!(Bytes::parse(Bytes::DEFAULT).is_ok());
    }

    #[test]
    fn strips_fit_the_budget_and_cover_every_tile_once() {
        for megabytes in [160, 200, 250, 400, 4000] {
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
                    assert!(rows.count() as u64 * plan.row <= plan.photographs);
                }
                assert_eq!(next, 10);
            }
            let sample = plan.sample();
            assert!(sample.count() as u64 * plan.row <= plan.photographs);
            assert_eq!(plan.whole(), sample == Rows::all(300));
            assert!(sample.iter().all(|y| y < 300));
            assert_eq!(sample, super::tests::plan(megabytes, 1).unwrap().sample());
        }
        assert!(plan(4000, 2).unwrap().whole());
        // However few the shots, and never more than there is room for.
        for photographs in [12, 44, 2000] {
            let plan = plan(4000, 2).unwrap();
            let rows = plan.gray_code_rows(photographs).count() as u64;
            let bytes = rows * 500 * photographs as u64 * (CHANNELS * size_of::<f32>()) as u64;
            assert!(bytes < 4000 << 20);
            assert!(rows == 300 || photographs == 2000);
        }
        assert!(!plan(160, 2).unwrap().whole());
    }

    #[test]
    fn too_little_memory_is_refused_with_the_least_that_would_do() {
        let message = plan(30, 2).unwrap_err().to_string();
        let words: Vec<&str> = message.split(' ').collect();
        let least = words.last().unwrap().trim_end_matches('M').parse().unwrap();
        assert!(message.contains("at least --memory"), "{message}");
        assert!(plan(least, 2).is_ok());
        assert!(plan(least - 1, 2).is_err());
    }
}
