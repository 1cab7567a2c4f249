//! The files of a capture that a page has: a dropped folder, or the contents of a zip.

use std::io::{self, ErrorKind};
use std::path::PathBuf;

use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::capture::CaptureFiles;

#[wasm_bindgen]
extern "C" {
    /// Reads files within a call: workers can (`FileReaderSync`).
    #[wasm_bindgen(typescript_type = "PageFiles")]
    #[derive(Clone, Debug)]
    pub type PageFiles;

    /// Bytes of the file `name`; `undefined` if there is no such file.
    #[wasm_bindgen(method, catch, js_name = size)]
    fn size_of(this: &PageFiles, name: &str) -> Result<Option<f64>, JsValue>;

    /// `length` bytes from `offset` on.
    #[wasm_bindgen(method, catch, js_name = read)]
    fn read_bytes(
        this: &PageFiles,
        name: &str,
        offset: f64,
        length: f64,
    ) -> Result<Vec<u8>, JsValue>;
}

#[wasm_bindgen(typescript_custom_section)]
const TYPESCRIPT: &str = "
/** Files that a worker reads within a call. Names are relative to the capture folder. */
export interface PageFiles {
  /** Bytes of the file; `undefined` if there is no such file. */
  size(name: string): number | undefined;
  /** Throws if the browser cannot read the file. */
  read(name: string, offset: number, length: number): Uint8Array;
}";

impl CaptureFiles for PageFiles {
    fn size(&self, name: &str) -> io::Result<u64> {
        let size = self.size_of(name).map_err(|thrown| read_error(&thrown))?;
        Ok(size.ok_or(ErrorKind::NotFound)? as u64)
    }

    fn read(&self, name: &str, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let count = CaptureFiles::size(self, name)?
            .saturating_sub(offset)
            .min(buffer.len() as u64);
        let bytes = self.read_bytes(name, offset as f64, count as f64);
        let bytes = bytes.map_err(|thrown| read_error(&thrown))?;
        let bytes = &bytes[..bytes.len().min(buffer.len())];
        buffer[..bytes.len()].copy_from_slice(bytes);
        Ok(bytes.len())
    }

    fn path(&self, name: &str) -> PathBuf {
        name.into()
    }
}

/// The error that the browser threw.
fn read_error(thrown: &JsValue) -> io::Error {
    let message = js_sys::Reflect::get(thrown, &"message".into());
    let message = message.ok().and_then(|message| message.as_string());
    io::Error::other(message.unwrap_or_else(|| "the browser cannot read it".to_owned()))
}
