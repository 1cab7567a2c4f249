//! `pkg-scripts/bench relight`: the time to relight a picture on the CPU, by this crate and by sparse matrix libraries in
//! the same run.
//!
//! A frame updates the light, relights every camera pixel and encodes the picture as 8-bit sRGB. Under "video" every
//! element changes in each frame and has its own chroma; under "torch" a spot moves; under "static" nothing changes. The
//! fastest frame counts, on one thread and on all cores in turn: other load on the machine only adds time.
//!
//! The comparison is made fair as follows. Peers get the same transport, of the paper's size, as a sparse matrix: the
//! functions that the coefficients stand for, in single precision, 225 elements a camera pixel less those off the light
//! plane. The three channels share one sparsity pattern with 32-bit indices, and are three products with the video's first
//! frame. Only the products are timed, with arrays in memory and in each peer's fastest layout; our time includes the new
//! light and the encoding. Peers with threads are compared on all cores and on one thread; scipy has one thread only, and
//! is compared with both. sprs leaves threads to the caller, which here divides the rows evenly. All run in turn,
//! several times, and the fastest frame of each counts: `native_…_vs_…` is the peer's time divided by ours. The pictures
//! are compared in linear light; if they differ, the benchmark fails.
//!
//! With the feature `gpu`, frames on the system's graphics device follow: drawn one after the other into its memory, and
//! timed until all are done. Software renderers are labelled as such.
//!
//! The bytes of a frame are the codes, each read once, and the picture, written once. They are compared with the bytes a
//! second that a copy on all cores reads and writes.
#![allow(clippy::unwrap_used, clippy::expect_used)] // a bench that cannot go on should stop

#[path = "relight/animated_photo.rs"]
mod animated_photo;
mod figures;
#[cfg(feature = "gpu")]
#[path = "relight/gpu.rs"]
mod gpu;
#[path = "relight/peers.rs"]
mod peers;
mod synthetic_photo;

use std::collections::BTreeMap;
use std::fs;

use animated_photo::{AnimatedPhoto, FrameTime, LIGHT_SEQUENCES};
use figures::Figures;
use rayon::prelude::*;
use synthetic_photo::{RANKS, SIDES};

fn main() {
    // `cargo bench` passes flags of a harness; they are ignored.
    let problem = figures::folder().join("relight");
    fs::create_dir_all(&problem).unwrap();
    let mut figures = Figures::new();
    let before = copy_bandwidth();
    sizes(&mut figures);
    peers::compare(&problem, &mut figures);
    #[cfg(feature = "gpu")]
    gpu::frames(&mut figures);
    bandwidth(before.max(copy_bandwidth()), &mut figures);
    figures::report("relight", &figures);
}

/// Frames of every size, rank and light sequence, in two rounds: other load rarely lasts for both.
fn sizes(figures: &mut Figures) {
    println!("Window 15, two camera pixels a light element; milliseconds and frames a second:\n");
    println!(
        "{:28} {:>19} {:>19} {:>8}",
        "", "one thread", "all cores", "of tone"
    );
    let mut best = BTreeMap::new();
    for is_last_round in [false, true] {
        for side in SIDES {
            for rank in RANKS {
                let mut photo = AnimatedPhoto::new(side, rank);
                for sequence in LIGHT_SEQUENCES {
                    let name = sequence.name();
                    photo.load(sequence);
                    let times = photo.fastest(1.5);
                    let best = best.entry((side, rank, name)).or_insert(times);
                    *best = [0, 1].map(|i| best[i].min(times[i]));
                    if is_last_round {
                        show(&format!("{side:4}² rank {rank:2} {name}"), *best);
                        figures.insert(key(side, rank, name, true), best[0].total);
                        figures.insert(key(side, rank, name, false), best[1].total);
                    }
                }
            }
        }
    }
}

fn show(name: &str, [one, all]: [FrameTime; 2]) {
    println!(
        "{name:28} {:9.2} {:9.1} {:9.2} {:9.1} {:8.2}",
        one.total,
        1e3 / one.total,
        all.total,
        1e3 / all.total,
        all.total - all.linear
    );
}

/// The name of a figure in milliseconds.
fn key(side: u32, rank: usize, what: &str, one_thread: bool) -> String {
    let threads = if one_thread { "_1_thread" } else { "" };
    format!("native_{side}_r{rank}_{what}{threads}_ms")
}

/// Bytes a second that a copy on all cores reads and writes, in memory far larger than any cache.
fn copy_bandwidth() -> f64 {
    const BYTES: usize = 1 << 29;
    let (from, mut to) = (vec![1u8; BYTES], vec![2u8; BYTES]);
    let part = BYTES.div_ceil(rayon::current_num_threads());
    let seconds = animated_photo::fastest_seconds(7, || {
        let parts = to.par_chunks_mut(part).zip(from.par_chunks(part));
        parts.for_each(|(to, from)| to.copy_from_slice(std::hint::black_box(from)));
    });
    2.0 * BYTES as f64 / seconds
}

fn bandwidth(copied: f64, figures: &mut Figures) {
    let bytes = synthetic_photo::bytes(peers::SIDE, peers::RANK) as f64;
    let frame = figures[&key(peers::SIDE, peers::RANK, "video", false)];
    figures.insert("copy_bandwidth_gb_s".to_owned(), copied / 1e9);
    figures.insert("video_frame_mb".to_owned(), bytes / 1e6);
    let fraction = bytes / (frame / 1e3) / copied;
    figures.insert("copy_bandwidth_fraction".to_owned(), fraction);
}
