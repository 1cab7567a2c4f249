//! Vectors of the plane, and unit coordinates, which do not depend on the resolution.

use std::ops::{Add, Mul, Sub};

use crate::transport::{Extent, LightPosition};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Vec2 {
    pub x: f64,
    pub y: f64,
}

pub(super) const fn vec2(x: f64, y: f64) -> Vec2 {
    Vec2 { x, y }
}

impl Vec2 {
    pub fn length(self) -> f64 {
        self.x.hypot(self.y)
    }

    pub fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    /// Rotated by `angle` radians from x towards y.
    pub fn rotated(self, angle: f64) -> Self {
        let (s, c) = angle.sin_cos();
        vec2(c * self.x - s * self.y, s * self.x + c * self.y)
    }
}

impl From<LightPosition> for Vec2 {
    fn from(p: LightPosition) -> Self {
        vec2(p.u, p.v)
    }
}

impl Add for Vec2 {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        vec2(self.x + o.x, self.y + o.y)
    }
}

impl Sub for Vec2 {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        vec2(self.x - o.x, self.y - o.y)
    }
}

impl Mul<f64> for Vec2 {
    type Output = Self;
    fn mul(self, k: f64) -> Self {
        vec2(self.x * k, self.y * k)
    }
}

/// Unit coordinates of a light plane: the origin in its centre, ±1 at the ends of its shorter side, y downwards.
#[derive(Clone, Copy, Debug)]
pub(super) struct CentredCoordinates {
    centre: Vec2,
    half: f64,
}

impl CentredCoordinates {
    pub fn new(light: Extent) -> Self {
        let (w, h) = (f64::from(light.width), f64::from(light.height));
        Self {
            centre: vec2(w / 2.0, h / 2.0),
            half: w.min(h) / 2.0,
        }
    }

    /// The unit coordinates of a position in light elements.
    pub fn at(&self, p: Vec2) -> Vec2 {
        (p - self.centre) * (1.0 / self.half)
    }
}

/// 0 below `from`, 1 above `to`, a cubic between.
pub(super) fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Linear interpolation: `a` at `t` = 0, `b` at 1.
pub(super) fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// [`mix`] for colours.
pub(super) fn mix3(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|c| mix(a[c], b[c], t))
}
