//! The `.ltm` file: what goes in comes out, and nothing damaged passes.
#![allow(clippy::unwrap_used)] // a test that cannot go on should stop

mod common;

use common::{Noise, functions, geometry};
use proptest::prelude::*;
use relightable_photo::format::{
    EncodedTile, FormatError, HEADER_BYTES, Limits, Metadata, Part, Reader, TileKind, write,
};
use relightable_photo::transport::{
    Basis, DirectTile, FactoredTile, Geometry, RecoveredTile, Transport,
};

/// What a recovery yields.
struct Recovered {
    geometry: Geometry,
    basis: Option<Basis>,
    tiles: Vec<RecoveredTile>,
}

impl Recovered {
    /// Direct tiles, the first of them dark.
    fn direct(geometry: Geometry, seed: u64) -> Self {
        let tiles = functions(geometry, seed).into_iter();
        Self {
            geometry,
            basis: None,
            tiles: tiles.map(RecoveredTile::Direct).collect(),
        }
    }

    /// The same with every other tile factored over a basis of unit norm, in the last component
    /// never, and one factored tile dark.
    fn mixed(geometry: Geometry, rank: usize, seed: u64) -> Self {
        let mut recovered = Self::direct(geometry, seed);
        let mut noise = Noise(seed);
        let kernel = |_| {
            let elements = (0..geometry.window.area()).map(|_| noise.next() as f32 - 0.4);
            let kernel: Vec<f32> = elements.collect();
            let norm = kernel.iter().map(|v| v * v).sum::<f32>().sqrt();
            kernel.into_iter().map(|v| v / norm).collect()
        };
        recovered.basis = Some(Basis {
            kernels: (0..rank).map(kernel).collect(),
        });
        for (i, rect) in geometry.tiles().enumerate().skip(1).step_by(2) {
            let coefficient = |j: usize| {
                let (k, last) = (j % rank, rank - 1);
                let size = if i == 3 || k == last && k > 0 {
                    0.0
                } else {
                    (1.0 + k as f32).powi(-2)
                };
                [1.0, 0.5, 2.0].map(|c| c * size * (noise.next() as f32 - 0.3))
            };
            recovered.tiles[i] = RecoveredTile::Factored(FactoredTile {
                rect,
                coefficients: (0..rect.extent.area() * rank).map(coefficient).collect(),
            });
        }
        recovered
    }

    fn encoded(&self) -> Vec<EncodedTile> {
        let encode = |tile| EncodedTile::new(&self.geometry, tile).unwrap();
        self.tiles.iter().map(encode).collect()
    }

    fn file(&self) -> Vec<u8> {
        let mut file = Vec::new();
        let basis = self.basis.as_ref();
        write(
            &self.geometry,
            &metadata(),
            basis,
            &self.encoded(),
            &mut file,
        )
        .unwrap();
        file
    }

    /// What is to be read of it, but for the rounding of coefficients.
    fn expected(&self) -> Transport {
        let quantise = |tile: &RecoveredTile| {
            let functions = tile.clone().functions(&self.geometry, self.basis.as_ref());
            DirectTile::quantise(&functions)
        };
        Transport {
            geometry: self.geometry,
            tiles: self.tiles.iter().map(quantise).collect(),
        }
    }
}

fn decode(file: &[u8], piece: usize) -> Result<(Transport, Metadata), FormatError> {
    let mut reader = Reader::new(Limits::default());
    for piece in file.chunks(piece.max(1)) {
        reader.feed(reader.position(), piece)?;
    }
    reader.finish()
}

fn metadata() -> Metadata {
    Metadata {
        writer: "test".to_owned(),
        method: "nnls".to_owned(),
        shots_used: vec![0, 2, 5],
    }
}

/// Six tiles of 8 x 8 pixels and less.
fn small_geometry() -> Geometry {
    geometry([17, 9], [8, 6], 3, [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]])
}

fn direct_file() -> Vec<u8> {
    Recovered::direct(small_geometry(), 1).file()
}

/// Tiles 0 and 3 dark, 1 and 5 factored, 2 and 4 direct.
fn mixed() -> Recovered {
    Recovered::mixed(small_geometry(), 4, 1)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn any_transport_survives_in_pieces_of_any_size(
        camera in [1u32..40, 1u32..40], light in [1u32..20, 1u32..20], half in 0u32..4,
        offset in -30.0f64..30.0, seed in any::<u64>(), piece in 1usize..5000,
    ) {
        let affine = [[0.5, 0.01, offset], [-0.02, 0.5, 0.25]];
        let recovered = Recovered::direct(geometry(camera, light, 2 * half + 1, affine), seed);
        let (decoded, meta) = decode(&recovered.file(), piece).unwrap();
        prop_assert_eq!(decoded, recovered.expected());
        prop_assert_eq!(meta, metadata());
    }

    #[test]
    fn factored_tiles_survive_but_for_rounding(
        camera in [1u32..40, 1u32..40], light in [1u32..20, 1u32..20], half in 0u32..4,
        offset in -30.0f64..30.0, rank in 1usize..20, seed in any::<u64>(),
        piece in 1usize..5000,
    ) {
        let affine = [[0.5, 0.01, offset], [-0.02, 0.5, 0.25]];
        let geometry = geometry(camera, light, 2 * half + 1, affine);
        let recovered = Recovered::mixed(geometry, rank, seed);
        let (decoded, _) = decode(&recovered.file(), piece).unwrap();
        let area = geometry.window.area();
        for (i, want) in recovered.expected().tiles.iter().enumerate() {
            let got = &decoded.tiles[i];
            let RecoveredTile::Factored(tile) = &recovered.tiles[i] else {
                prop_assert_eq!(got, want);
                continue;
            };
            prop_assert_eq!(got.rect, want.rect);
            // Half a step of each coefficient, on kernels of unit norm; then half a code at most
            // on either side, as the codes' own step changes little.
            let peak = |c: usize| {
                let sizes = tile.coefficients.iter().map(|coefficient| coefficient[c].abs());
                sizes.fold(0.0, f32::max)
            };
            for c in 0..3 {
                let bound = 0.51 * peak(c) / 32767.0 * (rank as f32).sqrt() + 1.01 * want.step[c];
                for at in 0..got.rect.extent.area() * area {
                    let [got, want] = [got, want].map(|t| t.tau(area, at / area, at % area)[c]);
                    prop_assert!((got - want).abs() <= bound, "{got} is not {want}");
                }
            }
        }
    }
}

#[test]
fn the_same_transport_gives_the_same_bytes() {
    assert_eq!(direct_file(), direct_file());
    assert_eq!(mixed().file(), mixed().file());
}

#[test]
fn tiles_keep_their_kinds() {
    let recovered = mixed();
    let file = recovered.file();
    let mut reader = Reader::new(Limits::default());
    reader.feed(0, &file).unwrap();
    let kinds: Vec<_> = reader.entries().iter().map(|entry| entry.kind).collect();
    // The last component is zero throughout.
    let factored = TileKind::Factored { components: 3 };
    let (dark, direct) = (TileKind::Dark, TileKind::Direct);
    assert_eq!(kinds, [dark, factored, direct, dark, direct, factored]);
    assert_eq!(reader.header().unwrap().rank, 4);
    assert!(reader.finish().unwrap().0.tiles[3].is_dark());
}

#[test]
fn a_tile_can_be_kept_by_itself() {
    let recovered = mixed();
    for (i, tile) in recovered.encoded().into_iter().enumerate() {
        let bytes = tile.to_bytes().unwrap();
        let restore =
            |rank, bytes: &[u8]| EncodedTile::from_bytes(&recovered.geometry, rank, i, bytes);
        assert_eq!(restore(4, &bytes).unwrap(), tile);
        for length in 0..bytes.len() {
            let error = restore(4, &bytes[..length]).unwrap_err();
            assert!(matches!(error, FormatError::Truncated { .. }), "{error}");
        }
        let error = restore(4, &[&bytes[..], b"."].concat()).unwrap_err();
        assert!(matches!(error, FormatError::TrailingBytes { .. }));
        if !matches!(tile.kind(), TileKind::Dark) {
            let mut damaged = bytes.clone();
            *damaged.last_mut().unwrap() ^= 1;
            let part = Part::Tile(i);
            let error = restore(4, &damaged).unwrap_err();
            assert!(matches!(error, FormatError::Checksum { part: p } if p == part));
        }
        if matches!(tile.kind(), TileKind::Factored { .. }) {
            let error = restore(2, &bytes).unwrap_err();
            assert!(matches!(error, FormatError::Kind { tile } if tile == i));
        }
    }
}

#[test]
fn factored_tiles_are_not_written_without_their_basis() {
    let recovered = mixed();
    let tiles = recovered.encoded();
    let mut short = recovered.basis.clone().unwrap();
    short.kernels.truncate(2);
    for (basis, there_is) in [(None, 0), (Some(&short), 2)] {
        let geometry = &recovered.geometry;
        let error = write(geometry, &metadata(), basis, &tiles, &mut Vec::new()).unwrap_err();
        assert!(matches!(
            error,
            FormatError::Components { tile: 1, components: 3, rank } if rank == there_is
        ));
    }
    let large = Basis {
        kernels: vec![vec![0.1; 9]; 1025],
    };
    let (geometry, mut out) = (&recovered.geometry, Vec::new());
    let error = write(geometry, &metadata(), Some(&large), &tiles, &mut out).unwrap_err();
    assert!(matches!(error, FormatError::Rank(1025)));
}

#[test]
fn every_truncation_is_refused() {
    for file in [direct_file(), mixed().file()] {
        for length in 0..file.len() {
            let error = decode(&file[..length], 97).unwrap_err();
            assert!(
                matches!(error, FormatError::Truncated { got, .. } if got == length as u64),
                "cut to {length}: {error}"
            );
        }
    }
}

#[test]
fn every_flipped_bit_is_refused() {
    for file in [direct_file(), mixed().file()] {
        for byte in 0..file.len() {
            for bit in 0..8 {
                let mut damaged = file.clone();
                damaged[byte] ^= 1 << bit;
                assert!(
                    decode(&damaged, 1 << 20).is_err(),
                    "bit {bit} of byte {byte}"
                );
            }
        }
    }
}

#[test]
fn what_is_wrong_is_said() {
    let file = direct_file();
    let message = |edit: &dyn Fn(&mut Vec<u8>)| {
        let mut file = file.clone();
        edit(&mut file);
        decode(&file, 1 << 20).unwrap_err().to_string()
    };
    assert!(message(&|f| f[..5].copy_from_slice(b"<html")).contains("not an .ltm file"));
    assert!(
        message(&|f| {
            f.remove(9);
        })
        .contains("text-mode")
    );
    let mangled = [&file[..8], b"\n\x1A\n"].concat();
    let error = decode(&mangled, 1).unwrap_err();
    assert!(matches!(error, FormatError::TextMode), "{error}");
    // By the name, in which readers of version 0.0 saw it, and by the field.
    assert!(message(&|f| f[5..7].copy_from_slice(b"00")).contains("version 0.0"));
    assert!(message(&|f| f[12] = 1).contains("version 1.1"));
    assert!(message(&|f| f[14] = 7).contains("version 0.7"));
    assert!(message(&|f| f[20] ^= 1).contains("header is damaged"));
    assert!(message(&|f| f[HEADER_BYTES + 9] ^= 1).contains("directory is damaged"));
    assert!(message(&|f| *f.last_mut().unwrap() ^= 1).contains("(tile 5) is damaged"));
    assert!(message(&|f| f.push(0)).contains("goes on after its end"));
    assert!(message(&|f| f.truncate(50)).contains("cut short"));
}

/// Offsets of fields that only a file of somebody who means harm has wrong: the checksums of it
/// are right.
mod field {
    use super::HEADER_BYTES;

    pub const METADATA_BYTES: usize = 96;
    pub const RANK: usize = 104;
    pub const BASIS_BYTES: usize = 108;
    pub const BASIS_CRC: usize = 112;
    pub const DIRECTORY_CRC: usize = 116;
    pub const HEADER_CRC: usize = 120;
    /// The entry of the second tile.
    pub const ENTRY: usize = HEADER_BYTES + 32;
    pub const LENGTH: usize = ENTRY + 8;
    pub const STEP: usize = ENTRY + 16;
    pub const KIND: usize = ENTRY + 28;
    pub const COMPONENTS: usize = ENTRY + 30;
}

fn u32_at(file: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(file[at..at + 4].try_into().unwrap())
}

fn put(file: &mut [u8], at: usize, bytes: &[u8]) {
    file[at..at + bytes.len()].copy_from_slice(bytes);
}

/// Makes the checksums of the basis, directory and header right.
fn seal(file: &mut [u8], tiles: usize) {
    let directory = HEADER_BYTES..HEADER_BYTES + 32 * tiles;
    let basis = directory.end + u32_at(file, field::METADATA_BYTES) as usize;
    let basis = basis..(basis + u32_at(file, field::BASIS_BYTES) as usize).min(file.len());
    for (part, at) in [
        (basis, field::BASIS_CRC),
        (directory, field::DIRECTORY_CRC),
        (0..field::HEADER_CRC, field::HEADER_CRC),
    ] {
        let crc = crc32c::crc32c(&file[part]);
        put(file, at, &crc.to_le_bytes());
    }
}

#[test]
fn a_crafted_file_is_refused_for_what_is_wrong_with_it() {
    let file = mixed().file();
    let basis_at = HEADER_BYTES + 32 * 6 + u32_at(&file, field::METADATA_BYTES) as usize;
    let refusal = |edit: &dyn Fn(&mut Vec<u8>)| {
        let mut file = file.clone();
        edit(&mut file);
        seal(&mut file, 6);
        decode(&file, 1 << 20).unwrap_err()
    };
    let kind = |edit: &dyn Fn(&mut Vec<u8>)| {
        let error = refusal(edit);
        assert!(matches!(error, FormatError::Kind { tile: 1 }), "{error}");
    };
    kind(&|f| put(f, field::KIND, &[3, 0]));
    kind(&|f| put(f, field::KIND, &[0, 0]));
    kind(&|f| put(f, field::KIND, &[1, 0]));
    kind(&|f| put(f, field::COMPONENTS, &[5, 0]));
    kind(&|f| put(f, field::COMPONENTS, &[0, 0]));
    kind(&|f| put(f, field::STEP, &f32::NAN.to_le_bytes()));
    kind(&|f| put(f, field::STEP, &0.0f32.to_le_bytes()));
    kind(&|f| put(f, field::LENGTH, &0u32.to_le_bytes()));
    kind(&|f| put(f, field::LENGTH, &u32::MAX.to_le_bytes()));
    // Fewer than were written, for which it is too long; and more.
    kind(&|f| put(f, field::COMPONENTS, &[2, 0]));
    let error = refusal(&|f| put(f, field::COMPONENTS, &[4, 0]));
    let part = Part::Tile(1);
    assert!(
        matches!(error, FormatError::Decompress { part: p, .. } if p == part),
        "{error}"
    );
    let error = refusal(&|f| put(f, field::RANK, &u32::MAX.to_le_bytes()));
    assert!(matches!(error, FormatError::Rank(0xFFFF_FFFF)), "{error}");
    let error = refusal(&|f| put(f, field::RANK, &3u32.to_le_bytes()));
    assert!(
        matches!(
            error,
            FormatError::Decompress {
                part: Part::Basis,
                ..
            }
        ),
        "{error}"
    );
    for (rank, bytes) in [(0, 20), (4, 0), (4, u32::MAX)] {
        let error = refusal(&|f| {
            put(f, field::RANK, &u32::to_le_bytes(rank));
            put(f, field::BASIS_BYTES, &bytes.to_le_bytes());
        });
        assert!(matches!(error, FormatError::BasisLength { .. }), "{error}");
    }
    let error = refusal(&|f| put(f, basis_at, &[0; 8]));
    assert!(error.to_string().contains("basis does not"), "{error}");
    // Sealed no more.
    let mut damaged = file.clone();
    damaged[basis_at + 9] ^= 1;
    let error = decode(&damaged, 1 << 20).unwrap_err();
    assert!(error.to_string().contains("basis is damaged"), "{error}");
}

#[test]
fn a_basis_of_no_numbers_is_refused() {
    let mut recovered = mixed();
    recovered.basis.as_mut().unwrap().kernels[2][5] = f32::INFINITY;
    let error = decode(&recovered.file(), 1000).unwrap_err();
    assert!(
        error.to_string().contains("element 5 of kernel 2"),
        "{error}"
    );
}

#[test]
fn steps_that_overflow_give_a_picture_of_numbers() {
    let mut file = mixed().file();
    put(&mut file, field::STEP, &f32::MAX.to_le_bytes());
    seal(&mut file, 6);
    let (transport, _) = decode(&file, 1000).unwrap();
    let tile = &transport.tiles[1];
    assert!(tile.step.iter().all(|step| step.is_finite()));
    let codes = tile.codes.iter().flatten();
    assert!(codes.max() <= Some(&4095));
}

#[test]
fn a_file_that_asks_for_too_much_memory_is_refused_before_it_gets_any() {
    let refusal = |file: &[u8]| {
        let mut reader = Reader::new(Limits {
            decoded_bytes: 10_000,
        });
        match reader.feed(0, file).unwrap_err() {
            FormatError::Limit {
                need,
                limit: 10_000,
            } => need,
            error => panic!("{error}"),
        }
    };
    let codes = 17 * 9 * 9 * 8;
    assert_eq!(refusal(&direct_file()), codes);
    // And while a tile is multiplied out: its planes, coefficients and functions, and two bases.
    let working = 64 * 4 * 3 * 2 + 64 * 4 * 3 * 4 + 64 * 9 * 3 * 4 + 2 * 4 * 9 * 4;
    assert_eq!(refusal(&mixed().file()), codes + working);
}

#[test]
fn the_reader_says_what_it_wants_and_takes_nothing_else() {
    let file = mixed().file();
    let mut reader = Reader::new(Limits::default());
    assert_eq!(reader.wants(), Some(0..HEADER_BYTES as u64));
    while let Some(range) = reader.wants() {
        assert!(!range.is_empty());
        let bytes = &file[range.start as usize..range.end as usize];
        reader.feed(range.start, bytes).unwrap();
    }
    assert_eq!(reader.position(), file.len() as u64);
    let error = reader.feed(3, &[0]).unwrap_err();
    assert!(matches!(error, FormatError::Offset { got: 3, .. }));
    assert!(reader.finish().is_ok());
}
