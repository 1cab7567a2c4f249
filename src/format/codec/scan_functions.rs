//! What one chunk of codings 3 and 4 adds to the direct functions of a tile, without zeros.

use super::colour::{ColourVector, ycocg_inverse};
use super::half_float_codec::half_value;
use crate::format::error::FormatError;
use crate::format::memory_budget::MemoryBudget;
use crate::format::scan::{ProgressiveScan, ScanCoding};
use crate::transport::{CHANNELS, FunctionEntry, end_pixel};

/// The slots of each pixel that are not zero.
#[derive(Debug)]
pub struct ScanFunctions {
    has_half_floats: bool,
    step: f32,
    /// As in [`FunctionCodes`](crate::transport::FunctionCodes), in the chunk's order and with its numbers: Y, Co and Cg
    /// in steps, or the bits of three half floats.
    pub entries: Vec<FunctionEntry>,
}

impl ScanFunctions {
    /// Of no pixel yet, with room for the tile.
    ///
    /// # Errors
    /// The errors of `budget`.
    pub fn try_new(
        scan: &ProgressiveScan,
        pixels: usize,
        tokens: u32,
        budget: &MemoryBudget,
    ) -> Result<Self, FormatError> {
        Ok(Self {
            has_half_floats: scan.coding == ScanCoding::DirectHalves,
            step: scan.step,
            entries: budget.try_with_capacity(max_entries(scan, pixels, tokens))?,
        })
    }

    /// Adds a slot of the next pixel, if a number of it is not zero.
    #[inline(never)] // both codecs call it
    pub fn push(&mut self, numbers: [i16; CHANNELS], slot: u16) {
        let [a, b, c] = numbers;
        if a | b | c != 0 {
            self.entries.push([a, b, c, slot as i16]);
        }
    }

    /// Ends the next pixel.
    #[inline(never)] // as `push`
    pub fn end_pixel(&mut self) {
        end_pixel(&mut self.entries);
    }

    /// The value of an entry: red, green, blue.
    pub fn value(&self, &[a, b, c, _]: &FunctionEntry) -> ColourVector {
        let rgb = match self.has_half_floats {
            true => [a, b, c].map(|bits| half_value(bits as u16)),
            false => ycocg_inverse([a, b, c].map(i32::from)).map(|number| number as f32),
        };
        rgb.map(|value| value * self.step)
    }
}

/// Upper bound on the entries of a chunk. In coding 3 each takes a token.
pub fn max_entries(scan: &ProgressiveScan, pixels: usize, tokens: u32) -> usize {
    let values = pixels * usize::from(scan.count);
    match scan.coding {
        ScanCoding::Direct => values.min(tokens as usize),
        _ => values,
    }
}
