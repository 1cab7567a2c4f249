//! `ltm-export recover`: a capture folder to an `.ltm` file.
//!
//! [`job`] reads the photographs, prepares a recovery, recovers its tiles into a [`checkpoint`] and encodes them.

mod args;
pub(super) mod calibration;
pub(super) mod capture_sample;
mod checkpoint;
mod checkpoint_key;
pub(super) mod findings;
mod job;
pub(super) mod messages;
pub(super) mod origin;
pub(super) mod preparation;
pub(super) mod report;

use std::time::Instant;

use anyhow::{Context, Result, bail};

pub use self::args::{MethodName, RecoverArgs, TrustedCalibration, WindowArg, parse_window};
pub use self::checkpoint::CheckpointInUseError;
pub use self::messages::{FaultyPhotographsError, StrictError, UnusableError};
pub use self::report::RecoverReport;

use self::capture_sample::SampleSource;
use self::job::{RecoverJob, encoded_components};
use super::levels_output::levels_of;
use super::output_file::{LTM, OutputFile};
use super::process_resources::{InterruptibleCores, thread_pool};
use super::report::print_json;
use super::value_parsers::UsageError;
use crate::capture::CaptureFolder;
use crate::export::{CaptureSize, MemoryPlan, TooLittleMemory, select_shots};
use crate::recover::{MIN_PATTERNS, RecoverError};

pub fn run(args: &RecoverArgs) -> Result<()> {
    if args.basis.is_some() && args.method().basis().is_none() {
        bail!(UsageError("--basis is for --method bpdn"));
    }
    let cores = InterruptibleCores::listen()?;
    // An output that cannot be written fails before the work.
    drop(OutputFile::create(&args.output, &LTM)?);
    let folder = CaptureFolder::open(&args.capture)?;
    let report = recover(args, &folder, &cores)?;
    match args.json {
        true => print_json(&report),
        false => report.print(args, folder.manifest()),
    }
}

/// Recovers `folder`, the capture of `args`, and writes the file.
pub fn recover(
    args: &RecoverArgs,
    folder: &CaptureFolder,
    cores: &InterruptibleCores,
) -> Result<RecoverReport> {
    let start = Instant::now();
    let manifest = folder.manifest();
    let shots = select_shots(&manifest.shots, args.patterns.map(|k| k as usize))
        .map_err(messages::too_few_shots)?;
    if shots.len() < MIN_PATTERNS {
        if let Some(patterns) = args.patterns {
            bail!("--patterns is {patterns}, but recovery needs at least {MIN_PATTERNS}");
        }
        let manifest = folder.manifest_path().display().to_string();
        return Err(RecoverError::TooFewPatterns(shots.len())).context(manifest);
    }
    let method = args.method();
    let capture = CaptureSize {
        camera: manifest.camera.extent(),
        light: manifest.light.extent(),
        shots: shots.len(),
        gray_code: match manifest.correspondence {
            Some(_) => 0,
            None => manifest.graycode.len(),
        },
    };
    let (limit, threads) = (args.memory.0, rayon::current_num_threads());
    let levels = levels_of(args.levels, manifest.camera.extent());
    let levels = levels.with_context(|| folder.manifest_path().display().to_string())?;
    // The file of an estimated window may take more.
    let encoding = args.window.map_or(0, |window| {
        let components = encoded_components(levels, window, method.max_rank(window));
        MemoryPlan::min_encoding_bytes(capture.camera, window, components)
    });
    let plan = MemoryPlan::new(limit, capture, method, args.window, threads);
    let min = plan.as_ref().map_or_else(|error| error.min, |_| 0);
    let plan = match plan {
        Ok(plan) if limit >= encoding => plan,
        _ => {
            let min = min.max(encoding);
            return Err(messages::too_little_memory(TooLittleMemory { limit, min }));
        }
    };
    let job = RecoverJob {
        start,
        args,
        folder,
        shots: &shots,
        levels,
        source: SampleSource { plan: &plan, cores },
    };
    thread_pool(plan.tiles_at_once())?.install(|| job.run())
}
