//! The built-in light `fire`: flames along the lower edge of the light plane.
//!
//! Heat at a point is a falling ramp plus layers of gradient noise that rise at their own speeds ([`FlameNoise`]);
//! the ramp's height varies along the edge ([`FlameColumn`]). A colour map turns heat into emission, and sparks are
//! added on top. Everything is a function of time, through hashes of lattice points, so a fire can be drawn at any
//! moment. Lengths are in heights of the light plane, `y` upwards.

use std::ops::Range;

use super::platform_math;
use crate::transport::LightRegion;

/// Rows at which heat is computed, at most; it is interpolated between them.
const MAX_HEAT_ROWS: u32 = 112;
/// Age of the fire at time 0, in seconds: a moment with a well-shaped flame.
const START_SECONDS: f64 = 500.4;
/// Sparks in the air over a square light plane.
const SPARK_COUNT: f64 = 14.0;

/// Linear emission of every light element of a region, row by row, at a time in seconds. A time that is not finite counts
/// as 0.
pub(super) fn fire_emission(region: LightRegion, seconds: f64) -> Vec<[f32; 4]> {
    let seconds = START_SECONDS + if seconds.is_finite() { seconds } else { 0.0 };
    let noise = FlameNoise::at(seconds);
    let plane = region.plane;
    let size = plane.height as f32;
    // Heat is computed at the centres of every `pitch`th element; the last nodes may lie beyond the edge.
    let pitch = plane.height.div_ceil(MAX_HEAT_ROWS).max(1);
    let first_node = region.first[0] / pitch;
    let last_node = (region.columns().end - 1).div_ceil(pitch);
    let columns: Vec<(f32, FlameColumn)> = (first_node..=last_node)
        .map(|i| {
            let x = ((i * pitch) as f32 + 0.5) / size;
            (x, FlameColumn::at(&noise, x, plane.width as f32 / size))
        })
        .collect();
    let row = |v: u32| -> Vec<f32> {
        let y = 1.0 - (v as f32 + 0.5) / size;
        let heat = |(x, column): &(f32, FlameColumn)| noise.heat(*x, y, column);
        columns.iter().map(heat).collect()
    };
    let mut elements = Vec::with_capacity(region.extent.area());
    let mut nodes = vec![0.0; columns.len()];
    let first = region.first[1] / pitch * pitch;
    let (mut above, mut below) = (row(first), row(first + pitch));
    for v in region.rows() {
        if v > region.first[1] && v % pitch == 0 {
            above = std::mem::replace(&mut below, row(v + pitch));
        }
        let t = (v % pitch) as f32 / pitch as f32;
        for ((node, above), below) in nodes.iter_mut().zip(&above).zip(&below) {
            *node = above + (below - above) * t;
        }
        for u in region.columns() {
            let (i, part) = (
                (u / pitch - first_node) as usize,
                (u % pitch) as f32 / pitch as f32,
            );
            let left = nodes[i];
            let right = nodes.get(i + 1).copied().unwrap_or(left);
            elements.push(heat_colour(left + (right - left) * part));
        }
    }
    add_sparks(region, seconds, &mut elements);
    elements
}

/// The emission at a heat of 0 to 1: dark, red, yellow, and white at the hottest.
fn heat_colour(heat: f32) -> [f32; 4] {
    let h2 = heat * heat;
    let h4 = h2 * h2;
    let red = h2 * (1.6 - 0.6 * h2);
    [red, h4 * (1.05 - 0.33 * h2), 0.32 * h4 * h4, 0.0]
}

/// Adds the sparks: Gaussian spots that rise, sway and fade.
fn add_sparks(region: LightRegion, seconds: f64, elements: &mut [[f32; 4]]) {
    let size = f64::from(region.plane.height);
    let width = f64::from(region.plane.width);
    // Smaller spots would flicker as they pass from element to element.
    let radius = (0.0055 * size).max(0.7);
    let count = (SPARK_COUNT * width / size).clamp(1.0, 64.0) as u32;
    for k in 0..count {
        let unit = |n: u32, seed: u32| f64::from(hash(k, n, seed)) / f64::from(u32::MAX);
        // Each spark has its own lifetime, and starts again elsewhere.
        let life = 1.7 + 1.6 * unit(0, 90);
        let lives = seconds / life + unit(0, 91);
        let (number, age) = (lives.floor(), lives - lives.floor());
        let n = number.rem_euclid(4_294_967_296.0) as u32;
        let sway = platform_math::sin(age * (2.0 + 3.0 * unit(n, 92)) + 6.0 * unit(n, 93));
        let u = width * (0.08 + 0.84 * unit(n, 94)) + size * 0.05 * sway;
        let v = size * (0.92 - (0.35 + 0.55 * unit(n, 95)) * age);
        // It lights up quickly and fades.
        let power = (8.0 * age).min(1.0) * (1.0 - age).powi(2) * (0.4 + 0.5 * unit(n, 96));
        let reach = |centre: f64, part: Range<u32>| {
            let first = (centre - 3.0 * radius).max(0.0) as u32;
            let end = (centre + 3.0 * radius).max(0.0) as u32;
            first.max(part.start)..end.min(part.end)
        };
        for j in reach(v, region.rows()) {
            for i in reach(u, region.columns()) {
                let (du, dv) = (f64::from(i) + 0.5 - u, f64::from(j) + 0.5 - v);
                let spot = (power * (-(du * du + dv * dv) / (2.0 * radius * radius)).exp()) as f32;
                let [column, row] = [i - region.first[0], j - region.first[1]];
                let element =
                    &mut elements[row as usize * region.extent.width as usize + column as usize];
                for (value, colour) in element.iter_mut().zip([1.0, 0.42, 0.08, 0.0]) {
                    *value += colour * spot * (1.0 - *value);
                }
            }
        }
    }
}

/// The layers of noise at one moment.
struct FlameNoise {
    /// Height of all flames.
    gust: FlameNoiseLayer,
    /// Height of each flame.
    draught: FlameNoiseLayer,
    /// Horizontal shift.
    sway: FlameNoiseLayer,
    /// Finer shift, both ways.
    curl: FlameNoiseLayer,
    /// The flames, from coarse to fine.
    tongues: [FlameNoiseLayer; 3],
}

impl FlameNoise {
    fn at(seconds: f64) -> Self {
        // Lattice cells per height along x and y, and speed in heights a second: finer noise is faster.
        let layer = |seed, x_scale, y_scale, speed| {
            FlameNoiseLayer::new(seed, x_scale, y_scale, speed * seconds)
        };
        Self {
            gust: layer(1, 0.9, 1.0, 0.8),
            draught: layer(2, 3.1, 1.0, 0.75),
            sway: layer(3, 1.7, 1.6, 0.62),
            curl: layer(4, 4.2, 3.4, 0.85),
            tongues: [
                layer(5, 4.6, 1.7, 0.78),
                layer(6, 9.5, 4.1, 0.93),
                layer(7, 19.0, 9.7, 1.12),
            ],
        }
    }

    /// The heat at a point, 0 to 1.
    fn heat(&self, x: f32, y: f32, column: &FlameColumn) -> f32 {
        // The sum below cannot be positive above this.
        let height = y / column.flame_height;
        if height > 1.45 {
            return 0.0;
        }
        // The noise shifts flames more the higher they are; their roots stay.
        let free = y.min(0.9);
        let curl = self.curl.noise(x, y);
        let x = x + free * (0.34 * self.sway.noise(x, y) + 0.10 * curl);
        let y = y + 0.12 * free * curl;
        let [large, middle, small] = &self.tongues;
        let large = large.noise(x, y);
        let turbulence = large + 0.52 * middle.noise(x, y) + 0.26 * small.noise(x, y);
        let body = 0.98 - 1.18 * height;
        (body + turbulence * (0.75 + 0.85 * height.min(1.0)) - column.heat_loss).clamp(0.0, 1.0)
    }
}

/// What depends on the position along the edge alone.
struct FlameColumn {
    /// Mean height of the flames.
    flame_height: f32,
    /// Heat lost towards the ends of the edge.
    heat_loss: f32,
}

impl FlameColumn {
    fn at(noise: &FlameNoise, x: f32, width: f32) -> Self {
        let gust = 1.0 + 0.15 * noise.gust.noise(x, 0.0);
        let offset = (2.0 * x / width - 1.0).abs();
        Self {
            flame_height: (0.64 + 0.42 * noise.draught.noise(x, 0.0)).max(0.2) * gust,
            heat_loss: 0.38 * offset * offset * offset * offset,
        }
    }
}

/// Gradient noise (K. Perlin, "Improving noise", 2002) that has risen by some distance.
struct FlameNoiseLayer {
    seed: u32,
    /// Lattice cells per height.
    x_scale: f32,
    y_scale: f32,
    /// The distance in lattice cells: whole cells modulo 2³², and the fraction.
    risen_cells: u32,
    risen_part: f32,
}

impl FlameNoiseLayer {
    fn new(seed: u32, x_scale: f32, y_scale: f32, risen: f64) -> Self {
        // In double precision, so that it still moves smoothly after days.
        let cells = risen * f64::from(y_scale);
        let whole = cells.floor();
        Self {
            seed: seed.wrapping_mul(0x9e37_79b9),
            x_scale,
            y_scale,
            risen_cells: whole.rem_euclid(4_294_967_296.0) as u32,
            risen_part: (cells - whole) as f32,
        }
    }

    /// Mostly within ±0.5, always within ±1. Not inlined: each copy adds 2 kB to a module.
    #[inline(never)]
    fn noise(&self, x: f32, y: f32) -> f32 {
        let (x, y) = (x * self.x_scale, y * self.y_scale - self.risen_part);
        // `floor` is a call where SSE4.1 is missing.
        let cell = |t: f32| t as i32 - i32::from(t < 0.0);
        let (i, j) = (cell(x), cell(y));
        let (x, y) = (x - i as f32, y - j as f32);
        let (i, j) = (i as u32, (j as u32).wrapping_sub(self.risen_cells));
        let corner = |right: u32, above: u32| {
            let h = hash(i.wrapping_add(right), j.wrapping_add(above), self.seed);
            let (a, b) = (h as u16 as i16, (h >> 16) as u16 as i16);
            let (x, y) = (x - right as f32, y - above as f32);
            (f32::from(a) * x + f32::from(b) * y) / 32768.0
        };
        let fade = |t: f32| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
        let s = fade(x);
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let below = mix(corner(0, 0), corner(1, 0), s);
        mix(below, mix(corner(0, 1), corner(1, 1), s), fade(y))
    }
}

/// A hash of a lattice point (the finaliser of MurmurHash3).
fn hash(i: u32, j: u32, seed: u32) -> u32 {
    let mut h = i.wrapping_mul(0x85eb_ca6b) ^ j.wrapping_mul(0xc2b2_ae35) ^ seed;
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::Extent;

    const FRAME: f64 = 1.0 / 60.0;

    fn emission_at(seconds: f64) -> Vec<[f32; 4]> {
        let side = 64;
        fire_emission(Extent::new(side, side).into(), seconds)
    }

    fn mean_change(a: &[[f32; 4]], b: &[[f32; 4]]) -> f32 {
        let pairs = a.as_flattened().iter().zip(b.as_flattened());
        pairs.map(|(a, b)| (a - b).abs()).sum::<f32>() / (3 * a.len()) as f32
    }

    #[test]
    fn the_fire_moves_smoothly() {
        for i in 0..100 {
            let seconds = f64::from(i) * 0.61;
            let (now, next) = (emission_at(seconds), emission_at(seconds + FRAME));
            let pairs = now.as_flattened().iter().zip(next.as_flattened());
            let largest = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(largest < 0.35, "{largest} at {seconds} s");
            let mean = mean_change(&now, &next);
            assert!((0.002..0.02).contains(&mean), "{mean} at {seconds} s");
        }
    }

    #[test]
    fn moments_of_a_minute_do_not_repeat() {
        let moments: Vec<_> = (0..240).map(|i| emission_at(f64::from(i) * 0.25)).collect();
        for (i, moment) in moments.iter().enumerate() {
            for earlier in &moments[..i] {
                assert!(mean_change(moment, earlier) > 0.03);
            }
        }
    }

    #[test]
    fn the_total_light_stays_within_bounds() {
        let light = |i: u32| -> f32 {
            let elements = emission_at(f64::from(i) * 0.25);
            elements.as_flattened().iter().sum()
        };
        let totals: Vec<f32> = (0..240).map(light).collect();
        let mean = totals.iter().sum::<f32>() / totals.len() as f32;
        for total in totals {
            assert!((0.45..1.8).contains(&(total / mean)), "{total} of {mean}");
        }
    }

    #[test]
    fn emission_is_within_bounds_for_any_extent_and_time() {
        for [width, height] in [[1, 1], [3, 200], [200, 3], [1, 256], [129, 130], [2, 257]] {
            for seconds in [0.0, -7.25, 1e9, 1e300, f64::NAN, f64::INFINITY] {
                let extent = Extent { width, height };
                let elements = fire_emission(extent.into(), seconds);
                assert_eq!(elements.len(), extent.area());
                for value in elements.as_flattened() {
                    assert!((0.0..=1.0).contains(value), "{value} on {extent}");
                }
                assert_eq!(fire_emission(extent.into(), seconds), elements);
            }
        }
    }

    #[test]
    fn a_finer_light_plane_shows_the_same_fire() {
        let [coarse, fine] = [60, 240].map(|side| {
            let extent = Extent::new(side, side);
            fire_emission(extent.into(), 3.0)
        });
        for v in 0..60 {
            for u in 0..60 {
                let block = (0..16).map(|k| fine[(4 * v + k / 4) * 240 + 4 * u + k % 4][0]);
                let mean = block.sum::<f32>() / 16.0;
                let there = coarse[v * 60 + u][0];
                assert!((mean - there).abs() < 0.25, "{mean}, {there} at {u}, {v}");
            }
        }
    }
}
