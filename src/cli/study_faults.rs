//! The faults of rigs in `ltm-export study`, measured as a user meets them.
//!
//! A capture with known transport is photographed again with a fault into a temporary folder; this capture is recovered and
//! evaluated. All of it is the code of the commands `simulate`, `photograph`, `recover` and `evaluate`.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use anyhow::{Context, Error, Result};
use clap::{Args, Command};
use tempfile::TempDir;

use super::process_resources::InterruptibleCores;
use super::recover::{MethodName, RecoverReport, TrustedCalibration};
use super::value_parsers::value_name;
use super::{evaluate, photograph, recover, simulate};
use crate::capture::{CaptureFolder, MANIFEST_NAME};
use crate::simulate::{SessionFault, SessionFaultKind};
use crate::study::{FaultOutcome, FaultedCapture, ProgressLog, ReportSection, fault_table};
use crate::transport::Decibels;

/// Built-in scenes.
const SCENES: [&str; 2] = ["stained-glass", "cookies"];
/// Of these `recover` uses 80 and holds out the others.
const SHOTS: &str = "88";
/// Seed of noise and faults.
const SEED: u64 = 1;
/// Seeds of the noise of captures without faults, which any report would be a false alarm on.
const CLEAN_SEEDS: RangeInclusive<u64> = 2..=11;

/// Sides of camera and light plane.
#[derive(Clone, Copy)]
struct SceneScale {
    camera: &'static str,
    light: &'static str,
}

const SCALE: SceneScale = SceneScale {
    camera: "128x128",
    light: "64x64",
};
const CLEAN_SCALE: SceneScale = SceneScale {
    camera: "64x64",
    light: "32x32",
};

/// A row of the table.
struct FaultRow {
    name: String,
    faults: Vec<SessionFault>,
}

impl FaultRow {
    fn single(fault: SessionFault) -> Self {
        Self {
            name: fault.to_string(),
            faults: vec![fault],
        }
    }

    /// No fault, each fault in its own size, a slow drift, and together faults that most rigs have.
    fn all() -> Vec<Self> {
        use SessionFaultKind::{Defects, Drift, Exposure, GrowingRoom, Jitter, Tremble};
        const COMMON: [SessionFaultKind; 6] =
            [Jitter, Drift, GrowingRoom, Tremble, Defects, Exposure];
        let mut rows = vec![Self {
            name: "clean".to_owned(),
            faults: Vec::new(),
        }];
        rows.extend(SessionFault::all().map(Self::single));
        rows.push(Self::single(SessionFault {
            kind: Drift,
            size: 0.01,
        }));
        let common = SessionFault::all().filter(|fault| COMMON.contains(&fault.kind));
        let third = |fault: SessionFault| SessionFault {
            size: fault.size / 3.0,
            ..fault
        };
        rows.push(Self {
            name: "six faults at a third of these sizes".to_owned(),
            faults: common.map(third).collect(),
        });
        rows
    }
}

/// Photographs captures again with faults, and recovers them.
pub struct FaultStudy<'a> {
    /// Captures and files; deleted at the end.
    folder: TempDir,
    method: MethodName,
    cores: InterruptibleCores,
    progress: ProgressLog<'a>,
}

impl<'a> FaultStudy<'a> {
    /// A study of recovery by `method`, with a temporary folder in `root`.
    pub fn new(root: &Path, method: MethodName, progress: ProgressLog<'a>) -> Result<Self> {
        let folder = TempDir::with_prefix_in(".ltm-export-", root);
        Ok(Self {
            folder: folder.with_context(|| root.display().to_string())?,
            method,
            cores: InterruptibleCores::default(),
            progress,
        })
    }

    /// The faults of the built-in scenes, and false alarms without faults.
    pub fn study_scenes(&self) -> Result<ReportSection> {
        let mut captures = Vec::new();
        for scene in SCENES {
            let capture = self.simulate(scene, SCALE)?;
            captures.push(self.outcomes(scene, &capture)?);
        }
        let mut section = table("faults", &captures)?;
        let SceneScale { camera, light } = SCALE;
        section.add_paragraph(&format!(
            "Both are captures of `ltm-export simulate` with camera {camera}, light {light} and {SHOTS} shots, of which 80 \
             are recovered from."
        ));
        section.add_paragraph(&self.false_alarms()?);
        Ok(section)
    }

    /// The faults of the capture in the folder `path`.
    pub fn study_capture(&self, name: &str, path: &Path) -> Result<ReportSection> {
        // An absolute path does not look like an option.
        let capture = path.canonicalize().context("cannot be read")?;
        let outcomes = self.outcomes(name, &capture)?;
        table(&format!("{name}-faults"), &[outcomes])
    }

    /// Writes a capture of `scene`.
    fn simulate(&self, scene: &str, scale: SceneScale) -> Result<PathBuf> {
        let SceneScale { camera, light } = scale;
        let capture = self.folder.path().join(format!("{scene}-{camera}"));
        let options = ["--camera", camera, "--light", light, "--patterns", SHOTS];
        let mut arguments = vec![scene.into(), "-o".into(), capture.clone().into_os_string()];
        arguments.extend(options.map(OsString::from));
        simulate::run(&parse(arguments)?)?;
        Ok(capture)
    }

    /// The outcomes of all rows for the folder `capture`, named `name`.
    fn outcomes(&self, name: &str, capture: &Path) -> Result<FaultedCapture> {
        let folder = CaptureFolder::open(capture)?;
        let has_grey_codes = has_grey_codes(&folder)?;
        let is_possible = |fault: &SessionFault| match fault.kind {
            SessionFaultKind::Mirror => folder.manifest().correspondence.is_some(),
            SessionFaultKind::Gamma => has_grey_codes,
            _ => true,
        };
        let outcome = |row: FaultRow| {
            let outcome = match row.faults.iter().all(is_possible) {
                true => self.measure(capture, &row.faults, SEED)?,
                false => FaultOutcome::Inapplicable,
            };
            let snr = outcome.snr().map_or(String::new(), |snr| format!(" {snr}"));
            let text = format!("faults, {name}, {}:{snr} {}", row.name, outcome.report());
            (self.progress)(text.trim_end());
            Ok(outcome)
        };
        let outcomes = FaultRow::all().into_iter().map(outcome);
        Ok(FaultedCapture {
            name: name.to_owned(),
            outcomes: outcomes.collect::<Result<_>>()?,
        })
    }

    /// Photographs `capture` again with `faults`, and recovers and evaluates it.
    fn measure(&self, capture: &Path, faults: &[SessionFault], seed: u64) -> Result<FaultOutcome> {
        let work = TempDir::new_in(self.folder.path())?;
        let [faulty, file] = ["capture", "recovered.ltm"].map(|name| work.path().join(name));
        let mut arguments = vec![capture.into(), "-o".into(), faulty.clone().into_os_string()];
        arguments.push(format!("--seed={seed}").into());
        arguments.extend(faults.iter().map(|fault| format!("--fault={fault}").into()));
        photograph::write_capture(&parse(arguments)?)?;
        let (report, snr) = match self.recover(&faulty, &file, TrustedCalibration::Declared)? {
            Ok(recovered) => recovered,
            Err(reason) => return Ok(FaultOutcome::Refused(reason)),
        };
        let has_estimates = report.estimated_fields.iter().any(|field| !field.is_used);
        let trusted = match has_estimates {
            true => self
                .recover(&faulty, &file, TrustedCalibration::Estimated)?
                .ok(),
            false => None,
        };
        Ok(FaultOutcome::Recovered {
            snr,
            trusted_snr: trusted.and_then(|(_, snr)| snr),
            findings: findings(&report),
        })
    }

    /// Recovers the folder `capture` and evaluates it: the report and the SNR, or why it is refused.
    fn recover(
        &self,
        capture: &Path,
        file: &Path,
        trust: TrustedCalibration,
    ) -> Result<Result<(RecoverReport, Option<Decibels>), String>> {
        let folder = CaptureFolder::open(capture)?;
        let mut arguments: Vec<OsString> = vec![capture.into(), "-o".into()];
        arguments.extend([file.into(), "--lossless".into()]);
        arguments.push(format!("--method={}", value_name(self.method)).into());
        arguments.push(format!("--trust={}", value_name(trust)).into());
        let report = match recover::recover(&parse(arguments)?, &folder, &self.cores) {
            Ok(report) => report,
            // Not the fault's doing.
            Err(error) if error.chain().any(|cause| cause.is::<io::Error>()) => return Err(error),
            Err(error) => return Ok(Err(first_clause(&error, capture))),
        };
        let evaluated = evaluate::evaluate(&parse([file, capture])?)?;
        Ok(Ok((report, evaluated.snr_db)))
    }

    /// The findings about captures without faults.
    fn false_alarms(&self) -> Result<String> {
        let mut alarms = Vec::new();
        let mut count = 0;
        for scene in SCENES {
            let capture = self.simulate(scene, CLEAN_SCALE)?;
            for seed in CLEAN_SEEDS {
                let report = self.measure(&capture, &[], seed)?.report();
                count += 1;
                if !report.is_empty() {
                    alarms.push(format!("{scene}, seed {seed}: {report}"));
                }
            }
        }
        let SceneScale { camera, light } = CLEAN_SCALE;
        let mut text = format!(
            "False alarms: of captures without faults, {} of {count} have anything reported (both scenes, camera {camera}, \
             light {light}, {SHOTS} shots, each with noise of {} other seeds).",
            alarms.len(),
            CLEAN_SEEDS.count(),
        );
        if !alarms.is_empty() {
            text += &format!(" These are {}.", alarms.join("; "));
        }
        (self.progress)(&text);
        Ok(text)
    }
}

fn table(file_name: &str, captures: &[FaultedCapture]) -> Result<ReportSection> {
    let names: Vec<String> = FaultRow::all().into_iter().map(|row| row.name).collect();
    Ok(fault_table(file_name, &names, captures)?)
}

/// The arguments of a subcommand, with its defaults.
fn parse<T: Args>(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<T> {
    let command = T::augment_args(Command::new("ltm-export")).no_binary_name(true);
    let matches = command.try_get_matches_from(arguments)?;
    Ok(T::from_arg_matches(&matches)?)
}

/// Whether patterns have codes whose emission depends on the light plane's response.
fn has_grey_codes(folder: &CaptureFolder) -> Result<bool> {
    for shot in 0..folder.manifest().shots.len() {
        let pattern = folder.read_pattern(shot)?;
        if pattern.has_grey_levels() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Names of what was corrected, and codes of warnings and of photographs that were left out.
fn findings(report: &RecoverReport) -> Vec<String> {
    let photographs = &report.photograph_reports;
    let (used, left_out): (Vec<_>, Vec<_>) = photographs
        .iter()
        .partition(|photo| photo.verdict == "used");
    let corrections = [
        ("gain", used.iter().any(|photo| photo.gain != 1.0)),
        (
            "stray_light",
            used.iter().any(|photo| photo.stray_light != 0.0),
        ),
        (
            "shift",
            used.iter().any(|photo| photo.shift != Some([0.0; 2])),
        ),
        ("hot_pixels", report.hot_pixels > 0),
        ("dead_pixels", report.dead_pixels > 0),
    ];
    let corrections = corrections.into_iter().filter(|(_, is_found)| *is_found);
    let mut findings: Vec<String> = corrections.map(|(name, _)| name.to_owned()).collect();
    let mut verdicts: BTreeMap<&str, usize> = BTreeMap::new();
    for photo in left_out {
        *verdicts.entry(photo.verdict).or_default() += 1;
    }
    let named = verdicts
        .iter()
        .map(|(code, count)| format!("{code} ({count})"));
    findings.extend(named);
    for warning in &report.warnings {
        // Photographs that are left out have warnings with the same codes.
        if !verdicts.contains_key(&*warning.code) {
            findings.push(warning.code.to_string());
        }
    }
    let values = report.estimated_fields.iter();
    findings.extend(values.map(|field| format!("{} {}", field.field, field.estimated)));
    findings
}

/// The first clause of an error about `capture`, without the capture's path.
fn first_clause(error: &Error, capture: &Path) -> String {
    let text = format!("{error:#}");
    let paths = [capture.join(MANIFEST_NAME), capture.to_owned()];
    let prefixes = paths.map(|path| format!("{}: ", path.display()));
    let message = prefixes
        .iter()
        .find_map(|prefix| text.strip_prefix(prefix))
        .unwrap_or(&text);
    let end = message.find([':', ';']).unwrap_or(message.len());
    message[..end].to_owned()
}
