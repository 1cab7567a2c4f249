//! Built-in scenes with known light transport, and a camera that photographs them.
//!
//! A [`SimulatedScene`] computes the light transport function τ, `[S]` in units of the measurement, of any
//! camera pixel: a procedural picture in resolution-independent coordinates ([`coordinates`]) and the physics
//! of light in it. The lengths that determine the band (scattering widths, refraction, parallax) are in
//! light elements, so that one window holds the band at every resolution.
//!
//! [`EmissionMatrix`] computes y = pT under many lights, [`Camera`] adds noise. This module uses no threads,
//! files or clock; callers compute [`SimulatedScene::tile`] in parallel.

mod camera;
mod cookies;
mod coordinates;
mod emission_matrix;
mod gradient_noise;
mod light_codes;
mod shapes;
mod stained_glass;
mod truth_lights;

pub use camera::{Camera, RandomStream};
pub use emission_matrix::EmissionMatrix;
pub use light_codes::{Ensemble, GrayCodePattern, LightCodes, MONITOR_GAMMA, emission};
pub use truth_lights::TruthLight;

use crate::transport::{
    CHANNELS, CameraPx, Correspondence, Extent, Geometry, GeometryError, TileRect,
    TransportFunctions, Window,
};

/// Side of the window that holds every built-in scene's band, in light elements.
pub const WINDOW_SIDE: u32 = 15;

/// A scene with known light transport.
pub trait SimulatedScene: Sync {
    /// Camera and light plane, window and correspondence.
    fn geometry(&self) -> &Geometry;

    /// Writes the light transport function of one pixel, `[S]`, to `tau`, which holds zeros. Elements
    /// outside the light plane stay zero.
    fn transport_function(&self, pixel: CameraPx, tau: &mut [[f32; CHANNELS]]);

    /// The light transport functions of the pixels in `rect`.
    fn tile(&self, rect: TileRect) -> TransportFunctions {
        let area = self.geometry().window.area();
        let mut functions = TransportFunctions::zeros(rect, area);
        for (pixel, tau) in rect.pixels().zip(functions.tau.chunks_exact_mut(area)) {
            self.transport_function(pixel, tau);
        }
        functions
    }
}

/// The built-in scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    /// A rose window of coloured glass and lead, lit from behind.
    StainedGlass,
    /// Cookies on a tray, lit by a projector at an angle.
    Cookies,
}

impl SceneKind {
    /// The scene, seen by a camera of `camera` pixels under a light plane of `light` elements.
    ///
    /// # Errors
    /// [`GeometryError`] for extents of zero, too large, or smaller than the window.
    pub fn build(
        self,
        camera: Extent,
        light: Extent,
    ) -> Result<Box<dyn SimulatedScene>, GeometryError> {
        let geometry = Geometry {
            camera,
            light,
            window: Window::new(WINDOW_SIDE)?,
            correspondence: Correspondence {
                affine: [
                    [f64::from(light.width) / f64::from(camera.width), 0.0, 0.0],
                    [0.0, f64::from(light.height) / f64::from(camera.height), 0.0],
                ],
            },
            tile_side: Geometry::DEFAULT_TILE_SIDE,
        }
        .validate()?;
        Ok(match self {
            Self::StainedGlass => Box::new(stained_glass::StainedGlass::new(geometry)),
            Self::Cookies => Box::new(cookies::Cookies::new(geometry)),
        })
    }

    /// The default ensemble: Gaussian for glass, as in the paper; Bernoulli for cookies, as its higher
    /// contrast helps sparse transport.
    pub fn ensemble(self) -> Ensemble {
        match self {
            Self::StainedGlass => Ensemble::Gaussian,
            Self::Cookies => Ensemble::Bernoulli,
        }
    }
}
