//! A capture whose photographs are TIFFs, of which stages read only the rows they need.

use std::fs;
use std::path::{Path, PathBuf};

use relightable_photo::capture::{CameraPixelSet, CaptureFolder};

use crate::stage::{Job, LEARNED, NNLS, fails, succeeds, text};

/// Bytes of a row of 64 pixels, and rows of a tile, of which one has all columns.
const ROW_BYTES: usize = 64 * 6;
const TILE_ROWS: usize = 16;
/// Where the first tile begins: after the header, the resolution and the samples' type.
const TILES_START: usize = 36;

fn ingest<'a>(from: &'a Path, to: &'a Path) -> [&'a str; 5] {
    ["stage", "ingest", text(from), "-o", text(to)]
}

/// Ingests the capture of a job, and makes the copy its capture. Returns the folder of the source.
fn ingest_capture(job: &mut Job) -> PathBuf {
    let copy = job.path("ingested");
    succeeds(&ingest(&job.capture, &copy));
    std::mem::replace(&mut job.capture, copy)
}

/// Damages the tiles of all photographs for whose numbers `is_damaged` is true.
fn damage(capture: &Path, is_damaged: impl Fn(usize) -> bool) {
    for entry in fs::read_dir(capture.join("photos")).unwrap() {
        let path = entry.unwrap().path();
        let mut bytes = fs::read(&path).unwrap();
        for tile in (0..400 / TILE_ROWS).filter(|tile| is_damaged(*tile)) {
            bytes[TILES_START + tile * TILE_ROWS * ROW_BYTES + 7] ^= 1;
        }
        fs::write(&path, bytes).unwrap();
    }
}

#[test]
fn an_ingested_capture_is_recovered_to_the_same_picture() {
    let mut job = Job::new("64x400", &["--fault", "clip=0.4"], &LEARNED);
    let source = job.recover(&[]);
    // In any order; the last writes the manifest.
    let copy = job.path("ingested");
    for (shard, is_last) in [("2/3", false), ("3/3", false), ("1/3", true)] {
        succeeds(&[&ingest(&job.capture, &copy)[..], &["--shard", shard]].concat());
        assert_eq!(copy.join("capture.json").exists(), is_last);
    }
    job.capture = copy;
    let recovered = job.recover(&[]);
    assert!(recovered.0 == source.0);
    let without_names = |report: &serde_json::Value| report.to_string().replace(".tif", ".png");
    let reports = [&source.1, &recovered.1].map(without_names);
    let folders = reports[1].replace("ingested/capture.json", "capture/capture.json");
    assert_eq!(reports[0], folders);
    // Until the manifest is changed: the hash of the inputs is then another one.
    let manifest = job.capture.join("capture.json");
    let text = fs::read_to_string(&manifest).unwrap();
    fs::write(&manifest, text.replacen('{', "{\"own\": 1,", 1)).unwrap();
    assert!(job.recover(&[]).0 != source.0);
    fs::write(&manifest, text).unwrap();
    // The stages write the bytes of `recover`.
    job.plan(&[]);
    job.learn();
    for shard in ["2/2", "1/2"] {
        job.tiles(shard);
    }
    assert!(job.assemble(2).0 == recovered.0);
}

#[test]
fn a_shard_reads_only_its_rows() {
    let mut job = Job::new("64x400", &[], &LEARNED);
    let source = ingest_capture(&mut job);
    job.plan(&[]);
    job.learn();
    job.tiles("2/4");
    let pack = job.pack("2-of-4.pack");
    let expected = fs::read(&pack).unwrap();
    fs::remove_file(&pack).unwrap();
    // Rows 128 to 255 and two more on either side: 10 tiles of 16 rows, 1.25 times as many as 128 rows have.
    damage(&job.capture, |tile| !(7..17).contains(&tile));
    job.tiles("2/4");
    assert!(fs::read(&pack).unwrap() == expected);
    for (shard, rows) in [("1/4", "rows 0 to 15;"), ("3/4", "rows 272 to 287;")] {
        let remedy = "delete it: \"ltm-export stage ingest CAPTURE -o COPY\" writes it again";
        fails(&job.tiles_args(shard), 65, &["photos/", rows, remedy]);
    }
    fs::remove_dir_all(job.capture.join("photos")).unwrap();
    succeeds(&ingest(&source, &job.capture));
    for shard in ["1/4", "3/4"] {
        job.tiles(shard);
    }
}

#[test]
fn ingesting_again_writes_what_has_changed() {
    let mut job = Job::new("64x64", &[], &NNLS);
    let source = ingest_capture(&mut job);
    let (copy, manifest) = (job.capture.clone(), job.capture.join("capture.json"));
    let again = ingest(&source, &copy);
    let written = |path: &Path| fs::metadata(path).unwrap().modified().unwrap();
    let photograph = copy.join("photos/0001.tif");
    let before = [&manifest, &photograph].map(|path| written(path));
    let said = succeeds(&again).stdout;
    assert!(String::from_utf8_lossy(&said).contains(": 0 files written"));
    assert_eq!([&manifest, &photograph].map(|path| written(path)), before);
    // Another photograph: only that, and a plan of the old one is refused.
    job.plan(&[]);
    job.learn();
    fs::copy(
        source.join("photos/0002.png"),
        source.join("photos/0001.png"),
    )
    .unwrap();
    let parts = [&again[..], &["--shard", "1/2"]].concat();
    let others = [&again[..], &["--shard", "2/2"]].concat();
    let said = [parts, others].map(|args| succeeds(&args).stdout);
    let said = said.map(|said| String::from_utf8(said).unwrap()).concat();
    assert!(said.contains(": 1 files written"), "{said}");
    fails(&job.tiles_args("1/1"), 65, &["0001.tif has changed since"]);
    // A damaged histogram, near the end of the file.
    let intact = fs::read(&photograph).unwrap();
    let mut damaged = intact.clone();
    let middle = (64 * ROW_BYTES + TILES_START + intact.len()) / 2;
    damaged[middle] ^= 1;
    fs::write(&photograph, damaged).unwrap();
    let file = job.path("damaged.ltm");
    let recover = ["recover", text(&copy), "-o", text(&file)];
    let words = ["photos/0001.tif", "in its record; delete it"];
    fails(&[&recover[..], &NNLS].concat(), 65, &words);
    let said = String::from_utf8(succeeds(&again).stdout).unwrap();
    assert!(said.contains(": 1 files written"), "{said}");
    assert!(fs::read(&photograph).unwrap() == intact);
    // A copy of the copy has the same TIFFs.
    let third = job.path("third");
    succeeds(&ingest(&copy, &third));
    assert!(fs::read(third.join("photos/0001.tif")).unwrap() == fs::read(&photograph).unwrap());
}

#[test]
fn files_of_others_are_not_replaced() {
    let job = Job::new("64x64", &[], &NNLS);
    let capture = &job.capture;
    fails(&ingest(capture, capture), 1, &["is the capture itself"]);
    let copy = job.path("copy");
    fs::create_dir_all(copy.join("photos")).unwrap();
    fs::write(copy.join("photos/0004.tif"), "mine").unwrap();
    let other = "copy: is not empty, and this command did not write it";
    fails(&ingest(capture, &copy), 1, &[other]);
    assert_eq!(fs::read(copy.join("photos/0004.tif")).unwrap(), b"mine");
    fs::remove_dir_all(&copy).unwrap();
    // Photographs that would have one name, and one outside the folder.
    let manifest = capture.join("capture.json");
    let json = fs::read_to_string(&manifest).unwrap();
    for (name, words) in [
        ("photos/0003.jpg", "would have one name as TIFFs"),
        ("../0004.png", "\"../0004.png\" is outside the folder"),
        (".", "\".\" is outside the folder"),
    ] {
        fs::write(&manifest, json.replace("photos/0004.png", name)).unwrap();
        fails(&ingest(capture, &copy), 65, &["capture.json", words]);
    }
    // A file may be named in several ways.
    let again = json.replacen("photos/0003.png", "./photos//0004.png", 1);
    fs::write(&manifest, again).unwrap();
    let named = job.path("named");
    succeeds(&ingest(capture, &named));
    let stages = job.path("named-stages");
    succeeds(&["stage", "plan", text(&named), "-o", text(&stages)]);
    fs::write(&manifest, &json).unwrap();
    // A damaged photograph is told, and the manifest waits for it.
    let photo = capture.join("photos/0004.png");
    let bytes = fs::read(&photo).unwrap();
    fs::write(&photo, &bytes[..bytes.len() / 2]).unwrap();
    fails(
        &ingest(capture, &copy),
        65,
        &["photos/0004.png (shots[4].photo"],
    );
    assert!(!copy.join("capture.json").exists());
    assert!(!copy.join("photos/0004.tif").exists());
    fs::remove_file(&photo).unwrap();
    fs::create_dir(&photo).unwrap();
    fails(
        &ingest(capture, &copy),
        65,
        &["photos/0004.png", "directory"],
    );
    fs::remove_dir(&photo).unwrap();
    let missing = ["photos/0004.png (shots[4].photo", "there is no such file"];
    fails(&ingest(capture, &copy), 65, &missing);
    fs::write(&photo, &bytes).unwrap();
    succeeds(&ingest(capture, &copy));
    // A pattern that is replaced.
    let pattern = fs::read(capture.join("patterns/0005.png")).unwrap();
    fs::write(capture.join("patterns/0004.png"), &pattern).unwrap();
    let said = succeeds(&ingest(capture, &copy)).stdout;
    assert!(String::from_utf8_lossy(&said).contains(": 1 files written"));
    assert!(fs::read(copy.join("patterns/0004.png")).unwrap() == pattern);
}

#[test]
fn tiled_tiffs_of_another_program_have_the_same_codes() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/tiff");
    let folder = tempfile::TempDir::new().unwrap();
    for (name, tolerance) in [
        ("integers.tif", 0.01),
        ("integers-big-endian.tif", 0.01),
        ("floats.tif", 0.01),
        // The numbers have 11 bits.
        ("half-floats.tif", 16.0),
    ] {
        fs::copy(fixtures.join(name), folder.path().join(name)).unwrap();
        let manifest = serde_json::json!({
            "version": 1,
            "camera": {"width": 40, "height": 50, "black": 0, "white": 65535},
            "light": {"width": 4, "height": 5, "gamma": 1},
            "correspondence": {"affine": [[0.1, 0, 0], [0, 0.1, 0]]},
            "dark": name,
            "shots": [{"pattern": "none.png", "photo": name}],
        });
        fs::write(folder.path().join("capture.json"), manifest.to_string()).unwrap();
        let capture = CaptureFolder::open(folder.path()).unwrap();
        let extent = capture.manifest().camera.extent();
        let dark = capture.read_dark(&CameraPixelSet::all(extent)).unwrap();
        for ((x, y), light) in extent.cells().zip(dark.light()) {
            for (c, light) in (0..).zip(light) {
                let code = f64::from(300 * x + 200 * y + 1000 * c);
                let found = f64::from(*light) * 65_535.0;
                assert!(
                    (found - code).abs() < tolerance,
                    "{name} ({x}, {y}): {found}"
                );
            }
        }
    }
}
