//! Reads assembled files, of which the fuzzer also chooses the contents of zstd frames.
#![no_main]

use fuzzing::choices::Choices;
use fuzzing::{craft, pieces, reading, seal};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut choices = Choices(data);
    let file = craft::file(&mut choices);
    seal::keep(&file);
    let _ = reading::check_file(&file);
    match choices.chance(128) {
        true => pieces::check(&file, &mut choices),
        false => reading::check_early(&file),
    }
});
