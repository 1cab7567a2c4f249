//! Sessions of other programs, and correspondences that bend: `ltm-export import`, `calibrate` and `recover`.

use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::Value;
use tempfile::TempDir;

use crate::session::{Session, run, stderr_text, succeed};

fn fail(arguments: &[&str]) -> String {
    let output = run(arguments);
    assert!(!output.status.success(), "{arguments:?} succeeds");
    stderr_text(&output)
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

fn manifest(folder: &str) -> Value {
    let path = Path::new(folder).join("capture.json");
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// Removes a field of a capture's manifest.
fn remove_field(folder: &str, field: &str) {
    let mut changed = manifest(folder);
    changed.as_object_mut().unwrap().remove(field).unwrap();
    fs::write(Path::new(folder).join("capture.json"), changed.to_string()).unwrap();
}

/// SNR of a file's light transport against the truth of a capture.
fn snr(file: &str, capture: &str) -> f64 {
    let report = json(&succeed(&["evaluate", file, capture, "--json"]));
    report["snr_db"].as_f64().unwrap()
}

/// A session of a display of 128 × 128 pixels: its pictures and its photographs.
fn session() -> Session {
    Session::of("32x32", "128x128", "40")
}

#[test]
fn a_session_of_another_program_is_imported_calibrated_and_recovered() {
    let session = session();
    let [pictures, photos] = ["sequence/display", "photos"].map(|name| session.text(name));
    let [capture, file] = ["capture", "file.ltm"].map(|name| session.text(name));
    let from = ["--patterns", &pictures, "--photos", &photos];
    let imported = succeed(&[&["import", "-o", &capture][..], &from].concat());
    // Eight grey levels, 40 patterns, 20 bits, lines along two axes and three colours are shots; floods that are repeated are not.
    let summary = stderr_text(&imported);
    assert!(
        summary.contains("73 shots of 32x32 light elements of 4x4 display pixels"),
        "{summary}"
    );
    assert!(summary.contains("20 photographs of Gray code, a dark frame, a flood photograph"));
    let report = json(&succeed(&["calibrate", &capture, "--json"]));
    assert!(report["decoded"].as_f64().unwrap() > 0.6, "{report}");
    assert_eq!(report["largest_displacement"], 0.0);
    let noise = report["noise"]["floor"][0].as_f64().unwrap();
    assert!(noise > 0.0 && noise < 1e-4, "{report}");
    let [drift, jitter] =
        ["drift", "jitter"].map(|name| report["exposure"][name].as_f64().unwrap());
    assert!(drift.abs() < 0.01 && jitter < 0.01, "{report}");
    let affine = &manifest(&capture)["correspondence"]["affine"];
    assert!(
        (affine[0][0].as_f64().unwrap() - 32.0 / 48.0).abs() < 0.01,
        "{affine}"
    );
    succeed(&[
        "recover",
        &capture,
        "-o",
        &file,
        "--patterns",
        "60",
        "--window",
        "9",
    ]);
    let report = json(&succeed(&["evaluate", &file, &capture, "--json"]));
    let held_out = report["heldout_fitted_snr_db"].as_f64().unwrap();
    assert!(held_out > 24.0, "{report}");
}

#[test]
fn imports_that_cannot_be_right_are_refused() {
    let session = session();
    let [pictures, photos] = ["sequence/display", "photos"].map(|name| session.text(name));
    let capture = session.text("capture");
    let import = |options: &[&str]| {
        let from = ["--patterns", &pictures, "--photos", &photos];
        [&["import", "-o", &capture][..], &from, options]
            .concat()
            .join("\n")
    };
    let refused = |options: &[&str]| {
        let arguments = import(options);
        fail(&arguments.split('\n').collect::<Vec<_>>())
    };
    let error = refused(&["--element", "3"]);
    assert!(error.contains("elements of 4, 8, 16"), "{error}");
    let error = refused(&["--element", "2"]);
    assert!(error.contains("elements of 4, 8, 16"), "{error}");
    let exchanged = [
        "import",
        "-o",
        &capture,
        "--patterns",
        &photos,
        "--photos",
        &pictures,
    ];
    let error = fail(&exchanged);
    assert!(error.contains("exchanged"), "{error}");
    let photo = fs::read_dir(&photos)
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    fs::remove_file(photo).unwrap();
    let error = refused(&[]);
    assert!(error.contains("photographs, but --patterns"), "{error}");
    assert!(!Path::new(&capture).exists());
}

#[test]
fn a_correspondence_that_bends_is_found_and_kept_in_the_file() {
    let folder = TempDir::new().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (capture, given, found) = (text("capture"), text("given.ltm"), text("found.ltm"));
    let size = ["--camera", "96x64", "--light", "48x32", "--patterns", "60"];
    let view = ["--distortion", "6", "--tilt", "12"];
    succeed(
        &[
            &["simulate", "stained-glass", "-o", &capture][..],
            &size,
            &view,
        ]
        .concat(),
    );
    succeed(&["recover", &capture, "-o", &given, "--window", "9"]);
    let error = fail(&["calibrate", &capture]);
    assert!(error.contains("--force"), "{error}");
    remove_field(&capture, "correspondence");
    let report = json(&succeed(&["calibrate", &capture, "--json"]));
    let displacement = report["largest_displacement"].as_f64().unwrap();
    assert!((1.0..5.0).contains(&displacement), "{report}");
    let residual = |of: &str| report[of]["median"].as_f64().unwrap();
    assert!(
        residual("residual") < 0.9 * residual("affine_residual"),
        "{report}"
    );
    succeed(&["recover", &capture, "-o", &found, "--window", "9"]);
    let snrs = [&given, &found].map(|file| snr(file, &capture));
    assert!(snrs[1] > snrs[0] - 0.5, "{snrs:?}");
    let inspected = json(&succeed(&["inspect", &found, "--json"]));
    assert_eq!(
        inspected["displacement"]["control_points"],
        serde_json::json!([7, 5])
    );
}

#[test]
fn a_displacement_for_pictures_of_another_size_is_refused() {
    let folder = TempDir::new().unwrap();
    let capture = folder.path().join("capture").to_str().unwrap().to_owned();
    let size = ["--camera", "48x32", "--light", "24x16", "--patterns", "4"];
    let view = ["--distortion", "-5"];
    succeed(
        &[
            &["simulate", "stained-glass", "-o", &capture][..],
            &size,
            &view,
        ]
        .concat(),
    );
    let mut changed = manifest(&capture);
    let points = &mut changed["correspondence"]["displacement"]["points"];
    assert_eq!(points["width"], 7);
    let path = Path::new(&capture).join("capture.json");
    changed["camera"]["width"] = 64.into();
    fs::write(&path, changed.to_string()).unwrap();
    let file = folder.path().join("file.ltm").to_str().unwrap().to_owned();
    let error = fail(&["recover", &capture, "-o", &file]);
    assert!(error.contains("correspondence.displacement"), "{error}");
    let error = fail(&["simulate", "cookies", "-o", &file, "--tilt", "5"]);
    assert!(error.contains("stained-glass"), "{error}");
}
