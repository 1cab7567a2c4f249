//! Decodes a file while its bytes arrive.

use std::ops::Range;

use wasm_bindgen::prelude::wasm_bindgen;

use super::{CodedError, Photo};
use crate::format::{ChunkSelection, LevelTable, Limits, LtmReader};
use crate::transport::Extent;

/// Names the byte ranges of an `.ltm` file that it needs, takes them in pieces of any size, and makes a [`Photo`].
#[wasm_bindgen]
pub struct Decoder {
    reader: LtmReader,
    /// Of a file of several levels, once its index is read.
    levels: Option<LevelTable>,
}

#[wasm_bindgen]
impl Decoder {
    /// A decoder with a limit on the decoded bytes; the default is 2 GiB. With a limit on the bytes of tiles it reads the
    /// first components only, in fours, as far as their coefficients fit; at least four.
    #[wasm_bindgen(constructor)]
    pub fn new(
        #[wasm_bindgen(js_name = maxDecodedBytes)] max_decoded_bytes: Option<f64>,
        #[wasm_bindgen(js_name = maxTileBytes)] max_tile_bytes: Option<f64>,
    ) -> Self {
        let limits = max_decoded_bytes.map_or_else(Limits::default, |bytes| Limits {
            decoded_bytes: bytes as u64, // saturates; 0 for NaN
        });
        let mut reader = LtmReader::new(limits);
        if let Some(bytes) = max_tile_bytes {
            reader.limit_tiles(bytes as u64);
        }
        Self {
            reader,
            levels: None,
        }
    }

    /// The missing byte ranges, the most important first: start and end of the first, then of the second, and so on. The
    /// first may end beyond a small file. Empty once the file is complete.
    pub fn wants(&self) -> Vec<f64> {
        let ranges = self.reader.wants(&ChunkSelection::default()).into_iter();
        let bounds = ranges.flat_map(|range| [range.start as f64, range.end as f64]);
        bounds.collect()
    }

    /// Takes the file's bytes from `offset` on. The bytes of one range must come in order; bytes that came before are
    /// skipped.
    ///
    /// # Errors
    /// A code that begins with `format-`.
    pub fn feed(&mut self, offset: f64, bytes: &[u8]) -> Result<(), CodedError> {
        self.reader.feed(offset as u64, bytes)?;
        if let (None, Some(index)) = (&self.levels, self.reader.index()) {
            self.levels = LevelTable::read(index)?;
        }
        Ok(())
    }

    /// Bytes taken, each counted once.
    #[wasm_bindgen(getter, js_name = bytesFed)]
    pub fn bytes_fed(&self) -> f64 {
        self.reader.progress().bytes as f64
    }

    /// Size of the file, once its header is read.
    #[wasm_bindgen(getter, js_name = fileBytes)]
    pub fn file_bytes(&self) -> Option<f64> {
        self.reader.progress().file_bytes.map(|bytes| bytes as f64)
    }

    /// Bytes of all levels, of which the file's header describes the last; `fileBytes` if there is one.
    #[wasm_bindgen(getter, js_name = bytesOfLevels)]
    pub fn bytes_of_levels(&self) -> Option<f64> {
        let others = self.levels.as_ref().map_or(0, LevelTable::bytes);
        Some(self.file_bytes()? + others as f64)
    }

    /// The table of levels, once the index is read; empty if there is one level. Width and height of level 0, and of its
    /// light plane, number of levels, side of the shards; and of each shard its level, column and row, and where it begins and ends.
    pub fn levels(&self) -> Vec<f64> {
        let (Some(table), Some(root)) = (&self.levels, self.file_bytes()) else {
            return Vec::new();
        };
        let mut numbers = Vec::new();
        for Extent { width, height } in [table.camera(0), table.light(0)] {
            numbers.extend([width, height].map(f64::from));
        }
        numbers.extend([table.levels(), table.shard_side()].map(f64::from));
        for (number, shard) in table.shards().iter().enumerate() {
            let Range { start, end } = table.range(number);
            numbers.push(f64::from(shard.level));
            numbers.push(f64::from(shard.x));
            numbers.push(f64::from(shard.y));
            numbers.extend([start, end].map(|at| root + at as f64));
        }
        numbers
    }

    /// Scans that are complete for every tile.
    #[wasm_bindgen(getter, js_name = scansDone)]
    pub fn scans_done(&self) -> usize {
        self.reader.progress().scans
    }

    /// A coarser photograph from the scans that are complete. `None` before the first scan, and once the file is
    /// complete.
    ///
    /// # Errors
    /// A code that begins with `format-`.
    pub fn preview(&self) -> Result<Option<Photo>, CodedError> {
        let (Some(transport), Some(index)) = (self.reader.preview()?, self.reader.index()) else {
            return Ok(None);
        };
        let metadata = index.metadata.text().to_owned();
        Ok(Some(Photo::with_metadata(transport, metadata)))
    }

    /// The photograph, once the file is complete.
    ///
    /// # Errors
    /// A code that begins with `format-`: `format-truncated` if the file is not complete.
    pub fn finish(self) -> Result<Photo, CodedError> {
        let (transport, metadata) = self.reader.finish()?;
        Ok(Photo::with_metadata(transport, metadata.text().to_owned()))
    }
}
