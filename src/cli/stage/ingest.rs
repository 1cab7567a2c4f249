//! `ltm-export stage ingest`: a copy of a capture whose photographs are TIFFs, of which each stage reads its rows only.
//!
//! Every photograph has one source and one target, so that shards share nothing; whichever shard ends last writes the manifest.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Error, Result, bail, ensure};
use rayon::prelude::*;

use super::shard::Shard;
use crate::capture::{
    CaptureFolder, IngestError, IngestSource, IngestedPhotograph, ListedPhotograph, MANIFEST_NAME,
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

/// A file of the capture.
#[derive(Clone, Copy)]
struct IngestedFile<'a> {
    name: &'a str,
    /// To be written as TIFF; `None` for a copy.
    photograph: Option<ListedPhotograph<'a>>,
}

/// What a shard did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IngestCounts {
    /// Photographs and patterns that were written.
    pub written: usize,
    /// Those that were there.
    pub complete: usize,
    /// Those that other shards have not written yet; there is no manifest until none are.
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
        let mut files = BTreeMap::new();
        for (name, photograph) in photographs.chain(copies).chain(log) {
            let is_inside = |component| matches!(component, Component::Normal(_));
            ensure!(
                Path::new(name).components().all(is_inside),
                "{}: \"{name}\" is outside the folder; move the file into it first",
                capture.manifest_path().display()
            );
            let target = match photograph {
                Some(_) => tiff_name(name),
                None => name.to_owned(),
            };
            let file = IngestedFile { name, photograph };
            if let Some(other) = files
                .insert(target, file)
                .filter(|other| other.name != name)
            {
                bail!(
                    "{}: \"{}\" and \"{name}\" would have one name as TIFFs; rename one of them",
                    capture.manifest_path().display(),
                    other.name
                );
            }
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
        let manifest = IngestedManifest::of(self.capture)?;
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
        let folder = to.parent().unwrap_or(self.output);
        fs::create_dir_all(folder).with_context(|| {
            let folder = folder.display();
            format!("{folder}: cannot be created; may you write there?")
        })?;
        // Of a capture that was ingested, the record stays.
        let is_ingested = ingested(&from)?.is_some();
        let Some(photograph) = file.photograph.filter(|_| !is_ingested) else {
            return self.copy(&from, &to);
        };
        let hashed = hash_file(&from, file.name.to_owned())?;
        let source = IngestSource {
            name: hashed.path,
            bytes: hashed.bytes,
            sha256: hashed.sha256,
        };
        if to.exists() && ingested(&to)?.is_some_and(|there| there.source == source) {
            return Ok(false);
        }
        self.remove_manifest()?;
        let output = OutputFile::create(&to, &PHOTOGRAPH)?;
        output.finish_from_input(|out| {
            let ingest = self.capture.ingest(photograph, &source, out);
            ingest.map_err(|error| match error {
                IngestError::Input(error) => InputError(error.into()).into(),
                other => Error::new(other),
            })
        })?;
        Ok(true)
    }

    /// Whether a shard has written a file, of a source as long as the present one.
    fn is_there(&self, target: &str, file: IngestedFile<'_>) -> bool {
        let length = |path: PathBuf| path.metadata().ok().map(|file| file.len());
        let (from, to) = (
            self.capture.root().join(file.name),
            self.output.join(target),
        );
        match IngestedPhotograph::read(&to) {
            Ok(Some(there)) if there.source.name == file.name => {
                length(from) == Some(there.source.bytes)
            }
            _ => length(to).is_some_and(|bytes| length(from) == Some(bytes)),
        }
    }

    /// Copies a file, unless an equal one is there.
    fn copy(&self, from: &Path, to: &Path) -> Result<bool> {
        let hash = |path: &Path| Ok::<_, Error>(hash_file(path, String::new())?.sha256);
        if to.exists() && hash(from)? == hash(to)? {
            return Ok(false);
        }
        self.remove_manifest()?;
        let mut source = File::open(from).with_context(|| from.display().to_string())?;
        let output = OutputFile::create(to, &COPY)?;
        output.finish(|out| Ok(io::copy(&mut source, out).map(drop)?))?;
        Ok(true)
    }

    /// Removes the manifest, before a file of the copy changes: the copy is not whole until the manifest is written again.
    fn remove_manifest(&self) -> Result<()> {
        remove_if_there(&self.output.join(MANIFEST_NAME))
    }
}

/// The manifests of a copy.
struct IngestedManifest {
    /// As it is in the folder that was ingested first.
    source: String,
    /// With the names of the TIFFs.
    text: String,
}

impl IngestedManifest {
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

/// Creates the folder of the copy. What is in a folder that has the manifest of a source may be replaced.
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
    IngestedPhotograph::read(path).with_context(|| path.display().to_string())
}

fn remove_if_there(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => {
            Err(e).with_context(|| format!("{}: cannot be replaced", path.display()))
        }
        _ => Ok(()),
    }
}
