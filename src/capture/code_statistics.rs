//! What the codes of photographs say of the camera: saturation, declared or not, and codes of 8 bits.

use serde::{Deserialize, Serialize};

use crate::linalg::vectorise;
use crate::transport::CHANNELS;

/// Samples of a channel with the highest code that are so many a photograph, more than of a few stuck pixels, and so many
/// times those with the next lower code, are saturated.
const MIN_PILE: usize = 6;
const MIN_PILE_RATIO: usize = 8;
/// Pixels of a row that are summarised side by side.
const SUMMARY_PIXELS: usize = 16;
/// Pixels of a row that are summarised at a time: fewer times [`SUMMARY_PIXELS`] than a lane can count.
const MAX_SUMMARY: usize = SUMMARY_PIXELS * (u16::MAX as usize - 1);
/// 8-bit codes are scaled to 16 bits by one of these factors.
const EIGHT_BIT_FACTORS: [u16; 2] = [257, 256];

/// Counts of the codes of photographs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CodeStatistics {
    /// Number of samples that are saturated as the manifest says.
    pub saturated: usize,
    photographs: usize,
    /// For each channel, the highest code that is not saturated and the next lower one, each with the number of its
    /// samples.
    highest: [[(u16, usize); 2]; CHANNELS],
    /// Whether all codes are multiples of each of [`EIGHT_BIT_FACTORS`].
    are_multiples: [bool; 2],
}

impl Default for CodeStatistics {
    fn default() -> Self {
        Self {
            photographs: 0,
            saturated: 0,
            highest: [[(0, 0); 2]; CHANNELS],
            are_multiples: [true; 2],
        }
    }
}

impl CodeStatistics {
    /// Of a photograph without samples yet.
    pub fn of_photograph() -> Self {
        Self {
            photographs: 1,
            ..Self::default()
        }
    }

    /// Counts the pixels of a row; codes from `saturated_from` on are saturated.
    pub fn add_row(&mut self, row: &[[u16; CHANNELS]], saturated_from: [u32; CHANNELS]) {
        for (are_multiples, factor) in self.are_multiples.iter_mut().zip(EIGHT_BIT_FACTORS) {
            let mut codes = row.as_flattened().iter();
            *are_multiples = *are_multiples && codes.all(|code| code.is_multiple_of(factor));
        }
        for part in row.chunks(MAX_SUMMARY) {
            self.add_part(part, saturated_from);
        }
    }

    fn add_part(&mut self, row: &[[u16; CHANNELS]], saturated_from: [u32; CHANNELS]) {
        let RowSummary { highest, saturated } = vectorise(
            #[cfg_attr(target_arch = "x86_64", inline(always))]
            || RowSummary::new(row, saturated_from),
        );
        self.saturated += saturated;
        for c in 0..CHANNELS {
            // Hardly any row has one of the highest codes of its photograph.
            if highest[c] < self.highest[c][1].0 {
                continue;
            }
            let codes = row.iter().map(|codes| codes[c]);
            for code in codes.filter(|code| u32::from(*code) < saturated_from[c]) {
                count(&mut self.highest[c], code, 1);
            }
        }
    }

    /// Counts `samples` of channel `c` with a `code`.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn add_code(&mut self, c: usize, code: u16, samples: usize, is_saturated: bool) {
        for (are_multiples, factor) in self.are_multiples.iter_mut().zip(EIGHT_BIT_FACTORS) {
            *are_multiples = *are_multiples && code.is_multiple_of(factor);
        }
        match is_saturated {
            true => self.saturated += samples,
            false => count(&mut self.highest[c], code, samples),
        }
    }

    /// The same counts if codes from `saturated_from` on are saturated, as far as these are the two highest.
    #[must_use]
    pub fn with_saturation(mut self, saturated_from: [u32; CHANNELS]) -> Self {
        for (highest, from) in self.highest.iter_mut().zip(saturated_from) {
            for (code, samples) in highest.iter_mut() {
                if u32::from(*code) >= from {
                    self.saturated += std::mem::take(samples);
                    *code = 0;
                }
            }
            highest.sort_by_key(|pair| std::cmp::Reverse(pair.0));
        }
        self
    }

    /// Adds the counts of another photograph.
    pub fn merge(mut self, other: Self) -> Self {
        self.photographs += other.photographs;
        self.saturated += other.saturated;
        for (own, other) in self.highest.iter_mut().zip(other.highest) {
            for (code, samples) in other {
                count(own, code, samples);
            }
        }
        for (own, other) in self.are_multiples.iter_mut().zip(other.are_multiples) {
            *own &= other;
        }
        self
    }

    /// The code at which samples of each channel are saturated though this is not declared, if there is one: they pile up
    /// there.
    pub fn undeclared_saturation(&self) -> [Option<u16>; CHANNELS] {
        self.highest.map(|[(code, samples), (_, next)]| {
            let is_pile =
                samples >= MIN_PILE * self.photographs && samples >= MIN_PILE_RATIO * next.max(1);
            (code > 0 && is_pile).then_some(code)
        })
    }

    /// Distance of the codes.
    pub fn step(&self) -> u16 {
        if self.highest.iter().all(|highest| highest[1].0 == 0) {
            return 1; // all photographs are black, or have one code
        }
        let factors = self.are_multiples.into_iter().zip(EIGHT_BIT_FACTORS);
        let mut steps =
            factors.filter_map(|(are_multiples, factor)| are_multiples.then_some(factor));
        steps.next().unwrap_or(1)
    }
}

/// The highest code of each channel in a part of a row that is not saturated, and the number of saturated samples.
struct RowSummary {
    highest: [u16; CHANNELS],
    saturated: usize,
}

impl RowSummary {
    /// Lanes beside one another, for vector instructions.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn new(row: &[[u16; CHANNELS]], saturated_from: [u32; CHANNELS]) -> Self {
        const LANES: usize = SUMMARY_PIXELS * CHANNELS;
        let channel = |lane: usize| lane % CHANNELS;
        // Codes above this one are saturated.
        let limit = saturated_from.map(|from| from.saturating_sub(1).min(u16::MAX.into()) as u16);
        let limits: [u16; LANES] = std::array::from_fn(|lane| limit[channel(lane)]);
        let (mut highest, mut saturated) = ([0u16; LANES], [0u16; LANES]);
        let (chunks, rest) = row.as_flattened().as_chunks();
        let mut last = [0; LANES];
        last[..rest.len()].copy_from_slice(rest);
        for codes in chunks.iter().chain([&last]) {
            for lane in 0..LANES {
                let is_saturated = codes[lane] > limits[lane];
                saturated[lane] += u16::from(is_saturated);
                highest[lane] = highest[lane].max(if is_saturated { 0 } else { codes[lane] });
            }
        }
        let mut summary = Self {
            highest: [0; CHANNELS],
            saturated: saturated.iter().map(|count| usize::from(*count)).sum(),
        };
        for (lane, code) in highest.into_iter().enumerate() {
            let own = &mut summary.highest[channel(lane)];
            *own = code.max(*own);
        }
        summary
    }
}

/// Counts samples with a code.
fn count([first, second]: &mut [(u16, usize); 2], code: u16, samples: usize) {
    if code == first.0 {
        first.1 += samples;
    } else if code > first.0 {
        (*first, *second) = ((code, samples), *first);
    } else if code == second.0 {
        second.1 += samples;
    } else if code > second.0 {
        *second = (code, samples);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::MAX_SIDE;

    fn statistics(codes: impl IntoIterator<Item = u16>, white: u16) -> CodeStatistics {
        let mut statistics = CodeStatistics::of_photograph();
        let pixels: Vec<[u16; CHANNELS]> = codes.into_iter().map(|code| [code; CHANNELS]).collect();
        for row in pixels.chunks(1000) {
            statistics.add_row(row, [u32::from(white); CHANNELS]);
        }
        statistics
    }

    /// Codes of a photograph: many values, none of them often.
    fn codes(count: u32) -> impl Iterator<Item = u16> {
        (0..count).map(|i| (600 + i.wrapping_mul(2_654_435_761) % 40_000) as u16)
    }

    #[test]
    fn saturated_samples_of_the_longest_row_are_counted() {
        let row = vec![[60_000; CHANNELS]; MAX_SIDE as usize];
        let mut statistics = CodeStatistics::of_photograph();
        statistics.add_row(&row, [50_000; CHANNELS]);
        assert_eq!(statistics.saturated, CHANNELS * row.len());
    }

    #[test]
    fn samples_that_pile_up_below_white_are_found_in_all_photographs_together() {
        let clean = statistics(codes(9000), 60_000);
        assert_eq!(
            (clean.saturated, clean.undeclared_saturation()),
            (0, [None; CHANNELS])
        );
        let clipped = |part: u32| {
            statistics(
                codes(9000)
                    .skip(3000 * part as usize)
                    .take(3000)
                    .map(|code| code.min(40_000)),
                60_000,
            )
        };
        let merged = clipped(0).merge(clipped(1)).merge(clipped(2));
        assert_eq!(merged.undeclared_saturation(), [Some(40_000); CHANNELS]);
        // A stuck pixel in each of many photographs is none.
        let stuck = (0..40)
            .map(|_| statistics(codes(3000).map(|code| code / 2).chain([50_000; 3]), 60_000));
        let stuck = stuck.fold(CodeStatistics::default(), CodeStatistics::merge);
        assert_eq!(stuck.undeclared_saturation(), [None; CHANNELS]);
        let black = statistics([0; 9000], 60_000);
        assert_eq!(
            (black.undeclared_saturation(), black.step()),
            ([None; CHANNELS], 1)
        );
        // Declared, it is counted.
        let declared = statistics(codes(9000).map(|code| code.min(40_000)), 40_000);
        assert!(declared.saturated > 64);
        assert_eq!(declared.undeclared_saturation(), [None; CHANNELS]);
        // Each channel for itself.
        let mut green = CodeStatistics::of_photograph();
        let row: Vec<_> = codes(9000)
            .map(|code| [code, code.min(30_000), code])
            .collect();
        green.add_row(&row, [1 << 16; CHANNELS]);
        assert_eq!(green.undeclared_saturation(), [None, Some(30_000), None]);
    }

    #[test]
    fn saturation_that_is_found_later_is_counted_as_if_it_had_been_declared() {
        let clipped = || codes(9000).map(|code| code.min(40_000));
        let found = statistics(clipped(), 60_000).with_saturation([40_000; CHANNELS]);
        let declared = statistics(clipped(), 40_000);
        assert_eq!(found.saturated, declared.saturated);
        assert_eq!(found.undeclared_saturation(), [None; CHANNELS]);
        assert_eq!(found.highest[0][0], declared.highest[0][0]);
    }

    #[test]
    fn codes_of_eight_bits_are_told_and_their_brightest_is_no_saturation() {
        for factor in EIGHT_BIT_FACTORS {
            let eight_bits = statistics(codes(9000).map(|code| code / 257 * factor), 65_535);
            assert_eq!(eight_bits.step(), factor);
            assert_eq!(eight_bits.undeclared_saturation(), [None; CHANNELS]);
        }
        assert_eq!(statistics(codes(9000), 60_000).step(), 1);
    }
}
