//! Raw files, floating-point numbers and 32-bit integers become the measurements of a capture. Raw files need LibRaw's
//! `dcraw_emu`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use half::f16;
use image::{ImageBuffer, Rgb};
use relightable_photo::calibrate;
use relightable_photo::relight::srgb::srgb_decode;

use crate::common::tiff_writer::{DNG_XYZ_TO_CAMERA, RgbSamples, bayer_dng, rgb_tiff};
use crate::session::{Session, stderr_text, succeed};

type Photo = ImageBuffer<Rgb<u16>, Vec<u16>>;

/// Pictures of a session, each with a photograph.
const PICTURES: usize = 88;
const SIZE: [u32; 2] = [48, 48];
/// Levels of the simulated camera.
const BLACK: f64 = 512.0;
const WHITE: f64 = 60_000.0;
/// Levels of the sensor of the DNG files. Blue has its own black.
const SENSOR_BLACK: [u16; 4] = [1024, 1024, 1024, 1040];
const SENSOR_WHITE: u16 = 15_024;

fn ensure_dcraw_emu() {
    // Without arguments it prints its options.
    let found = Command::new("dcraw_emu").output();
    assert!(
        found.is_ok(),
        "dcraw_emu is missing, which reads raw files: run pkg-scripts/setup test, or: apt-get install libraw-bin"
    );
}

fn read_rgb16(path: &Path) -> Photo {
    image::open(path)
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()))
        .into_rgb16()
}

/// Light of a photograph of the session, as a share of white.
fn light(photo: &Photo) -> Vec<[f64; 3]> {
    let share = |code: u16| (f64::from(code) - BLACK) / (WHITE - BLACK);
    photo.pixels().map(|pixel| pixel.0.map(share)).collect()
}

/// A session whose photographs were written again, by `encode`, as files of the extension that it gives.
fn session_of(
    encode: impl Fn(usize, &[[f64; 3]]) -> (&'static str, Vec<u8>),
) -> (Session, Vec<PathBuf>) {
    let session = Session::new();
    fs::create_dir(session.path("files")).unwrap();
    let write = |i: usize| {
        let (extension, bytes) = encode(i, &light(&read_rgb16(&session.photo(i))));
        let path = session.path(&format!("files/IMG_{i:04}.{extension}"));
        fs::write(&path, bytes).unwrap();
        path
    };
    let files = (0..PICTURES).map(write).collect();
    (session, files)
}

fn command(session: &Session, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ltm-export"));
    let [sequence, files] = ["sequence", "files"].map(|name| session.text(name));
    command.args(["assemble", &sequence, "--photos", &files]);
    command.args(more);
    command
}

fn assemble(session: &Session, more: &[&str]) -> Output {
    command(session, more).output().unwrap()
}

/// The photograph of picture `i` in the capture.
fn captured(session: &Session, i: usize) -> Photo {
    let sequence = fs::read(session.path("sequence/sequence.json")).unwrap();
    let sequence: serde_json::Value = serde_json::from_slice(&sequence).unwrap();
    let name = sequence["pictures"][i]["photo"].as_str().unwrap();
    read_rgb16(&session.path("sequence").join(name))
}

/// Nothing but what `patterns` wrote is in the session's folder.
fn assert_untouched(session: &Session) {
    let entries = fs::read_dir(session.path("sequence")).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    for name in names {
        let written = ["display", "patterns", "player.html", "sequence.json"];
        assert!(written.contains(&name.as_str()), "{name} remains");
    }
}

fn refusal(output: &Output) -> String {
    // 65 where the photograph cannot be read.
    let is_failure = matches!(output.status.code(), Some(1 | 65));
    assert!(is_failure, "{}", stderr_text(output));
    stderr_text(output)
}

/// The sensor's codes under this light: 2 x 2 for each pixel.
fn sensor_codes(light: &[[f64; 3]]) -> Vec<u16> {
    let [width, height] = SIZE.map(|side| side as usize);
    let mut codes = vec![0; 4 * width * height];
    for (n, [red, green, blue]) in light.iter().enumerate() {
        let (x, y) = (n % width, n / width);
        for (i, share) in [red, green, green, blue].into_iter().enumerate() {
            let range = f64::from(SENSOR_WHITE - 1024);
            let code = f64::from(SENSOR_BLACK[i]) + share * range + [0.0, 0.0, 2.0, 0.0][i];
            codes[(2 * y + i / 2) * 2 * width + 2 * x + i % 2] = code.round() as u16;
        }
    }
    // The first pixel is saturated, the second dark, the third darker than black.
    for (x, code) in [(0, 16_383), (2, 0), (4, 0)] {
        for i in 0..4 {
            let place = (i / 2) * 2 * width + x + i % 2;
            codes[place] = match x {
                0 => code,
                2 => SENSOR_BLACK[i],
                _ => SENSOR_BLACK[i] - 100,
            };
        }
    }
    codes
}

fn dng(light: &[[f64; 3]]) -> Vec<u8> {
    let size = SIZE.map(|side| 2 * side);
    bayer_dng(
        size,
        &sensor_codes(light),
        SENSOR_BLACK,
        SENSOR_WHITE.into(),
    )
}

#[test]
fn raw_files_become_linear_measurements() {
    ensure_dcraw_emu();
    let (session, _) = session_of(|_, light| ("dng", dng(light)));
    let output = assemble(&session, &[]);
    assert!(output.status.success(), "{}", stderr_text(&output));
    let camera = &session.manifest()["camera"];
    assert_eq!(
        (&camera["black"], &camera["white"]),
        (&0.0.into(), &65_000.0.into())
    );
    assert_eq!(camera["width"], SIZE[0]);
    for i in [0, 1, 2, 14, 40] {
        let codes = sensor_codes(&light(&read_rgb16(&session.photo(i))));
        let range = f64::from(SENSOR_WHITE - 1024);
        let share = |x: u32, y: u32| {
            let place = (y * 2 * SIZE[0] + x) as usize;
            let black = SENSOR_BLACK[(y % 2 * 2 + x % 2) as usize];
            (f64::from(codes[place]) - f64::from(black)).max(0.0) / range
        };
        let photo = captured(&session, i);
        for (x, y, pixel) in photo.enumerate_pixels() {
            let (u, v) = (2 * x, 2 * y);
            let green = (share(u + 1, v) + share(u, v + 1)) / 2.0;
            for (c, expected) in [share(u, v), green, share(u + 1, v + 1)]
                .into_iter()
                .enumerate()
            {
                if expected * 65_535.0 > 64_999.0 {
                    continue;
                }
                let found = f64::from(pixel[c]) / 65_535.0;
                // The converter rounds down, twice for green.
                let apart = (found - expected).abs();
                assert!(
                    apart <= 0.002 * expected + 2.0 / 65_535.0,
                    "{i}: {x} {y} {c}"
                );
            }
        }
        assert_eq!(photo.get_pixel(0, 0).0, [u16::MAX; 3]);
        assert_eq!(photo.get_pixel(1, 0).0, [0; 3]);
        assert_eq!(photo.get_pixel(2, 0).0, [0; 3]);
    }
}

/// The RGB of the DNG files' sensor of each primary of sRGB, as columns.
fn dng_primaries() -> [[f64; 3]; 3] {
    // To CIE XYZ (IEC 61966-2-1).
    const SRGB_TO_XYZ: [[f64; 3]; 3] = [
        [0.412_456_4, 0.357_576_1, 0.180_437_5],
        [0.212_672_9, 0.715_152_2, 0.072_175],
        [0.019_333_9, 0.119_192, 0.950_304_1],
    ];
    DNG_XYZ_TO_CAMERA.map(|row| {
        let product = |c: usize| (0..3).map(|k| row[k] * SRGB_TO_XYZ[k][c]).sum();
        std::array::from_fn(product)
    })
}

/// The sensor of the DNG files mixes the light of the display's primaries, which the object dims, more than its tag says.
#[test]
fn the_colours_of_a_camera_become_those_of_the_display_when_the_picture_is_shown() {
    ensure_dcraw_emu();
    let crosstalk = [[0.9, 0.06, 0.04], [0.05, 0.9, 0.05], [0.04, 0.06, 0.9]];
    let primaries = dng_primaries().map(|row| -> [f64; 3] {
        let product = |c: usize| (0..3).map(|k| row[k] * crosstalk[k][c]).sum();
        std::array::from_fn(product)
    });
    let brightest = calibrate::white_of(&primaries)
        .into_iter()
        .fold(0.0, f64::max);
    let mixed = |[r, g, b]: [f64; 3]| {
        primaries.map(|row| ((row[0] * r + row[1] * g + row[2] * b) / brightest).max(0.0))
    };
    let (session, _) = session_of(|_, light| {
        let light: Vec<[f64; 3]> = light.iter().map(|light| mixed(*light)).collect();
        ("dng", dng(&light))
    });
    let output = assemble(&session, &[]);
    assert!(output.status.success(), "{}", stderr_text(&output));
    assert!(
        !stderr_text(&output).contains("colours"),
        "{}",
        stderr_text(&output)
    );
    let found = &session.manifest()["camera"]["color_matrix"];
    let found: [[f64; 3]; 3] = serde_json::from_value(found.clone()).unwrap();
    let expected = calibrate::color_matrix(&primaries).unwrap();
    for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
        assert!((found - expected).abs() < 0.03, "{found} {expected}");
    }
    let [sequence, file] = ["sequence", "file.ltm"].map(|name| session.text(name));
    succeed(&[
        "recover",
        &sequence,
        "-o",
        &file,
        "--window",
        "9",
        "--patterns",
        "40",
        "--lossless",
    ]);
    let inspected = succeed(&["inspect", &file, "--json"]).stdout;
    let inspected: serde_json::Value = serde_json::from_slice(&inspected).unwrap();
    let kept: [[f64; 3]; 3] =
        serde_json::from_value(inspected["metadata"]["color_matrix"].clone()).unwrap();
    assert_eq!(kept, found);
    let relit = session.path("relit.png");
    let relight = ["relight", &file, "--light", "flood", "-o"];
    succeed(&[&relight[..], &[relit.to_str().unwrap()]].concat());
    let relit = image::open(relit).unwrap().into_rgb8();
    let flood = light(&read_rgb16(&session.photo(1)));
    // On average: recovery and noise make pixels differ.
    for c in 0..3 {
        let shown = relit
            .pixels()
            .map(|pixel| srgb_decode(f64::from(pixel.0[c]) / 255.0));
        let (shown, lit): (f64, f64) = (shown.sum(), flood.iter().map(|light| light[c]).sum());
        assert!((shown / lit - 1.0).abs() < 0.05, "{c}: {}", shown / lit);
    }
}

#[test]
fn raw_files_that_cannot_be_converted_are_named_with_the_remedy() {
    ensure_dcraw_emu();
    let (session, files) = session_of(|_, light| ("dng", dng(light)));
    let empty = session.path("empty");
    fs::create_dir(&empty).unwrap();
    let mut without_program = command(&session, &[]);
    let message = refusal(&without_program.env("PATH", &empty).output().unwrap());
    for part in [
        "files/IMG_00",
        "dcraw_emu",
        "apt-get install libraw-bin",
        "brew install libraw",
    ] {
        assert!(message.contains(part), "no {part}: {message}");
    }
    assert_untouched(&session);
    for (option, value, part) in [
        ("--black", "512", "leave --black out"),
        ("--response", "srgb", "leave --response out"),
    ] {
        let message = refusal(&assemble(&session, &[option, value]));
        assert!(message.contains(part), "{message}");
    }
    // A transfer that ended early.
    let whole = fs::read(&files[5]).unwrap();
    fs::write(&files[5], &whole[..whole.len() - 5000]).unwrap();
    let message = refusal(&assemble(&session, &[]));
    assert!(
        message.contains("IMG_0005.dng: dcraw_emu cannot convert it: "),
        "{message}"
    );
    fs::write(&files[5], "text").unwrap();
    let message = refusal(&assemble(&session, &[]));
    assert!(message.contains("IMG_0005.dng: dcraw_emu"), "{message}");
    assert_untouched(&session);
}

/// Samples of floating-point photographs, as multiples of this white.
const FLOAT_WHITE: f64 = 4.0;

/// A photograph in one of the types of floating-point numbers.
fn float_photo(i: usize, light: &[[f64; 3]]) -> (&'static str, Vec<u8>) {
    let numbers = light.as_flattened().iter().map(|share| share * FLOAT_WHITE);
    let samples = |bits| RgbSamples::Floats { bits };
    match i % 5 {
        0 => {
            let bytes: Vec<u8> = numbers
                .flat_map(|n| f16::from_f64(n).to_le_bytes())
                .collect();
            ("tif", rgb_tiff(SIZE, samples(16), &bytes))
        }
        1 => {
            let bytes: Vec<u8> = numbers.flat_map(|n| (n as f32).to_le_bytes()).collect();
            ("tif", rgb_tiff(SIZE, samples(32), &bytes))
        }
        2 => {
            let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
            ("tif", rgb_tiff(SIZE, samples(64), &bytes))
        }
        n => ("exr", openexr(light, n == 3)),
    }
}

fn openexr(light: &[[f64; 3]], is_half: bool) -> Vec<u8> {
    use exr::prelude::*;
    let folder = tempfile::TempDir::new().unwrap();
    let path = folder.path().join("photo.exr");
    let [width, height] = SIZE.map(|side| side as usize);
    let pixel = |x: usize, y: usize| light[y * width + x].map(|share| (share * FLOAT_WHITE) as f32);
    match is_half {
        true => write_rgb_file(&path, width, height, |x, y| {
            let [r, g, b] = pixel(x, y).map(f16::from_f32);
            (r, g, b)
        }),
        false => write_rgb_file(&path, width, height, |x, y| {
            let [r, g, b] = pixel(x, y);
            (r, g, b)
        }),
    }
    .unwrap();
    fs::read(path).unwrap()
}

#[test]
fn floating_point_photographs_keep_their_noise_below_black() {
    let (session, files) = session_of(float_photo);
    for (i, name) in [
        (1, "IMG_0001.tif: cannot be decoded as TIFF"),
        (3, "IMG_0003.exr: cannot be decoded as OpenEXR"),
    ] {
        let content = fs::read(&files[i]).unwrap();
        fs::write(&files[i], &content[..content.len() / 2]).unwrap();
        let message = refusal(&assemble(&session, &[]));
        assert!(
            message.contains(&format!("{name}: it is cut off or damaged; copy")),
            "{message}"
        );
        assert_untouched(&session);
        fs::write(&files[i], content).unwrap();
    }
    let output = assemble(&session, &["--white", "4"]);
    assert!(output.status.success(), "{}", stderr_text(&output));
    assert!(
        !stderr_text(&output).contains("warning"),
        "{}",
        stderr_text(&output)
    );
    let camera = &session.manifest()["camera"];
    let [black, white] = ["black", "white"].map(|level| camera[level].as_f64().unwrap());
    let mut below_black = 0;
    for i in 0..10 {
        let expected = light(&read_rgb16(&session.photo(i)));
        let photo = captured(&session, i);
        for (pixel, expected) in photo.pixels().zip(&expected) {
            for c in 0..3 {
                let found = (f64::from(pixel[c]) - black) / (white - black);
                // Half precision has 11 bits.
                let tolerance = expected[c].abs() / 2048.0 + 1.0 / 65_535.0;
                assert!(
                    (found - expected[c]).abs() <= tolerance,
                    "{i}: {found} {expected:?}"
                );
                below_black += usize::from(found < 0.0);
            }
        }
    }
    assert!(below_black > 100, "{below_black}");
}

#[test]
fn samples_that_are_not_numbers_are_refused_and_infinite_ones_saturated() {
    let tiff = |light: &[[f64; 3]]| {
        let numbers = light.as_flattened().iter();
        let bytes: Vec<u8> = numbers.flat_map(|n| (*n as f32).to_le_bytes()).collect();
        rgb_tiff(SIZE, RgbSamples::Floats { bits: 32 }, &bytes)
    };
    let (session, files) = session_of(|i, light| {
        let mut light = light.to_vec();
        if i == 6 {
            light[3][1] = f64::INFINITY;
        }
        ("tif", tiff(&light))
    });
    let output = assemble(&session, &[]);
    assert!(output.status.success(), "{}", stderr_text(&output));
    let photo = captured(&session, 6);
    assert_eq!(photo.get_pixel(3, 0)[1], u16::MAX);
    for name in ["photos", "graycode"] {
        fs::remove_dir_all(session.path("sequence").join(name)).unwrap();
    }
    fs::remove_file(session.path("sequence/capture.json")).unwrap();
    let mut light = light(&read_rgb16(&session.photo(8)));
    light[48 + 2][0] = f64::NAN;
    fs::write(&files[8], tiff(&light)).unwrap();
    let message = refusal(&assemble(&session, &[]));
    assert!(
        message.contains("IMG_0008.tif: has a sample at (2, 1) that is not a number"),
        "{message}"
    );
    // Black is far too high.
    let forced = refusal(&assemble(&session, &["--black", "2"]));
    assert!(forced.contains("--white above it"), "{forced}");
    assert_untouched(&session);
}

#[test]
fn integers_of_32_bits_are_codes_with_fractions() {
    let (session, _) = session_of(|_, light| {
        let code = |share: &f64| (BLACK + share * (WHITE - BLACK)) * 65_537.0;
        let numbers = light.as_flattened().iter().map(code);
        let bytes: Vec<u8> = numbers.flat_map(|n| (n as u32).to_le_bytes()).collect();
        (
            "tif",
            rgb_tiff(SIZE, RgbSamples::Integers { bits: 32 }, &bytes),
        )
    });
    let output = assemble(&session, &["--black", "512", "--white", "60000"]);
    assert!(output.status.success(), "{}", stderr_text(&output));
    for i in [0, 1, 30] {
        assert_eq!(captured(&session, i), read_rgb16(&session.photo(i)));
    }
}
