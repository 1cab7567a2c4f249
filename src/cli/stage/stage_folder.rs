//! The folder that the stages of a recovery share.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, Error, Result};

use super::shard::Shard;
use crate::capture::MANIFEST_NAME;
use crate::cli::recover::checkpoint_key::PROGRAM;

/// A file of another stage that is missing, damaged or of other photographs.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct StageFileError {
    pub path: PathBuf,
    pub problem: StageFileProblem,
}

#[derive(Clone, Debug, thiserror::Error)]
pub enum StageFileProblem {
    #[error("is missing; {0} writes it")]
    Missing(String),
    #[error(
        "is missing, and there are packs of {found} shards: give that number, or {remedy} writes it"
    )]
    OtherCount { found: u32, remedy: String },
    #[error("is a capture, without a plan; give the folder that {0} writes")]
    IsCapture(String),
    #[error("is incomplete or damaged; {0} writes it again")]
    Damaged(String),
    #[error("is not of this {made_from}; {remedy} writes it again")]
    Foreign {
        made_from: &'static str,
        remedy: String,
    },
    #[error("was replaced while a shard was made from it; the same command makes the shard again")]
    Replaced,
    #[error("was changed while it was read; the same command reads it again")]
    ChangedWhileRead,
    #[error("was written by {0}, and this is {PROGRAM}; use one version for all stages")]
    OtherProgram(String),
    #[error(
        "{0} has changed since; bring the file back, or plan the recovery anew by \"ltm-export stage plan\""
    )]
    ChangedCapture(String),
}

impl StageFileError {
    /// Whether the same command may succeed later: once another stage has written the file, or with the file that is there
    /// now.
    pub fn may_pass(&self) -> bool {
        use StageFileProblem::{ChangedWhileRead, Missing, OtherCount, Replaced};
        let problem = &self.problem;
        matches!(
            problem,
            ChangedWhileRead | Missing(_) | OtherCount { .. } | Replaced
        )
    }
}

impl StageFileProblem {
    /// With the path of the file.
    pub fn of(self, path: &Path) -> StageFileError {
        StageFileError {
            path: path.to_owned(),
            problem: self,
        }
    }
}

/// Whether the error is that a stage has not written its file.
pub fn is_missing(error: &Error) -> bool {
    let stage_file = error.downcast_ref::<StageFileError>();
    stage_file.is_some_and(|e| matches!(e.problem, StageFileProblem::Missing(_)))
}

/// The folder.
pub struct StageFolder(PathBuf);

impl StageFolder {
    pub fn new(path: &Path) -> Self {
        Self(path.to_owned())
    }

    /// Creates it, and the folder of its shards.
    pub fn create(path: &Path) -> Result<Self> {
        let folder = Self::new(path);
        let shards = folder.shards();
        std::fs::create_dir_all(&shards).with_context(|| {
            format!(
                "{}: cannot be created; may you write there?",
                shards.display()
            )
        })?;
        Ok(folder)
    }

    /// If it is a capture folder: then no stage has written the plan that is missing.
    pub fn check_is_no_capture(&self, remedy: &str) -> Result<(), StageFileError> {
        let is_capture = self.0.join(MANIFEST_NAME).exists() && !self.plan().exists();
        match is_capture {
            true => Err(StageFileProblem::IsCapture(remedy.to_owned()).of(&self.0)),
            false => Ok(()),
        }
    }

    pub fn plan(&self) -> PathBuf {
        self.0.join("plan.json")
    }

    pub fn learned(&self) -> PathBuf {
        self.0.join("learned.bin")
    }

    pub fn shards(&self) -> PathBuf {
        self.0.join("shards")
    }

    /// The command of a stage, with its other `options`.
    pub fn command(&self, stage: &str, options: &str) -> String {
        format!("\"ltm-export stage {stage} {}{options}\"", self.0.display())
    }

    /// Whether `learned.bin` has the id that a shard was made with: the `current` id is the `used` one.
    ///
    /// # Errors
    /// [`StageFileError`] if it is not.
    pub fn check_learned(&self, used: &str, current: &str) -> Result<(), StageFileError> {
        match used == current {
            true => Ok(()),
            false => Err(StageFileProblem::Replaced.of(&self.learned())),
        }
    }

    /// Reads a file of another stage; `remedy` is the command that writes it.
    ///
    /// # Errors
    /// If it is missing or cannot be read.
    pub fn read(&self, path: &Path, remedy: &str) -> Result<Vec<u8>> {
        match std::fs::read(path) {
            Err(e) if e.kind() == ErrorKind::NotFound => {
                Err(StageFileProblem::Missing(remedy.to_owned()).of(path).into())
            }
            bytes => bytes.with_context(|| path.display().to_string()),
        }
    }

    pub fn pack(&self, shard: Shard) -> PathBuf {
        self.shards().join(format!("{}.pack", shard.file_stem()))
    }

    /// Of how many shards packs are there, if it is another number than that of `shard`.
    pub fn other_count(&self, shard: Shard) -> Option<u32> {
        let entries = std::fs::read_dir(self.shards()).ok()?;
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let counts = names.filter_map(|name| {
            let (_, count) = name.strip_suffix(".pack")?.split_once("-of-")?;
            count.parse().ok()
        });
        counts.filter(|count| *count != shard.count()).min()
    }

    pub fn levels(&self, shard: Shard) -> PathBuf {
        self.shards().join(format!("{}.levels", shard.file_stem()))
    }
}
