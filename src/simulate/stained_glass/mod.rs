//! Stained glass lit from behind by a display.
//!
//! A camera pixel looks through one spot of the pane. Part of the light it sees comes straight
//! through, from where the refracting rough faces let it look: the ballistic peak. The rest is
//! scattered in the glass and comes from all around: the tail, a sum of two Gaussians, wider for
//! red. Both are integrated over the light elements' areas and attenuated by the glass's colour.
//! Lead stops light on the camera's side, and shades the elements behind it.

mod glass;
mod rose;

use glass::{Optics, transmittance};
use rose::{GlassPoint, glass_at};

use super::SimulatedScene;
use super::coordinates::{UnitPlane, Vec2, mix, smoothstep, vec2};
use super::gradient_noise::{noise, unit_hash};
use crate::transport::{CHANNELS, CameraPx, Element, Geometry, LightPx};

/// Samples along each side of a pixel or element when its coverage by lead is counted.
const SAMPLES_PER_SIDE: u32 = 4;
/// What lead lets through to the camera: a trace of stray light.
const LEAD_TRANSMITTANCE: [f64; CHANNELS] = [0.0030, 0.0029, 0.0027];
/// Light that still gets around the lead from an element wholly behind it: the pane stands a little
/// off the display.
const BEHIND_LEAD_SHARE: f64 = 0.50;
/// Share of the light that the two faces do not reflect.
const FACE_TRANSMITTANCE: f64 = 0.97;
/// Furthest the ballistic peak moves, in elements: with its width it stays inside the window.
const MAX_DISPLACEMENT: f64 = 4.0;
/// Width of the tail in each channel, relative to green: scattering grows with wavelength here
/// because the blue light that would go furthest is absorbed.
const RELATIVE_TAIL_WIDTH: [f64; CHANNELS] = [1.14, 1.0, 0.88];

/// The scene.
#[derive(Debug)]
pub(super) struct StainedGlass {
    geometry: Geometry,
    plane: UnitPlane,
    /// Light elements from one camera pixel to the next, along u and v.
    pitch: Vec2,
    /// Share of each light element that no lead hides, `[M]`.
    clear: Vec<f32>,
}

impl StainedGlass {
    pub fn new(geometry: Geometry) -> Self {
        let plane = UnitPlane::new(geometry.light);
        let mut clear = Vec::with_capacity(geometry.light.area());
        for v in 0..geometry.light.height {
            for u in 0..geometry.light.width {
                let corner = vec2(f64::from(u), f64::from(v));
                let hidden = mean_over(corner, vec2(1.0, 1.0), |p| {
                    f64::from(u8::from(glass_at(plane.at(p)).clearance < 0.0))
                });
                clear.push(mix(1.0, BEHIND_LEAD_SHARE, hidden) as f32);
            }
        }
        let affine = geometry.correspondence.affine;
        Self {
            geometry,
            plane,
            pitch: vec2(affine[0][0], affine[1][1]),
            clear,
        }
    }

    /// What the pane lets through over a pixel's area, on the camera's side.
    fn attenuation(&self, centre: Vec2) -> [f64; CHANNELS] {
        let mut sum = [0.0; CHANNELS];
        let corner = centre - self.pitch * 0.5;
        for_each_sample(corner, self.pitch, |p| {
            let p = self.plane.at(p);
            let seen = transmitted(&glass_at(p), p);
            for c in 0..CHANNELS {
                sum[c] += seen[c];
            }
        });
        sum.map(|s| s / f64::from(SAMPLES_PER_SIDE * SAMPLES_PER_SIDE))
    }

    /// Where refraction moves the view of the point `centre` (light elements), in elements.
    fn displacement(&self, optics: &Optics, piece: u32, centre: Vec2) -> Vec2 {
        let p = self.plane.at(LightPx {
            u: centre.x,
            v: centre.y,
        });
        // Each piece is cut from another part of the sheet.
        let offset = vec2(unit_hash(piece, 61), unit_hash(piece, 62)) * 90.0;
        // The slope of unit gradient noise has a root mean square of about 0.9 along each axis.
        let faces = noise(p * (1.0 / optics.grain) + offset, 63).1;
        // The sheet is not equally rough all over, and the whole pane is a little warped.
        let uneven = 1.0 + 0.9 * noise(p * 2.3, 64).0;
        let warp = noise(p * 1.7, 65).1;
        let d = faces * (optics.ripple * uneven / 0.9) + warp * 0.35;
        let length = d.length();
        if length > MAX_DISPLACEMENT {
            d * (MAX_DISPLACEMENT / length)
        } else {
            d
        }
    }
}

impl SimulatedScene for StainedGlass {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn transport_function(&self, pixel: CameraPx, tau: &mut [[f32; CHANNELS]]) {
        let at = self.geometry.correspondence.at(pixel);
        let centre = vec2(at.u, at.v);
        let GlassPoint { piece, glass, .. } = glass_at(self.plane.at(at));
        let optics = glass.optics();
        let seen = self.displacement(&optics, piece, centre);
        // How the footprint of a pixel is stretched by the slope of the displacement.
        let ahead = |d: Vec2| self.displacement(&optics, piece, centre + d) - seen;
        let right = ahead(vec2(self.pitch.x, 0.0)) + vec2(self.pitch.x, 0.0);
        let down = ahead(vec2(0.0, self.pitch.y)) + vec2(0.0, self.pitch.y);
        // A box has a twelfth of its square as variance. Past a point glass just blurs.
        let width = |across: f64, along: f64| {
            let footprint = (across * across + along * along) / 12.0;
            (optics.peak * optics.peak + footprint.min(0.6)).sqrt()
        };
        let peak = vec2(width(right.x, down.x), width(right.y, down.y));

        let origin = self.geometry.window_origin(pixel);
        let side = self.geometry.window.side() as usize;
        let from_origin = centre - vec2(f64::from(origin.u), f64::from(origin.v));
        let attenuation = self.attenuation(centre);
        // The tail has forgotten half of the way it was refracted.
        let middle = from_origin + seen * 0.5;
        let thick = 0.85 + 0.3 * unit_hash(piece, 66);
        let ballistic = SeparableGaussian::new(side, from_origin + seen, peak);
        for c in 0..CHANNELS {
            let wide = optics.tail * RELATIVE_TAIL_WIDTH[c] * thick.sqrt();
            let narrow = SeparableGaussian::new(side, middle, vec2(0.5, 0.5) * wide);
            let wide = SeparableGaussian::new(side, middle, vec2(1.0, 1.0) * wide);
            let straight = optics.ballistic.powf(thick);
            let scattered = 1.0 - straight;
            let parts = [
                (straight, &ballistic),
                (0.45 * scattered, &narrow),
                (0.55 * scattered, &wide),
            ];
            for (s, tau) in tau.iter_mut().enumerate() {
                let (i, j) = (s % side, s / side);
                let element = Element {
                    u: origin.u + i as i32,
                    v: origin.v + j as i32,
                };
                let Some(m) = element.index_in(self.geometry.light) else {
                    continue;
                };
                let share: f64 = parts
                    .iter()
                    .map(|(w, b)| w * b.along_u[i] * b.along_v[j])
                    .sum();
                tau[c] = (share * attenuation[c]) as f32 * self.clear[m];
            }
        }
    }
}

/// What the pane lets through at one point.
fn transmitted(spot: &GlassPoint, p: Vec2) -> [f64; CHANNELS] {
    if spot.clearance < 0.0 {
        return LEAD_TRANSMITTANCE;
    }
    // Painters shade pieces towards the lead: it rounds them, and hides where the putty is.
    let shade = mix(0.72, 1.0, smoothstep(0.0, 0.013, spot.clearance));
    // The brown stops blue most.
    let paint = [0.78, 0.86, 0.92].map(|stopped| 1.0 - stopped * spot.paint);
    let glass = transmittance(&spot.glass.optics(), spot.piece, p);
    std::array::from_fn(|c| glass[c] * paint[c] * shade * FACE_TRANSMITTANCE)
}

/// A Gaussian of unit weight, separated and integrated over each element of a window.
struct SeparableGaussian {
    along_u: Vec<f64>,
    along_v: Vec<f64>,
}

impl SeparableGaussian {
    /// `centre` from the window's corner and `width` (standard deviation), in elements.
    fn new(side: usize, centre: Vec2, width: Vec2) -> Self {
        let axis = |centre: f64, width: f64| {
            let scale = std::f64::consts::FRAC_1_SQRT_2 / width;
            let below = |edge: usize| 0.5 * libm::erf((edge as f64 - centre) * scale);
            let mut last = below(0);
            let mut share = |m: usize| {
                let next = below(m + 1);
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

/// Calls `f` at the centres of the cells of a grid over the box at `corner` of extent `size`.
fn for_each_sample(corner: Vec2, size: Vec2, mut f: impl FnMut(LightPx)) {
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(SAMPLES_PER_SIDE);
    for j in 0..SAMPLES_PER_SIDE {
        for i in 0..SAMPLES_PER_SIDE {
            f(LightPx {
                u: corner.x + at(i) * size.x,
                v: corner.y + at(j) * size.y,
            });
        }
    }
}

fn mean_over(corner: Vec2, size: Vec2, f: impl Fn(LightPx) -> f64) -> f64 {
    let mut sum = 0.0;
    for_each_sample(corner, size, |p| sum += f(p));
    sum / f64::from(SAMPLES_PER_SIDE * SAMPLES_PER_SIDE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::SceneKind;
    use crate::transport::Extent;

    #[test]
    fn a_blob_has_unit_weight_at_its_place() {
        let blob = SeparableGaussian::new(15, vec2(6.3, 8.9), vec2(0.6, 1.4));
        for (axis, centre) in [(&blob.along_u, 6.3), (&blob.along_v, 8.9)] {
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
    fn lead_is_near_black_and_glass_is_not() {
        let side = |n| Extent {
            width: n,
            height: n,
        };
        let scene = SceneKind::StainedGlass.build(side(192), side(96)).unwrap();
        let geometry = scene.geometry();
        let plane = UnitPlane::new(geometry.light);
        let (mut lead, mut glass) = (0, 0);
        for rect in geometry.tiles() {
            let functions = scene.tile(rect);
            let area = geometry.window.area();
            for (pixel, tau) in rect.pixels().zip(functions.tau.chunks_exact(area)) {
                let flood: f32 = tau.iter().flatten().sum::<f32>() / 3.0;
                let clearance = glass_at(plane.at(geometry.correspondence.at(pixel))).clearance;
                if covered(&plane, geometry, pixel) {
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

    fn covered(plane: &UnitPlane, geometry: &Geometry, pixel: CameraPx) -> bool {
        let at = geometry.correspondence.at(pixel);
        let affine = geometry.correspondence.affine;
        let pitch = vec2(affine[0][0], affine[1][1]);
        let mut covered = true;
        for_each_sample(vec2(at.u, at.v) - pitch * 0.5, pitch, |p| {
            covered &= glass_at(plane.at(p)).clearance < 0.0;
        });
        covered
    }
}
