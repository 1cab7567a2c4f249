//! The files of a capture that a page has: a dropped folder, or the contents of a zip.

use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
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
    #[wasm_bindgen(method, catch)]
    fn size(this: &PageFiles, name: &str) -> Result<Option<f64>, JsValue>;

    /// `length` bytes from `offset` on.
    #[wasm_bindgen(method, catch)]
    fn read(this: &PageFiles, name: &str, offset: f64, length: f64) -> Result<Vec<u8>, JsValue>;
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
    type File = PageFile;

    fn open(&self, name: &str) -> io::Result<PageFile> {
        let size = self.size(name).map_err(|thrown| read_error(&thrown))?;
        Ok(PageFile {
            files: self.clone(),
            name: name.to_owned(),
            position: 0,
            length: size.ok_or(ErrorKind::NotFound)? as u64,
        })
    }

    fn path(&self, name: &str) -> PathBuf {
        name.into()
    }
}

/// An opened file.
#[derive(Debug)]
pub struct PageFile {
    files: PageFiles,
    name: String,
    position: u64,
    length: u64,
}

impl Read for PageFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self
            .length
            .saturating_sub(self.position)
            .min(buffer.len() as u64);
        let (offset, length) = (self.position as f64, count as f64);
        let bytes = self.files.read(&self.name, offset, length);
        let bytes = bytes.map_err(|thrown| read_error(&thrown))?;
        let bytes = &bytes[..bytes.len().min(buffer.len())];
        buffer[..bytes.len()].copy_from_slice(bytes);
        self.position += bytes.len() as u64;
        Ok(bytes.len())
    }
}

impl Seek for PageFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = match to {
            SeekFrom::Start(position) => Some(position),
            SeekFrom::Current(by) => self.position.checked_add_signed(by),
            SeekFrom::End(by) => self.length.checked_add_signed(by),
        };
        self.position = position.ok_or(ErrorKind::InvalidInput)?;
        Ok(self.position)
    }
}

/// The error that the browser threw.
fn read_error(thrown: &JsValue) -> io::Error {
    let message = js_sys::Reflect::get(thrown, &"message".into());
    let message = message.ok().and_then(|message| message.as_string());
    io::Error::other(message.unwrap_or_else(|| "the browser cannot read it".to_owned()))
}
