//! Direct functions as codes, without the slots whose codes are all zero: at usual qualities nearly all are.

use super::geometry::{CHANNELS, TileRect};
use super::quantisation::{ChannelPeaks, code};
use super::tile::TexelCodes;

/// Largest code of direct functions. With 12 bits the quantisation noise of a pixel whose function is not sparse (S =
/// 225, error step/√12 in each slot) is about 60 dB below the signal, less than the noise of any photograph.
const MAX_DIRECT_CODE: f32 = 4095.0;

/// Numbers of one slot in red, green and blue (or their transform), and the slot, with [`LAST_ENTRY`] in the last entry of
/// a pixel.
pub type FunctionEntry = TexelCodes;

/// Marks the last entry of a pixel. Windows have less than 2^12 slots.
const LAST_ENTRY: i16 = 1 << 12;

/// The slot of an entry.
#[inline(always)]
pub fn entry_slot(entry: &FunctionEntry) -> usize {
    (entry[CHANNELS] & (LAST_ENTRY - 1)) as usize
}

/// The entries of each pixel, of entries that begin with those of a pixel.
#[inline(always)]
pub fn entries_by_pixel(entries: &[FunctionEntry]) -> impl Iterator<Item = &[FunctionEntry]> {
    entries.split_inclusive(|entry| entry[CHANNELS] & LAST_ENTRY != 0)
}

/// Marks the end of a pixel, whose entries follow those of ended pixels. A pixel without entries gets one of zeros.
pub(crate) fn end_pixel(entries: &mut Vec<FunctionEntry>) {
    match entries.last_mut() {
        Some(last) if last[CHANNELS] & LAST_ENTRY == 0 => last[CHANNELS] |= LAST_ENTRY,
        _ => entries.push([0, 0, 0, LAST_ENTRY]),
    }
}

/// The direct functions of a tile as codes: `value = code · step`.
#[derive(Clone, Debug, PartialEq)]
pub struct FunctionCodes {
    /// The pixels of the tile.
    pub rect: TileRect,
    /// Value of one code, per channel: the largest value of the channel has the largest code.
    pub step: [f32; CHANNELS],
    /// Pixel by pixel, in ascending order of slots; at least one for each pixel. Empty if all values are zero.
    pub(crate) entries: Vec<FunctionEntry>,
}

impl FunctionCodes {
    /// All values zero.
    pub fn dark(rect: TileRect) -> Self {
        Self {
            rect,
            step: [1.0; CHANNELS],
            entries: Vec::new(),
        }
    }

    /// Rounds functions, `[pixel, slot]` with `area` slots a pixel, to codes. Values that are not finite become zero.
    pub(crate) fn quantise(rect: TileRect, functions: &[[f32; CHANNELS]], area: usize) -> Self {
        let peaks = ChannelPeaks::of(functions);
        let mut codes = Self::dark(rect);
        if codes.set_step(peaks) {
            for function in functions.chunks_exact(area) {
                for (slot, value) in function.iter().enumerate() {
                    codes.push(slot, value);
                }
                end_pixel(&mut codes.entries);
            }
        }
        codes
    }

    /// Sets the step for values up to `peaks`. Returns `false` if all values are dark.
    pub(crate) fn set_step(&mut self, peaks: ChannelPeaks) -> bool {
        let steps = peaks.steps(MAX_DIRECT_CODE);
        self.step = steps.unwrap_or(self.step);
        steps.is_some()
    }

    /// Adds the value of a slot of the next pixel, if a code of it is not zero. Slots come in ascending order.
    pub(crate) fn push(&mut self, slot: usize, value: &[f32; CHANNELS]) {
        let [r, g, b] = std::array::from_fn(|c| code(value[c], self.step[c]));
        if r | g | b != 0 {
            self.entries.push([r, g, b, slot as i16]);
        }
    }

    /// Whether the entries are those of a tile of `rect` with `area` slots a pixel.
    #[cfg(any(test, all(target_arch = "wasm32", feature = "drawing")))]
    pub(crate) fn is_valid(&self, area: usize) -> bool {
        let (mut pixels, mut is_last) = (0, true);
        for entry in &self.entries {
            is_last = entry[CHANNELS] & LAST_ENTRY != 0;
            pixels += usize::from(is_last);
            // Negative slots become large ones.
            if (entry[CHANNELS] & !LAST_ENTRY) as usize >= area {
                return false;
            }
        }
        self.is_dark() || (is_last && pixels == self.rect.extent.area())
    }

    /// The entries of each pixel, by slot. A pixel whose values are zero has one entry of zeros; a dark tile has no
    /// pixels.
    pub fn pixels(&self) -> impl Iterator<Item = &[FunctionEntry]> {
        entries_by_pixel(&self.entries)
    }

    /// The value of an entry.
    pub fn value(&self, entry: &FunctionEntry) -> [f32; CHANNELS] {
        std::array::from_fn(|c| f32::from(entry[c]) * self.step[c])
    }

    /// All values, `[pixel, slot]` with `area` slots a pixel; empty if all are zero.
    pub(crate) fn values(&self, area: usize) -> Vec<[f32; CHANNELS]> {
        let mut values = vec![[0.0; CHANNELS]; self.pixels().count() * area];
        for (values, entries) in values.chunks_exact_mut(area).zip(self.pixels()) {
            for entry in entries {
                values[entry_slot(entry)] = self.value(entry);
            }
        }
        values
    }

    /// Whether all values are zero, and so not stored.
    pub fn is_dark(&self) -> bool {
        self.entries.is_empty()
    }

    /// Bytes of the codes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.entries[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::Extent;

    const AREA: usize = 9;
    const RECT: TileRect = TileRect {
        x: 3,
        y: 5,
        extent: Extent::new(4, 2),
    };

    /// Pixel 2 is dark, the others have up to three slots.
    fn functions() -> Vec<[f32; CHANNELS]> {
        let mut functions = vec![[0.0; CHANNELS]; RECT.extent.area() * AREA];
        for p in (0..RECT.extent.area()).filter(|p| *p != 2) {
            for slot in [p, (p + 4) % AREA, 8] {
                functions[p * AREA + slot] = [0.1 * slot as f32, -0.3, 0.7 / (p + 1) as f32];
            }
        }
        functions
    }

    #[test]
    fn codes_have_the_values_to_half_a_step() {
        let functions = functions();
        let codes = FunctionCodes::quantise(RECT, &functions, AREA);
        assert_eq!(codes.step, [0.8, 0.3, 0.7].map(|peak| peak / 4095.0));
        assert!(!codes.is_dark() && codes.is_valid(AREA));
        let stored = functions.iter().filter(|value| **value != [0.0; 3]);
        // And one of zeros for pixel 2.
        assert_eq!(codes.entries.len(), stored.count() + 1);
        assert_eq!(codes.pixels().nth(2), Some(&[[0, 0, 0, LAST_ENTRY]][..]));
        assert_eq!(codes.bytes(), 8 * codes.entries.len());
        let values = codes.values(AREA);
        assert_eq!(values.len(), functions.len());
        for (i, (value, want)) in values.iter().zip(&functions).enumerate() {
            for c in 0..CHANNELS {
                let error = (value[c] - want[c]).abs();
                assert!(error <= 0.501 * codes.step[c], "{i}, {c}: {error}");
            }
        }
        for (p, entries) in codes.pixels().enumerate() {
            let slots = entries.iter().map(entry_slot);
            assert!(slots.is_sorted_by(|a, b| a < b), "{p}: {entries:?}");
        }
    }

    #[test]
    fn values_without_codes_are_not_stored() {
        let mut functions = functions();
        functions[2 * AREA] = [f32::NAN, f32::INFINITY, 1e-5];
        let codes = FunctionCodes::quantise(RECT, &functions, AREA);
        assert_eq!(codes.pixels().nth(2), Some(&[[0, 0, 0, LAST_ENTRY]][..]));
        let dark = vec![[f32::NAN, 0.0, 1e-45]; functions.len()];
        let dark = FunctionCodes::quantise(RECT, &dark, AREA);
        assert_eq!(dark, FunctionCodes::dark(RECT));
        assert!(dark.values(AREA).is_empty() && dark.is_valid(AREA));
    }

    #[test]
    fn entries_of_another_tile_are_invalid() {
        let codes = FunctionCodes::quantise(RECT, &functions(), AREA);
        let last = codes.entries.len() - 1;
        let is_valid = |change: fn(&mut Vec<FunctionEntry>, usize)| {
            let mut changed = codes.clone();
            change(&mut changed.entries, last);
            changed.is_valid(AREA)
        };
        assert!(is_valid(|_, _| {}));
        assert!(is_valid(|entries, _| entries.clear()));
        // The last slot is 8.
        assert!(!codes.is_valid(AREA - 1));
        for change in [
            |entries: &mut Vec<_>, last| entries.truncate(last),
            |entries: &mut Vec<_>, _| entries.retain(|entry| entry[..3] != [0; 3]),
            |entries: &mut Vec<_>, last: usize| entries[last][3] &= !LAST_ENTRY,
            |entries: &mut Vec<_>, _| entries[0][3] |= LAST_ENTRY,
            |entries: &mut Vec<_>, _| entries[0][3] = -1,
            |entries: &mut Vec<_>, _| entries[0][3] |= 1 << 13,
            |entries: &mut Vec<_>, _| entries.push([0; 4]),
            |entries: &mut Vec<_>, _| entries.push([0, 0, 0, LAST_ENTRY]),
        ] as [fn(&mut Vec<FunctionEntry>, usize); 8]
        {
            assert!(!is_valid(change));
        }
    }
}
