//! Transports, lights and output transforms for tests of relighting, and the tolerance of pictures.

use relightable_photo::relight::{
    BuiltinLight, Gamut, Light, OutputTransform, Rgba8Picture, ToneCurve,
};
use relightable_photo::transport::{Basis, Extent, FloatTile, Geometry, Tile, Transport};

use super::Noise;

/// What the tiles of a transport contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileContents {
    /// Functions slot by slot.
    Direct,
    /// Coefficients of nine basis functions.
    Factored,
    /// Tiles of either, both and neither.
    Mixed,
}

/// Light transport functions with a peak in the window's middle and a noisy tail, brighter to the right and below, so that
/// a mirrored or shifted picture is recognised. They are not zero off the light plane, so that a backend that reads there
/// is recognised too.
pub fn asymmetric_transport(geometry: Geometry, contents: TileContents, seed: u64) -> Transport {
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
        let [direct, factored] = match contents {
            TileContents::Direct => [true, false],
            TileContents::Factored => [false, true],
            TileContents::Mixed => [i % 3 < 2, i % 4 > 0],
        };
        let mut tile = FloatTile::dark(rect);
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
                // Some are negative, different ones in each pixel.
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

/// All built-in lights; `random`, brighter, with varying chroma; and `corner`, with uniform chroma.
pub fn lights(extent: Extent) -> Vec<(&'static str, Light)> {
    let mut lights: Vec<_> = BuiltinLight::BY_NAME
        .map(|(name, light)| (name, light.render(extent)))
        .into();
    let mut noise = Noise(7);
    let values: Vec<f32> = (0..3 * extent.area())
        .map(|_| 3.0 * noise.next() as f32)
        .collect();
    let random = Light::from_linear_rgb(extent, &values).unwrap();
    lights.push(("random", random));
    let corner = (0..extent.area()).flat_map(|i| {
        let (u, v) = (i as u32 % extent.width, i as u32 / extent.width);
        let lit = u < extent.width.div_ceil(3) && v < extent.height.div_ceil(3);
        [0.2, 0.9, 0.4].map(|c| if lit { c * noise.next() as f32 } else { 0.0 })
    });
    let corner: Vec<f32> = corner.collect();
    lights.push(("corner", Light::from_linear_rgb(extent, &corner).unwrap()));
    lights
}

/// Output transforms that together have all features; the first has an exposure only.
pub fn output_transforms(exposure: f32) -> [OutputTransform; 4] {
    let plain = OutputTransform::srgb(exposure);
    let matrix = OutputTransform::diagonal([1.3, 1.0, 0.6].map(|gain| gain * exposure));
    // As of a camera whose channels overlap.
    let mixing = [[1.9, -0.7, -0.2], [-0.2, 1.5, -0.3], [0.0, -0.6, 1.6]];
    let (gamut, curve) = (Gamut::DisplayP3, ToneCurve::Filmic);
    [
        plain,
        OutputTransform {
            matrix,
            dither: true,
            ..plain
        },
        OutputTransform {
            matrix: mixing.map(|row| row.map(|factor: f32| 4.0 * exposure * factor)),
            curve,
            ..plain
        },
        OutputTransform {
            matrix,
            gamut,
            curve,
            dither: true,
        },
    ]
}

/// The transport with its first quads of components only.
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

/// Panics unless every channel of every pixel is within one code of the reference.
pub fn assert_within_one_code(got: &Rgba8Picture, reference: &Rgba8Picture, context: &str) {
    assert_eq!(got.extent, reference.extent, "{context}");
    let width = reference.extent.width as usize;
    for (i, (got, want)) in got.pixels.iter().zip(&reference.pixels).enumerate() {
        let difference = (0..4).map(|c| got[c].abs_diff(want[c])).max();
        assert!(
            difference <= Some(1) && got[3] == 255,
            "{context}: pixel ({}, {}) is {got:?}, not {want:?}",
            i % width,
            i / width
        );
    }
}
