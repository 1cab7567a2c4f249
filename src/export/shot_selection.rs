//! The shots of a capture that are recovered from, and those that are held out.

use thiserror::Error;

use crate::capture::{Shot, group_ids};

/// Of every so many patterns, one is held out of the recovery to evaluate it.
const HOLD_OUT_INTERVAL: usize = 10;

/// A capture has fewer shots than asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("{wanted} shots were asked for, but the capture has {available}")]
pub struct TooFewShots {
    /// Number of shots asked for.
    pub wanted: usize,
    /// Number of shots in the capture.
    pub available: usize,
}

/// Indices of the shots to recover from: the first `count`, or all but those held out.
///
/// # Errors
/// If there are fewer than `count` shots.
pub fn select_shots(shots: &[Shot], count: Option<usize>) -> Result<Vec<usize>, TooFewShots> {
    let available = shots.len();
    match count {
        Some(wanted) if wanted > available => Err(TooFewShots { wanted, available }),
        Some(wanted) => Ok((0..wanted).collect()),
        None => {
            // Shots of one pattern at several exposures are held out together.
            let patterns = group_ids(shots.iter().map(|shot| &shot.pattern));
            let is_used = |i: &usize| patterns[*i] % HOLD_OUT_INTERVAL != HOLD_OUT_INTERVAL - 1;
            Ok((0..available).filter(is_used).collect())
        }
    }
}
