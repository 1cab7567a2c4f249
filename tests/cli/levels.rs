//! Files of several levels on the command line.

use std::fs;
use std::path::{Path, PathBuf};

use image::RgbImage;
use tempfile::TempDir;

use crate::commands::{error_message, json, run, small_ltm, text};
use crate::enlargement::repeat_capture;

/// A file of three levels in shards of 256 pixels; level 0 has 523 x 41.
fn fixture() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/format/levels.ltm")
}

/// The picture of a file under a torch.
fn relit(file: &Path, folder: &Path, args: &[&str]) -> RgbImage {
    let out = folder.join("relit.png");
    let start = ["relight", text(file), "--light", "torch", "-o", text(&out)];
    let output = run(&[&start, args].concat());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    image::open(out).unwrap().to_rgb8()
}

#[test]
fn a_file_of_one_level_gets_more() {
    let folder = TempDir::new().unwrap();
    let flat = small_ltm(folder.path());
    let message = error_message(&["encode", text(&flat), "-o", "x.ltm"]);
    assert!(
        message.contains("64x64 pixels") && message.contains("--levels"),
        "{message}"
    );
    let file = folder.path().join("levels.ltm");
    let encode = ["encode", text(&flat), "-o", text(&file), "--levels", "2"];
    let report = json(&[&encode[..], &["--json"]].concat());
    let file_bytes = fs::metadata(&file).unwrap().len();
    assert_eq!(report["levels"], 2);
    assert_eq!(report["shards"], 2);
    assert_eq!(report["file_bytes"], file_bytes);
    // No temporary file is left.
    let files = fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(files, 2);

    // Pictures of level 0 are those of the file of one level.
    let before = relit(&flat, folder.path(), &["--at", "0.6,0.4"]);
    assert_eq!(relit(&file, folder.path(), &["--at", "0.6,0.4"]), before);
    // However coarse the root is, whose correspondence places the torch.
    let coarse = folder.path().join("coarse.ltm");
    json(&[
        "encode",
        text(&flat),
        "-o",
        text(&coarse),
        "--levels",
        "8",
        "--json",
    ]);
    assert_eq!(relit(&coarse, folder.path(), &["--at", "0.6,0.4"]), before);
    fs::remove_file(coarse).unwrap();
    let half = relit(&file, folder.path(), &["--level", "1"]);
    assert_eq!(half.dimensions(), (32, 32));
    // Of light; the mean of codes is that of a tone curve.
    let mean = |picture: &RgbImage| {
        let light = |code: &u8| (f64::from(*code) / 255.0).powf(2.2);
        picture.iter().map(light).sum::<f64>() / picture.len() as f64
    };
    let (whole, half) = (mean(&relit(&file, folder.path(), &[])), mean(&half));
    assert!(
        whole > 0.01 && (whole - half).abs() < 0.03 * whole,
        "{whole} {half}"
    );

    let inspected = json(&["inspect", text(&file), "--json"]);
    assert_eq!(
        inspected["levels"][0]["camera"],
        serde_json::json!([64, 64])
    );
    assert_eq!(inspected["levels"][1]["light"], serde_json::json!([16, 16]));
    assert_eq!(inspected["file_bytes"], file_bytes);
    let same = json(&["inspect", text(&flat), "--json"]);
    assert_eq!(inspected["metadata"], same["metadata"]);
    let message = error_message(&[
        "encode",
        text(&file),
        "-o",
        text(&folder.path().join("again.ltm")),
    ]);
    assert!(message.contains("2 levels already"), "{message}");
}

#[test]
fn regions_of_levels_are_cut_out_of_their_pictures() {
    let folder = TempDir::new().unwrap();
    for (level, [width, height]) in [("0", [523, 41]), ("1", [262, 21]), ("2", [131, 11])] {
        let args = ["--level", level, "--exposure", "8", "--at", "0.5,0.5"];
        let whole = relit(&fixture(), folder.path(), &args);
        assert_eq!(whole.dimensions(), (width, height));
        assert!(
            whole.iter().any(|code| *code > 100),
            "level {level} is dark"
        );
        // Across a border of shards on levels 0 and 1.
        let [x, y, w, h] = [width / 2 - 9, 3, 21, height - 5];
        let region = format!("{x},{y},{w},{h}");
        let part = relit(
            &fixture(),
            folder.path(),
            &[&args[..], &["--region", &region]].concat(),
        );
        let expected = image::imageops::crop_imm(&whole, x, y, w, h).to_image();
        assert!(part == expected, "level {level}");
        let args = [&args[..], &["--backend", "reference"]].concat();
        let reference = relit(&fixture(), folder.path(), &args);
        let pairs = whole.iter().zip(reference.iter());
        assert!(
            pairs.map(|(a, b)| a.abs_diff(*b)).max() <= Some(1),
            "level {level}"
        );
    }
    let flat = small_ltm(folder.path());
    let whole = relit(&flat, folder.path(), &[]);
    let part = relit(&flat, folder.path(), &["--region", "10,20,30,40"]);
    assert!(part == image::imageops::crop_imm(&whole, 10, 20, 30, 40).to_image());
}

#[test]
fn wrong_levels_and_regions_are_refused_by_name() {
    let folder = TempDir::new().unwrap();
    let (flat, file) = (small_ltm(folder.path()), fixture());
    let out = folder.path().join("x.png");
    let message = |file: &Path, args: &[&str]| {
        let start = ["relight", text(file), "--light", "flood", "-o", text(&out)];
        error_message(&[&start, args].concat())
    };
    for (file, args, words) in [
        (&file, &["--level", "3"][..], ["levels 0 to 2", "--level 3"]),
        (&flat, &["--level", "1"], ["one level", "--level 1"]),
        (
            &file,
            &["--region", "500,0,24,10"],
            ["523x41", "500,0,24,10"],
        ),
        (
            &file,
            &["--level", "2", "--region", "0,0,1,12"],
            ["131x11", "level 2"],
        ),
        (&flat, &["--region", "0,0,65,1"], ["64x64", "0,0,65,1"]),
        (
            &flat,
            &["--region", "4294967295,0,2,1"],
            ["64x64", "4294967295"],
        ),
    ] {
        let message = message(file, args);
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    }
    for (region, word) in [
        ("1,2,3", "four whole numbers"),
        ("0,0,0,5", "four whole numbers"),
    ] {
        let start = ["relight", text(&file), "--light", "flood", "-o", text(&out)];
        let output = run(&[&start[..], &["--region", region]].concat());
        assert_eq!(output.status.code(), Some(2));
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(message.contains(word), "{message}");
    }
    let first = run(&[
        "relight",
        text(&file),
        "--light",
        "flood",
        "-o",
        text(&out),
        "--first",
        "9K",
    ]);
    assert_eq!(first.status.code(), Some(2));
}

#[test]
fn damaged_shards_are_found_and_named() {
    let folder = TempDir::new().unwrap();
    let report = json(&["verify", text(&fixture()), "--json"]);
    assert_eq!(
        (&report["levels"], &report["shards"]),
        (&3.into(), &6.into())
    );
    let bytes = fs::read(fixture()).unwrap();
    let path = folder.path().join("damaged.ltm");
    let verify = |edit: &dyn Fn(&mut Vec<u8>)| {
        let mut damaged = bytes.clone();
        edit(&mut damaged);
        fs::write(&path, damaged).unwrap();
        error_message(&["verify", text(&path)])
    };
    let message = verify(&|file| *file.last_mut().unwrap() ^= 1);
    assert!(
        message.contains("shard 2, 0 of level 0") && message.contains("checksum"),
        "{message}"
    );
    // Shards after one whose index is damaged are checked too.
    let shard = bytes.windows(4).position(|bytes| bytes == b"SHRD").unwrap();
    let message = verify(&|file| {
        file[shard + 8] ^= 1;
        *file.last_mut().unwrap() ^= 1;
    });
    assert!(
        message.contains("2 of ") && message.contains("of level 1"),
        "{message}"
    );
    let message = verify(&|file| file.truncate(bytes.len() - 1));
    assert!(message.contains("cut short"), "{message}");
    let out = folder.path().join("x.png");
    let relight = ["relight", text(&path), "--light", "flood", "-o", text(&out)];
    let message = error_message(&relight);
    assert!(
        message.starts_with(&format!("error: {}: shard", path.display())),
        "{message}"
    );
    assert!(!out.exists());
    let message = verify(&|file| file.push(0));
    assert!(
        message.contains(&format!("byte {}", bytes.len())),
        "{message}"
    );
    fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
    let inspected = run(&["inspect", text(&path)]);
    let message = String::from_utf8_lossy(&inspected.stderr).into_owned();
    assert!(message.contains("cut short"), "{message}");
    let shown = String::from_utf8(inspected.stdout).unwrap();
    assert!(shown.contains("523x41 in 3 levels"), "{shown}");
}

#[test]
fn pictures_are_recovered_with_levels_and_evaluated() {
    let folder = TempDir::new().unwrap();
    let capture = folder.path().join("capture");
    let size = ["--camera", "24x600", "--light", "12x300"];
    let simulate = ["simulate", "stained-glass", "-o", text(&capture)];
    let output = run(&[&simulate[..], &size, &["--patterns", "30", "--seed", "3"]].concat());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    let recover = |name: &str, args: &[&str]| {
        let file = folder.path().join(name);
        let start = ["recover", text(&capture), "-o", text(&file), "--json"];
        let report = json(&[&start[..], &["--window", "3"], args].concat());
        let bytes = fs::metadata(&file).unwrap().len();
        assert_eq!(report["file_bytes"], bytes);
        (file, report, bytes)
    };
    let (file, report, bytes) = recover("levels.ltm", &["--levels", "2"]);
    assert_eq!(report["levels"], 2);
    let (flat, report, flat_bytes) = recover("flat.ltm", &[]);
    assert_eq!(report["levels"], 1);
    assert!(flat_bytes < bytes);
    // The same file as by `encode`.
    let encoded = folder.path().join("encoded.ltm");
    let encode = ["encode", text(&flat), "-o", text(&encoded), "--levels", "2"];
    assert_eq!(json(&[&encode[..], &["--json"]].concat())["levels"], 2);
    assert!(fs::read(&encoded).unwrap() == fs::read(&file).unwrap());

    let evaluate = |file: &Path| json(&["evaluate", text(file), text(&capture), "--json"]);
    let (found, expected) = (evaluate(&file), evaluate(&flat));
    for field in [
        "snr_db",
        "heldout_snr_db",
        "heldout_fitted_snr_db",
        "flood_snr_db",
    ] {
        let [found, expected] = [&found, &expected].map(|report| report[field].as_f64().unwrap());
        assert!(
            (found - expected).abs() < 1e-3,
            "{field}: {found} {expected}"
        );
    }
    assert_eq!(found["file_bytes"], bytes);
    let output = run(&["evaluate", text(&file), text(&capture), "--first", "10%"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(message.contains("one level"), "{message}");
    let page = folder.path().join("report.html");
    let report = json(&[
        "report",
        text(&file),
        text(&capture),
        "-o",
        text(&page),
        "--json",
    ]);
    let snr = report["held_out"]["snr_db"].as_f64().unwrap();
    assert!((snr - expected["heldout_snr_db"].as_f64().unwrap()).abs() < 1e-3);

    let limit = (3 * bytes / 4).to_string();
    let args = ["--levels", "2", "--max-bytes", &limit];
    let (_, report, small) = recover("small.ltm", &args);
    assert_eq!(report["levels"], 2);
    assert!(
        small <= 3 * bytes / 4 && small > bytes / 2,
        "{small} of {bytes}"
    );
    let start = ["recover", text(&capture), "--window", "3"];
    let out = folder.path().join("tiny.ltm");
    let args = ["-o", text(&out), "--levels", "2", "--max-bytes", "3kB"];
    let message = error_message(&[&start[..], &args].concat());
    assert!(
        message.contains("more than the 3000 asked for"),
        "{message}"
    );
    // Neither temporary files nor checkpoints of finished recoveries.
    let mut files: Vec<String> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    assert_eq!(
        files,
        [
            "capture",
            "encoded.ltm",
            "flat.ltm",
            "levels.ltm",
            "report.html",
            "small.ltm",
            "tiny.ltm.checkpoint"
        ]
    );
}

#[test]
fn pictures_are_wider_than_sixteen_bits_can_count() {
    let folder = TempDir::new().unwrap();
    let (small, wide) = (folder.path().join("small"), folder.path().join("wide"));
    let sides = ["--camera", "256x8", "--light", "128x4", "--patterns", "12"];
    let simulate = ["simulate", "cookies", "-o", text(&small)];
    let output = run(&[&simulate[..], &sides].concat());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    // So wide that the TIFFs of the copy have strips of fewer rows than others.
    let (count, file) = (343, folder.path().join("wide.ltm"));
    repeat_capture(&small, &wide, count);
    let copy = folder.path().join("copy");
    let output = run(&["stage", "ingest", text(&wide), "-o", text(&copy)]);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    let recover = ["recover", text(&copy), "-o", text(&file)];
    let report = json(
        &[
            &recover[..],
            &["--window", "3", "--method", "nnls", "--json"],
        ]
        .concat(),
    );
    let width = 256 * count;
    assert!(width > 87_381);
    assert!(report["levels"].as_u64().unwrap() > 5, "{report}");
    let evaluated = json(&["evaluate", text(&file), text(&wide), "--json"]);
    let snr = evaluated["heldout_snr_db"].as_f64().unwrap();
    assert!(snr > 20.0, "{evaluated}");

    // The picture repeats from end to end, as the photographs do.
    let out = folder.path().join("flood.png");
    let relight = ["relight", text(&file), "--light", "flood", "-o", text(&out)];
    let output = run(&relight);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    let relit = image::open(out).unwrap().to_rgb8();
    assert_eq!(relit.dimensions(), (width, 8));
    let difference = |x: u32, y: u32| {
        let pixels = [2, 255].map(|i| relit.get_pixel(256 * i + x, y).0);
        (0..3).map(move |c| u64::from(pixels[0][c].abs_diff(pixels[1][c])))
    };
    let differences = (0..256).flat_map(|x| (0..8).flat_map(move |y| difference(x, y)));
    let sum: u64 = differences.sum();
    assert!(sum < 3 * 256 * 8 * 4, "{sum}");
}
