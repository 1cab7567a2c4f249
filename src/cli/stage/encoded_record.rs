//! An encoded tile in a pack: the length of the head as u32 (little-endian), the [`EncodedTileHead`] as MessagePack, and the
//! chunks of all scans, one after the other.

use anyhow::{Context, Result};

use crate::format::{EncodedTile, EncodedTileHead};

const LENGTH_BYTES: usize = 4;

/// The content of a tile's record.
pub fn encode(tile: &EncodedTile) -> Result<Vec<u8>> {
    let head = rmp_serde::to_vec(&tile.head).context("a tile cannot be stored")?;
    let length = u32::try_from(head.len()).context("a tile is too large")?;
    let chunks = tile.chunks.concat();
    Ok([&length.to_le_bytes()[..], &head, &chunks].concat())
}

/// The head, and where the chunks begin; `None` if the content is not that of a tile.
pub fn decode_head(content: &[u8]) -> Option<(EncodedTileHead, usize)> {
    let (length, rest) = content.split_first_chunk::<LENGTH_BYTES>()?;
    let (head, chunks) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    let head: EncodedTileHead = rmp_serde::from_slice(head).ok()?;
    let lengths = head.entries.iter().map(|entry| u64::from(entry.bytes));
    (lengths.sum::<u64>() == chunks.len() as u64).then(|| (head, content.len() - chunks.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::ChunkEntry;

    #[test]
    fn a_cut_record_is_told() {
        let entry = |bytes| ChunkEntry {
            bytes,
            content_bytes: 2 * bytes,
            crc: 7,
        };
        let tile = EncodedTile {
            head: EncodedTileHead {
                entries: vec![entry(3), entry(0), entry(2)],
                signal: 0.1,
                errors: vec![0.3, 0.2, 1e-9],
                is_clipped: true,
            },
            chunks: vec![vec![1, 2, 3], vec![], vec![4, 5]],
        };
        let content = encode(&tile).unwrap();
        let (head, start) = decode_head(&content).unwrap();
        assert_eq!(head, tile.head);
        assert_eq!(content[start..], [1, 2, 3, 4, 5]);
        for cut in 0..content.len() {
            assert!(decode_head(&content[..cut]).is_none());
        }
    }
}
