//! The same picture by the sparse matrix products of other libraries.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use rayon::prelude::*;
use relightable_photo::job_executor::SequentialExecutor;
use relightable_photo::relight::Light;
use relightable_photo::relight::cpu::LinearRelighter;
use relightable_photo::transport::{CHANNELS, Transport};
use serde_json::Value;
use sprs::CsMatViewI;

use super::animated_photo::{AnimatedPhoto, FrameTime, LightSequence, fastest_seconds};
use super::{Figures, key};

/// The paper's size.
pub const SIDE: u32 = 512;
pub const RANK: usize = 16;

/// Rounds of all peers, and runs of a peer in each round.
const ROUNDS: usize = 4;
const RUNS: usize = 7;
/// RMS difference between pictures, relative to the picture's RMS, at most.
const MAX_RELATIVE_RMS: f64 = 1e-4;

/// `[N]` pixels of each channel.
type Planes = [Vec<f32>; CHANNELS];

/// The transport as sparse matrices in CSR form, `N` rows of `M` columns, one for each channel.
struct SparseTransport {
    columns: usize,
    /// Where rows begin, and the end of the last.
    row_starts: Vec<u32>,
    /// Light elements: the columns, shared by all channels.
    indices: Vec<u32>,
    values: Planes,
}

impl SparseTransport {
    fn of(transport: &Transport) -> Self {
        let geometry = &transport.geometry;
        let (camera, light, window) = (geometry.camera, geometry.light, geometry.window);
        let mut lengths = vec![0u32; camera.area()];
        let lit_slots = |origin| {
            (0..window.area()).filter_map(move |s| {
                let m = window.element(origin, s).index_in(light)?;
                Some((s, m as u32))
            })
        };
        let pixels = || transport.tiles.iter().flat_map(|tile| tile.rect().pixels());
        for pixel in pixels() {
            lengths[camera.index(pixel)] = lit_slots(geometry.window_origin(pixel)).count() as u32;
        }
        let mut row_starts = vec![0];
        row_starts.extend(lengths.iter().scan(0, |end, length| {
            *end += length;
            Some(*end)
        }));
        let elements = row_starts[camera.area()] as usize;
        let mut indices = vec![0; elements];
        let mut values = [0; CHANNELS].map(|_| vec![0.0; elements]);
        for tile in &transport.tiles {
            let functions = tile.functions(geometry, &transport.basis);
            let taus = functions.tau.chunks_exact(window.area());
            for (pixel, tau) in tile.rect().pixels().zip(taus) {
                let begin = row_starts[camera.index(pixel)] as usize;
                let slots = lit_slots(geometry.window_origin(pixel));
                for (at, (s, m)) in (begin..).zip(slots) {
                    indices[at] = m;
                    (0..CHANNELS).for_each(|c| values[c][at] = tau[s][c]);
                }
            }
        }
        Self {
            columns: light.area(),
            row_starts,
            indices,
            values,
        }
    }

    fn rows(&self) -> usize {
        self.row_starts.len() - 1
    }

    /// Writes raw arrays for peers that are programs, in the machine's byte order.
    fn write(&self, folder: &Path, light: &Planes) {
        fn write<T: bytemuck::NoUninit>(path: &Path, values: &[T]) {
            fs::write(path, bytemuck::cast_slice::<T, u8>(values)).unwrap();
        }
        write(&folder.join("begins.i32"), &self.row_starts);
        write(&folder.join("indices.i32"), &self.indices);
        for c in 0..CHANNELS {
            write(&folder.join(format!("values{c}.f32")), &self.values[c]);
            write(&folder.join(format!("light{c}.f32")), &light[c]);
        }
    }

    fn matrices(&self) -> [CsMatViewI<'_, f32, u32>; CHANNELS] {
        [0, 1, 2].map(|c| {
            let shape = (self.rows(), self.columns);
            CsMatViewI::new(shape, &self.row_starts, &self.indices, &self.values[c])
        })
    }
}

/// Row products of sprs, which are four times as fast as its matrix products. It has no threads, so rows are divided
/// evenly among ours.
fn sprs(matrices: &[CsMatViewI<'_, f32, u32>], light: &Planes, threads: usize, out: &mut Planes) {
    for ((matrix, light), out) in matrices.iter().zip(light).zip(out) {
        let part = matrix.rows().div_ceil(threads);
        let multiply = |(i, out): (usize, &mut [f32])| {
            let rows = matrix.slice_outer(i * part..i * part + out.len());
            for (y, row) in out.iter_mut().zip(rows.outer_iterator()) {
                *y = row.dot_dense(&light[..]);
            }
        };
        match threads {
            1 => multiply((0, out)),
            _ => out.par_chunks_mut(part).enumerate().for_each(multiply),
        }
    }
}

/// Runs a peer that is a program. Returns milliseconds by name; its pictures are files in the folder.
fn run_program(program: &mut Command, folder: &Path) -> Vec<(String, f64)> {
    let output = program
        .arg(folder)
        .arg(RUNS.to_string())
        .stderr(Stdio::inherit())
        .output()
        .unwrap();
    assert!(output.status.success(), "{program:?} failed");
    let times: Value = serde_json::from_slice(&output.stdout).unwrap();
    let times = times.as_object().unwrap().iter();
    times
        .map(|(name, ms)| (name.clone(), ms.as_f64().unwrap()))
        .collect()
}

fn picture(path: &Path) -> Planes {
    let bytes = fs::read(path).unwrap();
    let values: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
    let mut planes = values.chunks_exact(values.len() / CHANNELS);
    [0; CHANNELS].map(|_| planes.next().unwrap().to_vec())
}

fn planes(elements: impl Iterator<Item = [f32; 4]> + Clone) -> Planes {
    [0, 1, 2].map(|c| elements.clone().map(|element| element[c]).collect())
}

fn render_planes(relighter: &mut LinearRelighter, light: &Light) -> Planes {
    relighter.relight(light, &SequentialExecutor);
    planes(relighter.linear().pixels.iter().copied())
}

/// Panics if a peer's picture differs from ours.
fn assert_equal_pictures(name: &str, theirs: &Planes, ours: &Planes) {
    let square = |y: f64| y * y;
    for (theirs, ours) in theirs.iter().zip(ours) {
        assert_eq!(theirs.len(), ours.len(), "{name}");
        let both = theirs.iter().zip(ours);
        let difference: f64 = both
            .map(|(t, y)| square(f64::from(*t) - f64::from(*y)))
            .sum();
        let norm: f64 = ours.iter().map(|y| square(f64::from(*y))).sum();
        let error = (difference / norm).sqrt();
        assert!(
            error < MAX_RELATIVE_RMS,
            "{name} draws another picture: the relative RMS difference is {error:.1e}"
        );
    }
}

/// Measures this crate and the peers in turn.
pub fn compare(folder: &Path, figures: &mut Figures) {
    let variable = |name| std::env::var(name).ok();
    let (Some(python), Some(eigen)) = (variable("BENCH_PYTHON"), variable("BENCH_EIGEN")) else {
        println!("\nno peers: run pkg-scripts/bench relight");
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/relight_peers.py");
    let mut photo = AnimatedPhoto::new(SIDE, RANK);
    photo.load(LightSequence::Video);
    let first = photo.lights[0].clone();
    let light = planes(first.elements().iter().copied());
    let our_picture = render_planes(&mut photo.relighter, &first);
    let sparse = SparseTransport::of(photo.relighter.transport());
    sparse.write(folder, &light);
    let matrices = sparse.matrices();
    let cores = rayon::current_num_threads();

    let mut best = [FrameTime::INFINITE; 2];
    let mut theirs = Figures::new();
    let mut record = |name: &str, ms: f64, picture: &Planes| {
        assert_equal_pictures(name, picture, &our_picture);
        let best = theirs.entry(name.to_owned()).or_insert(ms);
        *best = best.min(ms);
    };
    for _ in 0..ROUNDS {
        let [one, all] = photo.fastest(2.0);
        best = [best[0].min(one), best[1].min(all)];
        for (name, threads) in [("sprs_1_thread", 1), ("sprs", cores)] {
            let mut out = [0; CHANNELS].map(|_| vec![0.0; sparse.rows()]);
            let seconds = fastest_seconds(RUNS, || sprs(&matrices, &light, threads, &mut out));
            record(name, seconds * 1e3, &out);
        }
        for program in [&mut Command::new(&eigen), Command::new(&python).arg(script)] {
            for (name, ms) in run_program(program, folder) {
                record(&name, ms, &picture(&folder.join(format!("{name}.f32"))));
            }
        }
    }
    report(best, &theirs, figures);
}

fn report([one, all]: [FrameTime; 2], theirs: &Figures, figures: &mut Figures) {
    println!("\n{SIDE}², rank {RANK}, video, against peers, which draw the same picture:\n");
    println!("{:28} {:>10} {:>8}", "", "ms", "ratio");
    println!("{:28} {:10.2}", "this, all cores", all.total);
    println!("{:28} {:10.2}", "  without tone mapping", all.linear);
    println!("{:28} {:10.2}", "this, one thread", one.total);
    println!("{:28} {:10.2}", "  without tone mapping", one.linear);
    for (time, one_thread) in [(all, false), (one, true)] {
        figures.insert(key(SIDE, RANK, "video", one_thread), time.total);
        figures.insert(key(SIDE, RANK, "video_linear", one_thread), time.linear);
    }
    for (name, ms) in theirs {
        let ours = if name.ends_with("1_thread") { one } else { all };
        println!("{name:28} {ms:10.2} {:8.1}", ms / ours.total);
        figures.insert(format!("{name}_ms"), *ms);
    }
    let scipy = theirs["scipy_csr"].min(theirs["scipy_csr_transposed"]);
    for (peer, together, alone) in [
        ("scipy_csr", scipy, scipy), // it has one thread only
        ("eigen", theirs["eigen"], theirs["eigen_1_thread"]),
        ("sprs", theirs["sprs"], theirs["sprs_1_thread"]),
    ] {
        figures.insert(format!("native_vs_{peer}"), together / all.total);
        figures.insert(format!("native_1_thread_vs_{peer}"), alone / one.total);
    }
}
