//! Parts of the file to bytes and back.

pub(super) mod basis;
mod bytes;
mod colour;
mod dct;
pub(super) mod direct;
pub(super) mod halves;
mod tokens;
pub(super) mod transform;

use zstd::zstd_safe;

use super::FormatError;
use super::error::Part;

/// zstd level for writing. 19 is the highest that stays within the window of 8 MiB; decoding speed
/// does not depend on it.
const LEVEL: i32 = 19;

/// Most bytes that a part may have before compression, and largest window of a zstd frame.
pub const MOST_PLAIN: u64 = 8 << 20;

/// Most bytes that `plain` bytes can take compressed (ZSTD_COMPRESSBOUND, rounded up). A part that
/// claims more is refused before it is gathered.
pub(super) fn compressed_bound(plain: u64) -> u64 {
    plain + plain / 256 + 64
}

/// Compresses into one zstd frame.
pub(super) fn compress(plain: &[u8]) -> Result<Vec<u8>, FormatError> {
    zstd::bulk::compress(plain, LEVEL).map_err(FormatError::Compress)
}

/// Decompresses one zstd frame to exactly `need` bytes.
pub(super) fn decompress(frame: &[u8], need: usize) -> Result<Vec<u8>, PartError> {
    check_frame(frame)?;
    let mut plain = zeros(need)?;
    let length = zstd_safe::decompress(&mut plain[..], frame)
        .map_err(|code| damaged(zstd_safe::get_error_name(code)))?;
    match length == need {
        true => Ok(plain),
        false => Err(damaged(format!("it has {length} bytes, not {need}"))),
    }
}

/// Refuses what is not one frame of a window that any decoder must take (RFC 8878, section 3.1.1).
fn check_frame(frame: &[u8]) -> Result<(), PartError> {
    let &[0x28, 0xB5, 0x2F, 0xFD, descriptor, window, ..] = frame else {
        return Err(damaged("it is no zstd frame"));
    };
    let one = zstd_safe::find_frame_compressed_size(frame) == Ok(frame.len());
    if !one {
        return Err(damaged("it is not one zstd frame"));
    }
    let single_segment = descriptor & 0x20 != 0;
    let (exponent, mantissa) = (u64::from(window >> 3), u64::from(window & 7));
    let window = (8 + mantissa) << (7 + exponent);
    match single_segment || window <= MOST_PLAIN {
        true => Ok(()),
        false => Err(damaged(format!("its zstd window has {window} bytes"))),
    }
}

/// Whether bytes have the checksum they are to have. Fuzzing goes past it, to what it keeps away.
pub(super) fn intact(bytes: &[u8], crc: u32) -> bool {
    cfg!(fuzzing) || checksum(bytes) == crc
}

/// CRC-32C (RFC 3720, appendix B.4).
#[cfg(not(target_arch = "wasm32"))]
pub(super) fn checksum(bytes: &[u8]) -> u32 {
    crc32c::crc32c(bytes)
}

/// CRC-32C by a table of 1 kB: browsers have no instruction for it, and would have to load larger ones.
#[cfg(target_arch = "wasm32")]
pub(super) fn checksum(bytes: &[u8]) -> u32 {
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI);
    CRC.checksum(bytes)
}

/// A vector of `length` zeros. A browser may refuse what the limits allow: that is an error, not
/// the end of the page.
pub(super) fn zeros<T: bytemuck::Zeroable + Clone>(length: usize) -> Result<Vec<T>, PartError> {
    let mut values = Vec::new();
    values
        .try_reserve_exact(length)
        .map_err(|_| PartError::Memory(length.saturating_mul(size_of::<T>())))?;
    values.resize(length, T::zeroed());
    Ok(values)
}

/// Why a part's bytes give nothing.
#[derive(Debug)]
pub(super) enum PartError {
    /// zstd's word for it, or what is wrong with what it gave.
    Damaged(String),
    /// The system has no memory for this many bytes more.
    Memory(usize),
}

fn damaged(what: impl Into<String>) -> PartError {
    PartError::Damaged(what.into())
}

impl PartError {
    /// The error for the caller, who knows which part it was.
    pub fn of(self, part: Part) -> FormatError {
        match self {
            Self::Damaged(reason) => FormatError::Decompress { part, reason },
            Self::Memory(need) => FormatError::Memory { need },
        }
    }
}
