//! `pkg-scripts/bench page`: how fast `<relightable-photo>` relights in a browser, by each back end, and
//! how much memory it takes. This program makes the photographs; `page/main.js`, which says how all of it
//! is measured, runs the browser.
#![allow(clippy::unwrap_used, clippy::expect_used)] // a bench that cannot go on should stop

mod figures;
mod made_up;

use std::fs;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::Command;

use relightable_photo::format::{EncodedFile, Metadata, Quality, Source};
use serde_json::{Value, json};

use figures::Figures;
use made_up::{Cores, RANKS, SIDES};

fn main() {
    let folder = figures::folder().join("page");
    fs::create_dir_all(&folder).unwrap();
    let photos: Vec<Value> = SIDES
        .iter()
        .flat_map(|side| RANKS.map(|rank| photograph(&folder, *side, rank)))
        .collect();
    fs::write(folder.join("photos.json"), json!(photos).to_string()).unwrap();
    let Ok(node) = std::env::var("BENCH_NODE") else {
        println!("no browser: run pkg-scripts/bench page");
        return;
    };
    let main = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/page/main.js");
    let status = Command::new(node).arg(main).arg(&folder).status().unwrap();
    assert!(status.success());
    let measured = fs::read(folder.join("figures.json")).unwrap();
    let measured: Figures = serde_json::from_slice(&measured).unwrap();
    figures::report("page", &measured);
}

/// A photograph, written where it is not there as this program writes it, and what is to be known of it.
fn photograph(folder: &Path, side: u32, rank: usize) -> Value {
    let name = format!("{side}-r{rank}.ltm");
    let path = folder.join(&name);
    if !is_of_this_program(&path) {
        // Under another name until it is whole.
        let part = path.with_extension("part");
        write(&part, side, rank);
        fs::rename(part, path).unwrap();
    }
    json!({"name": name, "side": side, "rank": rank, "frame_bytes": made_up::bytes(side, rank)})
}

/// Whether a file is there that is no older than what would write it.
fn is_of_this_program(path: &Path) -> bool {
    let changed = |path: &Path| fs::metadata(path)?.modified();
    let program = std::env::current_exe().and_then(|program| changed(&program));
    matches!((changed(path), program), (Ok(file), Ok(program)) if file >= program)
}

fn write(path: &Path, side: u32, rank: usize) {
    let geometry = made_up::geometry(side);
    let basis = made_up::basis(&geometry, rank);
    let source = Source {
        geometry,
        basis: Some(&basis),
        tile: &|i| Ok(made_up::tile(&geometry, rank, i)),
        metadata: Metadata::default(),
        extensions: Vec::new(),
    };
    // Anything coarser might leave components out.
    let encoded = EncodedFile::new(source, Quality::Lossless, &Cores).unwrap();
    let kept = usize::from(encoded.head().header.rank);
    assert_eq!(kept, rank, "components of the file");
    let mut file = BufWriter::new(fs::File::create(path).unwrap());
    encoded.write(&mut file).unwrap();
    file.flush().unwrap();
}
