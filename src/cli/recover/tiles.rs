//! Recovers tiles in parallel, into the checkpoint.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use anyhow::{Context, Result, bail};
use indicatif::ProgressBar;
use rayon::prelude::*;

use super::checkpoint::Checkpoint;
use super::tile_record;
use crate::capture::Measurements;
use crate::cli::process::{Interrupt, Interrupted};
use crate::cli::progress;
use crate::recover::{MIN_PATTERNS, Recovery};

/// The tiles of a prepared recovery, on their way into the checkpoint.
pub struct TileRecovery<'a> {
    interrupt: &'a Interrupt,
    recovery: &'a Recovery,
    bar: ProgressBar,
    pub checkpoint: Mutex<Checkpoint>,
}

impl<'a> TileRecovery<'a> {
    /// Shows progress from the tiles that `checkpoint` has already.
    pub fn new(interrupt: &'a Interrupt, recovery: &'a Recovery, checkpoint: Checkpoint) -> Self {
        let tiles = recovery.geometry().tile_grid().area();
        let bar = progress::bar("recovering", tiles);
        bar.set_position(checkpoint.count() as u64);
        bar.reset_eta(); // these tiles took no time
        Self {
            interrupt,
            recovery,
            bar,
            checkpoint: Mutex::new(checkpoint),
        }
    }

    /// Recovers those tiles in the rows of tiles `tile_rows` that the checkpoint lacks. Returns the number of
    /// overexposed pixels in these rows, which is zero without any `has_saturation`.
    pub fn recover_rows(
        &self,
        measurements: &Measurements,
        tile_rows: Range<u32>,
        has_saturation: bool,
    ) -> Result<usize> {
        let geometry = self.recovery.geometry();
        let columns = geometry.tile_grid().width;
        let tiles = (tile_rows.start * columns) as usize..(tile_rows.end * columns) as usize;
        let overexposed = tiles.into_par_iter().map(|i| -> Result<usize> {
            let rect = geometry.tile(i);
            if !self.lock().has(i) {
                if self.interrupt.is_requested() {
                    bail!(Interrupted(String::new()));
                }
                let tile = self.recovery.tile(measurements, rect);
                let record = tile_record::encode(&tile).context("a tile cannot be compressed")?;
                self.lock().add(i, &record)?;
                self.bar.inc(1);
            }
            Ok(match has_saturation {
                true => measurements.count_overexposed_pixels(rect, MIN_PATTERNS),
                false => 0,
            })
        });
        match overexposed.try_reduce(|| 0, |a, b| Ok(a + b)) {
            Err(e) if e.is::<Interrupted>() => Err(self.interrupted()),
            other => other,
        }
    }

    /// Ends the progress bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }

    /// The error of an interrupted recovery.
    pub fn interrupted(&self) -> anyhow::Error {
        self.finish();
        interrupted(&self.lock())
    }

    fn lock(&self) -> MutexGuard<'_, Checkpoint> {
        let checkpoint = self.checkpoint.lock();
        checkpoint.unwrap_or_else(PoisonError::into_inner)
    }
}

/// Flushes the checkpoint of an interrupted recovery to disk, and returns the error.
pub fn interrupted(checkpoint: &Checkpoint) -> anyhow::Error {
    match checkpoint.sync_after_interruption() {
        Ok(message) => Interrupted(message).into(),
        Err(error) => error,
    }
}
