//! Prepares a recovery, and finds what is wrong with the photographs or with what `capture.json` declares of them.

use anyhow::{Error, Result, bail};

use super::args::{RecoveryOptions, TrustedCalibration};
use super::calibration;
use super::capture_sample::{CaptureSample, PhotographSource};
use super::findings::Findings;
use super::messages::{self, FaultyPhotographsError, UnusableError};
use crate::capture::{CameraResponse, CaptureFolder, CodeStatistics, Manifest};
use crate::cli::finding::Finding;
use crate::cli::progress;
use crate::export::{self, ExportSettings, MIN_PLAUSIBLE_SNR, PreparedExport};
use crate::job_executor::Executor;
use crate::recover::{
    CaptureFault, Method, PreparedRecovery, RecoverError, WindowSizeEstimate, diagnose,
    find_response,
};
use crate::transport::{Decibels, Window};

/// SNR on held-out patterns below which hardly anything in a file would be right.
pub const MIN_USABLE_SNR: Decibels = Decibels(2.0);
/// Rise of the SNR on held-out patterns by which another response explains the photographs better.
const MIN_SNR_RISE: Decibels = Decibels(0.3);
/// Responses that are tried in turn.
const MAX_TRIALS: usize = 3;
/// Fewest photographs on one side of a move that are recovered alone.
const MIN_STILL_PHOTOGRAPHS: usize = 24;

/// Step of the shifts in camera pixels that is a move, and its square relative to the scatter on either side.
const MIN_STEP: f64 = 0.1;
const MIN_STEP_RATIO: f64 = 25.0;

/// A recovery that is ready to run, with the photographs that it is prepared from.
pub struct PreparedCapture {
    pub sample: CaptureSample,
    pub prepared: PreparedExport,
    pub findings: Findings,
}

/// How a recovery is prepared.
#[derive(Clone, Copy)]
pub struct PreparationSettings {
    pub method: Method,
    /// The method to use instead if the first predicts held-out patterns so badly that nothing could be told from it.
    pub fallback: Option<Method>,
    /// `None` to estimate it.
    pub window: Option<Window>,
    pub trust: TrustedCalibration,
    /// Whether shifts between photographs are estimated and corrected.
    pub is_registered: bool,
}

impl PreparationSettings {
    pub fn of(options: &RecoveryOptions) -> Self {
        Self {
            method: options.method(),
            fallback: None,
            window: options.window,
            trust: options.trust,
            is_registered: !options.no_register,
        }
    }
}

/// What a recovery is prepared by.
pub struct CapturePreparation<'a, S> {
    pub settings: PreparationSettings,
    /// As it is declared.
    pub folder: &'a CaptureFolder,
    pub source: S,
}

/// The photographs, and the recovery that is prepared from them.
pub struct Attempt {
    pub method: Method,
    pub sample: CaptureSample,
    pub prepared: Result<PreparedExport, RecoverError>,
    /// Why it may be bad.
    pub cause: Option<Finding>,
}

impl Attempt {
    fn snr(&self) -> Option<Decibels> {
        self.prepared.as_ref().ok()?.expected_snr()
    }

    /// Whether the photographs may not follow from their patterns.
    fn is_doubtful(&self) -> bool {
        use RecoverError::{IndistinctPhotographs, MismatchedPatterns, UncorrelatedPatterns};
        match &self.prepared {
            Ok(_) => self.snr().is_some_and(|snr| snr < MIN_PLAUSIBLE_SNR),
            Err(error) => matches!(
                error,
                MismatchedPatterns { .. } | UncorrelatedPatterns | IndistinctPhotographs
            ),
        }
    }

    /// The first photograph from which on shifts of the picture differ from those before: the camera moved by a fraction of
    /// a pixel.
    fn step_of_shifts(&self) -> Option<usize> {
        let corrections = self.prepared.as_ref().ok()?.recovery.corrections();
        let shifts: Vec<[f64; 2]> = corrections
            .iter()
            .map(|correction| correction.shift)
            .collect();
        first_after_step(&shifts)
    }

    /// Indices of the photographs that are left out.
    fn left_out(&self) -> Vec<usize> {
        let recovery = self.prepared.as_ref().map(|prepared| &prepared.recovery);
        let faults = recovery.map(PreparedRecovery::faults).unwrap_or_default();
        faults.iter().map(|(l, _)| *l).collect()
    }
}

impl<S: PhotographSource> CapturePreparation<'_, S> {
    /// Prepares the recovery, with warnings of all that is doubtful.
    ///
    /// # Errors
    /// If nothing can be recovered, if hardly anything would be right and `--force` is not given, and after a warning with
    /// `--strict`.
    pub fn run(&self, sample: CaptureSample, options: &RecoveryOptions) -> Result<PreparedCapture> {
        let mut findings = Findings::printed();
        let Attempt {
            sample,
            prepared,
            cause,
            ..
        } = self.examine(sample, &mut findings)?;
        let prepared = match (prepared, &cause) {
            (Ok(prepared), _) => prepared,
            (Err(_), Some(cause)) => bail!(FaultyPhotographsError(cause.message.clone())),
            (Err(error), None) => return Err(self.recover_error(error, &sample.shots)),
        };
        findings.add(messages::preparation(&prepared));
        let snr = prepared.expected_snr();
        let unusable = snr.filter(|snr| *snr < MIN_USABLE_SNR && !options.force);
        match (cause, unusable) {
            (Some(cause), Some(_)) if !options.strict => {
                let message = format!("{}; --force writes the file nevertheless", cause.message);
                bail!(FaultyPhotographsError(message))
            }
            (cause, _) => findings.add(cause),
        }
        findings.check(options.strict)?;
        match unusable {
            Some(snr) => bail!(UnusableError(snr)),
            None => Ok(PreparedCapture {
                sample,
                prepared,
                findings,
            }),
        }
    }

    /// Prepares the recovery as far as that is possible, and looks for all that is wrong with the photographs, or with what
    /// is declared of them.
    ///
    /// # Errors
    /// If photographs cannot be read, and if the executor is cancelled.
    pub fn examine(&self, sample: CaptureSample, findings: &mut Findings) -> Result<Attempt> {
        findings.add(messages::unknown_fields(self.folder));
        let sample = self.with_saturation(sample, findings)?;
        let (folder, shots, read) = (&sample.folder, &sample.shots, &sample.read);
        findings.add(messages::eight_bits(folder, shots, read));
        let saturation = messages::saturation(folder, shots, read, &sample.measurements);
        findings.add(saturation);
        let attempt = self.first_attempt(sample);
        let attempt = self.with_capture_fault(attempt, findings)?;
        let attempt = self.with_response(attempt, findings)?;
        let attempt = self.with_flood_shortfall(attempt, findings)?;
        let sample = &attempt.sample;
        let cores = self.source.cores();
        // Codes that are not linear have less contrast.
        if findings.are_responses_right() {
            let contrasts = self.source.finest_contrasts(sample);
            findings.add(contrasts.and_then(messages::display_sharpness));
        }
        if let Ok(prepared) = &attempt.prepared {
            let recovery = &prepared.recovery;
            if attempt.cause.is_none() && findings.are_responses_right() {
                let flicker = recovery.flicker(&sample.measurements, cores);
                findings.add(flicker.map(messages::flicker));
            }
            let photographs = messages::photographs(&sample.folder, &sample.shots, recovery);
            findings.add(photographs);
        }
        cores.check_cancelled()?;
        Ok(attempt)
    }

    /// Leaves out samples that are saturated though this is not declared.
    fn with_saturation(
        &self,
        sample: CaptureSample,
        findings: &mut Findings,
    ) -> Result<CaptureSample> {
        let codes = [Some(sample.read.codes), sample.read.flood_codes];
        let codes: Vec<CodeStatistics> = codes.into_iter().flatten().collect();
        let manifest = sample.folder.manifest();
        let Some((manifest, field)) = calibration::with_saturation(manifest, &codes) else {
            return Ok(sample);
        };
        let warning = calibration::saturation_warning(&field, &self.manifest_path());
        findings.add_estimate(field, warning);
        self.source.read_by(sample, manifest)
    }

    /// Looks for a fault of the capture as a whole. If the camera moved once, only the photographs from one of its places
    /// are used.
    fn with_capture_fault(&self, attempt: Attempt, findings: &mut Findings) -> Result<Attempt> {
        if !attempt.is_doubtful() {
            return Ok(attempt);
        }
        let sample = &attempt.sample;
        let fault = {
            let _spinner = progress::spinner("looking for a cause");
            let (window, cores) = (self.window(), self.source.cores());
            diagnose(
                &sample.measurements,
                window,
                &sample.shots,
                &attempt.left_out(),
                cores,
            )?
        };
        let moved = match fault {
            Some(CaptureFault::Moved { first, shift }) => Some((first, Some(shift))),
            Some(_) => None,
            None => attempt.step_of_shifts().map(|first| (first, None)),
        };
        let count = sample.shots.len();
        let still = moved.and_then(|(first, _)| still_photographs(count, first));
        let (Some((first, shift)), Some(still)) = (moved, still) else {
            let cause = fault.map(|fault| {
                messages::capture_fault(&sample.folder, &sample.shots, &sample.measurements, fault)
            });
            return Ok(Attempt { cause, ..attempt });
        };
        let mut manifest = sample.folder.manifest().clone();
        if still.start > 0 {
            // Gray code and flood are from the place before.
            let correspondence = &sample.measurements.correspondence;
            manifest.correspondence = Some(correspondence.shifted(shift.unwrap_or_default()));
            manifest.flood = None;
        }
        let warning = messages::moved_once(&sample.folder, &sample.shots, (first, shift), &still);
        findings.add([warning]);
        let (moved, shots) = partition(&sample.shots, &still);
        findings.moved_shots = moved;
        let sample = self.source.read_shots(attempt.sample, shots, manifest)?;
        Ok(self.attempt(attempt.method, sample))
    }

    /// Looks for responses of display and camera that explain the photographs better than those declared. Responses are
    /// tried in turn, as one is estimated with the mean function that follows from the one before.
    fn with_response(&self, declared: Attempt, findings: &mut Findings) -> Result<Attempt> {
        let is_usable = declared.prepared.is_ok() || declared.is_doubtful();
        if declared.cause.is_some() || !is_usable {
            return Ok(declared);
        }
        let Some(mut manifest) = self.likely_manifest(&declared)? else {
            return Ok(declared);
        };
        let original = declared.sample.folder.manifest().clone();
        let declared_snr = declared.snr();
        let Attempt {
            method,
            mut sample,
            prepared,
            mut cause,
        } = declared;
        let mut best: Option<(Manifest, Decibels, PreparedExport)> = None;
        for _ in 0..MAX_TRIALS {
            let trial = self.attempt(method, self.source.read_by(sample, manifest.clone())?);
            let least = match (&best, declared_snr) {
                (Some((_, snr, _)), _) => snr.0,
                (None, Some(snr)) => snr.0 + MIN_SNR_RISE.0,
                (None, None) => MIN_PLAUSIBLE_SNR.0,
            };
            let better = trial.snr().filter(|snr| snr.0 > least);
            // A power that is a little better than the curve of sRGB is hardly likelier.
            let next = match (better, manifest.camera.response) {
                (None, _) | (_, CameraResponse::Srgb) => None,
                _ => self.likely_manifest(&trial)?,
            };
            sample = trial.sample;
            if let (Some(snr), Ok(prepared)) = (better, trial.prepared) {
                best = Some((manifest, snr, prepared));
            }
            match next {
                Some(next) => manifest = next,
                None => break,
            }
        }
        let is_used = best.is_some() && self.settings.trust == TrustedCalibration::Estimated;
        if let Some((estimated, snr, _)) = &best {
            for mut field in calibration::changed_responses(&original, estimated) {
                field.is_used = is_used;
                let reason = calibration::response_reason(&field, declared_snr, *snr);
                let finding = field.finding(&self.manifest_path(), &reason);
                if prepared.is_err() && !is_used {
                    findings.estimated_fields.push(field);
                    cause = cause.or(Some(finding));
                } else {
                    findings.add_estimate(field, finding);
                }
            }
        }
        match best.filter(|_| is_used) {
            Some((estimated, _, prepared)) => Ok(Attempt {
                method,
                sample: self.source.read_by(sample, estimated)?,
                prepared: Ok(prepared),
                cause: None,
            }),
            None => Ok(Attempt {
                method,
                sample: self.source.read_by(sample, original)?,
                prepared,
                cause,
            }),
        }
    }

    /// The manifest with another response, if one may explain the photographs better.
    fn likely_manifest(&self, attempt: &Attempt) -> Result<Option<Manifest>> {
        let (sample, cores) = (&attempt.sample, self.source.cores());
        let measurements = &sample.measurements;
        let white = flood_white(sample.folder.manifest());
        let _spinner = progress::spinner("testing responses");
        let found = pollster::block_on(async {
            match &attempt.prepared {
                Ok(prepared) => prepared.recovery.response(measurements, white, cores).await,
                Err(_) => find_response(measurements, self.window(), white, cores).await,
            }
        });
        let found = match found {
            Err(RecoverError::Cancelled(cancelled)) => return Err(cancelled.into()),
            // The recovery has told, or will tell, why nothing can be estimated.
            found => found.unwrap_or_default(),
        };
        let declared = sample.folder.manifest();
        let mut likely = found
            .into_iter()
            .map(|found| calibration::with_response(declared, found));
        // Not every response has a name after the declared one.
        Ok(likely.find(|likely| likely != declared))
    }

    /// Looks whether the display dims bright pictures, or highlights are compressed, as only the flood photograph may tell.
    fn with_flood_shortfall(&self, attempt: Attempt, findings: &mut Findings) -> Result<Attempt> {
        let Some(prepared) = (attempt.prepared.as_ref().ok()).filter(|_| !attempt.is_doubtful())
        else {
            return Ok(attempt);
        };
        // Another wrong response would seem to be either.
        if !findings.are_responses_right() {
            return Ok(attempt);
        }
        let (measurements, cores) = (&attempt.sample.measurements, self.source.cores());
        let manifest = attempt.sample.folder.manifest().clone();
        let white = flood_white(&manifest);
        let Some(shortfall) = (prepared.recovery).flood_shortfall(measurements, white, cores)
        else {
            return Ok(attempt);
        };
        let is_used = self.settings.trust == TrustedCalibration::Estimated;
        let is_estimated = !findings.estimated_fields.is_empty();
        let compression = shortfall.compression.filter(|_| !is_estimated);
        let compressed = compression.and_then(|s| calibration::with_compression(&manifest, s));
        let (amended, mut field, reason) = match compressed {
            Some((amended, field)) => (amended, field, messages::flood_shortfall_reason(None)),
            None => {
                let dimming = shortfall.dimming;
                let (amended, field) = calibration::with_dimming(&manifest, dimming);
                let reason = messages::flood_shortfall_reason(Some(dimming));
                (amended, field, reason)
            }
        };
        field.is_used = is_used;
        let finding = field.finding(&self.manifest_path(), &reason);
        findings.add_estimate(field, finding);
        match is_used {
            true => {
                let sample = self.source.read_by(attempt.sample, amended)?;
                Ok(self.attempt(attempt.method, sample))
            }
            false => Ok(attempt),
        }
    }

    /// Prepares the recovery as declared: by the fallback where the method predicts too badly.
    fn first_attempt(&self, sample: CaptureSample) -> Attempt {
        let attempt = self.attempt(self.settings.method, sample);
        let is_implausible = attempt.snr().is_some_and(|snr| snr < MIN_PLAUSIBLE_SNR);
        match self.settings.fallback.filter(|_| is_implausible) {
            Some(method) => self.attempt(method, attempt.sample),
            None => attempt,
        }
    }

    /// Chooses the window, and learns or chooses what the method needs.
    fn attempt(&self, method: Method, sample: CaptureSample) -> Attempt {
        let _spinner = progress::spinner("learning");
        let cores = self.source.cores();
        let settings = ExportSettings {
            method,
            window: self.settings.window,
            is_registered: self.settings.is_registered,
        };
        let preparation = export::prepare(&sample.measurements, settings, cores);
        Attempt {
            method,
            prepared: pollster::block_on(preparation),
            sample,
            cause: None,
        }
    }

    /// The window, or the largest that may be chosen.
    fn window(&self) -> Window {
        self.settings
            .window
            .unwrap_or(WindowSizeEstimate::MAX_WINDOW)
    }

    fn manifest_path(&self) -> String {
        self.folder.manifest_path().display().to_string()
    }

    /// Names the capture, or those of the `shots` that were read, that an error of the recovery is about.
    pub fn recover_error(&self, error: RecoverError, shots: &[usize]) -> Error {
        match error {
            RecoverError::Cancelled(cancelled) => cancelled.into(),
            RecoverError::MismatchedPatterns { pattern_indices } => {
                let shots = pattern_indices.iter().map(|&l| shots[l]);
                messages::mismatched_shots(self.folder, shots)
            }
            RecoverError::IndistinctPhotographs => Error::new(error).context(self.manifest_path()),
            other => Error::new(other).context(self.folder.root().display().to_string()),
        }
    }
}

/// The measurement at which the flood photograph is white: it is read as if the display did not dim.
fn flood_white(manifest: &Manifest) -> f64 {
    (1.0 - manifest.light.dimming.unwrap_or(0.0)).recip()
}

/// The place in a list of shifts after which they differ from those before by more than their scatter.
fn first_after_step(shifts: &[[f64; 2]]) -> Option<usize> {
    let mean = |part: &[[f64; 2]], axis: usize| {
        part.iter().map(|shift| shift[axis]).sum::<f64>() / part.len() as f64
    };
    // Squared distance between the means of both parts, and mean squared deviation from them.
    let split = |first: usize| {
        let (before, after) = shifts.split_at(first);
        let (mut step, mut scatter) = (0.0, 0.0);
        for axis in 0..2 {
            let means = [mean(before, axis), mean(after, axis)];
            step += (means[1] - means[0]).powi(2);
            for (part, mean) in [before, after].into_iter().zip(means) {
                scatter += part
                    .iter()
                    .map(|shift| (shift[axis] - mean).powi(2))
                    .sum::<f64>();
            }
        }
        (first, step, scatter / shifts.len() as f64)
    };
    let splits =
        (MIN_STILL_PHOTOGRAPHS / 4)..(shifts.len().saturating_sub(MIN_STILL_PHOTOGRAPHS / 4));
    let best = splits.map(split).min_by(|a, b| a.2.total_cmp(&b.2))?;
    let (first, step, scatter) = best;
    let is_step = step > MIN_STEP * MIN_STEP && step > MIN_STEP_RATIO * scatter;
    is_step.then_some(first)
}

/// Which of `count` photographs show the object from the place of most, if the camera moved before photograph `first`: of
/// equal numbers those before, as the Gray code. `None` if these are too few.
fn still_photographs(count: usize, first: usize) -> Option<std::ops::Range<usize>> {
    let still = match first >= count - first {
        true => 0..first,
        false => first..count,
    };
    (still.len() >= MIN_STILL_PHOTOGRAPHS).then_some(still)
}

/// The shots that moved, and those that are `still`.
fn partition(shots: &[usize], still: &std::ops::Range<usize>) -> (Vec<usize>, Vec<usize>) {
    let moved = [&shots[..still.start], &shots[still.end..]].concat();
    (moved, shots[still.clone()].to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_of_shifts_is_found_and_trembling_is_none() {
        let noise = |l: usize| 0.01 * (7.3 * l as f64).sin();
        let step = |l: usize| if l < 40 { 0.0 } else { 0.2 };
        let shifts: Vec<[f64; 2]> = (0..72)
            .map(|l| [step(l) + noise(l), noise(l + 5)])
            .collect();
        assert_eq!(first_after_step(&shifts), Some(40));
        let trembling: Vec<[f64; 2]> = (0..72)
            .map(|l| [20.0 * noise(l), 20.0 * noise(l + 5)])
            .collect();
        assert_eq!(first_after_step(&trembling), None);
        assert_eq!(first_after_step(&[]), None);
    }

    #[test]
    fn the_larger_part_is_used_if_it_is_large_enough() {
        assert_eq!(still_photographs(72, 36), Some(0..36));
        assert_eq!(still_photographs(72, 20), Some(20..72));
        assert_eq!(still_photographs(40, 20), None);
        assert_eq!(partition(&[3, 5, 7, 9], &(1..4)), (vec![3], vec![5, 7, 9]));
    }
}
