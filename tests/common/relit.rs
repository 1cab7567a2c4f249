//! What tests of relighting share: transports, lights, and the standard that pictures are held to.

use relightable_photo::relight::{BuiltinLight, Light, Rgba8Picture};
use relightable_photo::transport::{DirectTile, Extent, Geometry, Transport, TransportFunctions};

use super::Noise;

/// Light transport functions with a peak in the window's middle and a rough tail, brighter to the
/// right and below, so that a mirrored or shifted picture cannot pass for the right one. They are
/// not zero off the display, so that whatever is wrongly seen there shows.
pub fn asymmetric_transport(geometry: Geometry, seed: u64) -> Transport {
    let mut noise = Noise(seed);
    let (side, area) = (geometry.window.side() as i32, geometry.window.area());
    let tiles = geometry.tiles().map(|rect| {
        let mut functions = TransportFunctions::zeros(rect, area);
        for (pixel, tau) in rect.pixels().zip(functions.tau.chunks_exact_mut(area)) {
            let across = (pixel.x as f32 + 1.0) / geometry.camera.width as f32;
            let down = (pixel.y as f32 + 1.0) / geometry.camera.height as f32;
            let gain = [0.3 + 0.7 * across, 0.3 + 0.7 * down, 1.2 - across * down];
            for (s, tau) in tau.iter_mut().enumerate() {
                let (u, v) = (s as i32 % side - side / 2, s as i32 / side - side / 2);
                let peak = 0.5 / (1.0 + (u * u + v * v) as f32);
                *tau = gain.map(|g| g * peak * (0.2 + 0.8 * noise.next() as f32));
            }
        }
        DirectTile::quantise(&functions)
    });
    Transport {
        geometry,
        tiles: tiles.collect(),
    }
}

/// All built-in lights, and one brighter than any of them with a colour of its own at each element.
pub fn lights(extent: Extent) -> Vec<(&'static str, Light)> {
    let mut lights: Vec<_> = BuiltinLight::ALL
        .map(|light| (light.name(), light.render(extent)))
        .into();
    let mut noise = Noise(7);
    let values: Vec<f32> = (0..3 * extent.area())
        .map(|_| 3.0 * noise.next() as f32)
        .collect();
    let random = Light::from_linear_rgb(extent, &values).unwrap();
    lights.push(("random", random));
    lights
}

/// Fails unless every channel of every pixel is within one code of the reference.
pub fn assert_within_one_code(got: &Rgba8Picture, reference: &Rgba8Picture, what: &str) {
    assert_eq!(got.extent, reference.extent, "{what}");
    let width = reference.extent.width as usize;
    for (i, (got, want)) in got.pixels.iter().zip(&reference.pixels).enumerate() {
        let off = (0..4).map(|c| got[c].abs_diff(want[c])).max();
        assert!(
            off <= Some(1) && got[3] == 255,
            "{what}: pixel ({}, {}) is {got:?}, not {want:?}",
            i % width,
            i / width
        );
    }
}
