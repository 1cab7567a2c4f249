//! Files made of parts of others, without decoding: a shard of a picture, and a file with another index.

use std::collections::BTreeMap;

use super::assembly::EncodedFile;
use crate::format::chunk::{ChunkEntry, ChunkId};
use crate::format::error::FormatError;
use crate::format::extension::FormatExtension;
use crate::format::index::FileIndex;
use crate::format::metadata::MetadataText;
use crate::format::scan::ScanCoding;
use crate::transport::Geometry;

impl EncodedFile {
    /// Copies the chunks of some `tiles` of a file, which are those of `geometry`, row by row; `fetch` gives their bytes.
    /// The copy decodes to the same values.
    ///
    /// # Errors
    /// The errors of `fetch`, [`FormatError::ChecksumMismatch`] of a chunk, and the errors of writing extensions.
    ///
    /// # Panics
    /// If the tiles are not as many as those of `geometry`.
    pub fn copy_of<E: From<FormatError>>(
        index: &FileIndex,
        geometry: Geometry,
        tiles: &[usize],
        extensions: Vec<FormatExtension>,
        metadata: MetadataText,
        mut fetch: impl FnMut(ChunkId) -> Result<Vec<u8>, E>,
    ) -> Result<Self, E> {
        assert_eq!(tiles.len(), geometry.tile_grid().area());
        let mut fetch = |chunk: ChunkId, bytes: u32| -> Result<Vec<u8>, E> {
            if bytes == 0 {
                return Ok(Vec::new());
            }
            let bytes = fetch(chunk)?;
            index.check_crc(chunk, &bytes)?;
            Ok(bytes)
        };
        let mut entries: Vec<ChunkEntry> = Vec::new();
        let mut chunks = Vec::new();
        for (scan, record) in index.scans.iter().enumerate() {
            let basis = ChunkId { scan, tile: None };
            chunks.push(fetch(basis, record.basis_bytes)?);
            for &tile in tiles {
                let entry = index.entry(scan, tile);
                let chunk = ChunkId {
                    scan,
                    tile: Some(tile),
                };
                chunks.push(fetch(chunk, entry.bytes)?);
                entries.push(entry);
            }
        }
        let scans = index.scans.clone();
        Ok(Self::indexed(
            geometry, scans, entries, extensions, metadata, chunks,
        )?)
    }

    /// The file with other extensions and metadata.
    ///
    /// # Errors
    /// [`FormatError::TooMany`] bytes of extensions or metadata.
    pub fn with_extensions(
        self,
        extensions: Vec<FormatExtension>,
        metadata: MetadataText,
    ) -> Result<Self, FormatError> {
        let FileIndex { header, scans, .. } = &self.index;
        let tiles = 0..self.index.tiles();
        let entries = (0..scans.len()).flat_map(|scan| tiles.clone().map(move |tile| (scan, tile)));
        let entries = entries.map(|(scan, tile)| self.index.entry(scan, tile));
        Self::indexed(
            header.geometry.clone(),
            scans.clone(),
            entries.collect(),
            extensions,
            metadata,
            self.chunks,
        )
    }
}

impl FileIndex {
    /// The coarsest step with which a component or slot of the file ends; `None` if it is lossless or dark.
    pub fn quantisation_step(&self) -> Option<f32> {
        let scans = self
            .scans
            .iter()
            .filter(|scan| matches!(scan.coding, ScanCoding::Transform | ScanCoding::Direct));
        // Early scans have coarser steps, and component 0 a finer one.
        let mut last_steps = BTreeMap::new();
        for scan in scans {
            for item in scan.items() {
                last_steps.insert((scan.coding.is_direct(), item), scan.step);
            }
        }
        last_steps.into_values().max_by(f32::total_cmp)
    }
}
