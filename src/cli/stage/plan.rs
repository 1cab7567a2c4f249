//! `plan.json`: the options of a recovery, and what identifies its photographs.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, Result};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::stage_folder::{StageFileProblem, StageFolder};
use crate::capture::{CaptureError, CaptureErrorKind, CaptureFolder, MANIFEST_NAME};
use crate::cli::file_hash::sha256;
use crate::cli::output_file::{FileSignature, OutputFile};
use crate::cli::process_resources::InterruptibleCores;
use crate::cli::recover::args::RecoveryOptions;
use crate::cli::recover::checkpoint_key::{FileDigest, PROGRAM, file_digests};
use crate::cli::recover::inputs::RecoveryInputs;
use crate::job_executor::Executor;
use crate::transport::Window;

const PLAN: FileSignature = FileSignature::of_own_name("a plan");

/// How a capture is compared with the one that was planned.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// Its manifest, the records of photographs that were ingested, and the lengths of its other files.
    Records,
    /// All files whole; of photographs that were ingested, the records.
    Contents,
}

/// The plan of a recovery.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecoveryPlan {
    /// Name and version of the program.
    program: String,
    /// SHA-256 of the fields that the file depends on.
    pub id: String,
    /// The capture folder.
    pub capture: PathBuf,
    pub options: RecoveryOptions,
    /// The files that the recovery reads, by their names in the manifest.
    files: BTreeMap<String, FileDigest>,
}

impl RecoveryPlan {
    /// Plans a recovery. Reads all its files; of photographs that were ingested, the records.
    ///
    /// # Errors
    /// If one cannot be read, and if the executor is cancelled.
    pub fn new(inputs: &RecoveryInputs<'_>, cores: &InterruptibleCores) -> Result<Self> {
        let root = inputs.folder.root();
        let mut plan = Self {
            program: PROGRAM.to_owned(),
            id: String::new(),
            capture: std::path::absolute(root).with_context(|| root.display().to_string())?,
            options: inputs.options.clone(),
            files: file_digests(inputs, cores)?,
        };
        plan.id = plan.computed_id()?;
        Ok(plan)
    }

    fn computed_id(&self) -> Result<String> {
        let identity = (&self.program, &self.options, &self.files);
        Ok(sha256(&serde_json::to_vec(&identity)?))
    }

    /// Number of files that the recovery reads.
    pub fn file_count(&self) -> usize {
        self.files.len()
    }

    /// Writes the plan, unless an equal one is there. Returns the plan of another recovery that it replaces, unless that one
    /// is damaged or of another version.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, stages: &StageFolder) -> Result<Option<Self>> {
        let earlier = Self::read(stages).ok();
        if earlier.as_ref() == Some(self) {
            return Ok(None);
        }
        let output = OutputFile::create(&stages.plan(), &PLAN)?;
        output.finish(|out| {
            serde_json::to_writer_pretty(&mut *out, self)?;
            Ok(writeln!(out)?)
        })?;
        // Another path of the same photographs is no other recovery.
        Ok(earlier.filter(|earlier| earlier.id != self.id))
    }

    /// # Errors
    /// [`StageFileError`](super::StageFileError) if it is missing, damaged or of another version of this program.
    pub fn read(stages: &StageFolder) -> Result<Self> {
        #[derive(Deserialize)]
        struct ProgramOnly {
            program: String,
        }

        let (path, remedy) = (
            stages.plan(),
            "\"ltm-export stage plan CAPTURE -o FOLDER\"".to_owned(),
        );
        stages.check_is_no_capture(&remedy)?;
        let text = stages.read(&path, &remedy)?;
        let damaged = || StageFileProblem::Damaged(remedy.clone()).of(&path);
        let ProgramOnly { program } = serde_json::from_slice(&text).map_err(|_| damaged())?;
        if program != PROGRAM {
            return Err(StageFileProblem::OtherProgram(program).of(&path).into());
        }
        let plan: Self = serde_json::from_slice(&text).map_err(|_| damaged())?;
        let is_window = |window: &Window| Window::new(window.side()).is_ok();
        let is_valid = plan.options.window.as_ref().is_none_or(is_window);
        match is_valid && plan.computed_id()? == plan.id {
            true => Ok(plan),
            false => Err(damaged().into()),
        }
    }

    /// Compares the capture with the one that was planned.
    ///
    /// # Errors
    /// [`StageFileError`](super::StageFileError) if a file has changed, and if one cannot be read or the executor is cancelled.
    pub fn check(
        &self,
        stages: &StageFolder,
        capture: &CaptureFolder,
        comparison: Comparison,
        cores: &InterruptibleCores,
    ) -> Result<()> {
        self.files.par_iter().try_for_each(|(name, planned)| {
            cores.check_cancelled()?;
            let path = capture.root().join(name);
            let is_compared_whole = name == MANIFEST_NAME || comparison == Comparison::Contents;
            let digest = match is_compared_whole {
                true => Some(FileDigest::of(&path)?),
                false => FileDigest::of_record(&path)?,
            };
            let is_same = match digest {
                Some(digest) => digest == *planned,
                None => {
                    let file = path.metadata();
                    let file = file.map_err(|e| CaptureError::new(&path, CaptureErrorKind::Io(e)));
                    file?.len() == planned.bytes
                }
            };
            if !is_same {
                let name = path.display().to_string();
                let changed = StageFileProblem::ChangedCapture(name);
                return Err(changed.of(&stages.plan()).into());
            }
            Ok(())
        })
    }
}
