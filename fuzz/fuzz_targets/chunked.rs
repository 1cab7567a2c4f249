//! A file read in pieces, of any size and in any order, gives the same as the whole file. The last bytes of the
//! fuzzer's input choose the pieces.
#![no_main]

use fuzzing::choices::Choices;
use fuzzing::{pieces, seal};
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};

const CHOICES: usize = 64;

fuzz_target!(|data: &[u8]| {
    let (file, choices) = data.split_at(data.len().saturating_sub(CHOICES));
    seal::keep(file);
    pieces::check(file, &mut Choices(choices));
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    let file = size.saturating_sub(CHOICES);
    if seed % 3 > 0 || file == 0 {
        return fuzzer_mutate(data, size, max_size);
    }
    let choices = data[file..size].to_vec();
    let file = seal::mutate(data, file, max_size - CHOICES, seed / 3, fuzzer_mutate);
    data[file..file + CHOICES].copy_from_slice(&choices);
    file + CHOICES
});
