//! Where a file comes from: hashes of all files, what the manifest says beyond what is used, and how it was photographed.

use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;
use serde_json::Value;

use crate::capture::CaptureFolder;
use crate::cli::file_hash::{HashedFile, checksum_lines, hash_capture, hash_file, sha256};
use crate::cli::process_resources::InterruptibleCores;
use crate::cli::shoot::LOG_NAME;

/// Where a file comes from.
#[derive(Clone, Debug, Serialize)]
pub struct CaptureOrigin {
    /// Program and version that wrote this report.
    pub program: &'static str,
    pub file: HashedFile,
    /// The file's metadata: program, method, patterns, and the shots that were used.
    pub metadata: Value,
    /// The manifest, with fields that are not used as well.
    pub manifest: Value,
    /// `shooting.json`, if the capture was photographed by `ltm-export shoot`.
    pub shooting: Option<Value>,
    /// The manifest, and everything that the recovery read.
    pub inputs: Vec<HashedFile>,
    /// Whether these are unchanged since then; null of files that do not say so.
    pub are_inputs_unchanged: Option<bool>,
}

impl CaptureOrigin {
    /// Of the file at `path` with this metadata.
    ///
    /// # Errors
    /// If a file cannot be read, or the command is interrupted.
    pub fn read(
        path: &Path,
        metadata: &str,
        used: &[usize],
        folder: &CaptureFolder,
        cores: &InterruptibleCores,
    ) -> Result<Self> {
        let log = folder.root().join(LOG_NAME);
        let shooting = match log.exists() {
            true => Some(read_json(&log)?),
            false => None,
        };
        let metadata: Value = serde_json::from_str(metadata)?;
        let inputs = hash_capture(folder, used, cores)?;
        let hash = sha256(checksum_lines(&inputs).as_bytes());
        let recorded = metadata["origin"]["inputs_sha256"].as_str();
        let are_inputs_unchanged = recorded.map(|recorded| recorded == hash);
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        Ok(Self {
            program: concat!("ltm-export ", env!("CARGO_PKG_VERSION")),
            file: hash_file(path, name.into_owned())?,
            metadata,
            manifest: read_json(&folder.manifest_path())?,
            shooting,
            inputs,
            are_inputs_unchanged,
        })
    }
}

fn read_json(path: &Path) -> Result<Value> {
    let read = || -> Result<Value> { Ok(serde_json::from_str(&std::fs::read_to_string(path)?)?) };
    read().with_context(|| path.display().to_string())
}
