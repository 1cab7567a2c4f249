//! What tests of relighting share: transports, lights, and the standard that pictures are held to.

use relightable_photo::relight::{BuiltinLight, Display, Gamut, Light, Rgba8Picture, ToneCurve};
use relightable_photo::transport::{BandTile, Basis, Extent, Geometry, Tile, Transport};

use super::Noise;

/// What tiles of a transport hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Functions element by element.
    Direct,
    /// Coefficients over nine functions.
    Factored,
    /// Either, both, or nothing.
    Mixed,
}

/// Light transport functions with a peak in the window's middle and a rough tail, brighter to the
/// right and below, so that a mirrored or shifted picture cannot pass for the right one. They are
/// not zero off the display, so that whatever is wrongly seen there shows.
pub fn asymmetric_transport(geometry: Geometry, kind: Kind, seed: u64) -> Transport {
    const RANK: usize = 9;
    let mut noise = Noise(seed);
    let (side, area) = (geometry.window.side() as i32, geometry.window.area());
    let mut function = move || -> Vec<f32> {
        let values = (0..area as i32).map(|s| {
            let (u, v) = (s % side - side / 2, s / side - side / 2);
            0.5 / (1.0 + (u * u + v * v) as f32) * (0.2 + 0.8 * noise.next() as f32)
        });
        values.collect()
    };
    let basis = Basis {
        kernels: (0..RANK).map(|_| function()).collect(),
    };
    let mut noise = Noise(!seed);
    let tiles = geometry.tiles().enumerate().map(|(i, rect)| {
        let [direct, factored] = match kind {
            Kind::Direct => [true, false],
            Kind::Factored => [false, true],
            Kind::Mixed => [i % 3 < 2, i % 4 > 0],
        };
        let mut tile = BandTile::dark(rect);
        for pixel in rect.pixels() {
            let across = (pixel.x as f32 + 1.0) / geometry.camera.width as f32;
            let down = (pixel.y as f32 + 1.0) / geometry.camera.height as f32;
            let gain = [0.3 + 0.7 * across, 0.3 + 0.7 * down, 1.2 - across * down];
            if direct {
                let functions = function();
                tile.functions
                    .extend(functions.iter().map(|tau| gain.map(|g| g * tau)));
            }
            if factored {
                // Some are negative, in each pixel others.
                let coefficients = (0..RANK).map(|k| {
                    let size = (noise.next() as f32 - 0.3) / (1.0 + k as f32).sqrt();
                    gain.map(|g| g * size)
                });
                tile.coefficients.extend(coefficients);
            }
        }
        Tile::quantise(&tile, RANK)
    });
    Transport {
        tiles: tiles.collect(),
        basis,
        geometry,
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
    // One that fills a corner only, of one colour.
    let corner = (0..extent.area()).flat_map(|i| {
        let (u, v) = (i as u32 % extent.width, i as u32 / extent.width);
        let lit = u < extent.width.div_ceil(3) && v < extent.height.div_ceil(3);
        [0.2, 0.9, 0.4].map(|c| if lit { c * noise.next() as f32 } else { 0.0 })
    });
    let corner: Vec<f32> = corner.collect();
    lights.push(("corner", Light::from_linear_rgb(extent, &corner).unwrap()));
    lights
}

/// Displays of all kinds, the first of which adds nothing to the exposure.
pub fn displays(exposure: f32) -> [Display; 4] {
    let plain = Display::srgb(exposure);
    let gains = [1.3, 1.0, 0.6].map(|gain| gain * exposure);
    let (gamut, curve) = (Gamut::DisplayP3, ToneCurve::Filmic);
    [
        plain,
        Display {
            gains,
            dither: true,
            ..plain
        },
        Display {
            gains: [4.0 * exposure; 3],
            curve,
            ..plain
        },
        Display {
            gains,
            gamut,
            curve,
            dither: true,
        },
    ]
}

/// A transport with the first of its components only, four a quad.
pub fn first_quads(transport: &Transport, quads: usize) -> Transport {
    let mut transport = transport.clone();
    let all = transport.basis.rank().div_ceil(4);
    for tile in &mut transport.tiles {
        let plane = tile.coefficients.codes.len() / (3 * all);
        for channel in tile
            .coefficients
            .codes
            .chunks_exact_mut((all * plane).max(1))
        {
            channel[quads * plane..].fill([0; 4]);
        }
    }
    transport
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
