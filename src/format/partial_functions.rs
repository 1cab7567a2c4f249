//! The direct functions of a tile while its scans arrive: the sum of what each has brought.
//!
//! Scans are kept as they came and added up pixel by pixel when codes or values are asked for. No more than one pixel
//! is ever held with all its slots.

use super::chunk::ChunkEntry;
use super::codec::scan_functions::{ScanFunctions, max_entries};
use super::error::FormatError;
use super::index::FileIndex;
use super::memory_budget::{MemoryBudget, vec_bytes};
use super::scan::ProgressiveScan;
use crate::transport::{
    CHANNELS, ChannelPeaks, FunctionCodes, FunctionEntry, TileRect, end_pixel, entries_by_pixel,
    entry_slot,
};

/// A slot and its value; `None` after the last one of a pixel.
type SlotValue<'a> = Option<(usize, &'a [f32; CHANNELS])>;

/// The chunks of direct functions of one tile.
#[derive(Debug, Default)]
pub(super) struct PartialFunctions(Vec<ScanFunctions>);

impl PartialFunctions {
    /// Whether no chunk has come.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Bytes allocated.
    pub fn bytes(&self) -> u64 {
        let entries = self.0.iter().map(|scan| vec_bytes(&scan.entries));
        vec_bytes(&self.0) + entries.sum::<u64>()
    }

    /// Starts the next chunk of `tile`, which has `tokens` tokens.
    ///
    /// # Errors
    /// The errors of `budget`.
    pub fn start_chunk(
        &mut self,
        index: &FileIndex,
        tile: usize,
        scan: &ProgressiveScan,
        tokens: u32,
        budget: &MemoryBudget,
    ) -> Result<&mut ScanFunctions, FormatError> {
        let pixels = index.header.geometry.tile(tile).extent.area();
        let functions = ScanFunctions::try_new(scan, pixels, tokens, budget)?;
        budget.try_push(&mut self.0, functions)?;
        let last = self.0.len() - 1;
        Ok(&mut self.0[last])
    }

    /// Calls `visit` with each slot that has a value in a scan and the sum of these: pixel by pixel, in ascending order.
    /// After each of the `pixels` pixels it is called with `None`.
    fn for_each_value(
        &self,
        pixels: usize,
        area: usize,
        budget: &MemoryBudget,
        visit: &mut dyn FnMut(SlotValue<'_>),
    ) -> Result<(), FormatError> {
        let mut window: Vec<[f32; CHANNELS]> = budget.try_zeroed(area)?;
        // A bit for each slot that has a value.
        let mut used: Vec<u32> = budget.try_zeroed(area.div_ceil(32))?;
        let mut next: Vec<u32> = budget.try_zeroed(self.0.len())?;
        for _ in 0..pixels {
            for (scan, next) in self.0.iter().zip(&mut next) {
                let entries = entries_by_pixel(&scan.entries[*next as usize..]).next();
                for entry in entries.unwrap_or_default() {
                    let (slot, value) = (entry_slot(entry), scan.value(entry));
                    used[slot / 32] |= 1 << (slot % 32);
                    (0..CHANNELS).for_each(|c| window[slot][c] += value[c]);
                    *next += 1;
                }
            }
            for (i, used) in used.iter_mut().enumerate() {
                while *used != 0 {
                    let slot = 32 * i + used.trailing_zeros() as usize;
                    *used &= *used - 1;
                    visit(Some((slot, &window[slot])));
                    window[slot] = [0.0; CHANNELS];
                }
            }
            visit(None);
        }
        Ok(())
    }

    /// The functions so far as codes, for windows of `area` slots.
    ///
    /// # Errors
    /// The errors of `budget`.
    pub fn quantise(
        &self,
        rect: TileRect,
        area: usize,
        budget: &MemoryBudget,
    ) -> Result<FunctionCodes, FormatError> {
        let pixels = rect.extent.area();
        let (mut peaks, mut values) = (ChannelPeaks::default(), 0);
        self.for_each_value(pixels, area, budget, &mut |value| {
            if let Some((_, value)) = value {
                peaks.add(value);
                values += 1;
            }
        })?;
        let mut codes = FunctionCodes::dark(rect);
        if codes.set_step(peaks) {
            // Of a pixel without values there is an entry too.
            codes.entries = budget.try_with_capacity(values + pixels)?;
            self.for_each_value(pixels, area, budget, &mut |value| match value {
                Some((slot, value)) => codes.push(slot, value),
                None => end_pixel(&mut codes.entries),
            })?;
            codes.entries.shrink_to_fit();
        }
        Ok(codes)
    }

    /// The values so far, `[pixel, slot]` with `area` slots for each of `pixels` pixels; empty if no chunk has come.
    ///
    /// # Errors
    /// The errors of `budget`.
    pub fn values(
        &self,
        pixels: usize,
        area: usize,
        budget: &MemoryBudget,
    ) -> Result<Vec<[f32; CHANNELS]>, FormatError> {
        if self.is_empty() {
            return Ok(Vec::new());
        }
        let mut values = budget.try_zeroed(pixels * area)?;
        let mut functions = values.chunks_exact_mut(area);
        let mut function = functions.next();
        self.for_each_value(pixels, area, budget, &mut |value| match value {
            Some((slot, value)) => {
                if let Some(function) = &mut function {
                    function[slot] = *value;
                }
            }
            None => function = functions.next(),
        })?;
        Ok(values)
    }
}

/// Upper bounds on the bytes of a tile's direct functions: of [`PartialFunctions`], and of their codes with all that
/// [`PartialFunctions::quantise`] takes.
pub(super) fn max_bytes(index: &FileIndex, tile: usize) -> [u64; 2] {
    let geometry = &index.header.geometry;
    let (pixels, area) = (geometry.tile(tile).extent.area(), geometry.window.area());
    let (mut scans, mut entries) = (0, 0);
    for (i, scan) in index.scans.iter().enumerate() {
        let ChunkEntry {
            bytes,
            content_bytes,
            ..
        } = index.entry(i, tile);
        if scan.coding.is_direct() && bytes > 0 {
            entries += max_entries(scan, pixels, content_bytes) as u64;
            scans += 1;
        }
    }
    let bytes = |count: u64, size: usize| count * size as u64;
    // A vector that is full doubles, and is copied.
    let partial = bytes(3 * scans + 1, size_of::<ScanFunctions>())
        + bytes(entries, size_of::<FunctionEntry>());
    let codes = entries.min((pixels * area) as u64) + pixels as u64;
    // The window of a pixel in each of two passes, with its bits.
    let window = bytes(3 * area as u64 + scans, size_of::<[f32; CHANNELS]>());
    match scans {
        0 => [0; 2],
        _ => [partial, bytes(codes, size_of::<FunctionEntry>()) + window],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::scan::ScanCoding;
    use crate::transport::Extent;
    use half::f16;

    const AREA: usize = 81;
    const RECT: TileRect = TileRect {
        x: 0,
        y: 8,
        extent: Extent::new(5, 3),
    };

    /// Scans that overlap, with few and with many slots, and the sum of their values, `[pixel, slot]`.
    fn scans(budget: &MemoryBudget) -> (PartialFunctions, Vec<[f32; CHANNELS]>) {
        let (pixels, mut noise) = (RECT.extent.area(), 1u32);
        let mut below = |limit: u32| {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (noise >> 8) % limit
        };
        let mut sums = vec![[0.0; CHANNELS]; pixels * AREA];
        let mut partial = Vec::new();
        for (coding, step, every) in [
            (ScanCoding::Direct, 0.037, 9),
            (ScanCoding::Direct, 0.0021, 2),
            (ScanCoding::DirectHalves, 0.5, 30),
            (ScanCoding::Direct, 1e-4, 1),
        ] {
            let scan = ProgressiveScan::new(coding, 0, AREA as u16, step);
            let mut functions = ScanFunctions::try_new(&scan, pixels, u32::MAX, budget).unwrap();
            for p in 0..pixels {
                // From the last slot on: scans have another order than codes.
                for slot in (0..AREA).rev().filter(|slot| (slot + p) % every == 0) {
                    let [a, b, c] = [0; CHANNELS].map(|_| below(200) as i16 - 100);
                    let (numbers, rgb) = match coding {
                        ScanCoding::Direct => {
                            // The inverse of YCoCg-R.
                            let (y, co, cg) = (i32::from(a), i32::from(b), i32::from(c));
                            let t = y - (cg >> 1);
                            let blue = t - (co >> 1);
                            ([a, b, c], [blue + co, cg + t, blue].map(|n| n as f32))
                        }
                        _ => {
                            let halves = [a, b, c].map(|n| f16::from_f32(f32::from(n) / 7.0));
                            (halves.map(|h| h.to_bits() as i16), halves.map(f16::to_f32))
                        }
                    };
                    functions.push(numbers, slot as u16);
                    let sum = &mut sums[p * AREA + slot];
                    (0..CHANNELS).for_each(|c| sum[c] += rgb[c] * step);
                }
                functions.end_pixel();
            }
            partial.push(functions);
        }
        (PartialFunctions(partial), sums)
    }

    #[test]
    fn the_sum_of_scans_is_that_of_whole_functions_to_the_bit() {
        let budget = MemoryBudget::unlimited();
        let (partial, sums) = scans(&budget);
        let values = partial.values(RECT.extent.area(), AREA, &budget).unwrap();
        assert_eq!(values, sums);
        let codes = partial.quantise(RECT, AREA, &budget).unwrap();
        assert_eq!(codes, FunctionCodes::quantise(RECT, &sums, AREA));
        assert!(!codes.is_dark());
    }

    #[test]
    fn no_scans_and_scans_of_zeros_are_dark() {
        let budget = MemoryBudget::unlimited();
        let none = PartialFunctions::default();
        assert_eq!((none.is_empty(), none.bytes()), (true, 0));
        assert!(none.values(15, AREA, &budget).unwrap().is_empty());
        let scan = ProgressiveScan::new(ScanCoding::Direct, 0, AREA as u16, 0.1);
        let mut zeros = ScanFunctions::try_new(&scan, 15, 20, &budget).unwrap();
        for _ in 0..15 {
            zeros.push([0; CHANNELS], 3);
            zeros.end_pixel();
        }
        let zeros = PartialFunctions(vec![zeros]);
        let codes = zeros.quantise(RECT, AREA, &budget).unwrap();
        assert_eq!(codes, FunctionCodes::dark(RECT));
    }
}
