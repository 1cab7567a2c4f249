//! The first bytes of a TIFF.

/// BigTIFF has 43 (+) instead of 42 (*).
const SIGNATURES: [&[u8]; 4] = [b"II*\0", b"II+\0", b"MM\0*", b"MM\0+"];

/// Whether a file that begins so is a TIFF, BigTIFF included.
pub fn is_tiff(start: &[u8]) -> bool {
    SIGNATURES.iter().any(|bytes| start.starts_with(bytes))
}
