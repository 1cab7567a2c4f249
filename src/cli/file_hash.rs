//! SHA-256 of the files of a capture. A capture that was ingested stands for the one that it was made from.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result};
use rayon::prelude::*;
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::ingested_manifest::{SOURCE_MANIFEST, is_of_source};
use super::process_resources::InterruptibleCores;
use super::progress;
use crate::capture::{CaptureFolder, IngestedPhotograph, MANIFEST_NAME};
use crate::job_executor::Executor;

const READ_BYTES: usize = 1 << 20;

/// A file, and what identifies its bytes.
#[derive(Clone, Debug, Serialize)]
pub struct HashedFile {
    /// As it is called in reports.
    pub path: String,
    pub bytes: u64,
    /// In hexadecimal digits.
    pub sha256: String,
}

/// Hashes the manifest of a capture, and the files that a recovery from `shots` reads, sorted by their paths. Of a
/// capture that was ingested, these are the files that it was made from, as their records say: the hash of all is the same.
///
/// # Errors
/// If a file cannot be read, or the command is interrupted.
pub fn hash_capture(
    folder: &CaptureFolder,
    shots: &[usize],
    cores: &InterruptibleCores,
) -> Result<Vec<HashedFile>> {
    let mut names = vec![MANIFEST_NAME.to_owned()];
    let read = folder.files(shots).into_iter();
    names.extend(read.map(|(name, _)| name.to_owned()));
    // Exposures of one pattern share it.
    names.sort();
    names.dedup();
    let bar = progress::bar("hashing", names.len());
    let hashed = names.into_par_iter().map(|name| -> Result<HashedFile> {
        cores.check_cancelled()?;
        let path = match name == MANIFEST_NAME && is_of_source(folder.root()) {
            true => folder.root().join(SOURCE_MANIFEST),
            false => folder.root().join(&name),
        };
        let ingested = IngestedPhotograph::read(&path).with_context(|| path.display().to_string());
        let hashed = match ingested? {
            Some(IngestedPhotograph { source, .. }) => HashedFile {
                path: source.name,
                bytes: source.bytes,
                sha256: source.sha256,
            },
            None => hash_file(&path, name)?,
        };
        bar.inc(1);
        Ok(hashed)
    });
    let mut hashed = hashed.collect::<Result<Vec<_>>>()?;
    hashed.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(hashed)
}

/// Lines as `sha256sum` writes them.
pub fn checksum_lines(files: &[HashedFile]) -> String {
    let line = |file: &HashedFile| format!("{}  {}\n", file.sha256, file.path);
    files.iter().map(line).collect()
}

/// The SHA-256 of `bytes` in hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

fn hexadecimal(digest: &[u8]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Hashes the file at `path`, which reports call `name`.
///
/// # Errors
/// If it cannot be read.
pub fn hash_file(path: &Path, name: String) -> Result<HashedFile> {
    let read = || -> Result<HashedFile> {
        let mut file = File::open(path)?;
        let mut hasher = Sha256::new();
        let mut buffer = vec![0; READ_BYTES];
        let mut bytes = 0;
        loop {
            let count = file.read(&mut buffer)?;
            if count == 0 {
                break;
            }
            hasher.update(&buffer[..count]);
            bytes += count as u64;
        }
        Ok(HashedFile {
            path: name,
            bytes,
            sha256: hexadecimal(&hasher.finalize()),
        })
    };
    read().with_context(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_those_of_the_standard() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("abc");
        std::fs::write(&path, "abc").unwrap();
        let hashed = hash_file(&path, "abc".to_owned()).unwrap();
        // FIPS 180-2, appendix B.1.
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!((hashed.sha256.as_str(), hashed.bytes), (expected, 3));
        assert_eq!(checksum_lines(&[hashed]), format!("{expected}  abc\n"));
        assert_eq!(sha256(b"abc"), expected);
        assert!(hash_file(&folder.path().join("none"), String::new()).is_err());
    }
}
