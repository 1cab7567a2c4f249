//! Reading without I/O: bytes in, tiles out.

use std::ops::Range;

use super::codec::{basis, direct, factored};
use super::error::Part;
use super::header::{self, HEADER_BYTES, Header, TileEntry, TileKind};
use super::{FormatError, Limits, Metadata};
use crate::transport::{Basis, DirectTile, Transport};

/// An incremental reader. [`wants`](Self::wants) says which bytes come next, [`feed`](Self::feed)
/// takes them in pieces of any size; each tile is checked and decoded as soon as it is whole.
///
/// ```
/// use relightable_photo::format::{Limits, Reader};
/// # fn open(file: &[u8]) -> Result<(), relightable_photo::format::FormatError> {
/// let mut reader = Reader::new(Limits::default());
/// for piece in file.chunks(1000) {
///     reader.feed(reader.position(), piece)?;
/// }
/// let (transport, metadata) = reader.finish()?;
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct Reader {
    limits: Limits,
    stage: Stage,
    /// Bytes of the current part received so far.
    pending: Vec<u8>,
    /// Offset of the next byte.
    position: u64,
    opened: Option<Opened>,
    tiles: Vec<DirectTile>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Header,
    Directory,
    Metadata,
    Basis,
    Tile(usize),
    Done,
}

/// What is known once the parts before the tiles have been read.
#[derive(Debug)]
struct Opened {
    header: Header,
    entries: Vec<TileEntry>,
    metadata: Metadata,
    basis: Basis,
}

/// How far a file has been read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Bytes received.
    pub bytes: u64,
    /// Bytes in the file, once the header is known.
    pub file_bytes: Option<u64>,
    /// Tiles decoded.
    pub tiles: usize,
}

impl Reader {
    /// A reader at the start of a file.
    pub fn new(limits: Limits) -> Self {
        Self {
            limits,
            stage: Stage::Header,
            pending: Vec::new(),
            position: 0,
            opened: None,
            tiles: Vec::new(),
        }
    }

    /// Offset of the next byte to feed.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// The byte range needed next, or `None` once the file is read. Feeding more than it is fine.
    pub fn wants(&self) -> Option<Range<u64>> {
        let need = self.part_bytes()? - self.pending.len() as u64;
        Some(self.position..self.position + need)
    }

    /// How far reading has come.
    pub fn progress(&self) -> Progress {
        Progress {
            bytes: self.position,
            file_bytes: self.opened.as_ref().map(|o| o.header.file_bytes),
            tiles: self.tiles.len(),
        }
    }

    /// The header, once read.
    pub fn header(&self) -> Option<&Header> {
        self.opened.as_ref().map(|o| &o.header)
    }

    /// The directory, in tile order; empty until read.
    pub fn entries(&self) -> &[TileEntry] {
        self.opened.as_ref().map_or(&[], |o| &o.entries)
    }

    /// Takes the file's bytes from `offset` on, which must be [`position`](Self::position).
    pub fn feed(&mut self, offset: u64, mut bytes: &[u8]) -> Result<(), FormatError> {
        if offset != self.position {
            return Err(FormatError::Offset {
                got: offset,
                wanted: self.position,
            });
        }
        while !bytes.is_empty() {
            let Some(part_bytes) = self.part_bytes() else {
                return Err(FormatError::TrailingBytes { end: self.position });
            };
            let missing = part_bytes - self.pending.len() as u64;
            let taken = bytes
                .len()
                .min(usize::try_from(missing).unwrap_or(usize::MAX));
            let (now, later) = bytes.split_at(taken);
            self.pending.extend_from_slice(now);
            self.position += taken as u64;
            bytes = later;
            if self.stage == Stage::Header {
                header::check_magic(&self.pending)?;
            }
            self.advance()?;
        }
        Ok(())
    }

    /// The whole transport, once every byte has been fed.
    pub fn finish(self) -> Result<(Transport, Metadata), FormatError> {
        match self.opened {
            Some(opened) if self.stage == Stage::Done => Ok((
                Transport {
                    geometry: opened.header.geometry,
                    tiles: self.tiles,
                },
                opened.metadata,
            )),
            opened => Err(FormatError::Truncated {
                got: self.position,
                need: opened.map_or(HEADER_BYTES as u64, |o| o.header.file_bytes),
            }),
        }
    }

    /// Length of the part being read, `None` when all are.
    fn part_bytes(&self) -> Option<u64> {
        match (self.stage, &self.opened) {
            (Stage::Header, _) => Some(HEADER_BYTES as u64),
            (Stage::Directory, Some(o)) => Some(o.header.directory_bytes()),
            (Stage::Metadata, Some(o)) => Some(u64::from(o.header.metadata_bytes)),
            (Stage::Basis, Some(o)) => Some(u64::from(o.header.basis_bytes)),
            (Stage::Tile(i), Some(o)) => Some(u64::from(o.entries[i].bytes)),
            _ => None,
        }
    }

    /// Takes in every part that is whole, the empty ones too.
    fn advance(&mut self) -> Result<(), FormatError> {
        while self.part_bytes() == Some(self.pending.len() as u64) {
            let part = std::mem::take(&mut self.pending);
            self.stage = self.take_part(&part)?;
        }
        Ok(())
    }

    fn take_part(&mut self, part: &[u8]) -> Result<Stage, FormatError> {
        let Some(opened) = &mut self.opened else {
            let mut bytes = [0; HEADER_BYTES];
            bytes.copy_from_slice(part);
            let header = Header::decode(&bytes)?;
            self.limits.check(&header)?;
            self.opened = Some(Opened {
                header,
                entries: Vec::new(),
                metadata: Metadata::default(),
                basis: Basis::default(),
            });
            return Ok(Stage::Directory);
        };
        match self.stage {
            Stage::Header | Stage::Directory => {
                opened.entries = header::decode_directory(&opened.header, part)?;
                Ok(Stage::Metadata)
            }
            Stage::Metadata => {
                check(part, opened.header.metadata_crc, Part::Metadata)?;
                opened.metadata = serde_json::from_slice(part).map_err(FormatError::Metadata)?;
                Ok(Stage::Basis)
            }
            Stage::Basis => {
                let header = &opened.header;
                if header.rank > 0 {
                    check(part, header.basis_crc, Part::Basis)?;
                    opened.basis = basis::decode(part, header.rank, header.geometry.window.area())
                        .map_err(|e| e.of(Part::Basis))?;
                }
                Ok(Stage::Tile(0))
            }
            Stage::Tile(i) => {
                self.tiles.push(opened.decode(i, part)?);
                let next = i + 1;
                Ok(if next < opened.entries.len() {
                    Stage::Tile(next)
                } else {
                    Stage::Done
                })
            }
            Stage::Done => Ok(Stage::Done),
        }
    }
}

impl Opened {
    /// Checks and decodes tile number `i`.
    fn decode(&self, i: usize, bytes: &[u8]) -> Result<DirectTile, FormatError> {
        let (entry, geometry) = (&self.entries[i], &self.header.geometry);
        check(bytes, entry.crc, Part::Tile(i))?;
        let (rect, step) = (geometry.tile(i), entry.step);
        let tile = match entry.kind {
            TileKind::Dark => Ok(DirectTile::dark(rect)),
            TileKind::Direct => direct::decode(bytes, rect, geometry.window.area(), step),
            TileKind::Factored { components } => {
                factored::decode(bytes, rect, components, self.basis.rank(), step)
                    .and_then(|tile| factored::multiply_out(&tile, geometry, &self.basis))
            }
        };
        tile.map_err(|e| e.of(Part::Tile(i)))
    }
}

fn check(bytes: &[u8], crc: u32, part: Part) -> Result<(), FormatError> {
    match crc32c::crc32c(bytes) == crc {
        true => Ok(()),
        false => Err(FormatError::Checksum { part }),
    }
}
