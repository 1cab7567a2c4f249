//! One recovery: from the photographs to the file.

use std::io::ErrorKind;
use std::sync::PoisonError;

use anyhow::{Context, Error, Result, bail};

use super::args::{RecoverArgs, WindowChoice};
use super::checkpoint::Checkpoint;
use super::encode::encode_file;
use super::memory_plan::MemoryPlan;
use super::report::RecoverReport;
use super::run_key::{PROGRAM, RunKey, recovery_fingerprint};
use super::shots;
use super::tiles::{self, TileRecovery};
use crate::capture::{
    CaptureFolder, DarkFrame, Measurements, NoiseModel, RowSet, group_count, group_ids,
};
use crate::cli::output_file::{OutputFile, OutputFormat};
use crate::cli::process::Interrupt;
use crate::cli::progress;
use crate::cli::shot_reader::{ShotReader, read_patterns};
use crate::format::{CaptureNote, EncodedFile, FormatError, Metadata};
use crate::recover::{
    BandwidthEstimate, HoldoutValidation, RecoverError, Recovery, Settings, WindowEstimate,
};
use crate::transport::{Basis, Decibels};

/// SNR on held-out patterns below which the photographs are probably at fault.
const MIN_PLAUSIBLE_SNR: Decibels = Decibels(13.0);

/// Unit of light transport in the file's metadata.
const UNITS: &str =
    "camera value where camera.black is 0 and camera.white is 1, per light element at full code";

/// A recovery with its arguments and inputs.
pub struct RecoverJob<'a> {
    pub args: &'a RecoverArgs,
    pub folder: &'a CaptureFolder,
    /// Indices of the shots to recover from.
    pub shots: &'a [usize],
    pub plan: &'a MemoryPlan,
    pub interrupt: &'a Interrupt,
}

/// The window, and how it was found.
struct ChosenWindow {
    settings: Settings,
    /// Estimated share of light from outside the window.
    tail_fraction: Option<f64>,
}

impl RecoverJob<'_> {
    /// Recovers all tiles and writes the file. Leaves time and memory of the report to the caller.
    pub fn run(&self) -> Result<RecoverReport> {
        let dark = self.folder.read_dark()?;
        self.folder.open_flood(&dark)?; // `evaluate` needs it: fail early if it is missing
        let gray_code_rows = self
            .plan
            .gray_code_rows(self.folder.manifest().graycode.len());
        let mut measurements = read_patterns(self.folder, &dark, self.shots, &gray_code_rows)?;
        let reader = ShotReader::open(self.folder, &dark, self.shots)?;
        let key = RunKey::new(
            self.args,
            self.folder,
            self.shots,
            self.plan,
            self.interrupt,
        )?;
        // Before the long work, so that a checkpoint that does not match fails early.
        let mut checkpoint = Checkpoint::open(&self.args.output, &key, self.args.resume)?;
        let saturated = self.load_sample(&mut measurements, reader, &checkpoint)?;
        let window = self.choose_window(&measurements, &checkpoint)?;
        let recovery = self.prepare(&measurements, window.settings, &checkpoint)?;
        let rank = recovery.basis().map(Basis::rank);
        let encoders = self
            .plan
            .tiles_encoded_at_once(window.settings.window, rank.unwrap_or(0))?;
        checkpoint.set_fingerprint(recovery_fingerprint(&recovery))?;
        let tiles = TileRecovery::new(self.interrupt, &recovery, checkpoint);
        let noise = measurements.noise;
        let strips = self.plan.strips(recovery.halo());
        let overexposed =
            self.recover_strips(measurements, &dark, &tiles, &strips, saturated > 0)?;
        drop(dark);
        let patterns = self.count_patterns();
        let metadata = self.metadata(window.settings, patterns);
        let file = thread_pool(encoders)?.install(|| self.encode(&tiles, &recovery, metadata))?;
        let output = OutputFile::create(&self.args.output, OutputFormat::Ltm)?;
        let file_bytes = output.finish(|out| Ok(file.write(out)?))?;
        let checkpoint = tiles.checkpoint.into_inner();
        checkpoint.unwrap_or_else(PoisonError::into_inner).delete();
        Ok(RecoverReport {
            seconds: 0.0,
            peak_rss_bytes: None,
            method: window.settings.method,
            basis: window.settings.method.basis(),
            window: window.settings.window.side(),
            leak: window.tail_fraction,
            rank,
            patterns,
            photographs: self.shots.len(),
            expected_snr_db: recovery
                .holdout_validation()
                .and_then(HoldoutValidation::snr),
            file_snr_db: file.snr(),
            common_mode: recovery.common_mode(),
            noise,
            strips: strips.len(),
            saturated_samples: saturated,
            overexposed_pixels: overexposed,
            file_bytes,
        })
    }

    /// Loads the rows to prepare the recovery from, and estimates the noise. Returns the number of saturated samples in
    /// all photographs.
    fn load_sample(
        &self,
        measurements: &mut Measurements,
        mut reader: ShotReader,
        checkpoint: &Checkpoint,
    ) -> Result<usize> {
        let bar = progress::bar("reading", self.shots.len());
        let loaded = reader.load_rows(measurements, &self.plan.sample_rows(), || {
            bar.inc(1);
            !self.interrupt.is_requested()
        })?;
        bar.finish_and_clear();
        if !loaded {
            return Err(tiles::interrupted(checkpoint));
        }
        let saturated = reader.finish()?;
        measurements.noise = NoiseModel::with_gain_from(measurements);
        shots::warn_of_saturation(saturated, measurements);
        Ok(saturated)
    }

    /// The window given, or the estimated one.
    fn choose_window(
        &self,
        measurements: &Measurements,
        checkpoint: &Checkpoint,
    ) -> Result<ChosenWindow> {
        let (window, tail_fraction) = match self.args.window {
            WindowChoice::Fixed(window) => (window, None),
            WindowChoice::Auto => {
                let estimate =
                    WindowEstimate::from_measurements(measurements, &self.interrupt.cores());
                let WindowEstimate { window, bandwidth } =
                    estimate.map_err(|error| self.recover_error(error, checkpoint))?;
                let side = window.side();
                match bandwidth {
                    BandwidthEstimate::Bounded { tail_fraction } => (window, Some(tail_fraction)),
                    BandwidthEstimate::Unbounded => {
                        eprintln!(
                            "warning: the band is at least as wide as the largest window tried, \
                             {side}x{side} light elements; a larger one can be given by --window"
                        );
                        (window, None)
                    }
                    BandwidthEstimate::Undetermined => {
                        eprintln!(
                            "warning: the photographs do not show how wide the band is; a window of \
                             {side}x{side} light elements is used, another can be given by --window"
                        );
                        (window, None)
                    }
                }
            }
        };
        let method = self.args.method();
        let settings = Settings { method, window };
        Ok(ChosenWindow {
            settings,
            tail_fraction,
        })
    }

    /// Learns or chooses what the method needs. Refuses photographs without a signal.
    fn prepare(
        &self,
        measurements: &Measurements,
        settings: Settings,
        checkpoint: &Checkpoint,
    ) -> Result<Recovery> {
        let spinner = progress::spinner("learning");
        let recovery = Recovery::prepare(measurements, settings, &self.interrupt.cores());
        spinner.finish_and_clear();
        let recovery = recovery.map_err(|error| self.recover_error(error, checkpoint))?;
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

    /// Recovers all tiles, strip by strip. Returns the number of overexposed pixels.
    fn recover_strips(
        &self,
        mut measurements: Measurements,
        dark: &DarkFrame,
        tiles: &TileRecovery,
        strips: &[(std::ops::Range<u32>, RowSet)],
        has_saturation: bool,
    ) -> Result<usize> {
        let mut reader = None;
        if !self.plan.fits_photographs() {
            reader = Some(ShotReader::open(self.folder, dark, self.shots)?);
            measurements.clear_rows();
        }
        let may_continue = || !self.interrupt.is_requested();
        let mut overexposed = 0;
        for (tile_rows, rows) in strips {
            if let Some(reader) = &mut reader
                && !reader.load_rows(&mut measurements, rows, may_continue)?
            {
                return Err(tiles.interrupted());
            }
            overexposed += tiles.recover_rows(&measurements, tile_rows.clone(), has_saturation)?;
        }
        tiles.finish();
        if overexposed > 0 {
            eprintln!(
                "warning: {overexposed} pixels are saturated in nearly all photographs and will be white \
                 under any light; photograph with less exposure"
            );
        }
        Ok(overexposed)
    }

    /// Encodes the recovered tiles.
    fn encode(
        &self,
        tiles: &TileRecovery,
        recovery: &Recovery,
        metadata: Metadata,
    ) -> Result<EncodedFile> {
        let spinner = progress::spinner("compressing");
        let (quality, checkpoint) = (&self.args.quality, &tiles.checkpoint);
        let file = encode_file(quality, checkpoint, recovery, metadata, self.interrupt);
        spinner.finish_and_clear();
        file.map_err(|error| {
            let output = self.args.output.display();
            match error {
                FormatError::Source(e) if e.kind() == ErrorKind::Interrupted => tiles.interrupted(),
                FormatError::TooLarge { .. } => Error::new(error).context(format!(
                    "{output}: cannot be written; the recovered tiles are kept: give the same command \
                     with --resume and a larger --max-bytes, or without --max-bytes"
                )),
                other => Error::new(other).context(output.to_string()),
            }
        })
    }

    fn metadata(&self, settings: Settings, patterns: usize) -> Metadata {
        let manifest = self.folder.manifest();
        Metadata {
            title: manifest.title.clone(),
            creator: manifest.creator.clone(),
            rights: manifest.rights.clone(),
            capture: CaptureNote {
                patterns,
                photographs: self.shots.len(),
            },
            writer: PROGRAM.to_owned(),
            method: settings.method.name().to_owned(),
            units: UNITS.to_owned(),
            shots_used: self.shots.to_vec(),
        }
    }

    /// Number of different patterns among the shots.
    fn count_patterns(&self) -> usize {
        let shots = &self.folder.manifest().shots;
        let patterns = self.shots.iter().map(|&i| &shots[i].pattern);
        group_count(&group_ids(patterns))
    }

    /// Names the capture, or the shots, that an error of the recovery is about.
    fn recover_error(&self, error: RecoverError, checkpoint: &Checkpoint) -> Error {
        match error {
            RecoverError::Cancelled(_) => tiles::interrupted(checkpoint),
            RecoverError::MismatchedPatterns { pattern_indices } => {
                let shots = pattern_indices.iter().map(|&l| self.shots[l]);
                shots::mismatched_shots(self.folder, shots)
            }
            other => Error::new(other).context(self.args.capture.display().to_string()),
        }
    }
}

/// A pool of `threads` threads.
pub fn thread_pool(threads: usize) -> Result<rayon::ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.context("threads cannot be started")
}
