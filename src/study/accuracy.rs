//! The SNR and the time of one method against the known transport, by the number of photographs.

use std::time::Instant;

use super::chart::ChartSeries;
use super::error::StudyError;
use super::method_sample_sizes::sample_for;
use super::pixel_sampling;
use crate::capture::Measurements;
use crate::job_executor::Executor;
use crate::recover::{Method, PreparedRecovery, RecoverySettings};
use crate::transport::{Decibels, KnownTransport, SnrAccumulator, transport_error};

/// SNR and time of a method.
#[derive(Clone, Copy, Debug)]
pub(super) struct AccuracyPoint {
    /// Number of photographs that the method uses.
    pub photographs: usize,
    /// SNR of the whole matrix; `None` if the error is zero.
    pub snr: Option<Decibels>,
    /// Standard error of `snr` in dB, because only a sample of pixels was recovered; 0 if all were.
    pub standard_error: f64,
    /// Number of recovered camera pixels.
    pub pixels: usize,
    /// Wall-clock time of recovering all pixels, extrapolated from the sample.
    pub seconds: f64,
}

/// The points of one method, by ascending number of photographs.
pub(super) struct MethodCurve {
    pub name: String,
    pub points: Vec<AccuracyPoint>,
}

impl MethodCurve {
    /// The accuracy with this number of photographs.
    pub fn at(&self, photographs: usize) -> Option<&AccuracyPoint> {
        let mut points = self.points.iter();
        points.find(|point| point.photographs == photographs)
    }

    /// The line of the curve in a chart of SNR by `x(photographs)`.
    pub fn series(&self, x: impl Fn(usize) -> f64) -> ChartSeries {
        let points = self.points.iter();
        let points = points.filter_map(|p| Some((x(p.photographs), p.snr?.0)));
        ChartSeries {
            name: self.name.clone(),
            points: points.collect(),
        }
    }
}

/// Recovers a sample of about `pixels` pixels, scaled by the method's speed ([`sample_for`]), and compares it
/// with the known transport. Errors are those of [`PreparedRecovery::prepare`].
pub(super) fn measure_accuracy(
    known: &impl KnownTransport,
    measurements: &Measurements,
    method: Method,
    pixels: usize,
    executor: &impl Executor,
) -> Result<AccuracyPoint, StudyError> {
    let start = Instant::now();
    let settings = RecoverySettings {
        method,
        window: known.geometry().window,
        is_registered: true,
    };
    let preparation = PreparedRecovery::prepare(measurements, settings, executor);
    let recovery = pollster::block_on(preparation)?;
    let prepared = start.elapsed().as_secs_f64();
    let geometry = recovery.geometry();
    let rects = sample_for(method, geometry, pixels);
    let functions = executor.map(rects.len(), |i| {
        let tile = recovery.tile(measurements, rects[i]);
        tile.functions(geometry, recovery.basis())
    });
    let recovered = start.elapsed().as_secs_f64();
    let error = |i: usize| transport_error(known, geometry, &functions[i]);
    let errors = executor.map(functions.len(), error);
    let pixels = pixel_sampling::count_pixels(&rects);
    let all = geometry.camera.area();
    let (snr, standard_error) = pooled_snr(&errors, pixels as f64 / all as f64);
    let per_pixel = (recovered - prepared) / pixels as f64;
    Ok(AccuracyPoint {
        photographs: measurements.patterns.len(),
        snr,
        standard_error,
        pixels,
        seconds: prepared + per_pixel * all as f64,
    })
}

/// SNR over all `parts`, and its standard error in dB if they are a random sample that covers a `share` of the
/// picture: that of a ratio of two sums (Cochran 1977, section 6.4).
pub(super) fn pooled_snr(parts: &[SnrAccumulator], share: f64) -> (Option<Decibels>, f64) {
    let sum: SnrAccumulator = parts.iter().copied().sum();
    let n = parts.len() as f64;
    let SnrAccumulator { signal, error } = sum;
    if parts.len() < 2 || signal == 0.0 || error == 0.0 {
        return (sum.snr(), 0.0);
    }
    let squares = parts
        .iter()
        .map(|part| (part.signal / signal - part.error / error).powi(2));
    let variance = squares.sum::<f64>() * n / (n - 1.0) * (1.0 - share).max(0.0);
    (sum.snr(), 10.0 / std::f64::consts::LN_10 * variance.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(truth: f64, estimate: f64) -> SnrAccumulator {
        let mut part = SnrAccumulator::default();
        part.add(truth, estimate);
        part
    }

    #[test]
    fn standard_error_is_zero_for_equal_parts_or_complete_samples() {
        let (snr, standard_error) = pooled_snr(&[part(1.0, 0.9); 5], 0.1);
        assert!((snr.unwrap().0 - 20.0).abs() < 1e-9);
        assert!(standard_error < 1e-9);
        let unequal = [part(1.0, 0.9), part(1.0, 0.99)];
        assert!(pooled_snr(&unequal, 0.1).1 > 1.0);
        assert_eq!(pooled_snr(&unequal, 1.0).1, 0.0, "all were judged");
    }
}
