//! Relighting in double precision, term by term as in the equations: the standard for all backends.

use super::{Light, OutputTransform, Rgba8Picture};
use crate::transport::{CHANNELS, CameraPx, Element, Transport};

/// `y = pT`: RGB of each of the `N` camera pixels, in units of the measurement.
///
/// # Panics
/// If the light's extent is not the transport's.
pub fn relight(transport: &Transport, light: &Light) -> Vec<[f64; CHANNELS]> {
    let geometry = transport.geometry;
    assert_eq!(light.extent(), geometry.light, "extent of the light");
    let (area, rank) = (geometry.window.area(), transport.basis.rank());
    let mut picture = vec![[0.0; CHANNELS]; geometry.camera.area()];
    // The basis response of the last window origin: neighbours often share it.
    let mut last_response: Option<(Element, Vec<[f64; CHANNELS]>)> = None;
    for tile in transport.tiles.iter().filter(|tile| !tile.is_dark()) {
        for (p, pixel) in tile.rect().pixels().enumerate() {
            let origin = geometry.window_origin(pixel);
            let emission = |s: usize| -> [f64; CHANNELS] {
                let element = geometry.window.element(origin, s);
                let m = element.index_in(geometry.light);
                m.map_or([0.0; CHANNELS], |m| {
                    [0, 1, 2].map(|c| f64::from(light.elements()[m][c]))
                })
            };
            let y = &mut picture[geometry.camera.index(pixel)];
            let slots = if tile.functions.is_dark() { 0 } else { area };
            for s in 0..slots {
                let tau = tile.functions.tau(area, p, s).map(f64::from);
                let emission = emission(s);
                (0..CHANNELS).for_each(|c| y[c] += tau[c] * emission[c]);
            }
            if tile.coefficients.is_dark() {
                continue;
            }
            let response = match &mut last_response {
                Some((of, response)) if *of == origin => response,
                last => {
                    let light: Vec<_> = (0..area).map(emission).collect();
                    let correlate = |function: &Vec<f32>| {
                        let mut sum = [0.0; CHANNELS];
                        for (v, light) in function.iter().zip(&light) {
                            (0..CHANNELS).for_each(|c| sum[c] += f64::from(*v) * light[c]);
                        }
                        sum
                    };
                    let response = transport.basis.kernels.iter().map(correlate).collect();
                    &mut last.insert((origin, response)).1
                }
            };
            for (k, response) in response.iter().enumerate() {
                let coefficient = tile.coefficients.coefficient(rank, p, k);
                (0..CHANNELS).for_each(|c| y[c] += f64::from(coefficient[c]) * response[c]);
            }
        }
    }
    picture
}

/// [`relight`], then an output transform.
///
/// # Panics
/// If the light's extent is not the transport's.
pub fn picture(transport: &Transport, light: &Light, output: &OutputTransform) -> Rgba8Picture {
    let extent = transport.geometry.camera;
    let linear = relight(transport, light);
    let pixels = (0..extent.height)
        .flat_map(|y| (0..extent.width).map(move |x| CameraPx { x, y }))
        .zip(linear)
        .map(|(at, linear)| {
            let [r, g, b] = output.codes(linear, at);
            [r, g, b, 255]
        });
    Rgba8Picture {
        extent,
        pixels: pixels.collect(),
    }
}
