//! Decodes a file while its bytes arrive.

use wasm_bindgen::prelude::wasm_bindgen;

use super::{CodedError, Photo};
use crate::format::{ChunkSelection, Limits, LtmReader};

/// Names the byte ranges of an `.ltm` file that it needs, takes them in pieces of any size, and makes a [`Photo`].
#[wasm_bindgen]
pub struct Decoder(LtmReader);

#[wasm_bindgen]
impl Decoder {
    /// A decoder with a limit on the decoded bytes; the default is 2 GiB.
    #[wasm_bindgen(constructor)]
    pub fn new(#[wasm_bindgen(js_name = maxDecodedBytes)] max_decoded_bytes: Option<f64>) -> Self {
        let limits = max_decoded_bytes.map_or_else(Limits::default, |bytes| Limits {
            decoded_bytes: bytes as u64, // saturates; 0 for NaN
        });
        Self(LtmReader::new(limits))
    }

    /// The missing byte ranges, the most important first: start and end of the first, then of the second, and so on. The
    /// first may end beyond a small file. Empty once the file is complete.
    pub fn wants(&self) -> Vec<f64> {
        let ranges = self.0.wants(&ChunkSelection::default()).into_iter();
        let bounds = ranges.flat_map(|range| [range.start as f64, range.end as f64]);
        bounds.collect()
    }

    /// Takes the file's bytes from `offset` on. The bytes of one range must come in order; bytes that came before are
    /// skipped.
    ///
    /// # Errors
    /// A code that begins with `format-`.
    pub fn feed(&mut self, offset: f64, bytes: &[u8]) -> Result<(), CodedError> {
        Ok(self.0.feed(offset as u64, bytes)?)
    }

    /// Bytes taken, each counted once.
    #[wasm_bindgen(getter, js_name = bytesFed)]
    pub fn bytes_fed(&self) -> f64 {
        self.0.progress().bytes as f64
    }

    /// Size of the file, once its header is read.
    #[wasm_bindgen(getter, js_name = fileBytes)]
    pub fn file_bytes(&self) -> Option<f64> {
        self.0.progress().file_bytes.map(|bytes| bytes as f64)
    }

    /// Scans that are complete for every tile.
    #[wasm_bindgen(getter, js_name = scansDone)]
    pub fn scans_done(&self) -> usize {
        self.0.progress().scans
    }

    /// A coarser photograph from the scans that are complete. `None` before the first scan, and once the file is
    /// complete.
    ///
    /// # Errors
    /// A code that begins with `format-`.
    pub fn preview(&self) -> Result<Option<Photo>, CodedError> {
        let (Some(transport), Some(index)) = (self.0.preview()?, self.0.index()) else {
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
        let (transport, metadata) = self.0.finish()?;
        Ok(Photo::with_metadata(transport, metadata.text().to_owned()))
    }
}
