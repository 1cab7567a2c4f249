//! `ltm-export study` on a capture with known transport.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use relightable_photo::simulate::SessionFault;
use serde_json::Value;
use tempfile::TempDir;

fn run(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ltm-export"));
    command.args(args).output().unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A small simulated capture, named `glass`, with its truth.
fn capture(folder: &Path) -> PathBuf {
    let size = ["--camera", "32x32", "--light", "16x16", "--patterns", "12"];
    simulate(folder, "stained-glass", "glass", &size)
}

/// A capture of `scene` in `folder`, with the given name.
fn simulate(folder: &Path, scene: &str, name: &str, size: &[&str]) -> PathBuf {
    let capture = folder.join(name);
    let output = run(&[&["simulate", scene, "-o", text(&capture)], size].concat());
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    capture
}

/// Header and rows of a table.
fn csv(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let cells = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect();
    let header = cells(reader.headers().unwrap());
    let rows = reader.records().map(|row| cells(&row.unwrap())).collect();
    (header, rows)
}

#[test]
fn figures_agree_with_recover_and_evaluate() {
    let folder = TempDir::new().unwrap();
    let (capture, results) = (capture(folder.path()), folder.path().join("results"));
    let output = run(&[
        "study",
        text(&capture),
        "-o",
        text(&results),
        "--pixels",
        "200",
    ]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(output.stdout.is_empty(), "progress goes to standard error");

    // Every picture in the report exists and is complete.
    let report = fs::read_to_string(results.join("results.md")).unwrap();
    let pictures: Vec<&str> = report
        .split("](")
        .skip(1)
        .map(|rest| rest.split(')').next().unwrap())
        .collect();
    assert_eq!(pictures.len(), 4);
    for picture in pictures {
        let svg = fs::read_to_string(results.join(picture)).unwrap();
        assert!(
            svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"),
            "{picture}"
        );
    }

    let (header, rows) = csv(&results.join("glass-figure3.csv"));
    assert_eq!(
        header[..4],
        ["method", "patterns", "patterns_per_light_element", "snr_db"]
    );
    let patterns: Vec<&str> = rows
        .iter()
        .filter(|row| row[0] == "nnls")
        .map(|row| row[1].as_str())
        .collect();
    assert_eq!(patterns, ["10", "12"]);
    let (_, profile) = csv(&results.join("glass-figure2.csv"));
    let last = profile.last().unwrap();
    assert_eq!((last[1].as_str(), last[2].as_str()), ("100.000", "100.000"));

    // Relit pictures agree with `recover` and `evaluate`, which round to half floats.
    let file = folder.path().join("glass.ltm");
    let window = ["--window", "15", "--patterns", "12", "--lossless"];
    let (_, rows) = csv(&results.join("glass-figure4.csv"));
    let method = ["--method", rows[0][3].as_str()];
    let recover = ["recover", text(&capture), "-o", text(&file)];
    assert!(
        run(&[&recover[..], &window, &method].concat())
            .status
            .success()
    );
    let evaluated = run(&["evaluate", text(&file), text(&capture), "--json"]);
    let evaluated: Value = serde_json::from_slice(&evaluated.stdout).unwrap();
    assert_eq!(rows.len(), 5);
    for row in rows {
        let (psnr, expected) = (row[1].parse::<f64>().unwrap(), &evaluated["relit"][&row[0]]);
        assert!(
            (psnr - expected.as_f64().unwrap()).abs() < 0.05,
            "{row:?}, {expected}"
        );
    }
}

#[test]
fn invalid_subjects_are_errors_before_any_work() {
    let folder = TempDir::new().unwrap();
    let capture = capture(folder.path());
    let results = folder.path().join("results");
    let assert_fails = |subjects: &[&str], word: &str| {
        let args = [&["study", "-o", text(&results)], subjects].concat();
        let output = run(&args);
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(matches!(output.status.code(), Some(1 | 65)), "{message}");
        assert!(message.contains(word), "no {word:?} in: {message}");
    };
    assert_fails(&["nowhere"], "nowhere");
    assert_fails(&[text(&capture), text(&capture)], "named twice");
    let usage = run(&["study", "scenes", "--faults", "-o", text(&results)]);
    assert_eq!(usage.status.code(), Some(2));
    assert!(!results.exists());
    fs::remove_dir_all(capture.join("truth")).unwrap();
    assert_fails(&[text(&capture)], "truth/");
    fs::write(folder.path().join("mine"), "keep").unwrap();
    let output = run(&["study", "scenes", "-o", text(folder.path())]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("is not empty"));
}

#[test]
fn a_capture_is_photographed_again_with_each_fault() {
    let folder = TempDir::new().unwrap();
    // About the smallest picture in which photographs are corrected, and the fastest method.
    let size = ["--camera", "32x16", "--light", "16x8", "--patterns", "40"];
    let capture = simulate(folder.path(), "cookies", "tray", &size);
    let results = folder.path().join("results");
    let study = ["study", text(&capture), "-o", text(&results)];
    let output = run(&[&study[..], &["--faults", "--method", "nnls"]].concat());
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let (header, rows) = csv(&results.join("tray-faults.csv"));
    assert_eq!(header, ["fault", "tray (dB)", "tray: reported"]);
    let row = |name: &str| {
        let row = rows.iter().find(|row| row[0] == name);
        row.unwrap_or_else(|| panic!("no {name}: {rows:?}"))
    };
    for fault in SessionFault::all() {
        row(&fault.to_string());
    }
    let snr = |name: &str| row(name)[1].parse::<f64>().unwrap();
    assert!(snr("clean") > 30.0, "{rows:?}");
    assert!((snr("clean") - snr("jitter=0.02")).abs() < 1.0, "{rows:?}");
    assert_eq!(row("clean")[2], "");
    assert_eq!(row("jitter=0.02")[2], "gain");
    assert_eq!(row("swap")[2], "photograph-pattern (2)");
    assert_eq!(row("mirror")[2], "refused: the correspondence is mirrored");
    assert_eq!(row("gamma=1.8")[2], "—", "patterns are black and white");
    let report = fs::read_to_string(results.join("results.md")).unwrap();
    assert!(report.contains("--faults --method nnls`") && report.contains("| swap |"));
    let files = fs::read_dir(&results).unwrap();
    assert_eq!(files.count(), 2, "temporary folders are deleted");
}
