//! A fire that burns along the lower edge of the light plane.
//!
//! Heat is turbulence that rises, faster the hotter, over a bed of embers whose draught comes and
//! goes from place to place; its colour is that of a glowing body. Everything follows from the time
//! alone, by hashes of lattice points. Lengths are in heights of the plane, upwards.

use super::math;
use crate::transport::Extent;

/// Most rows in which heat is computed; between them it is interpolated.
const ROWS: u32 = 112;
/// How long it has burnt when it is first looked at, in seconds: a moment with a fine flame.
const FIRST_LOOK: f64 = 500.4;
/// Sparks that fly at once over a square plane.
const SPARKS: f64 = 14.0;

/// Linear emission of every light element, row by row, `seconds` after the fire was first looked at.
/// Times that are not finite are taken as none.
pub(super) fn burning(extent: Extent, seconds: f64) -> Vec<[f32; 4]> {
    let seconds = FIRST_LOOK + if seconds.is_finite() { seconds } else { 0.0 };
    let air = Air::at(seconds);
    let size = extent.height as f32;
    // Nodes stand on the centres of every so many elements, the last ones on the edge or beyond it.
    let pitch = extent.height.div_ceil(ROWS).max(1);
    let nodes = |length: u32| (0..=length.saturating_sub(1).div_ceil(pitch)).map(|i| i * pitch);
    let columns: Vec<(f32, Embers)> = nodes(extent.width)
        .map(|u| {
            let x = (u as f32 + 0.5) / size;
            (x, Embers::at(&air, x, extent.width as f32 / size))
        })
        .collect();
    let row = |v: u32| -> Vec<f32> {
        let y = 1.0 - (v as f32 + 0.5) / size;
        columns.iter().map(|(x, e)| air.heat(*x, y, e)).collect()
    };
    let mut elements = Vec::with_capacity(extent.area());
    let mut between = vec![0.0; columns.len()];
    let (mut above, mut below) = (row(0), row(pitch));
    for v in 0..extent.height {
        if v > 0 && v % pitch == 0 {
            above = std::mem::replace(&mut below, row(v + pitch));
        }
        let t = (v % pitch) as f32 / pitch as f32;
        for ((between, above), below) in between.iter_mut().zip(&above).zip(&below) {
            *between = above + (below - above) * t;
        }
        for u in 0..extent.width {
            let (node, part) = ((u / pitch) as usize, (u % pitch) as f32 / pitch as f32);
            let left = between[node];
            let right = between.get(node + 1).copied().unwrap_or(left);
            elements.push(glow(left + (right - left) * part));
        }
    }
    sparks(extent, seconds, &mut elements);
    elements
}

/// The colour of a glowing body: red first, then yellow, white at the hottest only.
fn glow(heat: f32) -> [f32; 4] {
    let h2 = heat * heat;
    let h4 = h2 * h2;
    let red = h2 * (1.6 - 0.6 * h2);
    [red, h4 * (1.05 - 0.33 * h2), 0.32 * h4 * h4, 0.0]
}

/// Adds what flies up from the fire.
fn sparks(extent: Extent, seconds: f64, elements: &mut [[f32; 4]]) {
    let size = f64::from(extent.height);
    let width = f64::from(extent.width);
    // Never smaller than what elements can show without flicker.
    let radius = (0.0055 * size).max(0.7);
    let count = (SPARKS * width / size).clamp(1.0, 64.0) as u32;
    for k in 0..count {
        let unit = |n: u32, seed: u32| f64::from(hash(k, n, seed)) / f64::from(u32::MAX);
        // Each comes again, elsewhere, after a time of its own.
        let life = 1.7 + 1.6 * unit(0, 90);
        let lives = seconds / life + unit(0, 91);
        let (number, age) = (lives.floor(), lives - lives.floor());
        let n = number.rem_euclid(4_294_967_296.0) as u32;
        let sway = math::sin(age * (2.0 + 3.0 * unit(n, 92)) + 6.0 * unit(n, 93));
        let u = width * (0.08 + 0.84 * unit(n, 94)) + size * 0.05 * sway;
        let v = size * (0.92 - (0.35 + 0.55 * unit(n, 95)) * age);
        // It glows up and cools.
        let power = (8.0 * age).min(1.0) * (1.0 - age).powi(2) * (0.4 + 0.5 * unit(n, 96));
        let near = |centre: f64, length: u32| {
            let first = (centre - 3.0 * radius).max(0.0) as u32;
            first..((centre + 3.0 * radius).max(0.0) as u32).min(length)
        };
        for j in near(v, extent.height) {
            for i in near(u, extent.width) {
                let (du, dv) = (f64::from(i) + 0.5 - u, f64::from(j) + 0.5 - v);
                let spot = (power * (-(du * du + dv * dv) / (2.0 * radius * radius)).exp()) as f32;
                let element = &mut elements[j as usize * extent.width as usize + i as usize];
                for (value, colour) in element.iter_mut().zip([1.0, 0.42, 0.08, 0.0]) {
                    *value += colour * spot * (1.0 - *value);
                }
            }
        }
    }
}

/// Turbulent air at one moment: each layer of noise has risen by its own speed.
struct Air {
    gust: Layer,
    draught: Layer,
    sway: Layer,
    curl: Layer,
    tongues: [Layer; 3],
}

impl Air {
    fn at(seconds: f64) -> Self {
        // Grains a height across and up, heights a second: slender at the root, finer is faster.
        let layer = |seed, across, up, speed| Layer::new(seed, across, up, speed * seconds);
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

    /// 0 in cold air to 1 where the gas is hottest, `y` above the embers.
    fn heat(&self, x: f32, y: f32, embers: &Embers) -> f32 {
        // Above the tips of the flames nothing can glow.
        let up = y / embers.reach;
        if up > 1.45 {
            return 0.0;
        }
        // Flames hold on to the embers and lean freely above them.
        let free = y.min(0.9);
        let curl = self.curl.noise(x, y);
        let x = x + free * (0.34 * self.sway.noise(x, y) + 0.10 * curl);
        let y = y + 0.12 * free * curl;
        let [large, middle, small] = &self.tongues;
        let large = large.noise(x, y);
        let turbulence = large + 0.52 * middle.noise(x, y) + 0.26 * small.noise(x, y);
        let body = 0.98 - 1.18 * up;
        (body + turbulence * (0.75 + 0.85 * up.min(1.0)) - embers.cold).clamp(0.0, 1.0)
    }
}

/// What burns below a place.
struct Embers {
    /// Height that flames have on the average.
    reach: f32,
    /// Heat lost towards the sides.
    cold: f32,
}

impl Embers {
    fn at(air: &Air, x: f32, width: f32) -> Self {
        let gust = 1.0 + 0.15 * air.gust.noise(x, 0.0);
        let aside = (2.0 * x / width - 1.0).abs();
        Self {
            reach: (0.64 + 0.42 * air.draught.noise(x, 0.0)).max(0.2) * gust,
            cold: 0.38 * aside * aside * aside * aside,
        }
    }
}

/// Gradient noise (Perlin 2002) of its own grain that has risen for a while.
struct Layer {
    seed: u32,
    across: f32,
    up: f32,
    /// Lattice rows that have passed, and the part of the next.
    rows: u32,
    part: f32,
}

impl Layer {
    /// `across` and `up`: lattice cells a height. `risen`: heights.
    fn new(seed: u32, across: f32, up: f32, risen: f64) -> Self {
        // In double precision, so that it moves smoothly after days as well.
        let cells = risen * f64::from(up);
        let whole = cells.floor();
        Self {
            seed: seed.wrapping_mul(0x9e37_79b9),
            across,
            up,
            rows: whole.rem_euclid(4_294_967_296.0) as u32,
            part: (cells - whole) as f32,
        }
    }

    /// Mostly within ±0.5, never outside ±1. Once: in each of its places it is 2 kB for browsers to load.
    #[inline(never)]
    fn noise(&self, x: f32, y: f32) -> f32 {
        let (x, y) = (x * self.across, y * self.up - self.part);
        // Rounding down is a call on some processors.
        let cell = |t: f32| t as i32 - i32::from(t < 0.0);
        let (i, j) = (cell(x), cell(y));
        let (x, y) = (x - i as f32, y - j as f32);
        let (i, j) = (i as u32, (j as u32).wrapping_sub(self.rows));
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

/// A well mixed number (finaliser of MurmurHash3).
fn hash(i: u32, j: u32, seed: u32) -> u32 {
    let mut h = i.wrapping_mul(0x85eb_ca6b) ^ j.wrapping_mul(0xc2b2_ae35) ^ seed;
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: f64 = 1.0 / 60.0;

    fn burning_at(seconds: f64) -> Vec<[f32; 4]> {
        let side = 64;
        burning(
            Extent {
                width: side,
                height: side,
            },
            seconds,
        )
    }

    fn mean_change(a: &[[f32; 4]], b: &[[f32; 4]]) -> f32 {
        let pairs = a.as_flattened().iter().zip(b.as_flattened());
        pairs.map(|(a, b)| (a - b).abs()).sum::<f32>() / (3 * a.len()) as f32
    }

    #[test]
    fn it_moves_smoothly_and_never_jumps() {
        for i in 0..100 {
            let seconds = f64::from(i) * 0.61;
            let (now, next) = (burning_at(seconds), burning_at(seconds + FRAME));
            let pairs = now.as_flattened().iter().zip(next.as_flattened());
            let largest = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(largest < 0.35, "{largest} at {seconds} s");
            let mean = mean_change(&now, &next);
            assert!((0.002..0.02).contains(&mean), "{mean} at {seconds} s");
        }
    }

    #[test]
    fn no_moment_of_a_minute_comes_again() {
        let moments: Vec<_> = (0..240).map(|i| burning_at(f64::from(i) * 0.25)).collect();
        for (i, moment) in moments.iter().enumerate() {
            for earlier in &moments[..i] {
                assert!(mean_change(moment, earlier) > 0.03);
            }
        }
    }

    #[test]
    fn it_flickers_but_neither_dies_nor_flares() {
        let light = |i: u32| -> f32 {
            let elements = burning_at(f64::from(i) * 0.25);
            elements.as_flattened().iter().sum()
        };
        let totals: Vec<f32> = (0..240).map(light).collect();
        let mean = totals.iter().sum::<f32>() / totals.len() as f32;
        for total in totals {
            assert!((0.45..1.8).contains(&(total / mean)), "{total} of {mean}");
        }
    }

    #[test]
    fn planes_of_any_size_burn_at_any_time() {
        for [width, height] in [[1, 1], [3, 200], [200, 3], [1, 256], [129, 130], [2, 257]] {
            for seconds in [0.0, -7.25, 1e9, 1e300, f64::NAN, f64::INFINITY] {
                let extent = Extent { width, height };
                let elements = burning(extent, seconds);
                assert_eq!(elements.len(), extent.area());
                for value in elements.as_flattened() {
                    assert!((0.0..=1.0).contains(value), "{value} on {extent}");
                }
                assert_eq!(burning(extent, seconds), elements);
            }
        }
    }

    #[test]
    fn a_finer_plane_shows_the_same_fire() {
        let [coarse, fine] = [60, 240].map(|side| {
            let extent = Extent {
                width: side,
                height: side,
            };
            burning(extent, 3.0)
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
