//! Known light transport of a capture's `truth/` folder, and what follows from known columns.

use crate::capture::GroundTruth;
use crate::job_executor::Executor;
use crate::relight::Light;
use crate::transport::{
    CHANNELS, CameraPixel, Correspondence, Geometry, GeometryError, KnownTransport, LightElement,
    TileRect,
};

/// The transport in a capture's `truth/` folder.
#[derive(Debug)]
pub struct CaptureTruth {
    truth: GroundTruth,
    geometry: Geometry,
}

impl CaptureTruth {
    /// The transport of a capture whose pixels are recovered with `correspondence`.
    ///
    /// # Errors
    /// [`GeometryError`] if the extents and the window do not fit together.
    pub fn new(truth: GroundTruth, correspondence: Correspondence) -> Result<Self, GeometryError> {
        let geometry = Geometry {
            camera: truth.camera,
            light: truth.light_plane,
            window: truth.window,
            correspondence,
            tile_side: Geometry::DEFAULT_TILE_SIDE,
        }
        .validate()?;
        Ok(Self { truth, geometry })
    }
}

impl KnownTransport for CaptureTruth {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn origin(&self, pixel: CameraPixel) -> LightElement {
        self.truth.window_origin(self.geometry.camera.index(pixel))
    }

    fn transport_function(&self, pixel: CameraPixel, tau: &mut [[f32; CHANNELS]]) {
        let known = self.truth.tau(self.geometry.camera.index(pixel));
        for (tau, known) in tau.iter_mut().zip(known) {
            *tau = known.map(|t| t.to_f32());
        }
    }
}

/// A light transport matrix, column by column, `[N][M]`.
pub(super) type DenseTransport = Vec<Vec<[f32; CHANNELS]>>;

/// Computes every column of `known`.
pub(super) fn dense_transport(
    known: &impl KnownTransport,
    executor: &impl Executor,
) -> DenseTransport {
    let geometry = known.geometry();
    executor.map(geometry.camera.area(), |n| {
        let width = geometry.camera.width as usize;
        let (x, y) = ((n % width) as u32, (n / width) as u32);
        let pixel = CameraPixel { x, y };
        let mut function = vec![[0.0; CHANNELS]; geometry.window.area()];
        known.transport_function(pixel, &mut function);
        let mut column = vec![[0.0; CHANNELS]; geometry.light.area()];
        for (s, m) in geometry.elements_of_window(known.origin(pixel)) {
            column[m] = function[s];
        }
        column
    })
}

/// The picture of `rect` under `light` from the known transport, row by row.
pub(super) fn known_picture(
    known: &impl KnownTransport,
    rect: TileRect,
    light: &Light,
) -> Vec<[f64; CHANNELS]> {
    let geometry = known.geometry();
    let mut tau = vec![[0.0; CHANNELS]; geometry.window.area()];
    let picture = rect.pixels().map(|pixel| {
        known.transport_function(pixel, &mut tau);
        relight_pixel(geometry, known.origin(pixel), &tau, light)
    });
    picture.collect()
}

/// y = pτ of one pixel.
pub(super) fn relight_pixel(
    geometry: &Geometry,
    origin: LightElement,
    tau: &[[f32; CHANNELS]],
    light: &Light,
) -> [f64; CHANNELS] {
    let mut y = [0.0; CHANNELS];
    for (s, m) in geometry.elements_of_window(origin) {
        for c in 0..CHANNELS {
            y[c] += f64::from(tau[s][c]) * f64::from(light.elements()[m][c]);
        }
    }
    y
}
