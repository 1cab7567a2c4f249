//! `pkg-scripts/bench format`: size of files and speed of decoding, compared with other codecs at equal SNR in the same
//! run.
//!
//! - `*_scale_*`: bytes of a default file, and its loss of SNR against the known transport, relative to a `--lossless`
//!   file of the same recovery. At the paper's scale, and for a scene of a quarter of its width.
//! - `prefix10_min_psnr_db`: minimum PSNR of pictures relit by the first tenth of a file.
//! - `vs_*`: bytes of a peer (`format_peers.py`) over ours. Peers code the recovered band, or its coefficients as
//!   pictures, as coarsely as the SNR of our file allows. `vs_best_band_codec`: the best of f16 + zstd-19, CSR, blosc2
//!   and zfp, where lossless coders get quantised values in their best layout. `vs_best_plain_band_codec`: the best of
//!   zfp at equal SNR, and f16 + zstd-19 without quantisation.
//! - `decode_*`: MB of dequantised coefficients, four bytes each, per second and thread: natively tile by tile; in
//!   WebAssembly with simd128, in Node, in the file's order.

#![allow(clippy::unwrap_used, clippy::expect_used)] // a failed benchmark should panic

mod figures;
mod simulated_capture;

use std::fs;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use npyz::WriterBuilder;
use relightable_photo::format::{
    ChunkId, EncodedFile, EncoderInput, EncodingTarget, FileIndex, HEADER_BYTES, Limits, LtmReader,
    Metadata, decode_basis, decode_tile,
};
use relightable_photo::job_executor::SequentialExecutor;
use relightable_photo::transport::{Basis, CHANNELS, Decibels, FloatTile, SnrAccumulator};
use serde_json::{Value, json};

use figures::Figures;
use simulated_capture::{ltm_export, simulated};

/// Lossless peers that code the band.
const LOSSLESS_PEERS: [&str; 4] = ["band_f16_zstd19", "dense_f16_zstd19", "csr_npz", "blosc2"];
/// Peers that code the coefficients as pictures.
const IMAGE_PEERS: [&str; 2] = ["jpeg_planes", "webp_planes"];

fn main() {
    let folder = figures::folder();
    let mut figures = Figures::new();
    let capture = simulated(&folder, "quarter-scale", "stained-glass", 128);
    let small = loss(&folder, "quarter", &capture, &mut figures);
    prefix(&small, &capture, &mut figures);
    against_peers(&folder, &small, &mut figures);
    rates(&small, &mut figures);
    let capture = simulated(&folder, "paper-scale", "stained-glass", 512);
    let large = loss(&folder, "paper", &capture, &mut figures);
    wasm_rate(&large.file, &mut figures);
    figures::report("format", &figures);
}

/// A default file, and a lossless file of the same recovery.
struct Files {
    file: PathBuf,
    lossless: PathBuf,
}

fn loss(folder: &Path, name: &str, capture: &Path, figures: &mut Figures) -> Files {
    let files = Files {
        file: folder.join(format!("{name}.ltm")),
        lossless: folder.join(format!("{name}-lossless.ltm")),
    };
    let capture = capture.to_str().unwrap();
    let mut snr = [0.0; 2];
    for (i, (path, option)) in [(&files.lossless, "--lossless"), (&files.file, "--json")]
        .into_iter()
        .enumerate()
    {
        let path = path.to_str().unwrap();
        ltm_export(&["recover", capture, "-o", path, "--patterns", "80", option]);
        let evaluated = ltm_export(&["evaluate", path, capture, "--json"]);
        snr[i] = evaluated["snr_db"].as_f64().unwrap();
    }
    let bytes = fs::metadata(&files.file).unwrap().len();
    println!(
        "{name}: {bytes} bytes, SNR {:.2} dB of {:.2} dB",
        snr[1], snr[0]
    );
    figures.insert(format!("{name}_scale_mb"), bytes as f64 / 1e6);
    figures.insert(format!("{name}_scale_snr_loss_db"), snr[0] - snr[1]);
    files
}

fn prefix(files: &Files, capture: &Path, figures: &mut Figures) {
    let (file, capture) = (files.file.to_str().unwrap(), capture.to_str().unwrap());
    let evaluated = ltm_export(&["evaluate", file, capture, "--first", "10%", "--json"]);
    let relit = evaluated["relit"].as_object().unwrap();
    let least = relit.values().map(|psnr| psnr.as_f64().unwrap());
    figures.insert(
        "prefix10_min_psnr_db".to_owned(),
        least.fold(f64::INFINITY, f64::min),
    );
}

/// The index, basis and tiles of a file.
struct Decoded {
    index: FileIndex,
    basis: Basis,
    tiles: Vec<FloatTile>,
}

fn decode(path: &Path) -> Decoded {
    let bytes = fs::read(path).unwrap();
    let mut reader = LtmReader::new(Limits::default());
    reader.feed(0, &bytes[..HEADER_BYTES]).unwrap();
    let index = reader.index_bytes().unwrap() as usize;
    reader.feed(0, &bytes[..index]).unwrap();
    let index = reader.index().unwrap().clone();
    let fetch = |chunk: ChunkId| {
        let range = index.range(chunk);
        Ok::<_, relightable_photo::format::FormatError>(
            bytes[range.start as usize..range.end as usize].to_vec(),
        )
    };
    let basis = decode_basis(&index, fetch).unwrap();
    let tiles = (0..index.tiles()).map(|i| decode_tile(&index, i, fetch).unwrap());
    Decoded {
        tiles: tiles.collect(),
        basis,
        index,
    }
}

fn npy<T: npyz::AutoSerialize + Copy>(path: &Path, shape: &[usize], values: &[T]) {
    let shape: Vec<u64> = shape.iter().map(|&n| n as u64).collect();
    let file = BufWriter::new(fs::File::create(path).unwrap());
    let options = npyz::WriteOptions::new().default_dtype().shape(&shape);
    let mut writer = options.writer(file).begin_nd().unwrap();
    writer.extend(values.iter().copied()).unwrap();
    writer.finish().unwrap();
}

fn against_peers(folder: &Path, files: &Files, figures: &mut Figures) {
    let Ok(python) = std::env::var("BENCH_PYTHON") else {
        println!("no Python for the peers: run pkg-scripts/bench format");
        return;
    };
    let (given, ours) = (decode(&files.lossless), decode(&files.file));
    let geometry = given.index.header.geometry;
    let (camera, area) = (geometry.camera, geometry.window.area());
    let rank = given.basis.rank();
    let mut band = vec![0.0f32; camera.area() * area * CHANNELS];
    let mut planes = vec![0.0f32; rank * CHANNELS * camera.area()];
    let mut origins = vec![0i32; 2 * camera.area()];
    let mut error = SnrAccumulator::default();
    for (tile, coded) in given.tiles.iter().zip(&ours.tiles) {
        let functions = tile.functions(&geometry, Some(&given.basis));
        let coded = coded.functions(&geometry, Some(&ours.basis));
        for (p, pixel) in tile.rect.pixels().enumerate() {
            let n = camera.index(pixel);
            let origin = geometry.window_origin(pixel);
            [origins[2 * n], origins[2 * n + 1]] = [origin.u, origin.v];
            for s in 0..area {
                for c in 0..CHANNELS {
                    let tau = functions.tau[p * area + s][c];
                    band[(n * area + s) * CHANNELS + c] = tau;
                    error.add(f64::from(tau), f64::from(coded.tau[p * area + s][c]));
                }
            }
            for k in 0..rank {
                for c in 0..CHANNELS {
                    planes[(k * CHANNELS + c) * camera.area() + n] =
                        tile.coefficients[p * rank + k][c];
                }
            }
        }
    }
    let bytes = fs::metadata(&files.file).unwrap().len();
    let problem = folder.join("format-problem");
    fs::create_dir_all(&problem).unwrap();
    let (width, height) = (camera.width as usize, camera.height as usize);
    let kernels: Vec<f32> = given.basis.kernels.concat();
    let file = |name: &str| problem.join(name);
    npy(&file("band.npy"), &[camera.area(), area, CHANNELS], &band);
    npy(
        &file("coefficients.npy"),
        &[rank, CHANNELS, height, width],
        &planes,
    );
    npy(&file("basis.npy"), &[rank, area], &kernels);
    npy(&file("origins.npy"), &[camera.area(), 2], &origins);
    let snr = error.snr().unwrap().0;
    let description = json!({
        "camera": [camera.width, camera.height],
        "light": [geometry.light.width, geometry.light.height],
        "window": geometry.window.side(),
        "snr_db": snr,
        "ours_bytes": bytes,
    });
    fs::write(problem.join("problem.json"), description.to_string()).unwrap();
    let output = Command::new(python)
        .arg(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/benches/format_peers.py"
        ))
        .arg(&problem)
        .env("OMP_NUM_THREADS", "1")
        .stderr(Stdio::inherit())
        .output()
        .unwrap();
    assert!(output.status.success());
    let peers: Value = serde_json::from_slice(&output.stdout).unwrap();
    println!("\nPeers at {snr:.2} dB against the recovered band (ours: {bytes} bytes):");
    for (name, peer) in peers.as_object().unwrap() {
        println!("{name:20} {peer}");
    }
    let ratio = |name: &str| peers[name]["bytes"].as_f64().map(|b| b / bytes as f64);
    let least = |names: &[&str]| {
        let ratios = names.iter().filter_map(|name| ratio(name));
        ratios.fold(f64::INFINITY, f64::min)
    };
    for name in LOSSLESS_PEERS.iter().chain(&IMAGE_PEERS).chain(&["zfp"]) {
        if let Some(ratio) = ratio(name) {
            figures.insert(format!("vs_{name}"), ratio);
        }
    }
    let plain = half_floats(&band) as f64 / bytes as f64;
    figures.insert("vs_plain_f16_zstd19".to_owned(), plain);
    let zfp = ratio("zfp").unwrap_or(f64::INFINITY);
    figures.insert("vs_best_plain_band_codec".to_owned(), zfp.min(plain));
    figures.insert(
        "vs_best_band_codec".to_owned(),
        least(&LOSSLESS_PEERS).min(zfp),
    );
    figures.insert("vs_best_image_planes".to_owned(), least(&IMAGE_PEERS));
}

/// Bytes of the band as half floats, split into low and high bytes, by zstd.
fn half_floats(band: &[f32]) -> usize {
    let halves = || {
        band.iter()
            .map(|v| half::f16::from_f32(*v).to_bits().to_le_bytes())
    };
    let planes: Vec<u8> = halves()
        .map(|h| h[0])
        .chain(halves().map(|h| h[1]))
        .collect();
    zstd::bulk::compress(&planes, 19).unwrap().len()
}

/// Native encoding and decoding on one thread.
fn rates(files: &Files, figures: &mut Figures) {
    let given = decode(&files.lossless);
    let megabytes = |decoded: &Decoded| {
        let values: usize = decoded
            .tiles
            .iter()
            .map(|tile| tile.coefficients.len())
            .sum();
        (values * CHANNELS * size_of::<f32>()) as f64 / 1e6
    };
    let source = EncoderInput {
        geometry: given.index.header.geometry.clone(),
        basis: Some(&given.basis),
        tile: &|i| Ok(given.tiles[i].clone()),
        metadata: Metadata::default(),
        extensions: Vec::new(),
    };
    let start = Instant::now();
    EncodedFile::new(
        source,
        EncodingTarget::Snr(Decibels(33.0)),
        &SequentialExecutor,
    )
    .unwrap();
    let encoding = megabytes(&given) / start.elapsed().as_secs_f64();
    figures.insert("encode_native_mb_s".to_owned(), encoding);
    let fastest = (0..5).map(|_| {
        let start = Instant::now();
        let decoded = decode(&files.file);
        megabytes(&decoded) / start.elapsed().as_secs_f64()
    });
    figures.insert("decode_native_mb_s".to_owned(), fastest.fold(0.0, f64::max));
}

/// Decoding in WebAssembly, if `BENCH_NODE` names Node.
fn wasm_rate(file: &Path, figures: &mut Figures) {
    let Ok(node) = std::env::var("BENCH_NODE") else {
        return;
    };
    let inspected = ltm_export(&["inspect", file.to_str().unwrap(), "--json"]);
    let output = Command::new(node)
        .arg(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/benches/format_wasm.js"
        ))
        .arg(file)
        .arg(inspected.to_string())
        .stderr(Stdio::inherit())
        .output()
        .unwrap();
    assert!(output.status.success());
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    figures.insert("decode_mb_s".to_owned(), report["mb_s"].as_f64().unwrap());
}
