//! `pkg-scripts/bench deepzoom`: files of several levels, compared with files of one.
//!
//! - `*_pyramid_over_flat`: bytes of a file of three levels over those of its file of one level, at the paper's scale.
//! - `*_level_min_psnr_db`: minimum PSNR, over the built-in lights and the levels, of a level's picture against the average of
//!   level 0. The peak is the brightest pixel of that average.
//! - `large_*`: a photograph of 4096 x 4096 pixels (`DEEPZOOM_SIDE` for another multiple of 512), copies of the first scene
//!   side by side: microseconds of `encode` for a pixel, its peak memory, and bytes over those of one level.
//!   `benches/page/levels.js` then shows it in a page.

#![allow(clippy::unwrap_used, clippy::expect_used)] // a failed benchmark should panic

mod figures;
mod simulated_capture;

use std::fs::{self, File};
use std::io::{BufWriter, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use relightable_photo::format::{
    ChunkId, EncodedFile, FileIndex, FormatError, Limits, LtmReader, MetadataText,
};
use relightable_photo::job_executor::SequentialExecutor;
use relightable_photo::pyramid::PyramidReader;
use relightable_photo::relight::BuiltinLight;
use relightable_photo::relight::cpu::LinearRelighter;
use relightable_photo::transport::{CHANNELS, Extent, Geometry, TileRect};

use figures::Figures;
use simulated_capture::{ltm_export, simulated};

/// Side of the scenes: the paper's scale.
const SIDE: u32 = 512;
const LEVELS: u32 = 3;

fn main() {
    let folder = figures::folder();
    let mut figures = Figures::new();
    let window = levels(&folder, "window", "stained-glass", &mut figures);
    levels(&folder, "cookies", "cookies", &mut figures);
    large(&folder, &window, &mut figures);
    figures::report("deepzoom", &figures);
}

/// Measures the levels of a scene; returns its file of one level.
fn levels(folder: &Path, name: &str, scene: &str, figures: &mut Figures) -> PathBuf {
    let capture = simulated(folder, &format!("deepzoom-{name}"), scene, SIDE);
    let [flat, file] = ["flat", "levels"].map(|kind| folder.join(format!("{name}-{kind}.ltm")));
    ltm_export(&["recover", text(&capture), "-o", text(&flat), "--json"]);
    let encode = ["encode", text(&flat), "-o", text(&file)];
    let report = ltm_export(&[&encode[..], &["--levels", &LEVELS.to_string(), "--json"]].concat());
    let ratio = report["size_ratio"].as_f64().unwrap();
    figures.insert(format!("{name}_pyramid_over_flat"), ratio);
    let reader = Levels::open(&file);
    let psnrs = BuiltinLight::BY_NAME
        .iter()
        .map(|(_, light)| reader.min_psnr(*light));
    let least = psnrs.fold(f64::INFINITY, f64::min);
    figures.insert(format!("{name}_level_min_psnr_db"), least);
    flat
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn read_range(mut file: &File, range: Range<u64>) -> Vec<u8> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(range.start)).unwrap();
    file.take(range.end - range.start)
        .read_to_end(&mut bytes)
        .unwrap();
    bytes
}

/// The index of a file, or of its root.
fn index(file: &File) -> FileIndex {
    let mut reader = LtmReader::new(Limits::default());
    while reader.index().is_none() {
        let have = reader.progress().bytes;
        let end = reader.index_bytes().unwrap_or(144);
        reader.feed(have, &read_range(file, have..end)).unwrap();
    }
    reader.index().unwrap().clone()
}

struct Levels {
    file: File,
    reader: PyramidReader,
}

impl Levels {
    fn open(path: &Path) -> Self {
        let file = File::open(path).unwrap();
        let reader = PyramidReader::new(index(&file), Limits::default()).unwrap();
        Self {
            reader: reader.unwrap(),
            file,
        }
    }

    fn min_psnr(&self, light: BuiltinLight) -> f64 {
        let mut average = self.picture(0, light);
        let mut least = f64::INFINITY;
        for level in 1..LEVELS {
            average = halved(&average, self.reader.table().camera(level - 1));
            least = least.min(psnr(&average, &self.picture(level, light)));
        }
        least
    }

    /// The linear picture of a level under a light.
    fn picture(&self, level: u32, light: BuiltinLight) -> Vec<[f64; CHANNELS]> {
        let table = self.reader.table();
        let camera = table.camera(level);
        let whole = TileRect {
            x: 0,
            y: 0,
            extent: camera,
        };
        let mut picture = vec![[0.0; CHANNELS]; camera.area()];
        for id in self.reader.shards_in(level, whole) {
            let fetch = |range| Ok::<_, FormatError>(read_range(&self.file, range));
            let shard = self.reader.shard(id, whole, fetch).unwrap();
            let light = light.render(shard.transport.geometry.light_region());
            let mut relighter = LinearRelighter::new(Arc::new(shard.transport));
            relighter.relight(&light, &SequentialExecutor);
            for (pixel, value) in shard.rect.pixels().zip(&relighter.linear().pixels) {
                picture[camera.index(pixel)] = [0, 1, 2].map(|c| f64::from(value[c]));
            }
        }
        picture
    }
}

/// The mean of 2 x 2 pixels of a picture whose sides are even.
fn halved(picture: &[[f64; CHANNELS]], camera: Extent) -> Vec<[f64; CHANNELS]> {
    let width = camera.width as usize;
    let half = Extent::new(camera.width / 2, camera.height / 2);
    let pixel = |(x, y): (u32, u32)| {
        let at = 2 * (y as usize * width + x as usize);
        let four = [at, at + 1, at + width, at + width + 1].map(|i| picture[i]);
        std::array::from_fn(|c| four.iter().map(|pixel| pixel[c]).sum::<f64>() / 4.0)
    };
    half.cells().map(pixel).collect()
}

fn psnr(expected: &[[f64; CHANNELS]], got: &[[f64; CHANNELS]]) -> f64 {
    let values = expected.as_flattened().iter().zip(got.as_flattened());
    let error: f64 = values.map(|(a, b)| (a - b).powi(2)).sum();
    let peak = expected.as_flattened().iter().copied().fold(0.0, f64::max);
    10.0 * (peak * peak * (3 * expected.len()) as f64 / error).log10()
}

/// Measures `encode` on copies of a scene, side by side.
fn large(folder: &Path, scene: &Path, figures: &mut Figures) {
    let side = std::env::var("DEEPZOOM_SIDE").map_or(4096, |side| side.parse().unwrap());
    assert!((SIDE..=32768).contains(&side) && side.is_multiple_of(SIDE));
    let [flat, file] = ["flat", "levels"].map(|kind| folder.join(format!("large-{kind}.ltm")));
    copies(scene, side / SIDE, &flat);
    let report = ltm_export(&["encode", text(&flat), "-o", text(&file), "--json"]);
    let number = |key: &str| report[key].as_f64().unwrap();
    let pixels = f64::from(side).powi(2);
    figures.insert(
        "large_encode_us_per_pixel".to_owned(),
        1e6 * number("seconds") / pixels,
    );
    figures.insert(
        "large_encode_peak_mb".to_owned(),
        1e-6 * number("peak_rss_bytes"),
    );
    figures.insert("large_pyramid_over_flat".to_owned(), number("size_ratio"));
    // The page's part of the benchmark shows the other.
    fs::remove_file(flat).unwrap();
}

/// Writes `count` times `count` copies of a square file as one.
fn copies(scene: &Path, count: u32, to: &Path) {
    let file = File::open(scene).unwrap();
    let index = index(&file);
    let geometry = &index.header.geometry;
    let scaled = |extent: Extent| Extent::new(count * extent.width, count * extent.height);
    let large = Geometry {
        camera: scaled(geometry.camera),
        light: scaled(geometry.light),
        ..geometry.clone()
    };
    let grid = geometry.tile_grid();
    let tiles = large.tile_grid().cells();
    let tiles: Vec<usize> = tiles
        .map(|(x, y)| (y % grid.height * grid.width + x % grid.width) as usize)
        .collect();
    let fetch = |chunk: ChunkId| Ok::<_, FormatError>(read_range(&file, index.range(chunk)));
    let metadata: MetadataText = index.metadata.clone();
    let copy = EncodedFile::copy_of(&index, large, &tiles, Vec::new(), metadata, fetch).unwrap();
    copy.write(&mut BufWriter::new(File::create(to).unwrap()))
        .unwrap();
}
