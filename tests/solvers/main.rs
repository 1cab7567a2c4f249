//! Solvers build for browsers unchanged, and answer there as they do natively: every method
//! recovers the fixture, or a part of it, on one thread, and must reach the same SNR against its
//! truth on both.
//!
//! In a browser this runs in a worker, as a page would have it.
#![allow(clippy::unwrap_used)] // a test that cannot go on should stop

mod glass_s;

use relightable_photo::capture::Measurements;
use relightable_photo::executor::SequentialExecutor;
use relightable_photo::recover::{Method, Recovery, Settings, SparsityBasis};
use relightable_photo::transport::{Extent, Geometry, TileRect, TransportError};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::{wasm_bindgen_test, wasm_bindgen_test_configure};

#[cfg(target_arch = "wasm32")]
wasm_bindgen_test_configure!(run_in_dedicated_worker);

/// SNR that a method reaches on the fixture, in decibels. A method that was changed on purpose gets
/// its new figure, which the failing test prints.
fn expected_snr(method: Method) -> f64 {
    match method {
        Method::Learned => 34.168,
        Method::Nnls => 18.755,
        Method::Bpdn(SparsityBasis::Identity) => 18.305,
        Method::Bpdn(SparsityBasis::Dct) => 15.736,
        Method::Bpdn(SparsityBasis::Haar) => 16.479,
    }
}

/// Both machines must come this close to the figure, and so within 0.025 dB of each other.
const TOLERANCE: f64 = 0.0125;

/// What the learned prior must reach, whatever figure it is given above.
const LEARNED_AT_LEAST: f64 = 31.0;

#[cfg_attr(not(target_arch = "wasm32"), test)]
#[cfg_attr(target_arch = "wasm32", wasm_bindgen_test)]
fn every_method_recovers_the_fixture_alike() {
    let measurements = glass_s::measurements();
    let truth = glass_s::true_functions();
    let mut off = Vec::new();
    for &method in Method::ALL {
        let start = seconds();
        let error = recover(&measurements, method, &truth);
        let (snr, took) = (error.snr().unwrap().0, seconds() - start);
        let expected = expected_snr(method);
        say(&format!(
            "{method:?}: {snr:.4} dB (expected {expected}) in {took:.1} s"
        ));
        if (snr - expected).abs() > TOLERANCE {
            off.push(format!("{method:?} reaches {snr:.4} dB, not {expected}"));
        }
        if method == Method::Learned && snr < LEARNED_AT_LEAST {
            off.push(format!("{method:?} is below {LEARNED_AT_LEAST} dB"));
        }
    }
    assert!(off.is_empty(), "{}", off.join("; "));
}

/// What is recovered by `method`: the picture, but for transforms, which take about a minute for it,
/// only the middle of it.
fn parts(method: Method, geometry: &Geometry) -> Vec<TileRect> {
    match method {
        Method::Bpdn(SparsityBasis::Dct | SparsityBasis::Haar) => {
            let extent = Extent {
                width: 16,
                height: 16,
            };
            let [x, y] = [24, 24];
            vec![TileRect { x, y, extent }]
        }
        _ => geometry.tiles().collect(),
    }
}

/// Recovers by `method` and adds up the error.
fn recover(measurements: &Measurements, method: Method, truth: &[[f64; 3]]) -> TransportError {
    let window = glass_s::true_window();
    let settings = Settings { method, window };
    let recovery = Recovery::prepare(measurements, settings, &SequentialExecutor).unwrap();
    let (geometry, area) = (recovery.geometry(), window.area());
    let mut error = TransportError::default();
    for rect in parts(method, geometry) {
        let tile = recovery.tile(measurements, rect);
        let functions = tile.functions(geometry, recovery.basis());
        for (p, pixel) in rect.pixels().enumerate() {
            let n = geometry.camera.index(pixel);
            let pixels = [p, n].map(|i| i * area..(i + 1) * area);
            let [ours, theirs] = pixels;
            for (ours, theirs) in functions.tau[ours].iter().zip(&truth[theirs]) {
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

fn say(line: &str) {
    #[cfg(not(target_arch = "wasm32"))]
    println!("{line}");
    #[cfg(target_arch = "wasm32")]
    wasm_bindgen_test::console_log!("{line}");
}

#[cfg(not(target_arch = "wasm32"))]
#[test]
fn what_the_test_carries_is_what_the_folder_holds() {
    use relightable_photo::capture::{CaptureFolder, Noise, Photo, Picture, Rows};

    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/glass-s");
    let folder = CaptureFolder::open(root.as_ref()).unwrap();
    let dark = folder.read_dark().unwrap();
    let carried = glass_s::measurements();
    let shots: Vec<usize> = (0..folder.manifest().shots.len()).collect();
    let patterns = shots.iter().map(|&i| folder.read_pattern(i).unwrap());
    let correspondence = folder.correspondence().unwrap();
    let mut read = folder.no_rows(&shots, patterns.collect(), correspondence, &dark);
    read.rows = Rows::all(read.camera.height);
    let whole = |mut photo: Photo| {
        let mut picture = Picture::new();
        photo.read(&read.rows, &mut picture).unwrap();
        picture
    };
    let pictures = shots.iter().map(|&i| whole(folder.shot(i, &dark).unwrap()));
    read.pictures = pictures.collect();
    read.noise = Noise::with_gain_from(&read);
    assert_eq!((carried.camera, carried.light), (read.camera, read.light));
    assert_eq!(carried.correspondence, read.correspondence);
    assert_eq!(carried.patterns, read.patterns);
    assert_eq!(carried.full_scale, read.full_scale);
    assert_eq!(carried.rows, read.rows);
    assert_eq!(carried.pictures, read.pictures);
    assert_eq!(carried.noise, read.noise);

    let truth = folder.truth().unwrap().unwrap();
    assert_eq!(truth.window(), glass_s::true_window());
    let functions = glass_s::true_functions();
    let area = truth.window().area();
    for n in 0..carried.camera.area() {
        let pixel = relightable_photo::transport::CameraPx {
            x: n as u32 % carried.camera.width,
            y: n as u32 / carried.camera.width,
        };
        let origin = truth.window().origin(carried.correspondence.at(pixel));
        assert_eq!(truth.window_origin(n), origin);
        let ours = &functions[n * area..(n + 1) * area];
        let theirs = truth.tau(n).iter().map(|t| t.map(|t| t.to_f64()));
        assert!(theirs.eq(ours.iter().copied()), "pixel {n}");
    }
}
