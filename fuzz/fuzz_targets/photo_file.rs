//! A photograph is refused, or has all its samples, within the memory budget.
#![no_main]

use std::io::Cursor;

use fuzzing::heap;
use libfuzzer_sys::fuzz_target;
use relightable_photo::photo_file::{PhotoFormat, decode_photo};

/// Limit of the samples.
const MAX_SAMPLE_BYTES: u64 = 8 << 20;
/// Decoders need as much again, and tables.
const MAX_HEAP_BYTES: usize = 3 * (MAX_SAMPLE_BYTES as usize) + (8 << 20);
/// The TIFF decoder has limits of its own for tags: 256 MiB for the values of one, and then their numbers.
const MAX_TAG_BYTES: usize = 440 << 20;

fuzz_target!(|file: &[u8]| {
    let decode = || decode_photo(Cursor::new(file), MAX_SAMPLE_BYTES);
    let (decoded, peak) = heap::with_peak_bytes(decode);
    let budget = match PhotoFormat::of(file) {
        Some(PhotoFormat::Tiff) => MAX_HEAP_BYTES + MAX_TAG_BYTES,
        _ => MAX_HEAP_BYTES,
    };
    assert!(peak <= budget, "{peak} bytes");
    match decoded {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(photo) => {
            let extent = photo.extent();
            for (x, y) in [(0, 0), (extent.width - 1, extent.height - 1)] {
                let pixel = photo.pixel(x, y);
                let is_code = |code: f64| (0.0..=65_535.0).contains(&code);
                assert!(
                    photo.is_float() || pixel.into_iter().all(is_code),
                    "{pixel:?}"
                );
            }
        }
    }
});
