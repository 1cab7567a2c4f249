//! Decoding a file as it arrives.

use wasm_bindgen::prelude::wasm_bindgen;

use super::{CodedError, Photo};
use crate::format::{Limits, Reader};

/// Takes the bytes of an `.ltm` file in pieces of any size and makes a [`Photo`] of them.
#[wasm_bindgen]
pub struct Decoder(Reader);

#[wasm_bindgen]
impl Decoder {
    /// A decoder at the start of a file that may decode to `maxDecodedBytes` bytes; 2 GiB if left
    /// out.
    #[wasm_bindgen(constructor)]
    pub fn new(#[wasm_bindgen(js_name = maxDecodedBytes)] max_decoded_bytes: Option<f64>) -> Self {
        let limits = max_decoded_bytes.map_or_else(Limits::default, |bytes| Limits {
            decoded_bytes: bytes as u64, // saturates; NaN is 0
        });
        Self(Reader::new(limits))
    }

    /// Takes the next bytes of the file.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<(), CodedError> {
        Ok(self.0.feed(self.0.position(), bytes)?)
    }

    /// Bytes fed so far.
    #[wasm_bindgen(getter, js_name = bytesFed)]
    pub fn bytes_fed(&self) -> f64 {
        self.0.position() as f64
    }

    /// Bytes the file has, once its header has been read.
    #[wasm_bindgen(getter, js_name = fileBytes)]
    pub fn file_bytes(&self) -> Option<f64> {
        self.0.progress().file_bytes.map(|bytes| bytes as f64)
    }

    /// The photograph, once the whole file has been fed.
    pub fn finish(self) -> Result<Photo, CodedError> {
        let (transport, metadata) = self.0.finish()?;
        Photo::new(transport, &metadata)
    }
}
