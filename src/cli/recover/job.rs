//! One recovery: from the photographs to the file.

use std::sync::Mutex;
use std::time::Instant;

use anyhow::{Context, Error, Result, bail};
use rayon::prelude::*;

use super::args::RecoverArgs;
use super::checkpoint::{Checkpoint, lock};
use super::checkpoint_key::{CheckpointKey, PROGRAM, recovery_fingerprint};
use super::encode::encode_file;
use super::memory_plan::MemoryPlan;
use super::report::RecoverReport;
use super::{shot_selection, tile_record};
use crate::capture::{CaptureFolder, DarkFrame, Measurements, group_count, group_ids};
use crate::cli::measurement_reader::{MeasurementReader, read_patterns};
use crate::cli::output_file::{LTM, OutputFile};
use crate::cli::process_resources::{InterruptibleCores, peak_rss_bytes};
use crate::cli::progress;
use crate::format::{CaptureMetadata, Metadata};
use crate::job_executor::{Cancelled, Executor};
use crate::recover::{
    HoldoutValidation, MIN_PATTERNS, PreparedRecovery, RecoverError, RecoverySettings,
    TailEstimate, WindowSizeEstimate,
};
use crate::transport::{Basis, Decibels, Window};

/// SNR on held-out patterns below which the photographs are probably at fault.
const MIN_PLAUSIBLE_SNR: Decibels = Decibels(13.0);

/// Unit of light transport in the file's metadata.
const UNITS: &str =
    "camera value where camera.black is 0 and camera.white is 1, per light element at full code";

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
        self.folder.open_flood(&dark)?; // `evaluate` needs it: fail early if it is missing
        let gray_code_shots = self.folder.manifest().graycode.len();
        let gray_code_rows = self.plan.gray_code_rows(gray_code_shots);
        let mut measurements = read_patterns(self.folder, &dark, self.shots, &gray_code_rows)?;
        let reader = MeasurementReader::open(self.folder, &dark, self.shots)?;
        let key = CheckpointKey::new(self.args, self.folder, self.shots, self.plan, self.cores)?;
        // Before the long work, so that a checkpoint that does not match fails early.
        let checkpoint = Checkpoint::open(&self.args.output, &key, self.args.resume)?;
        let checkpoint = Mutex::new(checkpoint);
        let rows = self.plan.sample_rows();
        let saturated = reader.read_sample(&mut measurements, &rows, self.cores);
        let report = saturated.and_then(|n| self.recover(measurements, dark, n, &checkpoint));
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
        saturated: usize,
        checkpoint: &Mutex<Checkpoint>,
    ) -> Result<RecoverReport> {
        shot_selection::warn_of_saturation(saturated, &measurements);
        let (window, tail_fraction) = self.choose_window(&measurements)?;
        let method = self.args.method();
        let recovery = self.prepare(&measurements, RecoverySettings { method, window })?;
        let rank = recovery.basis().map(Basis::rank);
        let encoders = self.plan.tiles_encoded_at_once(window, rank.unwrap_or(0))?;
        lock(checkpoint).set_fingerprint(recovery_fingerprint(&recovery))?;
        let noise = measurements.noise;
        let overexposed =
            self.recover_tiles(measurements, dark, &recovery, checkpoint, saturated > 0)?;
        let listed = &self.folder.manifest().shots;
        let patterns = self.shots.iter().map(|&i| &listed[i].pattern);
        let patterns = group_count(&group_ids(patterns));
        let metadata = self.metadata(patterns);
        let encode = || encode_file(self.args, checkpoint, &recovery, metadata, self.cores);
        let file = thread_pool(encoders)?.install(encode)?;
        let output = OutputFile::create(&self.args.output, &LTM)?;
        let file_bytes = output.finish(|out| Ok(file.write(out)?))?;
        let validation = recovery.holdout_validation();
        Ok(RecoverReport {
            seconds: self.start.elapsed().as_secs_f64(),
            peak_rss_bytes: peak_rss_bytes(),
            method,
            basis: method.basis(),
            window: window.side(),
            leak: tail_fraction,
            rank,
            patterns,
            photographs: self.shots.len(),
            expected_snr_db: validation.and_then(HoldoutValidation::snr),
            file_snr_db: file.snr(),
            common_mode: recovery.common_mode(),
            noise,
            strips: self.plan.strips(recovery.halo()).len(),
            saturated_samples: saturated,
            overexposed_pixels: overexposed,
            file_bytes,
        })
    }

    /// The window given or estimated; if estimated, with the share of light from outside the window.
    fn choose_window(&self, measurements: &Measurements) -> Result<(Window, Option<f64>)> {
        if let Some(window) = self.args.window {
            return Ok((window, None));
        }
        let estimate = WindowSizeEstimate::from_measurements(measurements, self.cores);
        let WindowSizeEstimate { window, band } = estimate.map_err(|e| self.recover_error(e))?;
        let side = window.side();
        match band {
            TailEstimate::Bounded { tail_fraction } => {
                return Ok((window, Some(tail_fraction)));
            }
            TailEstimate::Unbounded => eprintln!(
                "warning: the band is at least as wide as the largest window tried, {side}x{side} light \
                 elements; a larger one can be given by --window"
            ),
            TailEstimate::Undetermined => eprintln!(
                "warning: the photographs do not show how wide the band is; a window of {side}x{side} \
                 light elements is used, another can be given by --window"
            ),
        }
        Ok((window, None))
    }

    /// Learns or chooses what the method needs. Refuses photographs without a signal.
    fn prepare(
        &self,
        measurements: &Measurements,
        settings: RecoverySettings,
    ) -> Result<PreparedRecovery> {
        let spinner = progress::spinner("learning");
        let recovery = PreparedRecovery::prepare(measurements, settings, self.cores);
        drop(spinner);
        let recovery = recovery.map_err(|error| self.recover_error(error))?;
        let Some(validation) = recovery.holdout_validation() else {
            return Ok(recovery);
        };
        if !validation.has_signal() {
            bail!(
                "{}: photographs do not differ from pattern to pattern by more than their noise; check \
                 that each of \"shots\" names its own photo, and that the light was on",
                self.folder.manifest_path().display()
            );
        }
        if let Some(snr) = validation.snr().filter(|snr| *snr < MIN_PLAUSIBLE_SNR) {
            eprintln!(
                "warning: the SNR on held-out patterns is only {snr}; check that the photographs are \
                 linear, that the light was steady and that the correspondence is right. With few \
                 patterns, or another method than learned, it may not get better"
            );
        }
        Ok(recovery)
    }

    /// Recovers the tiles that the checkpoint lacks, strip by strip. Returns the number of overexposed pixels, which is
    /// zero without `has_saturation`.
    fn recover_tiles(
        &self,
        mut measurements: Measurements,
        dark: DarkFrame,
        recovery: &PreparedRecovery,
        checkpoint: &Mutex<Checkpoint>,
        has_saturation: bool,
    ) -> Result<usize> {
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
        let mut overexposed = 0;
        for (tile_rows, rows) in self.plan.strips(recovery.halo()) {
            if let Some(reader) = &mut reader {
                let check = || Ok(self.cores.check_cancelled()?);
                reader.load_rows(&mut measurements, &rows, check)?;
            }
            let recover_tile = |i: u32| -> Result<usize> {
                let (i, rect) = (i as usize, geometry.tile(i as usize));
                if !lock(checkpoint).has(i) {
                    self.cores.check_cancelled()?;
                    let tile = recovery.tile(&measurements, rect);
                    let record =
                        tile_record::encode(&tile).context("a tile cannot be compressed")?;
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
        if overexposed > 0 {
            eprintln!(
                "warning: {overexposed} pixels are saturated in nearly all photographs and will be white \
                 under any light; photograph with less exposure"
            );
        }
        Ok(overexposed)
    }

    fn metadata(&self, patterns: usize) -> Metadata {
        let manifest = self.folder.manifest();
        Metadata {
            title: manifest.title.clone(),
            creator: manifest.creator.clone(),
            rights: manifest.rights.clone(),
            capture: CaptureMetadata {
                patterns,
                photographs: self.shots.len(),
            },
            writer: PROGRAM.to_owned(),
            method: self.args.method().name().to_owned(),
            units: UNITS.to_owned(),
            shots_used: self.shots.to_vec(),
        }
    }

    /// Names the capture, or the shots, that an error of the recovery is about.
    fn recover_error(&self, error: RecoverError) -> Error {
        match error {
            RecoverError::Cancelled(cancelled) => cancelled.into(),
            RecoverError::MismatchedPatterns { pattern_indices } => {
                let shots = pattern_indices.iter().map(|&l| self.shots[l]);
                shot_selection::mismatched_shots(self.folder, shots)
            }
            other => Error::new(other).context(self.args.capture.display().to_string()),
        }
    }
}

pub fn thread_pool(threads: usize) -> Result<rayon::ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.context("threads cannot be started")
}
