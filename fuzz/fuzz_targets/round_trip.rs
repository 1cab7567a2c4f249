//! The reader reads what the encoder writes, whatever the values, with the error that the file declares.
#![no_main]

use fuzzing::choices::Choices;
use fuzzing::source::{ArbitraryInput, ReversedExecutor, TargetChoice};
use fuzzing::{reading, seal};
use libfuzzer_sys::fuzz_target;
use relightable_photo::format::{EncodedFile, EncodingTarget, FormatError};

fuzz_target!(|data: &[u8]| {
    let mut choices = Choices(data);
    let target = TargetChoice::new(&mut choices);
    let encodes_again = choices.rarely();
    let losses: [u8; 9] = match target {
        TargetChoice::Loss(_) => choices.bytes(),
        _ => [0; 9],
    };
    let input = ArbitraryInput::new(&mut choices, target.max_slots());
    let encoded = match target.encode(&input, &losses) {
        Ok(encoded) => encoded,
        Err(FormatError::TooLarge { smallest, limit })
            if matches!(target, TargetChoice::Bytes(_)) =>
        {
            assert!(smallest > limit);
            return;
        }
        Err(error) => panic!("{input:?}, {target:?}: {error}"),
    };
    let file = bytes(&encoded);
    seal::keep(&file);
    let (transport, metadata) = match reading::check_file(&file) {
        Ok(read) => read,
        Err(error) => {
            panic!("{input:?}, {target:?}: the reader refuses the encoder's file: {error}")
        }
    };
    assert_eq!(transport.geometry, input.geometry);
    assert_eq!(
        metadata.read().expect("the encoder writes valid JSON"),
        input.metadata
    );
    if let TargetChoice::Bytes(limit) = target {
        assert!(encoded.bytes() <= limit);
    }
    for (s, scan) in encoded.index().scans.iter().enumerate() {
        assert!(!scan.snr.0.is_nan(), "scan {s} of {input:?}, {target:?}");
    }
    if encodes_again && let TargetChoice::Snr(snr) = target {
        let again = input.encode(EncodingTarget::Snr(snr), &ReversedExecutor);
        assert!(again.is_ok_and(|again| bytes(&again) == file));
    }
    if input.is_moderate && input.has_all_windows_on_plane() {
        reading::check_error(&input, &transport, encoded.snr(), target);
    }
});

fn bytes(file: &EncodedFile) -> Vec<u8> {
    let mut bytes = Vec::new();
    file.write(&mut bytes)
        .expect("writing to memory does not fail");
    assert_eq!(bytes.len() as u64, file.bytes());
    bytes
}
