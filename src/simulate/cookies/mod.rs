//! Cookies on a tray, lit by a collimated projector at an angle and seen from above.
//!
//! τ of a camera pixel, which sees a small area of an opaque surface, is the sum of
//!
//! - direct light, from the few light elements whose parallel beams hit that area. Its height displaces these
//!   elements along the projector's tilt (parallax). A taller object in the beam casts a shadow: no direct
//!   light;
//! - one interreflection: light that the surface around the area reflects onto it.

mod surface_grid;
mod tray;

use surface_grid::{SurfaceGrid, SurfacePoint};

use super::simulated_scene::SimulatedScene;
use super::vec2::{Vec2, vec2};
use crate::transport::{CHANNELS, CameraPixel, Extent, Geometry, LightElement};

/// Samples along each side of a camera pixel.
const SAMPLES_PER_SIDE: u32 = 3;
/// Displacement of a beam along u and v, in elements, while it descends by the height of the tallest cookie.
/// Direct light stays inside the window; on the tray it is in the window's centre, so that none is lost at
/// the edge of the light plane.
const TILT: Vec2 = vec2(3.7, 2.5);
/// Tangent of the angle between the beams and the vertical: 42°.
const TAN_TILT: f64 = 0.9;
/// Side of the square that a light element is blurred by, in elements.
const BLUR: f64 = 0.25;
/// Exposure: the measurement of a white card on the tray.
const EXPOSURE: f64 = 0.70;
/// Brightest specular highlight, and its exponent.
const HIGHLIGHT: f64 = 0.40;
const SHININESS: f64 = 50.0;
/// Half of the light plane's shorter side, in elements, for which parallax and shading are consistent. On a finer light
/// plane true parallax would need a wider band: parallax there is that of a steeper projector, shading stays the same.
const SHADING_HALF_SIDE: f64 = 32.0;

#[derive(Debug)]
pub(super) struct CookiesScene {
    geometry: Geometry,
    /// Surface samples, `SAMPLES_PER_SIDE`² for each camera pixel.
    surface: SurfaceGrid,
    /// One reflector for each light element.
    reflectors: Vec<RadiosityPatch>,
}

/// An area of surface, one element wide, that reflects light onto its surroundings.
#[derive(Clone, Copy, Debug)]
struct RadiosityPatch {
    /// Height in elements.
    height: f64,
    /// Gradient of the height.
    slope: Vec2,
    /// Reflected light, as a fraction of the flood.
    radiosity: [f64; CHANNELS],
    /// The element that lights it.
    light_element: LightElement,
}

impl CookiesScene {
    pub fn new(geometry: Geometry) -> Self {
        let affine = geometry.correspondence.affine;
        let samples = Extent::new(
            geometry.camera.width * SAMPLES_PER_SIDE,
            geometry.camera.height * SAMPLES_PER_SIDE,
        );
        let pitch = vec2(affine[0][0], affine[1][1]) * (1.0 / f64::from(SAMPLES_PER_SIDE));
        let surface = SurfaceGrid::new(geometry.light, samples, pitch);
        let element_surface = SurfaceGrid::new(geometry.light, geometry.light, vec2(1.0, 1.0));
        let scale = max_height_elements();
        let reflector = |(u, v)| {
            let point = element_surface.point(u, v);
            RadiosityPatch {
                height: point.surface.height * scale,
                slope: element_surface.slope(u, v) * scale,
                radiosity: reflected(&element_surface, &point).diffuse,
                light_element: element_at(beam_origin(&point)),
            }
        };
        let reflectors = geometry.light.cells().map(reflector).collect();
        Self {
            geometry,
            surface,
            reflectors,
        }
    }

    /// Adds the light that the reflectors around `pixel` send it.
    fn add_interreflections(
        &self,
        pixel: CameraPixel,
        albedo: [f64; CHANNELS],
        window: &mut TransportFunctionAccumulator,
    ) {
        let [i, j] = [pixel.x, pixel.y].map(|x| x * SAMPLES_PER_SIDE + SAMPLES_PER_SIDE / 2);
        let scale = max_height_elements();
        let point = self.surface.point(i, j);
        let height = point.surface.height * scale;
        let slope = self.surface.slope(i, j) * scale;
        let radius = (self.geometry.window.side() / 2) as i32;
        let LightElement { u, v } = element_at(point.at);
        for v in v - radius..=v + radius {
            for u in u - radius..=u + radius {
                let Some(m) = (LightElement { u, v }).index_in(self.geometry.light) else {
                    continue;
                };
                let reflector = &self.reflectors[m];
                let offset = vec2(f64::from(u) + 0.5, f64::from(v) + 0.5) - point.at;
                let rise = reflector.height - height;
                // Each surface must face the other. Normals are (-slope, 1) over their length.
                let here = rise - slope.dot(offset);
                let there = reflector.slope.dot(offset) - rise;
                if here <= 0.0 || there <= 0.0 {
                    continue;
                }
                // The reflector's area is 1 times the length of its (-slope, 1), which cancels the length of
                // its normal. The 0.3 softens the pole, as the reflector is not a point.
                let squared_distance = offset.dot(offset) + rise * rise + 0.3;
                let facing = here / (1.0 + slope.dot(slope)).sqrt() * there;
                let form_factor =
                    facing / (std::f64::consts::PI * squared_distance * squared_distance);
                let light =
                    std::array::from_fn(|c| albedo[c] * form_factor * reflector.radiosity[c]);
                window.add(reflector.light_element, light);
            }
        }
    }
}

impl SimulatedScene for CookiesScene {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn transport_function(&self, pixel: CameraPixel, tau: &mut [[f32; CHANNELS]]) {
        let mut window = TransportFunctionAccumulator {
            origin: self.geometry.window_origin(pixel),
            geometry: &self.geometry,
            tau,
        };
        let weight = EXPOSURE / f64::from(SAMPLES_PER_SIDE * SAMPLES_PER_SIDE);
        let footprint = self.surface.pitch + vec2(BLUR, BLUR);
        let mut albedo = [0.0; CHANNELS];
        for (i, j) in Extent::new(SAMPLES_PER_SIDE, SAMPLES_PER_SIDE).cells() {
            let [x, y] = [pixel.x, pixel.y].map(|first| first * SAMPLES_PER_SIDE);
            let point = self.surface.point(x + i, y + j);
            let light = reflected(&self.surface, &point);
            let measured = light.diffuse.map(|d| (d + light.highlight) * weight);
            window.add_box(beam_origin(&point), footprint, measured);
            for c in 0..CHANNELS {
                albedo[c] += point.surface.albedo[c] * weight;
            }
        }
        self.add_interreflections(pixel, albedo, &mut window);
    }
}

/// Height of the tallest cookie in elements, from [`TILT`] and [`TAN_TILT`].
fn max_height_elements() -> f64 {
    TILT.length() / TAN_TILT
}

/// Where the beam that hits `point` starts on the light plane.
fn beam_origin(point: &SurfacePoint) -> Vec2 {
    point.at - TILT * point.surface.height
}

/// The light element at a position.
fn element_at(p: Vec2) -> LightElement {
    LightElement {
        u: p.x.floor() as i32,
        v: p.y.floor() as i32,
    }
}

/// Direct light that a point reflects, as a fraction of what a white tray reflects.
#[derive(Default)]
struct DirectReflection {
    /// In all directions.
    diffuse: [f64; CHANNELS],
    /// Towards the camera only.
    highlight: f64,
}

/// The direct light that `point` reflects: none in shadow, more if its slope faces the projector.
fn reflected(surface: &SurfaceGrid, point: &SurfacePoint) -> DirectReflection {
    if surface.is_shaded(point, TILT) {
        return DirectReflection::default();
    }
    let slope = point.unit_slope * (max_height_elements() / SHADING_HALF_SIDE);
    // The normal is (-slope, 1) over its length; (-rake, 1) points to the projector.
    let rake = TILT * (TAN_TILT / TILT.length());
    let normal = (1.0 + slope.dot(slope)).sqrt();
    let facing = ((1.0 + slope.dot(rake)) / normal).max(0.0);
    // Blinn's highlight: the cosine between the normal and the half vector of camera and projector.
    let to_projector = (1.0 + rake.dot(rake)).sqrt();
    let half = rake * (1.0 / (1.0 + to_projector));
    let aligned = (1.0 + slope.dot(half)) / (normal * (1.0 + half.dot(half)).sqrt());
    DirectReflection {
        diffuse: point.surface.albedo.map(|a| a * facing),
        highlight: point.surface.gloss * HIGHLIGHT * aligned.max(0.0).powf(SHININESS),
    }
}

/// Sums one pixel's light transport function.
struct TransportFunctionAccumulator<'a> {
    origin: LightElement,
    geometry: &'a Geometry,
    tau: &'a mut [[f32; CHANNELS]],
}

impl TransportFunctionAccumulator<'_> {
    /// Adds light from `element`; ignores elements outside the light plane or the window.
    fn add(&mut self, element: LightElement, light: [f64; CHANNELS]) {
        let slot = self.geometry.window.slot(self.origin, element);
        if let (Some(s), Some(_)) = (slot, element.index_in(self.geometry.light)) {
            for c in 0..CHANNELS {
                self.tau[s][c] += light[c] as f32;
            }
        }
    }

    /// Adds light that comes uniformly from the box of extent `size` around `centre`.
    fn add_box(&mut self, centre: Vec2, size: Vec2, light: [f64; CHANNELS]) {
        let (first, last) = (centre - size * 0.5, centre + size * 0.5);
        let overlap = |from: f64, to: f64, m: i32| {
            (to.min(f64::from(m) + 1.0) - from.max(f64::from(m))) / (to - from)
        };
        for v in first.y.floor() as i32..=last.y.floor() as i32 {
            for u in first.x.floor() as i32..=last.x.floor() as i32 {
                let share = overlap(first.x, last.x, u) * overlap(first.y, last.y, v);
                if share > 0.0 {
                    self.add(LightElement { u, v }, light.map(|l| l * share));
                }
            }
        }
    }
}
