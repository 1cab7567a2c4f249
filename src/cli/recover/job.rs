//! One recovery: from the photographs to the file.

use std::io::ErrorKind;
use std::sync::Mutex;
use std::time::Instant;

use anyhow::{Context, Error, Result, bail};
use rayon::prelude::*;

use super::args::RecoverArgs;
use super::checkpoint::{Checkpoint, compress_tile, lock};
use super::checkpoint_key::{CheckpointKey, recovery_fingerprint};
use super::messages::{self, StrictError, UnusableError, Warning};
use super::report::{RecoverReport, photograph_reports};
use crate::capture::{CaptureFolder, DarkFrame, Measurements};
use crate::cli::measurement_reader::{
    MeasurementReader, ReadSample, read_patterns, read_sample_of,
};
use crate::cli::output_file::{LTM, OutputFile};
use crate::cli::process_resources::{InterruptibleCores, peak_rss_bytes};
use crate::cli::progress;
use crate::export::{self, MIN_PLAUSIBLE_SNR, MemoryPlan, PreparedExport, Provenance};
use crate::format::{EncodedFile, FormatError, Metadata};
use crate::job_executor::{Cancelled, Executor};
use crate::recover::{
    MIN_PATTERNS, PhotographFault, PreparedRecovery, RecoverError, TailEstimate,
    WindowSizeEstimate, diagnose,
};
use crate::transport::{Basis, Decibels};

/// SNR on held-out patterns below which hardly anything in a file would be right.
const MIN_USABLE_SNR: Decibels = Decibels(2.0);

/// The warnings printed so far.
#[derive(Default)]
struct Warnings {
    given: Vec<Warning>,
}

impl Warnings {
    fn add(&mut self, warnings: impl IntoIterator<Item = Warning>) {
        for warning in warnings {
            eprintln!("warning: {}", warning.message);
            self.given.push(warning);
        }
    }

    /// Fails after a warning if `strict` is set.
    fn check(&self, strict: bool) -> Result<()> {
        match strict && !self.given.is_empty() {
            true => Err(StrictError.into()),
            false => Ok(()),
        }
    }
}

pub struct RecoverJob<'a> {
    pub start: Instant,
    pub args: &'a RecoverArgs,
    pub folder: &'a CaptureFolder,
    /// Indices of the shots to recover from.
    pub shots: &'a [usize],
    pub plan: &'a MemoryPlan,
    pub cores: &'a InterruptibleCores,
}

impl RecoverJob<'_> {
    /// Recovers all tiles and writes the file.
    pub fn run(&self) -> Result<RecoverReport> {
        let dark = self.folder.read_dark()?;
        let flood = self.folder.open_flood(&dark)?;
        let gray_code_shots = self.folder.manifest().graycode.len();
        let gray_code_rows = self.plan.gray_code_rows(gray_code_shots);
        let mut measurements = read_patterns(self.folder, &dark, self.shots, &gray_code_rows)?;
        let reader = MeasurementReader::open(self.folder, &dark, self.shots)?;
        let key = CheckpointKey::new(self.args, self.folder, self.shots, self.plan, self.cores)?;
        // Before the long work, so that a checkpoint that does not match fails early.
        let checkpoint = Checkpoint::open(&self.args.output, &key, self.args.resume)?;
        let checkpoint = Mutex::new(checkpoint);
        let rows = self.plan.sample_rows();
        let read = reader.read_sample(&mut measurements, &rows, self.cores);
        let read = read.and_then(|read| {
            measurements.flood = flood
                .map(|flood| read_sample_of(flood, &rows))
                .transpose()?;
            Ok(read)
        });
        let report = read.and_then(|read| self.recover(measurements, dark, read, &checkpoint));
        match &report {
            Ok(_) => lock(&checkpoint).delete_on_drop = true,
            Err(error) if error.is::<Cancelled>() => return Err(lock(&checkpoint).interrupted()),
            Err(_) => {}
        }
        report
    }

    /// Recovers into the checkpoint and writes the file. An interruption is reported as [`Cancelled`].
    fn recover(
        &self,
        measurements: Measurements,
        dark: DarkFrame,
        read: ReadSample,
        checkpoint: &Mutex<Checkpoint>,
    ) -> Result<RecoverReport> {
        let saturated = read.codes.saturated;
        let mut warnings = Warnings::default();
        warnings.add(messages::unknown_fields(self.folder));
        warnings.add(messages::codes(&read.codes, self.folder));
        warnings.add(messages::saturation(saturated, &measurements));
        let prepared = self.prepare(&measurements)?;
        let recovery = &prepared.recovery;
        warnings.add(messages::preparation(&prepared));
        let snr = prepared.expected_snr();
        let cause = match snr {
            Some(snr) if snr < MIN_PLAUSIBLE_SNR => {
                self.capture_fault(&measurements, recovery.faults())?
            }
            _ => None,
        };
        warnings.add(messages::photographs(self.folder, self.shots, recovery));
        let unusable = snr.filter(|snr| *snr < MIN_USABLE_SNR && !self.args.force);
        match (cause, unusable) {
            (Some(cause), Some(_)) if !self.args.strict => {
                bail!("{cause}; --force writes the file nevertheless")
            }
            (Some(cause), _) => warnings.add([messages::capture_warning(cause)]),
            (None, _) => {}
        }
        warnings.check(self.args.strict)?;
        if let Some(snr) = unusable {
            bail!(UnusableError(snr));
        }
        let (method, window) = (self.args.method(), recovery.geometry().window);
        let rank = recovery.basis().map(Basis::rank);
        let encoders = self.plan.tiles_encoded_at_once(window, rank.unwrap_or(0));
        let encoders = encoders.map_err(messages::too_little_memory)?;
        lock(checkpoint).set_fingerprint(recovery_fingerprint(recovery))?;
        let noise = measurements.noise;
        let (overexposed, hot) =
            self.recover_tiles(measurements, dark, recovery, checkpoint, &read)?;
        messages::note_hot_pixels(hot);
        warnings.add(messages::overexposure(overexposed));
        warnings.check(self.args.strict)?;
        let provenance = Provenance::new(self.folder.manifest(), self.shots);
        let metadata = export::metadata(&provenance, method);
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
            photographs: self.shots.len(),
            expected_snr_db: prepared.expected_snr(),
            file_snr_db: file.snr(),
            common_mode: recovery.common_mode(),
            noise,
            strips: self.plan.strips(recovery.halo()).len(),
            saturated_samples: saturated,
            overexposed_pixels: overexposed,
            hot_pixels: hot,
            file_bytes,
            photograph_reports: photograph_reports(self.folder, self.shots, recovery),
            warnings: warnings.given,
        })
    }

    /// Chooses the window, and learns or chooses what the method needs.
    fn prepare(&self, measurements: &Measurements) -> Result<PreparedExport> {
        let spinner = progress::spinner("learning");
        let (method, window) = (self.args.method(), self.args.window);
        let preparation = export::prepare(measurements, method, window, self.cores);
        let prepared = pollster::block_on(preparation);
        drop(spinner);
        prepared.or_else(|error| {
            use RecoverError::{MismatchedPatterns, UncorrelatedPatterns};
            let may_have_cause = matches!(error, MismatchedPatterns { .. } | UncorrelatedPatterns);
            let cause = match may_have_cause {
                true => self.capture_fault(measurements, &[])?,
                false => None,
            };
            Err(cause.map_or_else(|| self.recover_error(error), Error::msg))
        })
    }

    /// The fault of the capture as a whole, if one is found without the photographs that are `left_out`.
    fn capture_fault(
        &self,
        measurements: &Measurements,
        left_out: &[(usize, PhotographFault)],
    ) -> Result<Option<String>> {
        let _spinner = progress::spinner("looking for a cause");
        let window = self.args.window.unwrap_or(WindowSizeEstimate::MAX_WINDOW);
        let left_out: Vec<usize> = left_out.iter().map(|(l, _)| *l).collect();
        let fault = diagnose(measurements, window, self.shots, &left_out, self.cores)?;
        Ok(
            fault
                .map(|fault| messages::capture_fault(self.folder, self.shots, measurements, fault)),
        )
    }

    /// Recovers the tiles that the checkpoint lacks, strip by strip. Returns the numbers of overexposed and of hot
    /// pixels.
    fn recover_tiles(
        &self,
        mut measurements: Measurements,
        dark: DarkFrame,
        recovery: &PreparedRecovery,
        checkpoint: &Mutex<Checkpoint>,
        read: &ReadSample,
    ) -> Result<(usize, usize)> {
        let geometry = recovery.geometry();
        let grid = geometry.tile_grid();
        let bar = progress::bar("recovering", grid.area());
        bar.set_position(lock(checkpoint).count() as u64);
        bar.reset_eta(); // these tiles took no time
        let mut reader = None;
        if !self.plan.fits_photographs() {
            reader = Some(MeasurementReader::open(self.folder, &dark, self.shots)?);
            measurements.clear_rows();
        }
        let has_saturation = read.codes.saturated > 0;
        let mut overexposed = 0;
        let mut hot = if reader.is_some() { 0 } else { read.hot_pixels };
        for (tile_rows, rows) in self.plan.strips(recovery.halo()) {
            if let Some(reader) = &mut reader {
                let check = || Ok(self.cores.check_cancelled()?);
                hot += reader.load_rows(&mut measurements, &rows, check)?;
            }
            let recover_tile = |i: u32| -> Result<usize> {
                let (i, rect) = (i as usize, geometry.tile(i as usize));
                if !lock(checkpoint).has(i) {
                    self.cores.check_cancelled()?;
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
        Ok((overexposed, hot))
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
        let file = export::encode_file(recovery, &record, metadata, quality, self.cores);
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

    /// Names the capture, or the shots, that an error of the recovery is about.
    fn recover_error(&self, error: RecoverError) -> Error {
        match error {
            RecoverError::Cancelled(cancelled) => cancelled.into(),
            RecoverError::MismatchedPatterns { pattern_indices } => {
                let shots = pattern_indices.iter().map(|&l| self.shots[l]);
                messages::mismatched_shots(self.folder, shots)
            }
            RecoverError::IndistinctPhotographs => {
                Error::new(error).context(self.folder.manifest_path().display().to_string())
            }
            other => Error::new(other).context(self.args.capture.display().to_string()),
        }
    }
}

pub fn thread_pool(threads: usize) -> Result<rayon::ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.context("threads cannot be started")
}
