//! CRC-32C (RFC 3720, appendix B.4).

use super::error::{FormatError, SectionName};

/// The checksum of `bytes`.
#[cfg(not(target_arch = "wasm32"))]
pub fn checksum(bytes: &[u8]) -> u32 {
    crc32c::crc32c(bytes)
}

/// The checksum of `bytes`, by a table of 1 kB: WebAssembly has no instruction for it, and larger
/// tables would have to be downloaded.
#[cfg(target_arch = "wasm32")]
pub fn checksum(bytes: &[u8]) -> u32 {
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI);
    CRC.checksum(bytes)
}

/// Checks that the bytes of `section` have the checksum `crc`. Fuzzing ignores checksums, to reach the code behind them.
///
/// # Errors
/// [`FormatError::ChecksumMismatch`].
pub fn check_crc(bytes: &[u8], crc: u32, section: SectionName) -> Result<(), FormatError> {
    match cfg!(fuzzing) || checksum(bytes) == crc {
        true => Ok(()),
        false => Err(FormatError::ChecksumMismatch(section)),
    }
}
