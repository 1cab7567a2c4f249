//! The command line: one module for each subcommand of `ltm-export`, over the library.
//!
//! Files, threads, signals and the terminal are handled here. Errors of the library name the file and the field;
//! [`advice`] adds the remedy.

mod advice;
mod assemble;
mod calibrate;
mod capture_writer;
mod check;
mod encode;
mod evaluate;
mod exit_status;
mod field_suggestion;
mod file_hash;
mod finding;
mod finest_level;
mod import;
mod ingested_manifest;
mod inspect;
mod levels_output;
mod ltm_file;
mod measurement_reader;
mod object_text;
mod output_file;
mod output_folder;
mod patterns;
mod photograph;
mod process_resources;
mod progress;
mod quality_report;
mod records;
mod recover;
mod relight;
mod relit_picture;
mod report;
mod shoot;
mod simulate;
mod stage;
mod study;
mod study_faults;
mod tiles;
mod value_parsers;
mod verify;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

/// Recover, inspect and relight photographs of an object under many lights
#[derive(Debug, Parser)]
#[command(name = "ltm-export", version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Patterns(patterns::PatternsArgs),
    Shoot(shoot::ShootArgs),
    Assemble(assemble::AssembleArgs),
    Import(import::ImportArgs),
    Calibrate(calibrate::CalibrateArgs),
    Simulate(simulate::SimulateArgs),
    Photograph(photograph::PhotographArgs),
    Check(check::CheckArgs),
    Recover(recover::RecoverArgs),
    Stage(stage::StageArgs),
    Encode(encode::EncodeArgs),
    Evaluate(evaluate::EvaluateArgs),
    Report(quality_report::ReportArgs),
    Relight(relight::RelightArgs),
    Tiles(tiles::TilesArgs),
    Inspect(inspect::InspectArgs),
    Verify(verify::VerifyArgs),
    Study(study::StudyArgs),
}

/// The definition of the command line, for its reference in `docs/cli.md`.
pub fn definition() -> clap::Command {
    Cli::command()
}

/// Parses the command line and runs it. The exit status is 0 on success, else that of [`exit_status`](exit_status::exit_status).
pub fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Patterns(args) => patterns::run(&args),
        Command::Shoot(args) => shoot::run(&args),
        Command::Assemble(args) => assemble::run(&args),
        Command::Import(args) => import::run(&args),
        Command::Calibrate(args) => calibrate::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Photograph(args) => photograph::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Recover(args) => recover::run(&args),
        Command::Stage(args) => stage::run(&args),
        Command::Encode(args) => encode::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Report(args) => quality_report::run(&args),
        Command::Relight(args) => relight::run(&args),
        Command::Tiles(args) => tiles::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Verify(args) => verify::run(&args),
        Command::Study(args) => study::run(&args),
    };
    let Err(error) = result else {
        return ExitCode::SUCCESS;
    };
    if error.is::<process_resources::Interrupted>() {
        eprintln!("{error:#}");
    } else if !error.is::<check::NotReadyError>() {
        // `check` has reported why.
        eprintln!("error: {}", advice::error_with_remedy(&error));
    }
    ExitCode::from(exit_status::exit_status(&error))
}
