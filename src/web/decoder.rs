//! Decoding a file as its bytes come.

use wasm_bindgen::prelude::wasm_bindgen;

use super::{CodedError, Photo};
use crate::format::{Interest, Limits, Reader};

/// Says which bytes of an `.ltm` file are of use, takes them in pieces of any size and makes a
/// [`Photo`] of them.
#[wasm_bindgen]
pub struct Decoder(Reader);

#[wasm_bindgen]
impl Decoder {
    /// A decoder of a file that may decode to `maxDecodedBytes` bytes; 2 GiB if left out.
    #[wasm_bindgen(constructor)]
    pub fn new(#[wasm_bindgen(js_name = maxDecodedBytes)] max_decoded_bytes: Option<f64>) -> Self {
        let limits = max_decoded_bytes.map_or_else(Limits::default, |bytes| Limits {
            decoded_bytes: bytes as u64, // saturates; NaN is 0
        });
        Self(Reader::new(limits))
    }

    /// Byte ranges that have not come yet, the most important first: where the first begins, where
    /// it ends, where the second begins. The first may reach beyond the end of a small file. Empty
    /// once all has come.
    pub fn wants(&self) -> Vec<f64> {
        let ranges = self.0.wants(&Interest::default());
        let bounds = ranges
            .into_iter()
            .flat_map(|range| [range.start, range.end]);
        bounds.map(|bound| bound as f64).collect()
    }

    /// Takes the file's bytes from `offset` on. Those of one range have to come in order; what has
    /// come before is passed over.
    pub fn feed(&mut self, offset: f64, bytes: &[u8]) -> Result<(), CodedError> {
        Ok(self.0.feed(offset as u64, bytes)?)
    }

    /// Bytes that have come, each counted once.
    #[wasm_bindgen(getter, js_name = bytesFed)]
    pub fn bytes_fed(&self) -> f64 {
        self.0.progress().bytes as f64
    }

    /// Bytes the file has, once its header has been read.
    #[wasm_bindgen(getter, js_name = fileBytes)]
    pub fn file_bytes(&self) -> Option<f64> {
        self.0.progress().file_bytes.map(|bytes| bytes as f64)
    }

    /// Scans that are there for every tile.
    #[wasm_bindgen(getter, js_name = scansDone)]
    pub fn scans_done(&self) -> usize {
        self.0.progress().scans
    }

    /// A coarser photograph of what has come of every tile; none before the first scan is there, and once
    /// all is.
    pub fn preview(&self) -> Result<Option<Photo>, CodedError> {
        let (Some(transport), Some(head)) = (self.0.preview()?, self.0.head()) else {
            return Ok(None);
        };
        Ok(Some(Photo::new(transport, &head.metadata)))
    }

    /// The photograph, once nothing is wanted any more.
    pub fn finish(self) -> Result<Photo, CodedError> {
        let (transport, metadata) = self.0.finish()?;
        Ok(Photo::new(transport, &metadata))
    }
}
