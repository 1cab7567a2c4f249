//! One tile's share of one scan.

/// Bytes as they stand in a file, and how many they are before compression.
#[derive(Clone, Debug, PartialEq)]
pub struct Chunk {
    /// As in the file.
    pub bytes: Vec<u8>,
    /// Bytes of its zstd frames' contents.
    pub plain: u32,
}

/// What the directory says of a chunk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChunkEntry {
    /// Bytes in the file; 0 of a chunk that is not there, all of whose numbers are zero.
    pub bytes: u32,
    /// Bytes of its zstd frames' contents.
    pub plain: u32,
    /// crc32c of the bytes in the file.
    pub crc: u32,
}

impl ChunkEntry {
    /// Bytes of an entry in the directory.
    pub const BYTES: usize = 12;
}
