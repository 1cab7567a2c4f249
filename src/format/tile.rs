//! A tile on its way: what the scans have brought of it.

use super::codec::transform::Planes;
use super::codec::{PartError, basis, direct, halves, zeros};
use super::error::Part;
use super::head::{Head, PartNumber};
use super::{Coding, FormatError};
use crate::transport::{BandTile, Basis, CHANNELS};

/// The numbers of a tile so far.
#[derive(Clone, Debug, Default)]
pub struct TileNumbers {
    /// Scans that it is done with.
    pub scans: usize,
    planes: Planes,
    /// `[pixel, component]`, by scans of half-precision floats.
    coefficients: Vec<[f32; CHANNELS]>,
    /// `[pixel, element]`.
    functions: Vec<[f32; CHANNELS]>,
}

impl TileNumbers {
    /// Takes the tile's chunk of the next scan. `order` is that of direct scans' slots.
    pub fn add(
        &mut self,
        head: &Head,
        order: &[u16],
        tile: usize,
        bytes: &[u8],
    ) -> Result<(), FormatError> {
        let part = PartNumber {
            scan: self.scans,
            tile: Some(tile),
        };
        self.decode(head, order, tile, bytes)
            .map_err(|e| e.of(part.into()))?;
        self.scans += 1;
        Ok(())
    }

    fn decode(
        &mut self,
        head: &Head,
        order: &[u16],
        tile: usize,
        bytes: &[u8],
    ) -> Result<(), PartError> {
        let geometry = &head.header.geometry;
        let (scan, plain) = (&head.scans[self.scans], head.entry(self.scans, tile).plain);
        let (extent, area) = (geometry.tile(tile).extent, geometry.window.area());
        let rank = usize::from(head.header.rank);
        let room = |values: &mut Vec<[f32; CHANNELS]>, each: usize| {
            if values.is_empty() {
                *values = zeros(extent.area() * each)?;
            }
            Ok::<_, PartError>(())
        };
        let (step, places) = (scan.step, usize::from(scan.first)..scan.end());
        match scan.coding {
            Coding::Transform => self.planes.add(extent, scan, bytes, plain),
            Coding::Direct => {
                room(&mut self.functions, area)?;
                direct::add(&mut self.functions, order, scan, bytes, plain)
            }
            Coding::Halves => {
                room(&mut self.coefficients, rank)?;
                let places: Vec<u16> = (scan.first..).take(places.len()).collect();
                halves::add(&mut self.coefficients, rank, &places, step, bytes)
            }
            Coding::DirectHalves => {
                room(&mut self.functions, area)?;
                halves::add(&mut self.functions, area, &order[places], step, bytes)
            }
        }
    }

    /// The tile as far as it has come, by the first `rank` components of the basis.
    pub fn band_tile(self, head: &Head, tile: usize, rank: usize) -> Result<BandTile, FormatError> {
        let rect = head.header.geometry.tile(tile);
        let all = usize::from(head.header.rank);
        let coefficients = match self.planes.is_dark() {
            true if rank == all => Ok(self.coefficients),
            true => {
                let pixels = self.coefficients.chunks_exact(all.max(1));
                Ok(pixels.flat_map(|pixel| &pixel[..rank]).copied().collect())
            }
            false => self.planes.coefficients(rect.extent, rank),
        };
        let scan = self.scans.saturating_sub(1);
        Ok(BandTile {
            rect,
            coefficients: coefficients.map_err(|e| e.of(Part::Chunk { scan, tile }))?,
            functions: self.functions,
        })
    }
}

/// Decodes one tile of a file by itself, of the bytes that `fetch` has for each of its chunks.
pub fn decode_tile<E: From<FormatError>>(
    head: &Head,
    tile: usize,
    mut fetch: impl FnMut(PartNumber) -> Result<Vec<u8>, E>,
) -> Result<BandTile, E> {
    let order = direct::order(head.header.geometry.window);
    let mut numbers = TileNumbers::default();
    for scan in 0..head.scans.len() {
        let part = PartNumber {
            scan,
            tile: Some(tile),
        };
        if head.entry(scan, tile).bytes == 0 {
            numbers.scans += 1;
            continue;
        }
        let bytes = fetch(part)?;
        head.check_crc(part, &bytes)?;
        numbers.add(head, &order, tile, &bytes)?;
    }
    Ok(numbers.band_tile(head, tile, head.header.rank.into())?)
}

/// Decodes the basis of a file, of the bytes that `fetch` has for each scan that brings some.
pub fn decode_basis<E: From<FormatError>>(
    head: &Head,
    mut fetch: impl FnMut(PartNumber) -> Result<Vec<u8>, E>,
) -> Result<Basis, E> {
    let area = head.header.geometry.window.area();
    let mut kernels = Vec::new();
    for scan in 0..head.scans.len() {
        let functions = head.functions(scan);
        if !functions.is_empty() {
            let part = PartNumber { scan, tile: None };
            let bytes = fetch(part)?;
            head.check_crc(part, &bytes)?;
            let decoded = basis::decode(&bytes, functions.len(), area);
            kernels.extend(decoded.map_err(|e| e.of(part.into()))?);
        }
    }
    Ok(Basis { kernels })
}
