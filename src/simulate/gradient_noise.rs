//! Reproducible randomness: hashes of integers, and gradient noise (Perlin 2002).

use super::vec2::{Vec2, mix, vec2};

/// A hash of a lattice point and a seed in 0..1.
pub(super) fn cell_hash(x: i32, y: i32, seed: u32) -> f64 {
    let mut h = seed ^ 0x9e37_79b9;
    for k in [x as u32, y as u32] {
        h = (h ^ k).wrapping_mul(0x85eb_ca6b);
        h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
        h ^= h >> 16;
    }
    f64::from(h) / 4_294_967_296.0
}

/// A hash of `key` and `seed` in 0..1.
pub(super) fn unit_hash(key: u32, seed: u32) -> f64 {
    cell_hash(key as i32, 0, seed)
}

/// Gradient noise on the unit lattice, and its gradient. Values are within ±0.71, mostly within ±0.4.
pub(super) fn noise(p: Vec2, seed: u32) -> (f64, Vec2) {
    let (x0, y0) = (p.x.floor(), p.y.floor());
    let (fx, fy) = (p.x - x0, p.y - y0);
    let corner = |i: i32, j: i32| {
        let turns = cell_hash(x0 as i32 + i, y0 as i32 + j, seed);
        let gradient = vec2(1.0, 0.0).rotated(turns * std::f64::consts::TAU);
        let value = gradient.dot(vec2(fx - f64::from(i), fy - f64::from(j)));
        (value, gradient)
    };
    let fade = |t: f64| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
    let fade_slope = |t: f64| 30.0 * t * t * (t - 1.0) * (t - 1.0);
    let (sx, sy) = (fade(fx), fade(fy));
    let [(a, ga), (b, gb), (c, gc), (d, gd)] =
        [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
    let (top, bottom) = (mix(a, b, sx), mix(c, d, sx));
    let (left, right) = (mix(a, c, sy), mix(b, d, sy));
    let slope = (ga * (1.0 - sx) + gb * sx) * (1.0 - sy) + (gc * (1.0 - sx) + gd * sx) * sy;
    let across = fade_slope(fx) * (right - left);
    let down = fade_slope(fy) * (bottom - top);
    (mix(top, bottom, sy), slope + vec2(across, down))
}

/// The sum of `octaves` layers of noise, each with twice the frequency and half the amplitude of the last.
pub(super) fn layered_noise(p: Vec2, octaves: u32, seed: u32) -> f64 {
    (0..octaves)
        .map(|o| {
            let scale = f64::from(1u32 << o);
            noise(p * scale, seed.wrapping_add(o)).0 / scale
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_is_the_gradient() {
        let h = 1e-5;
        for i in 0..50 {
            let p = vec2(f64::from(i) * 0.37 - 9.0, f64::from(i) * 0.73 - 20.0);
            let (value, slope) = noise(p, 7);
            assert!(value.abs() < 0.75);
            let dx = (noise(p + vec2(h, 0.0), 7).0 - noise(p - vec2(h, 0.0), 7).0) / (2.0 * h);
            let dy = (noise(p + vec2(0.0, h), 7).0 - noise(p - vec2(0.0, h), 7).0) / (2.0 * h);
            assert!((slope - vec2(dx, dy)).length() < 1e-6);
        }
    }
}
