//! A file is read or refused within the memory budget, and a check chunk by chunk has the same result.
#![no_main]

use fuzzing::{reading, seal};
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};

fuzz_target!(|file: &[u8]| {
    seal::keep(file);
    let _ = reading::check_file(file);
    reading::check_previews(file);
    reading::check_early(file);
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    seal::mutate(data, size, max_size, seed, fuzzer_mutate)
});
