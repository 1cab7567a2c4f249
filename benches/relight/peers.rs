//! Sparse matrix products that yield the same picture.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use rayon::prelude::*;
use relightable_photo::relight::{Light, cpu};
use relightable_photo::transport::{CHANNELS, Transport};
use relightable_photo::workers::OneThread;
use serde_json::Value;
use sprs::CsMatViewI;

use super::film::{Film, Kind, Time, fastest};
use super::{Figures, key};

/// The paper's size.
pub const SIDE: u32 = 512;
pub const RANK: usize = 16;

/// Times that all take their turn, and runs of a peer in each turn.
const TURNS: usize = 3;
const RUNS: usize = 5;
/// Root mean square that pictures may differ by, relative to the picture's own.
const MOST: f64 = 1e-4;

/// `[N]` pixels of each channel.
type Planes = [Vec<f32>; CHANNELS];

/// The transport as sparse matrices, `N` rows of `M` columns, one for each channel.
struct Band {
    columns: usize,
    /// Where rows begin, and where the last one ends.
    begins: Vec<i32>,
    /// Light elements, of all channels.
    indices: Vec<i32>,
    values: Planes,
}

impl Band {
    fn of(transport: &Transport) -> Self {
        let geometry = &transport.geometry;
        let (camera, light, window) = (geometry.camera, geometry.light, geometry.window);
        let mut lengths = vec![0i32; camera.area()];
        let on_display = |origin| {
            (0..window.area()).filter_map(move |s| {
                let m = window.element(origin, s).index_in(light)?;
                Some((s, m as i32))
            })
        };
        let pixels = || transport.tiles.iter().flat_map(|tile| tile.rect().pixels());
        for pixel in pixels() {
            lengths[camera.index(pixel)] = on_display(geometry.window_origin(pixel)).count() as i32;
        }
        let mut begins = vec![0];
        begins.extend(lengths.iter().scan(0, |end, length| {
            *end += length;
            Some(*end)
        }));
        let elements = begins[camera.area()] as usize;
        let mut indices = vec![0; elements];
        let mut values = [0; CHANNELS].map(|_| vec![0.0; elements]);
        for tile in &transport.tiles {
            let functions = tile.functions(geometry, &transport.basis);
            let taus = functions.tau.chunks_exact(window.area());
            for (pixel, tau) in tile.rect().pixels().zip(taus) {
                let begin = begins[camera.index(pixel)] as usize;
                let seen = on_display(geometry.window_origin(pixel));
                for (at, (s, m)) in (begin..).zip(seen) {
                    indices[at] = m;
                    (0..CHANNELS).for_each(|c| values[c][at] = tau[s][c]);
                }
            }
        }
        Self {
            columns: light.area(),
            begins,
            indices,
            values,
        }
    }

    fn rows(&self) -> usize {
        self.begins.len() - 1
    }

    /// For peers that are other programs: raw, and little-endian as the machine is.
    fn write(&self, folder: &Path, light: &Planes) {
        fn write<T: bytemuck::NoUninit>(path: &Path, values: &[T]) {
            fs::write(path, bytemuck::cast_slice::<T, u8>(values)).unwrap();
        }
        write(&folder.join("begins.i32"), &self.begins);
        write(&folder.join("indices.i32"), &self.indices);
        for c in 0..CHANNELS {
            write(&folder.join(format!("values{c}.f32")), &self.values[c]);
            write(&folder.join(format!("light{c}.f32")), &light[c]);
        }
    }

    fn matrices(&self) -> [CsMatViewI<'_, f32, i32>; CHANNELS] {
        [0, 1, 2].map(|c| {
            let shape = (self.rows(), self.columns);
            CsMatViewI::new(shape, &self.begins, &self.indices, &self.values[c])
        })
    }
}

/// Rows shared out evenly to threads, as sprs has products of one thread only.
fn sprs(matrices: &[CsMatViewI<'_, f32, i32>], light: &Planes, threads: usize, out: &mut Planes) {
    for ((matrix, light), out) in matrices.iter().zip(light).zip(out) {
        let part = matrix.rows().div_ceil(threads);
        let multiply = |(i, out): (usize, &mut [f32])| {
            out.fill(0.0);
            let rows = matrix.slice_outer(i * part..i * part + out.len());
            sprs::prod::mul_acc_mat_vec_csr(rows, &light[..], out);
        };
        match threads {
            1 => multiply((0, out)),
            _ => out.par_chunks_mut(part).enumerate().for_each(multiply),
        }
    }
}

/// A peer that is a program: milliseconds by what it calls them. It leaves its picture in the folder.
fn run(program: &mut Command, folder: &Path) -> Vec<(String, f64)> {
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

fn ours(relighter: &mut cpu::Relighter, light: &Light) -> Planes {
    relighter.relight(light, &OneThread);
    planes(relighter.linear().pixels.iter().copied())
}

/// Stops where a picture is not ours.
fn agree(name: &str, theirs: &Planes, ours: &Planes) {
    let square = |(a, b): (&f32, f32)| (f64::from(*a) - f64::from(b)).powi(2);
    for c in 0..CHANNELS {
        assert_eq!(theirs[c].len(), ours[c].len(), "{name}");
        let off: f64 = ours[c]
            .iter()
            .zip(theirs[c].iter().copied())
            .map(square)
            .sum();
        let whole: f64 = ours[c].iter().map(|y| square((y, 0.0))).sum();
        let off = (off / whole).sqrt();
        println!("{name:28} channel {c}: differs by {off:.1e}");
        assert!(off < MOST, "{name} yields another picture");
    }
}

/// Ours and the peers' by turns.
pub fn compare(folder: &Path, figures: &mut Figures) {
    let variable = |name| std::env::var(name).ok();
    let (Some(python), Some(eigen)) = (variable("BENCH_PYTHON"), variable("BENCH_EIGEN")) else {
        println!("\nno peers: run pkg-scripts/bench relight");
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/relight_peers.py");
    println!("\nAgainst peers: {SIDE}², rank {RANK}, video\n");
    let mut film = Film::new(SIDE, RANK);
    film.load(Kind::Video);
    let first = film.lights[0].clone();
    let light = planes(first.elements().iter().copied());
    let picture_of_ours = ours(&mut film.relighter, &first);
    let band = Band::of(film.relighter.transport());
    band.write(folder, &light);
    let matrices = band.matrices();
    let cores = rayon::current_num_threads();

    let mut best = [Time::NEVER; 2];
    let mut theirs = Figures::new();
    let mut slower = |name: String, ms: f64| {
        let best = theirs.entry(name).or_insert(f64::INFINITY);
        *best = best.min(ms);
    };
    for turn in 0..TURNS {
        let [one, all] = film.fastest(2.0);
        best = [best[0].min(one), best[1].min(all)];
        let mut out = [0; CHANNELS].map(|_| vec![0.0; band.rows()]);
        for (name, threads) in [("sprs_1_thread", 1), ("sprs", cores)] {
            let seconds = fastest(RUNS, || sprs(&matrices, &light, threads, &mut out));
            slower(name.to_owned(), seconds * 1e3);
        }
        for (name, ms) in run(&mut Command::new(&eigen), folder) {
            slower(name, ms);
        }
        for (name, ms) in run(Command::new(&python).arg(script), folder) {
            slower(name, ms);
        }
        if turn == 0 {
            agree("sprs", &out, &picture_of_ours);
            for name in [
                "eigen",
                "eigen_1_thread",
                "scipy_csr",
                "scipy_csr_transposed",
            ] {
                let theirs = picture(&folder.join(format!("{name}.f32")));
                agree(name, &theirs, &picture_of_ours);
            }
        }
    }
    report(best, theirs, figures);
}

fn report([one, all]: [Time; 2], theirs: Figures, figures: &mut Figures) {
    println!("\n{:28} {:>10} {:>8}", "", "ms", "ratio");
    println!("{:28} {:10.2}", "this, all cores", all.whole);
    println!("{:28} {:10.2}", "  without tone mapping", all.linear);
    println!("{:28} {:10.2}", "this, one thread", one.whole);
    println!("{:28} {:10.2}", "  without tone mapping", one.linear);
    for (time, one_thread) in [(all, false), (one, true)] {
        let mut keep = |what, ms| {
            let best = figures
                .entry(key(SIDE, RANK, what, one_thread))
                .or_insert(ms);
            *best = best.min(ms);
        };
        keep("video", time.whole);
        keep("video_linear", time.linear);
    }
    for (name, ms) in &theirs {
        let ours = if name.ends_with("1_thread") { one } else { all };
        println!("{name:28} {ms:10.2} {:8.1}", ms / ours.whole);
        figures.insert(format!("{name}_ms"), *ms);
    }
    let scipy = theirs["scipy_csr"].min(theirs["scipy_csr_transposed"]);
    for (peer, together, alone) in [
        ("scipy_csr", scipy, scipy), // it has one thread only
        ("eigen", theirs["eigen"], theirs["eigen_1_thread"]),
        ("sprs", theirs["sprs"], theirs["sprs_1_thread"]),
    ] {
        figures.insert(format!("native_vs_{peer}"), together / all.whole);
        figures.insert(format!("native_1_thread_vs_{peer}"), alone / one.whole);
    }
}
