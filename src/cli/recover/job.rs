//! One recovery: from the photographs to the file.

use std::cell::OnceCell;
use std::fs::File;
use std::io::ErrorKind;
use std::sync::Mutex;
use std::time::Instant;

use anyhow::{Context, Error, Result};
use rayon::prelude::*;

use super::args::RecoverArgs;
use super::capture_sample::{CaptureSample, SampleSource};
use super::checkpoint::{Checkpoint, compress_tile, lock};
use super::checkpoint_key::{CheckpointKey, recovery_fingerprint};
use super::messages;
use super::origin::{FileOrigin, OriginInput};
use super::preparation::{CapturePreparation, PreparationSettings, PreparedCapture};
use super::report::{RecoverReport, photograph_reports};
use crate::capture::{CameraPixelSet, CaptureFolder, DefectivePixels};
use crate::cli::levels_output::{temporary_spool, write_levels};
use crate::cli::measurement_reader::MeasurementReader;
use crate::cli::output_file::{LTM, OutputFile};
use crate::cli::process_resources::{peak_rss_bytes, thread_pool};
use crate::cli::progress;
use crate::export::{self, FileQuality, Provenance};
use crate::format::{EncodedFile, FormatError, Metadata, SpooledChunks};
use crate::job_executor::{Cancelled, Executor};
use crate::pyramid::PyramidLayout;
use crate::recover::{MIN_PATTERNS, PreparedRecovery, TailEstimate};
use crate::transport::{Basis, Decibels, Window};

/// Share of the bytes that the finest of several levels usually takes.
const LEVEL_0_SHARE: f64 = 0.75;
/// Share of the bytes that would fit in the next attempt.
const RETRY_SHARE: f64 = 0.98;

pub struct RecoverJob<'a> {
    pub start: Instant,
    pub args: &'a RecoverArgs,
    pub folder: &'a CaptureFolder,
    /// Indices of the shots to recover from.
    pub shots: &'a [usize],
    /// Number of levels of the file.
    pub levels: u32,
    pub source: SampleSource<'a>,
}

/// Number of components of the tiles that are encoded, if those of the recovery have `rank`.
pub fn encoded_components(levels: u32, window: Window, rank: usize) -> usize {
    match levels {
        1 => rank,
        // The tiles of coarser levels have one for each element of the window.
        _ => window.area(),
    }
}

impl RecoverJob<'_> {
    /// Recovers all tiles and writes the file.
    pub fn run(&self) -> Result<RecoverReport> {
        let checkpoint = OnceCell::new();
        // Before the long work, so that a checkpoint that does not match fails early.
        let open_checkpoint = || {
            let SampleSource { plan, cores } = self.source;
            let key = CheckpointKey::new(self.args, self.folder, self.shots, plan, cores)?;
            let opened = Checkpoint::open(&self.args.output, &key, self.args.resume)?;
            checkpoint.get_or_init(|| Mutex::new(opened));
            Ok(())
        };
        let sample = (self.source).read(self.folder.clone(), self.shots.to_vec(), open_checkpoint);
        let Some(checkpoint) = checkpoint.get() else {
            return Err(sample.err().unwrap_or_else(|| Cancelled.into()));
        };
        let report = sample.and_then(|sample| self.recover(sample, checkpoint));
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
        sample: CaptureSample,
        checkpoint: &Mutex<Checkpoint>,
    ) -> Result<RecoverReport> {
        let preparation = CapturePreparation {
            settings: PreparationSettings::of(self.args),
            folder: self.folder,
            source: self.source,
        };
        let PreparedCapture {
            sample,
            prepared,
            mut findings,
        } = preparation.run(sample, self.args)?;
        let recovery = &prepared.recovery;
        let saturated = sample.read.codes.saturated;
        let (method, window) = (self.args.method(), recovery.geometry().window);
        let rank = recovery.basis().map(Basis::rank);
        let levels = self.levels;
        let components = encoded_components(levels, window, rank.unwrap_or(0));
        let encoders = self.source.plan.tiles_encoded_at_once(window, components);
        let encoders = encoders.map_err(messages::too_little_memory)?;
        lock(checkpoint).set_fingerprint(recovery_fingerprint(recovery))?;
        let CaptureSample { folder, shots, .. } = &sample;
        let (folder, shots) = (folder.clone(), shots.clone());
        let noise = sample.measurements.noise;
        // Before the long work, so that a file that cannot be read fails early.
        let origin = FileOrigin::new(
            &OriginInput {
                folder: self.folder,
                shots: self.shots,
                window: window.side(),
                noise,
                expected_snr_db: prepared.expected_snr(),
            },
            self.source.cores,
        )?;
        let (overexposed, defects) = self.recover_tiles(sample, recovery, checkpoint)?;
        findings.add(messages::defective_pixels(defects));
        findings.add(messages::overexposure(overexposed));
        findings.check(self.args.strict)?;
        let provenance = Provenance::new(folder.manifest(), self.shots);
        let mut metadata = export::metadata(&provenance, method);
        metadata.origin = Some(serde_json::to_value(origin)?);
        let patterns = metadata.capture.patterns;
        let write = || self.write(recovery, checkpoint, metadata, levels);
        let (file_bytes, file_snr_db) = thread_pool(encoders)?.install(write)?;
        Ok(RecoverReport {
            seconds: self.start.elapsed().as_secs_f64(),
            peak_rss_bytes: peak_rss_bytes(),
            method,
            basis: method.basis(),
            window: window.side(),
            leak: match prepared.band {
                Some(TailEstimate::Bounded { tail_fraction }) => Some(tail_fraction),
                _ => None,
            },
            rank,
            patterns,
            photographs: shots.len(),
            expected_snr_db: prepared.expected_snr(),
            file_snr_db,
            common_mode: recovery.common_mode(),
            noise,
            strips: self.source.plan.strips(recovery.halo()).len(),
            saturated_samples: saturated,
            overexposed_pixels: overexposed,
            hot_pixels: defects.hot,
            dead_pixels: defects.dead,
            estimated_fields: findings.estimated_fields.clone(),
            file_bytes,
            levels,
            photograph_reports: photograph_reports(
                &folder,
                &shots,
                recovery,
                &findings.moved_shots,
            ),
            warnings: findings.warnings().cloned().collect(),
        })
    }

    /// Recovers the tiles that the checkpoint lacks, strip by strip. Returns the numbers of overexposed and of defective
    /// pixels.
    fn recover_tiles(
        &self,
        sample: CaptureSample,
        recovery: &PreparedRecovery,
        checkpoint: &Mutex<Checkpoint>,
    ) -> Result<(usize, DefectivePixels)> {
        let CaptureSample {
            folder,
            shots,
            dark,
            mut measurements,
            read,
        } = sample;
        let SampleSource { plan, cores } = self.source;
        let geometry = recovery.geometry();
        let grid = geometry.tile_grid();
        let bar = progress::bar("recovering", grid.area());
        bar.set_position(lock(checkpoint).count() as u64);
        bar.reset_eta(); // these tiles took no time
        let mut reader = None;
        if !plan.fits_photographs() {
            reader = Some(MeasurementReader::open(&folder, &dark, &shots)?);
            measurements.unload();
        }
        let has_saturation = read.codes.saturated > 0;
        let mut overexposed = 0;
        let mut defects = match reader {
            Some(_) => DefectivePixels::default(),
            None => read.defects,
        };
        let mut next_row = 0;
        for (tile_rows, rows) in plan.strips(recovery.halo()) {
            if let Some(reader) = &mut reader {
                let check = || Ok(cores.check_cancelled()?);
                let pixels = CameraPixelSet::row_range(rows.clone(), geometry.camera.width);
                reader.load(&mut measurements, &pixels, check)?;
                // Rows that were loaded before are filled already.
                defects += reader.fill_defects(&mut measurements, next_row, &read.codes);
                next_row = rows.end;
            }
            let recover_tile = |i: u32| -> Result<usize> {
                let (i, rect) = (i as usize, geometry.tile(i as usize));
                if !lock(checkpoint).has(i) {
                    cores.check_cancelled()?;
                    let tile = recovery.tile(&measurements, rect);
                    let record = compress_tile(&export::encode_tile(&tile))
                        .context("a tile cannot be compressed")?;
                    lock(checkpoint).add(i, &record)?;
                    bar.inc(1);
                }
                Ok(match has_saturation {
                    true => measurements.count_overexposed_pixels(rect, MIN_PATTERNS),
                    false => 0,
                })
            };
            let tiles = tile_rows.start * grid.width..tile_rows.end * grid.width;
            let counts = tiles.into_par_iter().map(recover_tile);
            overexposed += counts.try_reduce(|| 0, |a, b| Ok(a + b))?;
        }
        drop(bar);
        Ok((overexposed, defects))
    }

    /// Encodes the tiles in `checkpoint` and writes the file. Returns its length, and its SNR relative to the tiles. An
    /// interruption is reported as [`Cancelled`].
    fn write(
        &self,
        recovery: &PreparedRecovery,
        checkpoint: &Mutex<Checkpoint>,
        metadata: Metadata,
        levels: u32,
    ) -> Result<(u64, Option<Decibels>)> {
        let _spinner = progress::spinner("compressing");
        let mut quality = self.args.quality();
        let max_bytes = match quality {
            FileQuality::MaxBytes(bytes) => bytes,
            _ => u64::MAX,
        };
        if levels > 1 && max_bytes < u64::MAX {
            quality = FileQuality::MaxBytes((LEVEL_0_SHARE * max_bytes as f64) as u64);
        }
        loop {
            let file = self.encode(recovery, checkpoint, metadata.clone(), quality);
            let file = file.map_err(|error| self.writing_error(error, max_bytes))?;
            let output = OutputFile::create(&self.args.output, &LTM)?;
            let written = output.finish(|out| match levels {
                1 => Ok(file.write(out)?),
                _ => {
                    let layout = PyramidLayout {
                        max_bytes,
                        ..PyramidLayout::of_levels(levels)
                    };
                    let fetch = |chunk| Ok(file.chunk(chunk)?.into_owned());
                    let (output, cores) = (&self.args.output, self.source.cores);
                    write_levels(output, file.index(), &fetch, layout, cores, out)?;
                    Ok(())
                }
            });
            let error = match written {
                Ok(bytes) => return Ok((bytes, file.snr())),
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

    /// Encodes the tiles in `checkpoint` as a file of one level, whose chunks are in a temporary file.
    fn encode(
        &self,
        recovery: &PreparedRecovery,
        checkpoint: &Mutex<Checkpoint>,
        metadata: Metadata,
        quality: FileQuality,
    ) -> Result<EncodedFile<SpooledChunks<File>>, FormatError> {
        let record = |i| lock(checkpoint).read(i);
        let new_store = || temporary_spool(&self.args.output).map(SpooledChunks::new);
        let cores = self.source.cores;
        export::encode_file(recovery, &record, metadata, quality, cores, new_store)
    }

    /// The error with the name of the output; `max_bytes` is what the user asked for.
    fn writing_error(&self, error: FormatError, max_bytes: u64) -> Error {
        let output = self.args.output.display();
        match error {
            FormatError::Source(e) if e.kind() == ErrorKind::Interrupted => Cancelled.into(),
            FormatError::TooLarge { limit, smallest } => {
                // A file of several levels has a smaller limit for the finest one.
                let smallest =
                    (smallest as f64 * max_bytes as f64 / limit.max(1) as f64).ceil() as u64;
                let limit = max_bytes;
                Error::new(FormatError::TooLarge { limit, smallest }).context(format!(
                    "{output}: cannot be written; the recovered tiles are kept: give the same command \
                     with --resume and a larger --max-bytes, or without --max-bytes"
                ))
            }
            other => Error::new(other).context(output.to_string()),
        }
    }
}
