//! Recovery without a window: every light element is an unknown of every pixel (out-of-the-box compressive
//! sensing in the paper's terms).

use std::time::Instant;

use super::accuracy::{AccuracyPoint, pooled_snr};
use super::known_transport::DenseTransport;
use super::pixel_sampling;
use crate::capture::Measurements;
use crate::job_executor::Executor;
use crate::recover::Nnls;
use crate::transport::SnrAccumulator;

/// Recovers `pixels` random pixels, each by non-negative least squares over all M elements.
///
/// Least squares represents the paper's case (b) with φ = I as well: for τ ≥ 0 the ℓ1 norm is the pixel's total light,
/// which the measurements determine up to their noise.
///
/// Patterns must be grey, and no sample may be saturated.
pub(super) fn measure_accuracy(
    truth: &DenseTransport,
    measurements: &Measurements,
    pixels: usize,
    executor: &impl Executor,
) -> AccuracyPoint {
    let start = Instant::now();
    let gram = gram(measurements, executor);
    let shared = start.elapsed().as_secs_f64();
    let indices = pixel_sampling::random_indices(truth.len(), pixels);
    let start = Instant::now();
    let functions = executor.map(indices.len(), |i| {
        let mut solver = Nnls::new(&gram, measurements.light.area());
        [0, 1, 2].map(|c| solver.solve(&right_hand_side(measurements, indices[i], c)))
    });
    let each = start.elapsed().as_secs_f64() / indices.len() as f64;
    let errors = functions.iter().zip(indices).map(|(function, n)| {
        let mut error = SnrAccumulator::default();
        for (c, tau) in function.iter().enumerate() {
            for (truth, &tau) in truth[n].iter().zip(tau) {
                error.add(f64::from(truth[c]), tau);
            }
        }
        error
    });
    let errors: Vec<SnrAccumulator> = errors.collect();
    let (snr, standard_error) = pooled_snr(&errors, errors.len() as f64 / truth.len() as f64);
    AccuracyPoint {
        photographs: measurements.patterns.len(),
        snr,
        standard_error,
        pixels: errors.len(),
        seconds: shared + each * truth.len() as f64,
    }
}

/// `PᵀP`, `[M, M]`.
fn gram(measurements: &Measurements, executor: &impl Executor) -> Vec<f64> {
    let elements = measurements.light.area();
    let rows = executor.map(elements, |i| {
        let mut row = vec![0.0; elements];
        for pattern in &measurements.patterns {
            let plane = pattern.plane(0);
            let emission = f64::from(plane[i]);
            for (sum, &emitted) in row.iter_mut().zip(plane) {
                *sum += emission * f64::from(emitted);
            }
        }
        row
    });
    rows.concat()
}

/// `Pᵀy`, `[M]`.
fn right_hand_side(measurements: &Measurements, n: usize, c: usize) -> Vec<f64> {
    let mut sums = vec![0.0; measurements.light.area()];
    for (pattern, picture) in measurements.patterns.iter().zip(&measurements.photos) {
        let y = f64::from(picture[n][c]);
        for (sum, &emitted) in sums.iter_mut().zip(pattern.plane(0)) {
            *sum += y * f64::from(emitted);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardUniform};

    use super::*;
    use crate::capture::{CameraPixelSet, NoiseModel, Pattern};
    use crate::job_executor::SequentialExecutor;
    use crate::simulate::RandomStreamId;
    use crate::transport::{CHANNELS, Correspondence, Extent};

    #[test]
    fn a_sparse_function_is_recovered_from_all_elements() {
        // 16 elements, 10 patterns, two elements with transport.
        let mut tau = vec![[0.0f32; CHANNELS]; 16];
        tau[3] = [0.5, 0.2, 0.1];
        tau[11] = [0.0, 0.3, 0.4];
        let random = |l: u32| -> Vec<f32> {
            let mut stream = RandomStreamId::Pattern(l).start(1);
            (0..16)
                .map(|_| StandardUniform.sample(&mut stream))
                .collect()
        };
        let patterns: Vec<Vec<f32>> = (0..10).map(random).collect();
        let seen = |p: &Vec<f32>| {
            let y = |c: usize| p.iter().zip(&tau).map(|(p, t)| p * t[c]).sum();
            vec![[0, 1, 2].map(y)]
        };
        let measurements = Measurements {
            camera: Extent::new(1, 1),
            light: Extent::new(4, 4),
            correspondence: Correspondence::from_affine([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
            full_scale: vec![1.0; 10],
            loaded: CameraPixelSet::all(Extent::new(1, 1)),
            photos: patterns.iter().map(seen).collect(),
            flood: None,
            noise: NoiseModel {
                gain: [0.0; CHANNELS],
                floor: [0.0; CHANNELS],
            },
            patterns: patterns.into_iter().map(Pattern::Grey).collect(),
        };
        let truth = vec![tau];
        let accuracy = measure_accuracy(&truth, &measurements, 1, &SequentialExecutor);
        assert!(accuracy.snr.is_none_or(|snr| snr.0 > 60.0), "{accuracy:?}");
    }
}
