//! A stained-glass window, lit from behind by a monitor.
//!
//! τ of a camera pixel, which looks through one point of the window, is
//!
//! ```text
//! τ_m = attenuation · visible_m · (b · G_peak(m) + (1 − b) · (0.45 G_narrow(m) + 0.55 G_wide(m)))
//! ```
//!
//! with Gaussians G, integrated over light element m: the ballistic peak, displaced by refraction at the rough faces,
//! and a scattering tail, wider for red. b is the ballistic share. The attenuation is the transmittance of glass, paint
//! and lead over the pixel's area; visible_m is the share of element m that lead does not hide.

mod glass;
mod rose;

use glass::{GlassOptics, transmittance};
use rose::{GlassSample, glass_at};

use super::gradient_noise::{noise, unit_hash};
use super::simulated_scene::SimulatedScene;
use super::vec2::{CentredCoordinates, Vec2, mix, smoothstep, vec2};
use crate::transport::{CHANNELS, CameraPixel, Extent, Geometry};

/// Samples along each side of a pixel or element, for averages over its area.
const SAMPLES_PER_SIDE: u32 = 4;
const SAMPLES: f64 = (SAMPLES_PER_SIDE * SAMPLES_PER_SIDE) as f64;
/// Transmittance of lead: a little stray light.
const LEAD_TRANSMITTANCE: [f64; CHANNELS] = [0.0030, 0.0029, 0.0027];
/// Visible share of an element that lead hides completely: the window is at a distance from the monitor, so
/// that light passes around the lead.
const BEHIND_LEAD_SHARE: f64 = 0.50;
/// Share of the light that the two faces of the glass do not reflect.
const FACE_TRANSMITTANCE: f64 = 0.97;
/// Largest displacement of the ballistic peak, in elements: the peak stays inside the window.
const MAX_DISPLACEMENT: f64 = 4.0;
/// Width of the tail in each channel, relative to green: wider for red, because the glass absorbs the blue
/// light that travels far.
const RELATIVE_TAIL_WIDTH: [f64; CHANNELS] = [1.14, 1.0, 0.88];

#[derive(Debug)]
pub(super) struct StainedGlassScene {
    geometry: Geometry,
    plane: CentredCoordinates,
    /// Distance between camera pixels along u and v, in light elements.
    pitch: Vec2,
    /// Visible share of each light element, `[M]`.
    visible: Vec<f32>,
}

impl StainedGlassScene {
    pub fn new(geometry: Geometry) -> Self {
        let plane = CentredCoordinates::new(geometry.light);
        let is_hidden = |p| f64::from(u8::from(glass_at(plane.at(p)).clearance < 0.0));
        let visible = |(u, v)| {
            let corner = vec2(f64::from(u), f64::from(v));
            let hidden: f64 = samples(corner, vec2(1.0, 1.0)).map(is_hidden).sum();
            mix(1.0, BEHIND_LEAD_SHARE, hidden / SAMPLES) as f32
        };
        let visible = geometry.light.cells().map(visible).collect();
        let affine = geometry.correspondence.affine;
        Self {
            geometry,
            plane,
            pitch: vec2(affine[0][0], affine[1][1]),
            visible,
        }
    }

    /// The mean transmittance over a pixel's area.
    fn attenuation(&self, centre: Vec2) -> [f64; CHANNELS] {
        let mut sum = [0.0; CHANNELS];
        for p in samples(centre - self.pitch * 0.5, self.pitch) {
            let p = self.plane.at(p);
            let point = transmittance_at(&glass_at(p), p);
            for c in 0..CHANNELS {
                sum[c] += point[c];
            }
        }
        sum.map(|s| s / SAMPLES)
    }

    /// Displacement by refraction at the point `centre`; both in light elements.
    fn displacement(&self, optics: &GlassOptics, piece: u32, centre: Vec2) -> Vec2 {
        let p = self.plane.at(centre);
        // Each piece is another part of the sheet.
        let offset = vec2(unit_hash(piece, 61), unit_hash(piece, 62)) * 90.0;
        // The gradient of the noise has a root mean square of about 0.9 along each axis.
        let faces = noise(p * (1.0 / optics.grain) + offset, 63).1;
        // The roughness varies over the sheet, and the whole window is slightly warped.
        let roughness = 1.0 + 0.9 * noise(p * 2.3, 64).0;
        let warp = noise(p * 1.7, 65).1;
        let d = faces * (optics.ripple * roughness / 0.9) + warp * 0.35;
        d * (MAX_DISPLACEMENT / d.length()).min(1.0)
    }
}

impl SimulatedScene for StainedGlassScene {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn transport_function(&self, pixel: CameraPixel, tau: &mut [[f32; CHANNELS]]) {
        let centre = Vec2::from(self.geometry.correspondence.at(pixel));
        let GlassSample { piece, glass, .. } = glass_at(self.plane.at(centre));
        let optics = glass.optics();
        let displacement = self.displacement(&optics, piece, centre);
        // The gradient of the displacement stretches the pixel's footprint.
        let moved = |d: Vec2| self.displacement(&optics, piece, centre + d) - displacement + d;
        let right = moved(vec2(self.pitch.x, 0.0));
        let down = moved(vec2(0.0, self.pitch.y));
        // A box has the variance side² / 12. The footprint's effect is limited.
        let width = |dx: f64, dy: f64| {
            let footprint = (dx * dx + dy * dy) / 12.0;
            (optics.peak * optics.peak + footprint.min(0.6)).sqrt()
        };
        let peak = vec2(width(right.x, down.x), width(right.y, down.y));

        let origin = self.geometry.window_origin(pixel);
        let side = self.geometry.window.side() as usize;
        let from_origin = centre - vec2(f64::from(origin.u), f64::from(origin.v));
        let attenuation = self.attenuation(centre);
        // Scattering halves the displacement.
        let tail_centre = from_origin + displacement * 0.5;
        let thickness = 0.85 + 0.3 * unit_hash(piece, 66);
        let ballistic = SeparableGaussian::new(side, from_origin + displacement, peak);
        let ballistic_share = optics.ballistic.powf(thickness);
        let scattered = 1.0 - ballistic_share;
        for c in 0..CHANNELS {
            let wide = optics.tail * RELATIVE_TAIL_WIDTH[c] * thickness.sqrt();
            let narrow = SeparableGaussian::new(side, tail_centre, vec2(0.5, 0.5) * wide);
            let wide = SeparableGaussian::new(side, tail_centre, vec2(1.0, 1.0) * wide);
            let parts = [
                (ballistic_share, &ballistic),
                (0.45 * scattered, &narrow),
                (0.55 * scattered, &wide),
            ];
            for (s, tau) in tau.iter_mut().enumerate() {
                let element = self.geometry.window.element(origin, s);
                let Some(m) = element.index_in(self.geometry.light) else {
                    continue;
                };
                let (i, j) = (s % side, s / side);
                let part = |(weight, gaussian): &(f64, &SeparableGaussian)| {
                    weight * gaussian.along_u[i] * gaussian.along_v[j]
                };
                let share: f64 = parts.iter().map(part).sum();
                tau[c] = (share * attenuation[c]) as f32 * self.visible[m];
            }
        }
    }
}

/// The transmittance at one point.
fn transmittance_at(point: &GlassSample, p: Vec2) -> [f64; CHANNELS] {
    if point.clearance < 0.0 {
        return LEAD_TRANSMITTANCE;
    }
    // Shading paint along the lead.
    let shade = mix(0.72, 1.0, smoothstep(0.0, 0.013, point.clearance));
    // Brown paint absorbs blue most.
    let paint = [0.78, 0.86, 0.92].map(|absorbed| 1.0 - absorbed * point.paint);
    let glass = transmittance(&point.glass.optics(), point.piece, p);
    std::array::from_fn(|c| glass[c] * paint[c] * shade * FACE_TRANSMITTANCE)
}

/// A Gaussian of integral 1, separated by axis and integrated over each element of a window.
struct SeparableGaussian {
    along_u: Vec<f64>,
    along_v: Vec<f64>,
}

impl SeparableGaussian {
    /// `centre` from the window's corner and `width` (standard deviation), in elements.
    fn new(side: usize, centre: Vec2, width: Vec2) -> Self {
        let axis = |centre: f64, width: f64| {
            let scale = std::f64::consts::FRAC_1_SQRT_2 / width;
            let cumulative = |edge: usize| 0.5 * libm::erf((edge as f64 - centre) * scale);
            let mut last = cumulative(0);
            let mut share = |m: usize| {
                let next = cumulative(m + 1);
                next - std::mem::replace(&mut last, next)
            };
            (0..side).map(&mut share).collect()
        };
        Self {
            along_u: axis(centre.x, width.x),
            along_v: axis(centre.y, width.y),
        }
    }
}

/// The centres of the cells of a grid over the box from `corner` of extent `size`.
fn samples(corner: Vec2, size: Vec2) -> impl Iterator<Item = Vec2> {
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(SAMPLES_PER_SIDE);
    let cells = Extent::new(SAMPLES_PER_SIDE, SAMPLES_PER_SIDE).cells();
    cells.map(move |(i, j)| corner + vec2(at(i) * size.x, at(j) * size.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::simulated_scene::scene_geometry;

    #[test]
    fn gaussian_has_unit_weight_and_its_centre() {
        let gaussian = SeparableGaussian::new(15, vec2(6.3, 8.9), vec2(0.6, 1.4));
        for (axis, centre) in [(&gaussian.along_u, 6.3), (&gaussian.along_v, 8.9)] {
            let weight: f64 = axis.iter().sum();
            let mean: f64 = axis
                .iter()
                .enumerate()
                .map(|(m, w)| (m as f64 + 0.5) * w)
                .sum();
            assert!((weight - 1.0).abs() < 1e-4 && (mean - centre).abs() < 1e-2);
        }
    }

    #[test]
    fn lead_is_nearly_black_and_glass_is_not() {
        let side = |n| Extent::new(n, n);
        let scene = StainedGlassScene::new(
            scene_geometry(side(192), side(96), Default::default()).unwrap(),
        );
        let geometry = scene.geometry();
        let plane = CentredCoordinates::new(geometry.light);
        let (mut lead, mut glass) = (0, 0);
        for rect in geometry.tiles() {
            let functions = scene.tile(rect);
            let area = geometry.window.area();
            for (pixel, tau) in rect.pixels().zip(functions.tau.chunks_exact(area)) {
                let flood: f32 = tau.iter().flatten().sum::<f32>() / 3.0;
                let at = geometry.correspondence.at(pixel).into();
                let clearance = glass_at(plane.at(at)).clearance;
                if is_covered(&plane, geometry, pixel) {
                    lead += 1;
                    assert!(flood < 0.004, "lead at {pixel:?} sends {flood}");
                } else if clearance > 0.01 {
                    glass += 1;
                    assert!(flood > 0.03, "glass at {pixel:?} sends {flood}");
                }
            }
        }
        assert!(lead > 50 && glass > 1000, "{lead} {glass}");
    }

    /// Whether lead covers all of a pixel.
    fn is_covered(plane: &CentredCoordinates, geometry: &Geometry, pixel: CameraPixel) -> bool {
        let at = Vec2::from(geometry.correspondence.at(pixel));
        let affine = geometry.correspondence.affine;
        let pitch = vec2(affine[0][0], affine[1][1]);
        samples(at - pitch * 0.5, pitch).all(|p| glass_at(plane.at(p)).clearance < 0.0)
    }
}
