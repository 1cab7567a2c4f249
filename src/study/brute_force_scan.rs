//! Acquisition by scanning: one photograph for each light element, without computation.

use super::known_transport::DenseTransport;
use crate::capture::LinearPhoto;
use crate::transport::{CHANNELS, Decibels, SnrAccumulator};

/// The SNR after scanning the first 1, 2, … M elements. Columns that have not been scanned are estimated as
/// zero. `photographs[m]` shows element `m` alone at full brightness.
pub(super) fn snr_by_scans(
    truth: &DenseTransport,
    photographs: &[LinearPhoto],
) -> Vec<Option<Decibels>> {
    let columns: Vec<(SnrAccumulator, SnrAccumulator)> = photographs
        .iter()
        .enumerate()
        .map(|(m, photograph)| {
            let mut column = <(SnrAccumulator, SnrAccumulator)>::default();
            for (n, y) in photograph.iter().enumerate() {
                let tau = truth[n][m];
                for c in 0..CHANNELS {
                    // Noise makes measurements negative.
                    let estimate = f64::from(y[c].max(0.0));
                    column.0.add(f64::from(tau[c]), estimate);
                    column.1.add(f64::from(tau[c]), 0.0);
                }
            }
            column
        })
        .collect();
    (1..=columns.len())
        .map(|scanned| {
            let (scanned, unscanned) = columns.split_at(scanned);
            let scanned = scanned.iter().map(|c| c.0);
            let errors = scanned.chain(unscanned.iter().map(|c| c.1));
            errors.sum::<SnrAccumulator>().snr()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_complete_scan_without_noise_is_exact() {
        let truth = vec![vec![[0.3; 3], [0.4; 3]], vec![[0.0; 3], [0.5; 3]]];
        let photograph = |m: usize| vec![truth[0][m], truth[1][m]];
        let snr = snr_by_scans(&truth, &[photograph(0), photograph(1)]);
        let half = 10.0 * (0.5f64 / 0.41).log10();
        assert!((snr[0].unwrap().0 - half).abs() < 1e-4);
        assert_eq!(snr[1], None, "no error is left");
    }
}
