//! What the metadata of a file says of its origin.

use std::path::Path;

use anyhow::Result;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::capture::{CaptureFolder, ManifestCamera, NoiseModel};
use crate::cli::file_hash::{checksum_lines, hash_capture, sha256};
use crate::cli::process_resources::InterruptibleCores;
use crate::cli::shoot::LOG_NAME;
use crate::transport::Decibels;

/// Longest text of the manifest's own notes: metadata come before the picture.
const MAX_NOTES_BYTES: usize = 2048;

/// The origin of a file; see docs/format.md. The same command writes the same.
#[derive(Serialize, Deserialize)]
pub struct FileOrigin {
    /// SHA-256 of the lines that `sha256sum` writes of the manifest and the files that the recovery reads, sorted by their paths;
    /// of a capture that was ingested, of the files that it was made from.
    inputs_sha256: String,
    window: u32,
    camera: ManifestCamera,
    /// Estimated variances of the measurements.
    noise: NoiseModel,
    /// SNR on held-out patterns, of the transport before it was encoded.
    #[serde(skip_serializing_if = "Option::is_none")]
    expected_snr_db: Option<Decibels>,
    /// When the first and the last photograph were taken, if `ltm-export shoot` took them.
    #[serde(skip_serializing_if = "Option::is_none")]
    photographed: Option<[String; 2]>,
    /// The manifest's own notes, as text: numbers and depths are not limited there.
    #[serde(skip_serializing_if = "Option::is_none")]
    notes: Option<String>,
}

/// What a recovery knows of its input.
pub struct OriginInput<'a> {
    pub folder: &'a CaptureFolder,
    /// Indices of the shots that it reads.
    pub shots: &'a [usize],
    pub window: u32,
    pub noise: NoiseModel,
    pub expected_snr_db: Option<Decibels>,
}

impl FileOrigin {
    /// # Errors
    /// If a file cannot be read, or the command is interrupted.
    pub fn new(input: &OriginInput, cores: &InterruptibleCores) -> Result<Self> {
        let folder = input.folder;
        Ok(Self {
            inputs_sha256: inputs_sha256(folder, input.shots, cores)?,
            window: input.window,
            camera: folder.manifest().camera.clone(),
            noise: input.noise,
            expected_snr_db: input.expected_snr_db,
            photographed: photographed(&folder.root().join(LOG_NAME)),
            notes: notes(folder),
        })
    }
}

/// What identifies the inputs of a recovery from `shots`.
///
/// # Errors
/// If a file cannot be read, or the command is interrupted.
pub fn inputs_sha256(
    folder: &CaptureFolder,
    shots: &[usize],
    cores: &InterruptibleCores,
) -> Result<String> {
    let inputs = checksum_lines(&hash_capture(folder, shots, cores)?);
    Ok(sha256(inputs.as_bytes()))
}

/// From the log of a session, if there is one.
fn photographed(path: &Path) -> Option<[String; 2]> {
    let log = read_json(path)?;
    let photographs = log["photographs"].as_array()?.iter();
    let mut taken: Vec<&str> = photographs
        .filter_map(|photo| photo["taken"].as_str())
        .collect();
    taken.sort_unstable();
    let ends = taken.first().zip(taken.last());
    ends.map(|(first, last)| [first, last].map(|time| (*time).to_owned()))
}

/// What the manifest says for the laboratory.
fn notes(folder: &CaptureFolder) -> Option<String> {
    let path = folder.manifest_path();
    let notes = match read_json(&path)?.get("notes")? {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    if notes.len() > MAX_NOTES_BYTES {
        eprintln!(
            "note: {}: \"notes\" are longer than {MAX_NOTES_BYTES} bytes, and are not copied into the file",
            path.display()
        );
        return None;
    }
    Some(notes)
}

fn read_json(path: &Path) -> Option<Value> {
    serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()
}
