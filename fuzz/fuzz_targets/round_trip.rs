//! What the encoder writes the reader reads, as well as the file says, whatever the numbers.
#![no_main]

use fuzzing::choices::Choices;
use fuzzing::source::{Backwards, Given, Wanted};
use fuzzing::{reading, seal};
use libfuzzer_sys::fuzz_target;
use relightable_photo::format::{EncodedFile, FormatError, RateTarget};

fuzz_target!(|data: &[u8]| {
    let mut choices = Choices(data);
    let wanted = Wanted::new(&mut choices);
    let backwards = choices.rarely();
    let opinions: [u8; 9] = match wanted {
        Wanted::Loss(_) => choices.bytes(),
        _ => [0; 9],
    };
    let given = Given::new(&mut choices);
    let encoded = match wanted.encode(&given, &opinions) {
        Ok(encoded) => encoded,
        Err(FormatError::TooLarge { smallest, limit }) if matches!(wanted, Wanted::Bytes(_)) => {
            assert!(smallest > limit);
            return;
        }
        Err(error) => panic!("{given:?}, {wanted:?}: {error}"),
    };
    let file = bytes(&encoded);
    seal::keep(&file);
    let (transport, metadata) = match reading::check_file(&file) {
        Ok(read) => read,
        Err(error) => panic!("{given:?}, {wanted:?}: what was written is not read: {error}"),
    };
    assert_eq!(transport.geometry, given.geometry);
    assert_eq!(metadata.read().expect("it was read"), given.metadata);
    if let Wanted::Bytes(most) = wanted {
        assert!(encoded.bytes() <= most);
    }
    for (s, scan) in encoded.index().scans.iter().enumerate() {
        assert!(!scan.snr.0.is_nan(), "scan {s} of {given:?}, {wanted:?}");
    }
    if backwards && let Wanted::Snr(snr) = wanted {
        let again = given.encode(RateTarget::Snr(snr), &Backwards);
        assert!(again.is_ok_and(|again| bytes(&again) == file));
    }
    if given.tame && given.inside() {
        reading::check_error(&given, &transport, encoded.snr(), wanted);
    }
});

fn bytes(file: &EncodedFile) -> Vec<u8> {
    let mut bytes = Vec::new();
    file.write(&mut bytes).expect("memory takes it");
    assert_eq!(bytes.len() as u64, file.bytes());
    bytes
}
