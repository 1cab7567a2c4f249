//! Learned recovery of synthetic objects whose light transport functions are known.

use super::basis::LearnedBasis;
use super::equations::{ObservationEquations, PixelObservation};
use super::posterior::{PosteriorSolver, PriorPrecision};
use super::*;
use crate::capture::{CameraPixelSet, Measurements, NoiseModel, Pattern};
use crate::job_executor::{Executor, SequentialExecutor};
use crate::recover::sampling::pixels_by_window;
use crate::recover::{TailEstimate, WindowSizeEstimate, mean_function, pattern_check};
use crate::transport::{
    CHANNELS, CameraPixel, Correspondence, Extent, TileTransportFunctions, Window,
};

/// Runs jobs in reverse order, on which results must not depend.
struct ReverseOrder;

impl Executor for ReverseOrder {
    fn map<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        let mut results: Vec<T> = (0..count).rev().map(work).collect();
        results.reverse();
        results
    }
}

/// Uniform pseudo-random numbers in [0, 1).
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

const SIDE: u32 = 48;
const WINDOW: u32 = 7;

fn geometry() -> Geometry {
    Geometry {
        camera: Extent::new(SIDE, SIDE),
        light: Extent::new(SIDE / 2, SIDE / 2),
        window: Window::new(WINDOW).unwrap(),
        correspondence: Correspondence::from_affine([[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]]),
        tile_side: 32,
    }
}

fn picture() -> TileRect {
    TileRect {
        x: 0,
        y: 0,
        extent: geometry().camera,
    }
}

/// Gaussian spots whose position and size change smoothly over the picture, `[pixel, element]`.
fn object(geometry: &Geometry) -> Vec<[f64; CHANNELS]> {
    let side = WINDOW as usize;
    let mut tau = Vec::new();
    for pixel in picture().pixels() {
        let (x, y) = (f64::from(pixel.x), f64::from(pixel.y));
        let (du, dv) = ((0.21 * x + 0.1 * y).sin(), (0.17 * y - 0.13 * x).cos());
        let at = geometry.correspondence.at(pixel);
        let size = 0.7 + 0.3 * (0.11 * x).sin();
        let origin = geometry.window_origin(pixel);
        for s in 0..side * side {
            let element = geometry.window.element(origin, s);
            let u = f64::from(element.u) + 0.5 - at.u - du;
            let v = f64::from(element.v) + 0.5 - at.v - dv;
            let value = (-(u * u + v * v) / (2.0 * size * size)).exp() * 0.1;
            let lit = element.index_in(geometry.light).is_some();
            let bright = 0.7 + 0.3 * (0.05 * x * y).cos();
            tau.push([1.0, 0.8, 0.5].map(|c| if lit { c * bright * value } else { 0.0 }));
        }
    }
    tau
}

fn measurements(patterns: usize, seed: u64) -> (Measurements, Vec<[f64; CHANNELS]>) {
    let tau = object(&geometry());
    (photograph(patterns, seed, &tau), tau)
}

/// Measurements of `tau` under random patterns, with a little noise.
fn photograph(patterns: usize, seed: u64, tau: &[[f64; CHANNELS]]) -> Measurements {
    let geometry = geometry();
    let mut random = random(seed);
    let emissions: Vec<Vec<f32>> = (0..patterns)
        .map(|_| {
            let element = |_| if random() < 0.5 { 0.0 } else { 1.0 };
            (0..geometry.light.area()).map(element).collect()
        })
        .collect();
    let area = geometry.window.area();
    let pictures = emissions
        .iter()
        .map(|pattern| {
            let pixels = picture().pixels().enumerate().map(|(n, pixel)| {
                let origin = geometry.window_origin(pixel);
                let mut y = [0.0; CHANNELS];
                for s in 0..area {
                    let element = geometry.window.element(origin, s);
                    if let Some(m) = element.index_in(geometry.light) {
                        for c in 0..CHANNELS {
                            y[c] += f64::from(pattern[m]) * tau[n * area + s][c];
                        }
                    }
                }
                y.map(|y| (y + 1e-4 * (random() + random() + random() - 1.5) * 2.0) as f32)
            });
            pixels.collect()
        })
        .collect();
    Measurements {
        camera: geometry.camera,
        light: geometry.light,
        correspondence: geometry.correspondence,
        patterns: emissions.into_iter().map(Pattern::Grey).collect(),
        full_scale: vec![1.0; patterns],
        loaded: CameraPixelSet::all(Extent::new(SIDE, SIDE)),
        photos: pictures,
        flood: None,
        noise: NoiseModel {
            gain: [0.0; CHANNELS],
            floor: [1e-8; CHANNELS],
        },
    }
}

fn snr(tiles: &[TileTransportFunctions], tau: &[[f64; CHANNELS]]) -> f64 {
    let geometry = geometry();
    let area = geometry.window.area();
    let (mut signal, mut error) = (0.0, 0.0);
    for tile in tiles {
        for (p, pixel) in tile.rect.pixels().enumerate() {
            let n = geometry.camera.index(pixel);
            for s in 0..area {
                for c in 0..CHANNELS {
                    let truth = tau[n * area + s][c];
                    signal += truth * truth;
                    error += (truth - f64::from(tile.tau[p * area + s][c])).powi(2);
                }
            }
        }
    }
    10.0 * (signal / error).log10()
}

fn preparation<'a, E: Executor>(
    measurements: &'a CalibratedMeasurements<'a>,
    split: &'a HoldoutSplit,
    executor: &'a E,
) -> RecoveryPreparationInput<'a, E> {
    RecoveryPreparationInput {
        measurements,
        geometry: geometry(),
        split,
        executor,
    }
}

fn learn(
    measurements: &Measurements,
    executor: &impl Executor,
) -> Result<LearnedRecovery, RecoverError> {
    let split = HoldoutSplit::new(&measurements.patterns);
    let measurements = CalibratedMeasurements::uncorrected(measurements);
    let preparation = preparation(&measurements, &split, executor);
    pollster::block_on(async {
        let mean = mean_function::mean_function(&preparation).await?;
        pattern_check::check_patterns(&preparation, &mean).await?;
        LearnedRecovery::new(&preparation, &mean).await
    })
}

fn least_squares(preparation: &RecoveryPreparationInput<impl Executor>) -> PixelwiseRecovery {
    pollster::block_on(PixelwiseRecovery::least_squares(preparation)).unwrap()
}

fn estimate_window(measurements: &Measurements) -> WindowSizeEstimate {
    let estimate = WindowSizeEstimate::from_measurements(measurements, &SequentialExecutor);
    pollster::block_on(estimate).unwrap()
}

/// A reproducible stream of nearly normal numbers of variance 1.
pub(super) fn normal() -> impl FnMut() -> f64 {
    let mut state = 0x9E37_79B9_7F4A_7C15u64;
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

/// Observations of coefficients `z`, `[pixel, channel, r]`, with brightness 1, one diagonal Gram matrix, `[r]`, and
/// standard normal numbers `normal` for the noise.
pub(super) fn synthetic_equations(
    rect: TileRect,
    diagonal: &[f64],
    z: &[f64],
    variance: f64,
    mut normal: impl FnMut() -> f64,
) -> ObservationEquations {
    let rank = diagonal.len();
    let mut gram = vec![0.0; rank * rank];
    (0..rank).for_each(|k| gram[k * rank + k] = diagonal[k]);
    let observations = rect.pixels().flat_map(|pixel| {
        let observation = PixelObservation {
            gram: 0,
            brightness: 1.0,
            variance,
            energy: 0.0,
            count: rank,
            phase: (pixel.y % 2 * 2 + pixel.x % 2) as usize,
            has_full_window: true,
        };
        [observation; CHANNELS]
    });
    let right_hand_sides = z.iter().enumerate().map(|(i, z)| {
        let g = diagonal[i % rank];
        g * z + (variance * g).sqrt() * normal()
    });
    ObservationEquations {
        rect,
        rank,
        observations: observations.collect(),
        gram_matrices: vec![gram],
        right_hand_sides: right_hand_sides.collect(),
    }
}

#[test]
fn learned_recovery_beats_least_squares_with_few_patterns() {
    let geometry = geometry();
    let (measurements, tau) = measurements(20, 7);
    let measurements = CalibratedMeasurements::uncorrected(&measurements);
    let learned = learn(&measurements, &SequentialExecutor).unwrap();
    let split = HoldoutSplit::new(&measurements.patterns);
    let preparation = preparation(&measurements, &split, &SequentialExecutor);
    let direct = least_squares(&preparation);
    let ours: Vec<_> = geometry
        .tiles()
        .map(|rect| {
            let tile = learned.tile(&measurements, &split, rect);
            tile.functions(&geometry, Some(learned.basis()))
        })
        .collect();
    let theirs: Vec<_> = geometry
        .tiles()
        .map(|rect| direct.tile(&measurements, &split.all, rect))
        .collect();
    let (ours, theirs) = (snr(&ours, &tau), snr(&theirs, &tau));
    assert!(ours > theirs + 6.0, "{ours} dB against {theirs} dB");
    assert!(ours > 20.0, "{ours} dB");
}

#[test]
fn short_exposures_weigh_less_than_long_ones() {
    let (mut measurements, tau) = measurements(32, 7);
    let mut random = random(5);
    let mut normal = || (0..12).map(|_| random()).sum::<f64>() - 6.0;
    measurements.noise.gain = [2e-5; CHANNELS];
    for (l, picture) in measurements.photos.iter_mut().enumerate() {
        let exposure: f64 = if l % 2 == 0 { 1.0 } else { 1.0 / 16.0 };
        measurements.full_scale[l] = exposure.recip() as f32;
        for y in picture.iter_mut().flatten() {
            *y += (2e-5 * f64::from(*y).max(0.0) / exposure).sqrt() as f32 * normal() as f32;
        }
    }
    let geometry = geometry();
    let recovered = |measurements: &Measurements| {
        let measurements = &CalibratedMeasurements::uncorrected(measurements);
        let learned = learn(measurements, &SequentialExecutor).unwrap();
        let split = HoldoutSplit::new(&measurements.patterns);
        let preparation = preparation(measurements, &split, &SequentialExecutor);
        let direct = least_squares(&preparation);
        let learned = geometry.tiles().map(|rect| {
            let tile = learned.tile(measurements, &split, rect);
            tile.functions(&geometry, Some(learned.basis()))
        });
        let tiles = geometry.tiles();
        let direct = tiles.map(|rect| direct.tile(measurements, &split.all, rect));
        [learned.collect::<Vec<_>>(), direct.collect()].map(|tiles| snr(&tiles, &tau))
    };
    let known = recovered(&measurements);
    measurements.full_scale.fill(1.0);
    let unknown = recovered(&measurements);
    for (i, gain) in [1.0, 0.3].into_iter().enumerate() {
        let (known, unknown) = (known[i], unknown[i]);
        assert!(known > unknown + gain, "{known} dB against {unknown} dB");
    }
}

#[test]
fn execution_order_does_not_change_the_result() {
    let geometry = geometry();
    let (measurements, _) = measurements(12, 3);
    let measurements = CalibratedMeasurements::uncorrected(&measurements);
    let one = learn(&measurements, &SequentialExecutor).unwrap();
    let other = learn(&measurements, &ReverseOrder).unwrap();
    assert_eq!(one.basis(), other.basis());
    let rect = geometry.tile(1);
    let split = HoldoutSplit::new(&measurements.patterns);
    assert_eq!(
        one.tile(&measurements, &split, rect),
        other.tile(&measurements, &split, rect)
    );
}

#[test]
fn training_uses_pixels_with_saturated_samples() {
    let geometry = geometry();
    let (mut measurements, tau) = measurements(20, 7);
    let windows = pixels_by_window(&geometry, picture());
    for (i, (_, pixels)) in windows.iter().enumerate() {
        for &(n, _) in pixels {
            measurements.photos[i % 20][n] = [f32::NAN; CHANNELS];
        }
    }
    let measurements = CalibratedMeasurements::uncorrected(&measurements);
    let learned = learn(&measurements, &SequentialExecutor).unwrap();
    let split = HoldoutSplit::new(&measurements.patterns);
    let tiles = geometry.tiles().map(|rect| {
        let tile = learned.tile(&measurements, &split, rect);
        tile.functions(&geometry, Some(learned.basis()))
    });
    let snr = snr(&tiles.collect::<Vec<_>>(), &tau);
    assert!(snr > 19.0, "{snr} dB");
}

#[test]
fn estimated_band_is_as_wide_as_the_objects() {
    let (measurements, _) = measurements(80, 7);
    let estimate = estimate_window(&measurements);
    // The estimate has a margin of one ring.
    let side = estimate.window.side();
    assert!((WINDOW..=WINDOW + 2).contains(&side), "{estimate:?}");
    assert!(
        matches!(estimate.band, TailEstimate::Bounded { tail_fraction } if tail_fraction < 0.01),
        "{estimate:?}"
    );
}

#[test]
fn blending_improves_sparse_unrelated_functions() {
    // Two random elements in each window, which a Gaussian prior cannot represent.
    let geometry = geometry();
    let area = geometry.window.area();
    let mut random_slot = random(11);
    let mut tau = vec![[0.0; CHANNELS]; geometry.camera.area() * area];
    for (n, pixel) in picture().pixels().enumerate() {
        let origin = geometry.window_origin(pixel);
        for _ in 0..2 {
            let s = (random_slot() * area as f64) as usize;
            let lit = geometry.window.element(origin, s).index_in(geometry.light);
            if lit.is_some() {
                tau[n * area + s] = [0.5; CHANNELS];
            }
        }
    }
    let measurements = photograph(40, 7, &tau);
    let measurements = CalibratedMeasurements::uncorrected(&measurements);
    let mut learned = learn(&measurements, &SequentialExecutor).unwrap();
    assert!(learned.nnls.is_some());
    let split = HoldoutSplit::new(&measurements.patterns);
    let recovered = |learned: &LearnedRecovery| -> Vec<_> {
        let tiles = geometry.tiles().map(|rect| {
            let tile = learned.tile(&measurements, &split, rect);
            tile.functions(&geometry, Some(learned.basis()))
        });
        tiles.collect()
    };
    let blended = snr(&recovered(&learned), &tau);
    learned.nnls = None;
    let alone = snr(&recovered(&learned), &tau);
    assert!(blended > alone + 1.0, "{blended} dB against {alone} dB");
}

#[test]
fn saturated_photographs_are_an_overexposed_error() {
    let (mut measurements, _) = measurements(6, 1);
    for picture in &mut measurements.photos {
        picture.fill([f32::NAN; CHANNELS]);
    }
    let error = learn(&measurements, &SequentialExecutor).unwrap_err();
    assert!(matches!(error, RecoverError::Overexposed), "{error}");
    let estimate = estimate_window(&measurements);
    assert_eq!(estimate.band, TailEstimate::Undetermined);
}

#[test]
fn black_photographs_are_a_dark_error() {
    let (mut measurements, _) = measurements(6, 1);
    for picture in &mut measurements.photos {
        picture.fill([0.0; CHANNELS]);
    }
    let error = learn(&measurements, &SequentialExecutor).unwrap_err();
    assert!(matches!(error, RecoverError::NoSignal), "{error}");
}

#[test]
fn photographs_of_other_patterns_are_an_error() {
    let (mut measurements, _) = measurements(30, 1);
    measurements.photos.rotate_left(1);
    let error = learn(&measurements, &SequentialExecutor).unwrap_err();
    assert!(
        matches!(error, RecoverError::UncorrelatedPatterns),
        "{error}"
    );
    measurements.photos.rotate_right(1);
    measurements.photos.swap(4, 20);
    let error = learn(&measurements, &SequentialExecutor).unwrap_err();
    assert!(
        matches!(&error, RecoverError::MismatchedPatterns { pattern_indices } if pattern_indices == &[4, 20]),
        "{error}"
    );
    // Sensor noise only.
    let mut random = random(3);
    for sample in measurements.photos.iter_mut().flatten().flatten() {
        *sample = 1e-3 * (random() - 0.499) as f32;
    }
    let error = learn(&measurements, &SequentialExecutor).unwrap_err();
    assert!(
        matches!(error, RecoverError::UncorrelatedPatterns),
        "{error}"
    );
}

/// A basis of three single light elements.
fn single_elements() -> LearnedBasis {
    let area = (WINDOW * WINDOW) as usize;
    let mut functions = vec![0.0; 3 * area];
    for (k, s) in [24, 25, 31].into_iter().enumerate() {
        functions[k * area + s] = 1.0;
    }
    let mut mean = vec![0.0; area];
    mean[24] = 1.0;
    LearnedBasis::new(&functions, &mean)
}

fn two_by_two() -> TileRect {
    TileRect {
        x: 20,
        y: 20,
        extent: Extent::new(2, 2),
    }
}

#[test]
fn posterior_mean_minimises_the_negative_log_posterior() {
    let (measurements, _) = measurements(10, 5);
    let measurements = CalibratedMeasurements::uncorrected(&measurements);
    let all: Vec<usize> = (0..10).collect();
    let basis = single_elements();
    let equations =
        ObservationEquations::new(&measurements, &geometry(), &basis, &all, two_by_two());
    let covariance = [2.0, 0.5, 0.1, 0.5, 1.0, 0.2, 0.1, 0.2, 0.7];
    let prior = PriorPrecision::new(&covariance, 3);
    let mean = [0.8, 0.1, -0.2];
    let mut solver = PosteriorSolver::new(3);
    for index in 0..12 {
        solver.infer(&equations, index, 1.3, &prior, &mean);
        let observation = equations.observations[index];
        let gram = equations.gram(index);
        let variance = 1.3 * observation.variance;
        // The gradient of ‖y − fBz‖²/σ² + (z − m)ᵀC⁻¹(z − m) times C, which needs no inverse:
        // (z − m) − C f Bᵀ(y − fBz)/σ² = 0.
        let residual: Vec<f64> = (0..3)
            .map(|k| {
                let product: f64 = (0..3).map(|j| gram[k * 3 + j] * solver.mean[j]).sum();
                observation.brightness
                    * (equations.right_hand_side(index)[k] - observation.brightness * product)
                    / variance
            })
            .collect();
        for k in 0..3 {
            let step: f64 = (0..3).map(|j| covariance[k * 3 + j] * residual[j]).sum();
            let off = solver.mean[k] - mean[k] - step;
            assert!(off.abs() < 1e-6 * (1.0 + step.abs()), "{off} of {step}");
        }
    }
}

#[test]
fn a_saturated_sample_counts_as_missing() {
    let (mut measurements, _) = measurements(10, 5);
    let basis = single_elements();
    let without: Vec<usize> = (0..10).filter(|&l| l != 4).collect();
    let uncorrected = CalibratedMeasurements::uncorrected(&measurements);
    let clean =
        ObservationEquations::new(&uncorrected, &geometry(), &basis, &without, two_by_two());
    let n = geometry().camera.index(CameraPixel { x: 21, y: 20 });
    measurements.photos[4][n] = [f32::NAN; CHANNELS];
    let all: Vec<usize> = (0..10).collect();
    let uncorrected = CalibratedMeasurements::uncorrected(&measurements);
    let saturated =
        ObservationEquations::new(&uncorrected, &geometry(), &basis, &all, two_by_two());
    for index in 3..6 {
        assert_eq!(saturated.gram(index), clean.gram(index));
        assert_eq!(
            saturated.right_hand_side(index),
            clean.right_hand_side(index)
        );
        assert_eq!(
            saturated.observations[index].brightness,
            clean.observations[index].brightness
        );
        assert_eq!(saturated.observations[index].count, 9);
    }
    assert_eq!(saturated.observations[0].count, 10);
}

#[test]
fn rgb_patterns_with_equal_channels_equal_grey_patterns() {
    let (grey, _) = measurements(8, 9);
    let mut colour = grey.clone();
    for pattern in &mut colour.patterns {
        let plane = pattern.plane(0).to_vec();
        *pattern = Pattern::Rgb([plane.clone(), plane.clone(), plane]);
    }
    let all: Vec<usize> = (0..8).collect();
    let basis = single_elements();
    let [grey, colour] = [&grey, &colour].map(CalibratedMeasurements::uncorrected);
    let a = ObservationEquations::new(&grey, &geometry(), &basis, &all, two_by_two());
    let b = ObservationEquations::new(&colour, &geometry(), &basis, &all, two_by_two());
    for index in 0..12 {
        assert_eq!(a.gram(index), b.gram(index));
        assert_eq!(a.right_hand_side(index), b.right_hand_side(index));
        assert_eq!(
            a.observations[index].brightness,
            b.observations[index].brightness
        );
    }
}

/// Browsers' tests have no threads to stand for processes.
#[cfg(not(target_arch = "wasm32"))]
mod in_groups {
    use super::*;
    use crate::export;
    use crate::job_executor::test_group::run_in_group;
    use crate::recover::{Method, SparsityBasis};

    #[test]
    fn a_group_of_processes_prepares_the_same_recovery() {
        let (measurements, _) = measurements(30, 3);
        let prepare = |method, window, size| {
            let prepared = run_in_group(size, |executor| {
                let settings = export::ExportSettings {
                    method,
                    window,
                    is_registered: true,
                };
                let preparation = export::prepare(&measurements, settings, executor);
                let prepared = pollster::block_on(preparation).unwrap();
                let snr = prepared.expected_snr().unwrap();
                let recovery = postcard::to_allocvec(&prepared.recovery).unwrap();
                (recovery, snr.0.to_bits())
            });
            assert!(prepared.iter().all(|one| *one == prepared[0]), "{size}");
            prepared[0].clone()
        };
        let window = Some(geometry().window);
        for (method, window, sizes) in [
            (Method::Learned, window, &[2, 3][..]),
            (Method::Nnls, None, &[2, 9]),
            (Method::Bpdn(SparsityBasis::Identity), window, &[2]),
        ] {
            let alone = prepare(method, window, 1);
            for &size in sizes {
                assert!(prepare(method, window, size) == alone, "{method:?}, {size}");
            }
        }
    }
}
