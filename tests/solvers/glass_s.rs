//! The capture `glass-s`, embedded in the test program: browsers have no folders.

use std::io::Cursor;

use half::f16;
use png::{BitDepth, ColorType};
use relightable_photo::capture::{
    CameraPixelSet, LinearPhoto, Manifest, Measurements, NoiseModel, Pattern,
};
use relightable_photo::transport::{CHANNELS, Window};

/// Bytes of a file of the capture.
macro_rules! file {
    ($($name:expr),+) => {
        include_bytes!(concat!("../fixtures/glass-s/", $($name),+)).as_slice()
    };
}

/// Pattern and photograph of each shot.
macro_rules! shots {
    ($($name:literal)+) => {
        [$((file!("patterns/", $name, ".png"), file!("photos/", $name, ".png"))),+]
    };
}

const SHOTS: [(&[u8], &[u8]); 60] = shots![
    "0000" "0001" "0002" "0003" "0004" "0005" "0006" "0007" "0008" "0009"
    "0010" "0011" "0012" "0013" "0014" "0015" "0016" "0017" "0018" "0019"
    "0020" "0021" "0022" "0023" "0024" "0025" "0026" "0027" "0028" "0029"
    "0030" "0031" "0032" "0033" "0034" "0035" "0036" "0037" "0038" "0039"
    "0040" "0041" "0042" "0043" "0044" "0045" "0046" "0047" "0048" "0049"
    "0050" "0051" "0052" "0053" "0054" "0055" "0056" "0057" "0058" "0059"
];

/// The measurements: every shot, linear, less the dark frame.
pub fn measurements() -> Measurements {
    let json = std::str::from_utf8(file!("capture.json")).unwrap();
    let manifest = Manifest::parse(json, "capture.json".as_ref()).unwrap();
    let (emission, camera) = (manifest.light.emission(), &manifest.camera);
    let dark: LinearPhoto = codes16(file!("photos/dark.png"))
        .into_iter()
        .map(|codes| codes.map(|code| camera.linear(code, 1.0)))
        .collect();
    let picture = |png: &[u8]| -> LinearPhoto {
        let codes = codes16(png);
        assert!(
            codes
                .iter()
                .flatten()
                .all(|&code| f64::from(code) < camera.white)
        );
        let lit = codes.into_iter().zip(&dark);
        lit.map(|(codes, dark)| std::array::from_fn(|c| camera.linear(codes[c], 1.0) - dark[c]))
            .collect()
    };
    let pattern = |png: &[u8]| {
        let codes = read(png, ColorType::Grayscale, BitDepth::Eight).into_iter();
        Pattern::Grey(
            codes
                .map(|code| emission[usize::from(code)] as f32)
                .collect(),
        )
    };
    let code = 1.0 / (camera.white - camera.black);
    let mut measurements = Measurements {
        camera: camera.extent(),
        light: manifest.light.extent(),
        correspondence: manifest.correspondence.unwrap(),
        patterns: SHOTS.iter().map(|(png, _)| pattern(png)).collect(),
        full_scale: vec![1.0; SHOTS.len()],
        loaded: CameraPixelSet::all(camera.extent()),
        photos: SHOTS.iter().map(|(_, png)| picture(png)).collect(),
        flood: None,
        noise: NoiseModel::from_dark(&dark, camera.width, code),
    };
    measurements.noise = NoiseModel::with_gain_from(&measurements);
    measurements
}

fn codes16(png: &[u8]) -> Vec<[u16; CHANNELS]> {
    let bytes = read(png, ColorType::Rgb, BitDepth::Sixteen);
    let codes: Vec<u16> = bytes
        .as_chunks()
        .0
        .iter()
        .map(|&code| u16::from_be_bytes(code))
        .collect();
    codes.as_chunks().0.to_vec()
}

/// The samples of a picture, as bytes.
fn read(png: &[u8], colour: ColorType, depth: BitDepth) -> Vec<u8> {
    let mut reader = png::Decoder::new(Cursor::new(png)).read_info().unwrap();
    assert_eq!(reader.output_color_type(), (colour, depth));
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    bytes
}

/// The window that [`true_functions`] are given on.
pub fn true_window() -> Window {
    Window::new(13).unwrap()
}

/// The true light transport functions, `[pixel, slot]`.
pub fn true_functions() -> Vec<[f64; CHANNELS]> {
    // NumPy's format 1.0: magic, length of the header, header, values.
    let npy = file!("truth/tau.npy");
    let header = usize::from(u16::from_le_bytes([npy[8], npy[9]]));
    let (header, values) = npy[10..].split_at(header);
    let header = std::str::from_utf8(header).unwrap();
    let expected = "'descr': '<f2', 'fortran_order': False, 'shape': (4096, 13, 13, 3)";
    assert!(header.contains(expected), "{header}");
    let values: Vec<f64> = values
        .as_chunks()
        .0
        .iter()
        .map(|&bytes| f16::from_le_bytes(bytes).to_f64())
        .collect();
    values.as_chunks().0.to_vec()
}
