//! `ltm-export check`: all that is wrong with a capture folder, at once.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::LazyLock;

use image::{ImageBuffer, Rgb};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::common::copy_folder;
use crate::enlargement::{Enlargement, enlarge_capture};
use crate::session::{run, succeed};

type Photograph = ImageBuffer<Rgb<u16>, Vec<u16>>;

/// Levels of simulated captures.
const BLACK: f64 = 512.0;
const WHITE: f64 = 60_000.0;

fn text(path: &Path) -> String {
    path.to_str().unwrap().to_owned()
}

/// A capture folder.
struct Capture {
    _folder: Option<TempDir>,
    path: PathBuf,
}

/// Captures of both scenes, with known transport.
static SCENES: LazyLock<[Capture; 2]> = LazyLock::new(|| {
    ["stained-glass", "cookies"].map(|scene| {
        let capture = Capture::new();
        let size = ["--camera", "48x48", "--light", "24x24", "--patterns", "60"];
        succeed(&[&["simulate", scene, "-o", &text(&capture.path)], &size[..]].concat());
        capture
    })
});

impl Capture {
    /// A folder that does not exist yet.
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("capture");
        Self {
            _folder: Some(folder),
            path,
        }
    }

    /// Scene number `scene`, photographed again with faults.
    fn with_faults(scene: usize, faults: &[&str], seed: u64) -> Self {
        let capture = Self::new();
        let (from, to, seed) = (
            text(&SCENES[scene].path),
            text(&capture.path),
            seed.to_string(),
        );
        let mut arguments = vec!["photograph", &from, "-o", &to, "--seed", &seed];
        for fault in faults {
            arguments.extend(["--fault", fault]);
        }
        succeed(&arguments);
        capture
    }

    /// A copy of the second scene, which is checked faster.
    fn copy() -> Self {
        let capture = Self::new();
        copy_folder(&SCENES[1].path, &capture.path);
        capture
    }

    fn check(&self, more: &[&str]) -> Output {
        run(&[&["check", &text(&self.path)], more].concat())
    }

    /// The report, and the exit status.
    fn report(&self, more: &[&str]) -> (Value, i32) {
        let output = self.check(&[&["--json"], more].concat());
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(errors, "");
        let report = serde_json::from_slice(&output.stdout).unwrap();
        (report, output.status.code().unwrap())
    }

    fn photo(&self, shot: usize) -> PathBuf {
        self.path.join(format!("photos/{shot:04}.png"))
    }

    /// Replaces the samples of a photograph, as measurements: 0 at black and 1 at white.
    fn change(&self, name: &str, y: impl Fn(f64) -> f64) {
        let path = self.path.join(name);
        let mut photo: Photograph = image::open(&path).unwrap().to_rgb16();
        for sample in photo.iter_mut() {
            let measured = (f64::from(*sample) - BLACK) / (WHITE - BLACK);
            *sample = (BLACK + (WHITE - BLACK) * y(measured))
                .round()
                .clamp(0.0, 65535.0) as u16;
        }
        photo.save(&path).unwrap();
    }

    fn edit_manifest(&self, edit: impl FnOnce(&mut Value)) {
        let path = self.path.join("capture.json");
        let mut manifest: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        edit(&mut manifest);
        fs::write(&path, manifest.to_string()).unwrap();
    }
}

/// The findings with this code.
fn findings<'a>(report: &'a Value, code: &str) -> Vec<&'a Value> {
    let all = report["findings"].as_array().unwrap().iter();
    all.filter(|finding| finding["code"] == code).collect()
}

/// The only finding with this code.
fn finding<'a>(report: &'a Value, code: &str) -> &'a Value {
    match findings(report, code)[..] {
        [finding] => finding,
        _ => panic!("not one {code}: {:#}", report["findings"]),
    }
}

fn message(finding: &Value) -> &str {
    finding["message"].as_str().unwrap()
}

#[test]
fn clean_captures_are_ready() {
    let mut captures: Vec<Capture> = Vec::new();
    for scene in 0..SCENES.len() {
        captures.extend([2, 3, 4].map(|seed| Capture::with_faults(scene, &[], seed)));
    }
    captures.push(Capture {
        _folder: None,
        path: Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/glass-s"),
    });
    for capture in &captures {
        let (report, status) = capture.report(&["--strict"]);
        assert_eq!(report["findings"], json!([]), "{}", report["verdict"]);
        assert_eq!((status, &report["ready"]), (0, &json!(true)));
        let table = report["photograph_table"].as_array().unwrap();
        assert_eq!(table.len(), 60);
        assert!(table.iter().all(|shot| shot["verdict"] == "used"));
        assert!(report["examined"]["expected_snr_db"].as_f64().unwrap() > 13.0);
        let residual = &report["examined"]["gray_code"][0]["residual"];
        assert!(residual.as_f64().unwrap() < 1.0, "{residual}");
    }
    let output = captures[0].check(&[]);
    let lines = String::from_utf8(output.stdout).unwrap();
    assert!(
        lines.starts_with(
            "ready to recover: 60 patterns, 48x48 camera pixels, 24x24 light elements, window 15"
        ),
        "{lines}"
    );
    assert_eq!((output.status.code(), lines.lines().count()), (Some(0), 1));
}

/// A capture with five faults in different shots.
fn spoilt() -> Capture {
    let capture = Capture::with_faults(1, &["pattern"], 1);
    fs::remove_file(capture.photo(3)).unwrap();
    let small = image::open(capture.photo(7))
        .unwrap()
        .crop_imm(0, 0, 32, 48);
    small.to_rgb16().save(capture.photo(7)).unwrap();
    capture.change("photos/0011.png", |y| 6.0 * y);
    fs::copy(capture.photo(14), capture.photo(15)).unwrap();
    capture
}

#[test]
fn all_that_is_wrong_is_told_at_once() {
    let capture = spoilt();
    let (report, status) = capture.report(&[]);
    assert_eq!((status, &report["ready"]), (65, &json!(false)));
    for (code, severity, shots, words) in [
        (
            "file-missing",
            "error",
            json!([3]),
            "add it or correct its name",
        ),
        (
            "file-size",
            "error",
            json!([7]),
            "is 32x48 pixels; capture.json says 48x48",
        ),
        (
            "saturation",
            "warning",
            json!([11]),
            "shots[11] (photos/0011.png)",
        ),
        (
            "photograph-repeated",
            "error",
            json!([14, 15]),
            "one and the same photograph",
        ),
        (
            "photograph-unknown-pattern",
            "warning",
            json!([30]),
            "nor any other pattern",
        ),
    ] {
        let finding = finding(&report, code);
        assert_eq!(finding["severity"], severity, "{finding}");
        assert_eq!(finding["shots"], shots, "{finding}");
        assert!(message(finding).contains(words), "{finding}");
    }
    // One of the two copies shows the pattern of the other.
    assert_eq!(finding(&report, "photograph-pattern")["shots"], json!([15]));
    assert_eq!(
        (&report["errors"], &report["warnings"]),
        (&json!(3), &json!(3))
    );
    assert_eq!(
        report["verdict"],
        "3 errors, 3 warnings: correct the errors before you recover"
    );
    let verdict = |shot: usize| report["photograph_table"][shot]["verdict"].clone();
    assert_eq!((verdict(2), verdict(3)), (json!("used"), Value::Null));
    assert_eq!(verdict(30), "photograph-unknown-pattern");
}

#[test]
fn text_and_json_have_the_same_findings() {
    let capture = spoilt();
    let (report, status) = capture.report(&[]);
    let output = capture.check(&[]);
    assert_eq!(
        (output.status.code(), &output.stderr[..]),
        (Some(status), &b""[..])
    );
    let mut expected: Vec<String> = Vec::new();
    for finding in report["findings"].as_array().unwrap() {
        let part = |key: &str| finding[key].as_str().unwrap();
        expected.push(format!(
            "{} [{}]: {}",
            part("severity"),
            part("code"),
            part("message")
        ));
    }
    expected.push(report["verdict"].as_str().unwrap().to_owned());
    let lines = String::from_utf8(output.stdout).unwrap();
    assert_eq!(lines.lines().collect::<Vec<_>>(), expected);
    // Errors come first.
    let severities = expected.iter().map(|line| line.split(' ').next().unwrap());
    let severities: Vec<&str> = severities.take(expected.len() - 1).collect();
    assert!(severities.is_sorted(), "{severities:?}");
}

#[test]
fn strict_makes_warnings_count() {
    let capture = Capture::with_faults(1, &["8-bit"], 1);
    let (report, status) = capture.report(&[]);
    assert_eq!(finding(&report, "photographs-8-bit")["severity"], "warning");
    assert_eq!((status, &report["ready"]), (0, &json!(true)));
    assert!(
        report["verdict"].as_str().unwrap().ends_with("; 1 warning"),
        "{report:#}"
    );
    let (strict, status) = capture.report(&["--strict"]);
    assert_eq!((status, &strict["ready"]), (65, &json!(false)));
    assert_eq!(
        strict["verdict"],
        "0 errors, 1 warning: not ready, as --strict allows no warning"
    );
}

#[test]
fn a_broken_manifest_is_told_with_all_of_its_fields() {
    let capture = Capture::copy();
    capture.edit_manifest(|manifest| {
        manifest["camera"]["white"] = json!(100);
        manifest["light"]["gamma"] = Value::Null;
        manifest["shots"][5]["exposure"] = json!(-1);
        manifest["titel"] = json!("misspelt");
        manifest["shots"][6]["photo"] = json!("photos/none.png");
        manifest["shots"][8]["pattern"] = json!("patterns/none.png");
    });
    let (report, status) = capture.report(&[]);
    assert_eq!(status, 65);
    let fields = findings(&report, "manifest-field");
    for name in [
        "\"camera.white\"",
        "\"light.gamma\"",
        "\"shots[5].exposure\"",
    ] {
        let named = fields
            .iter()
            .filter(|finding| message(finding).contains(name));
        assert_eq!(named.count(), 1, "{name}: {report:#}");
    }
    assert!(message(finding(&report, "unknown-fields")).contains("titel"));
    let missing = finding(&report, "file-missing");
    assert_eq!(missing["shots"], json!([6, 8]));
    for words in [
        "2 files",
        "photos/none.png (shots[6].photo)",
        "patterns/none.png (shots[8].pattern)",
    ] {
        assert!(message(missing).contains(words), "{missing}");
    }
    assert_eq!(report["examined"], Value::Null);

    fs::write(
        capture.path.join("capture.json"),
        "{\"version\": 1, \"light\": 7}",
    )
    .unwrap();
    let (report, status) = capture.report(&[]);
    assert_eq!((status, &report["errors"]), (65, &json!(1)));
    assert!(message(finding(&report, "manifest-field")).contains("\"light\""));
    fs::write(capture.path.join("capture.json"), "not JSON").unwrap();
    let (report, _) = capture.report(&[]);
    assert!(message(finding(&report, "manifest")).contains("capture.json"));

    // A folder that is none is no finding.
    let nowhere = run(&["check", &text(&capture.path.join("nowhere"))]);
    assert_eq!(nowhere.status.code(), Some(65));
    assert!(String::from_utf8_lossy(&nowhere.stderr).contains("there is no such folder"));
}

#[test]
fn files_that_are_none_are_told_together() {
    let capture = Capture::copy();
    let eight_bits = image::open(capture.photo(1)).unwrap().to_rgb8();
    for shot in [1, 2] {
        eight_bits.save(capture.photo(shot)).unwrap();
    }
    let bytes = fs::read(capture.photo(4)).unwrap();
    fs::write(capture.photo(4), &bytes[..bytes.len() / 2]).unwrap();
    fs::write(capture.path.join("photos/dark.png"), "no picture").unwrap();
    for shot in 20..35 {
        fs::remove_file(capture.photo(shot)).unwrap();
    }
    let (report, status) = capture.report(&[]);
    assert_eq!(status, 65);
    let wrong = finding(&report, "file-type");
    assert_eq!(wrong["shots"], json!([1, 2]));
    assert!(
        message(wrong).contains("2 files") && message(wrong).contains("8-bit RGB"),
        "{wrong}"
    );
    let unreadable = findings(&report, "file-unreadable");
    assert_eq!(unreadable.len(), 2, "{report:#}");
    let missing = finding(&report, "file-missing");
    assert_eq!(missing["shots"].as_array().unwrap().len(), 15);
    assert!(
        message(missing).contains("15 files") && message(missing).contains("and 3 more"),
        "{missing}"
    );
    // The rest is examined.
    assert_eq!(report["examined"]["patterns"], 42);
}

#[test]
fn photographs_with_too_much_light_or_none_are_told() {
    let capture = Capture::copy();
    capture.change("photos/dark.png", |y| y + 0.05);
    capture.change("photos/flood.png", |y| 0.1 * y);
    capture.change("photos/0030.png", |_| 0.0005);
    for shot in (0..60).filter(|shot| *shot != 30) {
        capture.change(&format!("photos/{shot:04}.png"), |y| y + 0.05);
    }
    let (report, _) = capture.report(&[]);
    assert!(message(finding(&report, "dark-frame-bright")).contains("5.0 % of white"));
    assert_eq!(finding(&report, "photograph-dark")["shots"], json!([30]));
    finding(&report, "flood-dark");

    let dim = Capture::copy();
    for shot in 0..60 {
        dim.change(&format!("photos/{shot:04}.png"), |y| 0.1 * y);
    }
    dim.change("photos/flood.png", |y| 0.1 * y);
    dim.edit_manifest(|manifest| {
        manifest.as_object_mut().unwrap().remove("dark");
    });
    let (report, _) = dim.report(&[]);
    assert!(message(finding(&report, "underexposed")).contains("Expose about"));
    assert_eq!(finding(&report, "dark-frame-missing")["severity"], "note");
}

#[test]
fn gray_code_is_checked_whether_it_is_needed_or_not() {
    let capture = Capture::copy();
    // Declared a little off: three light elements.
    capture.edit_manifest(|manifest| {
        let affine = &mut manifest["correspondence"]["affine"][0][2];
        *affine = json!(affine.as_f64().unwrap() + 3.0);
    });
    let (report, _) = capture.report(&[]);
    let residual = finding(&report, "correspondence-residual");
    assert!(
        message(residual).contains("does not agree with the Gray code"),
        "{residual}"
    );

    // Not declared, it is decoded.
    capture.edit_manifest(|manifest| {
        manifest.as_object_mut().unwrap().remove("correspondence");
    });
    let (report, status) = capture.report(&["--strict"]);
    assert_eq!((status, &report["findings"]), (0, &json!([])));

    // All bits that are missing are named.
    capture.edit_manifest(|manifest| {
        let shots = manifest["graycode"].as_array_mut().unwrap();
        shots.retain(|shot| shot["bit"] != 2 || shot["axis"] != "y");
    });
    let (report, status) = capture.report(&[]);
    let incomplete = finding(&report, "gray-code-incomplete");
    assert_eq!((status, &incomplete["severity"]), (65, &json!("error")));
    for words in ["axis y, bit 2, plain", "axis y, bit 2, inverted"] {
        assert!(message(incomplete).contains(words), "{incomplete}");
    }
    capture.edit_manifest(|manifest| {
        manifest.as_object_mut().unwrap().remove("graycode");
    });
    let (report, _) = capture.report(&[]);
    assert!(message(finding(&report, "gray-code-incomplete")).contains("neither"));
}

#[test]
fn faults_of_rigs_are_told_by_the_codes_of_recover() {
    for (fault, code, severity, words) in [
        (
            "slip",
            "capture-fault",
            "error",
            "each photograph shows the pattern of the shot after its own",
        ),
        (
            "mirror",
            "capture-fault",
            "error",
            "the correspondence is mirrored",
        ),
        (
            "srgb",
            "camera-response",
            "warning",
            "\"camera\": {\"response\": \"srgb\"}",
        ),
        (
            "gamma=1.6",
            "display-response",
            "warning",
            "\"light\": {\"gamma\": 2.",
        ),
        (
            "dimming=0.15",
            "display-dims",
            "warning",
            "the display dims bright pictures",
        ),
        (
            "clip=0.3",
            "saturation-undeclared",
            "warning",
            "many samples have one code",
        ),
        (
            "tremble=0.2",
            "camera-trembled",
            "warning",
            "the camera moved between photographs",
        ),
        (
            "flicker=0.02",
            "light-flickers",
            "warning",
            "the exposure of rows varies",
        ),
        (
            "object",
            "photograph-object",
            "warning",
            "shots[30] (photos/0030.png)",
        ),
        (
            "blend=0.5",
            "photograph-blend",
            "warning",
            "was it taken while the screen changed?",
        ),
        (
            "drift=0.05",
            "exposures-differ",
            "note",
            "with a drift of +",
        ),
        (
            "jitter=0.02",
            "exposures-differ",
            "note",
            "exposures differ",
        ),
        ("room=0.02", "stray-light", "note", "is subtracted"),
        (
            "defects=0.002",
            "hot-pixels",
            "note",
            "5 hot pixels are filled",
        ),
    ] {
        // Two faults need grey codes and a scene that is lit everywhere.
        let scene = usize::from(!fault.starts_with("gamma") && !fault.starts_with("flicker"));
        let (report, status) = Capture::with_faults(scene, &[fault], 1).report(&[]);
        let finding = finding(&report, code);
        assert_eq!(finding["severity"], severity, "{fault}: {finding}");
        assert!(message(finding).contains(words), "{fault}: {finding}");
        assert_eq!(status == 65, severity == "error", "{fault}: {report:#}");
        // Where exposures vary, the flood's is not known, which looks as if the display dimmed.
        if severity == "note" && !fault.starts_with("jitter") {
            assert_eq!(report["warnings"], 0, "{fault}: {report:#}");
        }
    }
    let (report, _) = Capture::with_faults(1, &["smooth=0.6"], 1).report(&[]);
    finding(&report, "display-sharpness");
}

/// Time and memory with 80 shots of 24 megapixels, and 30 other photographs. `CHECK_CAPTURE` names a folder that keeps the
/// capture.
#[test]
#[ignore = "takes minutes and 12 GB; run it by: cargo test --release --test cli check:: -- --ignored --nocapture"]
fn photographs_of_24_megapixels_take_a_minute_and_a_gigabyte() {
    let folder = TempDir::new().unwrap();
    let kept = std::env::var_os("CHECK_CAPTURE").map(PathBuf::from);
    let capture = Capture {
        _folder: None,
        path: kept.unwrap_or_else(|| folder.path().join("large")),
    };
    if !capture.path.join("capture.json").exists() {
        write_large_capture(&folder.path().join("small"), &capture);
    }
    let (report, status) = capture.report(&[]);
    println!("{:#}", report["findings"]);
    for key in ["verdict", "seconds", "peak_rss_bytes", "examined"] {
        println!("{key}: {}", report[key]);
    }
    assert_eq!(status, 0);
    assert!(report["seconds"].as_f64().unwrap() < 60.0);
    assert!(report["peak_rss_bytes"].as_f64().unwrap() < 1e9);
}

/// Simulates a small capture, and enlarges it with noise.
fn write_large_capture(small: &Path, large: &Capture) {
    let size = [
        "--camera",
        "300x200",
        "--light",
        "128x86",
        "--electrons",
        "1000000000",
    ];
    succeed(
        &[
            &["simulate", "stained-glass", "-o", &text(small)],
            &size[..],
        ]
        .concat(),
    );
    enlarge_capture(small, &large.path, Enlargement::by(20));
}
