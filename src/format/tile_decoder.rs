//! Decoding one tile: chunks in the order of scans to coefficients c and direct functions d.

use super::chunk::ChunkId;
use super::codec::transform::CoefficientPlanes;
use super::codec::{basis_chunk, direct_functions, half_float_codec};
use super::error::{FormatError, SectionError};
use super::index::FileIndex;
use super::memory_budget::{MemoryBudget, vec_bytes};
use super::partial_functions::PartialFunctions;
use super::scan::{ProgressiveScan, ScanCoding};
use crate::transport::{Basis, CHANNELS, CoefficientCodes, FloatTile, Tile};

/// A tile as the sum of its chunks so far.
#[derive(Debug, Default)]
pub(super) struct TileDecoder {
    /// Number of the tile.
    tile: usize,
    /// Number of scans that are decoded or have no chunk for the tile.
    pub scans: usize,
    /// Of coding 1.
    planes: CoefficientPlanes,
    /// Of coding 2, `[pixel, component]`.
    coefficients: Vec<[f32; CHANNELS]>,
    functions: PartialFunctions,
}

impl TileDecoder {
    /// With `max_components` it reads no more components.
    pub fn new(tile: usize, max_components: Option<usize>) -> Self {
        Self {
            tile,
            planes: CoefficientPlanes {
                max_components,
                ..CoefficientPlanes::default()
            },
            ..Self::default()
        }
    }

    /// Bytes allocated.
    pub fn bytes(&self) -> u64 {
        self.planes.bytes() + vec_bytes(&self.coefficients) + self.functions.bytes()
    }

    /// Adds the tile's chunk of the next scan. `order` is the centre-out order.
    ///
    /// # Errors
    /// [`FormatError::DamagedSection`], and the errors of `budget`, which keeps only [`bytes`](Self::bytes) reserved.
    pub fn add(
        &mut self,
        index: &FileIndex,
        order: &[u16],
        bytes: &[u8],
        budget: &MemoryBudget,
    ) -> Result<(), FormatError> {
        let chunk = ChunkId {
            scan: self.scans,
            tile: Some(self.tile),
        };
        let (scratch, before) = (budget.scratch(), self.bytes());
        let scan = &index.scans[self.scans];
        let tokens = index.entry(self.scans, self.tile).content_bytes;
        let extent = index.header.geometry.tile(self.tile).extent;
        let (pixels, rank) = (extent.area(), usize::from(index.header.rank));
        let mut decode = || -> Result<(), SectionError> {
            match scan.coding {
                ScanCoding::Transform => self.planes.add(extent, scan, bytes, tokens, budget),
                ScanCoding::Halves => {
                    if self.coefficients.is_empty() {
                        self.coefficients = budget.try_zeroed(pixels * rank)?;
                    }
                    half_float_codec::add(&mut self.coefficients, rank, scan, bytes, budget)
                }
                ScanCoding::Direct | ScanCoding::DirectHalves => {
                    let functions = &mut self.functions;
                    let functions =
                        functions.start_chunk(index, self.tile, scan, tokens, budget)?;
                    let slots = &order[scan.items()];
                    if scan.coding == ScanCoding::Direct {
                        direct_functions::read(functions, pixels, slots, bytes, tokens, budget)?;
                    } else {
                        half_float_codec::read_functions(functions, pixels, slots, bytes, budget)?;
                    }
                    functions.entries.shrink_to_fit();
                    Ok(())
                }
            }
        };
        let decoded = decode();
        scratch.keep(self.bytes() - before);
        decoded.map_err(|error| error.in_chunk(chunk))?;
        self.scans += 1;
        Ok(())
    }

    /// The first `rank` components of the coefficients, `[pixel, component]`; empty if all are zero.
    fn coefficients(
        &self,
        index: &FileIndex,
        rank: usize,
        budget: &MemoryBudget,
    ) -> Result<Vec<[f32; CHANNELS]>, FormatError> {
        if !self.planes.is_dark() {
            let extent = index.header.geometry.tile(self.tile).extent;
            return self.planes.coefficients(extent, rank, budget);
        }
        let file_rank = usize::from(index.header.rank).max(1);
        let pixels = self.coefficients.chunks_exact(file_rank);
        let mut coefficients = budget.try_with_capacity(pixels.len() * rank)?;
        for pixel in pixels {
            coefficients.extend_from_slice(&pixel[..rank]);
        }
        Ok(coefficients)
    }

    /// The tile so far, by the first `rank` components, as codes. Only their bytes stay reserved.
    ///
    /// # Errors
    /// The errors of `budget`.
    pub fn quantise(
        &self,
        index: &FileIndex,
        rank: usize,
        budget: &MemoryBudget,
    ) -> Result<Tile, FormatError> {
        let rect = index.header.geometry.tile(self.tile);
        let mut quantised = Tile::dark(rect);
        let scratch = budget.scratch();
        let coefficients = self.coefficients(index, rank, budget)?;
        if !coefficients.is_empty() {
            let codes = budget.try_zeroed(Tile::texels(rect, rank))?;
            quantised.coefficients = CoefficientCodes::quantise(rect, &coefficients, rank, codes);
        }
        if !self.functions.is_empty() {
            let area = index.header.geometry.window.area();
            quantised.functions = self.functions.quantise(rect, area, budget)?;
        }
        scratch.keep(quantised.bytes() as u64);
        Ok(quantised)
    }
}

/// Decodes the basis chunk of a scan into `kernels`, which are those of the whole file.
pub(super) fn decode_basis_chunk(
    index: &FileIndex,
    scan: usize,
    bytes: &[u8],
    kernels: &mut [Vec<f32>],
    budget: &MemoryBudget,
) -> Result<(), FormatError> {
    let functions = &mut kernels[index.new_basis_functions(scan)];
    let area = index.header.geometry.window.area();
    let _scratch = budget.scratch();
    let decoded = basis_chunk::decode(bytes, functions, area, budget);
    decoded.map_err(|error| error.in_chunk(ChunkId { scan, tile: None }))
}

/// Decodes one tile of a file by itself; `fetch` gives the bytes of its chunks.
///
/// # Errors
/// The errors of `fetch`, and a [`FormatError`] if a chunk is damaged or memory is refused.
pub fn decode_tile<E: From<FormatError>>(
    index: &FileIndex,
    tile: usize,
    mut fetch: impl FnMut(ChunkId) -> Result<Vec<u8>, E>,
) -> Result<FloatTile, E> {
    let budget = MemoryBudget::unlimited();
    let order = direct_functions::centre_out_order(index.header.geometry.window, &budget)?;
    let mut decoder = TileDecoder::new(tile, None);
    for scan in 0..index.scans.len() {
        if index.entry(scan, tile).bytes == 0 {
            decoder.scans += 1;
            continue;
        }
        let chunk = ChunkId {
            scan,
            tile: Some(tile),
        };
        let bytes = fetch(chunk)?;
        index.check_crc(chunk, &bytes)?;
        decoder.add(index, &order, &bytes, &budget)?;
    }
    let rect = index.header.geometry.tile(tile);
    let (pixels, area) = (rect.extent.area(), order.len());
    Ok(FloatTile {
        rect,
        coefficients: decoder.coefficients(index, index.header.rank.into(), &budget)?,
        functions: decoder.functions.values(pixels, area, &budget)?,
    })
}

/// Decodes the basis of a file; `fetch` gives the bytes of its basis chunks.
///
/// # Errors
/// The errors of `fetch`, and a [`FormatError`] if a chunk is damaged or memory is refused.
pub fn decode_basis<E: From<FormatError>>(
    index: &FileIndex,
    mut fetch: impl FnMut(ChunkId) -> Result<Vec<u8>, E>,
) -> Result<Basis, E> {
    let budget = MemoryBudget::unlimited();
    let mut kernels = index.try_zeroed_basis(&budget)?;
    for chunk in index.chunks().filter(|chunk| chunk.tile.is_none()) {
        let bytes = fetch(chunk)?;
        index.check_crc(chunk, &bytes)?;
        decode_basis_chunk(index, chunk.scan, &bytes, &mut kernels, &budget)?;
    }
    Ok(Basis { kernels })
}

/// Checks one chunk of a file by itself: its length, its checksum, and that it decodes.
///
/// # Errors
/// The [`FormatError`] that a reader would report.
pub fn check(index: &FileIndex, chunk: ChunkId, bytes: &[u8]) -> Result<(), FormatError> {
    let range = index.range(chunk);
    let (got, expected) = (bytes.len() as u64, range.end - range.start);
    if got < expected {
        return Err(FormatError::Truncated {
            got: range.start + got,
            need: index.header.file_bytes,
        });
    }
    if got > expected {
        return Err(FormatError::ChunkLength {
            chunk,
            got,
            expected,
        });
    }
    index.check_crc(chunk, bytes)?;
    let (ChunkId { scan, tile }, budget) = (chunk, MemoryBudget::unlimited());
    let Some(tile) = tile else {
        let mut kernels = index.try_zeroed_basis(&budget)?;
        return decode_basis_chunk(index, scan, bytes, &mut kernels, &budget);
    };
    let record = &index.scans[scan];
    if record.coding == ScanCoding::Halves {
        // The scan's components alone: lossless files have many scans, and all components of a tile can be a gigabyte.
        let rank = usize::from(record.count);
        let pixels = index.header.geometry.tile(tile).extent.area();
        let mut values = budget.try_zeroed(pixels * rank)?;
        let alone = ProgressiveScan {
            first: 0,
            ..*record
        };
        return half_float_codec::add(&mut values, rank, &alone, bytes, &budget)
            .map_err(|error| error.in_chunk(chunk));
    }
    let mut decoder = TileDecoder {
        scans: scan,
        ..TileDecoder::new(tile, None)
    };
    if !index.has_colour_klt(scan, tile) {
        decoder.planes = CoefficientPlanes::with_klt();
    }
    let order = direct_functions::centre_out_order(index.header.geometry.window, &budget)?;
    decoder.add(index, &order, bytes, &budget)
}
