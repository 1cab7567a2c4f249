//! One recovery in one process: from the photographs to the file.

use std::cell::OnceCell;
use std::sync::Mutex;
use std::time::Instant;

use anyhow::Result;

use super::args::RecoverArgs;
use super::capture_sample::{CaptureSample, SampleSource};
use super::checkpoint::{Checkpoint, lock};
use super::checkpoint_key::{CheckpointKey, recovery_fingerprint};
use super::inputs::{RecoveryInputs, encoders};
use super::ltm_writer::{Destination, RecoveredTiles, finish};
use super::prepared_job::PreparedJob;
use super::report::RecoverReport;
use super::tile_recovery::{TilePhotographs, TileRecovery};
use crate::export::EncodingMemory;
use crate::job_executor::Cancelled;
use crate::recover::PreparedRecovery;
use crate::transport::Basis;

/// What to do after a `--max-bytes` that is too low.
const TOO_LARGE_REMEDY: &str = "the recovered tiles are kept: give the same command with --resume and a larger \
                                --max-bytes, or without --max-bytes";

pub struct RecoverJob<'a> {
    pub start: Instant,
    pub args: &'a RecoverArgs,
    pub inputs: &'a RecoveryInputs<'a>,
    pub source: SampleSource<'a>,
    /// What the file is written with.
    pub encoding: EncodingMemory,
}

impl RecoverJob<'_> {
    /// Recovers all tiles and writes the file.
    pub fn run(&self) -> Result<RecoverReport> {
        let checkpoint = OnceCell::new();
        // Before the long work, so that a checkpoint that does not match fails early.
        let open_checkpoint = || {
            let SampleSource { plan, cores } = self.source;
            let key = CheckpointKey::new(self.inputs, plan, cores)?;
            let opened = Checkpoint::open(&self.args.output, &key, self.args.resume)?;
            checkpoint.get_or_init(|| Mutex::new(opened));
            Ok(())
        };
        // Before the long work, too.
        let check = |recovery: &PreparedRecovery| {
            let rank = recovery.basis().map_or(0, Basis::rank);
            encoders(self.encoding, recovery.geometry(), self.inputs.levels, rank)?;
            match checkpoint.get() {
                Some(checkpoint) => {
                    lock(checkpoint).set_fingerprint(recovery_fingerprint(recovery))
                }
                None => Ok(()),
            }
        };
        let learned = PreparedJob::learn(self.inputs, self.source, open_checkpoint, check);
        let Some(checkpoint) = checkpoint.get() else {
            return Err(learned.err().unwrap_or_else(|| Cancelled.into()));
        };
        let report = learned.and_then(|(job, sample)| self.recover(job, sample, checkpoint));
        match &report {
            Ok(_) => lock(checkpoint).delete_on_drop = true,
            Err(error) if error.is::<Cancelled>() => return Err(lock(checkpoint).interrupted()),
            Err(_) => {}
        }
        report
    }

    /// Recovers into the checkpoint and writes the file. An interruption is reported as [`Cancelled`].
    fn recover(
        &self,
        job: PreparedJob,
        sample: CaptureSample,
        checkpoint: &Mutex<Checkpoint>,
    ) -> Result<RecoverReport> {
        let source = self.source;
        let tile_rows = 0..job.recovery.geometry().tile_grid().height;
        let photographs = TilePhotographs::of_sample(sample);
        let recovery = TileRecovery { job: &job, source };
        let counts = recovery.run(photographs, tile_rows, checkpoint)?;
        let destination = Destination {
            output: &self.args.output,
            memory: self.encoding,
            cores: source.cores,
            too_large_remedy: TOO_LARGE_REMEDY,
        };
        let record = |i| lock(checkpoint).read(i);
        let tiles = RecoveredTiles(&record);
        finish(self.start, self.inputs, job, counts, &destination, &tiles)
    }
}
