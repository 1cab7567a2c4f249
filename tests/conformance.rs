//! The conformance files of `docs/format.md` decode to the same bits, and the document shows the library's figures.
//!
//! `UPDATE_CONFORMANCE=1 cargo test --test conformance` encodes the files again. Only files that should cover
//! something else need that; a different choice by the encoder does not.
#![cfg(not(target_arch = "wasm32"))]
#![allow(clippy::unwrap_used)] // a failed test should panic

mod common;

use std::fs;
use std::io::Cursor;
use std::path::Path;
use std::sync::Once;

use common::{Noise, functions, tiled};
use relightable_photo::format::{
    self, CaptureMetadata, ChunkId, EncodedFile, EncoderInput, EncodingTarget, FileIndex,
    FormatError, FormatExtension, Limits, LtmReader, Metadata, ShardId, Spool,
};
use relightable_photo::job_executor::SequentialExecutor;
use relightable_photo::pyramid::{
    PyramidLayout, PyramidReader, PyramidSource, no_shard, write_pyramid,
};
use relightable_photo::relight::{Light, OutputTransform, reference};
use relightable_photo::transport::{
    Basis, CHANNELS, CameraPixel, Correspondence, Decibels, DisplacementGrid, FloatTile, Geometry,
    ShardOrigin, Tile, TileRect,
};

/// The files, as appendix G of `docs/format.md` lists them.
const NAMES: [&str; 9] = [
    "transform",
    "coarse",
    "direct",
    "mixed",
    "lossless",
    "extended",
    "bent",
    "dark",
    "levels",
];

/// The bytes of a fixture; with `UPDATE_CONFORMANCE` all fixtures are written first.
fn fixture(name: &str, extension: &str) -> Vec<u8> {
    static UPDATED: Once = Once::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/format");
    let path = |name: &str, extension: &str| folder.join(format!("{name}.{extension}"));
    UPDATED.call_once(|| {
        if std::env::var_os("UPDATE_CONFORMANCE").is_none() {
            return;
        }
        fs::create_dir_all(&folder).unwrap();
        for name in NAMES {
            let file = make(name);
            let values: Vec<u8> = parts(&file).into_iter().flat_map(decoded).collect();
            let expected = zstd::bulk::compress(&values, 19).unwrap();
            fs::write(path(name, "ltm"), &file).unwrap();
            fs::write(path(name, "expected.zst"), expected).unwrap();
        }
    });
    fs::read(path(name, extension)).unwrap()
}

/// A synthetic light transport.
struct Synthetic {
    geometry: Geometry,
    basis: Option<Basis>,
    tiles: Vec<FloatTile>,
}

impl Synthetic {
    /// Coefficients for the tiles `lit`; the others are dark.
    fn factored(geometry: Geometry, rank: usize, lit: &[usize]) -> Self {
        let mut noise = Noise(7);
        let kernel = |k: usize| -> Vec<f32> {
            let elements = (0..geometry.window.area()).map(|_| noise.next() as f32 - 0.4);
            elements.map(|v| v + 1.0 / (1.0 + k as f32)).collect()
        };
        let basis = Basis {
            kernels: (0..rank).map(kernel).collect(),
        };
        let mut tiles: Vec<FloatTile> = geometry.tiles().map(FloatTile::dark).collect();
        for &i in lit {
            tiles[i].coefficients = coefficients(tiles[i].rect, rank, &mut noise);
        }
        Self {
            geometry,
            tiles,
            basis: Some(basis),
        }
    }

    /// Adds direct functions to some tiles, with a peak in the centre of the window.
    fn and_direct(mut self, tiles: &[usize]) -> Self {
        let functions = functions(self.geometry.clone(), 3);
        let (side, area) = (
            self.geometry.window.side() as usize,
            self.geometry.window.area(),
        );
        for &i in tiles {
            let element = |(at, tau): (usize, &[f32; CHANNELS])| {
                let squared_distance = |i: usize| i.abs_diff(side / 2).pow(2) as f32;
                let slot = at % area;
                let distance = 1.0 + squared_distance(slot % side) + squared_distance(slot / side);
                tau.map(|t| (40.0 * t - 1.0) / (distance * distance))
            };
            self.tiles[i].functions = functions[i].tau.iter().enumerate().map(element).collect();
        }
        self
    }

    /// Makes a tile dark under a uniform light, so that its component 0 is zero.
    fn dark_under_uniform_light(mut self, tile: usize) -> Self {
        if let Some(basis) = &self.basis {
            let sum = |k: usize| basis.kernels[k].iter().sum::<f32>();
            let share = -sum(0) / sum(1);
            for pixel in self.tiles[tile].coefficients.chunks_mut(basis.rank()) {
                pixel[1] = pixel[0].map(|c| c * share);
                pixel[2..].fill([0.0; CHANNELS]);
            }
        }
        self
    }

    fn encode(
        &self,
        target: EncodingTarget<'_>,
        metadata: Metadata,
        extensions: Vec<FormatExtension>,
    ) -> Vec<u8> {
        let source = EncoderInput {
            geometry: self.geometry.clone(),
            basis: self.basis.as_ref(),
            tile: &|i| Ok(self.tiles[i].clone()),
            metadata,
            extensions,
        };
        let mut file = Vec::new();
        let encoded = EncodedFile::new(source, target, &SequentialExecutor).unwrap();
        encoded.write(&mut file).unwrap();
        file
    }
}

/// One colour on either side of a diagonal; brightness changes slowly along both axes.
fn coefficients(rect: TileRect, rank: usize, noise: &mut Noise) -> Vec<[f32; CHANNELS]> {
    let mut coefficients = Vec::new();
    for pixel in rect.pixels() {
        let (x, y) = (pixel.x as f32 / 20.0, pixel.y as f32 / 14.0);
        let colour = match x > y {
            true => [1.0, 0.4, 0.1],
            false => [0.2, 0.5, 0.8],
        };
        for k in 0..rank {
            let wave = (1.0 - x) * (0.7 - y) + if k % 2 == 0 { x } else { -y };
            let size = (0.3 + wave) / (1 + k * k) as f32;
            coefficients.push(colour.map(|c| c * size + 0.05 * (noise.next() as f32 - 0.5)));
        }
    }
    coefficients
}

fn metadata() -> Metadata {
    Metadata {
        writer: "conformance".to_owned(),
        ..Metadata::default()
    }
}

fn make(name: &str) -> Vec<u8> {
    // Tiles at the borders have few columns or rows.
    let wide = tiled(
        [70, 37],
        [36, 19],
        5,
        32,
        [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]],
    );
    let narrow = tiled(
        [35, 21],
        [18, 11],
        5,
        16,
        [[0.5, 0.01, 0.0], [-0.02, 0.5, 0.0]],
    );
    let small = tiled([17, 11], [9, 6], 3, 8, [[0.5, 0.0, 0.25], [0.0, 0.5, 0.25]]);
    let broad = tiled(
        [42, 25],
        [21, 13],
        5,
        24,
        [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]],
    );
    // Windows cross each border of the light plane, or lie off it.
    let crossing = tiled([20, 10], [8, 5], 5, 8, [[0.7, 0.0, -4.0], [0.0, 0.7, -1.0]]);
    let snr = |snr| EncodingTarget::Snr(Decibels(snr));
    let (synthetic, target) = match name {
        "transform" => (Synthetic::factored(wide, 4, &[0, 2, 3, 4]), snr(40.0)),
        "coarse" => (
            Synthetic::factored(narrow, 5, &[0, 2, 3, 4]).dark_under_uniform_light(4),
            snr(14.0),
        ),
        "direct" => {
            let mut direct = Synthetic::factored(broad, 1, &[]).and_direct(&[1, 2, 3]);
            direct.basis = None;
            (direct, snr(22.0))
        }
        "mixed" => (
            Synthetic::factored(crossing, 3, &[1, 3, 5]).and_direct(&[2, 3]),
            snr(30.0),
        ),
        "lossless" => (
            Synthetic::factored(small, 3, &[0, 2, 4]).and_direct(&[1, 2]),
            EncodingTarget::Lossless,
        ),
        "levels" => return levels(),
        "extended" => return extended(&Synthetic::factored(small, 2, &[0, 2, 3, 4])),
        "bent" => (Synthetic::factored(bent(), 2, &[0, 1, 3, 4]), snr(30.0)),
        "dark" => (Synthetic::factored(small, 2, &[]), snr(30.0)),
        _ => unreachable!("{name}"),
    };
    synthetic.encode(target, metadata(), Vec::new())
}

/// A correspondence that bends along both axes, by up to eight elements, and beyond the light plane.
fn bent() -> Geometry {
    let mut geometry = tiled(
        [41, 27],
        [21, 14],
        5,
        16,
        [[0.5, 0.01, 0.0], [-0.02, 0.5, 0.0]],
    );
    let points = DisplacementGrid::points_over(geometry.camera, 9);
    let code = |(i, j): (u32, u32)| {
        let (i, j) = (i as i16, j as i16);
        [40 * i * i - 97 * j, 300 - 150 * (i - 2) * (i - 2) * j]
    };
    let codes = points.cells().map(code).collect();
    let grid = DisplacementGrid::new(9, 0.011, points, codes).unwrap();
    geometry.correspondence.displacement = Some(grid.into());
    geometry.validate().unwrap()
}

/// A file of three levels, whose positions often fall on borders of elements. Few tiles are lit, at borders of shards.
fn levels() -> Vec<u8> {
    let mut geometry = tiled(
        [523, 41],
        [262, 21],
        5,
        16,
        [[0.5, 0.03, 0.5], [-0.02, 0.5, 4.0]],
    );
    let points = DisplacementGrid::points_over(geometry.camera, 24);
    let code = |(i, j): (u32, u32)| [(i % 5) as i16 - 2, 3 * (j % 2) as i16];
    let codes = points.cells().map(code).collect();
    let grid = DisplacementGrid::new(24, 0.25, points, codes).unwrap();
    geometry.correspondence.displacement = Some(grid.into());
    let lit = Synthetic::factored(geometry.clone(), 2, &[0, 15, 16, 48, 98]).and_direct(&[49, 65]);
    let file = lit.encode(EncodingTarget::Snr(Decibels(25.0)), metadata(), Vec::new());
    let (index, fetch) = chunks(&file);
    let layout = PyramidLayout {
        shard_side: 256,
        ..PyramidLayout::of_levels(3)
    };
    let spools = [(); 2].map(|()| Spool::new(Cursor::new(Vec::new())));
    let mut out = Vec::new();
    let source = PyramidSource {
        index: &index,
        fetch: &fetch,
    };
    write_pyramid(
        source,
        &no_shard,
        layout,
        spools,
        &SequentialExecutor,
        &mut out,
    )
    .unwrap();
    out
}

/// The root and the shards of a file, or the file of one level.
fn parts(file: &[u8]) -> Vec<&[u8]> {
    let mut reader = LtmReader::new(Limits::default());
    let root_bytes = u64::from_le_bytes(file[88..96].try_into().unwrap());
    reader.feed(0, &file[..root_bytes as usize]).unwrap();
    let index = reader.index().unwrap().clone();
    let Some(pyramid) = PyramidReader::new(index, Limits::default()).unwrap() else {
        return vec![file];
    };
    let root = ShardId {
        level: pyramid.table().levels() - 1,
        x: 0,
        y: 0,
    };
    let ids = std::iter::once(&root).chain(pyramid.table().shards());
    let ranges = ids.map(|id| pyramid.range(*id).unwrap());
    ranges
        .map(|range| &file[range.start as usize..range.end as usize])
        .collect()
}

/// A file with everything that a reader of version 1.0 ignores, and text beyond ASCII.
fn extended(synthetic: &Synthetic) -> Vec<u8> {
    let metadata = Metadata {
        title: "Rosace nord – «la Création» · 北の薔薇窓 🌹".to_owned(),
        creator: "Zoë Ångström".to_owned(),
        rights: "© Łódź, CC BY 4.0".to_owned(),
        capture: CaptureMetadata {
            patterns: 80,
            photographs: 83,
        },
        units: "1".to_owned(),
        shots_used: vec![0, 1, 4],
        ..metadata()
    };
    let extension = |tag: &[u8; 4], data: &[u8]| FormatExtension {
        tag: *tag,
        must_understand: false,
        data: data.to_vec(),
    };
    let extensions = vec![extension(b"test", b"anything"), extension(b"none", b"")];
    let mut file = synthetic.encode(EncodingTarget::Snr(Decibels(30.0)), metadata, extensions);
    // A field that version 1.0 does not have.
    let units = b"\"units\"";
    let at = file.windows(units.len()).position(|bytes| bytes == units);
    file[at.unwrap()..][..units.len()].copy_from_slice(b"\"later\"");
    common::sealed(file, |file| {
        file[14] = 7; // minor version
        file[128..140].fill(0xA5); // reserved
    })
}

fn read(file: &[u8]) -> LtmReader {
    let mut reader = LtmReader::new(Limits::default());
    reader.feed(0, file).unwrap();
    reader
}

/// A file's index, and a function that gives the bytes of a chunk.
fn chunks(file: &[u8]) -> (FileIndex, impl Fn(ChunkId) -> Result<Vec<u8>, FormatError>) {
    let index = read(file).index().unwrap().clone();
    let ranges = index.clone();
    let fetch = move |chunk| {
        let range = ranges.range(chunk);
        Ok(file[range.start as usize..range.end as usize].to_vec())
    };
    (index, fetch)
}

/// The decoded values of a file: coefficients and direct functions of each tile, then the basis.
fn decoded(file: &[u8]) -> Vec<u8> {
    let (index, fetch) = chunks(file);
    let geometry = index.header.geometry.clone();
    let mut values: Vec<f32> = Vec::new();
    for (i, rect) in geometry.tiles().enumerate() {
        let tile = format::decode_tile(&index, i, &fetch).unwrap();
        let tile_values = [
            (tile.coefficients, usize::from(index.header.rank)),
            (tile.functions, geometry.window.area()),
        ];
        for (mut tile_values, values_per_pixel) in tile_values {
            // A vector is empty if all values are zero.
            tile_values.resize(rect.extent.area() * values_per_pixel, [0.0; CHANNELS]);
            values.extend(tile_values.as_flattened());
        }
    }
    let basis = format::decode_basis(&index, &fetch).unwrap();
    values.extend(basis.kernels.iter().flatten());
    let mut bytes: Vec<u8> = values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    let Correspondence {
        displacement,
        origin,
        ..
    } = &geometry.correspondence;
    let is_shard =
        *origin != ShardOrigin::ZERO || index.extensions.iter().any(|e| &e.tag == b"SHRD");
    if displacement.is_some() || is_shard {
        for (x, y) in geometry.camera.cells() {
            let origin = geometry.window_origin(CameraPixel { x, y });
            bytes.extend([origin.u, origin.v].map(i32::to_le_bytes).as_flattened());
        }
    }
    bytes
}

/// A hexadecimal dump as in `docs/format.md`.
fn dump(bytes: &[u8]) -> String {
    let line = |(i, line): (usize, &[u8])| {
        let hex: Vec<String> = line.iter().map(|byte| format!("{byte:02X}")).collect();
        let text = line.iter().map(|&byte| match byte {
            b' '..=b'~' => char::from(byte),
            _ => '.',
        });
        let text: String = text.collect();
        format!("    {:04X}  {:<47}  {text}\n", 16 * i, hex.join(" "))
    };
    bytes.chunks(16).enumerate().map(line).collect()
}

#[test]
fn conformance_files_decode_to_the_same_bits() {
    for name in NAMES {
        let file = fixture(name, "ltm");
        let expected = fixture(name, "expected.zst");
        let expected = zstd::bulk::decompress(&expected, 1 << 26).unwrap();
        let got = parts(&file)
            .into_iter()
            .flat_map(decoded)
            .collect::<Vec<u8>>();
        assert_eq!(got.len(), expected.len(), "{name}");
        let (got, expected) = (got.as_chunks::<4>().0, expected.as_chunks::<4>().0);
        let wrong = got.iter().zip(expected).filter(|(a, b)| a != b).count();
        assert_eq!(wrong, 0, "{name}: of {} values", got.len());
    }
}

#[test]
fn the_reader_quantises_the_decoded_values() {
    for (name, file) in NAMES.map(|name| (name, fixture(name, "ltm"))) {
        let Some(file) = parts(&file).pop() else {
            panic!("{name} has no part");
        };
        let (index, fetch) = chunks(file);
        let basis = format::decode_basis(&index, &fetch).unwrap();
        let (transport, _) = read(file).finish().unwrap();
        assert_eq!(transport.basis, basis, "{name}");
        for (i, tile) in transport.tiles.iter().enumerate() {
            let values = format::decode_tile(&index, i, &fetch).unwrap();
            assert_eq!(
                tile,
                &Tile::quantise(&values, basis.rank()),
                "{name}, tile {i}"
            );
        }
    }
}

/// Panics unless `docs/format.md` has these lines.
fn assert_specified(lines: &str) {
    let document = include_str!("../docs/format.md");
    assert!(document.contains(lines), "docs/format.md lacks\n{lines}");
}

#[test]
fn the_specification_shows_the_smallest_file() {
    assert_specified(&dump(&fixture("dark", "ltm")));
}

/// Appendix K, which `tests/format_example.py` computes as well.
#[test]
fn the_specification_shows_windows_light_transport_functions_and_a_picture() {
    let file = fixture("mixed", "ltm");
    let (index, fetch) = chunks(&file);
    let geometry = index.header.geometry.clone();
    let (window, plane) = (geometry.window, geometry.light);

    let pixels = [(0, 0), (5, 1), (5, 8), (12, 3), (19, 9)];
    let windows = pixels.map(|(x, y)| {
        let pixel = CameraPixel { x, y };
        let (at, origin) = (
            geometry.correspondence.at(pixel),
            geometry.window_origin(pixel),
        );
        format!(
            "    pixel ({x}, {y}): u {:.2}, v {:.2}, origin ({}, {})\n",
            at.u, at.v, origin.u, origin.v
        )
    });
    assert_specified(&windows.concat());

    let origin = geometry.window_origin(CameraPixel { x: 5, y: 8 });
    let elements: Vec<_> = (0..window.area())
        .map(|slot| window.element(origin, slot).index_in(plane))
        .collect();
    let row = |(i, row): (usize, &[Option<usize>])| {
        let element = |m: &Option<usize>| m.map_or("   -".to_owned(), |m| format!("{m:4}"));
        let row: String = row.iter().map(element).collect();
        format!("    slots {:2} to {:2}:{row}\n", 5 * i, 5 * i + 4)
    };
    let mask: String = elements.chunks(5).enumerate().map(row).collect();
    assert_specified(&mask);

    let numbers = |values: &[f32]| -> String {
        let values: Vec<_> = values.iter().map(|value| format!("{value:.6}")).collect();
        values.join(" ")
    };
    let basis = format::decode_basis(&index, &fetch).unwrap();
    let tile = format::decode_tile(&index, 3, &fetch).unwrap();
    let tau = tile.functions(&geometry, Some(&basis)).tau;
    for slot in [2, 3, 14] {
        let tau = tau[5 * window.area() + slot];
        assert_specified(&format!("      τ                 {}\n", numbers(&tau)));
    }

    let light = Light::from_srgb_rows(plane, plane, |v, row| {
        for (u, pixel) in row.as_chunks_mut().0.iter_mut().enumerate() {
            *pixel = [255 - 32 * u, 60 * v, 15 + 16 * (u + v), 255].map(|code| code as u8);
        }
    });
    let light = light.unwrap();
    for m in [0, 17, 39] {
        let emission = numbers(&light.elements()[m][..CHANNELS]);
        assert_specified(&format!(", light {emission}\n"));
    }

    let (transport, _) = read(&file).finish().unwrap();
    let picture = reference::picture(&transport, &light, &OutputTransform::srgb(1.0 / 16.0));
    for channel in 0..CHANNELS {
        let row = |row: &[[u8; 4]]| {
            let codes = row.iter().map(|pixel| format!(" {:3}", pixel[channel]));
            format!("   {}\n", codes.collect::<String>())
        };
        let rows: String = picture.pixels.chunks(20).map(row).collect();
        assert_specified(&rows);
    }
}
