//! The surface of the tray and the cookies, sampled on a grid for fast ray marching.

use super::tray::{Surface, surface_at};
use crate::simulate::vec2::{CentredCoordinates, Vec2, vec2};
use crate::transport::{CHANNELS, Extent};

/// Distance of the finite differences for shading, in unit coordinates: the same at every resolution, so that
/// the picture does not depend on it.
const SLOPE_STEP: f64 = 0.008;

/// Heights and colours at grid points over the light plane.
#[derive(Debug)]
pub(super) struct SurfaceGrid {
    plane: CentredCoordinates,
    extent: Extent,
    /// Light elements from one sample to the next.
    pub pitch: Vec2,
    samples: Vec<SurfaceSample>,
}

/// [`Surface`] in single precision.
#[derive(Debug)]
struct SurfaceSample {
    height: f32,
    albedo: [f32; CHANNELS],
    gloss: f32,
}

/// The surface at one sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    /// Position on the light plane, in light elements.
    pub at: Vec2,
    pub surface: Surface,
    /// Gradient of the height, by unit coordinates.
    pub unit_slope: Vec2,
}

impl SurfaceGrid {
    /// Samples the surface at `extent` points, `pitch` light elements apart.
    pub fn new(light: Extent, extent: Extent, pitch: Vec2) -> Self {
        let plane = CentredCoordinates::new(light);
        let sample = |(i, j)| {
            let Surface {
                height,
                albedo,
                gloss,
            } = surface_at(plane.at(sample_position(pitch, i, j)));
            SurfaceSample {
                height: height as f32,
                albedo: albedo.map(|a| a as f32),
                gloss: gloss as f32,
            }
        };
        Self {
            plane,
            extent,
            pitch,
            samples: extent.cells().map(sample).collect(),
        }
    }

    /// The surface at sample `(i, j)`.
    pub fn point(&self, i: u32, j: u32) -> SurfacePoint {
        let at = sample_position(self.pitch, i, j);
        let sample = &self.samples[(j * self.extent.width + i) as usize];
        let p = self.plane.at(at);
        let step = |d: Vec2| surface_at(p + d).height - surface_at(p - d).height;
        SurfacePoint {
            at,
            surface: Surface {
                height: f64::from(sample.height),
                albedo: sample.albedo.map(f64::from),
                gloss: f64::from(sample.gloss),
            },
            unit_slope: vec2(step(vec2(SLOPE_STEP, 0.0)), step(vec2(0.0, SLOPE_STEP)))
                * (0.5 / SLOPE_STEP),
        }
    }

    /// Gradient of the height, by light elements, at sample `(i, j)`.
    pub fn slope(&self, i: u32, j: u32) -> Vec2 {
        let (i, j) = (i as i32, j as i32);
        let difference = |di, dj| self.height_at(i + di, j + dj) - self.height_at(i - di, j - dj);
        let along_u = difference(1, 0) * 0.5 / self.pitch.x;
        vec2(along_u, difference(0, 1) * 0.5 / self.pitch.y)
    }

    /// Whether the surface blocks the beam to `point`. A beam moves by `tilt` light elements while it descends by 1.
    pub fn is_shaded(&self, point: &SurfacePoint, tilt: Vec2) -> bool {
        let height = point.surface.height;
        let max_rise = 1.0 - height;
        let in_samples = |p: Vec2| vec2(p.x / self.pitch.x, p.y / self.pitch.y);
        let tilt_samples = in_samples(tilt);
        // One step for each sample along the longer axis.
        let longer = tilt_samples.x.abs().max(tilt_samples.y.abs());
        let steps = (max_rise * longer).ceil().max(1.0);
        let start = in_samples(point.at) - vec2(0.5, 0.5);
        // Against self-shadowing where the interpolated height exceeds the sample.
        const BIAS: f64 = 0.004;
        (1..=steps as u32).any(|k| {
            let rise = max_rise * f64::from(k) / steps;
            self.interpolated(start - tilt_samples * rise) > height + rise + BIAS
        })
    }

    fn height_at(&self, i: i32, j: i32) -> f64 {
        let i = i.clamp(0, self.extent.width as i32 - 1) as u32;
        let j = j.clamp(0, self.extent.height as i32 - 1) as u32;
        f64::from(self.samples[(j * self.extent.width + i) as usize].height)
    }

    /// Height at a position in samples, by bilinear interpolation.
    fn interpolated(&self, p: Vec2) -> f64 {
        let (i, j) = (p.x.floor(), p.y.floor());
        let (fx, fy) = (p.x - i, p.y - j);
        let row = |dj| {
            let at = |di| self.height_at(i as i32 + di, j as i32 + dj);
            at(0) * (1.0 - fx) + at(1) * fx
        };
        row(0) * (1.0 - fy) + row(1) * fy
    }
}

/// The position of sample `(i, j)` on the light plane, in light elements.
fn sample_position(pitch: Vec2, i: u32, j: u32) -> Vec2 {
    let at = |i: u32, pitch: f64| (f64::from(i) + 0.5) * pitch;
    vec2(at(i, pitch.x), at(j, pitch.y))
}
