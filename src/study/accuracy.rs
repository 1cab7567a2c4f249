//! One method on one set of measurements, held against the truth.

use std::time::Instant;

use super::known::{Known, error_of};
use super::methods::judged;
use super::{StudyError, blocks};
use crate::capture::Measurements;
use crate::executor::Executor;
use crate::recover::{Method, Recovery, Settings};
use crate::transport::{Decibels, TransportError};

/// How well a method did, and what it cost.
#[derive(Clone, Copy, Debug)]
pub(super) struct Accuracy {
    /// SNR of the whole matrix; `None` where there is no error at all.
    pub snr: Option<Decibels>,
    /// Standard error of `snr` from judging a sample of pixels, in dB; 0 where all were judged.
    pub standard_error: f64,
    /// Camera pixels judged.
    pub pixels: usize,
    /// Wall clock of recovering all pixels, scaled up from those judged.
    pub seconds: f64,
}

/// Recovers and judges about `pixels` pixels, or more or fewer of them as the method is faster or
/// slower ([`judged`]).
pub(super) fn judge(
    known: &impl Known,
    measurements: &Measurements,
    method: Method,
    pixels: usize,
    executor: &impl Executor,
) -> Result<Accuracy, StudyError> {
    let start = Instant::now();
    let settings = Settings {
        method,
        window: known.geometry().window,
    };
    let recovery = Recovery::prepare(measurements, settings, executor)?;
    let prepared = start.elapsed().as_secs_f64();
    let geometry = *recovery.geometry();
    let rects = judged(method, &geometry, pixels);
    let functions = executor.map(rects.len(), |i| {
        let tile = recovery.tile(measurements, rects[i]);
        tile.functions(&geometry, recovery.basis())
    });
    let recovered = start.elapsed().as_secs_f64();
    let errors = executor.map(functions.len(), |i| {
        error_of(known, &geometry, &functions[i])
    });
    let pixels = blocks::pixels(&rects);
    let all = geometry.camera.area();
    let (snr, standard_error) = pooled(&errors, pixels as f64 / all as f64);
    let per_pixel = (recovered - prepared) / pixels as f64;
    Ok(Accuracy {
        snr,
        standard_error,
        pixels,
        seconds: prepared + per_pixel * all as f64,
    })
}

/// SNR over all `parts`, and its standard error if they are a random `share` of what there is: that
/// of a ratio of two sums (Cochran 1977, section 6.4), as decibels.
pub(super) fn pooled(parts: &[TransportError], share: f64) -> (Option<Decibels>, f64) {
    let mut sum = TransportError::default();
    parts.iter().for_each(|&part| sum.merge(part));
    let n = parts.len() as f64;
    let (signal, error) = (sum.signal(), sum.error());
    if parts.len() < 2 || signal == 0.0 || error == 0.0 {
        return (sum.snr(), 0.0);
    }
    let squares = parts
        .iter()
        .map(|part| (part.signal() / signal - part.error() / error).powi(2));
    let variance = squares.sum::<f64>() * n / (n - 1.0) * (1.0 - share).max(0.0);
    (sum.snr(), 10.0 / std::f64::consts::LN_10 * variance.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(truth: f64, estimate: f64) -> TransportError {
        let mut part = TransportError::default();
        part.add(truth, estimate);
        part
    }

    #[test]
    fn a_sample_of_equal_parts_leaves_no_doubt_and_one_of_unequal_parts_does() {
        let (snr, doubt) = pooled(&[part(1.0, 0.9); 5], 0.1);
        assert!((snr.unwrap().0 - 20.0).abs() < 1e-9);
        assert!(doubt < 1e-9);
        let unequal = [part(1.0, 0.9), part(1.0, 0.99)];
        assert!(pooled(&unequal, 0.1).1 > 1.0);
        assert_eq!(pooled(&unequal, 1.0).1, 0.0, "all were judged");
    }
}
