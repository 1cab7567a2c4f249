//! Scans: passes over all tiles, each of which makes the picture better.

use super::codec::{basis, compressed_bound, direct, halves, transform};
use super::fields::Fields;
use crate::transport::{CHANNELS, Decibels, Extent, Geometry};

/// Most scans of a file.
pub(super) const MOST_SCANS: u32 = 1024;

/// How the chunks of a scan are to be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Coefficients over the basis: colour axes, cosine transform, rounded.
    Transform,
    /// Coefficients over the basis as half-precision floats.
    Halves,
    /// Light transport functions element by element: luma and chroma, rounded.
    Direct,
    /// Light transport functions element by element as half-precision floats.
    DirectHalves,
}

impl Coding {
    const ALL: [Self; 4] = [
        Self::Transform,
        Self::Halves,
        Self::Direct,
        Self::DirectHalves,
    ];

    /// Whether chunks hold elements of functions, not coefficients over the basis.
    pub fn is_direct(self) -> bool {
        matches!(self, Self::Direct | Self::DirectHalves)
    }
}

/// One pass over all tiles. What scans bring adds up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scan {
    /// How its chunks are to be read.
    pub coding: Coding,
    /// First component, or for direct codings the first slot in order from the window's middle.
    pub first: u16,
    /// How many components or slots.
    pub count: u16,
    /// Value of a number 1.
    pub step: f32,
    /// SNR of what the scans up to this one give, against what the file was made of.
    pub snr: Decibels,
    /// Compressed bytes of the functions of the basis that the scan brings; they come before its
    /// chunks.
    pub basis_bytes: u32,
    pub(super) basis_crc: u32,
}

impl Scan {
    /// Bytes of a scan in the directory.
    pub(super) const BYTES: usize = 24;

    /// A scan of which nothing has been written.
    pub(super) fn new(coding: Coding, first: u16, count: u16, step: f32) -> Self {
        Self {
            coding,
            first,
            count,
            // Of numbers at the ends of single precision a coarser or finer step may be beyond them.
            step: step.clamp(f32::MIN_POSITIVE, f32::MAX),
            snr: Decibels(0.0),
            basis_bytes: 0,
            basis_crc: 0,
        }
    }

    /// One past its last component or slot.
    pub fn end(&self) -> usize {
        usize::from(self.first) + usize::from(self.count)
    }

    pub(super) fn encode(&self) -> [u8; Self::BYTES] {
        let coding = Coding::ALL.iter().position(|coding| *coding == self.coding);
        let mut out = Vec::with_capacity(Self::BYTES);
        out.extend((coding.unwrap_or(0) as u16 + 1).to_le_bytes());
        out.extend(self.first.to_le_bytes());
        out.extend(self.count.to_le_bytes());
        out.extend([0; 2]);
        out.extend(self.step.to_le_bytes());
        out.extend((self.snr.0 as f32).to_le_bytes());
        out.extend(self.basis_bytes.to_le_bytes());
        out.extend(self.basis_crc.to_le_bytes());
        let mut bytes = [0; Self::BYTES];
        bytes.copy_from_slice(&out);
        bytes
    }

    /// A scan of a file with this geometry and a basis of `rank` functions, of which those before
    /// have brought `known`; `None` if there can be no such scan.
    pub(super) fn decode(
        bytes: &[u8; Self::BYTES],
        geometry: &Geometry,
        rank: u16,
        known: usize,
    ) -> Option<Self> {
        let mut fields = Fields(bytes);
        let coding = usize::from(fields.u16()).checked_sub(1);
        let (first, count, reserved) = (fields.u16(), fields.u16(), fields.u16());
        let scan = Self {
            coding: *Coding::ALL.get(coding?)?,
            first,
            count,
            step: fields.f32(),
            snr: Decibels(f64::from(fields.f32())),
            basis_bytes: fields.u32(),
            basis_crc: fields.u32(),
        };
        let area = geometry.window.area();
        let brings = scan.brings(known);
        let fits = match scan.coding.is_direct() {
            true => scan.end() <= area,
            false => usize::from(first) <= known && scan.end() <= usize::from(rank),
        };
        let basis_fits = match brings {
            0 => scan.basis_bytes == 0,
            functions => {
                let plain = basis::plain_bytes(functions, area) as u64;
                (1..=compressed_bound(plain)).contains(&u64::from(scan.basis_bytes))
            }
        };
        let sound = reserved == 0
            && count > 0
            && fits
            && basis_fits
            && scan.step > 0.0
            && scan.step.is_finite();
        sound.then_some(scan)
    }

    /// How many functions of the basis it brings, where `known` have come before.
    pub(super) fn brings(&self, known: usize) -> usize {
        match self.coding.is_direct() {
            true => 0,
            false => self.end().saturating_sub(known),
        }
    }

    /// Whether a chunk of a tile of this extent can have so many bytes, and so many before
    /// compression.
    pub(super) fn could_hold(&self, extent: Extent, bytes: u32, plain: u32) -> bool {
        let (bytes, plain) = (u64::from(bytes), u64::from(plain));
        let values = extent.area() * CHANNELS * usize::from(self.count);
        let (most_plain, bound) = match self.coding {
            Coding::Transform => (
                transform::most_plain(extent, self.count),
                transform::bound(plain),
            ),
            Coding::Direct => (direct::most_plain(extent, self.count), direct::bound(plain)),
            Coding::Halves | Coding::DirectHalves => {
                let exact = halves::plain_bytes(values) as u64;
                let most = if plain == exact { exact } else { 0 };
                (most, compressed_bound(plain))
            }
        };
        match bytes {
            0 => plain == 0,
            _ => plain > 0 && plain <= most_plain.min(super::codec::MOST_PLAIN) && bytes <= bound,
        }
    }
}
