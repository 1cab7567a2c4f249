//! The commands of `ltm-export` end to end, on the capture `glass-s`: figures, pictures, and messages for
//! wrong inputs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::LazyLock;

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

use crate::common::copy_folder;

fn fixture() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/glass-s")
}

pub fn run(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ltm-export"));
    command.args(args).output().unwrap()
}

pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

pub fn json(args: &[&str]) -> Value {
    let output = run(args);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{args:?}: {errors}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Runs a command that must fail; returns its message.
pub fn error_message(args: &[&str]) -> String {
    error_message_of(args, &[1, 65])
}

/// The same for one of these exit statuses.
fn error_message_of(args: &[&str], statuses: &[i32]) -> String {
    let output = run(args);
    let status = output.status.code().unwrap();
    assert!(statuses.contains(&status), "{args:?}: {status}");
    assert!(output.stdout.is_empty(), "errors go to standard error");
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(!message.contains("panicked"), "{message}");
    message
}

/// A copy of the fixture changed by `modify`, and a path for the output.
fn modified_capture(modify: impl FnOnce(&Path)) -> (TempDir, PathBuf, PathBuf) {
    let folder = TempDir::new().unwrap();
    let capture = folder.path().join("capture");
    copy_folder(&fixture(), &capture);
    modify(&capture);
    let output = folder.path().join("out/photo.ltm");
    fs::create_dir(output.parent().unwrap()).unwrap();
    (folder, capture, output)
}

/// Asserts that recovery from a capture changed by `modify` fails with a message that contains all of `words`,
/// and leaves no file.
fn assert_refused(modify: impl FnOnce(&Path), words: &[&str]) {
    let (_folder, capture, output) = modified_capture(modify);
    let args = ["recover", text(&capture), "-o", text(&output)];
    let message = error_message_of(&[&args[..], &["--window", "3"]].concat(), &[65]);
    for word in words {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
    let files = fs::read_dir(output.parent().unwrap()).unwrap().count();
    assert_eq!(files, 0, "files left behind");
}

fn edit_manifest(capture: &Path, edit: impl FnOnce(&mut Value)) {
    let path = capture.join("capture.json");
    let mut manifest: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    edit(&mut manifest);
    fs::write(path, manifest.to_string()).unwrap();
}

/// Misspells a field of an object.
fn rename(object: &mut Value, field: &str, misspelt: &str) {
    let fields = object.as_object_mut().unwrap();
    let value = fields.remove(field).unwrap();
    fields.insert(misspelt.to_owned(), value);
}

/// Recovers a small file.
fn recover_small_ltm(folder: &Path) -> PathBuf {
    let file = folder.join("small.ltm");
    let args = ["--patterns", "12", "--window", "3"];
    let fixture = fixture();
    let output = run(&[&["recover", text(&fixture), "-o", text(&file)], &args[..]].concat());
    assert!(output.status.success());
    file
}

/// A small file, the same for all tests.
pub fn small_ltm(folder: &Path) -> PathBuf {
    static BYTES: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let folder = TempDir::new().unwrap();
        fs::read(recover_small_ltm(folder.path())).unwrap()
    });
    let file = folder.join("small.ltm");
    fs::write(&file, &*BYTES).unwrap();
    file
}

#[test]
fn photographs_are_recovered_evaluated_inspected_and_verified() {
    let folder = TempDir::new().unwrap();
    let (fixture, file) = (fixture(), folder.path().join("glass.ltm"));
    let recovered = json(&[
        "recover",
        text(&fixture),
        "-o",
        text(&file),
        "--window",
        "13",
        "--lossless",
        "--json",
    ]);
    assert_eq!(recovered["method"], "learned");
    assert_eq!(recovered["patterns"], 54);
    assert_eq!(recovered["window"], 13);
    assert!(recovered["rank"].as_u64().unwrap() > 0);
    assert!(recovered["seconds"].as_f64().unwrap() > 0.0);
    assert!(recovered["peak_rss_bytes"].as_u64().unwrap() > 1 << 20);
    let bytes = fs::metadata(&file).unwrap().len();
    assert_eq!(recovered["file_bytes"], bytes);

    // A decibel below the SNR of the learned prior on this noisy, strongly scattering capture.
    let evaluated = json(&["evaluate", text(&file), text(&fixture), "--json"]);
    assert!(evaluated["snr_db"].as_f64().unwrap() > 32.4, "{evaluated}");
    assert!(
        evaluated["heldout_snr_db"].as_f64().unwrap() > 37.3,
        "{evaluated}"
    );
    assert_eq!(evaluated["heldout_shots"], 6);
    for light in ["checker", "colour", "fire", "flood", "stripes"] {
        let psnr = evaluated["relit"][light].as_f64().unwrap();
        assert!(psnr > 51.8, "{light}: {psnr} dB");
    }
    assert_eq!(evaluated["file_bytes"], bytes);

    let inspected = json(&["inspect", text(&file), "--json"]);
    assert_eq!(inspected["camera"], serde_json::json!([64, 64]));
    assert_eq!(inspected["window"], 13);
    assert_eq!(inspected["metadata"]["method"], "learned");
    assert_eq!(inspected["factored_tiles"], 1);
    assert_eq!(inspected["rank"], recovered["rank"]);
    assert_eq!(inspected["scans"][0]["coding"], "halves");
    assert_eq!(
        inspected["scans"].as_array().unwrap().last().unwrap()["prefix_bytes"],
        bytes
    );
    assert_eq!(
        inspected["metadata"]["shots_used"]
            .as_array()
            .unwrap()
            .len(),
        54
    );
    let verified = json(&["verify", text(&file), "--json"]);
    assert_eq!(verified["ok"], true);
    assert_eq!(verified["file_bytes"], bytes);

    // The default file is about a tenth as large, and loses little.
    let args = ["--window", "13", "--json"];
    let small = json(&[&["recover", text(&fixture), "-o", text(&file)], &args[..]].concat());
    assert!(small["file_bytes"].as_u64().unwrap() * 6 < bytes, "{small}");
    let expected = small["expected_snr_db"].as_f64().unwrap();
    let lossless = evaluated["snr_db"].as_f64().unwrap();
    assert!(
        (expected - lossless).abs() < 2.0,
        "{expected} dB expected, {lossless} dB reached"
    );
    let evaluated = json(&["evaluate", text(&file), text(&fixture), "--json"]);
    assert!(
        evaluated["snr_db"].as_f64().unwrap() > lossless - 0.3,
        "{evaluated}"
    );
    // The first tenth of it relights as well.
    let args = [
        "evaluate",
        text(&file),
        text(&fixture),
        "--first",
        "10%",
        "--json",
    ];
    for (light, psnr) in json(&args)["relit"].as_object().unwrap() {
        assert!(psnr.as_f64().unwrap() > 24.0, "{light}: {psnr} dB");
    }
}

#[test]
fn quality_and_size_of_the_file_are_as_requested() {
    let folder = TempDir::new().unwrap();
    let (fixture, file) = (fixture(), folder.path().join("glass.ltm"));
    let recover = |args: &[&str]| {
        let start = [
            "recover",
            text(&fixture),
            "-o",
            text(&file),
            "--window",
            "5",
            "--json",
        ];
        json(&[&start, args].concat())
    };
    let good = recover(&["--quality", "30"]);
    assert!(
        (good["file_snr_db"].as_f64().unwrap() - 30.0).abs() < 0.5,
        "{good}"
    );
    let max_bytes = |bytes: &'static str| {
        let start = ["recover", text(&fixture), "-o", text(&file)];
        [&start[..], &["--window", "5", "--max-bytes", bytes]].concat()
    };
    let before = fs::read(&file).unwrap();
    let message = error_message(&max_bytes("600"));
    assert!(
        ["at least", "600", "--resume"].map(|words| message.contains(words)) == [true; 3],
        "{message}"
    );
    assert!(fs::read(&file).unwrap() == before);
    // The checkpoint has all tiles.
    let resumed = run(&[&max_bytes("20kB")[..], &["--resume"]].concat());
    assert!(String::from_utf8_lossy(&resumed.stderr).contains("resuming with 4 of 4 tiles"));
    let bytes = fs::metadata(&file).unwrap().len();
    assert!((18_000..=20_000).contains(&bytes), "{bytes} bytes");
    assert_eq!(run(&max_bytes("99")).status.code(), Some(2));
    let both = ["recover", "x", "-o", "y", "--lossless", "--quality", "30"];
    assert_eq!(run(&both).status.code(), Some(2));
}

#[test]
fn each_method_is_selected_by_name_and_recorded_in_the_file() {
    let folder = TempDir::new().unwrap();
    let (fixture, file) = (fixture(), folder.path().join("glass.ltm"));
    let recover = ["recover", text(&fixture), "-o", text(&file), "--json"];
    let small = ["--patterns", "12", "--window", "3", "--method"];
    for args in [
        &["nnls"][..],
        &["bpdn"],
        &["bpdn", "--basis", "dct"],
        &["bpdn", "--basis", "haar"],
    ] {
        let recovered = json(&[&recover, &small[..], args].concat());
        assert_eq!(recovered["method"], args[0]);
        assert_eq!(recovered["rank"], Value::Null, "{args:?}");
        assert!(recovered["common_mode"].as_f64().unwrap() > 0.0, "{args:?}");
        let inspected = json(&["inspect", text(&file), "--json"]);
        assert_eq!(inspected["metadata"]["method"], args[0]);
        assert_eq!(inspected["rank"], Value::Null, "{args:?}");
        assert_eq!(inspected["factored_tiles"], 0, "{args:?}");
    }
}

#[test]
fn recovery_is_reproducible_bit_for_bit() {
    let folder = TempDir::new().unwrap();
    let first = fs::read(small_ltm(folder.path())).unwrap();
    let second = fs::read(recover_small_ltm(folder.path())).unwrap();
    assert_eq!(first, second);
}

#[test]
fn relit_pictures_agree_with_the_reference_and_follow_the_torch() {
    let folder = TempDir::new().unwrap();
    let file = small_ltm(folder.path());
    let relit = |name: &str, args: &[&str]| {
        let out = folder.path().join(name);
        let args = [&["relight", text(&file), "-o", text(&out)], args].concat();
        let output = run(&args);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        image::open(&out).unwrap().into_rgb8()
    };
    for light in ["flood", "torch", "checkerboard", "stripes", "spectrum"] {
        let fast = relit("a.png", &["--light", light]);
        let exact = relit("b.png", &["--light", light, "--backend", "reference"]);
        assert!(largest_difference(&fast, &exact) <= 1, "{light}");
        assert!(fast.iter().any(|&code| code > 40), "{light} shows nothing");
    }
    let brightness = |picture: &image::RgbImage, left: bool| -> u32 {
        let pixels = picture
            .enumerate_pixels()
            .filter(|(x, _, _)| (*x < 32) == left);
        pixels
            .map(|(_, _, p)| p.0.iter().map(|c| u32::from(*c)).sum::<u32>())
            .sum()
    };
    let left = relit("l.png", &["--light", "torch", "--at", "0.1,0.5"]);
    let right = relit("r.png", &["--light", "torch", "--at", "0.9,0.5"]);
    assert!(brightness(&left, true) > 2 * brightness(&left, false));
    assert!(brightness(&right, false) > 2 * brightness(&right, true));
    // Without --time the fire is that of time 0.
    let fire = relit("f.png", &["--light", "fire"]);
    assert_eq!(fire, relit("f0.png", &["--light", "fire", "--time", "0"]));
    assert_ne!(fire, relit("f2.png", &["--light", "fire", "--time", "2.5"]));
    // An image as the light, larger than the light plane; then half as bright.
    let white = folder.path().join("white.png");
    image::RgbImage::from_pixel(90, 50, image::Rgb([255; 3]))
        .save(&white)
        .unwrap();
    let pictured = relit("w.png", &["--light", text(&white)]);
    assert_eq!(pictured, relit("f.png", &["--light", "flood"]));
    let dim = relit("d.png", &["--light", "flood", "--exposure", "0.5"]);
    assert!(brightness(&dim, true) < brightness(&pictured, true));
    // An image that is a fifth opaque.
    let fifth = folder.path().join("fifth.png");
    image::RgbaImage::from_pixel(90, 50, image::Rgba([255, 255, 255, 51]))
        .save(&fifth)
        .unwrap();
    let transparent = relit("t.png", &["--light", text(&fifth)]);
    let dim = relit("e.png", &["--light", "flood", "--exposure", "0.2"]);
    assert!(largest_difference(&transparent, &dim) <= 1);
}

fn largest_difference(a: &image::RgbImage, b: &image::RgbImage) -> u8 {
    let differences = a.iter().zip(b.iter()).map(|(a, b)| a.abs_diff(*b));
    differences.max().unwrap()
}

#[test]
fn a_missing_photograph_is_named_with_its_field() {
    assert_refused(
        |c| fs::remove_file(c.join("photos/0003.png")).unwrap(),
        &[
            "photos/0003.png",
            "no such file",
            "shots[3].photo",
            "add it",
        ],
    );
    assert_refused(
        |c| fs::remove_file(c.join("patterns/0000.png")).unwrap(),
        &["patterns/0000.png", "shots[0].pattern"],
    );
    assert_refused(
        |c| fs::remove_file(c.join("capture.json")).unwrap(),
        &["is not a capture folder", "capture.json"],
    );
    let out = TempDir::new().unwrap();
    let output = out.path().join("x.ltm");
    let recover = |capture: &Path| error_message(&["recover", text(capture), "-o", text(&output)]);
    assert!(recover(&out.path().join("nowhere")).contains("there is no such folder"));
    assert!(recover(&fixture().join("capture.json")).contains("is a file"));
}

#[test]
fn identical_photographs_are_refused() {
    let folder = TempDir::new().unwrap();
    let capture = folder.path().join("cookies");
    let size = ["--camera", "32x32", "--light", "16x16", "--patterns", "20"];
    let simulated = run(&[&["simulate", "cookies", "-o", text(&capture)], &size[..]].concat());
    assert!(simulated.status.success());
    let photo = |i: usize| capture.join(format!("photos/{i:04}.png"));
    for i in 1..20 {
        fs::copy(photo(0), photo(i)).unwrap();
    }
    let file = folder.path().join("cookies.ltm");
    let message = error_message(&["recover", text(&capture), "-o", text(&file)]);
    assert!(
        message.contains("capture.json: photographs do not differ from pattern to pattern"),
        "{message}"
    );
}

#[test]
fn control_characters_of_a_file_are_escaped() {
    let (folder, capture, _) = modified_capture(|capture| {
        edit_manifest(capture, |m| m["title"] = "a\u{1b}]0;x\u{7}\nb".into());
    });
    let file = folder.path().join("x.ltm");
    let recovered = run(&[
        "recover",
        text(&capture),
        "-o",
        text(&file),
        "--window",
        "3",
    ]);
    assert!(recovered.status.success());
    let shown = run(&["inspect", text(&file)]).stdout;
    let shown = String::from_utf8(shown).unwrap();
    assert!(shown.contains(r"a\u{1b}]0;x\u{7}\nb"), "{shown}");
    assert!(!shown.contains('\u{1b}'));
}

#[test]
fn an_input_given_as_output_is_not_overwritten() {
    let (folder, capture, _) = modified_capture(|_| {});
    let manifest = capture.join("capture.json");
    let before = fs::read(&manifest).unwrap();
    let message = error_message(&["recover", text(&capture), "-o", text(&manifest)]);
    assert!(message.contains("is not an .ltm file"), "{message}");
    assert_eq!(fs::read(&manifest).unwrap(), before);
    let file = small_ltm(folder.path());
    let relight_to = |output: &Path| {
        let start = ["relight", text(&file), "--light", "flood", "-o"];
        error_message(&[&start[..], &[text(output)]].concat())
    };
    let before = fs::read(&file).unwrap();
    let message = relight_to(&file);
    assert!(message.contains("is not a PNG"), "{message}");
    let jpeg = folder.path().join("x.jpg");
    let message = relight_to(&jpeg);
    assert!(
        message.contains("x.jpg: a PNG is written; give a name with its extension"),
        "{message}"
    );
    assert_eq!(fs::read(&file).unwrap(), before);
    // A photograph is a PNG, but not one that the program writes.
    let photo = capture.join("photos/0000.png");
    let before = fs::read(&photo).unwrap();
    let message = relight_to(&photo);
    assert!(message.contains("written by this program"), "{message}");
    assert_eq!(fs::read(&photo).unwrap(), before);
    assert!(error_message(&["verify", text(folder.path())]).contains("is a folder"));
    // A file that the program wrote is replaced.
    assert_eq!(recover_small_ltm(folder.path()), file);
}

#[test]
fn a_picture_of_the_wrong_size_or_depth_is_refused() {
    assert_refused(
        |c| {
            image::RgbImage::new(64, 63)
                .save(c.join("photos/0001.png"))
                .unwrap()
        },
        &["photos/0001.png", "64x63", "64x64"],
    );
    assert_refused(
        |c| {
            image::RgbImage::new(64, 64)
                .save(c.join("photos/0001.png"))
                .unwrap()
        },
        &["photos/0001.png", "8-bit RGB", "16-bit linear RGB"],
    );
    assert_refused(
        |c| fs::write(c.join("photos/0002.png"), b"not a picture").unwrap(),
        &["photos/0002.png", "not a readable PNG"],
    );
    assert_refused(
        |c| {
            let path = c.join("photos/0002.png");
            let photo = fs::read(&path).unwrap();
            fs::write(path, &photo[..photo.len() / 2]).unwrap();
        },
        &["photos/0002.png", "not a readable PNG"],
    );
    assert_refused(
        |c| {
            let picture = image::ImageBuffer::<image::Luma<u16>, _>::new(32, 32);
            picture.save(c.join("patterns/0001.png")).unwrap();
        },
        &["patterns/0001.png", "16-bit grey", "8-bit grey or RGB"],
    );
}

#[test]
fn an_interlaced_photograph_is_refused() {
    let crc32 = |bytes: &[u8]| {
        !bytes.iter().fold(!0u32, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |crc, _| match crc & 1 {
                1 => crc >> 1 ^ 0xEDB8_8320,
                _ => crc >> 1,
            })
        })
    };
    assert_refused(
        |c| {
            let path = c.join("photos/0002.png");
            let mut photo = fs::read(&path).unwrap();
            photo[28] = 1; // the header's last byte
            let crc = crc32(&photo[12..29]);
            photo[29..33].copy_from_slice(&crc.to_be_bytes());
            fs::write(path, photo).unwrap();
        },
        &["photos/0002.png", "is interlaced", "without interlacing"],
    );
}

#[test]
fn jpeg_patterns_and_missing_flood_photographs_are_refused() {
    assert_refused(
        |c| {
            let jpeg = c.join("grey.jpg");
            image::GrayImage::new(32, 32).save(&jpeg).unwrap();
            fs::rename(jpeg, c.join("patterns/0000.png")).unwrap();
        },
        &["patterns/0000.png", "not a readable PNG"],
    );
    assert_refused(
        |c| edit_manifest(c, |m| m["flood"] = "photos/none.png".into()),
        &["photos/none.png", "(flood in capture.json)"],
    );
}

#[test]
fn a_manifest_with_a_byte_order_mark_is_read() {
    let (_folder, capture, output) = modified_capture(|c| {
        let path = c.join("capture.json");
        let json = fs::read_to_string(&path).unwrap();
        fs::write(path, format!("\u{feff}{json}")).unwrap();
    });
    let args = ["--patterns", "8", "--window", "1"];
    let recovered = run(&[&["recover", text(&capture), "-o", text(&output)], &args[..]].concat());
    assert!(recovered.status.success());
}

#[test]
fn a_pixel_saturated_in_every_photograph_is_white_and_reported() {
    let (folder, capture, output) = modified_capture(|c| {
        for i in 0..12 {
            let path = c.join(format!("photos/{i:04}.png"));
            let mut photo = image::open(&path).unwrap().into_rgb16();
            for (x, y) in (20..24).flat_map(|x| (30..33).map(move |y| (x, y))) {
                photo.put_pixel(x, y, image::Rgb([65535; 3]));
            }
            photo.save(path).unwrap();
        }
    });
    let args = ["--patterns", "12", "--window", "5", "--json"];
    let recovered = run(&[&["recover", text(&capture), "-o", text(&output)], &args[..]].concat());
    let report: Value = serde_json::from_slice(&recovered.stdout).unwrap();
    assert_eq!(report["overexposed_pixels"], 12);
    assert_eq!(report["saturated_samples"], 12 * 12 * 3);
    assert!(String::from_utf8_lossy(&recovered.stderr).contains("12 pixels are saturated"));
    let png = folder.path().join("flood.png");
    assert!(
        run(&[
            "relight",
            text(&output),
            "--light",
            "flood",
            "-o",
            text(&png)
        ])
        .status
        .success()
    );
    let flood = image::open(png).unwrap().into_rgb8();
    assert!(flood.get_pixel(21, 31).0.iter().all(|&code| code > 240));
}

#[test]
fn cookies_are_recovered_well() {
    // A decibel below the SNR from 54 photographs of this scene.
    let folder = TempDir::new().unwrap();
    let (capture, file) = (
        folder.path().join("cookies"),
        folder.path().join("cookies.ltm"),
    );
    let size = ["--camera", "64x64", "--light", "32x32", "--patterns", "60"];
    assert!(
        run(&[&["simulate", "cookies", "-o", text(&capture)], &size[..]].concat())
            .status
            .success()
    );
    assert!(
        run(&["recover", text(&capture), "-o", text(&file)])
            .status
            .success()
    );
    let evaluated = json(&["evaluate", text(&file), text(&capture), "--json"]);
    assert!(evaluated["snr_db"].as_f64().unwrap() > 35.3, "{evaluated}");
}

#[test]
fn a_bad_manifest_is_refused_by_field() {
    assert_refused(
        |c| edit_manifest(c, |m| m["version"] = 7.into()),
        &["capture.json", "\"version\" is 7"],
    );
    assert_refused(
        |c| fs::write(c.join("capture.json"), "{ \"version\": 1, ").unwrap(),
        &["capture.json: is not a capture manifest: ", "line 1"],
    );
    assert_refused(
        |c| {
            edit_manifest(c, |m| {
                drop(m["camera"].as_object_mut().unwrap().remove("white"))
            })
        },
        &["capture.json: \"camera.white\" is missing"],
    );
    assert_refused(
        |c| edit_manifest(c, |m| rename(&mut m["camera"], "white", "whtie")),
        &[
            "\"camera.white\" is missing",
            "correct the name of \"camera.whtie\" to \"white\"",
        ],
    );
    assert_refused(
        |c| edit_manifest(c, |m| rename(&mut m["light"], "gamma", "gama")),
        &[
            "\"light.gamma\" is missing, and so is \"light.response\"",
            "correct the name of \"light.gama\" to \"gamma\"",
        ],
    );
    assert_refused(
        |c| edit_manifest(c, |m| m["correspondence"]["affine"][0][2] = 1e6.into()),
        &["correspondence", "no camera pixel"],
    );
    assert_refused(
        |c| edit_manifest(c, |m| m["shots"].as_array_mut().unwrap().truncate(3)),
        &["3 patterns are too few"],
    );
    // Every photograph listed with the pattern before its own.
    assert_refused(
        |c| {
            edit_manifest(c, |m| {
                let shots = m["shots"].as_array_mut().unwrap();
                let photos: Vec<Value> = shots.iter().map(|s| s["photo"].clone()).collect();
                for (i, photo) in photos.into_iter().enumerate() {
                    let next = (i + 1) % shots.len();
                    shots[next]["photo"] = photo;
                }
            })
        },
        &["each photograph shows the pattern of the shot before its own"],
    );
}

#[test]
fn invalid_options_are_refused() {
    let folder = TempDir::new().unwrap();
    let (fixture, out) = (fixture(), folder.path().join("x.ltm"));
    let recover =
        |args: &[&str]| run(&[&["recover", text(&fixture), "-o", text(&out)], args].concat());
    let even = recover(&["--window", "4"]);
    assert_eq!(even.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&even.stderr).contains("odd"));
    let many = recover(&["--patterns", "61"]);
    assert!(String::from_utf8_lossy(&many.stderr).contains("60 shots"));
    assert_eq!(recover(&["--method", "magic"]).status.code(), Some(2));
    assert_eq!(recover(&["--basis", "dct"]).status.code(), Some(2));
    assert_eq!(recover(&["--patterns", "0"]).status.code(), Some(2));
    let relight = ["relight", "x.ltm", "-o", "x.png", "--light"];
    for wrong in [
        &["flood", "--at", "0.5,0.5"][..],
        &["torch", "--at", "here"],
        &["torch", "--time", "2"],
        &["fire", "--time", "now"],
        &["fire", "--time", "inf"],
        &["flood", "--exposure=-1"],
    ] {
        assert_eq!(
            run(&[&relight, wrong].concat()).status.code(),
            Some(2),
            "{wrong:?}"
        );
    }
    assert_eq!(run(&["recover"]).status.code(), Some(2));
    assert_eq!(run(&["frobnicate"]).status.code(), Some(2));
    let nowhere = folder.path().join("no/such/folder/x.ltm");
    let message = error_message(&[
        "recover",
        text(&fixture),
        "-o",
        text(&nowhere),
        "--patterns",
        "8",
        "--window",
        "1",
    ]);
    assert!(message.contains("no/such/folder/x.ltm"), "{message}");
    assert!(message.contains("folder exist"), "{message}");
    assert!(!out.exists());
}

#[test]
fn damaged_files_are_refused_by_every_command() {
    let folder = TempDir::new().unwrap();
    let intact = fs::read(small_ltm(folder.path())).unwrap();
    let file = folder.path().join("damaged.ltm");
    let (fixture, png) = (fixture(), folder.path().join("x.png"));
    type Damage = fn(&mut Vec<u8>);
    let cases: [(Damage, &str); 6] = [
        (|f| f.truncate(f.len() - 1), "cut short"),
        (|f| f.clear(), "cut short"),
        (
            |f| {
                let middle = f.len() / 2;
                f[middle] ^= 4;
            },
            "damaged",
        ),
        (|f| f[12] = 9, "version 9.0"),
        (|f| f[..4].copy_from_slice(b"<!DO"), "not an .ltm file"),
        (|f| f.push(0), "goes on after its end"),
    ];
    for (damage, word) in cases {
        let mut bytes = intact.clone();
        damage(&mut bytes);
        fs::write(&file, bytes).unwrap();
        for args in [
            &["verify", text(&file)][..],
            &["relight", text(&file), "--light", "flood", "-o", text(&png)],
            &["evaluate", text(&file), text(&fixture)],
        ] {
            let message = error_message(args);
            assert!(message.contains(word), "{args:?}: {message}");
            assert!(message.contains("damaged.ltm"), "{args:?}: {message}");
        }
        // `inspect` reads the file index only, and compares the length.
        let inspected = run(&["inspect", text(&file)]);
        let message = String::from_utf8_lossy(&inspected.stderr).into_owned();
        assert!(
            message.contains(word) || word == "damaged" || message.contains("warning"),
            "{message}"
        );
        let verified = run(&["verify", text(&file), "--json"]);
        assert_eq!(verified.status.code(), Some(65));
        let report: Value = serde_json::from_slice(&verified.stdout).unwrap();
        assert_eq!(report["ok"], false);
        assert!(report["error"].as_str().unwrap().contains(word));
    }
    assert!(!png.exists());
    assert!(error_message(&["verify", "nowhere.ltm"]).contains("nowhere.ltm"));
}

#[test]
fn a_file_from_another_capture_is_not_evaluated() {
    let (folder, capture, _) =
        modified_capture(|c| edit_manifest(c, |m| m["light"]["width"] = 33.into()));
    let file = small_ltm(folder.path());
    let message = error_message(&["evaluate", text(&file), text(&capture)]);
    assert!(message.contains("33x32"), "{message}");
}

#[test]
fn without_a_correspondence_the_gray_code_is_decoded() {
    let remove_correspondence = |c: &Path| {
        edit_manifest(c, |m| {
            drop(m.as_object_mut().unwrap().remove("correspondence"))
        })
    };
    let (_folder, capture, output) = modified_capture(remove_correspondence);
    let args = ["--patterns", "20", "--window", "5"];
    let recovered = run(&[&["recover", text(&capture), "-o", text(&output)], &args[..]].concat());
    assert!(
        recovered.status.success(),
        "{}",
        String::from_utf8_lossy(&recovered.stderr)
    );
    let inspected = json(&["inspect", text(&output), "--json"]);
    let truth = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    for (row, truth) in inspected["correspondence"]
        .as_array()
        .unwrap()
        .iter()
        .zip(truth)
    {
        let row: Vec<f64> = row
            .as_array()
            .unwrap()
            .iter()
            .map(|a| a.as_f64().unwrap())
            .collect();
        for (x, y) in [(0.0, 0.0), (64.0, 0.0), (0.0, 64.0), (64.0, 64.0)] {
            let off = (row[0] - truth[0]) * x + (row[1] - truth[1]) * y + row[2] - truth[2];
            assert!(off.abs() < 0.35, "{off} elements off: {row:?}");
        }
    }
    assert_refused(
        |c| {
            remove_correspondence(c);
            edit_manifest(c, |m| {
                m["graycode"]
                    .as_array_mut()
                    .unwrap()
                    .retain(|g| g["axis"] != "y")
            });
        },
        &[
            "capture.json",
            "\"graycode\"",
            "axis y, bit 4, inverted false",
        ],
    );
    assert_refused(
        |c| {
            remove_correspondence(c);
            edit_manifest(c, |m| drop(m["graycode"].as_array_mut().unwrap().remove(3)));
        },
        &[
            "capture.json",
            "\"graycode\"",
            "axis x, bit 3, inverted true",
        ],
    );
}

#[test]
fn exposure_and_saturation_are_accounted_for() {
    // Half the codes above black with half the exposure must give the same result; samples at white must be
    // left out.
    let recover = |capture: &Path, output: &Path| {
        let args = ["--patterns", "30", "--window", "5", "--json"];
        json(&[&["recover", text(capture), "-o", text(output)], &args[..]].concat())
    };
    let snr = |file: &Path| {
        let evaluated = json(&["evaluate", text(file), text(&fixture()), "--json"]);
        evaluated["snr_db"].as_f64().unwrap()
    };
    let (_plain_folder, capture, output) = modified_capture(|_| {});
    let plain = recover(&capture, &output);
    assert_eq!(plain["saturated_samples"], 0);
    let expected = snr(&output);
    let (_folder, capture, output) = modified_capture(|c| {
        let path = c.join("photos/0004.png");
        let mut photo = image::open(&path).unwrap().into_rgb16();
        for code in photo.iter_mut() {
            *code = (512.0 + (f64::from(*code) - 512.0) / 2.0).round() as u16;
        }
        photo.save(path).unwrap();
        let path = c.join("photos/0005.png");
        let mut photo = image::open(&path).unwrap().into_rgb16();
        photo.iter_mut().take(300).for_each(|code| *code = 60000);
        photo.save(path).unwrap();
        edit_manifest(c, |m| m["shots"][4]["exposure"] = 0.5.into());
    });
    let changed = recover(&capture, &output);
    assert_eq!(changed["saturated_samples"], 300);
    assert!((snr(&output) - expected).abs() < 0.2);
}
