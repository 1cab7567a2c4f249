//! A recovery in stages, as several machines run it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

use crate::enlargement::{Enlargement, enlarge_capture};

pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn stderr_text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ltm-export"));
    command.args(args);
    command
}

fn run(args: &[&str]) -> Output {
    command(args).output().unwrap()
}

/// Runs a command that must succeed.
pub fn succeeds(args: &[&str]) -> Output {
    let output = run(args);
    assert!(
        output.status.success(),
        "{args:?}: {}",
        stderr_text(&output)
    );
    output
}

/// Runs a command that must fail with this status and these words.
pub fn fails(args: &[&str], status: i32, words: &[&str]) {
    let output = run(args);
    let said = stderr_text(&output);
    assert_eq!(output.status.code(), Some(status), "{args:?}: {said}");
    for word in words {
        assert!(said.contains(word), "no {word:?}: {said}");
    }
}

/// Options of a recovery that learns a prior, and of one that takes less time.
pub const LEARNED: [&str; 2] = ["--window", "5"];
pub const NNLS: [&str; 4] = ["--window", "5", "--method", "nnls"];

/// A capture of so many camera pixels, and a folder of stages.
pub struct Job {
    options: &'static [&'static str],
    folder: TempDir,
    pub capture: PathBuf,
    stages: PathBuf,
}

impl Job {
    pub fn new(camera: &str, faults: &[&str], options: &'static [&'static str]) -> Self {
        let folder = TempDir::new().unwrap();
        let [capture, stages] = ["capture", "stages"].map(|name| folder.path().join(name));
        let clean = folder.path().join("clean");
        let first = if faults.is_empty() { &capture } else { &clean };
        let size = ["--camera", camera, "--light", "32x64", "--patterns", "30"];
        succeeds(&[&["simulate", "stained-glass", "-o", text(first)], &size[..]].concat());
        if !faults.is_empty() {
            let args = ["photograph", text(&clean), "-o", text(&capture)];
            succeeds(&[&args, faults].concat());
        }
        Self {
            options,
            folder,
            capture,
            stages,
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn pack(&self, name: &str) -> PathBuf {
        self.stages.join("shards").join(name)
    }

    pub fn plan(&self, options: &[&str]) -> Output {
        let args = [
            "stage",
            "plan",
            text(&self.capture),
            "-o",
            text(&self.stages),
        ];
        succeeds(&[&args[..], self.options, options].concat())
    }

    pub fn learn(&self) -> Output {
        succeeds(&["stage", "learn", text(&self.stages)])
    }

    pub fn tiles_args<'a>(&'a self, shard: &'a str) -> [&'a str; 5] {
        ["stage", "tiles", text(&self.stages), "--shard", shard]
    }

    fn levels_args<'a>(&'a self, shard: &'a str) -> [&'a str; 5] {
        ["stage", "levels", text(&self.stages), "--shard", shard]
    }

    pub fn tiles(&self, shard: &str) -> Output {
        succeeds(&self.tiles_args(shard))
    }

    /// The bytes of the file, and the report without what differs from run to run.
    pub fn assemble(&self, shards: usize) -> (Vec<u8>, Value) {
        let (file, shards) = (self.path("assembled.ltm"), shards.to_string());
        let args = ["stage", "assemble", text(&self.stages), "--shards", &shards];
        let output = succeeds(&[&args[..], &["-o", text(&file), "--json"]].concat());
        (fs::read(&file).unwrap(), report(&output))
    }

    /// As [`assemble`](Self::assemble), by `recover`.
    pub fn recover(&self, options: &[&str]) -> (Vec<u8>, Value) {
        let file = self.path("recovered.ltm");
        let args = ["recover", text(&self.capture), "-o", text(&file), "--json"];
        let output = succeeds(&[&args[..], self.options, options].concat());
        (fs::read(&file).unwrap(), report(&output))
    }
}

fn report(output: &Output) -> Value {
    let mut report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let fields = report.as_object_mut().unwrap();
    for varying in ["seconds", "peak_rss_bytes", "strips"] {
        fields.remove(varying).unwrap();
    }
    report
}

#[test]
fn shards_write_the_bytes_of_one_recovery() {
    // Four rows of the file's tiles, which are encoded one by one.
    let job = Job::new("64x400", &[], &LEARNED);
    let recovered = job.recover(&[]);
    job.plan(&[]);
    // The limit on memory and the number of threads change no byte.
    let limits = [("1G", "1"), ("4G", "2"), ("1G", "2"), ("4G", "1")];
    let limited = |args: &[&str], (memory, threads): (&str, &str)| {
        let mut command = command(args);
        command.args(["--memory", memory]);
        let output = command.env("RAYON_NUM_THREADS", threads).output().unwrap();
        assert!(output.status.success(), "{}", stderr_text(&output));
    };
    let learned = job.stages.join("learned.bin");
    let what_is_learned = limits.map(|limits| {
        limited(&["stage", "learn", text(&job.stages)], limits);
        let bytes = fs::read(&learned).unwrap();
        fs::remove_file(&learned).unwrap();
        bytes
    });
    assert!({ what_is_learned.windows(2) }.all(|two| two[0] == two[1]));
    job.learn();
    // One shard at all limits, the others at each in turn.
    let orders = [&[1][..], &[1], &[1], &[1], &[2, 1], &[3, 1, 2]];
    for (first, order) in (0..).zip(orders.into_iter().chain([&[7, 2, 4, 6, 1, 3, 5][..]])) {
        let count = order.len();
        for (number, i) in order.iter().zip(first..) {
            let shard = format!("{number}/{count}");
            limited(&job.tiles_args(&shard), limits[i % limits.len()]);
        }
        let assembled = job.assemble(count);
        assert!(assembled.0 == recovered.0, "{count} shards");
        assert_eq!(assembled.1, recovered.1);
        if count == 1 && first < limits.len() - 1 {
            fs::remove_file(job.pack("1-of-1.pack")).unwrap();
        }
    }
    // Nothing is done again.
    let written = |path: &Path| fs::metadata(path).unwrap().modified().unwrap();
    let files = [learned, job.pack("2-of-3.pack")];
    let before = files.each_ref().map(|path| written(path));
    job.plan(&[]);
    for again in [job.learn(), job.tiles("2/3")] {
        assert!(String::from_utf8_lossy(&again.stdout).contains("is complete"));
    }
    assert_eq!(files.each_ref().map(|path| written(path)), before);
}

/// Of three levels, the middle one has two shards.
#[test]
fn shards_of_coarser_levels_are_made_by_several_processes() {
    let mut job = Job::new("16x600", &[], &LEARNED);
    let large = job.path("large");
    enlarge_capture(&job.capture, &large, Enlargement::by(2));
    job.capture = large;
    let recovered = job.recover(&[]);
    job.plan(&[]);
    job.learn();
    let stages = text(&job.stages);
    let printed = |output: Output| String::from_utf8(output.stdout).unwrap();
    job.tiles("2/2");
    let of_two = |count| format!(": {count} of 2 shards of coarser levels");
    assert!(printed(succeeds(&job.levels_args("2/2"))).contains(&of_two(1)));
    let words = ["1-of-2.pack", "is missing", "stage tiles"];
    fails(&job.levels_args("1/2"), 75, &words);
    let words = ["1-of-3.pack", "is missing", "packs of 2 shards"];
    fails(&job.levels_args("2/3"), 75, &words);
    // The first of three processes has none.
    let [one, two] = [1, 2].map(of_two);
    let [none, complete] =
        [": is empty; other shares have all 2", ": is complete"].map(String::from);
    for expected in [vec![&one, &complete], vec![&two], vec![&none, &one, &one]] {
        let count = expected.len();
        let shards: Vec<_> = (1..=count)
            .map(|number| format!("{number}/{count}"))
            .collect();
        for shard in &shards {
            job.tiles(shard);
        }
        for (shard, expected) in shards.iter().zip(expected) {
            let text = printed(succeeds(&job.levels_args(shard)));
            assert!(text.contains(expected), "{shard}: {text}");
        }
        assert!(job.assemble(count) == recovered, "{count} shards");
    }
    // Without its pack, or from a damaged one, a shard is made by `assemble`.
    let packs = ["1-of-3.levels", "2-of-3.levels", "3-of-3.levels"].map(|name| job.pack(name));
    fs::remove_file(&packs[2]).unwrap();
    assert!(job.assemble(3) == recovered);
    let mut bytes = fs::read(&packs[1]).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&packs[1], bytes).unwrap();
    let file = job.path("assembled.ltm");
    let args = [
        "stage",
        "assemble",
        stages,
        "--shards",
        "3",
        "-o",
        text(&file),
    ];
    let note = stderr_text(&succeeds(&args));
    assert!(
        note.contains("note: ") && note.contains("2-of-3.levels"),
        "{note}"
    );
    assert!(fs::read(&file).unwrap() == recovered.0);
    // There is nothing to share of one level.
    job.plan(&["--levels", "1"]);
    job.learn();
    assert!(printed(succeeds(&job.levels_args("1/1"))).contains(": is empty; \"assemble\" makes"));
}

/// Registration, estimated responses and defective pixels reach every shard.
#[test]
fn what_is_learned_of_a_faulty_capture_holds_in_all_shards() {
    let faults = ["tremble=0.2", "clip=0.4", "defects", "object"];
    let faults = faults.map(|fault| ["--fault", fault]).concat();
    let job = Job::new("64x256", &faults, &LEARNED);
    let options = ["--trust", "estimated", "--levels", "1"];
    let recovered = job.recover(&options);
    // The fault that a photograph is left out for, and the pixels that are filled, once each.
    let verdicts = recovered.1["photograph_table"].as_array().unwrap().iter();
    assert!(verdicts.clone().any(|photo| photo["verdict"] != "used"));
    assert!(recovered.1["hot_pixels"].as_u64().unwrap() > 0);
    assert!(
        !recovered.1["estimated_fields"]
            .as_array()
            .unwrap()
            .is_empty()
    );
    job.plan(&options);
    job.learn();
    job.tiles("2/2");
    job.tiles("1/2");
    let assembled = job.assemble(2);
    assert!(assembled.0 == recovered.0);
    assert_eq!(assembled.1, recovered.1);
}

#[test]
fn a_killed_shard_resumes_and_two_at_once_do_no_harm() {
    let job = Job::new("64x264", &[], &NNLS);
    let recovered = job.recover(&[]);
    job.plan(&[]);
    job.learn();
    let mut child = command(&job.tiles_args("1/1"))
        .env("RAYON_NUM_THREADS", "1")
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let partial_bytes = || -> u64 {
        let entries = fs::read_dir(job.stages.join("shards")).unwrap();
        let sizes = entries.flatten().filter_map(|entry| entry.metadata().ok());
        sizes.map(|metadata| metadata.len()).sum()
    };
    // Two whole tiles at least: one has some 120,000 bytes, of which a process that is killed may have written a part.
    while partial_bytes() < 400_000 {
        assert!(child.try_wait().unwrap().is_none(), "it ended too early");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!job.pack("1-of-1.pack").exists());
    // One of them says that it resumes.
    let args = job.tiles_args("1/1");
    let both = [(); 2].map(|()| {
        let mut command = command(&args);
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        command.spawn().unwrap()
    });
    let said = both.map(|child| {
        let output = child.wait_with_output().unwrap();
        let said = stderr_text(&output);
        assert!(output.status.success(), "{said}");
        said
    });
    assert!(said.concat().contains("resuming with "));
    let left = fs::read_dir(job.stages.join("shards")).unwrap();
    let left: Vec<_> = left.flatten().map(|entry| entry.file_name()).collect();
    assert_eq!(left, ["1-of-1.pack"]);
    assert!(job.assemble(1).0 == recovered.0);
}

#[test]
fn a_shard_resumes_from_the_intact_tiles_of_partial_packs() {
    let job = Job::new("64x128", &[], &NNLS);
    job.plan(&[]);
    job.learn();
    job.tiles("1/1");
    let pack = job.pack("1-of-1.pack");
    let whole = fs::read(&pack).unwrap();
    // The key says what was learned; partial packs have the first digits in their names.
    let key = String::from_utf8_lossy(&whole[..300]);
    let learned = key.split_once("\"learned\":\"").unwrap().1;
    let partial = job.pack(&format!("1-of-1.{}.lost.partial", &learned[..8]));
    let of_another_plan = job.pack("1-of-1.01234567.lost.partial");
    fs::write(&of_another_plan, &whole).unwrap();
    fs::rename(&pack, &partial).unwrap();
    // Cut off within its last tile, as by a machine that was lost.
    fs::write(&partial, &whole[..whole.len() - 300]).unwrap();
    let said = stderr_text(&job.tiles("1/1"));
    assert!(said.contains("resuming with 7 of 8 tiles"), "{said}");
    assert!(fs::read(&pack).unwrap() == whole);
    assert!(!partial.exists() && of_another_plan.exists());
}

#[test]
fn an_interrupted_shard_keeps_its_tiles() {
    let job = Job::new("64x264", &[], &LEARNED);
    job.plan(&[]);
    job.learn();
    let mut tiles = command(&job.tiles_args("1/1"));
    tiles.env("RAYON_NUM_THREADS", "1").stderr(Stdio::piped());
    let mut child = tiles.spawn().unwrap();
    let shards = job.stages.join("shards");
    while fs::read_dir(&shards).unwrap().next().is_none() {
        assert!(child.try_wait().unwrap().is_none(), "it ended too early");
        std::thread::sleep(Duration::from_millis(1));
    }
    let id = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-TERM", &id])
            .status()
            .unwrap()
            .success()
    );
    let output = child.wait_with_output().unwrap();
    let said = stderr_text(&output);
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("the same command continues"), "{said}");
    assert!(stderr_text(&job.tiles("1/1")).contains("resuming with"));
}

#[test]
fn files_of_other_stages_are_checked_and_named() {
    let job = Job::new("64x264", &[], &NNLS);
    let stages = text(&job.stages);
    let file = job.path("file.ltm");
    let assemble = [
        "stage",
        "assemble",
        stages,
        "--shards",
        "2",
        "-o",
        text(&file),
    ];
    let learn = ["stage", "learn", stages];
    fails(&learn, 75, &["plan.json: is missing", "stage plan"]);
    let of_capture = ["stage", "learn", text(&job.capture)];
    fails(&of_capture, 65, &["is a capture", "stage plan"]);
    job.plan(&[]);
    let (first, second) = (job.tiles_args("1/2"), job.tiles_args("2/2"));
    fails(&first, 75, &["learned.bin: is missing", "stage learn"]);
    job.learn();
    job.tiles("1/2");
    let missing = ["2-of-2.pack: is missing", "stage tiles", "--shard 2/2"];
    fails(&assemble, 75, &missing);
    job.tiles("2/2");
    succeeds(&assemble);
    let sound = fs::read(&file).unwrap();

    // Packs that are cut off, damaged or of another shard, and their repair.
    let pack = job.pack("2-of-2.pack");
    let whole = fs::read(&pack).unwrap();
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 1;
    let other = fs::read(job.pack("1-of-2.pack")).unwrap();
    for (bytes, word) in [
        (
            whole[..whole.len() - 1].to_vec(),
            "is incomplete or damaged",
        ),
        (
            whole[..whole.len() / 2].to_vec(),
            "is incomplete or damaged",
        ),
        (vec![], "is incomplete or damaged"),
        (damaged, "is incomplete or damaged"),
        (other, "is not of this learned.bin and shard"),
    ] {
        fs::write(&pack, &bytes).unwrap();
        fails(&assemble, 65, &["2-of-2.pack", word, "--shard 2/2"]);
        succeeds(&second);
        assert!(fs::read(&pack).unwrap() == whole);
    }

    // Another plan: what was learned and recovered by the old one is refused until it is made anew.
    job.plan(&["--patterns", "28"]);
    fails(
        &second,
        65,
        &["learned.bin: is not of this plan", "stage learn"],
    );
    job.learn();
    fails(
        &assemble,
        65,
        &["1-of-2.pack", "is not of this learned.bin"],
    );
    job.plan(&[]);
    job.learn();
    succeeds(&assemble);
    assert!(fs::read(&file).unwrap() == sound);

    // A damaged learned.bin, a changed plan and a changed capture.
    let learned = job.stages.join("learned.bin");
    let content = fs::read(&learned).unwrap();
    for cut in [0, 5, 40, content.len() - 1] {
        fs::write(&learned, &content[..cut]).unwrap();
        fails(&first, 65, &["learned.bin: is incomplete or damaged"]);
        job.learn();
        assert!(fs::read(&learned).unwrap() == content);
    }
    let plan = job.stages.join("plan.json");
    let planned = fs::read_to_string(&plan).unwrap();
    fs::write(&plan, planned.replace("\"side\": 5", "\"side\": 4")).unwrap();
    fails(&first, 65, &["plan.json: is incomplete or damaged"]);
    fs::write(&plan, planned.replace("ltm-export 0", "ltm-export 9")).unwrap();
    fails(&first, 65, &["plan.json: was written by ltm-export 9"]);
    fs::write(&plan, &planned).unwrap();
    let photo = job.capture.join("photos/0003.png");
    let bytes = fs::read(&photo).unwrap();
    fs::write(&photo, &bytes[..bytes.len() - 1]).unwrap();
    fails(&second, 65, &["0003.png has changed since", "stage plan"]);
    fs::remove_file(&photo).unwrap();
    fails(&second, 65, &["0003.png"]);
    let plan_again = ["stage", "plan", text(&job.capture), "-o", stages];
    fails(&plan_again, 65, &["0003.png"]);
    // Of the same length.
    let mut changed = bytes.clone();
    *changed.last_mut().unwrap() ^= 1;
    fs::write(&photo, changed).unwrap();
    for stage in [&learn[..], &assemble] {
        fails(stage, 65, &["0003.png has changed since", "stage plan"]);
    }
    fs::write(&photo, &bytes).unwrap();
    fails(&["stage", "tiles", stages, "--shard", "3/2"], 2, &["3/16"]);

    // The capture moved.
    let moved = job.path("moved");
    fs::rename(&job.capture, &moved).unwrap();
    fs::remove_file(&pack).unwrap();
    fails(&second, 65, &["there is no such folder"]);
    succeeds(&[&second[..], &["--capture", text(&moved)]].concat());
    assert!(fs::read(&pack).unwrap() == whole);
}

#[test]
fn strict_plans_write_no_file_after_a_warning() {
    let job = Job::new("64x128", &["--fault", "clip=0.4"], &NNLS);
    job.plan(&["--strict"]);
    assert!(job.plan(&["--strict"]).stderr.is_empty());
    fails(&["stage", "learn", text(&job.stages)], 65, &["--strict"]);
    assert!(!job.stages.join("learned.bin").exists());
    let note = stderr_text(&job.plan(&[]));
    let words = ["plan.json: replaced the plan of ", text(&job.capture)];
    assert!(words.iter().all(|word| note.contains(word)), "{note}");
}
