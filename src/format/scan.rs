//! Scans: passes over all tiles. Each adds components or slots, or makes them more precise.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::constants::SCAN_RECORD_BYTES;
use super::fields::FieldReader;
use crate::transport::Decibels;

/// How a scan's values are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u16)]
pub enum ScanCoding {
    /// Coefficients: colour transform, cosine transform, quantisation.
    Transform = 1,
    /// Coefficients as half-precision floats.
    Halves,
    /// Direct functions: luma and chroma, quantisation.
    Direct,
    /// Direct functions as half-precision floats.
    DirectHalves,
}

impl ScanCoding {
    /// Whether chunks hold slots of direct functions, not coefficients.
    pub fn is_direct(self) -> bool {
        matches!(self, Self::Direct | Self::DirectHalves)
    }
}

/// Number of basis functions in the basis chunks of `scans`.
pub(super) fn rank_of(scans: &[ProgressiveScan]) -> usize {
    let coefficients = scans.iter().filter(|scan| !scan.coding.is_direct());
    coefficients.map(ProgressiveScan::end).max().unwrap_or(0)
}

/// One pass over all tiles. A decoded value is the sum of what its scans bring.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProgressiveScan {
    /// How its values are written.
    pub coding: ScanCoding,
    /// First component, or for direct codings the first slot by centre-out index.
    pub first: u16,
    /// Number of components or slots.
    pub count: u16,
    /// Quantisation step: the value of a quantised 1.
    pub step: f32,
    /// SNR of all scans up to this one against the encoder's input.
    pub snr: Decibels,
    /// Bytes of the basis chunk, which precedes the tile chunks.
    pub basis_bytes: u32,
    pub(super) basis_crc: u32,
}

impl ProgressiveScan {
    /// A scan whose chunks are not encoded yet.
    pub(super) fn new(coding: ScanCoding, first: u16, count: u16, step: f32) -> Self {
        Self {
            coding,
            first,
            count,
            // Steps for values near the ends of single precision may lie beyond them.
            step: step.clamp(f32::MIN_POSITIVE, f32::MAX),
            snr: Decibels(0.0),
            basis_bytes: 0,
            basis_crc: 0,
        }
    }

    /// One past the last component or slot.
    pub fn end(&self) -> usize {
        usize::from(self.first) + usize::from(self.count)
    }

    /// The components or slots.
    pub(super) fn items(&self) -> Range<usize> {
        self.first.into()..self.end()
    }

    /// Number of basis functions in the scan's basis chunk, if earlier scans have brought `known`.
    pub(super) fn new_basis_functions(&self, known: usize) -> usize {
        match self.coding.is_direct() {
            true => 0,
            false => self.end().saturating_sub(known),
        }
    }

    /// The record in the directory.
    pub(super) fn encode(&self) -> Vec<u8> {
        let [step, snr] = [self.step, self.snr.0 as f32].map(f32::to_bits);
        let shorts = [self.coding as u16, self.first, self.count, 0].map(u16::to_le_bytes);
        let words = [step, snr, self.basis_bytes, self.basis_crc].map(u32::to_le_bytes);
        [shorts.as_flattened(), words.as_flattened()].concat()
    }

    /// Reads a record; `None` if the coding is unknown, the reserved field is not 0, the count is 0,
    /// or the step is not positive and finite.
    pub(super) fn decode(record: &[u8; SCAN_RECORD_BYTES]) -> Option<Self> {
        let mut fields = FieldReader(record);
        let [coding, first, count, reserved] = fields.u16s();
        let [step, snr, basis_bytes, basis_crc] = fields.u32s();
        let (step, snr) = (f32::from_bits(step), f32::from_bits(snr));
        let coding = match coding {
            1 => ScanCoding::Transform,
            2 => ScanCoding::Halves,
            3 => ScanCoding::Direct,
            4 => ScanCoding::DirectHalves,
            _ => return None,
        };
        let is_valid = reserved == 0 && count > 0 && step > 0.0 && step.is_finite();
        is_valid.then_some(Self {
            coding,
            first,
            count,
            step,
            snr: Decibels(snr.into()),
            basis_bytes,
            basis_crc,
        })
    }
}
