//! Reading without I/O: bytes in, tiles out.

use std::ops::Range;

use super::codec::{PartError, basis, direct, zeros};
use super::error::Part;
use super::head::{Head, PartNumber, tiles_in};
use super::header::{self, FIRST_BYTES, HEADER_BYTES, Header};
use super::tile::TileNumbers;
use super::{FormatError, Limits, MetadataJson};
use crate::transport::{Basis, CoefficientTile, Decibels, DirectTile, Tile, Transport};

/// An incremental reader. [`wants`](Self::wants) says which bytes are of use,
/// [`feed`](Self::feed) takes any, in pieces of any size; each tile is checked and decoded as far as
/// its chunks have come.
///
/// ```
/// use relightable_photo::format::{Interest, Limits, Reader};
/// # fn open(file: &[u8]) -> Result<(), relightable_photo::format::FormatError> {
/// let mut reader = Reader::new(Limits::default());
/// loop {
///     let wanted = reader.wants(&Interest::default());
///     let Some(range) = wanted.first() else { break };
///     let end = file.len().min(range.end as usize);
///     reader.feed(range.start, &file[range.start as usize..end])?;
/// }
/// let (transport, metadata) = reader.finish()?;
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct Reader {
    limits: Limits,
    /// Bytes of the head received so far.
    gathered: Vec<u8>,
    header: Option<Header>,
    opened: Option<Opened>,
    received: u64,
}

/// What of a file is of use: by default all of it.
#[derive(Clone, Debug, Default)]
pub struct Interest {
    /// Camera pixels that are seen, columns and rows; all if none.
    pub viewport: Option<(Range<u32>, Range<u32>)>,
    /// SNR that is enough.
    pub quality: Option<Decibels>,
}

/// How far a file has been read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Bytes received.
    pub bytes: u64,
    /// Bytes in the file, once the header is known.
    pub file_bytes: Option<u64>,
    /// Scans that are there for every tile.
    pub scans: usize,
    /// Tiles that are whole.
    pub tiles: usize,
}

/// What is known once the head has been read.
#[derive(Debug)]
struct Opened {
    head: Head,
    /// Functions not there yet are all zero.
    basis: Basis,
    /// Slots of the window in the order of direct scans.
    order: Vec<u16>,
    tiles: Vec<Coming>,
    /// `[scan, basis and tiles]`.
    parts: Vec<Received>,
    /// How many of each scan have not.
    missing: Vec<usize>,
}

/// What has come of a part.
#[derive(Clone, Debug)]
enum Received {
    /// Its first bytes, or none.
    Some(Vec<u8>),
    /// All, which wait for earlier scans of the tile.
    Early(Vec<u8>),
    /// All that there is, and it is decoded.
    Whole,
}

/// A tile on its way.
#[derive(Debug)]
enum Coming {
    Numbers(TileNumbers),
    Whole(Tile),
}

impl Reader {
    /// A reader of which nothing is known.
    pub fn new(limits: Limits) -> Self {
        Self {
            limits,
            gathered: Vec::new(),
            header: None,
            opened: None,
            received: 0,
        }
    }

    /// Byte ranges that are of use, the most important first: the head, and once that is there each
    /// scan as far as `interest` goes. What has come is left out. The first range may reach beyond
    /// the end of a small file. None once there is nothing more to want.
    pub fn wants(&self, interest: &Interest) -> Vec<Range<u64>> {
        let Some(opened) = &self.opened else {
            let have = self.gathered.len() as u64;
            let head = self.header.map(|header| header.head_bytes());
            let wanted = have..head.unwrap_or(FIRST_BYTES);
            return Vec::from([wanted]);
        };
        opened.wants(interest)
    }

    /// How far reading has come.
    pub fn progress(&self) -> Progress {
        let opened = self.opened.as_ref();
        Progress {
            bytes: self.received,
            file_bytes: self.header.map(|header| header.file_bytes),
            scans: opened.map_or(0, Opened::scans),
            tiles: opened.map_or(0, |opened| {
                let whole = |tile: &&Coming| matches!(tile, Coming::Whole(_));
                opened.tiles.iter().filter(whole).count()
            }),
        }
    }

    /// Length of the head, once the header is known.
    pub fn head_bytes(&self) -> Option<u64> {
        self.header.map(|header| header.head_bytes())
    }

    /// All that is known before the first chunk, once it is.
    pub fn head(&self) -> Option<&Head> {
        self.opened.as_ref().map(|opened| &opened.head)
    }

    /// Takes the file's bytes from `offset` on. The head's must come in order, and so must those of
    /// each later part; what has come before is passed over.
    pub fn feed(&mut self, offset: u64, bytes: &[u8]) -> Result<(), FormatError> {
        let (mut offset, mut bytes) = (offset, bytes);
        while self.opened.is_none() {
            let have = self.gathered.len() as u64;
            if offset > have {
                return Err(FormatError::Offset {
                    got: offset,
                    wanted: have,
                });
            }
            let known = usize::try_from(have - offset).unwrap_or(usize::MAX);
            bytes = bytes.get(known..).unwrap_or_default();
            offset = have;
            if bytes.is_empty() {
                return Ok(());
            }
            let target = self.header.map_or(HEADER_BYTES as u64, |h| h.head_bytes());
            let missing = usize::try_from(target - have).unwrap_or(usize::MAX);
            let (now, later) = bytes.split_at(bytes.len().min(missing));
            self.gathered.extend_from_slice(now);
            self.received += now.len() as u64;
            offset += now.len() as u64;
            bytes = later;
            self.advance()?;
        }
        match &mut self.opened {
            Some(opened) => {
                self.received += opened.feed(offset, bytes)?;
                Ok(())
            }
            None => Ok(()),
        }
    }

    /// Reads the header, and the head, once they are there.
    fn advance(&mut self) -> Result<(), FormatError> {
        let Some(header) = self.header else {
            header::check_magic(&self.gathered)?;
            if let Some(bytes) = self.gathered.first_chunk::<HEADER_BYTES>() {
                let header = Header::decode(bytes)?;
                self.limits.check_header(&header)?;
                self.header = Some(header);
                return self.advance();
            }
            return Ok(());
        };
        if self.gathered.len() as u64 == header.head_bytes() {
            let head = Head::decode(header, &self.gathered, &self.limits)?;
            self.opened = Some(Opened::new(head)?);
            self.gathered = Vec::new();
        }
        Ok(())
    }

    /// The error of a file that ends after what has been fed.
    pub fn cut_short(&self) -> FormatError {
        FormatError::Truncated {
            got: self.received,
            need: self
                .header
                .map_or(HEADER_BYTES as u64, |header| header.file_bytes),
        }
    }

    /// The whole transport, once every byte has been fed.
    pub fn finish(self) -> Result<(Transport, MetadataJson), FormatError> {
        let cut_short = self.cut_short();
        match self.opened {
            Some(opened) if opened.missing.iter().all(|missing| *missing == 0) => opened.finish(),
            _ => Err(cut_short),
        }
    }

    /// A coarser transport, by the components that are there for every tile; none before those of the
    /// first scan are, and once all is there, which is left to [`finish`](Self::finish).
    pub fn preview(&self) -> Result<Option<Transport>, FormatError> {
        match &self.opened {
            Some(opened) if (1..opened.missing.len()).contains(&opened.scans()) => {
                opened.preview().map(Some)
            }
            _ => Ok(None),
        }
    }

    /// The transport as far as it has come, once the head has.
    pub fn finish_early(self) -> Result<(Transport, MetadataJson), FormatError> {
        match self.opened {
            Some(opened) => opened.finish(),
            None => self.finish(),
        }
    }
}

impl Opened {
    fn new(head: Head) -> Result<Self, FormatError> {
        let memory = |e: PartError| e.of(Part::Directory);
        let (tiles, scans) = (head.tiles(), head.scans.len());
        let area = head.header.geometry.window.area();
        let mut kernels = Vec::new();
        for _ in 0..head.header.rank {
            kernels.push(zeros(area).map_err(memory)?);
        }
        let mut opened = Self {
            basis: Basis { kernels },
            order: direct::order(head.header.geometry.window),
            tiles: (0..tiles)
                .map(|_| Coming::Numbers(TileNumbers::default()))
                .collect(),
            parts: vec![Received::Whole; scans * (tiles + 1)],
            missing: vec![0; scans],
            head,
        };
        for part in opened.head.parts() {
            let at = opened.head.index(part);
            opened.parts[at] = Received::Some(Vec::new());
            opened.missing[part.scan] += 1;
        }
        // Tiles that are all dark are whole from the beginning.
        for tile in 0..tiles {
            opened.pass_over(tile)?;
        }
        Ok(opened)
    }

    /// How many of a part's first bytes have come; none if all have.
    fn some(&self, part: PartNumber) -> Option<usize> {
        match &self.parts[self.head.index(part)] {
            Received::Some(bytes) => Some(bytes.len()),
            Received::Early(_) | Received::Whole => None,
        }
    }

    /// Scans that are there for every tile.
    fn scans(&self) -> usize {
        let gap = self.missing.iter().position(|missing| *missing > 0);
        gap.unwrap_or(self.missing.len())
    }

    fn wants(&self, interest: &Interest) -> Vec<Range<u64>> {
        let enough = interest.quality.and_then(|quality| {
            let scans = &self.head.scans;
            scans.iter().position(|scan| scan.snr.0 >= quality.0)
        });
        let scans = enough.map_or(self.head.scans.len(), |last| last + 1);
        let geometry = &self.head.header.geometry;
        let tiles = match &interest.viewport {
            Some((x, y)) => tiles_in(geometry, x.clone(), y.clone()),
            None => (0..self.tiles.len()).collect(),
        };
        let mut ranges: Vec<Range<u64>> = Vec::new();
        for scan in 0..scans {
            let chunks = tiles.iter().map(|&tile| Some(tile));
            for tile in std::iter::once(None).chain(chunks) {
                let part = PartNumber { scan, tile };
                let Some(some) = self.some(part) else {
                    continue;
                };
                let mut range = self.head.range(part);
                range.start += some as u64;
                match ranges.last_mut() {
                    Some(last) if last.end == range.start => last.end = range.end,
                    _ => ranges.push(range),
                }
            }
        }
        ranges
    }

    /// Takes bytes of parts; how many of them were new.
    fn feed(&mut self, mut offset: u64, mut bytes: &[u8]) -> Result<u64, FormatError> {
        let end = self.head.header.file_bytes;
        let mut new = 0;
        // The head once more, from a server that starts anew.
        let head_bytes = self.head.header.head_bytes();
        if offset < head_bytes {
            let known = usize::try_from(head_bytes - offset).unwrap_or(usize::MAX);
            bytes = bytes.get(known..).unwrap_or_default();
            offset = head_bytes;
        }
        while !bytes.is_empty() {
            if offset >= end {
                return Err(FormatError::TrailingBytes { end });
            }
            let part = self.head.part_at(offset);
            let range = self.head.range(part);
            let here = bytes.len().min((range.end - offset) as usize); // a part is below 4 GiB
            let (now, later) = bytes.split_at(here);
            new += self.feed_part(part, range, offset, now)?;
            offset += here as u64;
            bytes = later;
        }
        Ok(new)
    }

    /// Takes some bytes of one part; how many of them were new.
    fn feed_part(
        &mut self,
        part: PartNumber,
        range: Range<u64>,
        offset: u64,
        bytes: &[u8],
    ) -> Result<u64, FormatError> {
        let index = self.head.index(part);
        let Received::Some(partial) = &mut self.parts[index] else {
            return Ok(0);
        };
        let length = (range.end - range.start) as usize;
        if bytes.len() == length {
            let known = std::mem::take(partial).len();
            self.take(part, bytes)?;
            return Ok((length - known) as u64);
        }
        let at = (offset - range.start) as usize;
        if at > partial.len() {
            return Err(FormatError::Offset {
                got: offset,
                wanted: range.start + partial.len() as u64,
            });
        }
        let fresh = bytes.get(partial.len() - at..).unwrap_or_default();
        partial.extend_from_slice(fresh);
        let new = fresh.len() as u64;
        if partial.len() == length {
            let whole = std::mem::take(partial);
            self.take(part, &whole)?;
        }
        Ok(new)
    }

    /// Takes a part that is whole.
    fn take(&mut self, part: PartNumber, bytes: &[u8]) -> Result<(), FormatError> {
        self.head.check_crc(part, bytes)?;
        let at = self.head.index(part);
        self.parts[at] = Received::Whole;
        self.missing[part.scan] -= 1;
        let Some(tile) = part.tile else {
            let functions = self.head.functions(part.scan);
            let area = self.head.header.geometry.window.area();
            let decoded = basis::decode(bytes, functions.len(), area);
            let decoded = decoded.map_err(|e| e.of(part.into()))?;
            self.basis.kernels[functions].clone_from_slice(&decoded);
            return Ok(());
        };
        match &self.tiles[tile] {
            Coming::Numbers(numbers) if numbers.scans == part.scan => {
                self.add(tile, bytes)?;
                self.pass_over(tile)
            }
            _ => {
                self.parts[at] = Received::Early(bytes.to_vec());
                Ok(())
            }
        }
    }

    /// Takes a tile past the scans that have nothing for it, or that wait already.
    fn pass_over(&mut self, tile: usize) -> Result<(), FormatError> {
        while let Coming::Numbers(numbers) = &mut self.tiles[tile]
            && numbers.scans < self.head.scans.len()
        {
            let part = PartNumber {
                scan: numbers.scans,
                tile: Some(tile),
            };
            if self.head.entry(part.scan, tile).bytes == 0 {
                numbers.scans += 1;
                continue;
            }
            let at = self.head.index(part);
            let Received::Early(bytes) = &mut self.parts[at] else {
                break;
            };
            let bytes = std::mem::take(bytes);
            self.parts[at] = Received::Whole;
            self.add(tile, &bytes)?;
        }
        self.complete(tile)
    }

    /// Decodes a chunk, the next of its tile.
    fn add(&mut self, tile: usize, bytes: &[u8]) -> Result<(), FormatError> {
        match &mut self.tiles[tile] {
            Coming::Numbers(numbers) => numbers.add(&self.head, &self.order, tile, bytes),
            Coming::Whole(_) => Ok(()),
        }
    }

    /// Turns a tile whose chunks have all come into codes.
    fn complete(&mut self, tile: usize) -> Result<(), FormatError> {
        match &mut self.tiles[tile] {
            Coming::Numbers(numbers) if numbers.scans == self.head.scans.len() => {
                let numbers = std::mem::take(numbers);
                let codes = self.codes(tile, numbers, self.basis.rank())?;
                self.tiles[tile] = Coming::Whole(codes);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// The codes of what has come of a tile, of the first `rank` components.
    fn codes(&self, tile: usize, numbers: TileNumbers, rank: usize) -> Result<Tile, FormatError> {
        let part = Part::Chunk {
            scan: self.head.scans.len().saturating_sub(1),
            tile,
        };
        let band = numbers.band_tile(&self.head, tile, rank)?;
        let rect = band.rect;
        let mut codes = Tile::dark(rect);
        if !band.coefficients.is_empty() {
            let room = zeros(CoefficientTile::texels(rect, rank)).map_err(|e| e.of(part))?;
            codes.coefficients =
                CoefficientTile::quantise_into(rect, &band.coefficients, rank, room);
        }
        if !band.functions.is_empty() {
            let mut room = zeros(band.functions.len()).map_err(|e| e.of(part))?;
            room.clear();
            codes.functions = DirectTile::quantise_into(rect, &band.functions, room);
        }
        Ok(codes)
    }

    fn preview(&self) -> Result<Transport, FormatError> {
        let rank = self.head.functions(self.scans() - 1).end;
        let tile = |(i, tile): (usize, &Coming)| match tile {
            Coming::Numbers(numbers) => self.codes(i, numbers.clone(), rank),
            // The scans to come have nothing for it.
            Coming::Whole(tile) => Ok(tile.first_components(self.basis.rank(), rank)),
        };
        Ok(Transport {
            geometry: self.head.header.geometry,
            basis: Basis {
                kernels: self.basis.kernels[..rank].to_vec(),
            },
            tiles: self
                .tiles
                .iter()
                .enumerate()
                .map(tile)
                .collect::<Result<_, _>>()?,
        })
    }

    fn finish(mut self) -> Result<(Transport, MetadataJson), FormatError> {
        let mut tiles = Vec::with_capacity(self.tiles.len());
        for i in 0..self.tiles.len() {
            let none = Coming::Numbers(TileNumbers::default());
            tiles.push(match std::mem::replace(&mut self.tiles[i], none) {
                Coming::Whole(tile) => tile,
                Coming::Numbers(numbers) => self.codes(i, numbers, self.basis.rank())?,
            });
        }
        let transport = Transport {
            geometry: self.head.header.geometry,
            basis: self.basis,
            tiles,
        };
        Ok((transport, self.head.metadata))
    }
}
