//! Writing files: complete or not at all, and never over a file of another format.

use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use tempfile::NamedTempFile;

/// How the names of temporary files begin.
pub const TEMPORARY_PREFIX: &str = ".ltm-export-";

/// A builder of temporary files or folders with the permissions of ordinary ones (`mode` minus the umask, not
/// tempfile's private default), and the folder of `path` to create them in.
pub fn temporary_beside(path: &Path, mode: u32) -> (tempfile::Builder<'static, 'static>, &Path) {
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY_PREFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = mode;
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    (builder, folder)
}

/// The error without the name of a temporary file.
pub fn without_path(error: io::Error) -> io::Error {
    match error.raw_os_error() {
        Some(code) => io::Error::from_raw_os_error(code),
        None => error.kind().into(),
    }
}

#[derive(Debug)]
pub struct FileSignature {
    /// With its article.
    name: &'static str,
    /// The extension that paths must have if they have one.
    extension: Option<&'static str>,
    /// Bytes that files as this program writes them have at these offsets.
    signature: &'static [(usize, &'static [u8])],
}

pub const LTM: FileSignature = FileSignature {
    name: "an .ltm file",
    extension: None,
    signature: &[(0, b"\xABLTM")],
};
/// A picture: an 8-bit RGB PNG. Photographs have 16 bits.
pub const PNG: FileSignature = FileSignature {
    name: "a PNG",
    extension: Some("png"),
    signature: &[(0, b"\x89PNG"), (24, &[8, 2])],
};
/// A photograph: a 16-bit RGB PNG.
pub const PHOTOGRAPH: FileSignature = FileSignature {
    name: "a photograph",
    extension: Some("png"),
    signature: &[(0, b"\x89PNG"), (24, &[16, 2])],
};
/// The first bytes of every report.
pub const REPORT_START: &str = "<!doctype html><!--ltm-->";
/// A report as a page.
pub const HTML: FileSignature = FileSignature {
    name: "a report",
    extension: Some("html"),
    signature: &[(0, REPORT_START.as_bytes())],
};

impl FileSignature {
    /// Of files that may replace any other, as their names are this program's own.
    pub const fn of_own_name(name: &'static str) -> Self {
        Self {
            name,
            extension: None,
            signature: &[],
        }
    }

    /// Whether `path` is free, empty, or holds a file of this format as this program writes it.
    fn may_replace(&self, path: &Path) -> io::Result<bool> {
        let file = match File::open(path) {
            Ok(file) => file,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(true),
            Err(e) => return Err(e),
        };
        let mut start = Vec::new();
        file.take(26).read_to_end(&mut start)?;
        let has = |(at, bytes): &(usize, &[u8])| {
            start.get(*at..).is_some_and(|rest| rest.starts_with(bytes))
        };
        Ok(start.is_empty() || self.signature.iter().all(has))
    }
}

/// An error in reading an input while an output is written. It names the input.
#[derive(Debug, thiserror::Error)]
#[error("{0:#}")]
pub struct InputError(pub anyhow::Error);

impl InputError {
    /// The error without the name of the output, if it is one of the input.
    pub fn without_output(error: anyhow::Error) -> anyhow::Error {
        match error.downcast() {
            Ok(Self(cause)) => cause,
            Err(error) => error,
        }
    }
}

/// A file that is written under a temporary name beside its path and renamed when complete, so that the path never
/// holds a partial file. It replaces a file of the same format only: any other is probably an input, given as output by
/// mistake.
pub struct OutputFile {
    path: PathBuf,
    file: NamedTempFile,
}

impl OutputFile {
    /// Creates the temporary file, so that a path that cannot be written fails before the work is done.
    pub fn create(path: &Path, format: &FileSignature) -> Result<Self> {
        let name = format.name;
        let create = || -> Result<NamedTempFile> {
            ensure!(
                !path.exists() || path.is_file(),
                "is a folder or a device; give the name of a file"
            );
            ensure!(
                format.may_replace(path).context("cannot be read")?,
                "exists and is not {name} written by this program; give another name"
            );
            let extensions = path.extension().zip(format.extension);
            ensure!(
                extensions.is_none_or(|(given, own)| given.eq_ignore_ascii_case(own)),
                "{name} is written; give a name with its extension"
            );
            let (builder, folder) = temporary_beside(path, 0o666);
            builder
                .tempfile_in(folder)
                .map_err(without_path)
                .context("cannot be created; does its folder exist, and may you write there?")
        };
        let file = create().with_context(|| path.display().to_string())?;
        Ok(Self {
            path: path.to_owned(),
            file,
        })
    }

    /// As [`finish`](Self::finish), but an [`InputError`] of `write` does not name the output.
    pub fn finish_from_input(
        self,
        write: impl FnOnce(&mut BufWriter<&mut File>) -> Result<()>,
    ) -> Result<u64> {
        self.finish(write).map_err(InputError::without_output)
    }

    /// Writes the file and renames it to its path. Returns its length.
    pub fn finish(
        mut self,
        write: impl FnOnce(&mut BufWriter<&mut File>) -> Result<()>,
    ) -> Result<u64> {
        let finish = || -> Result<u64> {
            let mut out = BufWriter::new(self.file.as_file_mut());
            write(&mut out)?;
            out.flush().context("cannot be written")?;
            drop(out);
            let file = self.file.as_file();
            // On disk before it replaces another file, and before its checkpoint is deleted.
            file.sync_all().context("cannot be written")?;
            let bytes = file.metadata().context("cannot be read back")?.len();
            let renamed = self.file.persist(&self.path).map_err(|e| e.error);
            renamed.context("cannot be renamed")?;
            Ok(bytes)
        };
        finish().with_context(|| self.path.display().to_string())
    }
}
