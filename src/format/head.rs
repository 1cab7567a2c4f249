//! All that comes before the first scan: header, directory, extensions, metadata.

use std::ops::Range;

use super::codec::{checksum, compress, decompress, intact};
use super::error::Part;
use super::extension::{self, Extension};
use super::header::HEADER_BYTES;
use super::{ChunkEntry, Coding, FormatError, Header, Limits, Metadata, MetadataJson, Scan};
use crate::transport::Geometry;

/// What a reader knows before it has any chunk.
#[derive(Clone, Debug)]
pub struct Head {
    /// The fixed header.
    pub header: Header,
    /// The scans, in the order of the file.
    pub scans: Vec<Scan>,
    /// Extensions that readers may pass over.
    pub extensions: Vec<Extension>,
    /// Where the file came from.
    pub metadata: MetadataJson,
    /// `[scan, tile]`.
    entries: Vec<ChunkEntry>,
    /// Where parts begin, and where the last ends: of each scan its functions of the basis, then
    /// its chunks in the order of tiles.
    offsets: Vec<u64>,
}

impl Head {
    /// Reads the bytes of the head, of which there are as many as `header`, their first part, says.
    pub(super) fn decode(
        header: Header,
        bytes: &[u8],
        limits: &Limits,
    ) -> Result<Self, FormatError> {
        let mut rest = &bytes[HEADER_BYTES..];
        let mut take = |length: u32, crc: u32, part: Part| {
            let (taken, after) = rest.split_at(length as usize);
            rest = after;
            match intact(taken, crc) {
                true => Ok(taken),
                false => Err(FormatError::Checksum { part }),
            }
        };
        let directory = take(
            header.directory_bytes,
            header.directory_crc,
            Part::Directory,
        )?;
        let extensions = take(
            header.extension_bytes,
            header.extension_crc,
            Part::Extensions,
        )?;
        let metadata = take(header.metadata_bytes, header.metadata_crc, Part::Metadata)?;
        let extensions = extension::decode(extensions)?;
        let directory = decompress(directory, header.directory_plain_bytes() as usize)
            .map_err(|e| e.of(Part::Directory))?;
        let (scans, entries) = decode_directory(&header, &directory)?;
        let head = Self {
            offsets: offsets(&header, &scans, &entries),
            header,
            scans,
            entries,
            extensions,
            metadata: MetadataJson::decode(metadata)?,
        };
        let (end, file_bytes) = (head.end(), header.file_bytes);
        if end != file_bytes {
            return Err(FormatError::Length { end, file_bytes });
        }
        limits.check(&head)?;
        Ok(head)
    }

    /// Puts the head of a file together. Lengths and checksums in `header` are made right.
    ///
    /// # Panics
    /// If there is not one entry for each scan and tile.
    pub(super) fn new(
        mut header: Header,
        scans: Vec<Scan>,
        entries: Vec<ChunkEntry>,
        extensions: Vec<Extension>,
        metadata: &Metadata,
    ) -> Result<(Self, Vec<u8>), FormatError> {
        let tiles = header.geometry.tile_grid().area();
        assert_eq!(entries.len(), scans.len() * tiles, "one entry of each");
        let directory = compress(&encode_directory(&scans, &entries))?;
        let extension_bytes = extension::encode(&extensions);
        let metadata = MetadataJson::of(metadata)?;
        let json = metadata.text().as_bytes();
        let length = |bytes: &[u8]| u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        header.scans = scans.len() as u32; // the plan makes few
        header.directory_bytes = length(&directory);
        header.directory_crc = checksum(&directory);
        header.extension_bytes = length(&extension_bytes);
        header.extension_crc = checksum(&extension_bytes);
        header.metadata_bytes = length(json);
        header.metadata_crc = checksum(json);
        let offsets = offsets(&header, &scans, &entries);
        header.file_bytes = offsets.last().copied().unwrap_or(header.head_bytes());
        let fixed = header.encode();
        // What a reader would refuse is better not written.
        Header::decode(&fixed)?;
        let bytes = [&fixed[..], &directory, &extension_bytes, json].concat();
        let head = Self {
            header,
            scans,
            extensions,
            metadata,
            entries,
            offsets,
        };
        Ok((head, bytes))
    }

    /// Number of tiles.
    pub fn tiles(&self) -> usize {
        self.header.geometry.tile_grid().area()
    }

    /// What the directory says of a tile's chunk of a scan.
    pub fn entry(&self, scan: usize, tile: usize) -> ChunkEntry {
        self.entries[scan * self.tiles() + tile]
    }

    /// Where a part lies.
    pub fn range(&self, part: PartNumber) -> Range<u64> {
        let at = self.index(part);
        self.offsets[at]..self.offsets[at + 1]
    }

    /// The bytes of one scan.
    pub fn scan_range(&self, scan: usize) -> Range<u64> {
        let parts = self.tiles() + 1;
        self.offsets[scan * parts]..self.offsets[(scan + 1) * parts]
    }

    /// All parts that hold anything, in the order of the file.
    pub fn parts(&self) -> impl Iterator<Item = PartNumber> + use<'_> {
        let parts = (0..self.offsets.len() - 1).map(|at| self.part(at));
        parts.filter(|&part| !self.range(part).is_empty())
    }

    /// Whether a tile's chunk of a scan brings the tile's palette: the first that has the first
    /// component does.
    pub(super) fn brings_palette(&self, scan: usize, tile: usize) -> bool {
        let has = |scan: usize| self.scans[scan].first == 0 && self.entry(scan, tile).bytes > 0;
        let first =
            (0..scan).find(|&before| self.scans[before].coding == Coding::Transform && has(before));
        has(scan) && first.is_none()
    }

    /// An error if the bytes of a part do not have its checksum.
    pub(super) fn check_crc(&self, part: PartNumber, bytes: &[u8]) -> Result<(), FormatError> {
        let crc = match part.tile {
            None => self.scans[part.scan].basis_crc,
            Some(tile) => self.entry(part.scan, tile).crc,
        };
        match intact(bytes, crc) {
            true => Ok(()),
            false => Err(FormatError::Checksum { part: part.into() }),
        }
    }

    /// The functions of the basis that a scan brings.
    pub(super) fn functions(&self, scan: usize) -> Range<usize> {
        let before = self.scans[..scan]
            .iter()
            .fold(0, |known, scan| known + scan.brings(known));
        before..before + self.scans[scan].brings(before)
    }

    /// The part in which the byte at `offset` lies.
    pub(super) fn part_at(&self, offset: u64) -> PartNumber {
        let at = self.offsets.partition_point(|&start| start <= offset);
        self.part(at.saturating_sub(1))
    }

    /// Where the last part ends.
    fn end(&self) -> u64 {
        self.offsets.last().copied().unwrap_or(0)
    }

    /// The part's number in the order of the file.
    pub(super) fn index(&self, part: PartNumber) -> usize {
        part.scan * (self.tiles() + 1) + part.tile.map_or(0, |tile| tile + 1)
    }

    fn part(&self, index: usize) -> PartNumber {
        let parts = self.tiles() + 1;
        PartNumber {
            scan: index / parts,
            tile: (index % parts).checked_sub(1),
        }
    }
}

/// One part of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PartNumber {
    /// Which scan.
    pub scan: usize,
    /// Which tile; none for the functions of the basis that the scan brings.
    pub tile: Option<usize>,
}

impl From<PartNumber> for Part {
    fn from(PartNumber { scan, tile }: PartNumber) -> Self {
        tile.map_or(Self::Basis { scan }, |tile| Self::Chunk { scan, tile })
    }
}

/// Part offsets, from the head's end on. There are at most 2^34 lengths, and none of what decompresses
/// to 8 MiB is beyond 2^24: sums fit.
fn offsets(header: &Header, scans: &[Scan], entries: &[ChunkEntry]) -> Vec<u64> {
    let tiles = header.geometry.tile_grid().area();
    let mut offsets = Vec::with_capacity(scans.len() * (tiles + 1) + 1);
    let mut next = header.head_bytes();
    offsets.push(next);
    for (scan, entries) in scans.iter().zip(entries.chunks_exact(tiles)) {
        next += u64::from(scan.basis_bytes);
        offsets.push(next);
        for entry in entries {
            next += u64::from(entry.bytes);
            offsets.push(next);
        }
    }
    offsets
}

/// All scans, then all lengths, lengths before compression, and checksums: like stands by like.
fn encode_directory(scans: &[Scan], entries: &[ChunkEntry]) -> Vec<u8> {
    let mut bytes: Vec<u8> = scans.iter().flat_map(Scan::encode).collect();
    let fields: [fn(&ChunkEntry) -> u32; 3] = [|e| e.bytes, |e| e.plain, |e| e.crc];
    for field in fields {
        bytes.extend(entries.iter().flat_map(|entry| field(entry).to_le_bytes()));
    }
    bytes
}

fn decode_directory(
    header: &Header,
    bytes: &[u8],
) -> Result<(Vec<Scan>, Vec<ChunkEntry>), FormatError> {
    let geometry = &header.geometry;
    let (tiles, scan_count) = (geometry.tile_grid().area(), header.scans as usize);
    let (scan_bytes, fields) = bytes.split_at(scan_count * Scan::BYTES);
    let mut scans = Vec::with_capacity(scan_count);
    let mut known = 0;
    for (number, bytes) in scan_bytes.as_chunks().0.iter().enumerate() {
        let scan = Scan::decode(bytes, geometry, header.rank, known)
            .ok_or(FormatError::Scan { scan: number })?;
        known += scan.brings(known);
        scans.push(scan);
    }
    check_scans(header, &scans, known)?;
    let fields: Vec<u32> = fields
        .as_chunks()
        .0
        .iter()
        .map(|field| u32::from_le_bytes(*field))
        .collect();
    let (lengths, others) = fields.split_at(scan_count * tiles);
    let (plains, crcs) = others.split_at(scan_count * tiles);
    let mut entries = Vec::with_capacity(scan_count * tiles);
    for (i, ((&bytes, &plain), &crc)) in lengths.iter().zip(plains).zip(crcs).enumerate() {
        let (scan, tile) = (i / tiles, i % tiles);
        if !scans[scan].could_hold(geometry.tile(tile).extent, bytes, plain) {
            return Err(FormatError::Entry { scan, tile });
        }
        entries.push(ChunkEntry { bytes, plain, crc });
    }
    Ok((scans, entries))
}

/// What must hold of all scans together: the basis is brought whole, and coefficients as well as
/// functions come in one coding.
fn check_scans(header: &Header, scans: &[Scan], known: usize) -> Result<(), FormatError> {
    let has = |coding| scans.iter().any(|scan| scan.coding == coding);
    let mixed = has(Coding::Transform) && has(Coding::Halves)
        || has(Coding::Direct) && has(Coding::DirectHalves);
    match mixed || known != usize::from(header.rank) {
        true => Err(FormatError::Scan { scan: scans.len() }),
        false => Ok(()),
    }
}

/// Tiles that hold any of a rectangle of camera pixels.
pub(super) fn tiles_in(geometry: &Geometry, x: Range<u32>, y: Range<u32>) -> Vec<usize> {
    let side = geometry.tile_side;
    let inside = |tile: &usize| {
        let rect = geometry.tile(*tile);
        rect.x < x.end && rect.x + side > x.start && rect.y < y.end && rect.y + side > y.start
    };
    (0..geometry.tile_grid().area()).filter(inside).collect()
}
