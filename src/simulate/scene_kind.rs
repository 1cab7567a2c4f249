//! The built-in scenes by name.

use super::camera_view::CameraView;
use super::cookies::CookiesScene;
use super::pattern_image::PatternEnsemble;
use super::simulated_scene::{SimulatedScene, scene_geometry};
use super::stained_glass::StainedGlassScene;
use crate::transport::{Extent, GeometryError};

/// The built-in scenes. The command line shows the variants' descriptions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    all(feature = "cli", not(target_arch = "wasm32")),
    derive(clap::ValueEnum)
)]
pub enum SceneKind {
    /// A rose window lit from behind
    StainedGlass,
    /// Cookies on a tray under a tilted projector
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
        let geometry = scene_geometry(camera, light, CameraView::default())?;
        Ok(match self {
            Self::StainedGlass => Box::new(StainedGlassScene::new(geometry)),
            Self::Cookies => Box::new(CookiesScene::new(geometry)),
        })
    }

    /// The rose window with the distortion and tilt of `view`. Cookies have neither.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn build_stained_glass(
        camera: Extent,
        light: Extent,
        view: CameraView,
    ) -> Result<Box<dyn SimulatedScene>, GeometryError> {
        let geometry = scene_geometry(camera, light, view)?;
        Ok(Box::new(StainedGlassScene::new(geometry)))
    }

    /// The default ensemble: Gaussian for glass, as in the paper; Bernoulli for cookies, as its higher
    /// contrast helps sparse transport.
    pub fn ensemble(self) -> PatternEnsemble {
        match self {
            Self::StainedGlass => PatternEnsemble::Gaussian,
            Self::Cookies => PatternEnsemble::Bernoulli,
        }
    }
}
