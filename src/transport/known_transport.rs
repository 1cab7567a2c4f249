//! A light transport matrix that is known without recovery, and the error of a recovered one.

use super::float_tile::TileTransportFunctions;
use super::geometry::{CHANNELS, CameraPixel, Geometry, LightElement};
use super::snr::SnrAccumulator;

/// A light transport matrix whose columns are known.
pub trait KnownTransport: Sync {
    /// Camera and light plane, correspondence, and the window that holds the band.
    fn geometry(&self) -> &Geometry;

    /// Origin of a pixel's window.
    fn origin(&self, pixel: CameraPixel) -> LightElement {
        self.geometry().window_origin(pixel)
    }

    /// Writes the light transport function of one pixel, `[S]`, in units of the measurement.
    fn transport_function(&self, pixel: CameraPixel, tau: &mut [[f32; CHANNELS]]);
}

/// Error of recovered functions, whose windows are those of `geometry`, over the elements of both windows.
pub fn transport_error(
    known: &impl KnownTransport,
    geometry: &Geometry,
    functions: &TileTransportFunctions,
) -> SnrAccumulator {
    let (window, known_window) = (geometry.window, known.geometry().window);
    let mut sum = SnrAccumulator::default();
    let mut truth = vec![[0.0; CHANNELS]; known_window.area()];
    let recovered = functions.tau.chunks_exact(window.area());
    for (pixel, estimate) in functions.rect.pixels().zip(recovered) {
        let (origin, known_origin) = (geometry.window_origin(pixel), known.origin(pixel));
        known.transport_function(pixel, &mut truth);
        for (s, truth) in truth.iter().enumerate() {
            let slot = window.slot(origin, known_window.element(known_origin, s));
            let estimate = slot.map_or([0.0; CHANNELS], |s| estimate[s]);
            for c in 0..CHANNELS {
                sum.add(f64::from(truth[c]), f64::from(estimate[c]));
            }
        }
        if (window, origin) == (known_window, known_origin) {
            continue;
        }
        for (s, estimate) in estimate.iter().enumerate() {
            let element = window.element(origin, s);
            if known_window.slot(known_origin, element).is_none() {
                estimate.iter().for_each(|&e| sum.add(0.0, f64::from(e)));
            }
        }
    }
    sum
}
