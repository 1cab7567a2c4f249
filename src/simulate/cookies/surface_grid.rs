//! The surface sampled on a grid, so that rays can be marched over it quickly.

use super::tray::surface_at;
use crate::simulate::coordinates::{UnitPlane, Vec2, vec2};
use crate::transport::{CHANNELS, Extent, LightPx};

/// Distance over which slopes for shading are taken, in unit coordinates: the same at every
/// resolution, so that the picture is.
const SLOPE_STEP: f64 = 0.008;

/// Heights and colours on a grid over the light plane.
#[derive(Debug)]
pub(super) struct SurfaceGrid {
    plane: UnitPlane,
    extent: Extent,
    /// Light elements from one sample to the next.
    pitch: Vec2,
    heights: Vec<f32>,
    albedos: Vec<[f32; CHANNELS]>,
    glosses: Vec<f32>,
}

/// The surface at one sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    /// Where, on the light plane.
    pub at: LightPx,
    /// Height, 1 for the tallest cookie.
    pub height: f64,
    /// Diffuse albedo.
    pub albedo: [f64; CHANNELS],
    /// Strength of the highlight.
    pub gloss: f64,
    /// Slope of the height per unit coordinate.
    pub unit_slope: Vec2,
}

impl SurfaceGrid {
    /// Samples the surface at `extent` points, `pitch` light elements apart.
    pub fn new(light: Extent, extent: Extent, pitch: Vec2) -> Self {
        let plane = UnitPlane::new(light);
        let mut heights = Vec::with_capacity(extent.area());
        let mut albedos = Vec::with_capacity(extent.area());
        let mut glosses = Vec::with_capacity(extent.area());
        for j in 0..extent.height {
            for i in 0..extent.width {
                let here = surface_at(plane.at(place(pitch, i, j)));
                heights.push(here.height as f32);
                albedos.push(here.albedo.map(|a| a as f32));
                glosses.push(here.gloss as f32);
            }
        }
        Self {
            plane,
            extent,
            pitch,
            heights,
            albedos,
            glosses,
        }
    }

    /// Light elements from one sample to the next.
    pub fn pitch(&self) -> Vec2 {
        self.pitch
    }

    /// The surface at sample `(i, j)`.
    pub fn spot(&self, i: u32, j: u32) -> SurfacePoint {
        let at = place(self.pitch, i, j);
        let n = (j * self.extent.width + i) as usize;
        let p = self.plane.at(at);
        let step = |d: Vec2| surface_at(p + d).height - surface_at(p - d).height;
        SurfacePoint {
            at,
            height: f64::from(self.heights[n]),
            albedo: self.albedos[n].map(f64::from),
            gloss: f64::from(self.glosses[n]),
            unit_slope: vec2(step(vec2(SLOPE_STEP, 0.0)), step(vec2(0.0, SLOPE_STEP)))
                * (0.5 / SLOPE_STEP),
        }
    }

    /// Slope of the height per light element around sample `(i, j)`.
    pub fn slope(&self, i: u32, j: u32) -> Vec2 {
        let (i, j) = (i as i32, j as i32);
        let across = |di, dj| self.height_at(i + di, j + dj) - self.height_at(i - di, j - dj);
        vec2(
            across(1, 0) * 0.5 / self.pitch.x,
            across(0, 1) * 0.5 / self.pitch.y,
        )
    }

    /// Whether something stands in the way of the beam to `spot`. Beams travel by `tilt` (light
    /// elements) while they fall by 1.
    pub fn shaded(&self, spot: &SurfacePoint, tilt: Vec2) -> bool {
        let to_sky = 1.0 - spot.height;
        let run = vec2(tilt.x / self.pitch.x, tilt.y / self.pitch.y);
        // One step a sample along the longer axis misses nothing the grid can show.
        let steps = (to_sky * run.x.abs().max(run.y.abs())).ceil().max(1.0);
        let start = vec2(
            spot.at.u / self.pitch.x - 0.5,
            spot.at.v / self.pitch.y - 0.5,
        );
        // A surface must not shade itself where interpolation is a little higher than it.
        const BIAS: f64 = 0.004;
        (1..=steps as u32).any(|k| {
            let rise = to_sky * f64::from(k) / steps;
            self.interpolated(start - run * rise) > spot.height + rise + BIAS
        })
    }

    fn height_at(&self, i: i32, j: i32) -> f64 {
        let i = i.clamp(0, self.extent.width as i32 - 1) as u32;
        let j = j.clamp(0, self.extent.height as i32 - 1) as u32;
        f64::from(self.heights[(j * self.extent.width + i) as usize])
    }

    /// Height at a position given in samples, bilinear.
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

fn place(pitch: Vec2, i: u32, j: u32) -> LightPx {
    LightPx {
        u: (f64::from(i) + 0.5) * pitch.x,
        v: (f64::from(j) + 0.5) * pitch.y,
    }
}
