//! Recovery with little memory, and recovery that is interrupted and resumed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::LazyLock;
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

use crate::common::copy_folder;
use crate::enlargement::{Enlargement, enlarge_capture};

fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ltm-export"));
    command.args(args);
    command
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn stderr_text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", stderr_text(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn simulate(capture: &Path, scene: &str, size: &[&str]) {
    let args = ["simulate", scene, "-o", text(capture)];
    let output = command(&[&args, size].concat()).output().unwrap();
    assert!(output.status.success(), "{}", stderr_text(&output));
}

/// Photographs of a trembling camera that clips codes, which is not declared: what is found in a sample of the pixels holds for
/// all strips.
#[test]
fn with_little_memory_photographs_are_read_in_strips_to_the_same_file() {
    let folder = TempDir::new().unwrap();
    let [small, capture] = ["small", "large"].map(|name| folder.path().join(name));
    let size = ["--camera", "104x80", "--light", "26x20", "--patterns", "13"];
    simulate(&small, "stained-glass", &size);
    // Nothing needs Gray code, and it would take most of the time.
    let manifest = small.join("capture.json");
    let mut listed: Value = serde_json::from_slice(&fs::read(&manifest).unwrap()).unwrap();
    listed["graycode"] = Value::Array(Vec::new());
    fs::write(&manifest, listed.to_string()).unwrap();
    // Larger than pictures that are always loaded whole.
    let enlargement = Enlargement {
        factor: 8,
        trembling: 0.4,
        max_code: 24_000,
    };
    enlarge_capture(&small, &capture, enlargement);
    let recover = |memory: &str| {
        let file = folder.path().join(format!("{memory}.ltm"));
        let args = ["recover", text(&capture), "-o", text(&file), "--json"];
        let settings = ["--window", "3", "--method", "nnls", "--memory", memory];
        let output = command(&[&args[..], &settings].concat()).output().unwrap();
        (file, output)
    };
    let (_, refused) = recover("1M");
    assert_eq!(refused.status.code(), Some(1));
    let message = stderr_text(&refused);
    assert!(message.contains("--memory 1M is too little"), "{message}");
    let least = message.trim().rsplit(' ').next().unwrap();
    let budget = least.trim_end_matches('M').parse::<u64>().unwrap() << 20;
    let [whole, strips] = ["2G", least].map(|memory| {
        let (file, output) = recover(memory);
        let report = json(&output);
        let fields = report["estimated_fields"].as_array().unwrap();
        assert_eq!(fields[0]["field"], "camera.saturation", "{report}");
        assert!(
            report["saturated_samples"].as_u64().unwrap() > 100,
            "{report}"
        );
        let warnings = report["warnings"].as_array().unwrap().iter();
        let codes: Vec<&str> = warnings.map(|w| w["code"].as_str().unwrap()).collect();
        assert!(codes.contains(&"camera-trembled"), "{codes:?}");
        (fs::read(file).unwrap(), report)
    });
    assert_eq!(whole.1["strips"], 1);
    assert!(strips.1["strips"].as_u64().unwrap() > 2, "{}", strips.1);
    let peak = |report: &Value| report["peak_rss_bytes"].as_u64().unwrap();
    assert!(peak(&strips.1) < budget.min(peak(&whole.1)), "{}", strips.1);
    assert_eq!(whole.1["photograph_table"], strips.1["photograph_table"]);
    assert!(whole.0 == strips.0);
    assert_eq!(recover("lots").1.status.code(), Some(2));
    // So are those of its stages.
    let [stages, file] = ["stages", "stages.ltm"].map(|name| folder.path().join(name));
    let stage = |args: &[&str]| {
        let output = command(&[&["stage"], args].concat()).output().unwrap();
        assert!(output.status.success(), "{}", stderr_text(&output));
    };
    let (stages, memory) = (text(&stages), ["--memory", least]);
    let options = ["--window", "3", "--method", "nnls"];
    stage(&[&["plan", text(&capture), "-o", stages], &options[..]].concat());
    stage(&[&["learn", stages], &memory[..]].concat());
    for shard in ["2/2", "1/2"] {
        stage(&[&["tiles", stages, "--shard", shard], &memory[..]].concat());
    }
    let assemble = ["assemble", stages, "--shards", "2", "-o", text(&file)];
    stage(&[&assemble[..], &memory].concat());
    assert!(fs::read(file).unwrap() == whole.0);
}

/// The capture that every [`Interruptible`] has a copy of.
static CAPTURE: LazyLock<PathBuf> = LazyLock::new(|| {
    let capture = Path::new(env!("CARGO_TARGET_TMPDIR")).join("streaming-capture");
    let _ = fs::remove_dir_all(&capture);
    let size = ["--camera", "128x64", "--light", "64x32", "--patterns", "16"];
    simulate(&capture, "cookies", &size);
    capture
});

/// The file of an uninterrupted recovery, the same for every [`Interruptible`].
static WHOLE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let recovery = Interruptible::new();
    let output = recovery.recover("whole.ltm", &[]).output().unwrap();
    assert!(output.status.success(), "{}", stderr_text(&output));
    fs::read(recovery.path("whole.ltm")).unwrap()
});

/// A recovery of many tiles that tests interrupt.
struct Interruptible {
    folder: TempDir,
    capture: PathBuf,
}

impl Interruptible {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let capture = folder.path().join("capture");
        copy_folder(&CAPTURE, &capture);
        Self { folder, capture }
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

    /// Recovers until the checkpoint has the first tile, then sends `signal`.
    fn interrupt(&self, name: &str, signal: &str) -> Output {
        let output = self.signal(name, signal, wait_for_a_tile);
        assert!(self.path(&format!("{name}.checkpoint")).exists());
        output
    }

    /// Recovers until `wait` returns, then sends `signal`. `wait` gets the path of the checkpoint.
    fn signal(&self, name: &str, signal: &str, wait: impl Fn(&mut Child, &Path)) -> Output {
        assert!(!self.path(name).exists());
        let checkpoint = self.path(&format!("{name}.checkpoint"));
        let mut recover = self.recover(name, &["--memory", "4G"]);
        // On one thread most tiles are missing when the first is complete.
        recover.env("RAYON_NUM_THREADS", "1");
        let mut child = recover.stderr(Stdio::piped()).spawn().unwrap();
        wait(&mut child, &checkpoint);
        let id = child.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status().unwrap();
        assert!(sent.success());
        let output = child.wait_with_output().unwrap();
        assert!(
            !self.path(name).exists(),
            "an interrupted recovery must not write the file"
        );
        output
    }

    fn resumes(&self, name: &str) {
        let output = self.recover(name, &["--resume"]).output().unwrap();
        assert!(output.status.success(), "{}", stderr_text(&output));
        assert!(
            stderr_text(&output).contains("resuming with"),
            "{}",
            stderr_text(&output)
        );
        assert!(fs::read(self.path(name)).unwrap() == *WHOLE);
        assert!(!self.path(&format!("{name}.checkpoint")).exists());
    }
}

/// The records of a checkpoint that are whole: its key, the learned prior's fingerprint, then tiles.
fn whole_records(checkpoint: &[u8]) -> usize {
    const MAGIC_BYTES: usize = 8;
    // Its number, the length of its content and a checksum.
    const RECORD_HEAD_BYTES: usize = 12;
    let (mut at, mut records) = (MAGIC_BYTES, 0);
    while let Some(length) = checkpoint.get(at + 4..at + 8) {
        at += RECORD_HEAD_BYTES + u32::from_le_bytes(length.try_into().unwrap()) as usize;
        records += usize::from(at <= checkpoint.len());
    }
    records
}

/// Waits until the checkpoint has a whole tile.
fn wait_for_a_tile(child: &mut Child, checkpoint: &Path) {
    while fs::read(checkpoint).map_or(0, |bytes| whole_records(&bytes)) < 3 {
        assert!(
            child.try_wait().unwrap().is_none(),
            "the recovery ended before the signal"
        );
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn an_interrupted_recovery_resumes_to_the_same_bytes() {
    let recovery = Interruptible::new();
    for signal in ["-TERM", "-INT"] {
        let _ = fs::remove_file(recovery.path("stopped.ltm.checkpoint"));
        let output = recovery.interrupt("stopped.ltm", signal);
        assert_eq!(output.status.code(), Some(130), "{}", stderr_text(&output));
        let words = [
            "interrupted: ",
            " of 8 tiles",
            "stopped.ltm.checkpoint",
            "--resume",
        ];
        for word in words {
            assert!(
                stderr_text(&output).contains(word),
                "no {word}: {}",
                stderr_text(&output)
            );
        }
    }
    // Without --resume the checkpoint is kept.
    let again = recovery.recover("stopped.ltm", &[]).output().unwrap();
    assert_eq!(again.status.code(), Some(1));
    assert!(
        stderr_text(&again).contains("add --resume"),
        "{}",
        stderr_text(&again)
    );
    recovery.resumes("stopped.ltm");
    // Without a checkpoint --resume starts from the beginning.
    let output = recovery.recover("new.ltm", &["--resume"]).output().unwrap();
    assert!(
        stderr_text(&output).contains("starting from the beginning"),
        "{}",
        stderr_text(&output)
    );
    assert!(fs::read(recovery.path("new.ltm")).unwrap() == *WHOLE);
}

#[test]
fn an_interrupt_during_training_leaves_no_checkpoint() {
    let recovery = Interruptible::new();
    let output = recovery.signal("early.ltm", "-INT", |child, checkpoint| {
        while !checkpoint.exists() {
            assert!(
                child.try_wait().unwrap().is_none(),
                "the recovery ended before the signal"
            );
            std::thread::sleep(Duration::from_millis(1));
        }
    });
    assert_eq!(output.status.code(), Some(130), "{}", stderr_text(&output));
    let before = "interrupted before the first tile: nothing is kept";
    assert!(
        stderr_text(&output).contains(before),
        "{}",
        stderr_text(&output)
    );
    assert!(!recovery.path("early.ltm.checkpoint").exists());
}

#[test]
fn a_killed_recovery_resumes_and_mismatches_are_named() {
    let recovery = Interruptible::new();
    recovery.interrupt("killed.ltm", "-KILL");
    let checkpoint = recovery.path("killed.ltm.checkpoint");
    let kept = fs::read(&checkpoint).unwrap();
    let refuses = |more: &[&str], words: &[&str]| {
        let args = [&["--resume"], more].concat();
        let output = recovery.recover("killed.ltm", &args).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", stderr_text(&output));
        for word in words.iter().chain(&["killed.ltm.checkpoint"]) {
            assert!(
                stderr_text(&output).contains(word),
                "no {word}: {}",
                stderr_text(&output)
            );
        }
        assert!(fs::read(&checkpoint).unwrap() == kept);
    };
    refuses(
        &["--window", "9"],
        &["--window was 5, and is 9 now", "delete it"],
    );
    refuses(&["--patterns", "9"], &["--patterns was", "is 9 now"]);
    let trusting = "--trust was declared, and is estimated now";
    refuses(&["--trust", "estimated"], &[trusting]);
    let photo = recovery.capture.join("photos/0003.png");
    let sound = fs::read(&photo).unwrap();
    image::ImageBuffer::<image::Rgb<u16>, _>::new(128, 64)
        .save(&photo)
        .unwrap();
    refuses(&[], &["photos/0003.png in the capture has changed"]);
    fs::write(&photo, sound).unwrap();

    // Another process has not finished.
    let other = fs::File::open(&checkpoint).unwrap();
    other.lock().unwrap();
    let output = recovery
        .recover("killed.ltm", &["--resume"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(75), "it may succeed later");
    assert!(stderr_text(&output).contains("killed.ltm.checkpoint: is in use"));
    drop(other);

    // A checkpoint of another build, with another learned prior.
    let prior = 20 + u32::from_le_bytes(kept[12..16].try_into().unwrap()) as usize;
    assert_eq!(kept[prior..prior + 4], (u32::MAX - 1).to_le_bytes());
    let length = u32::from_le_bytes(kept[prior + 4..prior + 8].try_into().unwrap()) as usize;
    let mut other = kept.clone();
    other[prior + 12] ^= 1;
    let crc = crc32c::crc32c(&other[prior..prior + 8]);
    let crc = crc32c::crc32c_append(crc, &other[prior + 12..prior + 12 + length]);
    other[prior + 8..prior + 12].copy_from_slice(&crc.to_le_bytes());
    // A damaged checkpoint key: its number, its length, and its content.
    let damaged = [(8, 1), (14, 0x80), (15, 0x80), (20, 1)].map(|(at, bit)| {
        let mut damaged = kept.clone();
        damaged[at] ^= bit;
        (damaged, "is damaged; delete it")
    });
    let mut older = kept.clone();
    older[7] = b'1';
    let others = [
        (other, "another build"),
        (older, "written by another version"),
    ];
    for (bytes, words) in others.into_iter().chain(damaged) {
        fs::write(&checkpoint, &bytes).unwrap();
        for more in [&["--resume"][..], &[]] {
            let output = recovery.recover("killed.ltm", more).output().unwrap();
            assert_eq!(output.status.code(), Some(1), "{}", stderr_text(&output));
            if !words.contains("another build") || !more.is_empty() {
                assert!(
                    stderr_text(&output).contains(words),
                    "{}",
                    stderr_text(&output)
                );
            }
            assert!(fs::read(&checkpoint).unwrap() == bytes);
        }
    }

    // A record that is cut off, as by a crash.
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
        stderr_text(&output).contains("is not a checkpoint"),
        "{}",
        stderr_text(&output)
    );
    assert_eq!(fs::read(&checkpoint).unwrap(), b"somebody's notes");
}
