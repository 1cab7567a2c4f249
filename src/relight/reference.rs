//! Relighting in double precision, term by term as the paper writes it: the standard that every
//! fast path is held to.

use super::{Display, Light, Rgba8Picture};
use crate::transport::{CHANNELS, CameraPx, Element, Transport};

/// `y = pT` over each pixel's window, `[N]` pixels of RGB in units of the measurement.
///
/// # Panics
/// If the light's extent is not the transport's.
pub fn relight(transport: &Transport, light: &Light) -> Vec<[f64; CHANNELS]> {
    let geometry = transport.geometry;
    assert_eq!(light.extent(), geometry.light, "a light of another extent");
    let (area, rank) = (geometry.window.area(), transport.basis.rank());
    let mut picture = vec![[0.0; CHANNELS]; geometry.camera.area()];
    // Neighbours often look through the same window.
    let mut seen: Option<(Element, Vec<[f64; CHANNELS]>)> = None;
    for tile in transport.tiles.iter().filter(|tile| !tile.is_dark()) {
        for (p, pixel) in tile.rect().pixels().enumerate() {
            let origin = geometry.window_origin(pixel);
            let emitted = |s: usize| {
                let element = geometry.window.element(origin, s);
                let m = element.index_in(geometry.light)?;
                Some([0, 1, 2].map(|c| f64::from(light.elements()[m][c])))
            };
            let y = &mut picture[geometry.camera.index(pixel)];
            let direct = if tile.functions.is_dark() { 0 } else { area };
            for s in 0..direct {
                let tau = tile.functions.tau(area, p, s).map(f64::from);
                let emitted = emitted(s).unwrap_or_default();
                (0..CHANNELS).for_each(|c| y[c] += tau[c] * emitted[c]);
            }
            if tile.coefficients.is_dark() {
                continue;
            }
            if seen.as_ref().is_none_or(|(of, _)| *of != origin) {
                let light: Vec<_> = (0..area).map(emitted).collect();
                let through = |kernel: &Vec<f32>| {
                    let mut sum = [0.0; CHANNELS];
                    for (v, light) in kernel.iter().zip(&light) {
                        let light = light.unwrap_or_default();
                        (0..CHANNELS).for_each(|c| sum[c] += f64::from(*v) * light[c]);
                    }
                    sum
                };
                seen = Some((
                    origin,
                    transport.basis.kernels.iter().map(through).collect(),
                ));
            }
            if let Some((_, seen)) = &seen {
                for (k, seen) in seen.iter().enumerate() {
                    let coefficient = tile.coefficients.coefficient(rank, p, k);
                    (0..CHANNELS).for_each(|c| y[c] += f64::from(coefficient[c]) * seen[c]);
                }
            }
        }
    }
    picture
}

/// [`relight`], as a display shows it.
pub fn picture(transport: &Transport, light: &Light, display: &Display) -> Rgba8Picture {
    let extent = transport.geometry.camera;
    let linear = relight(transport, light);
    let pixels = (0..extent.height)
        .flat_map(|y| (0..extent.width).map(move |x| CameraPx { x, y }))
        .zip(linear)
        .map(|(at, linear)| {
            let [r, g, b] = display.codes(linear, at);
            [r, g, b, 255]
        });
    Rgba8Picture {
        extent,
        pixels: pixels.collect(),
    }
}
