//! The command line: subcommands over the library, with the files, threads and terminal that the
//! library does not know of.

mod checkpoint;
mod encode;
mod evaluate;
mod files;
mod inspect;
mod lights;
mod memory;
mod new_folder;
mod photographs;
mod process;
mod recover;
mod recovery_remedy;
mod relight;
mod report;
mod simulate;
mod study;
mod tile_record;
mod verify;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Photographs of an object under many lights in, one small file that relights it out.
#[derive(Debug, Parser)]
#[command(name = "ltm-export", version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Simulate(simulate::SimulateArgs),
    Recover(recover::RecoverArgs),
    Evaluate(evaluate::EvaluateArgs),
    Relight(relight::RelightArgs),
    Inspect(inspect::InspectArgs),
    Verify(verify::VerifyArgs),
    Study(study::StudyArgs),
}

/// Parses the command line and runs it. Status: 0 done, 1 failed, 2 wrong usage, 130 told to stop.
pub fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Simulate(args) => simulate::run(&args),
        Command::Recover(args) => recover::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Relight(args) => relight::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Verify(args) => verify::run(&args),
        Command::Study(args) => study::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is::<process::Interrupted>() => {
            eprintln!("{error:#}");
            ExitCode::from(process::INTERRUPTED)
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            if error.is::<Usage>() {
                ExitCode::from(2)
            } else {
                ExitCode::FAILURE
            }
        }
    }
}

/// Options that each are fine, but not together.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Usage(&'static str);

/// Parses a number from `least` to `most`.
fn number_in(text: &str, least: f32, most: f32) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => Err(format!("it must be a number from {least} to {most}")),
    }
}
