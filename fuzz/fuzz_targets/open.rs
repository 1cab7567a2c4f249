//! A file index is read or refused, and its lengths are within the limits.
#![no_main]

use fuzzing::choices::Choices;
use fuzzing::{reading, seal};
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};

fuzz_target!(|file: &[u8]| {
    seal::keep(file);
    // The last bytes of the file choose the viewport and SNR of the requests.
    let choices = &file[file.len() - file.len().min(32)..];
    reading::check_index(file, &mut Choices(choices));
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    seal::mutate(data, size, max_size, seed, fuzzer_mutate)
});
