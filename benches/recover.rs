//! `pkg-scripts/bench recover`: the time of recovery against scipy and scikit-learn on the same measurements, against
//! problem size and threads, and at the paper's scale.
//!
//! Our time is that of whole tiles by [`PreparedRecovery::tile`] on one thread, divided by pixels and channels; it includes
//! patterns, Gram matrices and right-hand sides. A peer's time is that of its solver alone, on one thread, for the same
//! equations as ready arrays, one right-hand side after the other; Gram matrices that it can use are not counted. The
//! time of our own solvers alone, on the same arrays, is shown as well.
//!
//! - Non-negative least squares: `scipy.optimize.nnls`. The objective is `‖y − Ax‖`, but at least 1e-10 `‖y‖`: below that
//!   both meet the measurements exactly.
//! - Basis pursuit denoising with φ = I: scikit-learn has no constrained form. The constrained minimiser is Lasso's at
//!   the λ whose residual is ε, so peers are given that λ, for which they would have to search: `Lasso(positive=True)`,
//!   `lars_path` and `lars_path_gram`. The objective is `½‖y − Ax‖² + λ‖x‖₁`, and the time ratio is that to the fastest.
//!
//! Objectives are computed from the solvers' double-precision solutions. The largest ratio of ours to the peer's over
//! all right-hand sides is shown: above 1, the peer's solution is better.

#![allow(clippy::unwrap_used, clippy::expect_used)] // a bench that cannot go on should stop

mod figures;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use rayon::prelude::*;
use relightable_photo::capture::{CameraPixelSet, LinearPhoto, Measurements, NoiseModel, Pattern};
use relightable_photo::job_executor::{Executor, SequentialExecutor};
use relightable_photo::recover::{
    Homotopy, Method, Nnls, PreparedRecovery, RecoverySettings, SparsityBasis,
};
use relightable_photo::simulate::{
    Camera, EmissionMatrix, PatternEnsemble, PatternImage, RandomStreamId, SceneKind, emission,
};
use relightable_photo::transport::{
    CHANNELS, CameraPixel, Extent, SnrAccumulator, TileRect, TileTransportFunctions, Window,
};
use serde_json::Value;

use figures::Figures;

/// The headline case: S = 225 elements, L = 80 patterns.
const WINDOW: u32 = 15;
const PATTERNS: usize = 80;
const SEED: u64 = 7;
/// Tiles that are timed, and windows of these that the peers solve.
const TILES: usize = 4;
const PEER_WINDOWS: usize = 12;
/// ε² of the denoising problems, above the squared residual of least squares, as a share of the measurements' energy.
const EXCESS_RESIDUAL: f64 = 1e-5;
/// Side, in camera pixels, of the sample on which the slow transforms are timed.
const TRANSFORM_SAMPLE_SIDE: u32 = 8;

fn main() {
    // `cargo bench` passes flags for a harness this bench does not have.
    let folder = figures::folder();
    let mut figures = Figures::new();
    against_peers(&folder, &mut figures);
    against_size(&mut figures);
    paper_scale(&folder, &mut figures);
    figures::report("recover", &figures);
}

fn square(side: u32) -> Extent {
    Extent::new(side, side)
}

/// Stained glass at two camera pixels an element, photographed with noise; and the true transport.
fn photograph(camera: Extent) -> (Measurements, Vec<TileTransportFunctions>) {
    let light = square(camera.width / 2);
    let scene = SceneKind::StainedGlass.build(camera, light).unwrap();
    let codes: Vec<PatternImage> = (0..PATTERNS as u32)
        .map(|i| {
            let mut stream = RandomStreamId::Pattern(i).start(SEED);
            PatternEnsemble::Gaussian.draw(light, &mut stream)
        })
        .collect();
    let sensor = Camera {
        electrons: 40_000.0,
    };
    let emissions = EmissionMatrix::new(light, &codes);
    let geometry = scene.geometry().clone();
    let truth: Vec<_> = (0..geometry.tile_grid().area())
        .into_par_iter()
        .map(|i| scene.tile(geometry.tile(i)))
        .collect();
    let mut pictures = vec![vec![[0.0; CHANNELS]; camera.area()]; PATTERNS];
    for functions in &truth {
        let seen = emissions.pictures(&geometry, functions);
        for (picture, seen) in pictures.iter_mut().zip(seen) {
            for (pixel, y) in functions.rect.pixels().zip(seen) {
                picture[camera.index(pixel)] = y;
            }
        }
    }
    let code = 1.0 / (Camera::WHITE - Camera::BLACK);
    let photograph = |seen: &[[f32; CHANNELS]], number: u32| -> LinearPhoto {
        let mut noise = RandomStreamId::Photograph(number).start(SEED);
        let photo = sensor.photograph(seen, &mut noise);
        let linear = |value: u16| ((f64::from(value) - Camera::BLACK) * code) as f32;
        photo.iter().map(|codes| codes.map(linear)).collect()
    };
    for (i, picture) in pictures.iter_mut().enumerate() {
        *picture = photograph(picture, i as u32);
    }
    let dark = photograph(&vec![[0.0; CHANNELS]; camera.area()], PATTERNS as u32);
    let patterns = codes.iter().map(|codes| match codes {
        PatternImage::Grey(codes) => {
            Pattern::Grey(codes.iter().map(|&c| emission(c) as f32).collect())
        }
        PatternImage::Rgb(_) => unreachable!("this ensemble is grey"),
    });
    let mut measurements = Measurements {
        camera,
        light,
        correspondence: geometry.correspondence,
        patterns: patterns.collect(),
        full_scale: vec![1.0; PATTERNS],
        loaded: CameraPixelSet::all(camera),
        photos: pictures,
        flood: None,
        noise: NoiseModel::from_dark(&dark, camera.width, code),
    };
    measurements.noise = NoiseModel::with_gain_from(&measurements);
    (measurements, truth)
}

fn prepare(measurements: &Measurements, method: Method) -> PreparedRecovery {
    let window = Window::new(WINDOW).unwrap();
    let settings = RecoverySettings {
        method,
        window,
        is_registered: true,
    };
    let preparation = PreparedRecovery::prepare(measurements, settings, &SequentialExecutor);
    pollster::block_on(preparation).unwrap()
}

fn tile(
    recovery: &PreparedRecovery,
    measurements: &Measurements,
    rect: TileRect,
) -> TileTransportFunctions {
    recovery
        .tile(measurements, rect)
        .functions(recovery.geometry(), recovery.basis())
}

/// Seconds of the fastest run: anything else that the machine does only adds time.
fn fastest(runs: usize, mut work: impl FnMut()) -> f64 {
    let times = (0..runs).map(|_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

fn snr(recovered: &[TileTransportFunctions], truth: &[TileTransportFunctions]) -> f64 {
    let mut error = SnrAccumulator::default();
    for (recovered, truth) in recovered.iter().zip(truth) {
        // The truth's tile may be larger.
        let area = recovered.tau.len() / recovered.rect.extent.area();
        for (p, pixel) in recovered.rect.pixels().enumerate() {
            let q = truth.rect.pixels().position(|at| at == pixel).unwrap();
            let recovered = recovered.tau[p * area..(p + 1) * area].iter().flatten();
            let truth = truth.tau[q * area..(q + 1) * area].iter().flatten();
            for (r, t) in recovered.zip(truth) {
                error.add(f64::from(*t), f64::from(*r));
            }
        }
    }
    error.snr().map_or(f64::NAN, |snr| snr.0)
}

/// Tiles from the middle of the picture, whose windows lie inside the light plane.
fn inner_tiles(recovery: &PreparedRecovery) -> Vec<usize> {
    let grid = recovery.geometry().tile_grid();
    let across = grid.width as usize;
    let inner = |i: usize| {
        (1..across - 1).contains(&(i % across)) && (1..across - 1).contains(&(i / across))
    };
    (0..grid.area()).filter(|&i| inner(i)).take(TILES).collect()
}

/// Times every method on the same tiles, and its peers.
fn against_peers(folder: &Path, figures: &mut Figures) {
    let (measurements, truth) = photograph(square(128));
    println!(
        "Glass, S = {}, L = {PATTERNS}, one thread, per right-hand side:\n",
        WINDOW * WINDOW
    );
    println!(
        "{:28} {:>10} {:>9} {:>10} {:>16} {:>8}",
        "", "µs", "SNR dB", "prepare s", "objective ours/", "ratio"
    );
    let mut equations = Vec::new();
    for &method in Method::ALL {
        let start = Instant::now();
        let recovery = prepare(&measurements, method);
        let prepared = start.elapsed().as_secs_f64();
        let tiles = inner_tiles(&recovery);
        let (name, transform) = match method {
            Method::Learned => ("learned", false),
            Method::Nnls => ("nnls", false),
            Method::Bpdn(SparsityBasis::Identity) => ("bpdn", false),
            Method::Bpdn(SparsityBasis::Dct) => ("bpdn_dct", true),
            Method::Bpdn(SparsityBasis::Haar) => ("bpdn_haar", true),
        };
        let whole = tiles.iter().map(|&i| recovery.geometry().tile(i));
        let rects: Vec<_> = match transform {
            false => whole.collect(),
            true => whole
                .take(1)
                .map(|rect| middle(rect, TRANSFORM_SAMPLE_SIDE))
                .collect(),
        };
        let mut recovered = Vec::new();
        let seconds = fastest(if transform { 1 } else { 3 }, || {
            recovered = (rects.iter())
                .map(|&rect| tile(&recovery, &measurements, rect))
                .collect();
        });
        let pixels: usize = rects.iter().map(|rect| rect.extent.area()).sum();
        let ours = seconds / (pixels * CHANNELS) as f64;
        let truth: Vec<_> = tiles.iter().map(|&i| truth[i].clone()).collect();
        let snr = snr(&recovered, &truth);
        println!(
            "{:28} {:10.1} {snr:9.2} {prepared:10.2}",
            format!("{name} (this)"),
            ours * 1e6
        );
        figures.insert(format!("{name}_us"), ours * 1e6);
        figures.insert(format!("{name}_snr_db"), snr);
        if method == Method::Nnls {
            equations = WindowEquations::of_windows(&measurements, &recovery, &truth);
        }
        match method {
            Method::Nnls => compare(folder, "nnls", "nnls_vs_scipy", ours, &equations, figures),
            Method::Bpdn(SparsityBasis::Identity) => {
                compare(folder, "bpdn", "bpdn_vs_sklearn", ours, &equations, figures);
            }
            _ => {}
        }
    }
}

/// A square of `side` pixels in the middle of a tile.
fn middle(rect: TileRect, side: u32) -> TileRect {
    TileRect {
        x: rect.x + (rect.extent.width - side) / 2,
        y: rect.y + (rect.extent.height - side) / 2,
        extent: square(side),
    }
}

/// Compares our solver's solutions of `equations` with the peers', and its time and that of whole tiles, `ours`, with
/// theirs.
fn compare(
    folder: &Path,
    name: &str,
    key: &str,
    ours: f64,
    equations: &[WindowEquations],
    figures: &mut Figures,
) {
    let mut solutions = Vec::new();
    let seconds = fastest(3, || {
        solutions = equations.iter().map(|e| e.solve(name)).collect();
    });
    let sides: usize = equations.iter().map(|e| e.sides.len()).sum();
    let alone = seconds / sides as f64;
    write_problems(folder, equations, &solutions);
    let mut answer = run_peers(folder, name);
    let answers = answer.as_object_mut().unwrap();
    let same = answers.remove("this").unwrap();
    println!(
        "{:28} {:10.1} {:9.2}",
        "  solver alone (this)",
        alone * 1e6,
        same["snr"].as_f64().unwrap()
    );
    figures.insert(format!("{name}_solver_us"), alone * 1e6);
    let (mut fastest_peer, mut worst) = (f64::INFINITY, 0.0f64);
    for (peer, result) in answers {
        let [theirs, snr, objective] =
            ["seconds", "snr", "objective"].map(|key| result[key].as_f64().unwrap());
        println!(
            "{:28} {:10.1} {snr:9.2} {:>10} {objective:16.9} {:8.1}",
            format!("  {peer}"),
            theirs * 1e6,
            "",
            theirs / ours
        );
        figures.insert(format!("{name}_vs_{peer}"), theirs / ours);
        figures.insert(format!("{name}_solver_vs_{peer}"), theirs / alone);
        figures.insert(format!("{name}_objective_vs_{peer}"), objective);
        fastest_peer = fastest_peer.min(theirs);
        worst = worst.max(objective);
    }
    figures.insert(key.to_owned(), fastest_peer / ours);
    figures.insert(format!("{name}_worst_objective"), worst);
}

/// The weighted equations of a window, with the right-hand sides of its four pixels.
struct WindowEquations {
    /// `Aᵀ`, `[S, L]`.
    columns: Vec<Vec<f64>>,
    /// `AᵀA`, `[S, S]`.
    gram: Vec<f64>,
    sides: Vec<RightHandSide>,
}

struct RightHandSide {
    y: Vec<f64>,
    /// `Aᵀy`.
    h: Vec<f64>,
    /// ε².
    max_residual: f64,
    truth: Vec<f64>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl WindowEquations {
    /// The equations of windows spread over the tiles.
    fn of_windows(
        measurements: &Measurements,
        recovery: &PreparedRecovery,
        truth: &[TileTransportFunctions],
    ) -> Vec<Self> {
        let common_mode = recovery.common_mode().expect("least squares chooses it");
        let weigh = |mut values: Vec<f64>| {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let less = (1.0 - common_mode.weight()) * mean;
            values.iter_mut().for_each(|v| *v -= less);
            values
        };
        let windows = (0..PEER_WINDOWS).map(|n| {
            let functions = &truth[n % truth.len()];
            Self::new(measurements, recovery, functions, n as u32, &weigh)
        });
        windows.collect()
    }

    fn new(
        measurements: &Measurements,
        recovery: &PreparedRecovery,
        functions: &TileTransportFunctions,
        n: u32,
        weigh: &impl Fn(Vec<f64>) -> Vec<f64>,
    ) -> Self {
        let geometry = recovery.geometry();
        let area = geometry.window.area();
        // The first of the window's four pixels: both coordinates are even.
        let step = 2 * (1 + n);
        let first = CameraPixel {
            x: functions.rect.x + step,
            y: functions.rect.y + (5 * step) % functions.rect.extent.height,
        };
        let origin = geometry.window_origin(first);
        let column = |slot| {
            let element = geometry.window.element(origin, slot);
            let m = (element.index_in(geometry.light)).expect("inside the light plane");
            let emissions = measurements.patterns.iter().map(|p| p.plane(0)[m]);
            weigh(emissions.map(f64::from).collect())
        };
        let columns: Vec<Vec<f64>> = (0..area).map(column).collect();
        let gram = (0..area * area).map(|i| dot(&columns[i / area], &columns[i % area]));
        let mut equations = Self {
            gram: gram.collect(),
            columns,
            sides: Vec::new(),
        };
        for (dy, dx) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let pixel = CameraPixel {
                x: first.x + dx,
                y: first.y + dy,
            };
            assert_eq!(geometry.window_origin(pixel), origin);
            let p = functions.rect.pixels().position(|at| at == pixel).unwrap();
            let truth = &functions.tau[p * area..(p + 1) * area];
            for c in 0..CHANNELS {
                let samples = (0..PATTERNS).map(|l| measurements.sample(l, pixel, c));
                let y = weigh(samples.collect());
                let truth = truth.iter().map(|tau| f64::from(tau[c])).collect();
                equations.add(y, truth);
            }
        }
        equations
    }

    fn add(&mut self, y: Vec<f64>, truth: Vec<f64>) {
        let h: Vec<f64> = self.columns.iter().map(|a| dot(a, &y)).collect();
        let mut residual = y.clone();
        let x = Nnls::new(&self.gram, h.len()).solve(&h);
        for (a, x) in self.columns.iter().zip(x) {
            residual.iter_mut().zip(a).for_each(|(r, a)| *r -= a * x);
        }
        self.sides.push(RightHandSide {
            max_residual: dot(&residual, &residual) + EXCESS_RESIDUAL * dot(&y, &y),
            h,
            y,
            truth,
        });
    }

    /// Our solutions for all right-hand sides.
    fn solve(&self, problem: &str) -> Vec<Vec<f64>> {
        let k = self.columns.len();
        match problem {
            "nnls" => {
                let mut solver = Nnls::new(&self.gram, k);
                self.sides.iter().map(|s| solver.solve(&s.h)).collect()
            }
            _ => {
                let mut solver = Homotopy::new(&self.gram, k);
                let sides = self.sides.iter();
                sides
                    .map(|s| solver.solve(&s.h, dot(&s.y, &s.y), s.max_residual.sqrt()))
                    .collect()
            }
        }
    }
}

/// Writes equations and our solutions as little-endian f64: for each window A `[L, S]`, then for each of its right-hand
/// sides y `[L]`, our x `[S]` and the true one `[S]`.
fn write_problems(folder: &Path, equations: &[WindowEquations], solutions: &[Vec<Vec<f64>>]) {
    let mut bytes = Vec::new();
    let mut write = |value: &f64| bytes.extend(value.to_le_bytes());
    for (window, solutions) in equations.iter().zip(solutions) {
        for l in 0..PATTERNS {
            window.columns.iter().for_each(|column| write(&column[l]));
        }
        for (side, x) in window.sides.iter().zip(solutions) {
            side.y
                .iter()
                .chain(x)
                .chain(&side.truth)
                .for_each(&mut write);
        }
    }
    fs::write(folder.join("problems.f64"), bytes).unwrap();
}

/// Runs the peers on the problems written. Returns seconds, largest ratio of objectives and SNR by name, and the SNR of
/// our solutions.
fn run_peers(folder: &Path, problem: &str) -> Value {
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
    assert!(output.status.success(), "a peer failed");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Sides of the pictures, in camera pixels.
const SIDES: [u32; 3] = [128, 192, 256];

/// Runs jobs on the threads of a pool.
struct PoolExecutor(rayon::ThreadPool);

impl Executor for PoolExecutor {
    fn map<T: Send>(&self, count: usize, job: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        self.0
            .install(|| (0..count).into_par_iter().map(job).collect())
    }
}

fn against_size(figures: &mut Figures) {
    println!("\nNon-negative least squares of a whole picture, L = {PATTERNS}, window {WINDOW}:\n");
    println!(
        "{:>10} {:>8} {:>10} {:>14}",
        "camera", "threads", "seconds", "µs a pixel"
    );
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut per_pixel = BTreeMap::new();
    for side in SIDES {
        let (measurements, _) = photograph(square(side));
        let recovery = prepare(&measurements, Method::Nnls);
        let pixels = measurements.camera.area();
        for threads in [1, 2] {
            if threads > cores {
                continue;
            }
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = PoolExecutor(pool.build().unwrap());
            let geometry = recovery.geometry();
            let seconds = fastest(2, || {
                pool.map(geometry.tile_grid().area(), |i| {
                    drop(tile(&recovery, &measurements, geometry.tile(i)));
                });
            });
            let us = seconds / pixels as f64 * 1e6;
            println!(
                "{:>10} {threads:8} {seconds:10.2} {us:14.1}",
                measurements.camera.to_string()
            );
            figures.insert(format!("nnls_{side}_{threads}_threads_seconds"), seconds);
            figures.insert(format!("nnls_{side}_{threads}_threads_us_a_pixel"), us);
            per_pixel.insert((side, threads), us);
        }
    }
    // 1 if time is linear in the number of pixels; a little more, as windows at the border are smaller.
    let [small, .., large] = SIDES;
    figures.insert(
        "nnls_us_a_pixel_largest_to_smallest".to_owned(),
        per_pixel[&(large, 1)] / per_pixel[&(small, 1)],
    );
    if let Some(two) = per_pixel.get(&(large, 2)) {
        let speedup = per_pixel[&(large, 1)] / two;
        figures.insert("nnls_speedup_on_2_threads".to_owned(), speedup);
    }
}

/// Recovers a capture of the paper's size by the command line's default method, files included.
fn paper_scale(folder: &Path, figures: &mut Figures) {
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
