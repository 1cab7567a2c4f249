//! Assembly: tiles are quantised and compressed by the plan, and put together to a file.

use std::borrow::Cow;
use std::io::Write;

use serde::{Deserialize, Serialize};

use super::basis_rotation::BasisRotation;
use super::encoder_input::EncoderInput;
use super::scan_plan::SHARES;
use super::source_analysis::{AnalysedSource, for_tiles, non_empty};
use crate::format::checksum::checksum;
use crate::format::chunk::{ChunkEntry, ChunkId, EncodedChunk};
use crate::format::chunk_store::ChunkStore;
use crate::format::codec::basis_chunk::QuantisedBasis;
use crate::format::codec::direct_functions::{self, QuantisedDirectFunctions};
use crate::format::codec::half_float_codec;
use crate::format::codec::transform_encoder::QuantisedCoefficients;
use crate::format::error::FormatError;
use crate::format::extension::FormatExtension;
use crate::format::index::FileIndex;
use crate::format::metadata::MetadataText;
use crate::format::scan::{ProgressiveScan, ScanCoding};
use crate::job_executor::Executor;
use crate::transport::{Basis, Decibels, FloatTile, Geometry, SnrAccumulator};

/// Share of the error that the rounding of the basis may add.
const BASIS_ERROR_SHARE: f64 = 0.02;
/// Relative squared error of half-precision floats: 74 dB. Few values may have none, or six times as much;
/// the file claims no less, and the basis is not finer.
pub const HALVES_ERROR_RATIO: f64 = 4e-8;

/// A file ready to be written.
#[derive(Clone, Debug)]
pub struct EncodedFile<S = Vec<Vec<u8>>> {
    pub(super) index: FileIndex,
    pub(super) index_bytes: Vec<u8>,
    pub(super) chunks: S,
    /// Number of tiles with values that the numbers of a coding plan do not reach.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) clipped_tiles: usize,
}

impl<S: ChunkStore> EncodedFile<S> {
    /// The file index.
    pub fn index(&self) -> &FileIndex {
        &self.index
    }

    /// Bytes of the file.
    pub fn bytes(&self) -> u64 {
        self.index.header.file_bytes
    }

    /// SNR against the source; `None` if it is dark.
    pub fn snr(&self) -> Option<Decibels> {
        self.index.scans.last().map(|scan| scan.snr)
    }

    /// Number of tiles with clipped values, which are far above all of the sample that the file was planned from.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn clipped_tiles(&self) -> usize {
        self.clipped_tiles
    }

    /// A file of the chunks in `chunks`, whose `entries` are `[scan, tile]`.
    ///
    /// # Errors
    /// [`FormatError::TooMany`] bytes of extensions or metadata.
    pub(super) fn indexed(
        geometry: Geometry,
        scans: Vec<ProgressiveScan>,
        entries: Vec<ChunkEntry>,
        extensions: Vec<FormatExtension>,
        metadata: MetadataText,
        chunks: S,
    ) -> Result<Self, FormatError> {
        let (index, index_bytes) =
            FileIndex::encode(geometry, scans, entries, extensions, metadata)?;
        Ok(Self {
            index,
            index_bytes,
            chunks,
            #[cfg(not(target_arch = "wasm32"))]
            clipped_tiles: 0,
        })
    }

    /// Writes the file.
    ///
    /// # Errors
    /// [`FormatError::Write`], and those of the store.
    pub fn write(&self, out: &mut impl Write) -> Result<(), FormatError> {
        out.write_all(&self.index_bytes)
            .map_err(FormatError::Write)?;
        for chunk in self.index.chunks() {
            out.write_all(&self.chunk(chunk)?)
                .map_err(FormatError::Write)?;
        }
        Ok(())
    }

    /// The bytes of a chunk.
    ///
    /// # Errors
    /// Those of the store.
    pub fn chunk(&self, chunk: ChunkId) -> Result<Cow<'_, [u8]>, FormatError> {
        self.chunks.get(self.index.chunk_number(chunk))
    }
}

/// A tile, quantised scan by scan.
pub struct QuantisedTile {
    coefficients: Option<QuantisedCoefficients>,
    functions: Option<QuantisedDirectFunctions>,
}

/// A tile's chunks `[scan]`, and its squared error after each scan.
#[derive(Default)]
pub struct TileChunks {
    pub chunks: Vec<EncodedChunk>,
    pub errors: Vec<f64>,
    /// Whether a value is larger than the numbers of its last scan reach.
    #[cfg(not(target_arch = "wasm32"))]
    pub is_clipped: bool,
}

impl TileChunks {
    /// Encodes a tile over the file's basis, of which the first `rank` functions count, by `scans`; `order` is that of slots.
    ///
    /// # Errors
    /// [`FormatError::Compress`].
    pub fn new(
        tile: &FloatTile,
        rank: usize,
        order: &[u16],
        scans: &[ProgressiveScan],
    ) -> Result<Self, FormatError> {
        let is_lossless = |scan: &ProgressiveScan| {
            matches!(scan.coding, ScanCoding::Halves | ScanCoding::DirectHalves)
        };
        match scans.iter().any(is_lossless) {
            true => encode_halves(tile, rank, order, scans),
            false => QuantisedTile::new(tile, rank, order, scans, false).encode(scans),
        }
    }
}

impl QuantisedTile {
    /// Quantises a tile over the file's basis, of which the first `rank` functions count; `order` is that of slots.
    /// `keep_decoded` says whether [`decoded`](Self::decoded) will be called.
    pub fn new(
        tile: &FloatTile,
        rank: usize,
        order: &[u16],
        scans: &[ProgressiveScan],
        keep_decoded: bool,
    ) -> Self {
        let extent = tile.rect.extent;
        let (coefficients, functions) = (non_empty(&tile.coefficients), non_empty(&tile.functions));
        Self {
            coefficients: coefficients
                .map(|c| QuantisedCoefficients::new(extent, c, rank, scans, keep_decoded)),
            functions: functions.map(|tau| QuantisedDirectFunctions::new(tau, order, scans)),
        }
    }

    /// The error after `scans` scans, without that of the KLT.
    pub fn error(&self, scans: usize) -> SnrAccumulator {
        let coefficients = self.coefficients.iter().map(|q| &q.errors);
        let parts = coefficients.chain(self.functions.iter().map(|q| &q.errors));
        let errors = parts.map(|errors| SnrAccumulator {
            signal: errors[0],
            error: errors[scans],
        });
        errors.sum()
    }

    /// The tile as a reader decodes it, over the file's basis.
    pub fn decoded(&self, tile: &FloatTile, order: &[u16]) -> FloatTile {
        let extent = tile.rect.extent;
        let coefficients = self.coefficients.as_ref().map(|q| q.decoded(extent));
        let functions = self.functions.as_ref();
        FloatTile {
            rect: tile.rect,
            coefficients: coefficients.and_then(Result::ok).unwrap_or_default(),
            functions: functions.map_or(Vec::new(), |q| q.decoded(&tile.functions, order)),
        }
    }

    /// Whether a value is larger than the numbers of its last scan reach.
    #[cfg(not(target_arch = "wasm32"))]
    fn is_clipped(&self, scans: &[ProgressiveScan]) -> bool {
        let (coefficients, functions) = (self.coefficients.as_ref(), self.functions.as_ref());
        coefficients.is_some_and(|q| q.is_clipped(scans))
            || functions.is_some_and(|q| q.is_clipped(scans))
    }

    fn encode(&self, scans: &[ProgressiveScan]) -> Result<TileChunks, FormatError> {
        let coefficients = self.coefficients.as_ref().map(|q| q.chunks(scans));
        let functions = self.functions.as_ref().map(|q| q.chunks(scans));
        let mut chunks = vec![EncodedChunk::default(); scans.len()];
        for part in [coefficients, functions].into_iter().flatten() {
            for (chunk, own) in chunks.iter_mut().zip(part?) {
                if !own.bytes.is_empty() {
                    *chunk = own;
                }
            }
        }
        let klt_error = self.coefficients.as_ref().map_or(0.0, |q| q.klt_error);
        let errors = (1..=scans.len()).map(|scans| self.error(scans).error + klt_error);
        Ok(TileChunks {
            chunks,
            errors: errors.collect(),
            #[cfg(not(target_arch = "wasm32"))]
            is_clipped: self.is_clipped(scans),
        })
    }
}

/// The scans of all tiles as half-precision floats.
pub fn lossless_scans(analysed: &AnalysedSource<'_, impl Executor>) -> Vec<ProgressiveScan> {
    // A rotated coefficient is at most the norm of the input coefficients.
    let gains = (0..analysed.rank()).filter_map(|k| Some(analysed.rotation.as_ref()?.gain(k)));
    let input_rank = analysed.basis.map_or(0, Basis::rank);
    let gain = gains.fold((input_rank as f64).sqrt(), f64::max) as f32;
    let peak = (analysed.coefficient_peak * gain).max(analysed.function_peak);
    let step = half_float_codec::step_for(peak);
    let side = analysed.geometry.tile_side;
    let max_per_scan = direct_functions::max_slots(side) as usize;
    let (rank, slots) = (analysed.rank(), analysed.slots());
    // All items have the same bytes.
    let mut scans = Vec::new();
    for (coding, items) in [
        (ScanCoding::Halves, rank),
        (ScanCoding::DirectHalves, slots),
    ] {
        let mut first = 0;
        while first < items {
            let planned = match scans.is_empty() {
                true => SHARES.first,
                false => SHARES.scan,
            };
            let count = (planned * (rank + slots) as f64) as usize;
            let count = count.clamp(1, max_per_scan).min(items - first);
            // Ranks and slots are below 2^12.
            scans.push(ProgressiveScan::new(
                coding,
                first as u16,
                count as u16,
                step,
            ));
            first += count;
        }
    }
    scans
}

fn encode_halves(
    tile: &FloatTile,
    rank: usize,
    order: &[u16],
    scans: &[ProgressiveScan],
) -> Result<TileChunks, FormatError> {
    let mut encoded = TileChunks::default();
    let (mut energies, mut errors) = (Vec::new(), Vec::new());
    for scan in scans {
        let values = match scan.coding.is_direct() {
            true => half_float_codec::gather(&tile.functions, order.len(), scan, Some(order)),
            false => half_float_codec::gather(&tile.coefficients, rank, scan, None),
        };
        let energy = values.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
        energies.push(energy);
        errors.push(half_float_codec::error(&values, scan.step).max(HALVES_ERROR_RATIO * energy));
        #[cfg(not(target_arch = "wasm32"))]
        {
            encoded.is_clipped |= half_float_codec::is_clipped(&values, scan.step);
        }
        encoded.chunks.push(match values.iter().all(|v| *v == 0.0) {
            true => EncodedChunk::default(),
            false => EncodedChunk {
                content_bytes: half_float_codec::content_bytes(values.len()) as u32,
                bytes: half_float_codec::encode(&values, scan.step)?,
            },
        });
    }
    let (mut error, mut missing) = (0.0, energies.iter().sum::<f64>());
    for (energy, scan_error) in energies.iter().zip(errors) {
        (error, missing) = (error + scan_error, missing - energy);
        encoded.errors.push(error + missing.max(0.0));
    }
    Ok(encoded)
}

/// Basis functions, rounded so that the rounding adds its share to `error`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RoundedBasis {
    functions: QuantisedBasis,
    /// `[component]`: squared error of a function.
    errors: Vec<f64>,
}

impl RoundedBasis {
    pub fn new(rotation: &BasisRotation, error: f64) -> Self {
        let kernels = &rotation.basis.kernels;
        let area = kernels.first().map_or(0, Vec::len);
        let steps = rotation.energies.iter().map(|energy| {
            let error = BASIS_ERROR_SHARE * error / rotation.rank() as f64;
            (12.0 * error / (area as f64 * energy.max(f64::MIN_POSITIVE))).sqrt() as f32
        });
        let functions = QuantisedBasis::new(kernels, &steps.collect::<Vec<_>>());
        let errors = kernels.iter().enumerate();
        let errors = errors.map(|(k, kernel)| functions.error(k, kernel));
        Self {
            errors: errors.collect(),
            functions,
        }
    }

    /// Puts the basis chunks of a file of this `geometry` into its store, and their lengths and checksums into `scans`.
    ///
    /// # Errors
    /// [`FormatError::Compress`], and those of the store.
    pub fn put_chunks(
        &self,
        geometry: &Geometry,
        scans: &mut [ProgressiveScan],
        store: &mut impl ChunkStore,
    ) -> Result<(), FormatError> {
        let (tiles, area) = (geometry.tile_grid().area(), geometry.window.area());
        let mut known = 0;
        for (number, scan) in scans.iter_mut().enumerate() {
            let functions = scan.new_basis_functions(known);
            if functions > 0 {
                let bytes = self.functions.encode(known, functions, area)?;
                known += functions;
                scan.basis_bytes = bytes.len() as u32; // below 2^24
                scan.basis_crc = checksum(&bytes);
                let basis = ChunkId {
                    scan: number,
                    tile: None,
                };
                store.put(basis.number(tiles), bytes)?;
            }
        }
        Ok(())
    }

    /// Squared errors that the rounding adds after each scan, for coefficients of these `energies`, `[component]`.
    pub fn errors(&self, energies: &[f64], scans: &[ProgressiveScan]) -> Vec<f64> {
        let (mut known, mut error) = (0, 0.0);
        let errors = scans.iter().map(|scan| {
            let new = known..known + scan.new_basis_functions(known);
            known = new.end;
            for k in new {
                error += energies[k] * self.errors[k];
            }
            error
        });
        errors.collect()
    }
}

/// The entry of a chunk in the directory.
pub fn chunk_entry(chunk: &EncodedChunk) -> ChunkEntry {
    ChunkEntry {
        bytes: chunk.bytes.len() as u32, // below 2^25
        content_bytes: chunk.content_bytes,
        crc: checksum(&chunk.bytes),
    }
}

/// Encodes all tiles by `scans`, and puts the file together.
///
/// # Errors
/// As [`EncodedFile::new`].
pub fn encode<S: ChunkStore>(
    source: &EncoderInput<'_>,
    analysed: &AnalysedSource<'_, impl Executor>,
    mut scans: Vec<ProgressiveScan>,
    mut store: S,
) -> Result<EncodedFile<S>, FormatError> {
    let rotation = analysed.rotation.as_ref();
    let geometry = &source.geometry;
    let tiles = geometry.tile_grid().area();
    let mut entries = vec![ChunkEntry::default(); scans.len() * tiles];
    // Every prefix lacks the dropped components.
    let kept = rotation.map_or(0.0, BasisRotation::energy);
    let mut errors = vec![(analysed.coefficient_energy - kept).max(0.0); scans.len()];
    let encode = |tile: FloatTile| {
        let tile = analysed.rotated(tile);
        TileChunks::new(&tile, analysed.rank(), &analysed.order, &scans)
    };
    for_tiles(source, analysed.executor, encode, |i, tile| {
        let tile = tile?;
        add_errors(&mut errors, &tile.errors);
        for (scan, chunk) in tile.chunks.iter().enumerate() {
            entries[scan * tiles + i] = chunk_entry(chunk);
        }
        store.put_tile(i, tiles, tile.chunks.into_iter().map(|chunk| chunk.bytes))
    })?;
    if let Some(rotation) = rotation {
        let basis = RoundedBasis::new(rotation, errors.last().copied().unwrap_or(0.0));
        basis.put_chunks(geometry, &mut scans, &mut store)?;
        add_errors(&mut errors, &basis.errors(&rotation.energies, &scans));
    }
    set_snrs(&mut scans, analysed.energy, &errors);
    let extensions = source.extensions.clone();
    EncodedFile::indexed(
        geometry.clone(),
        scans,
        entries,
        extensions,
        MetadataText::encode(&source.metadata)?,
        store,
    )
}

/// Adds squared errors, `[scan]`, to sums.
pub fn add_errors(sums: &mut [f64], errors: &[f64]) {
    for (sum, error) in sums.iter_mut().zip(errors) {
        *sum += error;
    }
}

/// Gives each scan the SNR of the squared `error` after it, against the `energy` of the source.
pub fn set_snrs(scans: &mut [ProgressiveScan], energy: f64, errors: &[f64]) {
    for (scan, &error) in scans.iter_mut().zip(errors) {
        let error = SnrAccumulator {
            signal: energy,
            error,
        };
        scan.snr = Decibels(f64::from(error.finite_snr().0 as f32));
    }
}
