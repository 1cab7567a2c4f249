//! `ltm-export stage ingest`: copies a capture. The photographs of the copy are TIFFs, whose tiles can be read one by one.
//!
//! A shard writes every Nth file; the shard that ends last writes the manifest.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};
use std::time::SystemTime;

use anyhow::{Context, Error, Result, bail, ensure};
use rayon::prelude::*;

use super::shard::Shard;
use super::stage_folder::StageFileProblem;
use crate::capture::{
    CaptureError, CaptureErrorKind, CaptureFolder, IngestError, IngestSource, IngestedPhotograph,
    ListedPhotograph, MANIFEST_NAME,
};
use crate::cli::file_hash::hash_file;
use crate::cli::ingested_manifest::{SOURCE_MANIFEST, ingested_manifest, is_of_source, tiff_name};
use crate::cli::output_file::{FileSignature, InputError, OutputFile, TEMPORARY_PREFIX};
use crate::cli::process_resources::InterruptibleCores;
use crate::cli::progress;
use crate::cli::shoot::LOG_NAME;
use crate::job_executor::Executor;

const PHOTOGRAPH: FileSignature = FileSignature::of_own_name("a photograph");
const COPY: FileSignature = FileSignature::of_own_name("a copy");
const MANIFEST: FileSignature = FileSignature::of_own_name("a manifest");

/// A capture, and the folder of its copy.
pub struct Ingestion<'a> {
    capture: &'a CaptureFolder,
    output: &'a Path,
    /// By their names in the copy.
    files: BTreeMap<String, IngestedFile<'a>>,
}

/// A name in a manifest for which the copy has no file.
#[derive(Debug, thiserror::Error)]
#[error("{}: \"{name}\" {fault}", manifest.display())]
pub struct IngestNameError {
    manifest: PathBuf,
    name: String,
    fault: NameFault,
}

#[derive(Debug, thiserror::Error)]
enum NameFault {
    #[error("is outside the folder; move the file into it")]
    Outside,
    #[error("is the name of a manifest; rename the file")]
    Reserved,
    #[error("and \"{0}\" would have one name as TIFFs; rename one of them")]
    Shared(String),
}

/// A file of the capture.
#[derive(Clone, Copy)]
struct IngestedFile<'a> {
    name: &'a str,
    /// To be written as TIFF; `None` for a copy.
    photograph: Option<ListedPhotograph<'a>>,
}

/// Numbers of files: photographs, patterns and the shooting log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IngestCounts {
    /// Written by this shard.
    pub written: usize,
    /// Of this shard, there already.
    pub complete: usize,
    /// Of other shards, not there yet. The manifest is written once there are none.
    pub missing: usize,
}

impl<'a> Ingestion<'a> {
    /// # Errors
    /// If the manifest names files outside the folder, or two that would have one name.
    pub fn new(capture: &'a CaptureFolder, output: &'a Path) -> Result<Self> {
        let manifest = capture.manifest();
        let photographs = manifest.photographs().into_iter();
        let photographs = photographs.map(|photograph| (photograph.name, Some(photograph)));
        let patterns = manifest.shots.iter();
        let copies = patterns.map(|shot| (shot.pattern.as_str(), None));
        let log = capture.root().join(LOG_NAME).exists();
        let log = log.then_some((LOG_NAME, None));
        let mut files: BTreeMap<String, IngestedFile<'_>> = BTreeMap::new();
        for (name, photograph) in photographs.chain(copies).chain(log) {
            let unusable = |fault| IngestNameError {
                manifest: capture.manifest_path(),
                name: name.to_owned(),
                fault,
            };
            let path = path_inside(name).ok_or_else(|| unusable(NameFault::Outside))?;
            let target = match photograph {
                Some(_) => tiff_name(&path),
                None => path.clone(),
            };
            if [MANIFEST_NAME, SOURCE_MANIFEST].contains(&target.as_str()) {
                bail!(unusable(NameFault::Reserved));
            }
            let other = files.get(&target).map(|file| file.name.to_owned());
            if let Some(other) = other.filter(|other| path_inside(other) != Some(path)) {
                bail!(unusable(NameFault::Shared(other)));
            }
            files.insert(target, IngestedFile { name, photograph });
        }
        Ok(Self {
            capture,
            output,
            files,
        })
    }

    /// Writes the files of `shard` that are not complete, and the manifest once all are.
    ///
    /// # Errors
    /// If a file cannot be read or written, if the output folder has other files, and if the executor is cancelled.
    pub fn run(&self, shard: Shard, cores: &InterruptibleCores) -> Result<IngestCounts> {
        let manifest = CopyManifest::of(self.capture)?;
        claim_folder(self.capture, self.output)?;
        write_text(&self.output.join(SOURCE_MANIFEST), &manifest.source)?;
        let path = self.output.join(MANIFEST_NAME);
        if !manifest.is_at(&path) {
            remove_if_there(&path)?;
        }
        let own: Vec<_> = shard.share(self.files.iter()).collect();
        let bar = progress::bar("ingesting", own.len());
        let written = own.par_iter().map(|(target, file)| -> Result<usize> {
            cores.check_cancelled()?;
            let is_written = self.write(target, **file)?;
            bar.inc(1);
            Ok(is_written.into())
        });
        let written = written.try_reduce(|| 0, |a, b| Ok(a + b))?;
        drop(bar);
        let is_there =
            |(target, file): &(&String, &IngestedFile<'_>)| self.is_there(target, **file);
        let missing = self.files.iter().filter(|file| !is_there(file)).count();
        if missing == 0 {
            write_text(&path, &manifest.text)?;
        }
        Ok(IngestCounts {
            written,
            complete: own.len() - written,
            missing,
        })
    }

    /// Writes a file, unless it is there. Returns whether it was written.
    fn write(&self, target: &str, file: IngestedFile<'_>) -> Result<bool> {
        let (from, to) = (
            self.capture.root().join(file.name),
            self.output.join(target),
        );
        let field = file.photograph.map(|photograph| photograph.role.field());
        let before = modified(&from).map_err(|error| CaptureError { field, ..error })?;
        let folder = to.parent().unwrap_or(self.output);
        fs::create_dir_all(folder).with_context(|| {
            let folder = folder.display();
            format!("{folder}: cannot be created; may you write there?")
        })?;
        // A photograph that was ingested keeps its record.
        let record = IngestedPhotograph::read_whole(&from);
        let is_ingested = record.map_err(|e| read_error(&from, e))?.is_some();
        let unchanged = || match modified(&from)? == before {
            true => Ok(()),
            false => Err(StageFileProblem::ChangedWhileRead.of(&from).into()),
        };
        match file.photograph.filter(|_| !is_ingested) {
            Some(photograph) => self.write_photograph(photograph, &from, &to, unchanged),
            None => self.copy(&from, &to, unchanged),
        }
    }

    /// Writes a photograph as TIFF, unless the TIFF of an equal file is there. The TIFF has its name only if the file is
    /// `unchanged` at its end.
    fn write_photograph(
        &self,
        photograph: ListedPhotograph<'_>,
        from: &Path,
        to: &Path,
        unchanged: impl Fn() -> Result<()>,
    ) -> Result<bool> {
        let hashed = hash_file(from, photograph.name.to_owned())?;
        let source = IngestSource {
            name: hashed.path,
            bytes: hashed.bytes,
            sha256: hashed.sha256,
        };
        if to.exists() && ingested(to)?.is_some_and(|there| there.source == source) {
            return Ok(false);
        }
        self.remove_manifest()?;
        let output = OutputFile::create(to, &PHOTOGRAPH)?;
        output.finish_from_input(|out| {
            let ingest = self.capture.ingest(photograph, &source, out);
            ingest.map_err(|error| match error {
                IngestError::Input(error) => InputError(error.into()).into(),
                other => Error::new(other),
            })?;
            unchanged().map_err(|error| InputError(error).into())
        })?;
        Ok(true)
    }

    /// Whether there is a file of the copy, made from a file as long as the present one.
    fn is_there(&self, target: &str, file: IngestedFile<'_>) -> bool {
        let length = |path: &Path| path.metadata().ok().map(|file| file.len());
        let (from, to) = (
            self.capture.root().join(file.name),
            self.output.join(target),
        );
        let record = |path: &Path| IngestedPhotograph::read_whole(path).ok().flatten();
        match (file.photograph, record(&to)) {
            (None, _) => length(&to).is_some_and(|bytes| length(&from) == Some(bytes)),
            (Some(_), None) => false,
            (Some(_), Some(there)) => match record(&from) {
                Some(original) => original == there,
                None => there.source.name == file.name && length(&from) == Some(there.source.bytes),
            },
        }
    }

    /// Copies a file, unless an equal one is there.
    fn copy(&self, from: &Path, to: &Path, unchanged: impl Fn() -> Result<()>) -> Result<bool> {
        let hash = |path: &Path| Ok::<_, Error>(hash_file(path, String::new())?.sha256);
        if to.exists() && hash(from)? == hash(to)? {
            return Ok(false);
        }
        self.remove_manifest()?;
        let mut source = File::open(from).map_err(|e| read_error(from, e))?;
        let output = OutputFile::create(to, &COPY)?;
        output.finish_from_input(|out| {
            io::copy(&mut source, out)?;
            unchanged().map_err(|error| InputError(error).into())
        })?;
        Ok(true)
    }

    /// Removes the manifest, before a file of the copy changes: the copy is not whole until the manifest is written again.
    fn remove_manifest(&self) -> Result<()> {
        remove_if_there(&self.output.join(MANIFEST_NAME))
    }
}

/// The manifest of a copy.
struct CopyManifest {
    /// The text of the source.
    source: String,
    /// With the names of the TIFFs.
    text: String,
}

impl CopyManifest {
    fn of(capture: &CaptureFolder) -> Result<Self> {
        let read =
            |path: &Path| fs::read_to_string(path).with_context(|| path.display().to_string());
        let (root, path) = (capture.root(), capture.manifest_path());
        Ok(match is_of_source(root) {
            true => Self {
                source: read(&root.join(SOURCE_MANIFEST))?,
                text: read(&path)?,
            },
            false => Self {
                source: read(&path)?,
                text: ingested_manifest(&path)?,
            },
        })
    }

    fn is_at(&self, path: &Path) -> bool {
        fs::read_to_string(path).is_ok_and(|there| there == self.text)
    }
}

/// Creates the folder of the copy. Files are replaced only in a folder that has the manifest of a source.
///
/// # Errors
/// If it has other files.
fn claim_folder(capture: &CaptureFolder, output: &Path) -> Result<()> {
    let claim = || -> Result<()> {
        fs::create_dir_all(output).context("cannot be created; may you write there?")?;
        let [from, to] = [capture.root(), output].map(Path::canonicalize);
        ensure!(from? != to?, "is the capture itself; give another folder");
        // Other shards begin with the same file.
        let is_temporary = |name: &str| name.starts_with(TEMPORARY_PREFIX);
        let mut is_empty = true;
        for entry in fs::read_dir(output)? {
            is_empty &= entry?.file_name().to_str().is_some_and(is_temporary);
        }
        ensure!(
            is_empty || output.join(SOURCE_MANIFEST).exists(),
            "is not empty, and this command did not write it; give another folder"
        );
        Ok(())
    };
    claim().with_context(|| output.display().to_string())
}

/// Writes a manifest, unless an equal one is there.
fn write_text(path: &Path, text: &str) -> Result<()> {
    if fs::read_to_string(path).is_ok_and(|there| there == text) {
        return Ok(());
    }
    let output = OutputFile::create(path, &MANIFEST)?;
    output.finish(|out| Ok(out.write_all(text.as_bytes())?))?;
    Ok(())
}

fn ingested(path: &Path) -> Result<Option<IngestedPhotograph>> {
    IngestedPhotograph::read_whole(path).with_context(|| path.display().to_string())
}

/// When a file of the capture was changed, and its length.
fn modified(path: &Path) -> Result<(SystemTime, u64), CaptureError> {
    let metadata = path.metadata();
    let read = metadata.and_then(|metadata| Ok((metadata.modified()?, metadata.len())));
    read.map_err(|e| read_error(path, e))
}

fn read_error(path: &Path, error: io::Error) -> CaptureError {
    CaptureError::new(path, CaptureErrorKind::of_opening(error))
}

/// A path relative to a folder, without `.` and doubled separators; `None` if it leads out of the folder.
fn path_inside(name: &str) -> Option<String> {
    let mut parts = Vec::new();
    for component in Path::new(name).components() {
        match component {
            Component::CurDir => {}
            Component::Normal(part) => parts.push(part.to_str()?),
            _ => return None,
        }
    }
    (!parts.is_empty()).then(|| parts.join("/"))
}

fn remove_if_there(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => {
            Err(e).with_context(|| format!("{}: cannot be replaced", path.display()))
        }
        _ => Ok(()),
    }
}
