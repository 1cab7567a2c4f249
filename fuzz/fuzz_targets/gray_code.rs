//! Photographs of Gray code give a map of finite numbers, or an error.
#![no_main]

use std::cell::RefCell;
use std::convert::Infallible;

use fuzzing::choices::Choices;
use libfuzzer_sys::fuzz_target;
use relightable_photo::calibrate::{GrayCodePhotos, LightPlaneAxis};
use relightable_photo::transport::Extent;

/// Sides of the camera grid: at least 100 pixels have to be decoded.
const MAX_SIDE: u8 = 24;

fuzz_target!(|data: &[u8]| {
    let mut choices = Choices(data);
    let mut side = || 1 + u32::from(choices.below(MAX_SIDE));
    let camera = Extent::new(side(), side());
    let light = Extent::new(
        1 + u32::from(choices.u16()),
        1 + u32::from(choices.below(64)),
    );
    let rows: Vec<u32> = (0..camera.height).filter(|_| !choices.rarely()).collect();
    let slopes: [u8; 4] = choices.bytes();
    let choices = RefCell::new(choices);
    let read = |axis, bit, inverted| {
        let mut photo = stripes(camera, &rows, slopes, axis, bit, inverted);
        disturb(&mut photo, &mut choices.borrow_mut());
        Ok::<_, Infallible>(photo)
    };
    let Ok(gray_code) = GrayCodePhotos::collect(light, rows.clone(), read);
    if let Ok(fit) = gray_code.fit(camera) {
        let numbers = fit.correspondence.to_numbers();
        assert!(numbers.iter().all(|x| x.is_finite()), "{fit:?}");
    }
    for bit in gray_code.x.iter().chain(&gray_code.y) {
        let contrast = bit.best_contrast();
        assert!(
            contrast.is_none_or(|contrast| !contrast.is_nan()),
            "{contrast:?}"
        );
    }
});

/// A bit of the Gray code, seen through an affine map of these slopes.
fn stripes(
    camera: Extent,
    rows: &[u32],
    slopes: [u8; 4],
    axis: LightPlaneAxis,
    bit: u32,
    inverted: bool,
) -> Vec<[f32; 3]> {
    let [along_x, along_y] = match axis {
        LightPlaneAxis::X => [slopes[0], slopes[1]],
        LightPlaneAxis::Y => [slopes[2], slopes[3]],
    };
    let pixels = rows
        .iter()
        .flat_map(|y| (0..camera.width).map(move |x| (x, *y)));
    let brightness = |(x, y): (u32, u32)| {
        let element = (u32::from(along_x) * x + u32::from(along_y) * y) / 64;
        let is_lit = ((element ^ element >> 1) >> bit) & 1 == 1;
        [if is_lit != inverted { 0.9 } else { 0.1 }; 3]
    };
    pixels.map(brightness).collect()
}

/// Replaces some samples by measurements of any 16-bit code: a little below black to saturation.
fn disturb(photo: &mut [[f32; 3]], choices: &mut Choices) {
    let sample = |byte: u8| match byte {
        u8::MAX => f32::NAN,
        byte => (f32::from(byte) - 8.0) / 240.0,
    };
    if choices.is_empty() || !choices.chance(128) {
        return;
    }
    let bytes = choices.fill(photo.len());
    let keeps = choices.byte();
    for (pixel, byte) in photo.iter_mut().zip(bytes) {
        if byte > keeps {
            *pixel = [sample(byte), 0.5, sample(byte.wrapping_mul(7))];
        }
    }
}
