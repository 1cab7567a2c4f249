//! `pkg-scripts/bench relight`: how fast a picture is relit on the CPU, and how fast sparse matrix
//! libraries are at the same, in the same run.
//!
//! A frame is what a page asks for: the light is taken, every camera pixel relit, and the picture
//! tone-mapped to 8-bit sRGB. Of its lights, "video" has every element new and coloured in each
//! frame, "torch" moves in each frame, and "static" is the light there already was. Times are those of
//! the fastest frame, on one thread and on all cores turn about: whatever else the machine does only
//! adds to them.
//!
//! How the comparison is made fair. Peers get the same transport, of the sizes of the paper, as the
//! sparse matrix it stands for: the coefficients' codes multiplied out, in single precision, 225
//! elements a camera pixel less those that are off the display. The three channels share one sparsity,
//! held in 32-bit indices, and are three products with the video's first frame. Only the products count,
//! with arrays in memory and in the order they are fastest in; reading, transposing and checking do not,
//! nor does tone mapping, which is counted in our time. Ours takes a new light in every frame. Peers that
//! can use all cores are held against all of ours, and one thread against one. scipy has one only, and
//! is held against both. sprs leaves threads to its caller, which shares the rows out evenly here. All
//! are run by turns, several times over, and the fastest frame of each counts: `native_…_vs_…` is the
//! peer's time divided by ours. Pictures are compared in linear light, and where they do not agree the
//! benchmark fails.
//!
//! With the crate's `gpu` feature, frames on the system's graphics device follow. They are drawn one after
//! the other into its memory, and timed until all are done; a device that is a program is called one.
//!
//! Bytes of a frame are those of the codes, each of which is read once, and of the picture written. They
//! are held against the bytes that copying reads and writes a second, on all cores.
#![allow(clippy::unwrap_used, clippy::expect_used)] // a bench that cannot go on should stop

mod figures;
#[path = "relight/film.rs"]
mod film;
#[cfg(feature = "gpu")]
#[path = "relight/gpu.rs"]
mod gpu;
mod made_up;
#[path = "relight/peers.rs"]
mod peers;

use std::collections::BTreeMap;
use std::fs;

use figures::Figures;
use film::{Film, KINDS, Time};
use made_up::{RANKS, SIDES};
use rayon::prelude::*;

fn main() {
    // `cargo bench` passes flags for a harness this bench does not have.
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

/// Frames of every size, rank and light, all of them twice: a machine is rarely busy that long.
fn sizes(figures: &mut Figures) {
    println!("Window 15, two camera pixels a light element; milliseconds and frames a second:\n");
    println!(
        "{:28} {:>19} {:>19} {:>8}",
        "", "one thread", "all cores", "of tone"
    );
    let mut best = BTreeMap::new();
    for last in [false, true] {
        for side in SIDES {
            for rank in RANKS {
                let mut film = Film::new(side, rank);
                for kind in KINDS {
                    let name = kind.name();
                    film.load(kind);
                    let times = film.fastest(1.5);
                    let best = best.entry((side, rank, name)).or_insert(times);
                    *best = [0, 1].map(|i| best[i].min(times[i]));
                    if last {
                        show(&format!("{side:4}² rank {rank:2} {name}"), *best);
                        figures.insert(key(side, rank, name, true), best[0].whole);
                        figures.insert(key(side, rank, name, false), best[1].whole);
                    }
                }
            }
        }
    }
}

fn show(name: &str, [one, all]: [Time; 2]) {
    println!(
        "{name:28} {:9.2} {:9.1} {:9.2} {:9.1} {:8.2}",
        one.whole,
        1e3 / one.whole,
        all.whole,
        1e3 / all.whole,
        all.whole - all.linear
    );
}

/// What a time in milliseconds is called.
fn key(side: u32, rank: usize, what: &str, one_thread: bool) -> String {
    let threads = if one_thread { "_1_thread" } else { "" };
    format!("native_{side}_r{rank}_{what}{threads}_ms")
}

/// Bytes read and written a second by copying on all cores, from and to memory far beyond any cache.
fn copy_bandwidth() -> f64 {
    const BYTES: usize = 1 << 29;
    let (from, mut to) = (vec![1u8; BYTES], vec![2u8; BYTES]);
    let part = BYTES.div_ceil(rayon::current_num_threads());
    let seconds = film::fastest(7, || {
        let parts = to.par_chunks_mut(part).zip(from.par_chunks(part));
        parts.for_each(|(to, from)| to.copy_from_slice(std::hint::black_box(from)));
    });
    2.0 * BYTES as f64 / seconds
}

fn bandwidth(copied: f64, figures: &mut Figures) {
    let bytes = made_up::bytes(peers::SIDE, peers::RANK) as f64;
    let frame = figures[&key(peers::SIDE, peers::RANK, "video", false)];
    figures.insert("copy_bandwidth_gb_s".to_owned(), copied / 1e9);
    figures.insert("video_frame_mb".to_owned(), bytes / 1e6);
    let fraction = bytes / (frame / 1e3) / copied;
    figures.insert("copy_bandwidth_fraction".to_owned(), fraction);
}
