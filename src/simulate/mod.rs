//! Built-in scenes whose transport is known, and the camera that photographs them.
//!
//! A [`SimulatedScene`] is a picture drawn by formula, in coordinates that do not depend on any resolution,
//! together with the physics that turns each camera pixel into a light transport function. Lengths
//! that make the band (scattering widths, refraction, parallax) are given in light elements: with
//! more elements the same picture stands closer to the display, and the same window holds it.
//!
//! Pure computation: no threads, no files, no clock. Whoever has them calls [`SimulatedScene::tile`] for
//! many tiles at once, [`EmissionMatrix`] to see them under many lights and [`Camera`] for the noise.

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
pub use light_codes::{DISPLAY_GAMMA, Ensemble, GrayCodePattern, LightCodes, emission};
pub use truth_lights::TruthLight;

use crate::transport::{
    CHANNELS, CameraPx, Correspondence, Extent, Geometry, GeometryError, TileRect,
    TransportFunctions, Window,
};

/// Side of the window that holds every built-in scene's band, in light elements. Scattering and
/// parallax below are chosen to fit it.
pub const WINDOW_SIDE: u32 = 15;

/// A scene of known transport.
pub trait SimulatedScene: Sync {
    /// Grids, band and correspondence.
    fn geometry(&self) -> &Geometry;

    /// Writes the light transport function of one pixel, `[S]`, over zeros. Elements off the
    /// display have none.
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
    /// A rose window: coloured glass between lead cames, lit from behind.
    StainedGlass,
    /// Cookies on a tray under a tilted projector.
    Cookies,
}

impl SceneKind {
    /// The scene seen by `camera` under a light plane of `light` elements.
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

    /// The ensemble that suits the scene: the paper lit glass with Gaussian patterns; sparse
    /// transport profits most from the higher contrast of binary ones.
    pub fn ensemble(self) -> Ensemble {
        match self {
            Self::StainedGlass => Ensemble::Gaussian,
            Self::Cookies => Ensemble::Bernoulli,
        }
    }
}
