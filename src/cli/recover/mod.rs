//! `ltm-export recover`: a capture folder to an `.ltm` file.
//!
//! [`job`] reads the photographs, prepares a recovery, recovers its tiles into a [`checkpoint`] and encodes them.

pub(super) mod args;
pub(super) mod calibration;
pub(super) mod capture_sample;
mod checkpoint;
pub(super) mod checkpoint_key;
pub(super) mod findings;
pub(super) mod inputs;
mod job;
pub(super) mod ltm_writer;
pub(super) mod messages;
pub(super) mod origin;
pub(super) mod preparation;
pub(super) mod prepared_job;
pub(super) mod report;
pub(super) mod tile_recovery;

use std::time::Instant;

use anyhow::Result;

pub use self::args::{MethodName, RecoverArgs, TrustedCalibration, WindowArg, parse_window};
pub use self::checkpoint::CheckpointInUseError;
pub use self::messages::{FaultyPhotographsError, StrictError, UnusableError};
pub use self::report::RecoverReport;

use self::capture_sample::SampleSource;
use self::inputs::{RecoveryInputs, encoding_memory};
use self::job::RecoverJob;
use super::output_file::{LTM, OutputFile};
use super::process_resources::{InterruptibleCores, thread_pool};
use super::report::print_json;
use crate::capture::CaptureFolder;

pub fn run(args: &RecoverArgs) -> Result<()> {
    args.options.check()?;
    let cores = InterruptibleCores::listen()?;
    // An output that cannot be written fails before the work.
    drop(OutputFile::create(&args.output, &LTM)?);
    let folder = CaptureFolder::open(&args.capture)?;
    let report = recover(args, &folder, &cores)?;
    match args.json {
        true => print_json(&report),
        false => report.print(&args.output, folder.manifest()),
    }
}

/// Recovers `folder`, the capture of `args`, and writes the file.
pub fn recover(
    args: &RecoverArgs,
    folder: &CaptureFolder,
    cores: &InterruptibleCores,
) -> Result<RecoverReport> {
    let start = Instant::now();
    let inputs = RecoveryInputs::new(folder, &args.options)?;
    let plan = inputs.memory_plan(args.memory)?;
    let job = RecoverJob {
        start,
        args,
        inputs: &inputs,
        source: SampleSource { plan: &plan, cores },
        encoding: encoding_memory(args.memory),
    };
    thread_pool(plan.tiles_at_once())?.install(|| job.run())
}
