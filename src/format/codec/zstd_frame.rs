//! Zstandard frames (RFC 8878) whose content length the caller knows.

use zstd::zstd_safe;

use crate::format::constants::MAX_CONTENT_BYTES;
use crate::format::error::{FormatError, SectionError, damaged};
use crate::format::memory_budget::MemoryBudget;

/// The highest level whose window stays within 8 MiB. Decoding speed does not depend on it.
const LEVEL: i32 = 19;

/// Maximum bytes of the frame of `content` bytes (ZSTD_COMPRESSBOUND, rounded up). A longer chunk is
/// refused by the directory alone.
pub fn compressed_bound(content: u64) -> u64 {
    content + content / 256 + 64
}

/// Compresses into one frame.
///
/// # Errors
/// [`FormatError::Compress`].
pub fn compress(content: &[u8]) -> Result<Vec<u8>, FormatError> {
    let mut frame = Vec::with_capacity(zstd_safe::compress_bound(content.len()));
    zstd_safe::compress(&mut frame, content, LEVEL)
        .map_err(|code| FormatError::Compress(zstd_safe::get_error_name(code)))?;
    Ok(frame)
}

/// Decompresses one frame to exactly `length` bytes.
///
/// # Errors
/// [`SectionError`] if `frame` is not one frame of this content, or the budget refuses memory.
pub fn decompress(
    frame: &[u8],
    length: usize,
    budget: &MemoryBudget,
) -> Result<Vec<u8>, SectionError> {
    check_frame(frame)?;
    let mut content = budget.try_zeroed(length)?;
    let got = zstd_safe::decompress(&mut content[..], frame)
        .map_err(|code| damaged(zstd_safe::get_error_name(code)))?;
    match got == length {
        true => Ok(content),
        false => Err(damaged(format!("it has {got} bytes, not {length}"))),
    }
}

/// Compresses a content of any length into one frame, in little memory.
///
/// # Errors
/// [`FormatError::Compress`].
pub fn compress_large(content: &[u8]) -> Result<Vec<u8>, FormatError> {
    #[cfg(not(target_arch = "wasm32"))]
    if content.len() > small_tables::MIN_BYTES {
        return small_tables::compress(content);
    }
    compress(content)
}

/// Compression of large contents: the level's own tables would take 80 MB.
#[cfg(not(target_arch = "wasm32"))]
mod small_tables {
    use zstd::zstd_safe::{CCtx, CParameter, ErrorCode, compress_bound, get_error_name};

    use super::{FormatError, LEVEL};

    /// Contents of fewer bytes have smaller tables anyway.
    pub const MIN_BYTES: usize = 1 << 20;
    /// Logarithm of the number of entries of a table, 4 bytes each.
    const TABLE_LOG: u32 = 20;

    pub fn compress(content: &[u8]) -> Result<Vec<u8>, FormatError> {
        let mut frame = Vec::with_capacity(compress_bound(content.len()));
        let compressed = context().and_then(|mut context| context.compress2(&mut frame, content));
        compressed.map_err(|code| FormatError::Compress(get_error_name(code)))?;
        Ok(frame)
    }

    pub fn context() -> Result<CCtx<'static>, ErrorCode> {
        let mut context = CCtx::create();
        for parameter in [
            CParameter::CompressionLevel(LEVEL),
            CParameter::ChainLog(TABLE_LOG),
            CParameter::HashLog(TABLE_LOG),
        ] {
            context.set_parameter(parameter)?;
        }
        Ok(context)
    }
}

/// Checks that the bytes are one frame, with a window that every decoder must support (RFC 8878, section 3.1.1).
fn check_frame(frame: &[u8]) -> Result<(), SectionError> {
    let &[0x28, 0xB5, 0x2F, 0xFD, descriptor, window, ..] = frame else {
        return Err(damaged("it is not a zstd frame"));
    };
    if zstd_safe::find_frame_compressed_size(frame) != Ok(frame.len()) {
        return Err(damaged("it is not one zstd frame"));
    }
    let is_single_segment = descriptor & 0x20 != 0;
    let (exponent, mantissa) = (u64::from(window >> 3), u64::from(window & 7));
    let window = (8 + mantissa) << (7 + exponent);
    match is_single_segment || window <= MAX_CONTENT_BYTES {
        true => Ok(()),
        false => Err(damaged(format!("its zstd window has {window} bytes"))),
    }
}

#[cfg(not(target_arch = "wasm32"))]
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_contents_are_compressed_in_little_memory() {
        let number = |i: u32| (i.wrapping_mul(2_654_435_761) >> 20) as u16;
        let content: Vec<u8> = (0..4 << 20).flat_map(|i| number(i).to_le_bytes()).collect();
        let frame = compress_large(&content).unwrap();
        assert!(frame.len() < content.len());
        let budget = MemoryBudget::unlimited();
        assert!(decompress(&frame, content.len(), &budget).unwrap() == content);
        let mut context = small_tables::context().unwrap();
        let mut again = Vec::with_capacity(zstd_safe::compress_bound(content.len()));
        context.compress2(&mut again, &content[..]).unwrap();
        assert_eq!(again, frame);
        assert!(context.sizeof() < 20 << 20, "{} bytes", context.sizeof());
        // Small contents have the bytes that they always had.
        let small = &content[..1 << 16];
        assert_eq!(compress_large(small).unwrap(), compress(small).unwrap());
    }
}
