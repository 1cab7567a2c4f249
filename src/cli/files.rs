//! Reading and writing files whole.

use std::fs::File;
use std::io::{BufWriter, Read, Write};
use std::path::Path;

use anyhow::{Context, Result};

use crate::format::{Header, Limits, Metadata, Reader, TileEntry};
use crate::transport::Transport;

/// Bytes read at a time.
const PIECE: usize = 1 << 20;
/// A workstation has more memory than a browser tab.
const LIMITS: Limits = Limits {
    decoded_bytes: 64 << 30,
};

/// Everything an `.ltm` file holds.
pub struct LtmFile {
    pub header: Header,
    pub entries: Vec<TileEntry>,
    pub metadata: Metadata,
    pub transport: Transport,
}

/// Reads and checks an `.ltm` file.
pub fn read_ltm(path: &Path) -> Result<LtmFile> {
    let read = || -> Result<LtmFile> {
        let mut file = File::open(path).context("cannot be opened")?;
        let mut reader = Reader::new(LIMITS);
        let mut piece = vec![0; PIECE];
        loop {
            let n = file.read(&mut piece).context("cannot be read")?;
            if n == 0 {
                break;
            }
            reader.feed(reader.position(), &piece[..n])?;
        }
        let (header, entries) = (reader.header().copied(), reader.entries().to_vec());
        let (transport, metadata) = reader.finish()?;
        Ok(LtmFile {
            header: header.context("has no header")?,
            entries,
            metadata,
            transport,
        })
    };
    read().with_context(|| path.display().to_string())
}

/// Writes a file beside its place and renames it there once whole, so that `path` never holds half
/// of it. An existing file is replaced. Returns the file's length.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> Result<()>,
) -> Result<u64> {
    let write = || -> Result<u64> {
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".ltm-export-");
        #[cfg(unix)]
        {
            // As any new file: the umask decides, not tempfile's private default.
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let mut file = builder
            .tempfile_in(folder)
            .context("cannot be created; does its folder exist, and may you write there?")?;
        let mut out = BufWriter::new(file.as_file_mut());
        write(&mut out)?;
        out.flush().context("cannot be written")?;
        drop(out);
        let bytes = file
            .as_file()
            .metadata()
            .context("cannot be read back")?
            .len();
        file.persist(path).context("cannot be put in place")?;
        Ok(bytes)
    };
    write().with_context(|| path.display().to_string())
}
