//! A sequence of pictures is refused, or makes a valid manifest, and photographs of any brightness are compared with it.
#![no_main]

use std::path::Path;

use fuzzing::choices::Choices;
use libfuzzer_sys::fuzz_target;
use relightable_photo::acquisition::{PatternSequence, SequenceBrightness};
use relightable_photo::capture::{Manifest, ManifestCamera};

/// The last bytes of the input are the brightness of photographs.
const CHOICES: usize = 64;

fuzz_target!(|data: &[u8]| {
    let (json, choices) = data.split_at(data.len().saturating_sub(CHOICES));
    let Ok(json) = std::str::from_utf8(json) else {
        return;
    };
    let Ok(sequence) = PatternSequence::parse(json) else {
        return;
    };
    let camera = ManifestCamera {
        width: 8,
        height: 8,
        black: 0.0,
        white: 65535.0,
        ..ManifestCamera::default()
    };
    let manifest = serde_json::to_string(&sequence.manifest(camera, None));
    let manifest = manifest.expect("a manifest has only strings and finite numbers");
    let parsed = Manifest::parse(&manifest, Path::new("capture.json"));
    assert!(parsed.is_ok(), "{parsed:?}");
    let mut choices = Choices(choices);
    let count = sequence.pictures.len();
    for photographs in [count, count - 1, count + 1] {
        let parts = |_| vec![f64::from(choices.byte()) / 255.0, choices.f64()];
        let brightness = SequenceBrightness {
            thumbnails: (0..photographs).map(parts).collect(),
        };
        match photographs == count {
            true => assert!(brightness.faults(&sequence).iter().all(|(i, _)| *i < count)),
            false => drop(brightness.gap(&sequence)),
        }
    }
});
