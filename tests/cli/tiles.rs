//! Static tiles of a relit picture, as Deep Zoom and IIIF viewers ask for them.

use std::fs;
use std::path::Path;

use image::{Rgb, RgbImage, imageops};
use serde_json::Value;
use tempfile::TempDir;

use crate::commands::{error_message, run, small_ltm, text};

const LIGHT: [&str; 4] = ["--light", "flood", "--exposure", "8"];

/// A file of 523 x 41 pixels.
fn fixture() -> String {
    format!(
        "{}/tests/fixtures/format/levels.ltm",
        env!("CARGO_MANIFEST_DIR")
    )
}

fn write_tiles(file: &str, folder: &Path, args: &[&str]) -> String {
    let start = ["tiles", file, "-o", text(folder)];
    let output = run(&[&start, &LIGHT[..], args].concat());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    String::from_utf8(output.stdout).unwrap()
}

fn relit(file: &str, folder: &Path) -> RgbImage {
    let out = folder.join("relit.png");
    assert!(
        run(&[&["relight", file, "-o", text(&out)], &LIGHT[..]].concat())
            .status
            .success()
    );
    image::open(out).unwrap().to_rgb8()
}

/// The tile at a path, which is a JPEG of this size.
fn tile(path: &Path, size: (u32, u32)) -> RgbImage {
    let tile = image::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    assert_eq!((tile.width(), tile.height()), size, "{}", path.display());
    tile.to_rgb8()
}

/// The mean difference of codes.
fn difference(a: &RgbImage, b: &RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let sum: u64 = a
        .iter()
        .zip(b.iter())
        .map(|(a, b)| u64::from(a.abs_diff(*b)))
        .sum();
    sum as f64 / a.len() as f64
}

/// Half the rows and columns, by the mean of light.
fn halved(picture: &RgbImage) -> RgbImage {
    let (width, height) = picture.dimensions();
    let light = |code: u8| match f64::from(code) / 255.0 {
        code if code <= 0.04045 => code / 12.92,
        code => ((code + 0.055) / 1.055).powf(2.4),
    };
    let code = |light: f64| match light {
        light if light <= 0.003_130_8 => 12.92 * light,
        light => 1.055 * light.powf(1.0 / 2.4) - 0.055,
    };
    RgbImage::from_fn(width.div_ceil(2), height.div_ceil(2), |x, y| {
        let xs = 2 * x..(2 * x + 2).min(width);
        let cells = (2 * y..(2 * y + 2).min(height)).flat_map(|y| xs.clone().map(move |x| (x, y)));
        let pixels: Vec<[f64; 3]> = cells
            .map(|(x, y)| picture.get_pixel(x, y).0.map(light))
            .collect();
        let mean = |c: usize| pixels.iter().map(|p| p[c]).sum::<f64>() / pixels.len() as f64;
        Rgb([0, 1, 2].map(|c| (255.0 * code(mean(c))).round() as u8))
    })
}

#[test]
fn deep_zoom_has_every_size_down_to_a_pixel() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("tiles");
    let shown = write_tiles(&fixture(), &out, &["--quality", "98"]);
    assert!(shown.contains("12 tiles"), "{shown}");
    let description = fs::read_to_string(out.join("picture.dzi")).unwrap();
    for field in [
        "TileSize=\"512\"",
        "Overlap=\"0\"",
        "Width=\"523\"",
        "Height=\"41\"",
    ] {
        assert!(description.contains(field), "{description}");
    }
    let mut expected = relit(&fixture(), folder.path());
    let level = |level: u32| out.join(format!("picture_files/{level}"));
    let [left, right] = [(0, 512), (1, 11)]
        .map(|(column, width)| tile(&level(10).join(format!("{column}_0.jpg")), (width, 41)));
    for (x, tile) in [(0, left), (512, right)] {
        let part = imageops::crop_imm(&expected, x, 0, tile.width(), 41).to_image();
        assert!(difference(&tile, &part) < 2.0);
    }
    for number in (0..10).rev() {
        expected = halved(&expected);
        let tile = tile(&level(number).join("0_0.jpg"), expected.dimensions());
        let difference = difference(&tile, &expected);
        assert!(difference < 2.0, "level {number}: {difference}");
    }
    assert_eq!(expected.dimensions(), (1, 1));
    assert!(!level(11).exists());
}

#[test]
fn iiif_has_the_tiles_that_its_description_promises() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("tiles");
    let id = "https://museum.example/iiif/window";
    write_tiles(
        &fixture(),
        &out,
        &["--format", "iiif", "--id", &format!("{id}/")],
    );
    let info: Value = serde_json::from_slice(&fs::read(out.join("info.json")).unwrap()).unwrap();
    assert_eq!(info["id"], id);
    assert_eq!(info["profile"], "level0");
    let number = |value: &Value| value.as_u64().unwrap() as u32;
    let (width, height, side) = (
        number(&info["width"]),
        number(&info["height"]),
        number(&info["tiles"][0]["width"]),
    );
    let mut count = 0;
    // As the specification's implementation notes compute them.
    for factor in info["tiles"][0]["scaleFactors"].as_array().unwrap() {
        let factor = number(factor);
        for x in (0..width).step_by((side * factor) as usize) {
            for y in (0..height).step_by((side * factor) as usize) {
                let (w, h) = (
                    (side * factor).min(width - x),
                    (side * factor).min(height - y),
                );
                let size = (w.div_ceil(factor), h.div_ceil(factor));
                let region = match (w, h) == (width, height) {
                    true => "full".to_owned(),
                    false => format!("{x},{y},{w},{h}"),
                };
                tile(
                    &out.join(format!("{region}/{},{}/0/default.jpg", size.0, size.1)),
                    size,
                );
                count += 1;
            }
        }
    }
    assert_eq!(count, 3);
    let size = &info["sizes"][0];
    assert_eq!((number(&size["width"]), number(&size["height"])), (262, 21));

    // A picture that is one tile.
    let out = folder.path().join("small");
    let small = small_ltm(folder.path());
    write_tiles(text(&small), &out, &["--format", "iiif", "--id", id]);
    tile(&out.join("full/max/0/default.jpg"), (64, 64));
}

#[test]
fn folders_in_use_and_wrong_options_are_refused() {
    let folder = TempDir::new().unwrap();
    let start = ["tiles", &fixture(), "--light", "flood", "-o"];
    fs::write(folder.path().join("a"), "").unwrap();
    let message = error_message(&[&start[..], &[text(folder.path())]].concat());
    assert!(message.contains("not empty"), "{message}");
    let out = folder.path().join("x");
    for wrong in [
        &["--format", "iiif"][..],
        &["--id", "https://a.example"],
        &["--format", "iiif", "--id", "https://"],
        &["--format", "iiif", "--id", "https://a.example/info.json"],
        &["--time", "1"],
        &["--quality", "0"],
    ] {
        let output = run(&[&start[..], &[text(&out)], wrong].concat());
        assert_eq!(output.status.code(), Some(2), "{wrong:?}");
    }
    let message = error_message(&["tiles", "nowhere.ltm", "--light", "flood", "-o", text(&out)]);
    assert!(message.starts_with("error: nowhere.ltm"), "{message}");
    assert!(!out.exists());
}
