//! Parts of the file to bytes and back.
//!
//! All parts are compressed the same way: numbers of two or four bytes are split into one plane for
//! each byte, the least significant first, so that zstd sees the bytes that are alike together.

pub(super) mod basis;
pub(super) mod direct;
pub(super) mod factored;

use super::FormatError;
use super::error::Part;

/// zstd level for writing. 19 is the highest whose window stays within a tile's own size; decoding
/// speed does not depend on it.
const LEVEL: i32 = 19;

/// Most bytes that `plain` bytes can take compressed (ZSTD_COMPRESSBOUND, rounded up). A part that
/// claims more is refused before it is gathered.
pub(super) fn compressed_bound(plain: u64) -> u64 {
    plain + plain / 256 + 64
}

fn compress(planes: &[u8]) -> Result<Vec<u8>, FormatError> {
    zstd::bulk::compress(planes, LEVEL).map_err(FormatError::Compress)
}

/// Decompresses exactly `need` bytes.
fn decompress(bytes: &[u8], need: usize) -> Result<Vec<u8>, PartError> {
    let mut planes = zeros(need)?;
    let length = zstd::bulk::decompress_to_buffer(bytes, &mut planes)
        .map_err(|e| PartError::Damaged(e.to_string()))?;
    match length == need {
        true => Ok(planes),
        false => Err(PartError::Damaged(format!(
            "it has {length} bytes, not {need}"
        ))),
    }
}

/// A vector of `length` zeros. A browser may refuse what the limits allow: that is an error, not
/// the end of the page.
fn zeros<T: bytemuck::Zeroable + Clone>(length: usize) -> Result<Vec<T>, PartError> {
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

impl PartError {
    /// The error for the caller, who knows which part it was.
    pub fn of(self, part: Part) -> FormatError {
        match self {
            Self::Damaged(reason) => FormatError::Decompress { part, reason },
            Self::Memory(need) => FormatError::Memory { need },
        }
    }
}
