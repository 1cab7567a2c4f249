//! Every recovery method on the fixture, natively and in browsers: the SNR against the true functions is at least a
//! floor, and the same on both targets.
//!
//! The native test writes its SNRs to [`SNR_FILE`] in Cargo's temporary folder; the program for browsers is compiled
//! with that file's text in the environment variable `SOLVERS_NATIVE_SNR`, as `pkg-scripts/test` does it. In a browser
//! the test runs in a worker, as a page would run recovery.
#![allow(clippy::unwrap_used)] // a test that cannot go on should stop

mod glass_s;

use relightable_photo::capture::Measurements;
use relightable_photo::job_executor::SequentialExecutor;
use relightable_photo::recover::{Method, PreparedRecovery, RecoverySettings, SparsityBasis};
use relightable_photo::transport::{Extent, Geometry, SnrAccumulator, TileRect, Window};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::{wasm_bindgen_test, wasm_bindgen_test_configure};

#[cfg(target_arch = "wasm32")]
wasm_bindgen_test_configure!(run_in_dedicated_worker);

/// Where the native test leaves its SNRs: one a line, in the order of [`Method::ALL`].
#[cfg(not(target_arch = "wasm32"))]
const SNR_FILE: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/solvers-snr");

/// Largest difference between the SNRs of two targets, in decibels. Their elementary functions round differently.
#[cfg(target_arch = "wasm32")]
const MAX_TARGET_DIFFERENCE: f64 = 0.01;

/// Smallest SNR that a method may reach on its part of the fixture, in decibels.
fn min_snr(method: Method) -> f64 {
    match method {
        Method::Learned => 34.1,
        Method::Nnls => 16.6,
        Method::Bpdn(SparsityBasis::Identity) => 16.15,
        Method::Bpdn(SparsityBasis::Dct) => 21.2,
        Method::Bpdn(SparsityBasis::Haar) => 22.5,
    }
}

#[cfg_attr(not(target_arch = "wasm32"), test)]
#[cfg_attr(target_arch = "wasm32", wasm_bindgen_test)]
fn every_method_reaches_its_snr_on_every_target() {
    let measurements = glass_s::measurements();
    let truth = glass_s::true_functions();
    let (mut levels, mut failures) = (Vec::new(), Vec::new());
    for &method in Method::ALL {
        let start = seconds();
        let snr = recover(&measurements, method, &truth).snr().unwrap().0;
        let (min, duration) = (min_snr(method), seconds() - start);
        report(&format!(
            "{method:?}: {snr:.4} dB (at least {min}) in {duration:.1} s"
        ));
        if snr < min {
            failures.push(format!("{method:?} reaches {snr:.4} dB, less than {min}"));
        }
        levels.push(snr);
    }
    failures.extend(differences_between_targets(&levels));
    assert!(failures.is_empty(), "{}", failures.join("; "));
}

/// Writes the native SNRs for the test in browsers.
#[cfg(not(target_arch = "wasm32"))]
fn differences_between_targets(levels: &[f64]) -> Vec<String> {
    let lines = levels.iter().map(|snr| format!("{snr:.6}\n"));
    std::fs::write(SNR_FILE, lines.collect::<String>()).unwrap();
    Vec::new()
}

/// Compares SNRs with the native ones.
#[cfg(target_arch = "wasm32")]
fn differences_between_targets(levels: &[f64]) -> Vec<String> {
    let Some(native) = option_env!("SOLVERS_NATIVE_SNR") else {
        return vec!["compiled without SOLVERS_NATIVE_SNR; run pkg-scripts/test".to_owned()];
    };
    let native: Vec<f64> = native
        .split_whitespace()
        .map(|snr| snr.parse().unwrap())
        .collect();
    assert_eq!(native.len(), levels.len());
    let pairs = Method::ALL.iter().zip(levels.iter().zip(&native));
    let differences =
        pairs.filter(|(_, (here, native))| (*here - *native).abs() > MAX_TARGET_DIFFERENCE);
    differences
        .map(|(method, (here, native))| {
            format!("{method:?} reaches {here:.4} dB, natively {native:.4}")
        })
        .collect()
}

/// The window of `method`: the true one, or its middle for the transforms, which take about a minute for all of it.
fn window(method: Method) -> Window {
    match method {
        Method::Bpdn(SparsityBasis::Dct | SparsityBasis::Haar) => Window::new(9).unwrap(),
        _ => glass_s::true_window(),
    }
}

/// The parts of the picture that `method` recovers: all for the learned recovery, which uses neighbours, else the middle.
fn regions(method: Method, geometry: &Geometry) -> Vec<TileRect> {
    let middle = |side: u32| {
        let Extent { width, height } = geometry.camera;
        let [x, y] = [width, height].map(|length| (length - side) / 2);
        let extent = Extent::new(side, side);
        vec![TileRect { x, y, extent }]
    };
    match method {
        Method::Learned => geometry.tiles().collect(),
        Method::Nnls | Method::Bpdn(SparsityBasis::Identity) => middle(32),
        Method::Bpdn(SparsityBasis::Dct | SparsityBasis::Haar) => middle(16),
    }
}

/// Recovers by `method` and returns the error against the true functions, inside the method's window.
fn recover(measurements: &Measurements, method: Method, truth: &[[f64; 3]]) -> SnrAccumulator {
    let window = window(method);
    let settings = RecoverySettings {
        method,
        window,
        is_registered: true,
    };
    let preparation = PreparedRecovery::prepare(measurements, settings, &SequentialExecutor);
    let recovery = pollster::block_on(preparation).unwrap();
    let geometry = recovery.geometry();
    let [side, true_side] = [window, glass_s::true_window()].map(|w| w.side() as usize);
    let margin = (true_side - side) / 2;
    let mut error = SnrAccumulator::default();
    for rect in regions(method, geometry) {
        let tile = recovery.tile(measurements, rect);
        let functions = tile.functions(geometry, recovery.basis());
        let functions = functions.tau.chunks_exact(side * side);
        for (pixel, function) in rect.pixels().zip(functions) {
            let n = geometry.camera.index(pixel);
            for (s, ours) in function.iter().enumerate() {
                let [column, row] = [s % side, s / side].map(|i| margin + i);
                let theirs = truth[(n * true_side + row) * true_side + column];
                for c in 0..3 {
                    error.add(theirs[c], f64::from(ours[c]));
                }
            }
        }
    }
    error
}

#[cfg(not(target_arch = "wasm32"))]
fn seconds() -> f64 {
    use std::time::{SystemTime, UNIX_EPOCH};
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap()
        .as_secs_f64()
}

#[cfg(target_arch = "wasm32")]
fn seconds() -> f64 {
    js_sys::Date::now() / 1000.0
}

fn report(line: &str) {
    #[cfg(not(target_arch = "wasm32"))]
    println!("{line}");
    #[cfg(target_arch = "wasm32")]
    wasm_bindgen_test::console_log!("{line}");
}

#[cfg(not(target_arch = "wasm32"))]
#[test]
fn embedded_fixture_equals_its_folder() {
    use relightable_photo::capture::{
        CameraPixelSet, CaptureFolder, LinearPhoto, NoiseModel, PhotographRowReader,
    };

    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/glass-s");
    let folder = CaptureFolder::open(root.as_ref()).unwrap();
    let camera = folder.manifest().camera.extent();
    let dark = folder.read_dark(&CameraPixelSet::all(camera)).unwrap();
    let embedded = glass_s::measurements();
    let shots: Vec<usize> = (0..folder.manifest().shots.len()).collect();
    let patterns = shots.iter().map(|&i| folder.read_pattern(i).unwrap());
    let correspondence = folder.manifest().correspondence.clone().unwrap();
    let mut read = folder.empty_measurements(
        &shots,
        patterns.collect(),
        correspondence,
        dark.noise(&CameraPixelSet::all(camera)),
    );
    read.loaded = CameraPixelSet::all(read.camera);
    let whole = |mut photo: PhotographRowReader| {
        let mut picture = LinearPhoto::new();
        photo.read(&read.loaded, &dark, &mut picture).unwrap();
        picture
    };
    let pictures = shots.iter().map(|&i| whole(folder.open_shot(i).unwrap()));
    read.photos = pictures.collect();
    read.noise = NoiseModel::with_gain_from(&read);
    assert_eq!((embedded.camera, embedded.light), (read.camera, read.light));
    assert_eq!(embedded.correspondence, read.correspondence);
    assert_eq!(embedded.patterns, read.patterns);
    assert_eq!(embedded.full_scale, read.full_scale);
    assert_eq!(embedded.loaded, read.loaded);
    assert_eq!(embedded.photos, read.photos);
    assert_eq!(embedded.noise, read.noise);

    let truth = folder.truth().unwrap().unwrap();
    assert_eq!(truth.window, glass_s::true_window());
    let functions = glass_s::true_functions();
    let area = truth.window.area();
    for n in 0..embedded.camera.area() {
        let pixel = relightable_photo::transport::CameraPixel {
            x: n as u32 % embedded.camera.width,
            y: n as u32 / embedded.camera.width,
        };
        let origin = truth.window.origin(embedded.correspondence.at(pixel));
        assert_eq!(truth.window_origin(n), origin);
        let ours = &functions[n * area..(n + 1) * area];
        let theirs = truth.tau(n).iter().map(|t| t.map(|t| t.to_f64()));
        assert!(theirs.eq(ours.iter().copied()), "pixel {n}");
    }
}
