//! Relighting in double precision, term by term as the paper writes it: the standard that every
//! fast path is held to.

use super::{Light, Rgba8Picture, tone};
use crate::transport::{CHANNELS, Transport};

/// `y = pT` over each pixel's window, `[N]` pixels of RGB in units of the measurement.
///
/// # Panics
/// If the light's extent is not the transport's.
pub fn relight(transport: &Transport, light: &Light) -> Vec<[f64; CHANNELS]> {
    let geometry = transport.geometry;
    assert_eq!(light.extent(), geometry.light, "a light of another extent");
    let area = geometry.window.area();
    let mut picture = vec![[0.0; CHANNELS]; geometry.camera.area()];
    for tile in transport.tiles.iter().filter(|tile| !tile.is_dark()) {
        for (p, pixel) in tile.rect.pixels().enumerate() {
            let origin = geometry.window_origin(pixel);
            let y = &mut picture[geometry.camera.index(pixel)];
            for s in 0..area {
                let element = geometry.window.element(origin, s);
                let Some(m) = element.index_in(geometry.light) else {
                    continue;
                };
                let codes = tile.codes[p * area + s];
                for c in 0..CHANNELS {
                    let tau = f64::from(codes[c]) * f64::from(tile.step[c]);
                    y[c] += tau * f64::from(light.elements()[m][c]);
                }
            }
        }
    }
    picture
}

/// [`relight`], scaled by `exposure` and encoded as 8-bit sRGB.
pub fn relight_srgb8(transport: &Transport, light: &Light, exposure: f64) -> Rgba8Picture {
    let pixels = relight(transport, light).into_iter().map(|y| {
        let [r, g, b] = y.map(|y| tone::srgb8(y * exposure));
        [r, g, b, 255]
    });
    Rgba8Picture {
        extent: transport.geometry.camera,
        pixels: pixels.collect(),
    }
}
