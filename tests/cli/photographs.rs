//! Recovery from photographs with faults: what `ltm-export recover` corrects, leaves out and says.

use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::LazyLock;

use assert_cmd::Command;
use image::{ImageBuffer, Rgb};
use serde_json::Value;
use tempfile::TempDir;

use crate::common::copy_folder;
use crate::session::succeed;

type Photograph = ImageBuffer<Rgb<u16>, Vec<u16>>;

/// Black and white levels of the fixture.
const BLACK: f64 = 512.0;
const WHITE: f64 = 60_000.0;

/// A copy of the capture `glass-s`.
struct Capture {
    _folder: TempDir,
    path: PathBuf,
}

impl Capture {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("glass-s");
        let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/glass-s");
        copy_folder(&fixture, &path);
        Self {
            _folder: folder,
            path,
        }
    }

    fn photo(&self, l: usize) -> PathBuf {
        self.path.join(format!("photos/{l:04}.png"))
    }

    fn read(&self, l: usize) -> Photograph {
        image::open(self.photo(l)).unwrap().to_rgb16()
    }

    /// Replaces the samples of a photograph, as measurements: 0 at black and 1 at white.
    fn change(&self, l: usize, y: impl Fn(usize, f64) -> f64) {
        let mut photo = self.read(l);
        for (i, sample) in photo.iter_mut().enumerate() {
            let measured = (f64::from(*sample) - BLACK) / (WHITE - BLACK);
            *sample = (BLACK + (WHITE - BLACK) * y(i, measured)).round() as u16;
        }
        photo.save(self.photo(l)).unwrap();
    }

    fn output(&self) -> PathBuf {
        self.path.join("out.ltm")
    }

    fn recover(&self, more: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ltm-export"));
        command
            .arg("recover")
            .arg(&self.path)
            .arg("-o")
            .arg(self.output());
        command
            .args(["--json"])
            .args(if more.contains(&"--method") {
                &[][..]
            } else {
                &["--method", "nnls"]
            })
            .args(more)
            .output()
            .unwrap()
    }

    /// The message of a recovery that fails.
    fn error(&self) -> String {
        let output = self.recover(&[]);
        assert!(!output.status.success());
        assert!(!self.output().exists());
        String::from_utf8(output.stderr).unwrap()
    }

    fn report(&self) -> (Value, String) {
        let output = self.recover(&[]);
        let errors = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{errors}");
        (serde_json::from_slice(&output.stdout).unwrap(), errors)
    }
}

/// The report of the capture as it is.
static CLEAN: LazyLock<Value> = LazyLock::new(|| {
    let (report, errors) = Capture::new().report();
    assert_eq!(report["warnings"], Value::Array(Vec::new()));
    assert!(!errors.contains("note:"), "{errors}");
    report
});

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn exposures_and_stray_light_are_corrected_and_reported() {
    let table = CLEAN["photograph_table"].as_array().unwrap();
    assert!(
        table
            .iter()
            .all(|photo| photo["gain"] == 1.0 && photo["verdict"] == "used")
    );

    let faulty = Capture::new();
    let gain = |l: usize| 1.0 + 0.03 * (l as f64 * 2.4).sin();
    for l in 0..60 {
        faulty.change(l, |_, y| gain(l) * y + 0.01 * l as f64 / 60.0);
    }
    let (report, errors) = faulty.report();
    for note in ["exposures differ", "2.1 %", "stray light", "is subtracted"] {
        assert!(errors.contains(note), "no {note}: {errors}");
    }
    let table = report["photograph_table"].as_array().unwrap();
    assert_eq!(table.len(), 54);
    let ratios = table.iter().map(|photo| {
        let l = photo["shot"].as_u64().unwrap() as usize;
        let stray = number(&photo["stray_light"]);
        assert!((stray - 0.01 * l as f64 / 60.0).abs() < 1e-3, "{photo}");
        number(&photo["gain"]) / gain(l)
    });
    let ratios: Vec<f64> = ratios.collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    for ratio in &ratios {
        assert!((ratio / mean - 1.0).abs() < 0.006, "{ratio} of {mean}");
    }
    let loss = number(&CLEAN["expected_snr_db"]) - number(&report["expected_snr_db"]);
    assert!(loss.abs() < 1.0, "{loss} dB");
}

#[test]
fn a_photograph_that_does_not_belong_is_left_out_by_name() {
    let capture = Capture::new();
    let other = capture.read(21);
    let samples: Vec<f64> = other
        .iter()
        .map(|y| (f64::from(*y) - BLACK) / (WHITE - BLACK))
        .collect();
    capture.change(20, |i, y| 0.5 * (y + samples[i]));
    let (report, errors) = capture.report();
    for word in [
        "warning: shots[20] (photos/0020.png) is left out",
        "50 % of patterns/0021.png",
    ] {
        assert!(errors.contains(word), "no {word}: {errors}");
    }
    assert_eq!(report["warnings"][0]["code"], "photograph-blend");
    let table = report["photograph_table"].as_array().unwrap();
    let verdict = |shot: u64| {
        let photo = table.iter().find(|photo| photo["shot"] == shot).unwrap();
        photo["verdict"].as_str().unwrap().to_owned()
    };
    assert_eq!(verdict(20), "photograph-blend");
    assert_eq!(verdict(21), "used");

    std::fs::remove_file(capture.output()).unwrap();
    let strict = capture.recover(&["--strict"]);
    assert_eq!(strict.status.code(), Some(65));
    let errors = String::from_utf8(strict.stderr).unwrap();
    assert!(errors.contains("--strict allows no warning"), "{errors}");
    assert!(!capture.output().exists());
}

#[test]
fn swapped_photographs_are_left_out_with_the_patterns_that_they_show() {
    let capture = Capture::new();
    let photos = [3, 5].map(|l| capture.read(l));
    photos[0].save(capture.photo(5)).unwrap();
    photos[1].save(capture.photo(3)).unwrap();
    let (report, errors) = capture.report();
    for (l, other) in [(3, 5), (5, 3)] {
        let warning = format!(
            "shots[{l}] (photos/{l:04}.png) is left out: it shows the pattern patterns/{other:04}.png of \
             shots[{other}]"
        );
        assert!(errors.contains(&warning), "no {warning}: {errors}");
    }
    assert_eq!(report["warnings"].as_array().unwrap().len(), 2);
}

#[test]
fn photographs_after_a_bump_are_left_out() {
    let capture = Capture::new();
    // From the middle of the session on, the picture is half a pixel further to the left.
    for l in 30..60 {
        let photo = capture.read(l);
        let last = photo.width() - 1;
        let moved = Photograph::from_fn(photo.width(), photo.height(), |x, y| {
            let [a, b] = [x, (x + 1).min(last)].map(|x| photo.get_pixel(x, y).0);
            Rgb([0, 1, 2].map(|c| ((u32::from(a[c]) + u32::from(b[c])) / 2) as u16))
        });
        moved.save(capture.photo(l)).unwrap();
    }
    let (report, errors) = capture.report();
    let words = "photographs are left out, as the camera or the object had moved";
    assert!(errors.contains(words), "{errors}");
    let table = report["photograph_table"].as_array().unwrap();
    let is_used = |photo: &Value| photo["verdict"] == "used";
    let is_late = |photo: &Value| photo["shot"].as_u64().unwrap() >= 30;
    for photo in table {
        assert_ne!(is_used(photo), is_late(photo), "{photo}");
    }
    // A half-pixel blur may make one look like something else.
    let moved = table
        .iter()
        .filter(|photo| photo["verdict"] == "photograph-moved");
    assert!(moved.count() >= 24, "{errors}");
}

#[test]
fn photographs_that_follow_from_nothing_are_written_by_force_only() {
    let capture = Capture::new();
    // In every other photograph, the picture is three pixels further up.
    for l in (1..60).step_by(2) {
        let photo = capture.read(l);
        let height = photo.height();
        let moved = Photograph::from_fn(photo.width(), height, |x, y| {
            *photo.get_pixel(x, (y + 3) % height)
        });
        moved.save(capture.photo(l)).unwrap();
    }
    let output = capture.recover(&["--method", "learned"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(65), "{errors}");
    assert!(
        errors.contains("--force writes the file nevertheless"),
        "{errors}"
    );
    assert!(!capture.output().exists(), "{errors}");
    let forced = capture.recover(&["--method", "learned", "--force"]);
    assert!(forced.status.success());
    assert!(capture.output().exists());
}

#[test]
fn a_sequence_that_slipped_is_refused_with_its_place() {
    let capture = Capture::new();
    let photos: Vec<Photograph> = (20..60).map(|l| capture.read(l)).collect();
    for (l, photo) in (20..59).zip(&photos[1..]) {
        photo.save(capture.photo(l)).unwrap();
    }
    let error = capture.error();
    assert!(
        error.contains("from shots[20] (photos/0020.png) on, each photograph shows the pattern of the shot after its own"),
        "{error}"
    );
    assert!(error.contains("--patterns 19"), "{error}");
}

#[test]
fn a_mirrored_correspondence_is_refused_with_the_right_one() {
    let capture = Capture::new();
    let path = capture.path.join("capture.json");
    let mut manifest: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    manifest["correspondence"]["affine"][0] = serde_json::json!([-0.5, 0, 32]);
    std::fs::write(&path, manifest.to_string()).unwrap();
    let error = capture.error();
    assert!(error.contains("the correspondence is mirrored"), "{error}");
    assert!(
        error.contains("\"affine\": [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]]"),
        "{error}"
    );
}

#[test]
fn after_a_move_by_pixels_only_the_photographs_before_are_used() {
    let capture = Capture::new();
    for l in 30..60 {
        let before = capture.read(l);
        let moved = Photograph::from_fn(64, 64, |x, y| {
            *before.get_pixel(x.saturating_sub(3), y.saturating_sub(1))
        });
        moved.save(capture.photo(l)).unwrap();
    }
    let (report, errors) = capture.report();
    let words = "moved before shots[30] (photos/0030.png), by about 3 pixels to the right and 1 pixel down: the 27 photographs \
                 from then on are left out";
    assert!(errors.contains(words), "{errors}");
    assert_eq!(report["warnings"][0]["code"], "photograph-moved");
    assert_eq!(report["photographs"], 27);
    let table = report["photograph_table"].as_array().unwrap();
    assert_eq!(table.len(), 54);
    for photo in table {
        let is_late = photo["shot"].as_u64().unwrap() >= 30;
        assert_eq!(photo["verdict"] == "photograph-moved", is_late, "{photo}");
    }
}

#[test]
fn a_camera_that_trembles_is_followed_and_warned_of() {
    let capture = Capture::new();
    for l in (0..60).step_by(2) {
        let before = capture.read(l);
        // A shift of a quarter of a pixel to the right, by the cubic convolution of Keys (1981). By more than a third,
        // photographs are left out as moved.
        let moved = Photograph::from_fn(64, 64, |x, y| {
            let taps = [(-2, -3.0), (-1, 29.0), (0, 111.0), (1, -9.0)];
            Rgb(std::array::from_fn(|c| {
                let sample = |d: i32| {
                    let x = x.saturating_add_signed(d).min(63);
                    f64::from(before.get_pixel(x, y)[c])
                };
                let sum: f64 = taps.iter().map(|&(d, weight)| weight * sample(d)).sum();
                (sum / 128.0).round() as u16
            }))
        });
        moved.save(capture.photo(l)).unwrap();
    }
    let (report, _) = capture.report();
    let warnings = report["warnings"].as_array().unwrap();
    let codes: Vec<&Value> = warnings.iter().map(|warning| &warning["code"]).collect();
    assert!(
        codes.contains(&&Value::from("camera-trembled")),
        "{codes:?}"
    );
    let table = report["photograph_table"].as_array().unwrap();
    let shifts = |parity: u64| {
        let shots = table
            .iter()
            .filter(move |photo| photo["shot"].as_u64().unwrap() % 2 == parity);
        shots.map(|photo| number(&photo["shift"][0]))
    };
    let still = shifts(1).sum::<f64>() / shifts(1).count() as f64;
    for shift in shifts(0) {
        assert!((shift - still - 0.25).abs() < 0.05, "{shift} {still}");
    }
    assert!(
        !codes.contains(&&Value::from("photograph-moved")),
        "{codes:?}"
    );
    assert!(!codes.contains(&&Value::from("low-snr")), "{codes:?}");

    let output = capture.recover(&["--no-register", "--force"]);
    let unregistered: Value = serde_json::from_slice(&output.stdout).unwrap();
    let table = unregistered["photograph_table"].as_array().unwrap();
    assert!(table.iter().all(|photo| photo["shift"][0] == 0.0));
    let [with, without] = [&report, &unregistered].map(|report| number(&report["expected_snr_db"]));
    assert!(with > without + 1.0, "{with} {without}");
}

/// With 11 light elements and more, windows share covariances.
#[test]
fn the_transport_of_a_trembling_camera_is_recovered_accurately() {
    let (_folder, [capture, file]) = &faulty_capture("cookies", "70", "tremble=0.2");
    let recover = ["recover", capture, "-o", file, "--lossless"];
    succeed(&[&recover[..], &["--window", "11"]].concat());
    let evaluated = succeed(&["evaluate", file, capture, "--json"]).stdout;
    let evaluated: Value = serde_json::from_slice(&evaluated).unwrap();
    // 37.6 dB if the camera does not tremble.
    let snr = number(&evaluated["snr_db"]);
    assert!(snr > 27.0, "{snr}");
}

#[test]
fn hot_and_dead_pixels_are_filled() {
    let capture = Capture::new();
    let hot = [(10, 20), (40, 33), (63, 5)].map(|(x, y)| 64 * y + x);
    let dead = 64 * 30 + 22;
    for l in 0..60 {
        capture.change(l, |i, y| match i / 3 {
            n if hot.contains(&n) => 1.05,
            n if n == dead => 0.0,
            _ => y,
        });
    }
    let (report, errors) = capture.report();
    assert!(errors.contains("3 hot pixels are filled"), "{errors}");
    assert!(errors.contains("1 dead pixel is filled"), "{errors}");
    assert_eq!(
        (&report["hot_pixels"], &report["dead_pixels"]),
        (&Value::from(3), &Value::from(1))
    );
    assert_eq!(report["overexposed_pixels"], 0);
    assert_eq!(CLEAN["hot_pixels"], 0);
    let loss = number(&CLEAN["expected_snr_db"]) - number(&report["expected_snr_db"]);
    assert!(loss.abs() < 0.5, "{loss} dB");
}

#[test]
fn codes_that_are_declared_wrong_are_warned_of() {
    let codes = |capture: &Capture| -> Vec<String> {
        let (report, _) = capture.report();
        let warnings = report["warnings"].as_array().unwrap();
        let code = |warning: &Value| warning["code"].as_str().unwrap().to_owned();
        warnings.iter().map(code).collect()
    };
    let clipped = Capture::new();
    for l in 0..60 {
        clipped.change(l, |_, y| y.min(0.25));
    }
    let (report, errors) = clipped.report();
    assert_eq!(report["warnings"][0]["code"], "saturation-undeclared");
    let field = &report["estimated_fields"][0];
    let code = (BLACK + (WHITE - BLACK) * 0.25).round();
    assert_eq!(field["estimated"], serde_json::json!([code, code, code]));
    assert!(
        report["saturated_samples"].as_u64().unwrap() > 1000,
        "{errors}"
    );
    assert_eq!(field["is_used"], true);
    let coarse = Capture::new();
    for l in 0..60 {
        let mut photo = coarse.read(l);
        photo
            .iter_mut()
            .for_each(|sample| *sample = *sample / 257 * 257);
        photo.save(coarse.photo(l)).unwrap();
    }
    let coarse = codes(&coarse);
    assert!(
        coarse.contains(&"photographs-8-bit".to_owned()),
        "{coarse:?}"
    );
    assert!(
        !coarse.contains(&"saturation-undeclared".to_owned()),
        "{coarse:?}"
    );
}

#[test]
fn a_tone_curve_is_told_and_undone_if_estimates_are_trusted() {
    let capture = Capture::new();
    let curve = |_, y: f64| match y {
        y if y <= 0.003_130_8 => 12.92 * y,
        y => 1.055 * y.powf(1.0 / 2.4) - 0.055,
    };
    for l in 0..60 {
        capture.change(l, curve);
    }
    let output = capture.recover(&["--force"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    let text = r#""camera": {"response": "srgb"}"#;
    assert!(errors.contains(text), "{errors}");
    let trusting = capture.recover(&["--trust", "estimated"]);
    let errors = String::from_utf8(trusting.stderr).unwrap();
    assert!(trusting.status.success(), "{errors}");
    let report: Value = serde_json::from_slice(&trusting.stdout).unwrap();
    let field = &report["estimated_fields"][0];
    assert_eq!(field["field"], "camera.response");
    assert_eq!(field["estimated"], "srgb");
    let loss = number(&CLEAN["expected_snr_db"]) - number(&report["expected_snr_db"]);
    assert!(loss.abs() < 1.0, "{loss} dB");

    // Declared, it is no doubt.
    let path = capture.path.join("capture.json");
    let mut manifest: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    manifest["camera"]["response"] = "srgb".into();
    std::fs::write(&path, manifest.to_string()).unwrap();
    let (declared, _) = capture.report();
    assert_eq!(declared["estimated_fields"], Value::Array(Vec::new()));
    assert_eq!(declared["expected_snr_db"], report["expected_snr_db"]);
}

#[test]
fn a_display_that_dims_bright_pictures_is_told() {
    let capture = Capture::new();
    // Of 15 % when all elements are lit; patterns have half of them lit.
    let path = capture.path.join("photos/flood.png");
    let mut flood = image::open(&path).unwrap().to_rgb16();
    for sample in flood.iter_mut() {
        *sample = (BLACK + 0.85 / 0.925 * (f64::from(*sample) - BLACK)).round() as u16;
    }
    flood.save(&path).unwrap();
    let (report, errors) = capture.report();
    assert_eq!(report["warnings"][0]["code"], "display-dims", "{errors}");
    let dimming = number(&report["estimated_fields"][0]["estimated"]);
    assert!((dimming - 0.15).abs() < 0.02, "{dimming}");
    assert_eq!(report["estimated_fields"][0]["is_used"], false);
    let trusting = capture.recover(&["--trust", "estimated", "--strict"]);
    assert!(trusting.status.success());
    let report: Value = serde_json::from_slice(&trusting.stdout).unwrap();
    assert_eq!(report["estimated_fields"][0]["is_used"], true);

    // Declared, it is not found again.
    let path = capture.path.join("capture.json");
    let mut manifest: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    manifest["light"]["dimming"] = dimming.into();
    std::fs::write(&path, manifest.to_string()).unwrap();
    let (declared, errors) = capture.report();
    assert_eq!(declared["warnings"], Value::Array(Vec::new()), "{errors}");
}

/// Simulates a capture, and photographs it again with a fault: the folder to keep, and the paths of the capture and of a file.
fn faulty_capture(scene: &str, patterns: &str, fault: &str) -> (TempDir, [String; 2]) {
    let folder = TempDir::new().unwrap();
    let [original, faulty, file] = ["original", "faulty", "file.ltm"]
        .map(|name| folder.path().join(name).to_str().unwrap().to_owned());
    let size = ["--camera", "48x48", "--light", "24x24"];
    let simulate = ["simulate", scene, "-o", &original, "--patterns", patterns];
    succeed(&[&simulate[..], &size].concat());
    succeed(&["photograph", &original, "-o", &faulty, "--fault", fault]);
    (folder, [faulty, file])
}

/// Simulates a capture, photographs it again with a fault, and recovers it: the report.
fn report_of_fault(scene: &str, fault: &str, [method, window]: [&str; 2]) -> Value {
    let (_folder, [capture, file]) = &faulty_capture(scene, "50", fault);
    let recover = ["recover", capture, "-o", file, "--json"];
    let report = succeed(&[&recover[..], &["--method", method, "--window", window]].concat());
    serde_json::from_slice(&report.stdout).unwrap()
}

#[test]
fn a_gamma_that_is_declared_wrong_is_told() {
    let field = |report: &Value| report["estimated_fields"][0].clone();
    let report = report_of_fault("stained-glass", "gamma=1.6", ["learned", "9"]);
    let codes: Vec<&Value> = report["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|w| &w["code"])
        .collect();
    assert!(
        codes.contains(&&Value::from("display-response")),
        "{codes:?}"
    );
    assert_eq!(field(&report)["field"], "light.gamma");
    assert_eq!(field(&report)["declared"], 1.6);
    let gamma = number(&field(&report)["estimated"]);
    assert!((gamma - 2.2).abs() < 0.1, "{gamma}");
}

/// Makes grey patterns coloured: the channels of each shot become those of three shots, and so do their photographs.
fn colour_patterns(capture: &Path, shots: usize) {
    let shot_of = |l: usize, c: usize| (l + 7 * c) % shots;
    let names = |kind: &str| -> Vec<PathBuf> {
        let name = |l: usize| capture.join(format!("{kind}/{l:04}.png"));
        (0..shots).map(name).collect()
    };
    let patterns = names("patterns");
    let grey: Vec<_> = patterns
        .iter()
        .map(|path| image::open(path).unwrap().to_luma8())
        .collect();
    for (l, path) in patterns.iter().enumerate() {
        let (width, height) = grey[l].dimensions();
        let code = |x, y| Rgb([0, 1, 2].map(|c| grey[shot_of(l, c)].get_pixel(x, y).0[0]));
        let coloured = image::RgbImage::from_fn(width, height, code);
        coloured.save(path).unwrap();
    }
    let photos = names("photos");
    let taken: Vec<Photograph> = photos
        .iter()
        .map(|path| image::open(path).unwrap().to_rgb16())
        .collect();
    for (l, path) in photos.iter().enumerate() {
        let (width, height) = taken[l].dimensions();
        let sample = |x, y| Rgb([0, 1, 2].map(|c| taken[shot_of(l, c)].get_pixel(x, y).0[c]));
        Photograph::from_fn(width, height, sample)
            .save(path)
            .unwrap();
    }
}

/// Adds a photograph at half the exposure of each shot.
fn add_half_exposures(capture: &Path) {
    let path = capture.join("capture.json");
    let mut manifest: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let mut shots = Vec::new();
    for shot in manifest["shots"].as_array().unwrap() {
        let name = shot["photo"].as_str().unwrap();
        let mut photo = image::open(capture.join(name)).unwrap().to_rgb16();
        for sample in photo.iter_mut() {
            *sample = (BLACK + 0.5 * (f64::from(*sample) - BLACK)).round() as u16;
        }
        let half = name.replace(".png", "-half.png");
        photo.save(capture.join(&half)).unwrap();
        shots.push(shot.clone());
        let pattern = &shot["pattern"];
        shots.push(serde_json::json!({"pattern": pattern, "photo": half, "exposure": 0.5}));
    }
    manifest["shots"] = shots.into();
    std::fs::write(&path, manifest.to_string()).unwrap();
}

#[test]
fn a_wrong_gamma_is_told_with_patterns_in_colour_and_with_several_exposures() {
    let changes: [fn(&Path); 2] = [|capture| colour_patterns(capture, 50), add_half_exposures];
    for (i, change) in changes.into_iter().enumerate() {
        let (_folder, [capture, file]) = faulty_capture("stained-glass", "50", "gamma=1.6");
        change(Path::new(&capture));
        let recover = ["recover", &capture, "-o", &file, "--json", "--window", "9"];
        let report = succeed(&recover).stdout;
        let report: Value = serde_json::from_slice(&report).unwrap();
        let field = &report["estimated_fields"][0];
        assert_eq!(field["field"], "light.gamma", "{i}: {report}");
        let gamma = number(&field["estimated"]);
        assert!((gamma - 2.2).abs() < 0.1, "{i}: {gamma}");
        let trusting = succeed(&[&recover[..], &["--force", "--trust", "estimated"]].concat());
        let trusting: Value = serde_json::from_slice(&trusting.stdout).unwrap();
        let gain = number(&trusting["expected_snr_db"]) - number(&report["expected_snr_db"]);
        assert!(gain > 1.0, "{i}: {gain} dB");
    }
}

/// Of a window, whose patterns light all pixels nearly equally, only the flood photograph tells them apart.
#[test]
fn compressed_highlights_are_told_from_a_display_that_dims() {
    for (scene, window) in [("stained-glass", "15"), ("cookies", "9")] {
        let only = |fault| {
            let report = report_of_fault(scene, fault, ["learned", window]);
            let fields = report["estimated_fields"].as_array().unwrap().clone();
            assert_eq!(fields.len(), 1, "{scene}: {fields:?}");
            fields[0].clone()
        };
        let response = only("compression=1.5");
        assert_eq!(response["field"], "camera.response");
        let slope = number(&response["estimated"]["compression"]);
        assert!((slope - 1.5).abs() < 0.1, "{scene}: {slope}");
        let dimming = only("dimming=0.15");
        assert_eq!(dimming["field"], "light.dimming");
        let share = number(&dimming["estimated"]);
        assert!((share - 0.15).abs() < 0.02, "{scene}: {share}");
    }
}

#[test]
fn patterns_that_are_enlarged_smoothly_are_warned_of() {
    let codes = |report: &Value| report["warnings"].to_string();
    let report = report_of_fault("cookies", "smooth=0.5", ["nnls", "9"]);
    assert!(
        codes(&report).contains("display-sharpness"),
        "{}",
        codes(&report)
    );
    let report = report_of_fault("cookies", "jitter=0.01", ["nnls", "9"]);
    assert!(
        !codes(&report).contains("display-sharpness"),
        "{}",
        codes(&report)
    );
}

#[test]
fn a_light_that_flickers_is_told() {
    let capture = Capture::new();
    for l in 0..60 {
        // Three periods from the top to the bottom, at another time in each photograph.
        let phase = (0.618_034 * l as f64).fract();
        capture.change(l, |i, y| {
            let periods = 3.0 * (i / 192) as f64 / 64.0 + phase;
            y * (1.0 + 0.01 * (std::f64::consts::TAU * periods).sin())
        });
    }
    let (report, errors) = capture.report();
    let warnings = report["warnings"].as_array().unwrap();
    assert!(
        warnings
            .iter()
            .any(|warning| warning["code"] == "light-flickers"),
        "{errors}"
    );
    assert!(
        errors.contains("the exposure of rows varies by about 1.0 %"),
        "{errors}"
    );
}

#[test]
fn a_known_transport_is_photographed_again_with_faults() {
    let folder = TempDir::new().unwrap();
    let [original, faulty] = ["original", "faulty"].map(|name| folder.path().join(name));
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ltm-export"));
        command.args(arguments).output().unwrap()
    };
    let [from, to] = [&original, &faulty].map(|path| path.to_str().unwrap());
    let simulated = run(&[
        "simulate",
        "cookies",
        "-o",
        from,
        "--camera",
        "32x32",
        "--light",
        "16x16",
        "--patterns",
        "40",
    ]);
    assert!(simulated.status.success());
    let photographed = run(&[
        "photograph",
        from,
        "-o",
        to,
        "--fault",
        "jitter=0.1",
        "--fault",
        "swap",
    ]);
    assert!(
        photographed.status.success(),
        "{}",
        String::from_utf8_lossy(&photographed.stderr)
    );
    let file = folder.path().join("file.ltm");
    let file = file.to_str().unwrap();
    let recovered = run(&["recover", to, "-o", file, "--json"]);
    let report: Value = serde_json::from_slice(&recovered.stdout).unwrap();
    let table = report["photograph_table"].as_array().unwrap();
    let left_out = table
        .iter()
        .filter(|photo| photo["verdict"] == "photograph-pattern");
    let left_out: Vec<u64> = left_out
        .map(|photo| photo["shot"].as_u64().unwrap())
        .collect();
    assert_eq!(left_out, [20, 21]);
    let gains = table.iter().map(|photo| number(&photo["gain"]));
    let deviation = gains.map(|gain| (gain - 1.0).powi(2)).sum::<f64>() / table.len() as f64;
    assert!(
        (0.06..0.14).contains(&deviation.sqrt()),
        "{}",
        deviation.sqrt()
    );
    let evaluated = run(&["evaluate", file, to, "--json"]);
    let evaluated: Value = serde_json::from_slice(&evaluated.stdout).unwrap();
    assert!(
        number(&evaluated["snr_db"]) > 20.0,
        "{}",
        evaluated["snr_db"]
    );
    let unknown = run(&["photograph", from, "-o", "x", "--fault", "jiter"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("jitter=0.02"));
}
