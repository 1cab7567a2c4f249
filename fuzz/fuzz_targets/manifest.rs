//! A capture's manifest is refused, or its values are within their ranges.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use relightable_photo::capture::Manifest;

fuzz_target!(|json: &[u8]| {
    let Ok(json) = std::str::from_utf8(json) else {
        return;
    };
    match Manifest::parse(json, Path::new("capture.json")) {
        // The message can be written.
        Err(error) => assert!(error.to_string().contains("capture.json")),
        Ok(manifest) => check(&manifest),
    }
});

fn check(manifest: &Manifest) {
    assert!(!manifest.shots.is_empty());
    let emission = manifest.light.emission();
    assert!(
        emission.iter().all(|e| e.is_finite() && *e >= 0.0),
        "{emission:?}"
    );
    let camera = &manifest.camera;
    assert!(camera.black < camera.white);
    for code in [0, 1, u16::MAX / 2, u16::MAX] {
        assert!(
            !camera.linear(code, 1.0).is_nan(),
            "{camera:?}, code {code}"
        );
        assert!((0..3).all(|c| camera.is_saturated(u16::MAX, c)));
    }
    let extent = camera.extent();
    assert!(extent.width > 0 && extent.height > 0);
}
