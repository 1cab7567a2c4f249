//! Large captures, made of small ones faster than a simulation computes them.

use std::fs;
use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageBuffer, ImageEncoder, Rgb};
use serde_json::{Value, json};

type Photograph = ImageBuffer<Rgb<u16>, Vec<u16>>;

/// How photographs are enlarged: by linear interpolation, with the noise of 40,000 electrons at white.
#[derive(Clone, Copy)]
pub struct Enlargement {
    /// Camera pixels along a side of an enlarged one.
    pub factor: u32,
    /// Largest shift of the photographs of patterns along each axis, in enlarged pixels.
    pub trembling: f32,
    /// Codes above this one become it.
    pub max_code: u16,
}

impl Enlargement {
    pub fn by(factor: u32) -> Self {
        Self {
            factor,
            trembling: 0.0,
            max_code: u16::MAX,
        }
    }
}

/// Enlarges all photographs of the capture `small`.
pub fn enlarge_capture(small: &Path, large: &Path, enlargement: Enlargement) {
    for name in ["patterns", "photos", "graycode"] {
        fs::create_dir_all(large.join(name)).unwrap();
    }
    let json = fs::read(small.join("capture.json")).unwrap();
    let mut manifest: Value = serde_json::from_slice(&json).unwrap();
    let still = Enlargement {
        trembling: 0.0,
        ..enlargement
    };
    let name = |value: &Value| value.as_str().unwrap().to_owned();
    let mut names = vec![
        (name(&manifest["dark"]), still),
        (name(&manifest["flood"]), still),
    ];
    for (key, enlargement) in [("shots", enlargement), ("graycode", still)] {
        let listed = manifest[key].as_array().unwrap().iter();
        names.extend(listed.map(|shot| (name(&shot["photo"]), enlargement)));
    }
    for shot in manifest["shots"].as_array().unwrap() {
        let name = shot["pattern"].as_str().unwrap();
        fs::copy(small.join(name), large.join(name)).unwrap();
    }
    let threads = std::thread::available_parallelism().unwrap().get();
    std::thread::scope(|scope| {
        for thread in 0..threads {
            let own = names.iter().enumerate().skip(thread).step_by(threads);
            scope.spawn(move || {
                own.for_each(|(i, (name, enlargement))| {
                    enlarge(&small.join(name), &large.join(name), i as u64, *enlargement)
                });
            });
        }
    });
    for side in ["width", "height"] {
        let pixels = manifest["camera"][side].as_u64().unwrap();
        manifest["camera"][side] = json!(pixels * u64::from(enlargement.factor));
    }
    for row in 0..2 {
        for column in 0..2 {
            let value = &mut manifest["correspondence"]["affine"][row][column];
            *value = json!(value.as_f64().unwrap() / f64::from(enlargement.factor));
        }
    }
    fs::write(large.join("capture.json"), manifest.to_string()).unwrap();
}

fn enlarge(from: &Path, to: &Path, seed: u64, enlargement: Enlargement) {
    let Enlargement {
        factor,
        trembling,
        max_code,
    } = enlargement;
    let small: Photograph = image::open(from).unwrap().to_rgb16();
    let mut random = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random
    };
    let shift = [(); 2].map(|()| trembling * ((next() >> 32) as f32 / 2f32.powi(31) - 1.0));
    let place = |x: u32, side: u32, shift: f32| {
        let at = (x as f32 + 0.5 + shift) / factor as f32 - 0.5;
        let at = at.clamp(0.0, (side - 1) as f32);
        let first = (at as u32).min(side - 2);
        (first as usize, at - first as f32)
    };
    let (width, height) = small.dimensions();
    let columns: Vec<_> = (0..width * factor)
        .map(|x| place(x, width, shift[0]))
        .collect();
    let codes = small.as_raw();
    let mut bytes: Vec<u8> = Vec::with_capacity(6 * (width * height * factor.pow(2)) as usize);
    for (top, down) in (0..height * factor).map(|y| place(y, height, shift[1])) {
        for &(left, right) in &columns {
            for c in 0..3 {
                let code = |x: usize, y: usize| f32::from(codes[(y * width as usize + x) * 3 + c]);
                let row = |y: usize| code(left, y) + right * (code(left + 1, y) - code(left, y));
                let value = row(top) + down * (row(top + 1) - row(top));
                // Four uniform numbers are nearly normal together, of variance 1/3.
                let random = next();
                let parts = [0, 16, 32, 48].map(|shift| (random >> shift & 0xFFFF) as f32);
                let normal = (parts.iter().sum::<f32>() / 65_536.0 - 2.0) * 3f32.sqrt();
                let light = ((value - 512.0) / 59_488.0).max(0.0);
                let deviation = 59_488.0 * (light / 40_000.0 + 4e-8).sqrt();
                let code = (value + deviation * normal).round().max(0.0) as u16;
                bytes.extend(code.min(max_code).to_ne_bytes());
            }
        }
    }
    let sides = [width * factor, height * factor];
    write_png(to, &bytes, sides, ExtendedColorType::Rgb16);
}

/// Repeats all photographs and patterns of the capture `small` from left to right, `count` times. It has no Gray code.
pub fn repeat_capture(small: &Path, wide: &Path, count: u32) {
    let json = fs::read(small.join("capture.json")).unwrap();
    let mut manifest: Value = serde_json::from_slice(&json).unwrap();
    manifest.as_object_mut().unwrap().remove("graycode");
    let shots = manifest["shots"].as_array().unwrap();
    let patterns = shots
        .iter()
        .flat_map(|shot| [&shot["photo"], &shot["pattern"]]);
    for name in patterns.chain([&manifest["dark"], &manifest["flood"]]) {
        let name = name.as_str().unwrap();
        fs::create_dir_all(wide.join(name).parent().unwrap()).unwrap();
        repeat(&small.join(name), &wide.join(name), count);
    }
    for grid in ["camera", "light"] {
        let width = manifest[grid]["width"].as_u64().unwrap();
        manifest[grid]["width"] = json!(width * u64::from(count));
    }
    fs::write(wide.join("capture.json"), manifest.to_string()).unwrap();
}

fn repeat(from: &Path, to: &Path, count: u32) {
    let small = image::open(from).unwrap();
    let (width, height) = (small.width() * count, small.height());
    let bytes = small.as_bytes();
    let rows = bytes
        .chunks_exact(bytes.len() / height as usize)
        .map(|row| row.repeat(count as usize));
    let bytes = rows.collect::<Vec<_>>().concat();
    write_png(to, &bytes, [width, height], small.color().into());
}

fn write_png(path: &Path, bytes: &[u8], [width, height]: [u32; 2], color: ExtendedColorType) {
    let file = std::io::BufWriter::new(fs::File::create(path).unwrap());
    PngEncoder::new_with_quality(file, CompressionType::Fast, FilterType::Sub)
        .write_image(bytes, width, height, color)
        .unwrap();
}
