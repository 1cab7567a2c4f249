//! Encodes recovered tiles and writes the `.ltm` file.

use std::fs::File;
use std::io;
use std::mem;
use std::path::Path;
use std::time::Instant;

use anyhow::{Error, Result};

use super::findings::Findings;
use super::inputs::{RecoveryInputs, encoders};
use super::messages;
use super::prepared_job::PreparedJob;
use super::report::RecoverReport;
use super::tile_recovery::TileCounts;
use crate::cli::levels_output::{temporary_spool, write_levels};
use crate::cli::output_file::{LTM, OutputFile};
use crate::cli::process_resources::{InterruptibleCores, cancelled_or, thread_pool};
use crate::cli::progress;
use crate::export::{self, EncodingMemory, FileQuality};
use crate::format::{ChunkStore, EncodedFile, FormatError, Metadata, ShardId, SpooledChunks};
use crate::pyramid::{PyramidLayout, PyramidSource, no_shard};
use crate::transport::Decibels;

/// Share of the bytes that the finest of several levels usually takes.
const LEVEL_0_SHARE: f64 = 0.75;
/// Share of the bytes that would fit in the next attempt.
const RETRY_SHARE: f64 = 0.98;

/// Reads the record of a tile.
pub type ReadTile<'a> = dyn Fn(usize) -> io::Result<Vec<u8>> + Sync + 'a;

/// Where a file goes, and what it is written with.
pub struct Destination<'a> {
    pub output: &'a Path,
    pub memory: EncodingMemory,
    pub cores: &'a InterruptibleCores,
    /// What to do after a `--max-bytes` that is too low.
    pub too_large_remedy: &'static str,
}

/// What a file is encoded from beside its tiles.
pub struct WriterInput<'a> {
    pub job: &'a PreparedJob,
    pub metadata: &'a Metadata,
    pub destination: &'a Destination<'a>,
}

/// The tiles of a file.
pub trait FileTiles: Sync {
    /// Where the chunks of the file are.
    type Store: ChunkStore + Sync;

    /// The file of one level.
    ///
    /// # Errors
    /// If a tile cannot be read, or the target not be reached.
    fn encode(
        &self,
        input: &WriterInput<'_>,
        quality: FileQuality,
    ) -> Result<EncodedFile<Self::Store>, FormatError>;

    /// The file of a shard of a coarser level, if it is made already.
    ///
    /// # Errors
    /// If it cannot be read.
    fn level_shard(&self, shard: ShardId) -> Result<Option<Vec<u8>>, FormatError> {
        no_shard(shard)
    }
}

/// Recovered tiles, whose records this function reads.
pub struct RecoveredTiles<'a>(pub &'a ReadTile<'a>);

impl FileTiles for RecoveredTiles<'_> {
    type Store = SpooledChunks<File>;

    fn encode(
        &self,
        input: &WriterInput<'_>,
        quality: FileQuality,
    ) -> Result<EncodedFile<Self::Store>, FormatError> {
        let WriterInput {
            job,
            metadata,
            destination,
        } = *input;
        let Destination { output, cores, .. } = *destination;
        let new_store = || temporary_spool(output).map(SpooledChunks::new);
        let recovery = &job.recovery;
        match &job.coding {
            Some(plan) => {
                export::encode_planned(recovery, plan, self.0, metadata, cores, new_store()?)
            }
            None => {
                let metadata = metadata.clone();
                export::encode_file(recovery, self.0, metadata, quality, cores, new_store)
            }
        }
    }
}

/// Writes the file of a recovery.
struct LtmWriter<'a, T> {
    tiles: &'a T,
    input: WriterInput<'a>,
    quality: FileQuality,
    /// Number of levels of the file.
    levels: u32,
    /// Those about the capture, to which those about the file are added.
    findings: Findings,
    /// Whether a warning is an error.
    strict: bool,
}

/// Writes the file of `tiles`, as `recover` and its last stage do. `counts` are those of the tiles.
///
/// # Errors
/// If there is a warning and `--strict`, and if the file cannot be written. An interruption is reported as
/// [`Cancelled`](crate::job_executor::Cancelled).
pub fn finish(
    start: Instant,
    inputs: &RecoveryInputs<'_>,
    mut job: PreparedJob,
    counts: TileCounts,
    destination: &Destination<'_>,
    tiles: &impl FileTiles,
) -> Result<RecoverReport> {
    job.findings.add(messages::defective_pixels(counts.defects));
    job.findings.add(messages::overexposure(counts.overexposed));
    job.findings.check(inputs.options.strict)?;
    let metadata = job.metadata(&inputs.shots, inputs.options.method())?;
    let findings = mem::take(&mut job.findings);
    let input = WriterInput {
        job: &job,
        metadata: &metadata,
        destination,
    };
    let mut writer = LtmWriter {
        tiles,
        input,
        quality: inputs.options.quality(),
        levels: inputs.levels,
        findings,
        strict: inputs.options.strict,
    };
    let written = writer.write()?;
    job.findings = writer.findings;
    Ok(RecoverReport::new(start, inputs, &job, counts, &written))
}

/// A file that was written.
pub struct WrittenFile {
    pub bytes: u64,
    /// SNR relative to the tiles.
    pub snr: Option<Decibels>,
}

impl<T: FileTiles> LtmWriter<'_, T> {
    /// Encodes the tiles and writes the file. An interruption is reported as
    /// [`Cancelled`](crate::job_executor::Cancelled).
    fn write(&mut self) -> Result<WrittenFile> {
        let WriterInput {
            job, destination, ..
        } = self.input;
        let geometry = job.recovery.geometry();
        let (memory, rank) = (destination.memory, job.rank().unwrap_or(0));
        let encoders = encoders(memory, geometry, self.levels, rank)?;
        thread_pool(encoders)?.install(|| self.write_within_limit())
    }

    fn write_within_limit(&mut self) -> Result<WrittenFile> {
        let spinner = progress::spinner("compressing");
        let (levels, destination) = (self.levels, self.input.destination);
        let mut quality = self.quality;
        let max_bytes = match quality {
            FileQuality::MaxBytes(bytes) => bytes,
            _ => u64::MAX,
        };
        if levels > 1 && max_bytes < u64::MAX {
            quality = FileQuality::MaxBytes((LEVEL_0_SHARE * max_bytes as f64) as u64);
        }
        loop {
            let file = self.tiles.encode(&self.input, quality);
            let file = file.map_err(|error| self.writing_error(error, max_bytes))?;
            let clipped = messages::clipped_tiles(file.clipped_tiles(), file.index().tiles());
            spinner.suspend(|| self.findings.add(clipped));
            self.findings.check(self.strict)?;
            let output = OutputFile::create(destination.output, &LTM)?;
            let written = output.finish(|out| match levels {
                1 => Ok(file.write(out)?),
                _ => {
                    let layout = PyramidLayout {
                        max_bytes,
                        ..PyramidLayout::of_levels(levels)
                    };
                    let source = PyramidSource {
                        index: file.index(),
                        fetch: &|chunk| Ok(file.chunk(chunk)?.into_owned()),
                    };
                    write_levels(
                        destination.output,
                        source,
                        &|shard| self.tiles.level_shard(shard),
                        layout,
                        destination.cores,
                        out,
                    )?;
                    Ok(())
                }
            });
            let error = match written {
                Ok(bytes) => {
                    return Ok(WrittenFile {
                        bytes,
                        snr: file.snr(),
                    });
                }
                Err(error) => error,
            };
            match error.downcast::<FormatError>() {
                // Coarser levels took more than their usual share.
                Ok(FormatError::TooLarge { limit, smallest }) => {
                    let fitting = file.bytes() as f64 * limit as f64 / smallest as f64;
                    quality = FileQuality::MaxBytes((RETRY_SHARE * fitting) as u64);
                }
                Ok(error) => return Err(self.writing_error(error, max_bytes)),
                Err(error) => return Err(error),
            }
        }
    }

    /// The error with the name of the output; `max_bytes` is what the user asked for.
    fn writing_error(&self, error: FormatError, max_bytes: u64) -> Error {
        let output = self.input.destination.output.display();
        match error {
            FormatError::TooLarge { limit, smallest } => {
                // A file of several levels has a smaller limit for the finest one.
                let smallest =
                    (smallest as f64 * max_bytes as f64 / limit.max(1) as f64).ceil() as u64;
                let limit = max_bytes;
                Error::new(FormatError::TooLarge { limit, smallest }).context(format!(
                    "{output}: cannot be written; {}",
                    self.input.destination.too_large_remedy
                ))
            }
            other => cancelled_or(Error::new(other).context(output.to_string())),
        }
    }
}
