//! Relighting in double precision, term by term as in the equations: the standard for all backends.

use super::{Light, OutputTransform, Rgba8Picture};
use crate::transport::{CHANNELS, CameraPixel, LightElement, Transport, entry_slot};

/// `y = pT`: RGB of each of the `N` camera pixels, in units of the measurement.
///
/// # Panics
/// If the light's extent is not the transport's.
pub fn relight(transport: &Transport, light: &Light) -> Vec<[f64; CHANNELS]> {
    let geometry = &transport.geometry;
    // Not `assert_eq`, whose formatting code modules would have to carry.
    assert!(light.extent() == geometry.light, "extent of the light");
    let (area, rank) = (geometry.window.area(), transport.basis.rank());
    let emission = |element: LightElement| -> [f64; CHANNELS] {
        let m = element.index_in(geometry.light);
        m.map_or([0.0; CHANNELS], |m| {
            [0, 1, 2].map(|c| f64::from(light.elements()[m][c]))
        })
    };
    let add = |sum: &mut [f64; CHANNELS], factors: [f32; CHANNELS], values: [f64; CHANNELS]| {
        (0..CHANNELS).for_each(|c| sum[c] += f64::from(factors[c]) * values[c]);
    };
    let mut picture = vec![[0.0; CHANNELS]; geometry.camera.area()];
    for tile in transport.tiles.iter().filter(|tile| !tile.is_dark()) {
        let components = if tile.coefficients.is_dark() { 0 } else { rank };
        // The window's light and the basis response at the last origin, which neighbours often share.
        let (mut last_origin, mut window, mut response) = (None, Vec::new(), Vec::new());
        let mut functions = tile.functions.pixels();
        for (p, pixel) in tile.rect().pixels().enumerate() {
            let origin = geometry.window_origin(pixel);
            if last_origin.replace(origin) != Some(origin) {
                let elements = (0..area).map(|s| geometry.window.element(origin, s));
                window = elements.map(emission).collect();
                let correlate = |function: &Vec<f32>| {
                    let mut sum = [0.0; CHANNELS];
                    let pairs = function.iter().zip(&window);
                    pairs.for_each(|(v, light)| add(&mut sum, [*v; CHANNELS], *light));
                    sum
                };
                let functions = transport.basis.kernels[..components].iter();
                response = functions.map(correlate).collect();
            }
            let y = &mut picture[geometry.camera.index(pixel)];
            for entry in functions.next().unwrap_or_default() {
                add(y, tile.functions.value(entry), window[entry_slot(entry)]);
            }
            for (k, response) in response.iter().enumerate() {
                add(y, tile.coefficient(rank, p, k), *response);
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
    let pixels = extent.cells().zip(linear).map(|((x, y), linear)| {
        let [r, g, b] = output.codes(linear, CameraPixel { x, y });
        [r, g, b, 255]
    });
    Rgba8Picture {
        extent,
        pixels: pixels.collect(),
    }
}
