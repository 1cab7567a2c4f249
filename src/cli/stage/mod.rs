//! `ltm-export stage`: the stages of a recovery one by one, for several machines.
//!
//! ```text
//! (PNGs ── ingest ── TIFFs)
//! capture ── plan ── learn ─┬─ tiles 1/n ─┬─ levels 1/n ─┬─ assemble ── .ltm
//!                           ├─ tiles 2/n ─┼─ levels 2/n ─┤
//!                           ⋮             ⋮              ⋮
//! ```
//!
//! `recover` is the same stages in one process. Every stage may be repeated: a file that is complete and follows from its
//! inputs stays, any other is written under a temporary name and renamed. Each names what it follows from, so that files of
//! another plan are told.

mod encoded_record;
mod encoded_tiles;
mod ingest;
mod learned_file;
mod level_packs;
mod pack;
mod pack_file;
mod partial_shards;
mod plan;
mod shard;
mod shard_packs;
mod shard_tiles;
pub(super) mod stage_folder;

use std::path::PathBuf;
use std::time::Instant;

use anyhow::Result;
use clap::{Args, Subcommand};

pub use self::ingest::IngestNameError;
pub use self::stage_folder::StageFileError;

use self::encoded_tiles::EncodedTiles;
use self::ingest::Ingestion;
use self::learned_file::LearnedFile;
use self::level_packs::{LevelPacks, level_key, level_shares};
use self::pack::Pack;
use self::partial_shards::PartialShard;
use self::plan::{Comparison, RecoveryPlan};
use self::shard::Shard;
use self::shard_packs::ShardPacks;
use self::shard_tiles::ShardTiles;
use self::stage_folder::StageFolder;
use super::levels_output::temporary_spool;
use super::output_file::{LTM, OutputFile};
use super::process_resources::{Interrupted, InterruptibleCores, cancelled_or, thread_pool};
use super::recover::args::{DEFAULT_MEMORY, RecoveryOptions};
use super::recover::capture_sample::SampleSource;
use super::recover::inputs::{RecoveryInputs, encoders, encoding_memory};
use super::recover::ltm_writer::{Destination, RecoveredTiles, finish};
use super::recover::prepared_job::PreparedJob;
use super::recover::tile_recovery::{TileCounts, TilePhotographs, TileRecovery};
use super::report::{print_json, print_line};
use super::value_parsers::ByteCount;
use crate::capture::{CaptureFolder, MANIFEST_NAME};
use crate::export;
use crate::job_executor::{Cancelled, Executor};
use crate::pyramid::{PyramidSource, make_coarser_shards};

/// What to do after a `--max-bytes` that is too low.
const TOO_LARGE_REMEDY: &str =
    "repeat the stages with a plan of a larger --max-bytes, or without --max-bytes";

/// Recover a capture stage by stage, on several machines
#[derive(Debug, Args)]
pub struct StageArgs {
    #[command(subcommand)]
    stage: Stage,
}

#[derive(Debug, Subcommand)]
enum Stage {
    Ingest(IngestArgs),
    Plan(PlanArgs),
    Learn(LearnArgs),
    Tiles(TilesArgs),
    Levels(LevelsArgs),
    Assemble(AssembleArgs),
}

/// Copy a capture; the photographs become TIFFs, of which the other stages read only the rows they need
#[derive(Debug, Args)]
struct IngestArgs {
    /// Capture folder: capture.json and the files it names
    capture: PathBuf,
    /// Folder of the copy; created if missing
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Which of how many shards of the files: 1/16 to 16/16. The shard that ends last writes capture.json
    #[arg(long, value_name = "I/N", default_value = "1/1", value_parser = Shard::parse)]
    shard: Shard,
}

/// Write plan.json: the options of a recovery, and what identifies its photographs
#[derive(Debug, Args)]
struct PlanArgs {
    /// Capture folder: capture.json and the files it names
    capture: PathBuf,
    /// Folder of the stages' files; created if missing
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    #[command(flatten)]
    options: RecoveryOptions,
}

/// Learn from a sample of the photographs what all tiles need, and write learned.bin
#[derive(Debug, Args)]
struct LearnArgs {
    #[command(flatten)]
    folders: Folders,
    /// Limit on memory
    #[arg(long, value_name = "BYTES", default_value = DEFAULT_MEMORY, value_parser = ByteCount::parse)]
    memory: ByteCount,
}

/// Recover one of several shards of the picture, and write shards/I-of-N.pack
#[derive(Debug, Args)]
struct TilesArgs {
    #[command(flatten)]
    folders: Folders,
    /// Which of how many shards: 1/16 to 16/16
    #[arg(long, value_name = "I/N", value_parser = Shard::parse)]
    shard: Shard,
    /// Limit on memory; photographs that do not fit are read in strips
    #[arg(long, value_name = "BYTES", default_value = DEFAULT_MEMORY, value_parser = ByteCount::parse)]
    memory: ByteCount,
}

/// Make one of several shares of a large picture's coarser levels, and write shards/I-of-N.levels. Without it `assemble` makes
/// them
#[derive(Debug, Args)]
struct LevelsArgs {
    #[command(flatten)]
    folders: Folders,
    /// Which of how many shares: as many as shards of tiles
    #[arg(long, value_name = "I/N", value_parser = Shard::parse)]
    shard: Shard,
    /// Limit on memory
    #[arg(long, value_name = "BYTES", default_value = DEFAULT_MEMORY, value_parser = ByteCount::parse)]
    memory: ByteCount,
}

/// Put the tiles of all shards together and write the file
#[derive(Debug, Args)]
struct AssembleArgs {
    #[command(flatten)]
    folders: Folders,
    /// Number of shards
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(shard::MAX_SHARDS)))]
    shards: u32,
    /// File to write
    #[arg(short, long, value_name = "FILE.ltm")]
    output: PathBuf,
    /// Limit on memory
    #[arg(long, value_name = "BYTES", default_value = DEFAULT_MEMORY, value_parser = ByteCount::parse)]
    memory: ByteCount,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct Folders {
    /// Folder of the stages' files, with plan.json
    folder: PathBuf,
    /// Capture folder, where it is not at the path in plan.json
    #[arg(long, value_name = "CAPTURE")]
    capture: Option<PathBuf>,
}

pub fn run(args: &StageArgs) -> Result<()> {
    if let Stage::Plan(args) = &args.stage {
        args.options.check()?;
    }
    let cores = InterruptibleCores::listen()?;
    let result = match &args.stage {
        Stage::Ingest(args) => ingest(args, &cores),
        Stage::Plan(args) => plan(args, &cores),
        Stage::Learn(args) => learn(args, &cores),
        Stage::Tiles(args) => tiles(args, &cores),
        Stage::Levels(args) => levels(args, &cores),
        Stage::Assemble(args) => assemble(args, &cores),
    };
    result.map_err(|error| match error.is::<Cancelled>() {
        true => Interrupted("interrupted; the same command begins this stage again".into()).into(),
        false => error,
    })
}

/// Whether the file of a stage is complete. A [`StageFileError`] means that it is not; other errors are returned.
fn is_complete<T>(read: Result<T>) -> Result<bool> {
    match read {
        Ok(_) => Ok(true),
        Err(error) if error.is::<StageFileError>() => Ok(false),
        Err(error) => Err(error),
    }
}

/// A plan, and the capture that it is of.
struct PlannedCapture {
    stages: StageFolder,
    plan: RecoveryPlan,
    capture: CaptureFolder,
}

impl PlannedCapture {
    /// The inputs of its recovery, and the content of `learned.bin`.
    ///
    /// # Errors
    /// Those of [`RecoveryInputs::new`] and [`LearnedFile::read`].
    fn learned(&self) -> Result<(RecoveryInputs<'_>, LearnedFile)> {
        let inputs = RecoveryInputs::new(&self.capture, &self.plan.options)?;
        let learned = LearnedFile::read(&self.stages, &self.plan, &inputs)?;
        Ok((inputs, learned))
    }

    /// Whether `learned.bin` still has this id: a plan that has changed meanwhile has files of its own.
    ///
    /// # Errors
    /// [`StageFileError`] if it has not.
    fn check_learned(&self, id: &str) -> Result<()> {
        let current = LearnedFile::read_id(&self.stages)?;
        Ok(self.stages.check_learned(id, &current)?)
    }
}

impl Folders {
    /// Reads the plan and opens its capture.
    ///
    /// # Errors
    /// If either cannot be read, and if the capture has changed since.
    fn open(&self, comparison: Comparison, cores: &InterruptibleCores) -> Result<PlannedCapture> {
        let stages = StageFolder::new(&self.folder);
        let plan = RecoveryPlan::read(&stages)?;
        let capture = self.capture.as_ref().unwrap_or(&plan.capture);
        let capture = CaptureFolder::open(capture)?;
        plan.check(&stages, &capture, comparison, cores)?;
        Ok(PlannedCapture {
            stages,
            plan,
            capture,
        })
    }
}

fn ingest(args: &IngestArgs, cores: &InterruptibleCores) -> Result<()> {
    let capture = CaptureFolder::open(&args.capture)?;
    let counts = Ingestion::new(&capture, &args.output)?.run(args.shard, cores)?;
    let (path, written, complete) = (args.output.display(), counts.written, counts.complete);
    let state = match counts.missing {
        0 => format!("{MANIFEST_NAME} is written"),
        missing => format!("other shards have {missing} to write before {MANIFEST_NAME}"),
    };
    print_line(&format!(
        "{path}: {written} files written, {complete} were complete; {state}"
    ))
}

fn plan(args: &PlanArgs, cores: &InterruptibleCores) -> Result<()> {
    let capture = CaptureFolder::open(&args.capture)?;
    let inputs = RecoveryInputs::new(&capture, &args.options)?;
    let stages = StageFolder::create(&args.output)?;
    let plan = RecoveryPlan::new(&inputs, cores)?;
    let replaced = plan.write(&stages)?;
    let (path, rows) = (stages.plan(), inputs.file_tile_rows());
    if let Some(earlier) = replaced {
        eprintln!(
            "note: {}: replaced the plan of {}, which has other options or photographs; what its stages wrote stays until they run again",
            path.display(),
            earlier.capture.display(),
        );
    }
    print_line(&format!(
        "{}: {} files of {}, to recover in at most {rows} shards",
        path.display(),
        plan.file_count(),
        capture.root().display(),
    ))
}

fn learn(args: &LearnArgs, cores: &InterruptibleCores) -> Result<()> {
    let PlannedCapture {
        stages,
        plan,
        capture,
    } = args.folders.open(Comparison::Contents, cores)?;
    let inputs = RecoveryInputs::new(&capture, &plan.options)?;
    if is_complete(LearnedFile::read(&stages, &plan, &inputs))? {
        return print_line(&format!("{}: is complete", stages.learned().display()));
    }
    // A folder that cannot be written fails before the work.
    LearnedFile::try_output(&stages)?;
    let memory = inputs.memory_plan(args.memory)?;
    let source = SampleSource {
        plan: &memory,
        cores,
    };
    let learn = || PreparedJob::learn(&inputs, source, || Ok(()), |_| Ok(()));
    let (job, _) = thread_pool(memory.tiles_at_once())?.install(learn)?;
    let snr = job.expected_snr();
    LearnedFile::write(&stages, &plan, &job)?;
    let snr = snr.map_or(String::new(), |snr| {
        format!(", predicts held-out patterns to {snr}")
    });
    print_line(&format!("{}: learned{snr}", stages.learned().display()))
}

fn tiles(args: &TilesArgs, cores: &InterruptibleCores) -> Result<()> {
    let planned = args.folders.open(Comparison::Records, cores)?;
    let stages = &planned.stages;
    // Copies of folders may lack empty ones.
    StageFolder::create(&args.folders.folder)?;
    let (inputs, LearnedFile { id, job }) = planned.learned()?;
    let geometry = job.recovery.geometry();
    let key = args.shard.pack_key(&id, &job);
    let path = stages.pack(args.shard);
    let verify = || Pack::open(&path, &key, "");
    let print_complete = || print_line(&format!("{}: is complete", path.display()));
    let recovered = args.shard.recovered_key(&id, geometry);
    let sink = PartialShard::open(stages, args.shard, &recovered)?;
    if is_complete(verify())? {
        sink.remove()?;
        return print_complete();
    }
    let memory = inputs.tiles_memory_plan(args.memory, geometry.window)?;
    // Before the long work.
    let encoders = match &job.coding {
        Some(_) => {
            let rank = job.rank().unwrap_or(0);
            encoders(encoding_memory(args.memory), geometry, 1, rank)?
        }
        None => 1,
    };
    sink.print_count();
    let source = SampleSource {
        plan: &memory,
        cores,
    };
    let recover = || {
        let photographs = TilePhotographs::of_capture(&planned.capture, &job)?;
        let recovery = TileRecovery { job: &job, source };
        recovery.run(photographs, args.shard.tile_rows(geometry), &sink)
    };
    let finished = thread_pool(memory.tiles_at_once())?
        .install(recover)
        .and_then(|counts| {
            planned.check_learned(&id)?;
            let tiles = ShardTiles {
                job: &job,
                recovered: &sink,
                cores,
            };
            let write = || pack_file::write(&path, &key, counts, |add| tiles.write(&key, add));
            thread_pool(encoders)?.install(write)
        });
    if let Err(error) = finished {
        // Another process may have finished the shard, and removed the partial packs.
        return match verify() {
            Ok(_) => {
                sink.remove()?;
                print_complete()
            }
            Err(_) => Err(sink.explain(error)),
        };
    }
    sink.remove()?;
    print_line(&format!(
        "{}: {} tiles of shard {}",
        path.display(),
        key.items.len(),
        args.shard
    ))
}

fn levels(args: &LevelsArgs, cores: &InterruptibleCores) -> Result<()> {
    let planned = args.folders.open(Comparison::Records, cores)?;
    let stages = &planned.stages;
    StageFolder::create(&args.folders.folder)?;
    let (inputs, LearnedFile { id, job }) = planned.learned()?;
    let shares = level_shares(&job, inputs.levels, args.shard.count())?;
    let key = level_key(args.shard, &id, shares.as_ref());
    let path = stages.levels(args.shard);
    if is_complete(Pack::open(&path, &key, ""))? {
        return print_line(&format!("{}: is complete", path.display()));
    }
    let (geometry, rank) = (job.recovery.geometry(), job.rank().unwrap_or(0));
    let total = shares.as_ref().map_or(0, |shares| shares.shards().len());
    let shares = shares.filter(|_| !key.items.is_empty());
    let encoders = match &shares {
        Some(_) => encoders(encoding_memory(args.memory), geometry, inputs.levels, rank)?,
        None => 1,
    };
    let make = |add: &mut dyn FnMut(u32, &[u8]) -> Result<()>| -> Result<()> {
        let (Some(coding), Some(shares)) = (&job.coding, &shares) else {
            return Ok(());
        };
        let process = args.shard.index();
        let rows = shares.rows(process);
        let shards = Shard::all(args.shard.count()).filter(|shard| shard.has_rows(&rows, geometry));
        let packs = ShardPacks::open(stages, &id, &job, shards, cores)?;
        let tiles = EncodedTiles {
            packs: &packs,
            plan: coding,
            levels: None,
            cores,
        };
        let metadata = job.metadata(&inputs.shots, inputs.options.method())?;
        let file = tiles.partial_file(export::file_geometry(&job.recovery), &metadata)?;
        let source = PyramidSource {
            index: file.index(),
            fetch: &|chunk| Ok(file.chunk(chunk)?.into_owned()),
        };
        let spools = [temporary_spool(&path)?, temporary_spool(&path)?];
        let add = |number: usize, file: Vec<u8>| add(number as u32, &file);
        make_coarser_shards(source, shares, process, spools, cores, add).map_err(cancelled_or)?;
        cores.check_cancelled()?;
        planned.check_learned(&id)
    };
    let write = || pack_file::write(&path, &key, TileCounts::default(), make);
    thread_pool(encoders)?.install(write)?;
    let content = match (key.items.len(), total) {
        (_, 0) => "is empty; \"assemble\" makes all levels of this picture".to_owned(),
        (0, _) => format!("is empty; other shares have all {total} shards of coarser levels"),
        (count, _) => format!("{count} of {total} shards of coarser levels"),
    };
    print_line(&format!("{}: {content}", path.display()))
}

fn assemble(args: &AssembleArgs, cores: &InterruptibleCores) -> Result<()> {
    let start = Instant::now();
    drop(OutputFile::create(&args.output, &LTM)?);
    let planned = args.folders.open(Comparison::Contents, cores)?;
    let stages = &planned.stages;
    let (inputs, LearnedFile { id, mut job }) = planned.learned()?;
    job.findings.print_further();
    let packs = ShardPacks::open(stages, &id, &job, Shard::all(args.shards), cores)?;
    let levels = level_shares(&job, inputs.levels, args.shards)?
        .map(|shares| LevelPacks::open(stages, &id, shares, args.shards, cores))
        .transpose()?;
    let destination = Destination {
        output: &args.output,
        memory: encoding_memory(args.memory),
        cores,
        too_large_remedy: TOO_LARGE_REMEDY,
    };
    let counts = packs.counts();
    let report = match job.coding.clone() {
        Some(plan) => {
            let tiles = EncodedTiles {
                packs: &packs,
                plan: &plan,
                levels: levels.as_ref(),
                cores,
            };
            finish(start, &inputs, job, counts, &destination, &tiles)?
        }
        None => {
            let record = |i| packs.read(i);
            let tiles = RecoveredTiles(&record);
            finish(start, &inputs, job, counts, &destination, &tiles)?
        }
    };
    match args.json {
        true => print_json(&report),
        false => report.print(&args.output, planned.capture.manifest()),
    }
}
