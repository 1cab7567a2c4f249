//! The table of a file of several levels, and its shards, are read or refused.
#![no_main]

use fuzzing::{reading, seal};
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};

fuzz_target!(|file: &[u8]| {
    seal::keep(file);
    reading::check_levels(file);
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    seal::mutate(data, size, max_size, seed, fuzzer_mutate)
});
