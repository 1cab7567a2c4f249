//! How noisy the measurements are.
//!
//! The floor comes from one dark frame. A single flood cannot tell noise from texture, so the gain
//! comes from the shots: a block of neighbouring pixels sees nearly the same few light elements, so
//! that its samples over all shots are a matrix of low rank, plus noise of full rank. What is left
//! when the ranks that stand out of noise are taken away is noise (as in Liu, Tanaka and Okutomi,
//! *Single-image noise level estimation for blind denoising*, 2013, with shots in place of patches).

use serde::Serialize;

use super::Measurements;
use crate::linalg::symmetric_eigen;
use crate::transport::{CHANNELS, CameraPx};

/// Pixels along a block's side: enough that two pixels an element leave most ranks to noise.
const BLOCK_SIDE: u32 = 3;
/// Samples of a block a shot, `p`.
const BLOCK_SERIES: usize = (BLOCK_SIDE * BLOCK_SIDE) as usize * CHANNELS;
/// Blocks looked at: their answers together are then good to a few per cent.
const MOST_BLOCKS: usize = 400;
/// Fewest shots in which a block is nowhere saturated.
const FEWEST_SHOTS: usize = 4;
/// Rounds of weighting blocks by what the last round found.
const ROUNDS: usize = 4;
/// How far above its asymptotic value the largest eigenvalue of pure noise may come to lie.
const EDGE_SLACK: f64 = 1.05;
/// Median absolute deviation to standard deviation, of a Gaussian.
const MAD_TO_SIGMA: f64 = 1.4826;
/// Standard deviations past which a neighbour's difference is an edge or a hot pixel, not noise.
const OUTLIER: f64 = 4.0;

/// Variance of samples, per channel, in units of the measurement squared.
///
/// A sample of measurement `y` taken at relative exposure `e` has variance `gain·y/e + floor/e²`.
/// The dark frame that was subtracted has noise of its own, of variance `floor`; it shifts a pixel
/// by the same constant in all shots, and is not part of this figure. A fixed pattern of the sensor
/// is in dark frame and shots alike and falls out between them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Noise {
    /// Variance a unit of measurement at exposure 1: one over the electrons at measurement 1.
    pub gain: [f64; CHANNELS],
    /// Variance without light at exposure 1: read noise and the rounding of codes.
    pub floor: [f64; CHANNELS],
}

impl Noise {
    /// What a dark frame tells, in rows `width` pixels long: the floor. The gain is still zero.
    ///
    /// Neighbours differ by noise alone, but for what the sensor's fixed pattern adds. Rounding to
    /// codes `quantum` apart is always there, even where a dark frame shows no noise at all.
    pub fn from_dark(dark: &[[f32; CHANNELS]], width: u32, quantum: f64) -> Self {
        let rounding = quantum * quantum / 12.0;
        let floor = std::array::from_fn(|c| {
            let rows = dark.chunks_exact(width as usize);
            let differences = rows.flat_map(|row| {
                let pairs = row.chunks_exact(2);
                pairs.map(|pair| f64::from(pair[1][c]) - f64::from(pair[0][c]))
            });
            let mut sizes: Vec<f64> = differences.map(f64::abs).collect();
            let Some(deviation) = quantile(&mut sizes, 1, 2) else {
                return rounding;
            };
            // Codes are coarse against the noise of a good camera, and so is their median: it only
            // says which differences are no noise. `quantum` keeps it from being zero.
            let limit = OUTLIER * (MAD_TO_SIGMA * deviation).max(quantum);
            let kept = sizes.iter().take_while(|size| **size <= limit);
            let (count, sum) = kept.fold((0.0, 0.0), |(n, sum), d| (n + 1.0, sum + d * d));
            (sum / (2.0 * f64::max(count, 1.0))).max(rounding)
        });
        Self {
            gain: [0.0; CHANNELS],
            floor,
        }
    }

    /// Variance of a sample of channel `c` that came out as `y` at relative exposure `exposure`.
    pub fn variance(&self, c: usize, y: f64, exposure: f64) -> f64 {
        (self.gain[c] * y.max(0.0) + self.floor[c] / exposure) / exposure
    }

    /// Estimates the gain from `measurements`, whose own `noise` has the floor. Where no pixel has
    /// enough samples that are not saturated, the gain is zero.
    pub fn with_gain_from(measurements: &Measurements) -> Self {
        let mut noise = measurements.noise;
        let blocks = blocks(measurements);
        for round in 0..ROUNDS {
            let before = (round > 0).then_some(noise);
            noise.gain = gain(&blocks, noise.floor, before);
        }
        noise
    }
}

/// Samples of a block of pixels in the shots in which none of it is saturated.
struct Block {
    /// `[shots, p]`, each times the square root of its exposure.
    samples: Vec<f64>,
    /// Square root of each shot's exposure.
    weights: Vec<f64>,
    /// Mean measurement of each of the `p` samples.
    mean: [f64; BLOCK_SERIES],
    /// Mean of one over the exposure.
    mean_full_scale: f64,
}

/// Blocks spread over the rows at hand.
fn blocks(measurements: &Measurements) -> Vec<Block> {
    let across = measurements.camera.width / BLOCK_SIDE;
    let strips = measurements.rows.strips().iter();
    let tops: Vec<u32> = strips
        .flat_map(|strip| {
            let whole = (strip.len() as u32) / BLOCK_SIDE;
            (0..whole).map(|row| strip.start + row * BLOCK_SIDE)
        })
        .collect();
    let count = across as usize * tops.len();
    let every = count.div_ceil(MOST_BLOCKS).max(1);
    let places = (0..count).step_by(every).map(|i| {
        let row = i as u32 / across;
        // Shifted from row to row, lest the blocks form columns.
        let column = (i as u32 % across + row * 7) % across;
        (column * BLOCK_SIDE, tops[row as usize])
    });
    let found = places.filter_map(|(x, y)| Block::at(measurements, x, y));
    found.collect()
}

impl Block {
    /// The block whose first pixel is `(x, y)`; `None` where it is saturated too often.
    fn at(measurements: &Measurements, x: u32, y: u32) -> Option<Self> {
        let mut block = Self {
            samples: Vec::with_capacity(measurements.patterns.len() * BLOCK_SERIES),
            weights: Vec::new(),
            mean: [0.0; BLOCK_SERIES],
            mean_full_scale: 0.0,
        };
        for (l, full_scale) in measurements.full_scale.iter().enumerate() {
            let mut samples = [0.0; BLOCK_SERIES];
            for (j, sample) in samples.iter_mut().enumerate() {
                let (pixel, c) = (j as u32 / CHANNELS as u32, j % CHANNELS);
                let pixel = CameraPx {
                    x: x + pixel % BLOCK_SIDE,
                    y: y + pixel / BLOCK_SIDE,
                };
                *sample = measurements.sample(l, pixel, c);
            }
            if samples.iter().all(|y| y.is_finite()) {
                let full_scale = f64::from(*full_scale);
                let weight = full_scale.recip().sqrt();
                for (mean, y) in block.mean.iter_mut().zip(samples) {
                    *mean += y;
                }
                block.samples.extend(samples.map(|y| y * weight));
                block.weights.push(weight);
                block.mean_full_scale += full_scale;
            }
        }
        let shots = block.weights.len();
        block.mean = block.mean.map(|sum| sum / shots as f64);
        block.mean_full_scale /= shots as f64;
        block.remove_constant();
        (shots >= FEWEST_SHOTS).then_some(block)
    }

    /// Takes away what is the same in all shots, so that the dark frame's own noise goes too.
    fn remove_constant(&mut self) {
        let squares: f64 = self.weights.iter().map(|w| w * w).sum();
        for j in 0..BLOCK_SERIES {
            let column = self.samples.iter().skip(j).step_by(BLOCK_SERIES);
            let dot: f64 = column.zip(&self.weights).map(|(y, w)| y * w).sum();
            let column = self.samples.iter_mut().skip(j).step_by(BLOCK_SERIES);
            for (y, w) in column.zip(&self.weights) {
                *y -= w * dot / squares;
            }
        }
    }

    /// Mean measurement of one channel.
    fn brightness(&self, c: usize) -> f64 {
        let means = self.mean.iter().skip(c).step_by(CHANNELS);
        means.sum::<f64>() * CHANNELS as f64 / BLOCK_SERIES as f64
    }

    /// Variance of noise, relative to what is `expected` of each sample, by channel; `None` where
    /// the block's ranks are all taken by what it shows.
    fn relative_noise(&self, expected: &[f64; BLOCK_SERIES]) -> Option<[f64; CHANNELS]> {
        let p = BLOCK_SERIES;
        let scale = expected.map(|v| v.sqrt().recip());
        let mut gram = vec![0.0; p * p];
        for row in self.samples.chunks_exact(p) {
            for i in 0..p {
                for j in 0..=i {
                    gram[i * p + j] += row[i] * scale[i] * row[j] * scale[j];
                }
            }
        }
        for i in 0..p {
            for j in 0..i {
                gram[j * p + i] = gram[i * p + j];
            }
        }
        let (values, vectors) = symmetric_eigen(gram, p);
        let freedom = self.weights.len() - 1;
        // As many ranks are taken to be signal as stand out of the noise that is left: pure noise
        // of variance 1 has eigenvalues up to (√n + √p)² (Marchenko and Pastur).
        let rank = (0..p.min(freedom)).find(|&k| {
            let (n, q) = ((freedom - k) as f64, (p - k) as f64);
            let level = values[k..].iter().sum::<f64>() / (n * q);
            values[k] <= EDGE_SLACK * level * (n.sqrt() + q.sqrt()).powi(2)
        })?;
        // Near the last rank anything passes for noise.
        if 3 * rank > 2 * p.min(freedom) {
            return None;
        }
        let left = |j: usize| {
            let parts = values[rank..]
                .iter()
                .zip(vectors[rank * p..].chunks_exact(p));
            parts.fold((0.0, 0.0), |(energy, share), (value, v)| {
                (energy + value * v[j] * v[j], share + v[j] * v[j])
            })
        };
        Some(std::array::from_fn(|c| {
            let series = (c..p).step_by(CHANNELS).map(left);
            let (energy, share) = series.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
            energy / (share * (freedom - rank) as f64)
        }))
    }
}

/// The gain by channel, with samples weighted as `before` says, or by brightness alone.
fn gain(blocks: &[Block], floor: [f64; CHANNELS], before: Option<Noise>) -> [f64; CHANNELS] {
    // (mean measurement, gain) by channel and block.
    let mut found: [Vec<(f64, f64)>; CHANNELS] = Default::default();
    for block in blocks {
        let brightest = block.mean.iter().fold(0.0f64, |a, b| a.max(*b));
        let expected: [f64; BLOCK_SERIES] = std::array::from_fn(|j| {
            let (c, y) = (j % CHANNELS, block.mean[j].max(0.0));
            let without_light = floor[c] * block.mean_full_scale;
            match before {
                Some(noise) => noise.gain[c] * y + without_light,
                None => y + 0.05 * brightest + without_light,
            }
        });
        let Some(relative) = block.relative_noise(&expected) else {
            continue;
        };
        for c in 0..CHANNELS {
            let brightness = block.brightness(c);
            let series = expected.iter().skip(c).step_by(CHANNELS);
            let mean = series.sum::<f64>() * CHANNELS as f64 / BLOCK_SERIES as f64;
            let of_light = relative[c] * mean - floor[c] * block.mean_full_scale;
            if brightness > 0.0 {
                found[c].push((brightness, of_light / brightness));
            }
        }
    }
    found.map(|mut found| {
        // The brighter half tells light's noise best from the floor.
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.truncate(found.len().div_ceil(2));
        let mut gains: Vec<f64> = found.into_iter().map(|(_, gain)| gain).collect();
        // What passes for noise and is none only ever adds to it.
        quantile(&mut gains, 1, 3).unwrap_or(0.0).max(0.0)
    })
}

/// The value with `part / of` of all `values` below it; sorts them. `None` of nothing.
fn quantile(values: &mut [f64], part: usize, of: usize) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() * part / of).copied()
}

#[cfg(test)]
#[cfg(not(target_arch = "wasm32"))]
mod tests {
    use super::*;
    use crate::capture::{Pattern, Picture, Rows};
    use crate::simulate::{Camera, EmissionMatrix, Ensemble, LightCodes, RandomStream, SceneKind};
    use crate::transport::{Extent, TileRect};

    /// Photographs a scene with `electrons` at full scale, every third shot at twice the exposure,
    /// and less a dark frame; channel 1 as if binned from two samples.
    fn measure(kind: SceneKind, camera: [u32; 2], patterns: u32, electrons: f64) -> Measurements {
        let extent = |[width, height]: [u32; 2]| Extent { width, height };
        let (camera, light) = (extent(camera), extent([24, 24]));
        let sensor = Camera {
            black: 512.0,
            white: 60_000.0,
            electrons,
            read_noise: 8.0,
        };
        let draw = |i| {
            let mut stream = RandomStream::Pattern(i).start(7);
            Ensemble::Gaussian.draw(light, &mut stream).unwrap()
        };
        let lights: Vec<LightCodes> = std::iter::once(LightCodes::uniform(light, 0))
            .chain((0..patterns).map(draw))
            .collect();
        let scene = kind.build(camera, light).unwrap();
        let (x, y) = (0, 0);
        let functions = scene.tile(TileRect {
            x,
            y,
            extent: camera,
        });
        let exposure = |i: usize| if i % 3 == 2 { 2.0 } else { 1.0 };
        let linear = |code: u16| (f64::from(code) - 512.0) / (60_000.0 - 512.0);
        let seen = EmissionMatrix::new(light, &lights).pictures(scene.geometry(), &functions);
        let mut pictures = seen.iter().enumerate().map(|(i, picture)| -> Picture {
            let exposed: Picture = picture
                .iter()
                .map(|y| y.map(|y| y * exposure(i) as f32))
                .collect();
            let take = |take: u32| {
                let mut stream = RandomStream::Photograph(2 * i as u32 + take).start(7);
                sensor.photograph(&exposed, &mut stream).unwrap()
            };
            let pairs = take(0).into_iter().zip(take(1));
            let pixel = |(a, b): ([u16; 3], [u16; 3])| {
                let green = (linear(a[1]) + linear(b[1])) / 2.0;
                [linear(a[0]), green, linear(a[2])].map(|y| (y / exposure(i)) as f32)
            };
            pairs.map(pixel).collect()
        });
        let dark = pictures.next().unwrap();
        let noise = Noise::from_dark(&dark, camera.width, 1.0 / (60_000.0 - 512.0));
        let less_dark = |mut picture: Picture| {
            for (y, dark) in picture.iter_mut().flatten().zip(dark.iter().flatten()) {
                *y -= dark;
            }
            picture
        };
        Measurements {
            camera,
            light,
            correspondence: scene.geometry().correspondence,
            patterns: vec![Pattern::Grey(Vec::new()); patterns as usize],
            full_scale: (1..=patterns as usize)
                .map(|i| exposure(i).recip() as f32)
                .collect(),
            rows: Rows::all(camera.height),
            pictures: pictures.map(less_dark).collect(),
            noise,
        }
    }

    #[test]
    fn gain_and_floor_are_found_in_photographs_of_any_scene() {
        // Camera pixels: two an element, one an element, and about three an element.
        for (kind, camera, patterns, electrons) in [
            (SceneKind::StainedGlass, [48, 48], 40, 4e4),
            (SceneKind::StainedGlass, [24, 24], 80, 4e3),
            (SceneKind::Cookies, [48, 48], 20, 4e5),
            (SceneKind::Cookies, [64, 72], 80, 4e3),
        ] {
            let measurements = measure(kind, camera, patterns, electrons);
            let noise = Noise::with_gain_from(&measurements);
            for (c, samples) in [1.0, 2.0, 1.0].into_iter().enumerate() {
                let gain = noise.gain[c] * electrons * samples;
                let rounding = (electrons / (60_000.0 - 512.0)).powi(2) / 12.0;
                let read = (64.0 + rounding) / electrons.powi(2) / samples;
                let floor = noise.floor[c] / read;
                let found = format!("{kind:?} {patterns} {electrons} {c}: {gain} {floor}");
                assert!((0.75..1.33).contains(&gain), "{found}");
                assert!((0.75..1.33).contains(&floor), "{found}");
            }
        }
    }

    #[test]
    fn saturated_samples_and_missing_light_are_no_noise() {
        let mut measurements = measure(SceneKind::StainedGlass, [48, 48], 40, 4e4);
        for (l, picture) in measurements.pictures.iter_mut().enumerate() {
            let saturated = picture.iter_mut().skip(l % 9).step_by(50);
            saturated.for_each(|y| *y = [f32::NAN; CHANNELS]);
        }
        let noise = Noise::with_gain_from(&measurements);
        assert!((0.7..1.4).contains(&(noise.gain[0] * 4e4)), "{noise:?}");
        for picture in &mut measurements.pictures {
            picture.fill([0.0; CHANNELS]);
        }
        assert_eq!(Noise::with_gain_from(&measurements).gain, [0.0; CHANNELS]);
        for picture in &mut measurements.pictures {
            picture.fill([f32::NAN; CHANNELS]);
        }
        assert_eq!(Noise::with_gain_from(&measurements).gain, [0.0; CHANNELS]);
    }

    #[test]
    fn a_dark_frame_without_noise_has_that_of_rounding_and_hot_pixels_are_none() {
        let mut dark: Picture = vec![[0.0; CHANNELS]; 64];
        assert_eq!(
            Noise::from_dark(&dark, 8, 0.12).floor,
            [0.12 * 0.12 / 12.0; CHANNELS]
        );
        dark[9][1] = 40.0;
        let found = Noise::from_dark(&dark, 8, 0.001).floor;
        assert!(found[1] < 1e-6, "{found:?}");
        let noise = Noise {
            gain: [2.0; CHANNELS],
            floor: [3.0; CHANNELS],
        };
        assert_eq!(noise.variance(0, 5.0, 2.0), 2.0 * 5.0 / 2.0 + 3.0 / 4.0);
        assert_eq!(noise.variance(0, -5.0, 1.0), 3.0);
    }
}
