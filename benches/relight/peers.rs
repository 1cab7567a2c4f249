//! Sparse matrix products that yield the same picture.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use rayon::prelude::*;
use relightable_photo::executor::SequentialExecutor;
use relightable_photo::relight::{Light, cpu};
use relightable_photo::transport::{CHANNELS, Transport};
use serde_json::Value;
use sprs::CsMatViewI;

use super::film::{Film, Kind, Time, fastest};
use super::{Figures, key};

/// The paper's size.
pub const SIDE: u32 = 512;
pub const RANK: usize = 16;

/// Times that all take their turn, and runs of a peer in each turn.
const TURNS: usize = 4;
const RUNS: usize = 7;
/// Root mean square that pictures may differ by, relative to the picture's own.
const MOST: f64 = 1e-4;

/// `[N]` pixels of each channel.
type Planes = [Vec<f32>; CHANNELS];

/// The transport as sparse matrices, `N` rows of `M` columns, one for each channel.
struct Band {
    columns: usize,
    /// Where rows begin, and where the last one ends.
    begins: Vec<u32>,
    /// Light elements, of all channels.
    indices: Vec<u32>,
    values: Planes,
}

impl Band {
    fn of(transport: &Transport) -> Self {
        let geometry = &transport.geometry;
        let (camera, light, window) = (geometry.camera, geometry.light, geometry.window);
        let mut lengths = vec![0u32; camera.area()];
        let on_display = |origin| {
            (0..window.area()).filter_map(move |s| {
                let m = window.element(origin, s).index_in(light)?;
                Some((s, m as u32))
            })
        };
        let pixels = || transport.tiles.iter().flat_map(|tile| tile.rect().pixels());
        for pixel in pixels() {
            lengths[camera.index(pixel)] = on_display(geometry.window_origin(pixel)).count() as u32;
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

    fn matrices(&self) -> [CsMatViewI<'_, f32, u32>; CHANNELS] {
        [0, 1, 2].map(|c| {
            let shape = (self.rows(), self.columns);
            CsMatViewI::new(shape, &self.begins, &self.indices, &self.values[c])
        })
    }
}

/// Products of rows, which sprs does four times as fast as those of a whole matrix. Rows are shared out
/// evenly to threads, of which it has none.
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
    relighter.relight(light, &SequentialExecutor);
    planes(relighter.linear().pixels.iter().copied())
}

/// Stops where a picture is not ours in some channel.
fn agree(name: &str, theirs: &Planes, ours: &Planes) {
    let square = |y: f64| y * y;
    for (theirs, ours) in theirs.iter().zip(ours) {
        assert_eq!(theirs.len(), ours.len(), "{name}");
        let both = theirs.iter().zip(ours);
        let off: f64 = both
            .map(|(t, y)| square(f64::from(*t) - f64::from(*y)))
            .sum();
        let whole: f64 = ours.iter().map(|y| square(f64::from(*y))).sum();
        let off = (off / whole).sqrt();
        assert!(
            off < MOST,
            "{name} draws another picture: it is off by {off:.1e}"
        );
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
    let mut keep = |name: &str, ms: f64, picture: &Planes| {
        agree(name, picture, &picture_of_ours);
        let best = theirs.entry(name.to_owned()).or_insert(ms);
        *best = best.min(ms);
    };
    for _ in 0..TURNS {
        let [one, all] = film.fastest(2.0);
        best = [best[0].min(one), best[1].min(all)];
        for (name, threads) in [("sprs_1_thread", 1), ("sprs", cores)] {
            let mut out = [0; CHANNELS].map(|_| vec![0.0; band.rows()]);
            let seconds = fastest(RUNS, || sprs(&matrices, &light, threads, &mut out));
            keep(name, seconds * 1e3, &out);
        }
        for program in [&mut Command::new(&eigen), Command::new(&python).arg(script)] {
            for (name, ms) in run(program, folder) {
                keep(&name, ms, &picture(&folder.join(format!("{name}.f32"))));
            }
        }
    }
    report(best, &theirs, figures);
}

fn report([one, all]: [Time; 2], theirs: &Figures, figures: &mut Figures) {
    println!("\n{SIDE}², rank {RANK}, video, against peers, which draw the same picture:\n");
    println!("{:28} {:>10} {:>8}", "", "ms", "ratio");
    println!("{:28} {:10.2}", "this, all cores", all.whole);
    println!("{:28} {:10.2}", "  without tone mapping", all.linear);
    println!("{:28} {:10.2}", "this, one thread", one.whole);
    println!("{:28} {:10.2}", "  without tone mapping", one.linear);
    for (time, one_thread) in [(all, false), (one, true)] {
        figures.insert(key(SIDE, RANK, "video", one_thread), time.whole);
        figures.insert(key(SIDE, RANK, "video_linear", one_thread), time.linear);
    }
    for (name, ms) in theirs {
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
