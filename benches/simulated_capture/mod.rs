//! Simulated captures, and the commands that make and use them.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

/// Runs a command of `ltm-export`; returns the JSON that it prints, or null.
pub fn ltm_export(args: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_ltm-export"))
        .args(args)
        .stderr(Stdio::inherit())
        .output()
        .unwrap();
    assert!(output.status.success(), "{args:?}");
    serde_json::from_slice(&output.stdout).unwrap_or(Value::Null)
}

/// A simulated capture of a scene, with two camera pixels along each side of a light element, under 80 patterns.
pub fn simulated(folder: &Path, name: &str, scene: &str, side: u32) -> PathBuf {
    let capture = folder.join(name);
    if !capture.join("capture.json").exists() {
        let [camera, light] = [side, side / 2].map(|side| format!("{side}x{side}"));
        let grids = ["--camera", &camera, "--light", &light, "--patterns", "80"];
        let command = ["simulate", scene, "-o", capture.to_str().unwrap()];
        ltm_export(&[&command[..], &grids].concat());
    }
    capture
}
