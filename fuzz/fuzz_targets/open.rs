//! A head is read or refused, and nobody is promised more than limits allow.
#![no_main]

use fuzzing::choices::Choices;
use fuzzing::{reading, seal};
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};

fuzz_target!(|file: &[u8]| {
    seal::keep(file);
    // What is asked of the reader follows from the file, mutation by mutation.
    let choices = &file[file.len() - file.len().min(32)..];
    reading::check_head(file, &mut Choices(choices));
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    seal::mutate(data, size, max_size, seed, fuzzer_mutate)
});
