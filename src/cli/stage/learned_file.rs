//! `learned.bin`: what is learned from a sample of the photographs, for all shards.
//!
//! The 8 bytes `LTMLRN02`, then two [records](crate::cli::records): the [`LearnedKey`] as JSON, and the
//! [`PreparedJob`] as MessagePack, compressed by zstd.

use std::io::Write;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use super::plan::RecoveryPlan;
use super::stage_folder::{StageFileProblem, StageFolder};
use crate::cli::file_hash::sha256;
use crate::cli::output_file::{FileSignature, OutputFile};
use crate::cli::records::{Record, RecordReader, encode_record};
use crate::cli::recover::checkpoint_key::PROGRAM;
use crate::cli::recover::inputs::RecoveryInputs;
use crate::cli::recover::prepared_job::PreparedJob;

const MAGIC: [u8; 8] = *b"LTMLRN02";
const LEARNED: FileSignature = FileSignature::of_own_name("what a recovery learned");
const ZSTD_LEVEL: i32 = 3;
/// Numbers of the records.
const KEY: u32 = 0;
const JOB: u32 = 1;

/// What the content depends on.
#[derive(PartialEq, Eq, Serialize, Deserialize)]
struct LearnedKey {
    /// Name and version of the program.
    program: String,
    /// The plan's id.
    plan: String,
}

/// The file.
pub struct LearnedFile {
    /// SHA-256 of what was learned: another build or machine may learn other values from the same photographs.
    pub id: String,
    pub job: PreparedJob,
}

impl LearnedFile {
    /// # Errors
    /// If the file cannot be written.
    pub fn write(stages: &StageFolder, plan: &RecoveryPlan, job: &PreparedJob) -> Result<()> {
        let key = serde_json::to_vec(&LearnedKey::of(plan))?;
        let job = zstd::bulk::compress(&job.to_bytes()?, ZSTD_LEVEL)
            .context("what was learned cannot be compressed")?;
        let records = [encode_record(KEY, &key)?, encode_record(JOB, &job)?];
        OutputFile::create(&stages.learned(), &LEARNED)?.finish(|out| {
            out.write_all(&MAGIC)?;
            Ok(records
                .iter()
                .try_for_each(|record| out.write_all(record))?)
        })?;
        Ok(())
    }

    /// Tries whether the file can be written, before the work.
    ///
    /// # Errors
    /// If it cannot be.
    pub fn try_output(stages: &StageFolder) -> Result<()> {
        OutputFile::create(&stages.learned(), &LEARNED).map(drop)
    }

    /// # Errors
    /// [`StageFileError`](super::StageFileError) if the file is missing, damaged or of another plan.
    pub fn read(
        stages: &StageFolder,
        plan: &RecoveryPlan,
        inputs: &RecoveryInputs<'_>,
    ) -> Result<Self> {
        let (path, remedy) = (stages.learned(), stages.command("learn", ""));
        let (key, content) = read_records(stages)?;
        if key != LearnedKey::of(plan) {
            let made_from = "plan";
            let foreign = StageFileProblem::Foreign { made_from, remedy };
            return Err(foreign.of(&path).into());
        }
        let job = zstd::decode_all(&content[..]).ok();
        let job = job.and_then(|bytes| PreparedJob::from_bytes(&bytes).ok());
        let job = job.filter(|job| job.is_of(inputs));
        Ok(Self {
            id: sha256(&content),
            job: job.ok_or_else(|| StageFileProblem::Damaged(remedy).of(&path))?,
        })
    }

    /// The id alone, of the file that is there now.
    ///
    /// # Errors
    /// [`StageFileError`](super::StageFileError) if it is missing or damaged.
    pub fn read_id(stages: &StageFolder) -> Result<String> {
        read_records(stages).map(|(_, content)| sha256(&content))
    }
}

/// The key and the compressed job.
fn read_records(stages: &StageFolder) -> Result<(LearnedKey, Vec<u8>)> {
    let (path, remedy) = (stages.learned(), stages.command("learn", ""));
    let bytes = stages.read(&path, &remedy)?;
    let damaged = || StageFileProblem::Damaged(remedy.clone()).of(&path);
    let records = bytes.strip_prefix(&MAGIC).ok_or_else(damaged)?;
    let mut records = RecordReader::new(records, 0, records.len() as u64);
    let mut next = |number| -> Result<Record> {
        let record = records.next()?;
        let record = record.filter(|record| record.is_intact && record.number == number);
        Ok(record.ok_or_else(damaged)?)
    };
    let key = serde_json::from_slice(&next(KEY)?.content).map_err(|_| damaged())?;
    Ok((key, next(JOB)?.content))
}

impl LearnedKey {
    fn of(plan: &RecoveryPlan) -> Self {
        Self {
            program: PROGRAM.to_owned(),
            plan: plan.id.clone(),
        }
    }
}
