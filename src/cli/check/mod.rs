//! `ltm-export check`: all that is wrong with a capture folder, before it is recovered.
//!
//! Every photograph is decoded once ([`scanned_capture`]). Files ([`file_findings`]), single photographs
//! ([`photograph_findings`]) and the Gray code ([`gray_code`]) are looked at first. What photographs say together is found
//! by the preparation of a recovery, as `recover` runs it, from the same pixels as `recover` ([`examination`]).

mod examination;
mod file_findings;
mod gray_code;
mod photograph_findings;
mod report;
mod scanned_capture;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Error, Result};
use clap::Args;
use rayon::prelude::*;

use self::examination::Examination;
use self::file_findings::FileFault;
use self::photograph_findings::Brightness;
pub use self::report::CheckReport;
use self::report::ShotReport;
use self::scanned_capture::ScannedCapture;
use super::advice::error_with_remedy;
use super::finding::Finding;
use super::process_resources::{Interrupted, InterruptibleCores, peak_rss_bytes};
use super::recover::findings::Findings;
use super::recover::{WindowArg, messages, parse_window};
use super::report::print_json;
use crate::calibrate::GrayCodeQuality;
use crate::capture::{CaptureErrorKind, CaptureFolder, PhotographRole};
use crate::job_executor::Cancelled;
use crate::recover::{MIN_PATTERNS, RecoverError};
use crate::transport::Window;

/// Check a capture folder before it is recovered: all that is wrong with it, each with its remedy
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Capture folder: capture.json and the files it names
    capture: PathBuf,
    /// Window that it will be recovered with: an odd number of light elements, or "auto" to estimate it
    #[arg(long, value_name = "W", default_value = "15", value_parser = parse_window)]
    window: WindowArg,
    /// Exit with status 65 after warnings, too
    #[arg(long)]
    strict: bool,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// The capture has errors, which the report tells.
#[derive(Debug, thiserror::Error)]
#[error("the capture is not ready to be recovered")]
pub struct NotReadyError;

pub fn run(args: &CheckArgs) -> Result<()> {
    let cores = InterruptibleCores::listen()?;
    let report = check(args, &cores).map_err(|error| match error.is::<Cancelled>() {
        true => Interrupted("interrupted; nothing was checked to the end".to_owned()).into(),
        false => error,
    })?;
    match args.json {
        true => print_json(&report)?,
        false => report.print()?,
    }
    match report.ready {
        true => Ok(()),
        false => Err(NotReadyError.into()),
    }
}

/// Checks the capture at `capture`, as for a recovery in `window`; `None` to estimate it.
///
/// # Errors
/// If it is no capture folder, or the command is interrupted.
pub fn check_capture(
    capture: &Path,
    window: Option<Window>,
    cores: &InterruptibleCores,
) -> Result<CheckReport> {
    let args = CheckArgs {
        capture: capture.to_owned(),
        window,
        strict: false,
        json: false,
    };
    check(&args, cores)
}

fn check(args: &CheckArgs, cores: &InterruptibleCores) -> Result<CheckReport> {
    let start = Instant::now();
    let of_findings = |findings| CheckReport::new(findings, None, args.strict);
    let mut report = match CaptureFolder::open_unchecked(&args.capture) {
        Ok(folder) if folder.manifest().problems().is_empty() => {
            check_photographs(args, &folder, cores)?
        }
        Ok(folder) => of_findings(check_headers(&folder)),
        Err(error) if matches!(error.problem, CaptureErrorKind::NotACapture(_)) => {
            return Err(error.into());
        }
        Err(error) => of_findings(vec![file_findings::manifest(&error)]),
    };
    report.seconds = start.elapsed().as_secs_f64();
    report.peak_rss_bytes = peak_rss_bytes();
    Ok(report)
}

/// What can be told where fields of the manifest are wrong: these, and files that are missing or of another type.
fn check_headers(folder: &CaptureFolder) -> Vec<Finding> {
    let mut findings = file_findings::fields(folder);
    let manifest = folder.manifest();
    let photographs = manifest.photographs().into_iter().filter_map(|photograph| {
        let error = folder.check_header(photograph).err()?;
        Some(FileFault::of_photograph(folder, photograph.role, error))
    });
    let mut faults: Vec<FileFault> = photographs.collect();
    faults.extend(pattern_faults(folder));
    let problems = manifest.problems();
    if problems.iter().any(is_of_size) {
        faults.retain(|fault| !matches!(fault.error.problem, CaptureErrorKind::WrongExtent { .. }));
    }
    findings.extend(file_findings::files(folder.root(), &faults));
    findings
}

/// Whether a size is wrong, with which no file can agree.
fn is_of_size(problem: &CaptureErrorKind) -> bool {
    match problem {
        CaptureErrorKind::OutOfRange { field, .. } => {
            field.ends_with(".width") || field.ends_with(".height")
        }
        _ => false,
    }
}

/// The patterns that cannot be read.
fn pattern_faults(folder: &CaptureFolder) -> Vec<FileFault> {
    let shots = 0..folder.manifest().shots.len();
    let fault = |i: usize| {
        let error = folder.read_pattern(i).err()?;
        Some(FileFault::of_pattern(i, error))
    };
    shots.into_par_iter().filter_map(fault).collect()
}

/// What single photographs say, in captures with a valid manifest.
struct CheckedPhotographs<'a> {
    scanned: ScannedCapture<'a>,
    gray_code: Option<[GrayCodeQuality; 2]>,
    /// Of each shot, if it can be read.
    brightness: Vec<Option<Brightness>>,
    /// Indices of the shots that can be read, and are neither dark nor saturated in large parts.
    usable: Vec<usize>,
}

impl<'a> CheckedPhotographs<'a> {
    /// Decodes all photographs, and looks at each by itself.
    fn read(
        folder: &CaptureFolder,
        window: Option<Window>,
        cores: &'a InterruptibleCores,
        findings: &mut Findings,
    ) -> Result<Self, Cancelled> {
        let (mut scanned, errors) = ScannedCapture::read(folder, window, cores)?;
        let of_photograph = |(role, error)| FileFault::of_photograph(folder, role, error);
        let mut faults: Vec<FileFault> = errors.into_iter().map(of_photograph).collect();
        faults.extend(pattern_faults(folder));
        findings.add(file_findings::files(folder.root(), &faults));
        let (gray_code, of_gray_code) = gray_code::examine(folder, &mut scanned);
        findings.add(of_gray_code);
        findings.add(photograph_findings::duplicates(folder, &scanned));
        let brightness = photograph_findings::brightness(folder, &scanned);
        let dark = photograph_findings::shots_without_light(&brightness);
        let exposures = photograph_findings::exposures(folder, &scanned, &brightness, &dark);
        findings.add(exposures);
        let saturated = photograph_findings::oversaturated_shots(folder, &scanned);
        let finding = photograph_findings::oversaturated(folder, &scanned, &saturated);
        findings.add(finding);
        let is_usable = |i: &usize| {
            let is_faulty = faults.iter().any(|fault| fault.shot == Some(*i));
            !is_faulty && !dark.contains(i) && !saturated.contains(i)
        };
        Ok(Self {
            gray_code,
            usable: (0..brightness.len()).filter(is_usable).collect(),
            scanned,
            brightness,
        })
    }

    fn shot_reports(&self, folder: &CaptureFolder) -> Vec<ShotReport> {
        let report = |(i, brightness): (usize, &Option<Brightness>)| {
            let scan = self.scanned.scan(PhotographRole::Shot(i));
            ShotReport::new(folder, i, scan, *brightness)
        };
        self.brightness.iter().enumerate().map(report).collect()
    }
}

/// Checks a capture with a valid manifest.
fn check_photographs(
    args: &CheckArgs,
    folder: &CaptureFolder,
    cores: &InterruptibleCores,
) -> Result<CheckReport> {
    let mut findings = Findings::default();
    let photographs = CheckedPhotographs::read(folder, args.window, cores, &mut findings)?;
    let mut shot_reports = photographs.shot_reports(folder);
    let examined = match photographs.usable.len() {
        usable if usable < MIN_PATTERNS => {
            findings.add(messages::unknown_fields(folder));
            let error = RecoverError::TooFewPatterns(usable);
            let error = Error::new(error).context(folder.manifest_path().display().to_string());
            findings.add([Finding::error(
                "too-few-patterns",
                error_with_remedy(&error),
            )]);
            None
        }
        // A finding says that nothing is known of where patterns are in photographs.
        _ if !photographs.scanned.has_correspondence(folder) => {
            findings.add(messages::unknown_fields(folder));
            None
        }
        _ => {
            let examination = Examination {
                folder,
                window: args.window,
                scanned: &photographs.scanned,
            };
            let (mut examined, found) =
                examination.run(photographs.usable.clone(), &mut findings)?;
            examined.gray_code = photographs.gray_code;
            for found in found {
                shot_reports[found.shot].add(&found);
            }
            Some(examined)
        }
    };
    let mut report = CheckReport::new(findings.list, examined, args.strict);
    report.shot_reports = shot_reports;
    Ok(report)
}
