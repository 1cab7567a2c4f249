//! One recovery: from the photographs to the file.

use std::cell::OnceCell;
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
use crate::capture::{CaptureFolder, DefectivePixels};
use crate::cli::measurement_reader::MeasurementReader;
use crate::cli::output_file::{LTM, OutputFile};
use crate::cli::process_resources::{peak_rss_bytes, thread_pool};
use crate::cli::progress;
use crate::export::{self, Provenance};
use crate::format::{EncodedFile, FormatError, Metadata};
use crate::job_executor::{Cancelled, Executor};
use crate::recover::{MIN_PATTERNS, PreparedRecovery, TailEstimate};
use crate::transport::Basis;

pub struct RecoverJob<'a> {
    pub start: Instant,
    pub args: &'a RecoverArgs,
    pub folder: &'a CaptureFolder,
    /// Indices of the shots to recover from.
    pub shots: &'a [usize],
    pub source: SampleSource<'a>,
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
        let encoders = self
            .source
            .plan
            .tiles_encoded_at_once(window, rank.unwrap_or(0));
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
        let encode = || self.encode(recovery, checkpoint, metadata);
        let file = thread_pool(encoders)?.install(encode)?;
        let output = OutputFile::create(&self.args.output, &LTM)?;
        let file_bytes = output.finish(|out| Ok(file.write(out)?))?;
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
            file_snr_db: file.snr(),
            common_mode: recovery.common_mode(),
            noise,
            strips: self.source.plan.strips(recovery.halo()).len(),
            saturated_samples: saturated,
            overexposed_pixels: overexposed,
            hot_pixels: defects.hot,
            dead_pixels: defects.dead,
            estimated_fields: findings.estimated_fields.clone(),
            file_bytes,
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
            measurements.clear_rows();
        }
        let has_saturation = read.codes.saturated > 0;
        let mut overexposed = 0;
        let mut defects = match reader {
            Some(_) => DefectivePixels::default(),
            None => read.defects,
        };
        for (tile_rows, rows) in plan.strips(recovery.halo()) {
            if let Some(reader) = &mut reader {
                let check = || Ok(cores.check_cancelled()?);
                reader.load_rows(&mut measurements, &rows, check)?;
                defects += reader.fill_defects(&mut measurements, &read.codes);
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

    /// Encodes the tiles in `checkpoint`. An interruption is reported as [`Cancelled`].
    fn encode(
        &self,
        recovery: &PreparedRecovery,
        checkpoint: &Mutex<Checkpoint>,
        metadata: Metadata,
    ) -> Result<EncodedFile> {
        let _spinner = progress::spinner("compressing");
        let record = |i| lock(checkpoint).read(i);
        let quality = self.args.quality();
        let file = export::encode_file(recovery, &record, metadata, quality, self.source.cores);
        file.map_err(|error| {
            let output = self.args.output.display();
            match error {
                FormatError::Source(e) if e.kind() == ErrorKind::Interrupted => Cancelled.into(),
                FormatError::TooLarge { .. } => Error::new(error).context(format!(
                    "{output}: cannot be written; the recovered tiles are kept: give the same command \
                     with --resume and a larger --max-bytes, or without --max-bytes"
                )),
                other => Error::new(other).context(output.to_string()),
            }
        })
    }
}
