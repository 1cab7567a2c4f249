//! Scans: passes over all tiles. Each adds components or slots, or makes them more precise.

use super::constants::SCAN_RECORD_BYTES;
use super::fields::FieldReader;
use crate::transport::Decibels;

/// How a scan's values are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Coefficients: colour transform, cosine transform, quantisation.
    Transform,
    /// Coefficients as half-precision floats.
    Halves,
    /// Direct functions: luma and chroma, quantisation.
    Direct,
    /// Direct functions as half-precision floats.
    DirectHalves,
}

impl Coding {
    const ALL: [Self; 4] = [
        Self::Transform,
        Self::Halves,
        Self::Direct,
        Self::DirectHalves,
    ];

    /// Whether chunks hold slots of direct functions, not coefficients.
    pub fn is_direct(self) -> bool {
        matches!(self, Self::Direct | Self::DirectHalves)
    }
}

/// One pass over all tiles. A decoded value is the sum of what its scans bring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scan {
    /// How its values are written.
    pub coding: Coding,
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

impl Scan {
    /// A scan whose chunks are not encoded yet.
    pub(super) fn new(coding: Coding, first: u16, count: u16, step: f32) -> Self {
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

    /// Number of basis functions in the scan's basis chunk, if earlier scans have brought `known`.
    pub(super) fn new_basis_functions(&self, known: usize) -> usize {
        match self.coding.is_direct() {
            true => 0,
            false => self.end().saturating_sub(known),
        }
    }

    /// The record in the directory.
    pub(super) fn encode(&self) -> [u8; SCAN_RECORD_BYTES] {
        let coding = Coding::ALL.iter().position(|coding| *coding == self.coding);
        let mut record = [0; SCAN_RECORD_BYTES];
        record[..2].copy_from_slice(&(coding.unwrap_or(0) as u16 + 1).to_le_bytes());
        record[2..4].copy_from_slice(&self.first.to_le_bytes());
        record[4..6].copy_from_slice(&self.count.to_le_bytes());
        record[8..12].copy_from_slice(&self.step.to_le_bytes());
        record[12..16].copy_from_slice(&(self.snr.0 as f32).to_le_bytes());
        record[16..20].copy_from_slice(&self.basis_bytes.to_le_bytes());
        record[20..].copy_from_slice(&self.basis_crc.to_le_bytes());
        record
    }

    /// Reads a record; `None` if the coding is unknown, the reserved field is not 0, the count is 0,
    /// or the step is not positive and finite.
    pub(super) fn decode(record: &[u8; SCAN_RECORD_BYTES]) -> Option<Self> {
        let mut fields = FieldReader(record);
        let coding = usize::from(fields.u16()).checked_sub(1)?;
        let (first, count, reserved) = (fields.u16(), fields.u16(), fields.u16());
        let scan = Self {
            coding: *Coding::ALL.get(coding)?,
            first,
            count,
            step: fields.f32(),
            snr: Decibels(f64::from(fields.f32())),
            basis_bytes: fields.u32(),
            basis_crc: fields.u32(),
        };
        let is_valid = reserved == 0 && count > 0 && scan.step > 0.0 && scan.step.is_finite();
        is_valid.then_some(scan)
    }
}
