//! Decoding one tile: chunks in the order of scans to coefficients c and direct functions d.

use super::budget::{Budget, vec_bytes};
use super::chunk::ChunkId;
use super::codec::transform::Planes;
use super::codec::{basis, direct, halves};
use super::error::{FormatError, SectionError};
use super::index::FileIndex;
use super::scan::Coding;
use crate::transport::{BandTile, Basis, CHANNELS, CoefficientTile, DirectTile, Tile};

/// A tile as the sum of its chunks so far.
#[derive(Debug, Default)]
pub(super) struct TileDecoder {
    /// Number of scans that are decoded or have no chunk for the tile.
    pub scans: usize,
    /// Of coding 1.
    planes: Planes,
    /// Of coding 2, `[pixel, component]`.
    coefficients: Vec<[f32; CHANNELS]>,
    /// `[pixel, slot]`.
    functions: Vec<[f32; CHANNELS]>,
}

impl TileDecoder {
    /// Bytes allocated.
    pub fn bytes(&self) -> u64 {
        self.planes.bytes() + vec_bytes(&self.coefficients) + vec_bytes(&self.functions)
    }

    /// Adds the tile's chunk of the next scan. `order` is the centre-out order.
    ///
    /// # Errors
    /// [`FormatError::DamagedSection`], and the errors of `budget`, which keeps only [`bytes`](Self::bytes)
    /// reserved.
    pub fn add(
        &mut self,
        index: &FileIndex,
        order: &[u16],
        tile: usize,
        bytes: &[u8],
        budget: &Budget,
    ) -> Result<(), FormatError> {
        let chunk = ChunkId::of_tile(self.scans, tile);
        let (scratch, before) = (budget.scratch(), self.bytes());
        let decoded = self.decode(index, order, tile, bytes, budget);
        scratch.keep(self.bytes() - before);
        decoded.map_err(|error| error.in_chunk(chunk))?;
        self.scans += 1;
        Ok(())
    }

    fn decode(
        &mut self,
        index: &FileIndex,
        order: &[u16],
        tile: usize,
        bytes: &[u8],
        budget: &Budget,
    ) -> Result<(), SectionError> {
        let geometry = &index.header.geometry;
        let scan = &index.scans[self.scans];
        let content_bytes = index.entry(self.scans, tile).content_bytes;
        let (extent, area) = (geometry.tile(tile).extent, geometry.window.area());
        let rank = usize::from(index.header.rank);
        let allocate = |values: &mut Vec<[f32; CHANNELS]>, columns: usize| {
            if values.is_empty() {
                *values = budget.try_zeroed(extent.area() * columns)?;
            }
            Ok::<_, FormatError>(())
        };
        match scan.coding {
            Coding::Transform => self.planes.add(extent, scan, bytes, content_bytes, budget),
            Coding::Direct => {
                allocate(&mut self.functions, area)?;
                direct::add(
                    &mut self.functions,
                    order,
                    scan,
                    bytes,
                    content_bytes,
                    budget,
                )
            }
            Coding::Halves => {
                allocate(&mut self.coefficients, rank)?;
                halves::add(&mut self.coefficients, rank, scan, None, bytes, budget)
            }
            Coding::DirectHalves => {
                allocate(&mut self.functions, area)?;
                halves::add(&mut self.functions, area, scan, Some(order), bytes, budget)
            }
        }
    }

    /// The first `rank` components of the coefficients, `[pixel, component]`; empty if all are zero.
    fn coefficients(
        &self,
        index: &FileIndex,
        tile: usize,
        rank: usize,
        budget: &Budget,
    ) -> Result<Vec<[f32; CHANNELS]>, FormatError> {
        if !self.planes.is_dark() {
            let extent = index.header.geometry.tile(tile).extent;
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
        tile: usize,
        rank: usize,
        budget: &Budget,
    ) -> Result<Tile, FormatError> {
        let rect = index.header.geometry.tile(tile);
        let mut quantised = Tile::dark(rect);
        let scratch = budget.scratch();
        let coefficients = self.coefficients(index, tile, rank, budget)?;
        if !coefficients.is_empty() {
            let codes = budget.try_zeroed(CoefficientTile::texels(rect, rank))?;
            quantised.coefficients =
                CoefficientTile::quantise_into(rect, &coefficients, rank, codes);
        }
        if !self.functions.is_empty() {
            let codes = budget.try_with_capacity(self.functions.len())?;
            quantised.functions = DirectTile::quantise_into(rect, &self.functions, codes);
        }
        scratch.keep(quantised.bytes() as u64);
        Ok(quantised)
    }
}

/// Decodes one tile of a file by itself; `fetch` gives the bytes of its chunks.
///
/// # Errors
/// The errors of `fetch`, and a [`FormatError`] if a chunk is damaged or memory is refused.
pub fn decode_tile<E: From<FormatError>>(
    index: &FileIndex,
    tile: usize,
    mut fetch: impl FnMut(ChunkId) -> Result<Vec<u8>, E>,
) -> Result<BandTile, E> {
    let budget = Budget::unlimited();
    let order = direct::centre_out_order(index.header.geometry.window, &budget)?;
    let mut decoder = TileDecoder::default();
    for scan in 0..index.scans.len() {
        let chunk = ChunkId::of_tile(scan, tile);
        if index.entry(scan, tile).bytes == 0 {
            decoder.scans += 1;
            continue;
        }
        let bytes = fetch(chunk)?;
        index.check_crc(chunk, &bytes)?;
        decoder.add(index, &order, tile, &bytes, &budget)?;
    }
    let rank = index.header.rank.into();
    Ok(BandTile {
        rect: index.header.geometry.tile(tile),
        coefficients: decoder.coefficients(index, tile, rank, &budget)?,
        functions: decoder.functions,
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
    let budget = Budget::unlimited();
    let area = index.header.geometry.window.area();
    let mut kernels = basis::try_zeroed(index.header.rank.into(), area, &budget)?;
    for scan in 0..index.scans.len() {
        let functions = index.new_basis_functions(scan);
        if !functions.is_empty() {
            let chunk = ChunkId::of_basis(scan);
            let bytes = fetch(chunk)?;
            index.check_crc(chunk, &bytes)?;
            basis::decode(&bytes, &mut kernels[functions], area, &budget)
                .map_err(|error| error.in_chunk(chunk))?;
        }
    }
    Ok(Basis { kernels })
}
