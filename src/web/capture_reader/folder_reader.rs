//! A capture folder, read for the module of recovery.

use wasm_bindgen::prelude::wasm_bindgen;

use super::page_files::PageFiles;
use crate::capture::{CameraPixelSet, CameraRowSet, CaptureFolder, DarkFrame};
use crate::export::{Provenance, select_shots};
use crate::web::CodedError;
use crate::web::recovery_error::out_of_memory;

/// Reads the shots of a capture folder.
#[wasm_bindgen]
pub struct CaptureReader {
    folder: CaptureFolder<PageFiles>,
    dark: DarkFrame,
}

#[wasm_bindgen]
impl CaptureReader {
    /// Reads the manifest and the dark frame.
    ///
    /// # Errors
    /// Codes that begin with `capture-`.
    pub fn open(files: PageFiles) -> Result<Self, CodedError> {
        let folder = CaptureFolder::from_files(files)?;
        let dark = folder.read_dark(&CameraPixelSet::all(folder.manifest().camera.extent()))?;
        Ok(Self { folder, dark })
    }

    /// Number of shots in the folder.
    #[wasm_bindgen(getter)]
    pub fn shots(&self) -> usize {
        self.folder.manifest().shots.len()
    }

    /// Fields of the manifest that are ignored because they are unknown.
    #[wasm_bindgen(getter, js_name = unknownFields)]
    pub fn unknown_fields(&self) -> Vec<String> {
        self.folder.manifest().unknown.clone()
    }

    /// All that a recovery from the first `count` shots, or from all but those held out, needs beside the photographs,
    /// for [`CaptureBuilder`](crate::web::CaptureBuilder) of the module of recovery.
    ///
    /// # Errors
    /// Codes that begin with `capture-`; `recover-correspondence` if the Gray code is unclear, or the
    /// manifest has a correspondence that bends; `recover-patterns` if
    /// there are fewer shots; `recover-memory` if memory is missing.
    pub fn calibration(&self, count: Option<usize>) -> Result<Vec<u8>, CodedError> {
        let (folder, dark) = (&self.folder, &self.dark);
        let manifest = folder.manifest();
        let shots = select_shots(&manifest.shots, count)?;
        folder.open_flood()?;
        let correspondence = match &manifest.correspondence {
            Some(correspondence) if correspondence.displacement.is_some() => {
                let message = "capture.json: the correspondence bends, and pages recover with affine ones only; recover this \
                               capture with ltm-export, or remove \"correspondence.displacement\"";
                return Err(CodedError::new("recover-correspondence", message));
            }
            Some(correspondence) => correspondence.clone(),
            None => {
                let rows = CameraRowSet::all(manifest.camera.height);
                let photos = folder.read_gray_code(dark, &rows)?;
                photos.fit_affine(manifest.camera.extent())?
            }
        };
        let patterns = shots.iter().map(|&i| folder.read_pattern(i));
        let patterns = patterns.collect::<Result<_, _>>()?;
        let noise = dark.noise(&CameraPixelSet::all(manifest.camera.extent()));
        let measurements = folder.empty_measurements(&shots, patterns, correspondence, noise);
        let provenance = Provenance::new(manifest, &shots);
        postcard::to_allocvec(&(measurements, provenance)).map_err(|_| out_of_memory())
    }

    /// The photograph of shot `i` as measurements, `[N, 3]`; NaN where it is saturated.
    ///
    /// # Errors
    /// Codes that begin with `capture-`; `internal` if there is no such shot.
    pub fn photograph(&self, i: usize) -> Result<Vec<f32>, CodedError> {
        self.check_shot(i)?;
        let (photo, _) = self.folder.open_shot(i)?.read_all(&self.dark)?;
        Ok(photo.into_flattened())
    }

    /// The light of shot `i`, linear RGB `[M, 3]`.
    ///
    /// # Errors
    /// Codes that begin with `capture-`; `internal` if there is no such shot.
    pub fn light(&self, i: usize) -> Result<Vec<f32>, CodedError> {
        self.check_shot(i)?;
        Ok(self.folder.read_pattern(i)?.rgb())
    }
}

impl CaptureReader {
    fn check_shot(&self, i: usize) -> Result<(), CodedError> {
        match i < self.shots() {
            true => Ok(()),
            false => Err(CodedError::internal("the capture has no such shot")),
        }
    }
}
