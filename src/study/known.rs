//! Transport that is known: from a scene's formula, or from a capture's `truth/`.

use crate::capture::Truth;
use crate::relight::Light;
use crate::simulate::SimulatedScene;
use crate::transport::{
    CHANNELS, CameraPx, Correspondence, Element, Geometry, GeometryError, TileRect, TransportError,
    TransportFunctions,
};

/// A transport of which every light transport function can be had.
pub trait Known: Sync {
    /// Grids, correspondence, and the window that holds the band.
    fn geometry(&self) -> &Geometry;

    /// First element of a pixel's window.
    fn origin(&self, pixel: CameraPx) -> Element {
        self.geometry().window_origin(pixel)
    }

    /// Writes the light transport function of one pixel, `[S]`, in units of the measurement.
    fn transport_function(&self, pixel: CameraPx, tau: &mut [[f32; CHANNELS]]);
}

/// A built-in scene.
#[derive(Clone, Copy)]
pub struct SceneTruth<'a>(pub &'a dyn SimulatedScene);

impl Known for SceneTruth<'_> {
    fn geometry(&self) -> &Geometry {
        self.0.geometry()
    }

    fn transport_function(&self, pixel: CameraPx, tau: &mut [[f32; CHANNELS]]) {
        tau.fill([0.0; CHANNELS]);
        self.0.transport_function(pixel, tau);
    }
}

/// What a capture folder's `truth/` says.
#[derive(Debug)]
pub struct CaptureTruth {
    truth: Truth,
    geometry: Geometry,
}

impl CaptureTruth {
    /// `truth` of a capture with this `correspondence`, by which its pixels will be recovered.
    pub fn new(truth: Truth, correspondence: Correspondence) -> Result<Self, GeometryError> {
        let geometry = Geometry {
            camera: truth.camera(),
            light: truth.light_plane(),
            window: truth.window(),
            correspondence,
            tile_side: Geometry::DEFAULT_TILE_SIDE,
        }
        .validate()?;
        Ok(Self { truth, geometry })
    }
}

impl Known for CaptureTruth {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn origin(&self, pixel: CameraPx) -> Element {
        self.truth.window_origin(self.geometry.camera.index(pixel))
    }

    fn transport_function(&self, pixel: CameraPx, tau: &mut [[f32; CHANNELS]]) {
        let known = self.truth.tau(self.geometry.camera.index(pixel));
        for (tau, known) in tau.iter_mut().zip(known) {
            *tau = known.map(|t| t.to_f32());
        }
    }
}

/// Error of recovered functions, which lie on the windows of `geometry`, over every element that
/// either transport has.
pub(super) fn error_of(
    known: &impl Known,
    geometry: &Geometry,
    functions: &TransportFunctions,
) -> TransportError {
    let (ours, theirs) = (geometry.window, known.geometry().window);
    let mut sum = TransportError::default();
    let mut truth = vec![[0.0; CHANNELS]; theirs.area()];
    let recovered = functions.tau.chunks_exact(ours.area());
    for (pixel, estimate) in functions.rect.pixels().zip(recovered) {
        let (our_origin, their_origin) = (geometry.window_origin(pixel), known.origin(pixel));
        known.transport_function(pixel, &mut truth);
        for (s, truth) in truth.iter().enumerate() {
            let here = ours.slot(our_origin, theirs.element(their_origin, s));
            let estimate = here.map_or([0.0; CHANNELS], |s| estimate[s]);
            for c in 0..CHANNELS {
                sum.add(f64::from(truth[c]), f64::from(estimate[c]));
            }
        }
        if (ours, our_origin) == (theirs, their_origin) {
            continue;
        }
        for (s, estimate) in estimate.iter().enumerate() {
            if theirs
                .slot(their_origin, ours.element(our_origin, s))
                .is_none()
            {
                estimate.iter().for_each(|&e| sum.add(0.0, f64::from(e)));
            }
        }
    }
    sum
}

/// The pixels of `rect` under `light`, from the known transport, row by row.
pub(super) fn expose(known: &impl Known, rect: TileRect, light: &Light) -> Vec<[f64; CHANNELS]> {
    let geometry = known.geometry();
    let mut tau = vec![[0.0; CHANNELS]; geometry.window.area()];
    let lit = rect.pixels().map(|pixel| {
        known.transport_function(pixel, &mut tau);
        pixel_under(geometry, known.origin(pixel), &tau, light)
    });
    lit.collect()
}

/// `y = pτ` for one pixel.
pub(super) fn pixel_under(
    geometry: &Geometry,
    origin: Element,
    tau: &[[f32; CHANNELS]],
    light: &Light,
) -> [f64; CHANNELS] {
    let mut y = [0.0; CHANNELS];
    for (s, tau) in tau.iter().enumerate() {
        if let Some(m) = geometry.window.element(origin, s).index_in(geometry.light) {
            for c in 0..CHANNELS {
                y[c] += f64::from(tau[c]) * f64::from(light.elements()[m][c]);
            }
        }
    }
    y
}
