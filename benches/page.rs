//! `pkg-scripts/bench page`: the frame times of `<relightable-photo>` in a browser by each backend, and its memory. This
//! program makes the photographs; `page/main.js` runs the browser and describes the measurements.
#![allow(clippy::unwrap_used, clippy::expect_used)] // a failed benchmark stops

mod figures;
mod synthetic_photo;

use std::fs;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::Command;

use relightable_photo::format::{EncodedFile, EncoderInput, EncodingTarget, Metadata};
use serde_json::{Value, json};

use figures::Figures;
use synthetic_photo::{RANKS, RayonExecutor, SIDES};

fn main() {
    let folder = figures::folder().join("page");
    fs::create_dir_all(&folder).unwrap();
    let photos: Vec<Value> = SIDES
        .iter()
        .flat_map(|side| RANKS.map(|rank| write_photograph(&folder, *side, rank)))
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

/// Writes a photograph unless its file is up to date. Returns its name, size and bytes.
fn write_photograph(folder: &Path, side: u32, rank: usize) -> Value {
    let name = format!("{side}-r{rank}.ltm");
    let path = folder.join(&name);
    if !is_up_to_date(&path) {
        // Under another name until it is complete.
        let part = path.with_extension("part");
        write_file(&part, side, rank);
        fs::rename(part, path).unwrap();
    }
    json!({"name": name, "side": side, "rank": rank, "frame_bytes": synthetic_photo::bytes(side, rank)})
}

/// Whether a file exists and is not older than this program.
fn is_up_to_date(path: &Path) -> bool {
    let changed = |path: &Path| fs::metadata(path)?.modified();
    let program = std::env::current_exe().and_then(|program| changed(&program));
    matches!((changed(path), program), (Ok(file), Ok(program)) if file >= program)
}

fn write_file(path: &Path, side: u32, rank: usize) {
    let geometry = synthetic_photo::geometry(side);
    let basis = synthetic_photo::basis(&geometry, rank);
    let source = EncoderInput {
        geometry: geometry.clone(),
        basis: Some(&basis),
        tile: &|i| Ok(synthetic_photo::tile(&geometry, rank, i)),
        metadata: Metadata::default(),
        extensions: Vec::new(),
    };
    // A lower quality might drop components.
    let encoded = EncodedFile::new(source, EncodingTarget::Lossless, &RayonExecutor).unwrap();
    let kept = usize::from(encoded.index().header.rank);
    assert_eq!(kept, rank, "components of the file");
    let mut file = BufWriter::new(fs::File::create(path).unwrap());
    encoded.write(&mut file).unwrap();
    file.flush().unwrap();
}
