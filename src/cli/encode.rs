//! `ltm-export encode`: an `.ltm` file as one of several levels.

use std::io::{self, ErrorKind};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::{Context, Error, Result, bail, ensure};
use clap::Args;
use serde::Serialize;

use super::levels_output::{levels_of, write_levels};
use super::ltm_file::{open_ltm, read_range};
use super::output_file::{InputError, LTM, OutputFile};
use super::process_resources::{Interrupted, InterruptibleCores, peak_rss_bytes};
use super::progress;
use super::report::{format_bytes, print_json, print_line};
use crate::format::{ChunkId, FormatError, LevelTable};
use crate::pyramid::{PyramidLayout, PyramidSource, no_shard};

/// Write a large relightable photograph as one of several levels, of which viewers fetch the part and the level that are
/// seen
///
/// The element shows such a file from its coarsest level on. Its server must support range requests.
#[derive(Debug, Args)]
pub struct EncodeArgs {
    /// Relightable photograph of one level
    #[arg(value_name = "FILE.ltm")]
    file: PathBuf,
    /// File to write; its finest level decodes to the same values as FILE.ltm
    #[arg(short, long, value_name = "OUT.ltm")]
    output: PathBuf,
    /// Number of levels, each with half the pixels a side of the one before [default: down to at most 512 pixels, for
    /// photographs of more than 1024]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=12))]
    levels: Option<u32>,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct EncodeReport {
    levels: u32,
    /// Of all levels, with the root.
    shards: usize,
    seconds: f64,
    peak_rss_bytes: Option<u64>,
    file_bytes: u64,
    /// Bytes relative to those of the file of one level.
    size_ratio: f64,
}

pub fn run(args: &EncodeArgs) -> Result<()> {
    let start = Instant::now();
    let cores = InterruptibleCores::listen()?;
    let output = OutputFile::create(&args.output, &LTM)?;
    let name = || args.file.display().to_string();
    let (file, index) = open_ltm(&args.file)?;
    ensure!(
        !index.is_shard(),
        "{}: is a shard of a larger file, which has levels already",
        name()
    );
    if let Some(table) = LevelTable::read(&index).with_context(name)? {
        bail!("{}: has {} levels already", name(), table.levels());
    }
    let file = Mutex::new(file);
    let fetch = |chunk: ChunkId| {
        let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
        let bytes = read_range(&mut file, index.range(chunk));
        bytes.map_err(|error| FormatError::Source(io::Error::other(InputError(error))))
    };
    let camera = index.header.geometry.camera;
    let levels = levels_of(args.levels, camera).with_context(name)?;
    ensure!(
        levels > 1,
        "{}: has {camera} pixels, for which one level is best; give --levels if you want more",
        name()
    );
    let layout = PyramidLayout::of_levels(levels);
    let spinner = progress::spinner("coarsening");
    let mut shards = 1;
    let file_bytes = output.finish_from_input(|out| {
        let source = PyramidSource {
            index: &index,
            fetch: &fetch,
        };
        let written = write_levels(&args.output, source, &no_shard, layout, &cores, out);
        let table = written.map_err(|error| match error {
            FormatError::Write(_) | FormatError::Spool(_) => error.into(),
            FormatError::Source(e) if e.kind() == ErrorKind::Interrupted => {
                InputError(Interrupted("interrupted: nothing is written".to_owned()).into()).into()
            }
            other => Error::from(InputError(Error::new(other).context(name()))),
        })?;
        shards += table.shards().len();
        Ok(())
    })?;
    drop(spinner);
    let report = EncodeReport {
        levels,
        shards,
        seconds: start.elapsed().as_secs_f64(),
        peak_rss_bytes: peak_rss_bytes(),
        file_bytes,
        size_ratio: file_bytes as f64 / index.header.file_bytes as f64,
    };
    match args.json {
        true => print_json(&report),
        false => report.print(args),
    }
}

impl EncodeReport {
    fn print(&self, args: &EncodeArgs) -> Result<()> {
        print_line(&format!(
            "{}: {} levels in {} shards, {}, {:.2} times {}",
            args.output.display(),
            self.levels,
            self.shards,
            format_bytes(self.file_bytes),
            self.size_ratio,
            args.file.display()
        ))
    }
}
