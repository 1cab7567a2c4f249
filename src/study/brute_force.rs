//! Scanning: one photograph for each light element.

use super::Picture;
use super::dense::Dense;
use crate::transport::{CHANNELS, Decibels, TransportError};

/// SNR after the first 1, 2, … M elements have been scanned, row by row; what has not been scanned
/// is taken to be dark. `photographs[m]` shows element `m` alone at full brightness.
pub(super) fn scan(truth: &Dense, photographs: &[Picture]) -> Vec<Option<Decibels>> {
    let columns: Vec<(TransportError, TransportError)> = photographs
        .iter()
        .enumerate()
        .map(|(m, photograph)| {
            let mut column = <(TransportError, TransportError)>::default();
            for (n, y) in photograph.iter().enumerate() {
                let tau = truth.pixel(n)[m];
                for c in 0..CHANNELS {
                    // Light is never negative; noise is.
                    let estimate = f64::from(y[c].max(0.0));
                    column.0.add(f64::from(tau[c]), estimate);
                    column.1.add(f64::from(tau[c]), 0.0);
                }
            }
            column
        })
        .collect();
    let sum = |errors: &mut dyn Iterator<Item = TransportError>| {
        let mut sum = TransportError::default();
        errors.for_each(|error| sum.merge(error));
        sum.snr()
    };
    (1..=columns.len())
        .map(|scanned| {
            let (done, left) = columns.split_at(scanned);
            sum(&mut done.iter().map(|c| c.0).chain(left.iter().map(|c| c.1)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scanning_without_noise_is_exact_in_the_end() {
        let truth = Dense {
            elements: 2,
            tau: vec![[0.3; 3], [0.4; 3], [0.0; 3], [0.5; 3]],
        };
        let photograph = |m: usize| vec![truth.pixel(0)[m], truth.pixel(1)[m]];
        let snr = scan(&truth, &[photograph(0), photograph(1)]);
        let half = 10.0 * (0.5f64 / 0.41).log10();
        assert!((snr[0].unwrap().0 - half).abs() < 1e-4);
        assert_eq!(snr[1], None, "no error is left");
    }
}
