//! Reading `.ltm` files: whole, a prefix, or the file index only.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::num::ParseFloatError;
use std::ops::Range;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::value_parsers::ByteCount;
use crate::format::{
    ChunkSelection, FileIndex, FormatError, HEADER_BYTES, Limits, LtmReader, ReadProgress,
    SectionName,
};
use crate::transport::Transport;

const READ_BYTES: usize = 1 << 20;
/// More than in browsers, as a workstation has more memory than a tab.
pub const LIMITS: Limits = Limits {
    decoded_bytes: 16 << 30,
};

/// An `.ltm` file, or a prefix of one.
pub struct LtmFile {
    pub index: FileIndex,
    pub transport: Transport,
    pub progress: ReadProgress,
}

/// Why a file is not read, beside what the format says.
#[derive(Debug, thiserror::Error)]
pub enum LtmFileError {
    #[error("is a folder, not an .ltm file")]
    Folder,
    #[error("cannot be opened: {0}")]
    Open(io::Error),
    #[error("{error:#} (--first {intact} reads the part before the damage)")]
    DamagedEnd {
        error: anyhow::Error,
        /// Bytes before the damage.
        intact: u64,
    },
}

/// Reads and checks an `.ltm` file of one level, or its prefix `first`.
pub fn read_ltm(path: &Path, first: Option<PrefixLength>) -> Result<LtmFile> {
    let read = || -> Result<LtmFile> {
        let file = open(path)?;
        let length = file.metadata().context("cannot be read")?.len();
        let max_bytes = first.map_or(u64::MAX, |first| first.bytes_of(length));
        let mut reader = LtmReader::new(LIMITS);
        let fed = feed_all(&mut reader, file.take(max_bytes));
        let Some(index) = reader.index().cloned() else {
            fed?;
            ensure!(
                max_bytes >= length,
                "the first {max_bytes} bytes end within its file index; give --first more"
            );
            return Err(reader.truncated().into());
        };
        let progress = reader.progress();
        let transport = fed.and_then(|()| match first {
            Some(_) => Ok(reader.finish_early()?),
            None => Ok(reader.finish()?),
        });
        let (transport, _) = transport.map_err(|error| match intact_bytes(&index, &error) {
            Some(intact) if intact > index.header.index_bytes() => {
                LtmFileError::DamagedEnd { error, intact }.into()
            }
            _ => error,
        })?;
        Ok(LtmFile {
            index,
            transport,
            progress,
        })
    };
    read().with_context(|| path.display().to_string())
}

fn feed_all(reader: &mut LtmReader, mut file: impl Read) -> Result<()> {
    let mut buffer = vec![0; READ_BYTES];
    let mut offset = 0;
    loop {
        let n = file.read(&mut buffer).context("cannot be read")?;
        if n == 0 {
            return Ok(());
        }
        reader.feed(offset, &buffer[..n])?;
        offset += n as u64;
    }
}

/// Number of bytes before the damage that `error` reports, if known.
fn intact_bytes(index: &FileIndex, error: &anyhow::Error) -> Option<u64> {
    match error.downcast_ref::<FormatError>()? {
        FormatError::Truncated { got, .. } => Some(*got),
        FormatError::ChecksumMismatch(SectionName::Chunk(chunk))
        | FormatError::DamagedSection {
            section: SectionName::Chunk(chunk),
            ..
        } => Some(index.range(*chunk).start),
        _ => None,
    }
}

/// Opens an `.ltm` file, of any size, and reads its file index.
pub fn open_ltm(path: &Path) -> Result<(File, FileIndex)> {
    let read = || -> Result<(File, FileIndex)> {
        let mut file = open(path)?;
        let mut reader = LtmReader::of_index(LIMITS);
        loop {
            if let Some(index) = reader.index() {
                return Ok((file, index.clone()));
            }
            let range = reader.wants(&ChunkSelection::default()).into_iter().next();
            let range = range.unwrap_or_default();
            let bytes = read_range(&mut file, range.clone())?;
            if bytes.is_empty() {
                return Err(reader.truncated().into());
            }
            // Chunks after the file index need not be decoded.
            let index = reader.index_bytes().unwrap_or(HEADER_BYTES as u64);
            let index_bytes = bytes.len().min((index - range.start) as usize);
            reader.feed(range.start, &bytes[..index_bytes])?;
        }
    };
    read().with_context(|| path.display().to_string())
}

/// The bytes of `range`, or up to the end of the file.
pub fn read_range(file: &mut File, range: Range<u64>) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(range.start))
        .context("cannot be read")?;
    let read = file.take(range.end - range.start).read_to_end(&mut bytes);
    read.context("cannot be read")?;
    Ok(bytes)
}

fn open(path: &Path) -> Result<File, LtmFileError> {
    if path.is_dir() {
        return Err(LtmFileError::Folder);
    }
    File::open(path).map_err(LtmFileError::Open)
}

/// Length of a prefix: in bytes, or in per cent of the file.
#[derive(Clone, Copy, Debug)]
pub enum PrefixLength {
    Bytes(u64),
    Percent(f64),
}

impl PrefixLength {
    /// Parses `20000`, `20K` or `10%`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let Some(number) = text.strip_suffix('%') else {
            return Ok(Self::Bytes(ByteCount::parse(text)?.0));
        };
        match number.parse().map_err(|e: ParseFloatError| e.to_string())? {
            percent if (0.0..=100.0).contains(&percent) => Ok(Self::Percent(percent)),
            _ => Err("give a number from 0% to 100%".to_owned()),
        }
    }

    fn bytes_of(self, length: u64) -> u64 {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Percent(percent) => (length as f64 * percent / 100.0) as u64,
        }
    }
}
