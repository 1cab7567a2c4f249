//! The conformance files of `docs/format.md`: they decode to the same bits for ever.
//!
//! `UPDATE_CONFORMANCE=1 cargo test --test conformance` makes them anew, which only a change of what
//! they are to cover asks for: that the encoder chooses other numbers is no reason.
#![cfg(not(target_arch = "wasm32"))]
#![allow(clippy::unwrap_used)] // a test that cannot go on should stop

mod common;

use std::fs;
use std::path::Path;
use std::sync::Once;

use common::{Noise, functions, tiled};
use relightable_photo::executor::SequentialExecutor;
use relightable_photo::format::{
    self, CaptureNote, ChunkId, EncodedFile, Extension, FileIndex, FormatError, Limits, Metadata,
    RateTarget, Reader, Source,
};
use relightable_photo::transport::{BandTile, Basis, CHANNELS, Decibels, Geometry, Tile, TileRect};

/// What each file is, as `docs/format.md` lists them.
const NAMES: [&str; 7] = [
    "transform",
    "coarse",
    "direct",
    "mixed",
    "lossless",
    "extended",
    "dark",
];

/// A file next to the others, made anew first where that is asked for.
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
            let expected = zstd::bulk::compress(&decoded(&file), 19).unwrap();
            fs::write(path(name, "ltm"), &file).unwrap();
            fs::write(path(name, "expected.zst"), expected).unwrap();
        }
    });
    fs::read(path(name, extension)).unwrap()
}

/// A transport made from nothing.
struct Synthetic {
    geometry: Geometry,
    basis: Option<Basis>,
    tiles: Vec<BandTile>,
}

impl Synthetic {
    /// Coefficients for the tiles of these numbers; the others are dark.
    fn factored(geometry: Geometry, rank: usize, lit: &[usize]) -> Self {
        let mut noise = Noise(7);
        let kernel = |k: usize| -> Vec<f32> {
            let elements = (0..geometry.window.area()).map(|_| noise.next() as f32 - 0.4);
            elements.map(|v| v + 1.0 / (1.0 + k as f32)).collect()
        };
        let basis = Basis {
            kernels: (0..rank).map(kernel).collect(),
        };
        let mut tiles: Vec<BandTile> = geometry.tiles().map(BandTile::dark).collect();
        for &i in lit {
            tiles[i].coefficients = coefficients(tiles[i].rect, rank, &mut noise);
        }
        Self {
            geometry,
            tiles,
            basis: Some(basis),
        }
    }

    /// With functions of their own for some tiles, that peak in the middle of the window.
    fn and_direct(mut self, tiles: &[usize]) -> Self {
        let functions = functions(self.geometry, 3);
        let (side, area) = (
            self.geometry.window.side() as usize,
            self.geometry.window.area(),
        );
        for &i in tiles {
            let element = |(at, tau): (usize, &[f32; CHANNELS])| {
                let from_middle = |place: usize| place.abs_diff(side / 2).pow(2) as f32;
                let slot = at % area;
                let far = 1.0 + from_middle(slot % side) + from_middle(slot / side);
                tau.map(|t| (40.0 * t - 1.0) / (far * far))
            };
            self.tiles[i].functions = functions[i].tau.iter().enumerate().map(element).collect();
        }
        self
    }

    /// With a tile that is dark under a flat light, so that its first component is zero.
    fn dark_when_flat(mut self, tile: usize) -> Self {
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
        target: RateTarget<'_>,
        metadata: Metadata,
        extensions: Vec<Extension>,
    ) -> Vec<u8> {
        let source = Source {
            geometry: self.geometry,
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

/// Two colours, one on either side of a diagonal, that change slowly along both axes.
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
    // Tiles at the edges are a few pixels across, or less than that.
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
    // Windows hang over every edge of the display, and lie off it.
    let hanging = tiled([20, 10], [8, 5], 5, 8, [[0.7, 0.0, -4.0], [0.0, 0.7, -1.0]]);
    let snr = |snr| RateTarget::Snr(Decibels(snr));
    let (synthetic, target) = match name {
        "transform" => (Synthetic::factored(wide, 4, &[0, 2, 3, 4]), snr(40.0)),
        "coarse" => (
            Synthetic::factored(narrow, 5, &[0, 2, 3, 4]).dark_when_flat(4),
            snr(14.0),
        ),
        "direct" => {
            let mut direct = Synthetic::factored(broad, 1, &[]).and_direct(&[1, 2, 3]);
            direct.basis = None;
            (direct, snr(22.0))
        }
        "mixed" => (
            Synthetic::factored(hanging, 3, &[1, 3, 5]).and_direct(&[2, 3]),
            snr(30.0),
        ),
        "lossless" => (
            Synthetic::factored(small, 3, &[0, 2, 4]).and_direct(&[1, 2]),
            RateTarget::Lossless,
        ),
        "extended" => return extended(&Synthetic::factored(small, 2, &[0, 2, 3, 4])),
        "dark" => (Synthetic::factored(small, 2, &[]), snr(30.0)),
        _ => unreachable!("{name}"),
    };
    synthetic.encode(target, metadata(), Vec::new())
}

/// What a reader of version 1.0 has to pass over, and letters of all sorts.
fn extended(synthetic: &Synthetic) -> Vec<u8> {
    let metadata = Metadata {
        title: "Rosace nord – «la Création» · 北の薔薇窓 🌹".to_owned(),
        creator: "Zoë Ångström".to_owned(),
        rights: "© Łódź, CC BY 4.0".to_owned(),
        capture: CaptureNote {
            patterns: 80,
            photographs: 83,
        },
        units: "1".to_owned(),
        shots_used: vec![0, 1, 4],
        ..metadata()
    };
    let extension = |tag: &[u8; 4], data: &[u8]| Extension {
        tag: *tag,
        must_understand: false,
        data: data.to_vec(),
    };
    let extensions = vec![extension(b"test", b"anything"), extension(b"none", b"")];
    let mut file = synthetic.encode(RateTarget::Snr(Decibels(30.0)), metadata, extensions);
    // A field that version 1.0 does not have.
    let units = b"\"units\"";
    let at = file.windows(units.len()).position(|bytes| bytes == units);
    file[at.unwrap()..][..units.len()].copy_from_slice(b"\"later\"");
    common::sealed(file, |file| {
        file[14] = 7; // minor version
        file[128..140].fill(0xA5); // reserved
    })
}

fn read(file: &[u8]) -> Reader {
    let mut reader = Reader::new(Limits::default());
    reader.feed(0, file).unwrap();
    reader
}

/// A file's index, and its parts by their number.
fn parts(file: &[u8]) -> (FileIndex, impl Fn(ChunkId) -> Result<Vec<u8>, FormatError>) {
    let index = read(file).index().unwrap().clone();
    let ranges = index.clone();
    let part = move |part| {
        let range = ranges.range(part);
        Ok(file[range.start as usize..range.end as usize].to_vec())
    };
    (index, part)
}

/// Coefficients and functions of every tile, then the basis, as they come out of the decoder.
fn decoded(file: &[u8]) -> Vec<u8> {
    let (index, part) = parts(file);
    let geometry = index.header.geometry;
    let mut values: Vec<f32> = Vec::new();
    for (i, rect) in geometry.tiles().enumerate() {
        let tile = format::decode_tile(&index, i, &part).unwrap();
        let of_tile = [
            (tile.coefficients, usize::from(index.header.rank)),
            (tile.functions, geometry.window.area()),
        ];
        for (mut of_tile, each) in of_tile {
            of_tile.resize(rect.extent.area() * each, [0.0; CHANNELS]); // where it has none
            values.extend(of_tile.as_flattened());
        }
    }
    let basis = format::decode_basis(&index, &part).unwrap();
    values.extend(basis.kernels.iter().flatten());
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

/// Bytes as `docs/format.md` shows them.
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
        let expected = zstd::bulk::decompress(&expected, 1 << 24).unwrap();
        let got = decoded(&file);
        assert_eq!(got.len(), expected.len(), "{name}");
        let (got, expected) = (got.as_chunks::<4>().0, expected.as_chunks::<4>().0);
        let wrong = got.iter().zip(expected).filter(|(a, b)| a != b).count();
        assert_eq!(wrong, 0, "{name}: of {} values", got.len());
    }
}

#[test]
fn tiles_are_made_of_these_values() {
    for name in NAMES {
        let file = fixture(name, "ltm");
        let (index, part) = parts(&file);
        let basis = format::decode_basis(&index, &part).unwrap();
        let (transport, _) = read(&file).finish().unwrap();
        assert_eq!(transport.basis, basis, "{name}");
        for (i, tile) in transport.tiles.iter().enumerate() {
            let numbers = format::decode_tile(&index, i, &part).unwrap();
            assert_eq!(
                tile,
                &Tile::quantise(&numbers, basis.rank()),
                "{name}, tile {i}"
            );
        }
    }
}

#[test]
fn the_specification_shows_the_smallest_file_as_it_is() {
    let text = include_str!("../docs/format.md");
    let file = fixture("dark", "ltm");
    let dump = dump(&file);
    assert!(text.contains(&dump), "docs/format.md lacks\n{dump}");
}
