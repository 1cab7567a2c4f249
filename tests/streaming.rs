//! Recovery within little memory, and recovery that is interrupted and goes on.
#![cfg(unix)]
#![allow(clippy::unwrap_used)] // a test that cannot go on should stop

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ltm-export"));
    command.args(args);
    command
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", said(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn simulate(folder: &TempDir, scene: &str, size: &[&str]) -> PathBuf {
    let capture = folder.path().join("capture");
    let args = ["simulate", scene, "-o", text(&capture)];
    let output = command(&[&args, size].concat()).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    capture
}

#[test]
fn little_memory_reads_photographs_by_strips_and_recovers_the_same() {
    let folder = TempDir::new().unwrap();
    let size = [
        "--camera",
        "64x1024",
        "--light",
        "16x256",
        "--patterns",
        "100",
    ];
    let capture = simulate(&folder, "stained-glass", &size);
    let recover = |method: &str, memory: &str| {
        let file = folder.path().join(format!("{method}-{memory}.ltm"));
        let args = [
            "recover",
            text(&capture),
            "-o",
            text(&file),
            "--window",
            "3",
            "--json",
            "--method",
            method,
            "--memory",
            memory,
            // How good a file is worth being is judged by the sample, too.
            "--quality",
            "40",
        ];
        let output = command(&args).output().unwrap();
        (file, output)
    };
    let peak = |report: &Value| report["peak_rss_bytes"].as_u64().unwrap();
    let whole_and_strips = |method: &str| {
        let (_, refused) = recover(method, "1M");
        assert_eq!(refused.status.code(), Some(1));
        let message = said(&refused);
        assert!(message.contains("--memory 1M is too little"), "{message}");
        let least = message.trim().rsplit(' ').next().unwrap();
        let budget = least.trim_end_matches('M').parse::<u64>().unwrap() << 20;
        let (whole, whole_report) = recover(method, "2G");
        let (strips, report) = recover(method, least);
        let (whole_report, report) = (json(&whole_report), json(&report));
        assert_eq!(whole_report["strips"], 1);
        assert!(report["strips"].as_u64().unwrap() > 2, "{report}");
        assert!(peak(&report) < budget, "{report}");
        if method == "nnls" {
            // Learning takes more than the photographs of a capture as small as this.
            assert!(peak(&report) < peak(&whole_report), "{report}");
            assert_eq!(whole_report["common_mode"], report["common_mode"]);
        }
        [whole, strips]
    };
    // Least squares chooses one weight, the same from either sample, and so recovers the same.
    let [whole, strips] = whole_and_strips("nnls").map(|file| fs::read(file).unwrap());
    assert!(whole == strips);
    // What is learned depends on the sample, but not how good it is.
    let [whole, strips] = whole_and_strips("learned").map(|file| {
        let args = ["evaluate", text(&file), text(&capture), "--json"];
        let evaluated = json(&command(&args).output().unwrap());
        evaluated["heldout_snr_db"].as_f64().unwrap()
    });
    assert!((whole - strips).abs() < 0.1, "{whole} dB, {strips} dB");
    let impossible = recover("learned", "lots").1;
    assert_eq!(impossible.status.code(), Some(2));
}

/// A recovery of many tiles to interrupt, and what it comes to when it is not.
struct Interruptible {
    folder: TempDir,
    capture: PathBuf,
    whole: Vec<u8>,
}

impl Interruptible {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let size = [
            "--camera",
            "128x128",
            "--light",
            "64x64",
            "--patterns",
            "16",
        ];
        let capture = simulate(&folder, "cookies", &size);
        let mut this = Self {
            folder,
            capture,
            whole: Vec::new(),
        };
        let output = this.recover("whole.ltm", &[]).output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
        this.whole = fs::read(this.path("whole.ltm")).unwrap();
        this
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn recover(&self, name: &str, more: &[&str]) -> Command {
        let file = self.path(name);
        let args = ["recover", text(&self.capture), "-o", text(&file)];
        let window = ["--window", "5"];
        let window = if more.contains(&"--window") {
            &[][..]
        } else {
            &window
        };
        command(&[&args, window, more].concat())
    }

    /// Recovers until the first tile is kept, then sends `signal`.
    fn interrupt(&self, name: &str, signal: &str) -> Output {
        let output = self.signal(name, signal, wait_for_a_tile);
        assert!(self.path(&format!("{name}.checkpoint")).exists());
        output
    }

    /// Recovers until the end of `wait`, which is given the checkpoint, then sends `signal`.
    fn signal(&self, name: &str, signal: &str, wait: impl Fn(&mut Child, &Path)) -> Output {
        assert!(!self.path(name).exists());
        let checkpoint = self.path(&format!("{name}.checkpoint"));
        let mut recover = self.recover(name, &["--memory", "4G"]);
        // On one thread, most tiles are yet to come when the first is there.
        recover.env("RAYON_NUM_THREADS", "1");
        let mut child = recover.stderr(Stdio::piped()).spawn().unwrap();
        wait(&mut child, &checkpoint);
        let id = child.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status().unwrap();
        assert!(sent.success());
        let output = child.wait_with_output().unwrap();
        assert!(!self.path(name).exists(), "never half a file");
        output
    }

    fn resumes(&self, name: &str) {
        let output = self.recover(name, &["--resume"]).output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
        assert!(said(&output).contains("resuming with"), "{}", said(&output));
        assert!(fs::read(self.path(name)).unwrap() == self.whole);
        assert!(!self.path(&format!("{name}.checkpoint")).exists());
    }
}

/// Waits until the checkpoint holds more than its head and what was learned.
fn wait_for_a_tile(child: &mut Child, checkpoint: &Path) {
    let (mut last, mut grown) = (0, 0);
    loop {
        let bytes = fs::metadata(checkpoint).map_or(0, |m| m.len());
        grown += u32::from(bytes > last);
        last = bytes;
        if grown == 3 {
            return;
        }
        assert!(child.try_wait().unwrap().is_none(), "ended too soon");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn an_interrupted_recovery_goes_on_to_the_same_bytes() {
    let recovery = Interruptible::new();
    for signal in ["-INT", "-TERM"] {
        let output = recovery.interrupt("told.ltm", signal);
        assert_eq!(output.status.code(), Some(130), "{}", said(&output));
        let words = [
            "interrupted: ",
            " of 16 tiles",
            "told.ltm.checkpoint",
            "--resume",
        ];
        for word in words {
            assert!(said(&output).contains(word), "no {word}: {}", said(&output));
        }
        // Not lost by forgetting to say so.
        let again = recovery.recover("told.ltm", &[]).output().unwrap();
        assert_eq!(again.status.code(), Some(1));
        assert!(said(&again).contains("add --resume"), "{}", said(&again));
        recovery.resumes("told.ltm");
        fs::remove_file(recovery.path("told.ltm")).unwrap();
    }
    // Nothing to resume from is no hindrance.
    let output = recovery.recover("new.ltm", &["--resume"]).output().unwrap();
    assert!(
        said(&output).contains("starting from the beginning"),
        "{}",
        said(&output)
    );
    assert!(fs::read(recovery.path("new.ltm")).unwrap() == recovery.whole);
}

#[test]
fn learning_stops_when_told_and_leaves_nothing() {
    let recovery = Interruptible::new();
    let output = recovery.signal("early.ltm", "-INT", |child, checkpoint| {
        while !checkpoint.exists() {
            assert!(child.try_wait().unwrap().is_none(), "ended too soon");
            std::thread::sleep(Duration::from_millis(1));
        }
    });
    assert_eq!(output.status.code(), Some(130), "{}", said(&output));
    let before = "interrupted before the first tile: nothing is kept";
    assert!(said(&output).contains(before), "{}", said(&output));
    assert!(!recovery.path("early.ltm.checkpoint").exists());
}

#[test]
fn a_killed_recovery_goes_on_too_and_what_does_not_fit_is_named() {
    let recovery = Interruptible::new();
    recovery.interrupt("killed.ltm", "-KILL");
    let checkpoint = recovery.path("killed.ltm.checkpoint");
    let kept = fs::read(&checkpoint).unwrap();
    let refuses = |more: &[&str], words: &[&str]| {
        let args = [&["--resume"], more].concat();
        let output = recovery.recover("killed.ltm", &args).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        for word in words.iter().chain(&["killed.ltm.checkpoint"]) {
            assert!(said(&output).contains(word), "no {word}: {}", said(&output));
        }
        assert!(fs::read(&checkpoint).unwrap() == kept);
    };
    refuses(
        &["--window", "9"],
        &["--window was 5, and is 9 now", "delete it"],
    );
    refuses(&["--patterns", "9"], &["--patterns was", "is 9 now"]);
    let photo = recovery.capture.join("photos/0003.png");
    let sound = fs::read(&photo).unwrap();
    image::ImageBuffer::<image::Rgb<u16>, _>::new(128, 128)
        .save(&photo)
        .unwrap();
    refuses(&[], &["photos/0003.png in the capture has changed"]);
    fs::write(&photo, sound).unwrap();

    // As if another build had begun it, and learned something else.
    let head = 16 + u32::from_le_bytes(kept[8..12].try_into().unwrap()) as usize;
    assert_eq!(kept[head..head + 4], u32::MAX.to_le_bytes());
    let length = u32::from_le_bytes(kept[head + 4..head + 8].try_into().unwrap()) as usize;
    let mut other = kept.clone();
    other[head + 12] ^= 1;
    let crc = crc32c::crc32c(&other[head..head + 8]);
    let crc = crc32c::crc32c_append(crc, &other[head + 12..head + 12 + length]);
    other[head + 8..head + 12].copy_from_slice(&crc.to_le_bytes());
    // And as if the disk had lost a bit of what was asked for.
    let mut damaged = kept.clone();
    damaged[20] ^= 1;
    for (bytes, words) in [(other, "another build"), (damaged, "is damaged; delete it")] {
        fs::write(&checkpoint, &bytes).unwrap();
        for more in [&["--resume"][..], &[]] {
            let output = recovery.recover("killed.ltm", more).output().unwrap();
            assert_eq!(output.status.code(), Some(1), "{}", said(&output));
            if words.contains("damaged") || !more.is_empty() {
                assert!(said(&output).contains(words), "{}", said(&output));
            }
            assert!(fs::read(&checkpoint).unwrap() == bytes);
        }
    }

    // As if the process had died while it wrote.
    let mut torn = kept.clone();
    torn.extend([1, 0, 0, 0, 200, 0, 0, 0, 9, 9]);
    fs::write(&checkpoint, torn).unwrap();
    recovery.resumes("killed.ltm");

    fs::write(&checkpoint, "somebody's notes").unwrap();
    let output = recovery
        .recover("killed.ltm", &["--resume"])
        .output()
        .unwrap();
    assert!(
        said(&output).contains("is not a checkpoint"),
        "{}",
        said(&output)
    );
    assert_eq!(fs::read(&checkpoint).unwrap(), b"somebody's notes");
}
