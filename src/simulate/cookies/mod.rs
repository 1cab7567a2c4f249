//! Cookies on a tray, lit by a tilted collimated projector, seen straight from above.
//!
//! A camera pixel sees a spot of an opaque surface. Its direct light comes from the one or few
//! elements whose beam hits that spot, which the spot's height moves along the projector's tilt:
//! depth parallax. Where a taller neighbour stands in the way there is none: a cast shadow. What
//! is left is light that lit neighbours reflect onto the spot.

mod surface_grid;
mod tray;

use surface_grid::{SurfaceGrid, SurfacePoint};

use super::SimulatedScene;
use super::coordinates::{Vec2, vec2};
use crate::transport::{CHANNELS, CameraPx, Element, Extent, Geometry, LightPx};

/// Samples along each side of a camera pixel.
const SAMPLES: u32 = 3;
/// How far a beam travels along u and v while it falls by the tallest cookie's height, in
/// elements. With the projector's blur the direct light stays inside the window, and on the tray
/// it lies in the middle, so that none is lost at the display's edge.
const TILT: Vec2 = vec2(3.7, 2.5);
/// Tangent of the angle between the beams and the vertical: 42°.
const TAN_TILT: f64 = 0.9;
/// Side of the spot that a projector pixel is blurred by, in elements.
const BLUR: f64 = 0.25;
/// EmissionMatrix: a white card on the tray would measure this much.
const EXPOSURE: f64 = 0.70;
/// Brightest highlight, and how narrow highlights are.
const HIGHLIGHT: f64 = 0.40;
const SHININESS: f64 = 50.0;
/// Light elements along half of the shorter side at which shading and parallax have one scale of
/// relief. Finer displays would need a wider band: there the projector stands steeper, and only
/// the shading keeps its rake.
const SHADING_HALF_SIDE: f64 = 32.0;

/// The scene.
#[derive(Debug)]
pub(super) struct Cookies {
    geometry: Geometry,
    /// Surface samples, `SAMPLES` a side for each camera pixel.
    fine: SurfaceGrid,
    /// One surface patch for each light element, for reflections between them.
    patches: Vec<Reflector>,
}

/// A piece of surface one element wide, as a reflector.
#[derive(Clone, Copy, Debug)]
struct Reflector {
    /// Height in elements.
    height: f64,
    /// Slope of the height.
    slope: Vec2,
    /// Light it sends on, as a fraction of the flood, if any reaches it.
    radiosity: [f64; CHANNELS],
    /// The element that lights it.
    lit_by: Element,
}

impl Cookies {
    pub fn new(geometry: Geometry) -> Self {
        let affine = geometry.correspondence.affine;
        let samples = Extent {
            width: geometry.camera.width * SAMPLES,
            height: geometry.camera.height * SAMPLES,
        };
        let pitch = vec2(affine[0][0], affine[1][1]) * (1.0 / f64::from(SAMPLES));
        let fine = SurfaceGrid::new(geometry.light, samples, pitch);
        let coarse = SurfaceGrid::new(geometry.light, geometry.light, vec2(1.0, 1.0));
        let scale = relief_in_elements();
        let patches = (0..geometry.light.height)
            .flat_map(|v| (0..geometry.light.width).map(move |u| (u, v)))
            .map(|(u, v)| {
                let spot = coarse.spot(u, v);
                let beam = beam_through(spot.at, spot.height);
                Reflector {
                    height: spot.height * scale,
                    slope: coarse.slope(u, v) * scale,
                    radiosity: reflected(&coarse, &spot).diffuse,
                    lit_by: Element {
                        u: beam.u.floor() as i32,
                        v: beam.v.floor() as i32,
                    },
                }
            })
            .collect();
        Self {
            geometry,
            fine,
            patches,
        }
    }

    /// Light that reaches `pixel` by way of the patches around it.
    fn reflections(
        &self,
        pixel: CameraPx,
        albedo: [f64; CHANNELS],
        window: &mut WindowAccumulator,
    ) {
        let middle = SAMPLES / 2;
        let (i, j) = (pixel.x * SAMPLES + middle, pixel.y * SAMPLES + middle);
        let scale = relief_in_elements();
        let spot = self.fine.spot(i, j);
        let (height, slope) = (spot.height * scale, self.fine.slope(i, j) * scale);
        let reach = (window.side / 2) as i32;
        let (u, v) = (spot.at.u.floor() as i32, spot.at.v.floor() as i32);
        for dv in -reach..=reach {
            for du in -reach..=reach {
                let Some(m) = (Element {
                    u: u + du,
                    v: v + dv,
                })
                .index_in(self.geometry.light) else {
                    continue;
                };
                let patch = &self.patches[m];
                let towards = vec2(
                    f64::from(u + du) + 0.5 - spot.at.u,
                    f64::from(v + dv) + 0.5 - spot.at.v,
                );
                let rise = patch.height - height;
                // Normals are (-slope, 1) over their length; each must face the other patch.
                let here = rise - slope.dot(towards);
                let there = patch.slope.dot(towards) - rise;
                if here <= 0.0 || there <= 0.0 {
                    continue;
                }
                // A patch's area is its square element times the length of its (-slope, 1), which
                // cancels that of its own normal. The softening stands for the patch's extent.
                let square = towards.dot(towards) + rise * rise + 0.3;
                let facing = here / (1.0 + slope.dot(slope)).sqrt() * there;
                let form_factor = facing / (std::f64::consts::PI * square * square);
                let light = std::array::from_fn(|c| albedo[c] * form_factor * patch.radiosity[c]);
                window.add(patch.lit_by, light);
            }
        }
    }
}

impl SimulatedScene for Cookies {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn transport_function(&self, pixel: CameraPx, tau: &mut [[f32; CHANNELS]]) {
        let mut window = WindowAccumulator {
            origin: self.geometry.window_origin(pixel),
            side: self.geometry.window.side(),
            light: self.geometry.light,
            tau,
        };
        let weight = EXPOSURE / f64::from(SAMPLES * SAMPLES);
        let footprint = self.fine.pitch() + vec2(BLUR, BLUR);
        let mut albedo = [0.0; CHANNELS];
        for j in 0..SAMPLES {
            for i in 0..SAMPLES {
                let spot = self.fine.spot(pixel.x * SAMPLES + i, pixel.y * SAMPLES + j);
                let light = reflected(&self.fine, &spot);
                let seen = light.diffuse.map(|d| (d + light.highlight) * weight);
                window.add_box(beam_through(spot.at, spot.height), footprint, seen);
                for c in 0..CHANNELS {
                    albedo[c] += spot.albedo[c] * weight;
                }
            }
        }
        self.reflections(pixel, albedo, &mut window);
    }
}

/// Height of the tallest cookie in elements: what makes [`TILT`] have the slope [`TAN_TILT`].
fn relief_in_elements() -> f64 {
    TILT.length() / TAN_TILT
}

/// Where on the display the beam starts that hits `at` at `height`.
fn beam_through(at: LightPx, height: f64) -> LightPx {
    LightPx {
        u: at.u - TILT.x * height,
        v: at.v - TILT.y * height,
    }
}

/// What a spot sends on of the direct light, as a fraction of what a white tray would.
struct ReflectedLight {
    /// In all directions.
    diffuse: [f64; CHANNELS],
    /// Towards the camera only.
    highlight: f64,
}

/// Direct light off a spot: none in shadow, more off slopes that face the projector.
fn reflected(relief: &SurfaceGrid, spot: &SurfacePoint) -> ReflectedLight {
    if relief.shaded(spot, TILT) {
        return ReflectedLight {
            diffuse: [0.0; CHANNELS],
            highlight: 0.0,
        };
    }
    let slope = spot.unit_slope * (relief_in_elements() / SHADING_HALF_SIDE);
    // The normal is (-slope, 1) over its length, the projector lies towards (-rake, 1).
    let rake = TILT * (TAN_TILT / TILT.length());
    let normal = (1.0 + slope.dot(slope)).sqrt();
    let facing = ((1.0 + slope.dot(rake)) / normal).max(0.0);
    // Blinn's highlight: how near the normal is to halfway between camera and projector.
    let to_projector = (1.0 + rake.dot(rake)).sqrt();
    let half = rake * (1.0 / (1.0 + to_projector));
    let aligned = (1.0 + slope.dot(half)) / (normal * (1.0 + half.dot(half)).sqrt());
    ReflectedLight {
        diffuse: spot.albedo.map(|a| a * facing),
        highlight: spot.gloss * HIGHLIGHT * aligned.max(0.0).powf(SHININESS),
    }
}

/// One pixel's light transport function while it is being gathered.
struct WindowAccumulator<'a> {
    origin: Element,
    side: u32,
    light: Extent,
    tau: &'a mut [[f32; CHANNELS]],
}

impl WindowAccumulator<'_> {
    /// Adds light from `element`, unless it is off the display or beyond the window.
    fn add(&mut self, element: Element, light: [f64; CHANNELS]) {
        let window = Extent {
            width: self.side,
            height: self.side,
        };
        let within = Element {
            u: element.u - self.origin.u,
            v: element.v - self.origin.v,
        };
        if let (Some(s), Some(_)) = (within.index_in(window), element.index_in(self.light)) {
            for c in 0..CHANNELS {
                self.tau[s][c] += light[c] as f32;
            }
        }
    }

    /// Adds light that comes evenly from the box of extent `size` around `middle`.
    fn add_box(&mut self, middle: LightPx, size: Vec2, light: [f64; CHANNELS]) {
        let (u0, u1) = (middle.u - size.x / 2.0, middle.u + size.x / 2.0);
        let (v0, v1) = (middle.v - size.y / 2.0, middle.v + size.y / 2.0);
        let overlap = |from: f64, to: f64, m: i32| {
            (to.min(f64::from(m) + 1.0) - from.max(f64::from(m))) / (to - from)
        };
        for v in v0.floor() as i32..=v1.floor() as i32 {
            for u in u0.floor() as i32..=u1.floor() as i32 {
                let share = overlap(u0, u1, u) * overlap(v0, v1, v);
                if share > 0.0 {
                    self.add(Element { u, v }, light.map(|l| l * share));
                }
            }
        }
    }
}
