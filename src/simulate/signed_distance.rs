//! Signed distances to the outlines of shapes, in unit coordinates: negative inside.

use std::f64::consts::TAU;

use super::vec2::{Vec2, vec2};

pub(super) fn circle(p: Vec2, radius: f64) -> f64 {
    p.length() - radius
}

/// Distance to the segment from `a` to `b`.
pub(super) fn segment(p: Vec2, a: Vec2, b: Vec2) -> f64 {
    let (pa, ba) = (p - a, b - a);
    let t = (pa.dot(ba) / ba.dot(ba)).clamp(0.0, 1.0);
    (pa - ba * t).length()
}

/// The intersection of two discs: tips at `(±half_length, 0)`, `half_width` at x = 0.
pub(super) fn vesica(p: Vec2, half_length: f64, half_width: f64) -> f64 {
    // Each arc is a circle through both tips with its centre on the other side of the x axis.
    let offset = (half_length * half_length - half_width * half_width) / (2.0 * half_width);
    let radius = half_width + offset;
    circle(vec2(p.x, p.y.abs() + offset), radius)
}

/// A star with `points` tips at `outer` and as many notches at `inner`; one tip points to -y.
pub(super) fn star(p: Vec2, points: u32, outer: f64, inner: f64) -> f64 {
    let half = TAU / f64::from(points) / 2.0;
    let (_, q) = fold(vec2(-p.y, p.x), points, 0.0);
    let q = vec2(q.x, q.y.abs());
    let (tip, notch) = (vec2(outer, 0.0), vec2(inner, 0.0).rotated(half));
    let edge = notch - tip;
    let outward = (q.x - tip.x) * edge.y - (q.y - tip.y) * edge.x;
    segment(q, tip, notch).copysign(outward)
}

/// A heart 2 wide and 1.8 high for `size` = 1, its point towards +y (after Inigo Quilez).
pub(super) fn heart(p: Vec2, size: f64) -> f64 {
    // His heart has its point at the origin, points to -y and is 1.2 wide.
    let scale = 0.6 / size;
    let q = vec2(p.x.abs() * scale, 0.55 - p.y * scale);
    let d = if q.x + q.y > 1.0 {
        circle(q - vec2(0.25, 0.75), 2f64.sqrt() / 4.0)
    } else {
        let notch = (q - vec2(0.0, 1.0)).length();
        let flank = 0.5 * (q.x + q.y).max(0.0);
        let edge = (q - vec2(flank, flank)).length();
        notch.min(edge).copysign(q.x - q.y)
    };
    d / scale
}

/// The union of two shapes, with a fillet of about `k` where they meet.
pub(super) fn smooth_union(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k / 4.0
}

/// Maps the plane to one of `n` equal sectors around the origin. Returns the sector's index and the point
/// rotated to it: x radial along the sector's axis, y tangential. The axis of sector 0 is at angle `phase`.
pub(super) fn fold(p: Vec2, n: u32, phase: f64) -> (u32, Vec2) {
    let step = TAU / f64::from(n);
    let k = ((p.y.atan2(p.x) - phase) / step).round();
    let index = k.rem_euclid(f64::from(n)) as u32;
    (index, p.rotated(-(k * step + phase)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_negative_inside_and_zero_on_their_outline() {
        assert!((vesica(vec2(0.0, 0.2), 0.5, 0.2)).abs() < 1e-12);
        assert!((vesica(vec2(0.5, 0.0), 0.5, 0.2)).abs() < 1e-12);
        assert!(vesica(vec2(0.3, 0.0), 0.5, 0.2) < 0.0);
        assert!(star(vec2(0.0, -0.9), 5, 1.0, 0.5) < 0.0);
        assert!(star(vec2(0.0, 0.9), 5, 1.0, 0.5) > 0.0);
        assert!(star(vec2(0.0, -1.0), 5, 1.0, 0.5).abs() < 1e-12);
        assert!(heart(vec2(0.0, 0.8), 1.0) < 0.0);
        assert!(heart(vec2(0.0, -0.9), 1.0) > 0.0);
    }

    #[test]
    fn fold_keeps_the_radius_and_returns_the_sector() {
        for k in 0..12 {
            let angle = TAU * f64::from(k) / 12.0 + 0.1;
            let (index, q) = fold(vec2(0.7, 0.0).rotated(angle), 12, 0.0);
            assert_eq!(index, k);
            assert!((q - vec2(0.7, 0.0).rotated(0.1)).length() < 1e-12);
        }
    }
}
