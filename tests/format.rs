//! The `.ltm` file: what goes in comes out, and nothing damaged passes.
#![allow(clippy::unwrap_used)] // a test that cannot go on should stop

mod common;

use common::{geometry, transport};
use proptest::prelude::*;
use relightable_photo::format::{
    EncodedTile, FormatError, HEADER_BYTES, Limits, Metadata, Reader, write,
};
use relightable_photo::transport::{Geometry, Transport};

fn encode(transport: &Transport, metadata: &Metadata) -> Vec<u8> {
    let geometry = &transport.geometry;
    let tiles: Vec<_> = transport
        .tiles
        .iter()
        .map(|tile| EncodedTile::new(geometry, tile).unwrap())
        .collect();
    let mut file = Vec::new();
    write(geometry, metadata, &tiles, &mut file).unwrap();
    file
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

fn small_geometry() -> Geometry {
    geometry([17, 9], [8, 6], 3, [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]])
}

fn small_file() -> Vec<u8> {
    encode(&transport(small_geometry(), 1), &metadata())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn any_transport_survives_in_pieces_of_any_size(
        camera in [1u32..40, 1u32..40], light in [1u32..20, 1u32..20], half in 0u32..4,
        offset in -30.0f64..30.0, seed in any::<u64>(), piece in 1usize..5000,
    ) {
        let affine = [[0.5, 0.01, offset], [-0.02, 0.5, 0.25]];
        let transport = transport(geometry(camera, light, 2 * half + 1, affine), seed);
        let file = encode(&transport, &metadata());
        let (decoded, meta) = decode(&file, piece).unwrap();
        prop_assert_eq!(decoded, transport);
        prop_assert_eq!(meta, metadata());
    }
}

#[test]
fn the_same_transport_gives_the_same_bytes() {
    assert_eq!(small_file(), small_file());
}

#[test]
fn every_truncation_is_refused() {
    let file = small_file();
    for length in 0..file.len() {
        let error = decode(&file[..length], 97).unwrap_err();
        assert!(
            matches!(error, FormatError::Truncated { got, .. } if got == length as u64),
            "cut to {length}: {error}"
        );
    }
}

#[test]
fn every_flipped_bit_is_refused() {
    let file = small_file();
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

#[test]
fn what_is_wrong_is_said() {
    let file = small_file();
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
    assert!(message(&|f| f[12] = 1).contains("version 1.0"));
    assert!(message(&|f| f[20] ^= 1).contains("header is damaged"));
    assert!(message(&|f| f[HEADER_BYTES + 9] ^= 1).contains("directory is damaged"));
    assert!(message(&|f| *f.last_mut().unwrap() ^= 1).contains("(tile 5) is damaged"));
    assert!(message(&|f| f.push(0)).contains("goes on after its end"));
    assert!(message(&|f| f.truncate(50)).contains("cut short"));
}

#[test]
fn a_file_that_asks_for_too_much_memory_is_refused_before_it_gets_any() {
    let mut reader = Reader::new(Limits {
        decoded_bytes: 10_000,
    });
    let error = reader.feed(0, &small_file()).unwrap_err();
    assert!(matches!(
        error,
        FormatError::Limit {
            need: 11_016,
            limit: 10_000
        }
    ));
}

#[test]
fn the_reader_says_what_it_wants_and_takes_nothing_else() {
    let file = small_file();
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
