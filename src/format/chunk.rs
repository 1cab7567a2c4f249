//! Chunks: runs of bytes that have their own length and checksum.

use serde::{Deserialize, Serialize};

/// A basis chunk or a tile chunk of one scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ChunkId {
    /// Number of the scan.
    pub scan: usize,
    /// Number of the tile; `None` for the basis chunk.
    pub tile: Option<usize>,
}

impl ChunkId {
    /// Its number in the order of a file with so many `tiles`, empty chunks counted.
    pub fn number(self, tiles: usize) -> usize {
        self.scan * (tiles + 1) + self.tile.map_or(0, |tile| tile + 1)
    }

    /// The chunk with a [`number`](Self::number).
    pub fn of_number(number: usize, tiles: usize) -> Self {
        Self {
            scan: number / (tiles + 1),
            tile: (number % (tiles + 1)).checked_sub(1),
        }
    }
}

impl std::fmt::Display for ChunkId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let scan = self.scan;
        match self.tile {
            None => write!(f, "basis (scan {scan})"),
            Some(tile) => write!(f, "picture data (scan {scan}, tile {tile})"),
        }
    }
}

/// The directory's entry for a tile chunk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChunkEntry {
    /// Bytes in the file; 0 if there is no chunk, which stands for zeros.
    pub bytes: u32,
    /// Bytes of the contents of its zstd frames; a token is one byte.
    pub content_bytes: u32,
    /// CRC-32C of the bytes in the file.
    pub crc: u32,
}

/// A tile chunk as the encoder makes it, with the [`ChunkEntry::content_bytes`]; empty if all values are zero.
#[derive(Clone, Debug, Default)]
pub struct EncodedChunk {
    pub bytes: Vec<u8>,
    pub content_bytes: u32,
}
