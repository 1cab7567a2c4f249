//! `ltm-export report`: one page that says how a file was made, how good it is, and what it may be used for.
//!
//! Predictions are compared with held-out photographs ([`predictions`]), the capture is checked as `ltm-export check` does, files
//! are hashed ([`provenance`]), and the findings become a conclusion ([`conclusion`]) and a page ([`page`], [`figures`]).

mod conclusion;
mod figures;
mod page;
mod predictions;
mod provenance;

use std::path::PathBuf;
use std::time::SystemTime;

use anyhow::{Result, ensure};
use clap::Args;
use serde::Serialize;

use self::conclusion::{Conclusion, FileQuality};
use self::predictions::{HeldOutAccuracy, Predictions};
use self::provenance::CaptureOrigin;
use super::assemble::fit_gray_code;
use super::calibrate::Distances;
use super::check::{CheckReport, check_capture};
use super::evaluate::ensure_same_geometry;
use super::finest_level::FinestLevel;
use super::output_file::{HTML, OutputFile};
use super::process_resources::{Interrupted, InterruptibleCores};
use super::report::{print_json, print_line};
use crate::capture::CaptureFolder;
use crate::job_executor::Cancelled;
use crate::transport::Decibels;

/// Write a page about a file and its capture: pictures, accuracy, noise, drift, origin, and what it may be used for
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Relightable photograph
    #[arg(value_name = "FILE.ltm")]
    file: PathBuf,
    /// Capture folder that it was recovered from
    capture: PathBuf,
    /// Page to write, complete in itself
    #[arg(short, long, value_name = "REPORT.html")]
    output: PathBuf,
    /// Print one JSON object on standard output: everything but the pictures
    #[arg(long)]
    json: bool,
}

/// Fields of `report --json`; see docs/capture.md.
#[derive(Serialize)]
pub struct QualityReport {
    /// When it was written: RFC 3339, UTC.
    written: String,
    conclusion: Conclusion,
    /// None if the recovery used all photographs.
    held_out: Option<HeldOutAccuracy>,
    /// Distances between the correspondence of the Gray code and its decoded positions, in light elements; null without Gray
    /// code that can be decoded.
    correspondence_residual: Option<Distances>,
    /// As `check --json`.
    check: CheckReport,
    provenance: CaptureOrigin,
}

pub fn run(args: &ReportArgs) -> Result<()> {
    let output = OutputFile::create(&args.output, &HTML)?;
    let cores = InterruptibleCores::listen()?;
    let (report, predictions) =
        examine(args, &cores).map_err(|error| match error.is::<Cancelled>() {
            true => Interrupted("interrupted: no report is written".to_owned()).into(),
            false => error,
        })?;
    let page = page::html(&report, &predictions)?;
    output.finish(|out| {
        use std::io::Write;
        Ok(out.write_all(page.as_bytes())?)
    })?;
    if report.provenance.are_inputs_unchanged == Some(false) {
        eprintln!("warning: {}", conclusion::OTHER_INPUTS);
    }
    if args.json {
        return print_json(&report);
    }
    print_line(&format!(
        "{}: {}",
        args.output.display(),
        report.conclusion.sentence
    ))
}

fn examine(args: &ReportArgs, cores: &InterruptibleCores) -> Result<(QualityReport, Predictions)> {
    let mut file = FinestLevel::open(&args.file, None)?;
    let folder = CaptureFolder::open(&args.capture)?;
    ensure_same_geometry(&file.geometry, &args.file, &folder)?;
    let window = file.geometry.window;
    let check = check_capture(&args.capture, Some(window), cores)?;
    let noise = check.examined.as_ref().map(|examined| examined.noise);
    let metadata = file.metadata.read()?;
    let shots = folder.manifest().shots.len();
    ensure!(
        metadata.shots_used.iter().all(|shot| *shot < shots),
        "{}: was recovered from more shots than the {shots} of {}; give the capture that it was recovered from",
        args.file.display(),
        args.capture.display()
    );
    let (file_snr, text) = (file.snr, file.metadata.text().to_owned());
    let used = metadata.shots_used;
    let color_matrix = metadata.color_matrix.as_ref();
    let predictions = Predictions::new(&mut file, &folder, &used, noise, color_matrix, cores)?;
    let provenance = CaptureOrigin::read(&args.file, &text, &used, &folder, cores)?;
    let residual = match folder.manifest().graycode.is_empty() {
        true => None,
        false => fit_gray_code(&args.capture)
            .ok()
            .and_then(|fit| fit.residual),
    };
    let held_out = predictions.accuracy();
    let transport_snr = provenance.metadata["origin"]["expected_snr_db"].as_f64();
    let transport_snr = transport_snr.map(Decibels);
    let quality = FileQuality {
        transport_snr,
        file_snr,
        are_inputs_unchanged: provenance.are_inputs_unchanged,
    };
    let report = QualityReport {
        written: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
        conclusion: Conclusion::new(held_out.as_ref(), &quality, &check, &predictions),
        held_out,
        correspondence_residual: residual.map(Distances::from),
        check,
        provenance,
    };
    Ok((report, predictions))
}
