//! The command line: subcommands over the library, with the files, threads and terminal that the
//! library does not know of.

mod evaluate;
mod files;
mod inspect;
mod lights;
mod new_folder;
mod process;
mod recover;
mod relight;
mod report;
mod simulate;
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
}

/// Parses the command line and runs it. Status: 0 done, 1 failed, 2 wrong usage.
pub fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Simulate(args) => simulate::run(&args),
        Command::Recover(args) => recover::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Relight(args) => relight::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Verify(args) => verify::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
