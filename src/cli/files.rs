//! Reading and writing files whole.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, ensure};
use tempfile::NamedTempFile;

use super::memory::Bytes;
use crate::format::{FormatError, HEADER_BYTES, Head, Interest, Limits, Part, Reader};
use crate::transport::Transport;

/// Bytes read at a time.
const PIECE: usize = 1 << 20;
/// A workstation has more memory than a browser tab.
const LIMITS: Limits = Limits {
    decoded_bytes: 16 << 30,
};

/// What was read of an `.ltm` file.
pub struct LtmFile {
    pub head: Head,
    pub transport: Transport,
    /// Bytes read, and scans that are whole for every tile.
    pub bytes: u64,
    pub scans: usize,
}

/// Reads and checks an `.ltm` file, or of its beginning as much as `first` says.
pub fn read_ltm(path: &Path, first: Option<Share>) -> Result<LtmFile> {
    let read = || -> Result<LtmFile> {
        let file = open(path)?;
        let length = file.metadata().context("cannot be read")?.len();
        let most = first.map_or(u64::MAX, |first| first.of(length));
        let mut reader = Reader::new(LIMITS);
        let fed = feed(&mut reader, file.take(most));
        let Some(head) = reader.head().cloned() else {
            fed?;
            ensure!(
                most >= length,
                "the first {most} bytes end within its head; give --first more"
            );
            return Err(reader.cut_short().into());
        };
        let progress = reader.progress();
        let transport = fed.and_then(|()| match first {
            Some(_) => Ok(reader.finish_early()?),
            None => Ok(reader.finish()?),
        });
        let (transport, _) = transport.map_err(|error| match sound_bytes(&head, &error) {
            Some(sound) if sound > head.header.head_bytes() => {
                anyhow!("{error:#} (--first {sound} shows what comes before)")
            }
            _ => error,
        })?;
        Ok(LtmFile {
            head,
            transport,
            bytes: progress.bytes,
            scans: progress.scans,
        })
    };
    read().with_context(|| path.display().to_string())
}

fn feed(reader: &mut Reader, mut file: impl Read) -> Result<()> {
    let mut piece = vec![0; PIECE];
    let mut offset = 0;
    loop {
        let n = file.read(&mut piece).context("cannot be read")?;
        if n == 0 {
            return Ok(());
        }
        reader.feed(offset, &piece[..n])?;
        offset += n as u64;
    }
}

/// Bytes before what an error is of, where that is known.
fn sound_bytes(head: &Head, error: &anyhow::Error) -> Option<u64> {
    match error.downcast_ref::<FormatError>()? {
        FormatError::Truncated { got, .. } => Some(*got),
        FormatError::Checksum { part } | FormatError::Decompress { part, .. } => {
            let bad = head.parts().find(|&number| Part::from(number) == *part);
            bad.map(|number| head.range(number).start)
        }
        _ => None,
    }
}

/// Opens an `.ltm` file as far as its head.
pub fn open_ltm(path: &Path) -> Result<(File, Head)> {
    let read = || -> Result<(File, Head)> {
        let mut file = open(path)?;
        let mut reader = Reader::new(LIMITS);
        loop {
            if let Some(head) = reader.head() {
                return Ok((file, head.clone()));
            }
            let wanted = reader.wants(&Interest::default()).into_iter().next();
            let wanted = wanted.unwrap_or_default();
            let piece = read_at(&mut file, wanted.clone())?;
            if piece.is_empty() {
                return Err(reader.cut_short().into());
            }
            // What the head does not need is not decoded.
            let head = reader.head_bytes().unwrap_or(HEADER_BYTES as u64);
            let useful = piece.len().min((head - wanted.start) as usize);
            reader.feed(wanted.start, &piece[..useful])?;
        }
    };
    read().with_context(|| path.display().to_string())
}

/// Bytes of a file from some place to another, or to its end.
pub fn read_at(file: &mut File, range: Range<u64>) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(range.start))
        .context("cannot be read")?;
    let part = file.take(range.end - range.start).read_to_end(&mut bytes);
    part.context("cannot be read")?;
    Ok(bytes)
}

fn open(path: &Path) -> Result<File> {
    ensure!(!path.is_dir(), "is a folder, not an .ltm file");
    File::open(path).context("cannot be opened")
}

/// How much of a file: so many bytes, or so many hundredths of it.
#[derive(Clone, Copy, Debug)]
pub enum Share {
    Bytes(u64),
    Percent(f64),
}

impl Share {
    /// Parses `20000`, `20K` or `10%`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.strip_suffix('%') {
            Some(number) => {
                let percent = number.parse::<f64>().map_err(|e| e.to_string())?;
                match (0.0..=100.0).contains(&percent) {
                    true => Ok(Self::Percent(percent)),
                    false => Err("give a number from 0% to 100%".to_owned()),
                }
            }
            None => Ok(Self::Bytes(Bytes::parse(text)?.0)),
        }
    }

    fn of(self, length: u64) -> u64 {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Percent(percent) => (length as f64 * percent / 100.0) as u64,
        }
    }
}

/// What makes temporary files or folders with the permissions of any new one (`mode` less the
/// umask, not tempfile's private default), and the folder to make them in to be beside `path`.
pub fn beside(path: &Path, mode: u32) -> (tempfile::Builder<'static, 'static>, &Path) {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".ltm-export-");
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

/// Kinds of file that commands write, told by how they begin.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// A relightable photograph.
    Ltm,
    /// A picture.
    Png,
}

impl Kind {
    fn signature(self) -> &'static [u8] {
        match self {
            Self::Ltm => b"\xABLTM",
            Self::Png => b"\x89PNG",
        }
    }

    /// Whether a path's ending is that of this kind, or none.
    fn fits(self, path: &Path) -> bool {
        let extension = match self {
            Self::Ltm => return true, // no other program writes these
            Self::Png => "png",
        };
        path.extension()
            .is_none_or(|own| own.eq_ignore_ascii_case(extension))
    }

    /// Whether `path` holds a file of this kind, as this program writes it, or nothing at all.
    fn may_replace(self, path: &Path) -> std::io::Result<bool> {
        let file = match File::open(path) {
            Ok(file) => file,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(true),
            Err(e) => return Err(e),
        };
        let mut start = Vec::new();
        file.take(26).read_to_end(&mut start)?;
        let ours = start.starts_with(self.signature())
            && match self {
                Self::Ltm => true,
                // Eight bits of red, green and blue: photographs have sixteen.
                Self::Png => start.get(24..) == Some(&[8, 2]),
            };
        Ok(start.is_empty() || ours)
    }
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Ltm => "an .ltm file",
            Self::Png => "a PNG",
        })
    }
}

/// A file to come: written beside its place and renamed there once whole, so that its path never
/// holds half of it. An existing file of the same kind is replaced; any other is somebody's photograph
/// or manifest, named by mistake.
pub struct Output {
    path: PathBuf,
    file: NamedTempFile,
}

impl Output {
    /// Makes sure that the file can be written, before any work is done for it.
    pub fn create(path: &Path, kind: Kind) -> Result<Self> {
        let create = || -> Result<NamedTempFile> {
            ensure!(
                !path.exists() || path.is_file(),
                "is a folder or a device; give the name of a file"
            );
            ensure!(
                kind.may_replace(path).context("cannot be looked at")?,
                "is there already and is not {kind} such as this writes; give another name"
            );
            ensure!(
                kind.fits(path),
                "{kind} is what is written; give a name that ends like one"
            );
            let (builder, folder) = beside(path, 0o666);
            builder
                .tempfile_in(folder)
                .map_err(|e| std::io::Error::from(e.kind())) // it names the temporary file
                .context("cannot be created; does its folder exist, and may you write there?")
        };
        let file = create().with_context(|| path.display().to_string())?;
        Ok(Self {
            path: path.to_owned(),
            file,
        })
    }

    /// Writes the file and puts it in its place. Returns its length.
    pub fn finish(
        mut self,
        write: impl FnOnce(&mut BufWriter<&mut File>) -> Result<()>,
    ) -> Result<u64> {
        let finish = || -> Result<u64> {
            let mut out = BufWriter::new(self.file.as_file_mut());
            write(&mut out)?;
            out.flush().context("cannot be written")?;
            drop(out);
            // On the disk before it takes its name, and before anything it was made from may go.
            let synced = self.file.as_file().sync_all();
            synced.context("cannot be written")?;
            let metadata = self.file.as_file().metadata();
            let bytes = metadata.context("cannot be read back")?.len();
            self.file
                .persist(&self.path)
                .map_err(|e| e.error)
                .context("cannot be put in place")?;
            Ok(bytes)
        };
        finish().with_context(|| self.path.display().to_string())
    }
}
