//! Synthetic transports, and edits of files with correct checksums, for all integration tests.
#![allow(dead_code)] // each test program uses some of it
#![allow(clippy::unwrap_used)]

pub mod relit;
pub mod tiff_writer;

use std::fs;
use std::path::Path;

use relightable_photo::format::HEADER_BYTES;
use relightable_photo::transport::{
    Correspondence, DisplacementGrid, Extent, Geometry, TileTransportFunctions, Window,
};

/// A reproducible stream of numbers in 0..1.
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A geometry with tiles of 8 pixels.
pub fn geometry(camera: [u32; 2], light: [u32; 2], window: u32, affine: [[f64; 3]; 2]) -> Geometry {
    tiled(camera, light, window, 8, affine)
}

pub fn tiled(
    camera: [u32; 2],
    light: [u32; 2],
    window: u32,
    tile_side: u32,
    affine: [[f64; 3]; 2],
) -> Geometry {
    let extent = |[width, height]: [u32; 2]| Extent { width, height };
    Geometry {
        camera: extent(camera),
        light: extent(light),
        window: Window::new(window).unwrap(),
        correspondence: Correspondence::from_affine(affine),
        tile_side,
    }
    .validate()
    .unwrap()
}

/// The geometry with a correspondence that bends along both axes, by up to a few elements.
#[allow(dead_code)] // not in every test
pub fn bent(mut geometry: Geometry) -> Geometry {
    let points = DisplacementGrid::points_over(geometry.camera, 8);
    let code = |(i, j): (u32, u32)| {
        let (i, j) = (i as i16, j as i16);
        [
            40 * (i % 5) * (i % 3) - 97 * (j % 4),
            300 - 150 * (i % 4) * (j % 3),
        ]
    };
    let codes = points.cells().map(code).collect();
    let grid = DisplacementGrid::new(8, 0.011, points, codes).unwrap();
    geometry.correspondence.displacement = Some(grid.into());
    geometry.validate().unwrap()
}

/// Noisy light transport functions, zero off the light plane; the first tile is dark.
pub fn functions(geometry: Geometry, seed: u64) -> Vec<TileTransportFunctions> {
    let mut noise = Noise(seed);
    let (side, area) = (geometry.window.side() as usize, geometry.window.area());
    let tiles = geometry.tiles().enumerate().map(|(i, rect)| {
        let mut functions = TileTransportFunctions::zeros(rect, area);
        for (p, pixel) in rect.pixels().enumerate() {
            let origin = geometry.window_origin(pixel);
            for s in 0..area {
                let element = geometry.window.element(origin, s);
                let lit = i > 0 && element.index_in(geometry.light).is_some();
                let tau = std::array::from_fn(|_| noise.next().powi(4) as f32 / side as f32);
                if lit {
                    functions.tau[p * area + s] = tau;
                }
            }
        }
        functions
    });
    tiles.collect()
}

/// A file after an edit of its header or chunks, with correct checksums as far as the file's lengths are valid.
pub fn sealed(mut file: Vec<u8>, edit: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    edit(&mut file);
    if file.len() < HEADER_BYTES {
        return file;
    }
    seal_chunks(&mut file);
    seal_header(&mut file);
    file
}

/// A file after an edit of its decompressed directory.
pub fn with_directory(file: &[u8], edit: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let [directory, rest] = directory_bounds(file);
    let mut content = zstd::bulk::decompress(&file[directory..rest], 1 << 20).unwrap();
    edit(&mut content);
    let packed = zstd::bulk::compress(&content, 1).unwrap();
    let mut edited = [&file[..directory], &packed, &file[rest..]].concat();
    let length = packed.len() as u32;
    edited[104..108].copy_from_slice(&length.to_le_bytes());
    let total = edited.len() as u64;
    edited[88..96].copy_from_slice(&total.to_le_bytes());
    seal_header(&mut edited);
    edited
}

fn u32_at(bytes: &[u8], at: usize) -> usize {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
}

fn directory_bounds(file: &[u8]) -> [usize; 2] {
    let end = (HEADER_BYTES + u32_at(file, 104)).min(file.len());
    [HEADER_BYTES, end]
}

/// Corrects the checksums of chunks in the directory.
fn seal_chunks(file: &mut Vec<u8>) {
    let [start, end] = directory_bounds(file);
    let scans = u32_at(file, 100);
    let Ok(mut content) = zstd::bulk::decompress(&file[start..end], 1 << 20) else {
        return;
    };
    let Some(entries) = content
        .len()
        .checked_sub(24 * scans)
        .filter(|n| scans > 0 && n % 12 == 0)
    else {
        return;
    };
    let (count, tables) = (entries / 12, 24 * scans);
    if count % scans != 0 {
        return;
    }
    let mut at = end + u32_at(file, 112) + u32_at(file, 120);
    for scan in 0..scans {
        let crc = |at: &mut usize, length: usize| {
            let bytes = file.get(*at..at.saturating_add(length)).unwrap_or_default();
            *at = at.saturating_add(length);
            crc32c::crc32c(bytes).to_le_bytes()
        };
        let basis = u32_at(&content, 24 * scan + 16);
        let sum = crc(&mut at, basis);
        content[24 * scan + 20..24 * scan + 24].copy_from_slice(&sum);
        for i in scan * (count / scans)..(scan + 1) * (count / scans) {
            let length = u32_at(&content, tables + 4 * i);
            let sum = crc(&mut at, length);
            let crc_at = tables + 4 * (2 * count + i);
            if length > 0 {
                content[crc_at..crc_at + 4].copy_from_slice(&sum);
            }
        }
    }
    let Ok(packed) = zstd::bulk::compress(&content, 1) else {
        return;
    };
    let grown = packed.len() as i64 - (end - start) as i64;
    file.splice(start..end, packed.iter().copied());
    let length = packed.len() as u32;
    file[104..108].copy_from_slice(&length.to_le_bytes());
    let total = u64::from_le_bytes(file[88..96].try_into().unwrap()).wrapping_add_signed(grown);
    file[88..96].copy_from_slice(&total.to_le_bytes());
}

/// Corrects the checksums in the header.
fn seal_header(file: &mut [u8]) {
    let mut start = HEADER_BYTES;
    for length_at in [104, 112, 120] {
        let end = start
            .saturating_add(u32_at(file, length_at))
            .min(file.len());
        let crc = crc32c::crc32c(&file[start.min(end)..end]);
        file[length_at + 4..length_at + 8].copy_from_slice(&crc.to_le_bytes());
        start = end;
    }
    let crc = crc32c::crc32c(&file[..HEADER_BYTES - 4]);
    file[HEADER_BYTES - 4..HEADER_BYTES].copy_from_slice(&crc.to_le_bytes());
}

/// Copies a folder with all its contents.
pub fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy_folder(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}
