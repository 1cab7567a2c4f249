//! The interface of simulated scenes, and their geometry.

use super::camera_view::CameraView;
use crate::transport::{
    CHANNELS, CameraPixel, Extent, Geometry, GeometryError, TileRect, TileTransportFunctions,
    Window,
};

/// Side of the window that holds every built-in scene's band, in light elements.
pub const WINDOW_SIDE: u32 = 15;

/// A scene with known light transport.
pub trait SimulatedScene: Sync {
    /// Camera and light plane, window and correspondence.
    fn geometry(&self) -> &Geometry;

    /// Writes the light transport function of one pixel, `[S]`, to `tau`, which holds zeros. Elements
    /// outside the light plane stay zero.
    fn transport_function(&self, pixel: CameraPixel, tau: &mut [[f32; CHANNELS]]);

    /// The light transport functions of the pixels in `rect`.
    fn tile(&self, rect: TileRect) -> TileTransportFunctions {
        let area = self.geometry().window.area();
        let mut functions = TileTransportFunctions::zeros(rect, area);
        for (pixel, tau) in rect.pixels().zip(functions.tau.chunks_exact_mut(area)) {
            self.transport_function(pixel, tau);
        }
        functions
    }
}

/// The geometry of a scene: the light plane fills the camera's picture but for the distortion and tilt of `view`.
///
/// # Errors
/// [`GeometryError`] for extents of zero, too large, or smaller than the window.
pub(super) fn scene_geometry(
    camera: Extent,
    light: Extent,
    view: CameraView,
) -> Result<Geometry, GeometryError> {
    Geometry {
        camera,
        light,
        window: Window::new(WINDOW_SIDE)?,
        correspondence: view.correspondence(camera, light)?,
        tile_side: Geometry::DEFAULT_TILE_SIDE,
    }
    .validate()
}
