//! `pkg-scripts/bench recover`: recovery against scipy and scikit-learn on the same measurements in
//! the same run, against problem size and cores, and at the paper's scale.
//!
//! How the comparison is made fair. Ours is the time of whole tiles by the library's own way in
//! ([`Recovery::tile`]) on one thread, divided by pixels and channels: gathering patterns, Gram
//! matrices, right-hand sides and everything else is in it. A peer's time is its solver's call
//! alone, on the same equations as ready arrays, one right-hand side after the other, on one thread;
//! Gram matrices that it can use are given to it and not counted.
//!
//! - Non-negative least squares: `scipy.optimize.nnls`. Objective: `‖y − Ax‖`.
//! - Basis pursuit denoising, φ = I: scikit-learn has no constrained form. Lasso's minimiser at the λ
//!   at which its residual is ε is the constrained problem's, so peers are given that λ, which they
//!   would have to search for: `Lasso(positive=True)` at it, and `lars_path` and `lars_path_gram`
//!   down to it. Objective: `½‖y − Ax‖² + λ‖x‖₁`, in which all can be compared. The ratio is against
//!   the fastest of the three.
//!
//! Objectives are shown as the worst ratio of ours to the peer's, right-hand side by right-hand
//! side: above one, the peer was better.

#![allow(clippy::unwrap_used, clippy::expect_used)] // a bench that cannot go on should stop

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use rayon::prelude::*;
use relightable_photo::capture::{Measurements, Noise, Pattern, Picture, Rows};
use relightable_photo::recover::{Method, OneThread, Recovery, Settings, SparsityBasis, Workers};
use relightable_photo::simulate::{
    Camera, Codes, Ensemble, Exposure, NoiseStream, SceneKind, emission,
};
use relightable_photo::transport::{
    CHANNELS, CameraPx, Extent, TransportError, TransportFunctions, Window,
};
use serde_json::{Value, json};

/// The headline case: S = 225 elements, L = 80 patterns.
const WINDOW: u32 = 15;
const PATTERNS: usize = 80;
const SEED: u64 = 7;
/// Tiles timed, and windows of them that peers get.
const TILES: usize = 4;
const PEER_WINDOWS: usize = 12;

fn main() {
    // `cargo bench` passes flags for a harness this bench does not have.
    let target = PathBuf::from(env!("CARGO_BIN_EXE_ltm-export"));
    let target = target.ancestors().nth(2).unwrap().to_owned();
    let folder = target.join("bench");
    fs::create_dir_all(&folder).unwrap();
    let mut figures = BTreeMap::new();
    against_peers(&folder, &mut figures);
    against_size(&mut figures);
    paper_scale(&folder, &mut figures);
    println!();
    for (key, value) in &figures {
        println!("{key:32} {value:.4}");
    }
    let report = json!({"machine": machine(), "figures": figures});
    let path = folder.join("recover.json");
    fs::write(&path, serde_json::to_string_pretty(&report).unwrap() + "\n").unwrap();
    println!("\n{}", path.display());
}

fn machine() -> String {
    let cpu = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|l| l.strip_prefix("model name"));
    let model = model.map_or(std::env::consts::ARCH, |m| {
        m.trim_start_matches([' ', '\t', ':'])
    });
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{model}, {cores} cores, {}", std::env::consts::OS)
}

fn square(side: u32) -> Extent {
    Extent {
        width: side,
        height: side,
    }
}

/// Stained glass at two camera pixels an element, photographed with noise; and the true transport.
fn photograph(camera: Extent) -> (Measurements, Vec<TransportFunctions>) {
    let light = square(camera.width / 2);
    let scene = SceneKind::StainedGlass.build(camera, light).unwrap();
    let codes: Vec<Codes> = (0..PATTERNS as u32)
        .map(|i| {
            let mut stream = NoiseStream::Pattern(i).start(SEED);
            Ensemble::Gaussian.draw(light, &mut stream).unwrap()
        })
        .collect();
    let sensor = Camera {
        black: 512.0,
        white: 60_000.0,
        electrons: 40_000.0,
        read_noise: 8.0,
    };
    let exposure = Exposure::new(light, &codes);
    let geometry = *scene.geometry();
    let truth: Vec<_> = (0..geometry.tile_grid().area())
        .into_par_iter()
        .map(|i| scene.tile(geometry.tile(i)))
        .collect();
    let mut pictures = vec![vec![[0.0; CHANNELS]; camera.area()]; PATTERNS];
    for functions in &truth {
        let seen = exposure.expose(&geometry, functions);
        for (picture, seen) in pictures.iter_mut().zip(seen) {
            for (pixel, y) in functions.rect.pixels().zip(seen) {
                picture[camera.index(pixel)] = y;
            }
        }
    }
    let code = 1.0 / (sensor.white - sensor.black);
    let photograph = |seen: &[[f32; CHANNELS]], number: u32| -> Picture {
        let mut noise = NoiseStream::Photograph(number).start(SEED);
        let photo = sensor.photograph(seen, &mut noise).unwrap();
        let linear = |value: u16| ((f64::from(value) - sensor.black) * code) as f32;
        photo.iter().map(|codes| codes.map(linear)).collect()
    };
    for (i, picture) in pictures.iter_mut().enumerate() {
        *picture = photograph(picture, i as u32);
    }
    let dark = photograph(&vec![[0.0; CHANNELS]; camera.area()], PATTERNS as u32);
    let patterns = codes.iter().map(|codes| match codes {
        Codes::Grey(codes) => Pattern::Grey(codes.iter().map(|&c| emission(c) as f32).collect()),
        Codes::Rgb(_) => unreachable!("this ensemble is grey"),
    });
    let mut measurements = Measurements {
        camera,
        light,
        correspondence: geometry.correspondence,
        patterns: patterns.collect(),
        full_scale: vec![1.0; PATTERNS],
        rows: Rows::all(camera.height),
        pictures,
        flood: None,
        noise: Noise::from_dark(&dark, camera.width, code),
    };
    measurements.noise = Noise::with_gain_from(&measurements);
    (measurements, truth)
}

fn prepare(measurements: &Measurements, method: Method) -> Recovery {
    let window = Window::new(WINDOW).unwrap();
    Recovery::prepare(measurements, Settings { method, window }, &OneThread).unwrap()
}

fn tile(recovery: &Recovery, measurements: &Measurements, i: usize) -> TransportFunctions {
    let geometry = recovery.geometry();
    recovery
        .tile(measurements, geometry.tile(i))
        .functions(geometry, recovery.basis())
}

/// Seconds of the fastest of a few runs: whatever else the machine does only adds to it.
fn fastest(runs: usize, mut work: impl FnMut()) -> f64 {
    let times = (0..runs).map(|_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

fn snr(recovered: &[TransportFunctions], truth: &[&TransportFunctions]) -> f64 {
    let mut error = TransportError::default();
    for (recovered, truth) in recovered.iter().zip(truth) {
        let pairs = recovered
            .tau
            .iter()
            .flatten()
            .zip(truth.tau.iter().flatten());
        for (r, t) in pairs {
            error.add(f64::from(*t), f64::from(*r));
        }
    }
    error.snr().map_or(f64::NAN, |snr| snr.0)
}

fn against_peers(folder: &Path, figures: &mut BTreeMap<String, f64>) {
    let (measurements, truth) = photograph(square(128));
    println!(
        "Glass, S = {}, L = {PATTERNS}, one thread, per right-hand side:\n",
        WINDOW * WINDOW
    );
    println!(
        "{:28} {:>10} {:>9} {:>16} {:>8}",
        "", "µs", "SNR dB", "objective ours/", "ratio"
    );
    for (name, method) in [
        ("nnls", Method::Nnls),
        ("bpdn", Method::Bpdn(SparsityBasis::Identity)),
    ] {
        let recovery = prepare(&measurements, method);
        // Tiles from the middle of the picture: windows on the display whole.
        let geometry = recovery.geometry();
        let across = geometry.tile_grid().width as usize;
        let tiles: Vec<usize> = (0..geometry.tile_grid().area())
            .filter(|i| {
                (1..across - 1).contains(&(i % across)) && (1..across - 1).contains(&(i / across))
            })
            .take(TILES)
            .collect();
        let mut recovered = Vec::new();
        let seconds = fastest(3, || {
            recovered = tiles
                .iter()
                .map(|&i| tile(&recovery, &measurements, i))
                .collect();
        });
        let sides: usize = recovered
            .iter()
            .map(|f| f.rect.extent.area() * CHANNELS)
            .sum();
        let ours = seconds / sides as f64;
        let truth: Vec<_> = tiles.iter().map(|&i| &truth[i]).collect();
        println!(
            "{:28} {:10.1} {:9.2}",
            format!("{name} (this)"),
            ours * 1e6,
            snr(&recovered, &truth)
        );
        figures.insert(format!("{name}_us"), ours * 1e6);
        figures.insert(format!("{name}_snr_db"), snr(&recovered, &truth));
        write_problems(folder, &measurements, &recovery, &recovered);
        let answer = peers(folder, name);
        let mut fastest_peer = f64::INFINITY;
        for (peer, result) in answer.as_object().unwrap() {
            let theirs = result["seconds"].as_f64().unwrap();
            let objective = result["objective"].as_f64().unwrap();
            println!(
                "{:28} {:10.1} {:>9} {:16.6} {:8.1}",
                format!("  {peer}"),
                theirs * 1e6,
                "",
                objective,
                theirs / ours
            );
            figures.insert(format!("{name}_vs_{peer}"), theirs / ours);
            figures.insert(format!("{name}_objective_vs_{peer}"), objective);
            fastest_peer = fastest_peer.min(theirs);
        }
        let key = if name == "nnls" {
            "nnls_vs_scipy"
        } else {
            "bpdn_vs_sklearn"
        };
        figures.insert(key.to_owned(), fastest_peer / ours);
    }
}

/// Writes the weighted equations of a spread of windows as raw little-endian f64: for each window
/// A `[L, S]`, then for each of its right-hand sides y `[L]` and our x `[S]`.
fn write_problems(
    folder: &Path,
    measurements: &Measurements,
    recovery: &Recovery,
    recovered: &[TransportFunctions],
) {
    let geometry = recovery.geometry();
    let area = geometry.window.area();
    let common_mode = recovery
        .common_mode()
        .expect("both methods choose it")
        .weight();
    let weigh = |values: &mut [f64]| {
        let less = (1.0 - common_mode) * values.iter().sum::<f64>() / values.len() as f64;
        values.iter_mut().for_each(|v| *v -= less);
    };
    let mut bytes = Vec::new();
    let mut write = |value: f64| bytes.extend(value.to_le_bytes());
    for n in 0..PEER_WINDOWS {
        let functions = &recovered[n % recovered.len()];
        // The first of the window's four pixels: both coordinates are even.
        let step = 2 * (1 + n as u32);
        let first = CameraPx {
            x: functions.rect.x + step,
            y: functions.rect.y + (5 * step) % functions.rect.extent.height,
        };
        let origin = geometry.window_origin(first);
        let columns: Vec<Vec<f64>> = (0..area)
            .map(|slot| {
                let element = geometry.window.element(origin, slot);
                let m = element
                    .index_in(geometry.light)
                    .expect("inside the display");
                let mut column: Vec<f64> = (measurements.patterns.iter())
                    .map(|p| f64::from(p.plane(0)[m]))
                    .collect();
                weigh(&mut column);
                column
            })
            .collect();
        for l in 0..PATTERNS {
            columns.iter().for_each(|column| write(column[l]));
        }
        for (dy, dx) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let pixel = CameraPx {
                x: first.x + dx,
                y: first.y + dy,
            };
            assert_eq!(geometry.window_origin(pixel), origin);
            let p = functions.rect.pixels().position(|at| at == pixel).unwrap();
            for c in 0..CHANNELS {
                let mut y: Vec<f64> = (0..PATTERNS)
                    .map(|l| measurements.sample(l, pixel, c))
                    .collect();
                weigh(&mut y);
                y.into_iter().for_each(&mut write);
                for tau in &functions.tau[p * area..(p + 1) * area] {
                    write(f64::from(tau[c]));
                }
            }
        }
    }
    fs::write(folder.join("problems.f64"), bytes).unwrap();
}

/// What the peers need for the same, by name: seconds and worst ratio of objectives.
fn peers(folder: &Path, problem: &str) -> Value {
    let python =
        std::env::var("BENCH_PYTHON").expect("BENCH_PYTHON: run pkg-scripts/bench recover");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/recover_peers.py");
    let output = Command::new(python)
        .arg(script)
        .arg(problem)
        .arg(folder.join("problems.f64"))
        .args([PATTERNS, (WINDOW * WINDOW) as usize, 4 * CHANNELS].map(|n| n.to_string()))
        .envs(["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"].map(|v| (v, "1")))
        .stderr(Stdio::inherit())
        .output()
        .unwrap();
    assert!(output.status.success(), "the peers failed");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Threads of a pool.
struct Pool(rayon::ThreadPool);

impl Workers for Pool {
    fn map<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        self.0
            .install(|| (0..count).into_par_iter().map(work).collect())
    }
}

fn against_size(figures: &mut BTreeMap<String, f64>) {
    println!("\nNon-negative least squares of a whole picture, L = {PATTERNS}, window {WINDOW}:\n");
    println!(
        "{:>10} {:>8} {:>10} {:>14}",
        "camera", "threads", "seconds", "µs a pixel"
    );
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut per_pixel = Vec::new();
    for (side, threads) in [(64, 1), (128, 1), (192, 1), (128, 2)] {
        if threads > cores {
            continue;
        }
        let (measurements, _) = photograph(square(side));
        let recovery = prepare(&measurements, Method::Nnls);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = Pool(pool.build().unwrap());
        let tiles = recovery.geometry().tile_grid().area();
        let seconds = fastest(2, || {
            pool.map(tiles, |i| drop(tile(&recovery, &measurements, i)));
        });
        let pixels = measurements.camera.area();
        let us = seconds / pixels as f64 * 1e6;
        println!(
            "{:>10} {threads:8} {seconds:10.2} {us:14.1}",
            measurements.camera.to_string()
        );
        match threads {
            1 => per_pixel.push(us),
            _ => {
                figures.insert("speedup_on_2_cores".to_owned(), per_pixel[1] / us);
            }
        }
        figures.insert(format!("nnls_{side}_{threads}_threads_seconds"), seconds);
    }
    // 1 where time is linear in the number of pixels; borders, whose windows are smaller, make it
    // a little more.
    figures.insert(
        "time_per_pixel_9x_pixels".to_owned(),
        per_pixel[2] / per_pixel[0],
    );
}

/// The paper's size by the command line's default method, files and all.
fn paper_scale(folder: &Path, figures: &mut BTreeMap<String, f64>) {
    let ltm_export = || Command::new(env!("CARGO_BIN_EXE_ltm-export"));
    let capture = folder.join("paper-scale");
    if !capture.join("capture.json").exists() {
        println!("\nSimulating the paper's scale…");
        let status = ltm_export()
            .args([
                "simulate",
                "stained-glass",
                "--camera",
                "512x512",
                "--light",
                "256x256",
            ])
            .args(["--patterns", "80", "-o"])
            .arg(&capture)
            .status();
        assert!(status.unwrap().success());
    }
    let output = ltm_export()
        .args(["recover", "--patterns", "80", "--window", "15", "--json"])
        .arg(&capture)
        .arg("-o")
        .arg(folder.join("paper-scale.ltm"))
        .stderr(Stdio::inherit())
        .output()
        .unwrap();
    assert!(output.status.success());
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let seconds = report["seconds"].as_f64().unwrap();
    let megabytes = report["peak_rss_bytes"].as_f64().unwrap_or(f64::NAN) / 1e6;
    println!(
        "\nPaper scale, camera 512x512, light 256x256, L = 80, window 15, RGB, by {}: {seconds:.1} s, {megabytes:.0} MB",
        report["method"]
    );
    figures.insert("paper_scale_seconds".to_owned(), seconds);
    figures.insert("paper_scale_peak_mb".to_owned(), megabytes);
}
