//! A session with a simulated object: what a display shows, and its photographs.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

pub fn run(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ltm-export"));
    command.args(arguments).output().unwrap()
}

pub fn stderr_text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub fn succeed(arguments: &[&str]) -> Output {
    let output = run(arguments);
    assert!(
        output.status.success(),
        "{arguments:?}: {}",
        stderr_text(&output)
    );
    output
}

/// An object, the sequence that a display shows, and its photographs.
pub struct Session {
    pub folder: TempDir,
}

impl Session {
    pub fn new() -> Self {
        Self::of("24x24", "200x150", "48")
    }

    /// Of so many light elements, display pixels and patterns.
    pub fn of(light: &str, screen: &str, patterns: &str) -> Self {
        Self::simulated(&["--camera", "48x48"], light, screen, patterns)
    }

    /// With options of the simulation, of so many light elements, display pixels and patterns.
    pub fn simulated(simulation: &[&str], light: &str, screen: &str, patterns: &str) -> Self {
        let session = Self {
            folder: TempDir::new().unwrap(),
        };
        let [object, sequence, photos] =
            ["object", "sequence", "photos"].map(|name| session.text(name));
        let simulate = ["simulate", "stained-glass", "-o", &object];
        let size = ["--light", light, "--patterns", "1"];
        succeed(&[&simulate[..], &size, simulation].concat());
        let display = ["--screen", screen, "--light", light, "--patterns", patterns];
        succeed(&[&["patterns", "-o", &sequence], &display[..]].concat());
        let photograph = ["photograph", &object, "--sequence", &sequence];
        succeed(&[&photograph[..], &["-o", &photos]].concat());
        session
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    /// The photograph of picture `i`.
    pub fn photo(&self, i: usize) -> PathBuf {
        self.path(&format!("photos/IMG_{:04}.png", i + 1))
    }

    pub fn assemble(&self, more: &[&str]) -> Output {
        let [sequence, photos] = ["sequence", "photos"].map(|name| self.text(name));
        let levels = ["--black", "512", "--white", "60000"];
        run(&[
            &["assemble", &sequence, "--photos", &photos],
            &levels[..],
            more,
        ]
        .concat())
    }

    pub fn refusal(&self) -> String {
        let output = self.assemble(&[]);
        // 65 where a photograph cannot be read.
        assert!(matches!(output.status.code(), Some(1 | 65)));
        assert!(!self.path("sequence/capture.json").exists());
        assert!(!self.path("sequence/photos").exists());
        stderr_text(&output)
    }

    pub fn manifest(&self) -> Value {
        serde_json::from_slice(&fs::read(self.path("sequence/capture.json")).unwrap()).unwrap()
    }
}
