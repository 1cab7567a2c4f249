//! Gain of the noise model, estimated from the shots, as one flood photograph cannot separate noise from texture.
//!
//! Neighbouring pixels respond to the same few light elements, so the samples of a block of `p` values over `L` shots
//! are an `[L, p]` matrix of low rank plus noise of full rank. The smallest eigenvalues of its Gram matrix give the noise
//! (Liu, Tanaka and Okutomi, *Single-image noise level estimation for blind denoising*, 2013, with shots in place of
//! patches).

use super::measurements::Measurements;
use super::noise_model::{NoiseModel, quantile};
use crate::linalg::{ascending_order, mirror_upper, symmetric_eigen};
use crate::transport::{CHANNELS, Extent, TileRect};

/// Camera pixels along a side of a block. At two pixels a light element, signal then takes a minority of the ranks.
const BLOCK_SIDE: u32 = 3;
/// Samples of a block in one shot, `p`.
const BLOCK_SERIES: usize = (BLOCK_SIDE * BLOCK_SIDE) as usize * CHANNELS;
/// Blocks analysed: enough for an accuracy of a few per cent.
const MAX_BLOCKS: usize = 400;
/// Least number of shots in which a block is unsaturated.
const MIN_SHOTS: usize = 4;
/// Rounds of estimating the gain with samples weighted by the last estimate.
const GAIN_ROUNDS: usize = 4;
/// Upper bound on the largest eigenvalue of pure noise, relative to its asymptotic value.
const MAX_NOISE_EIGENVALUE_RATIO: f64 = 1.05;

impl NoiseModel {
    /// Adds the gain to the floor of `measurements.noise`. The gain is zero if all pixels are saturated in too many
    /// shots.
    pub fn with_gain_from(measurements: &Measurements) -> Self {
        let mut noise = measurements.noise;
        let squares = sample_squares(measurements.camera);
        let blocks = squares.filter_map(|square| NoiseEstimationPatch::at(measurements, square));
        let blocks: Vec<NoiseEstimationPatch> = blocks.collect();
        for round in 0..GAIN_ROUNDS {
            let last = (round > 0).then_some(noise);
            noise.gain = estimate_gain(&blocks, noise.floor, last);
        }
        noise
    }
}

/// The samples of a square of camera pixels in all shots in which none of them is saturated.
struct NoiseEstimationPatch {
    /// `[shots, p]`, scaled by the square root of the exposure.
    samples: Vec<f64>,
    /// Square root of each shot's exposure.
    weights: Vec<f64>,
    /// Mean measurement of each sample.
    mean: [f64; BLOCK_SERIES],
    /// Mean of 1 / exposure.
    mean_full_scale: f64,
}

/// The squares of the picture that the gain is estimated from: at most [`MAX_BLOCKS`], spread evenly.
pub(crate) fn sample_squares(camera: Extent) -> impl Iterator<Item = TileRect> {
    let columns = (camera.width / BLOCK_SIDE) as usize;
    let count = columns * (camera.height / BLOCK_SIDE) as usize;
    let stride = count.div_ceil(MAX_BLOCKS).max(1);
    (0..count).step_by(stride).map(move |i| {
        let row = i / columns;
        // Shifted from row to row, so that the blocks do not line up in columns.
        let column = (i % columns + row * 7) % columns;
        TileRect {
            x: column as u32 * BLOCK_SIDE,
            y: row as u32 * BLOCK_SIDE,
            extent: Extent::new(BLOCK_SIDE, BLOCK_SIDE),
        }
    })
}

impl NoiseEstimationPatch {
    /// The samples of a square; `None` if it is saturated too often.
    fn at(measurements: &Measurements, square: TileRect) -> Option<Self> {
        let mut block = Self {
            samples: Vec::with_capacity(measurements.patterns.len() * BLOCK_SERIES),
            weights: Vec::new(),
            mean: [0.0; BLOCK_SERIES],
            mean_full_scale: 0.0,
        };
        for (l, full_scale) in measurements.full_scale.iter().enumerate() {
            let mut samples = [0.0; BLOCK_SERIES];
            for (pixel, samples) in square.pixels().zip(samples.chunks_exact_mut(CHANNELS)) {
                for (c, sample) in samples.iter_mut().enumerate() {
                    *sample = measurements.sample(l, pixel, c);
                }
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
        block.subtract_constant();
        (shots >= MIN_SHOTS).then_some(block)
    }

    /// Subtracts from each sample the constant over all shots, which includes the noise of the dark frame.
    fn subtract_constant(&mut self) {
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

    /// Variance of the noise by channel, relative to the `expected` variance of each sample; `None` if the signal takes
    /// too many ranks.
    fn relative_noise(&self, expected: &[f64; BLOCK_SERIES]) -> Option<[f64; CHANNELS]> {
        let p = BLOCK_SERIES;
        let scale = expected.map(|v| v.sqrt().recip());
        let mut gram = vec![0.0; p * p];
        for row in self.samples.chunks_exact(p) {
            for i in 0..p {
                for j in i..p {
                    gram[i * p + j] += row[i] * scale[i] * row[j] * scale[j];
                }
            }
        }
        mirror_upper(&mut gram, p);
        let (values, vectors) = symmetric_eigen(gram, p);
        let degrees = self.weights.len() - 1;
        // The signal has the smallest rank for which the rest may be pure noise: noise of variance 1 has eigenvalues up
        // to (√n + √p)² (Marchenko and Pastur).
        let rank = (0..p.min(degrees)).find(|&k| {
            let (n, q) = ((degrees - k) as f64, (p - k) as f64);
            let level = values[k..].iter().sum::<f64>() / (n * q);
            values[k] <= MAX_NOISE_EIGENVALUE_RATIO * level * (n.sqrt() + q.sqrt()).powi(2)
        })?;
        // With few ranks left the test accepts anything.
        if 3 * rank > 2 * p.min(degrees) {
            return None;
        }
        // Energy of sample j in the noise subspace, and the share of the sample that lies in it.
        let noise = |j: usize| {
            let subspace = values[rank..]
                .iter()
                .zip(vectors[rank * p..].chunks_exact(p));
            subspace.fold((0.0, 0.0), |(energy, share), (value, v)| {
                (energy + value * v[j] * v[j], share + v[j] * v[j])
            })
        };
        Some(std::array::from_fn(|c| {
            let series = (c..p).step_by(CHANNELS).map(noise);
            let (energy, share) = series.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
            energy / (share * (degrees - rank) as f64)
        }))
    }
}

/// Mean of channel `c` over the pixels of a block.
fn channel_mean(values: &[f64; BLOCK_SERIES], c: usize) -> f64 {
    let series = values.iter().skip(c).step_by(CHANNELS);
    series.sum::<f64>() * CHANNELS as f64 / BLOCK_SERIES as f64
}

/// The gain by channel. Samples are weighted by the `last` estimate, or at first by their measurement.
fn estimate_gain(
    blocks: &[NoiseEstimationPatch],
    floor: [f64; CHANNELS],
    last: Option<NoiseModel>,
) -> [f64; CHANNELS] {
    // (mean measurement, gain) by channel and block.
    let mut estimates: [Vec<(f64, f64)>; CHANNELS] = Default::default();
    for block in blocks {
        let brightest = block.mean.iter().fold(0.0f64, |a, b| a.max(*b));
        let expected: [f64; BLOCK_SERIES] = std::array::from_fn(|j| {
            let (c, y) = (j % CHANNELS, block.mean[j].max(0.0));
            let floor = floor[c] * block.mean_full_scale;
            match last {
                Some(noise) => noise.gain[c] * y + floor,
                None => y + 0.05 * brightest + floor,
            }
        });
        let Some(relative) = block.relative_noise(&expected) else {
            continue;
        };
        for c in 0..CHANNELS {
            let measurement = channel_mean(&block.mean, c);
            let mean = channel_mean(&expected, c);
            let photon_noise = relative[c] * mean - floor[c] * block.mean_full_scale;
            if measurement > 0.0 {
                estimates[c].push((measurement, photon_noise / measurement));
            }
        }
    }
    estimates.map(|estimates| {
        // In the brighter half the floor matters least.
        let brightest = ascending_order(estimates.iter().map(|(measurement, _)| -measurement));
        let half = brightest.iter().take(estimates.len().div_ceil(2));
        let mut gains: Vec<f64> = half.map(|&i| estimates[i].1).collect();
        // Signal mistaken for noise increases an estimate, hence a low quantile.
        quantile(&mut gains, 1, 3).unwrap_or(0.0).max(0.0)
    })
}

#[cfg(all(feature = "simulate", not(target_arch = "wasm32")))]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{CameraPixelSet, LinearPhoto, Pattern};
    use crate::simulate::{
        Camera, EmissionMatrix, PatternEnsemble, PatternImage, RandomStreamId, SceneKind,
    };

    /// Photographs a scene with `electrons` at full scale, every third shot at twice the exposure, and less a dark
    /// frame; channel 1 as if binned from two samples.
    fn measure(kind: SceneKind, camera: [u32; 2], patterns: u32, electrons: f64) -> Measurements {
        let extent = |[width, height]: [u32; 2]| Extent { width, height };
        let (camera, light) = (extent(camera), extent([24, 24]));
        let sensor = Camera { electrons };
        let draw = |i| {
            let mut stream = RandomStreamId::Pattern(i).start(7);
            PatternEnsemble::Gaussian.draw(light, &mut stream)
        };
        let lights: Vec<PatternImage> = std::iter::once(PatternImage::uniform(light, 0))
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
        let exposed = EmissionMatrix::new(light, &lights).pictures(scene.geometry(), &functions);
        let mut photos = exposed.iter().enumerate().map(|(i, photo)| -> LinearPhoto {
            let exposed: LinearPhoto = photo
                .iter()
                .map(|y| y.map(|y| y * exposure(i) as f32))
                .collect();
            let take = |take: u32| {
                let mut stream = RandomStreamId::Photograph(2 * i as u32 + take).start(7);
                sensor.photograph(&exposed, &mut stream)
            };
            let pairs = take(0).into_iter().zip(take(1));
            let pixel = |(a, b): ([u16; 3], [u16; 3])| {
                let green = (linear(a[1]) + linear(b[1])) / 2.0;
                [linear(a[0]), green, linear(a[2])].map(|y| (y / exposure(i)) as f32)
            };
            pairs.map(pixel).collect()
        });
        let dark = photos.next().unwrap();
        let noise = NoiseModel::from_dark(&dark, camera.width, 1.0 / (60_000.0 - 512.0));
        let less_dark = |mut photo: LinearPhoto| {
            for (y, dark) in photo.iter_mut().flatten().zip(dark.iter().flatten()) {
                *y -= dark;
            }
            photo
        };
        Measurements {
            camera,
            light,
            correspondence: scene.geometry().correspondence.clone(),
            patterns: vec![Pattern::Grey(Vec::new()); patterns as usize],
            full_scale: (1..=patterns as usize)
                .map(|i| exposure(i).recip() as f32)
                .collect(),
            loaded: CameraPixelSet::all(camera),
            photos: photos.map(less_dark).collect(),
            flood: None,
            noise,
        }
    }

    #[test]
    fn gain_and_floor_are_estimated_for_any_scene() {
        // Camera pixels: two an element, one an element, and about three an element.
        for (kind, camera, patterns, electrons) in [
            (SceneKind::StainedGlass, [48, 48], 40, 4e4),
            (SceneKind::StainedGlass, [24, 24], 80, 4e3),
            (SceneKind::Cookies, [48, 48], 20, 4e5),
            (SceneKind::Cookies, [64, 72], 80, 4e3),
        ] {
            let measurements = measure(kind, camera, patterns, electrons);
            let noise = NoiseModel::with_gain_from(&measurements);
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
    fn saturated_samples_and_dark_photographs_add_no_noise() {
        let mut measurements = measure(SceneKind::StainedGlass, [48, 48], 40, 4e4);
        for (l, photo) in measurements.photos.iter_mut().enumerate() {
            let saturated = photo.iter_mut().skip(l % 9).step_by(50);
            saturated.for_each(|y| *y = [f32::NAN; CHANNELS]);
        }
        let noise = NoiseModel::with_gain_from(&measurements);
        assert!((0.7..1.4).contains(&(noise.gain[0] * 4e4)), "{noise:?}");
        for photo in &mut measurements.photos {
            photo.fill([0.0; CHANNELS]);
        }
        assert_eq!(
            NoiseModel::with_gain_from(&measurements).gain,
            [0.0; CHANNELS]
        );
        for photo in &mut measurements.photos {
            photo.fill([f32::NAN; CHANNELS]);
        }
        assert_eq!(
            NoiseModel::with_gain_from(&measurements).gain,
            [0.0; CHANNELS]
        );
    }

    #[test]
    fn the_floor_is_at_least_rounding_and_ignores_hot_pixels() {
        let mut dark: LinearPhoto = vec![[0.0; CHANNELS]; 64];
        assert_eq!(
            NoiseModel::from_dark(&dark, 8, 0.12).floor,
            [0.12 * 0.12 / 12.0; CHANNELS]
        );
        dark[9][1] = 40.0;
        let found = NoiseModel::from_dark(&dark, 8, 0.001).floor;
        assert!(found[1] < 1e-6, "{found:?}");
        let noise = NoiseModel {
            gain: [2.0; CHANNELS],
            floor: [3.0; CHANNELS],
        };
        assert_eq!(noise.variance(0, 5.0, 2.0), 2.0 * 5.0 / 2.0 + 3.0 / 4.0);
        assert_eq!(noise.variance(0, -5.0, 1.0), 3.0);
    }
}
