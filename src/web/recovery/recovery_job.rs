//! One recovery: from measurements to a file.

use std::io::{self, ErrorKind};

use js_sys::Function;
use wasm_bindgen::prelude::wasm_bindgen;

use super::group_executor::{GroupExecutor, ProcessGroup};
use super::measurement_input::MeasurementInput;
use crate::capture::Measurements;
use crate::export::{
    self, ExportSettings, FileQuality, MIN_PLAUSIBLE_SNR, PreparedExport, Provenance,
    has_implausible_saturation,
};
use crate::recover::{
    MIN_PATTERNS, Method, PhotographFault, PreparedRecovery, RecoverError, SparsityBasis,
    TailEstimate,
};
use crate::transport::{Basis, Decibels, Window};
use crate::web::CodedError;
use crate::web::progress::{ReportingExecutor, report_jobs_of};
use crate::web::recovery_error::out_of_memory;

/// A recovery that is prepared. Tiles can be recovered in any order, here or in other workers.
#[wasm_bindgen]
pub struct Recovery {
    pub(super) input: MeasurementInput,
    prepared: PreparedExport,
    method: Method,
    /// The tiles recovered so far.
    records: Vec<Option<Vec<u8>>>,
    overexposed_pixels: usize,
    file_snr: Option<Decibels>,
}

#[wasm_bindgen]
impl Recovery {
    /// Chooses the window, if none is given, and learns or chooses what the method (`learned`, `nnls` or `bpdn`, with
    /// basis `identity`, `dct` or `haar`) needs: alone, or in a `group` with workers that call this
    /// for the same measurements. `onJob` gets the number of jobs done.
    ///
    /// # Errors
    /// Codes that begin with `recover-`; `worker-unavailable` if the group has lost a worker.
    pub async fn prepare(
        input: &MeasurementInput,
        method: &str,
        basis: Option<String>,
        window: Option<u32>,
        #[wasm_bindgen(js_name = onJob)] on_job: Function,
        group: Option<ProcessGroup>,
    ) -> Result<Self, CodedError> {
        let method = parse_method(method, basis.as_deref())?;
        let settings = ExportSettings {
            method,
            window: window.map(Window::new).transpose()?,
            is_registered: true,
        };
        let executor = GroupExecutor::join(group);
        let preparation = export::prepare(&input.measurements, settings, &executor);
        let prepared = report_jobs_of(&on_job, preparation).await;
        let prepared = prepared.map_err(|error| name_shots(input, error))?;
        let tiles = prepared.recovery.geometry().tile_grid().area();
        Ok(Self {
            input: input.clone(),
            prepared,
            method,
            records: vec![None; tiles],
            overexposed_pixels: 0,
            file_snr: None,
        })
    }

    /// Bytes for [`TileRecovery`](super::TileRecovery) in another worker.
    ///
    /// # Errors
    /// `recover-memory` if memory is missing.
    pub fn pack(&self) -> Result<Vec<u8>, CodedError> {
        let Measurements {
            patterns,
            full_scale,
            noise,
            ..
        } = &*self.input.measurements;
        postcard::to_allocvec(&(self.recovery(), patterns, full_scale, noise))
            .map_err(|_| out_of_memory())
    }

    /// The first row of the photographs that the tile rows from `first` to `end` depend on.
    #[wasm_bindgen(js_name = firstRow)]
    pub fn first_row(&self, first: u32) -> u32 {
        let geometry = self.recovery().geometry();
        (first * geometry.tile_side).saturating_sub(self.recovery().halo())
    }

    /// The samples of all photographs that the tile rows from `first` to `end`, exclusive, depend on.
    #[wasm_bindgen(js_name = packRows)]
    pub fn pack_rows(&self, first: u32, end: u32) -> Vec<f32> {
        let geometry = self.recovery().geometry();
        let end = (end * geometry.tile_side + self.recovery().halo()).min(geometry.camera.height);
        let width = geometry.camera.width as usize;
        let rows = self.first_row(first) as usize * width..end as usize * width;
        let photos = self.input.measurements.photos.iter();
        photos
            .flat_map(|photo| photo[rows.clone()].as_flattened())
            .copied()
            .collect()
    }

    /// Recovers a tile here.
    ///
    /// # Errors
    /// Code `internal` if there is no such tile; `recover-memory` if memory is missing.
    #[wasm_bindgen(js_name = recoverTile)]
    pub fn recover_tile(&mut self, index: usize) -> Result<(), CodedError> {
        let record = self.tile_record(index)?;
        self.put_tile(index, record)
    }

    /// Recovers a tile for [`put_tile`](Self::put_tile) in another worker of the group.
    ///
    /// # Errors
    /// Code `internal` if there is no such tile; `recover-memory` if memory is missing.
    #[wasm_bindgen(js_name = tileRecord)]
    pub fn tile_record(&self, index: usize) -> Result<Vec<u8>, CodedError> {
        encoded_tile(self.recovery(), &self.input.measurements, index)
    }

    /// Takes a tile that another worker has recovered.
    ///
    /// # Errors
    /// Code `internal` if there is no such tile.
    #[wasm_bindgen(js_name = putTile)]
    pub fn put_tile(&mut self, index: usize, record: Vec<u8>) -> Result<(), CodedError> {
        let slot = self.records.get_mut(index).ok_or_else(no_such_tile)?;
        *slot = Some(record);
        if self.input.saturated_samples > 0 {
            let rect = self.prepared.recovery.geometry().tile(index);
            let measurements = &self.input.measurements;
            self.overexposed_pixels += measurements.count_overexposed_pixels(rect, MIN_PATTERNS);
        }
        Ok(())
    }

    /// The bytes of the file, once all tiles are recovered. Without a quality it is as large as the noise of the
    /// photographs justifies; `snr` is that relative to the recovered transport, in decibels.
    ///
    /// # Errors
    /// Codes that begin with `format-`; `internal` if a tile is missing.
    pub fn encode(
        &mut self,
        snr: Option<f64>,
        #[wasm_bindgen(js_name = maxBytes)] max_bytes: Option<f64>,
        lossless: bool,
        #[wasm_bindgen(js_name = onJob)] on_job: &Function,
    ) -> Result<Vec<u8>, CodedError> {
        let quality = match (snr, max_bytes) {
            (Some(snr), _) => FileQuality::Snr(Decibels(snr)),
            (_, Some(bytes)) => FileQuality::MaxBytes(bytes as u64),
            _ if lossless => FileQuality::Lossless,
            _ => FileQuality::ByNoise,
        };
        let metadata = self.metadata();
        let file = ReportingExecutor::run(on_job, |executor| {
            let record = |i| self.record(i);
            export::encode_file(
                self.recovery(),
                &record,
                metadata,
                quality,
                executor,
                || Ok(Vec::new()),
            )
        })?;
        let mut bytes = Vec::new();
        let length = usize::try_from(file.bytes()).map_err(|_| out_of_memory())?;
        bytes
            .try_reserve_exact(length)
            .map_err(|_| out_of_memory())?;
        file.write(&mut bytes)?;
        self.file_snr = file.snr();
        Ok(bytes)
    }

    /// Number of tiles.
    #[wasm_bindgen(getter)]
    pub fn tiles(&self) -> usize {
        self.records.len()
    }

    /// Number of tiles in a row of tiles.
    #[wasm_bindgen(getter, js_name = tileColumns)]
    pub fn tile_columns(&self) -> u32 {
        self.recovery().geometry().tile_grid().width
    }

    /// Side of the window, in light elements.
    #[wasm_bindgen(getter)]
    pub fn window(&self) -> u32 {
        self.recovery().geometry().window.side()
    }

    /// Number of basis functions; `undefined` if every tile is direct.
    #[wasm_bindgen(getter)]
    pub fn rank(&self) -> Option<usize> {
        self.recovery().basis().map(Basis::rank)
    }

    /// SNR of the recovered transport in decibels, estimated on held-out patterns.
    #[wasm_bindgen(getter, js_name = expectedSnr)]
    pub fn expected_snr(&self) -> Option<f64> {
        self.prepared.expected_snr().map(|snr| snr.0)
    }

    /// SNR of the encoded file relative to the recovered transport, in decibels.
    #[wasm_bindgen(getter, js_name = fileSnr)]
    pub fn file_snr(&self) -> Option<f64> {
        self.file_snr.map(|snr| snr.0)
    }

    /// Estimated share of light from outside the window, if the window was estimated.
    #[wasm_bindgen(getter)]
    pub fn leak(&self) -> Option<f64> {
        match self.prepared.band {
            Some(TailEstimate::Bounded { tail_fraction }) => Some(tail_fraction),
            _ => None,
        }
    }

    /// Number of saturated samples, which are left out.
    #[wasm_bindgen(getter, js_name = saturatedSamples)]
    pub fn saturated_samples(&self) -> usize {
        self.input.saturated_samples
    }

    /// Number of pixels, of the tiles recovered so far, that are saturated in nearly all photographs.
    #[wasm_bindgen(getter, js_name = overexposedPixels)]
    pub fn overexposed_pixels(&self) -> usize {
        self.overexposed_pixels
    }

    /// Codes of doubts: `low-snr`, `band-unbounded`, `band-undetermined`, `saturation` and `overexposed`; then one for each
    /// photograph that is left out, with the index of its shot: `photograph-unknown-pattern 3`, `photograph-object 3`,
    /// `photograph-distorted 3`, `photograph-pattern 3 7` (it shows the pattern of shot 7), and `photograph-blend 3 7 50`
    /// (50 % of the light is that pattern's); one for all that are moved, `photograph-moved 3 20` (shot 3 and 19 others);
    /// and `camera-trembled 12` (by 0.12 pixels, root mean square).
    #[wasm_bindgen(getter)]
    pub fn warnings(&self) -> Vec<String> {
        let is_low = |snr: Decibels| snr < MIN_PLAUSIBLE_SNR;
        let (band, saturated) = (self.prepared.band, self.input.saturated_samples);
        let warnings = [
            (self.prepared.expected_snr().is_some_and(is_low), "low-snr"),
            (band == Some(TailEstimate::Unbounded), "band-unbounded"),
            (
                band == Some(TailEstimate::Undetermined),
                "band-undetermined",
            ),
            (
                has_implausible_saturation(saturated, &self.input.measurements),
                "saturation",
            ),
            (self.overexposed_pixels > 0, "overexposed"),
        ];
        let given = warnings.into_iter().filter(|(applies, _)| *applies);
        let doubts = given.map(|(_, name)| name.to_owned());
        let faults = self.recovery().faults();
        let shots = &self.input.provenance.shots;
        let mut moved = faults.iter().filter(|(_, fault)| fault.is_moved());
        let (count, first) = (moved.clone().count(), moved.next());
        // Of those that moved, the first stands for all.
        let told = faults
            .iter()
            .filter(|fault| !fault.1.is_moved() || first == Some(fault));
        let warnings = told.map(|&(l, fault)| fault_warning(shots, l, fault, count));
        let shift = self.recovery().trembling();
        let trembled =
            shift.map(|shift| format!("camera-trembled {}", (100.0 * shift + 0.5) as u32));
        doubts.chain(warnings).chain(trembled).collect()
    }
}

impl Recovery {
    pub(super) fn recovery(&self) -> &PreparedRecovery {
        &self.prepared.recovery
    }

    pub(super) fn record(&self, index: usize) -> io::Result<Vec<u8>> {
        let record = self.records.get(index).cloned().flatten();
        record.ok_or_else(|| io::Error::from(ErrorKind::NotFound))
    }

    pub(super) fn metadata(&self) -> crate::format::Metadata {
        export::metadata(&self.input.provenance, self.method)
    }
}

/// The record of a tile.
pub(super) fn encoded_tile(
    recovery: &PreparedRecovery,
    measurements: &Measurements,
    index: usize,
) -> Result<Vec<u8>, CodedError> {
    let geometry = recovery.geometry();
    if index >= geometry.tile_grid().area() {
        return Err(no_such_tile());
    }
    let rect = geometry.tile(index);
    if !measurements.has_tile(rect) {
        return Err(CodedError::internal("a tile's photographs are missing"));
    }
    let tile = recovery.tile(measurements, rect);
    Ok(export::encode_tile(&tile))
}

fn no_such_tile() -> CodedError {
    CodedError::internal("the recovery has no such tile")
}

fn parse_method(method: &str, basis: Option<&str>) -> Result<Method, CodedError> {
    let invalid = |field: &str, value: &str, allowed: &str| {
        let message = format!("{field} is \"{value}\"; it must be {allowed}");
        CodedError::new("recover-options", message)
    };
    Ok(match (method, basis.unwrap_or("identity")) {
        ("learned", _) => Method::Learned,
        ("nnls", _) => Method::Nnls,
        ("bpdn", "identity") => Method::Bpdn(SparsityBasis::Identity),
        ("bpdn", "dct") => Method::Bpdn(SparsityBasis::Dct),
        ("bpdn", "haar") => Method::Bpdn(SparsityBasis::Haar),
        ("bpdn", basis) => return Err(invalid("basis", basis, "identity, dct or haar")),
        (method, _) => return Err(invalid("method", method, "learned, nnls or bpdn")),
    })
}

/// The warning of photograph `l`'s fault; `moved` photographs are left out because the camera moved.
fn fault_warning(shots: &[usize], l: usize, fault: PhotographFault, moved: usize) -> String {
    let shot = |l: usize| shots.get(l).copied().unwrap_or(l);
    let (code, own) = (fault.code(), shot(l));
    match fault {
        PhotographFault::PatternOf { other } => format!("{code} {own} {}", shot(other)),
        PhotographFault::Blend { other, share } => {
            let percent = (100.0 * share).round() as u32;
            format!("{code} {own} {} {percent}", shot(other))
        }
        PhotographFault::Moved { .. } => format!("{code} {own} {moved}"),
        _ => format!("{code} {own}"),
    }
}

/// The error, with the shots that it is about.
fn name_shots(input: &MeasurementInput, error: RecoverError) -> CodedError {
    let RecoverError::MismatchedPatterns { pattern_indices } = &error else {
        return error.into();
    };
    let names = pattern_indices.iter().map(|&l| {
        let Provenance {
            shots, photographs, ..
        } = &*input.provenance;
        let shot = shots.get(l).unwrap_or(&l);
        match photographs.get(l).map(|name| &**name) {
            None | Some("") => format!("photograph {shot}"),
            Some(name) => format!("shots[{shot}] ({name})"),
        }
    });
    let names = names.collect::<Vec<_>>().join(", ");
    let coded = CodedError::from(error);
    CodedError::new(coded.code, format!("{names}: {}", coded.message))
}
