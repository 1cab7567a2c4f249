//! What the tiles of a recovery depend on. A checkpoint is resumed only with an equal key.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use crc32c::Crc32cReader;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::inputs::RecoveryInputs;
use crate::capture::{CaptureError, CaptureErrorKind, IngestedPhotograph};
use crate::cli::process_resources::{Interrupted, InterruptibleCores};
use crate::cli::value_parsers::value_name;
use crate::export::MemoryPlan;
use crate::job_executor::Executor;
use crate::recover::{HoldoutValidation, PreparedRecovery};
use crate::transport::Window;

/// Name and version of this program.
pub const PROGRAM: &str = concat!("ltm-export ", env!("CARGO_PKG_VERSION"));

/// Everything that determines the recovered tiles.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CheckpointKey {
    /// Name and version of the program.
    pub program: String,
    /// `--method`.
    pub method: String,
    /// `--basis`; of bpdn only.
    pub basis: Option<String>,
    /// `--window`; `None` for "auto".
    pub window: Option<u32>,
    /// `--patterns`, if given.
    pub patterns: Option<u32>,
    /// `--trust`.
    pub trust: String,
    /// `--no-register`.
    pub no_register: bool,
    /// The files read, by their names in the manifest.
    pub files: BTreeMap<String, FileDigest>,
    /// Number of tiles.
    pub tiles: usize,
}

impl CheckpointKey {
    /// The key of a recovery from `inputs`. Reads all their files.
    pub fn new(
        inputs: &RecoveryInputs<'_>,
        plan: &MemoryPlan,
        cores: &InterruptibleCores,
    ) -> Result<Self> {
        let options = inputs.options;
        let method = options.method();
        Ok(Self {
            program: PROGRAM.to_owned(),
            method: method.name().to_owned(),
            basis: method.basis().map(|basis| basis.name().to_owned()),
            window: options.window.map(Window::side),
            patterns: options.patterns,
            trust: value_name(options.trust),
            no_register: options.no_register,
            files: file_digests(inputs, cores)?,
            tiles: plan.tiles(),
        })
    }

    /// Describes the first difference between this key, of a checkpoint, and that of the present run.
    pub fn difference(&self, present: &Self) -> Option<String> {
        if self.program != present.program {
            let (was, is) = (&self.program, &present.program);
            return Some(format!("it was written by {was}, and this is {is}"));
        }
        let mut options = self.options().into_iter().zip(present.options());
        if let Some(((name, was), (_, is))) = options.find(|(was, is)| was != is) {
            return Some(format!("{name} was {was}, and is {is} now"));
        }
        let mut names = self.files.keys().chain(present.files.keys());
        if let Some(name) = names.find(|&name| self.files.get(name) != present.files.get(name)) {
            return Some(format!("{name} in the capture has changed since"));
        }
        (self.tiles != present.tiles).then(|| "the tiles differ".to_owned())
    }

    /// Names and values of the options.
    fn options(&self) -> [(&'static str, String); 6] {
        let text = |value: Option<String>, none: &str| value.unwrap_or_else(|| none.to_owned());
        let number = |value: Option<u64>, none| text(value.map(|value| value.to_string()), none);
        let no_register = if self.no_register {
            "given"
        } else {
            "not given"
        };
        [
            ("--method", self.method.clone()),
            ("--basis", text(self.basis.clone(), "not given")),
            ("--window", number(self.window.map(u64::from), "auto")),
            (
                "--patterns",
                number(self.patterns.map(u64::from), "not given"),
            ),
            ("--trust", self.trust.clone()),
            ("--no-register", no_register.to_owned()),
        ]
    }
}

/// Digests of all files that a recovery reads, by their names in the manifest.
///
/// # Errors
/// If one cannot be read, and if the executor is cancelled.
pub fn file_digests(
    inputs: &RecoveryInputs<'_>,
    cores: &InterruptibleCores,
) -> Result<BTreeMap<String, FileDigest>> {
    let digest = |(name, path): (&str, PathBuf)| -> Result<(String, FileDigest)> {
        let interrupted = || Interrupted("interrupted before anything was read".to_owned());
        ensure!(!cores.is_cancelled(), interrupted());
        Ok((name.to_owned(), FileDigest::of(&path)?))
    };
    let files = inputs.folder.files(&inputs.shots);
    files.into_par_iter().map(digest).collect()
}

/// Length and CRC-32C of a file; of a photograph that was ingested, the CRC-32C of its record, which has the checksums of its
/// strips.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileDigest {
    pub bytes: u64,
    crc: u32,
}

impl FileDigest {
    /// Reads the file, which is one of a capture.
    pub fn of(path: &Path) -> Result<Self, CaptureError> {
        if let Some(digest) = Self::of_record(path)? {
            return Ok(digest);
        }
        let read = || -> io::Result<Self> {
            let mut reader = Crc32cReader::new(File::open(path)?);
            let bytes = io::copy(&mut reader, &mut io::sink())?;
            let crc = reader.crc32c();
            Ok(Self { bytes, crc })
        };
        read().map_err(|e| CaptureError::new(path, CaptureErrorKind::Io(e)))
    }

    /// Reads the record of a photograph that was ingested; `None` of other files.
    pub fn of_record(path: &Path) -> Result<Option<Self>, CaptureError> {
        let record = IngestedPhotograph::read(path);
        let record = record.map_err(|e| CaptureError::new(path, CaptureErrorKind::Io(e)))?;
        Ok(record.map(|photograph| Self {
            bytes: photograph.bytes,
            crc: photograph.checksum,
        }))
    }
}

/// CRC-32C of what a recovery learned or chose: its geometry, basis, weight of the common mode, SNR on held-out patterns,
/// corrections of photographs, and the photographs that it leaves out. Another build or machine may learn different values
/// from the same photographs, and its tiles would not fit.
pub fn recovery_fingerprint(recovery: &PreparedRecovery) -> u32 {
    let geometry = recovery.geometry();
    let correspondence = geometry.correspondence.to_numbers().into_iter();
    let common_mode = recovery.common_mode().map(|mode| mode.weight());
    let validation = recovery.holdout_validation();
    let snr = validation.and_then(HoldoutValidation::snr);
    let chosen = [common_mode, snr.map(|snr| snr.0)].map(|value| value.unwrap_or(f64::NAN));
    let corrections = recovery.corrections().iter();
    let corrections = corrections.flat_map(|correction| {
        let [x, y] = correction.shift;
        [correction.scale, correction.offset, x, y]
    });
    let left_out = recovery.faults().iter().map(|fault| fault.0 as f64);
    let basis = recovery.basis().into_iter().flat_map(|b| b.kernels.iter());
    let bytes: Vec<u8> = geometry
        .sides()
        .into_iter()
        .flatten()
        .flat_map(u32::to_le_bytes)
        .chain(
            correspondence
                .chain(chosen)
                .chain(corrections)
                .chain(left_out)
                .flat_map(f64::to_le_bytes),
        )
        .chain(basis.flatten().flat_map(|value| value.to_le_bytes()))
        .collect();
    crc32c::crc32c(&bytes)
}
