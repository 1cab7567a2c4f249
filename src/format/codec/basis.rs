//! The basis that factored tiles share.

use super::{PartError, compress, decompress, zeros};
use crate::format::FormatError;
use crate::transport::Basis;

/// Bytes of a basis before compression: f32, for it is small and every pixel depends on it.
pub fn plain_bytes(rank: u16, area: usize) -> usize {
    usize::from(rank) * area * 4
}

/// Compresses a basis that has kernels.
pub fn encode(basis: &Basis) -> Result<Vec<u8>, FormatError> {
    let values: Vec<f32> = basis.kernels.iter().flatten().copied().collect();
    let mut planes = vec![0u8; 4 * values.len()];
    for (i, value) in values.iter().enumerate() {
        for (plane, byte) in value.to_le_bytes().into_iter().enumerate() {
            planes[plane * values.len() + i] = byte;
        }
    }
    compress(&planes)
}

/// Decompresses a basis of `rank` kernels of `area` elements.
pub fn decode(bytes: &[u8], rank: u16, area: usize) -> Result<Basis, PartError> {
    let planes = decompress(bytes, plain_bytes(rank, area))?;
    let values = planes.len() / 4;
    let mut kernels = Vec::new();
    for k in 0..usize::from(rank) {
        let mut kernel: Vec<f32> = zeros(area)?;
        for (s, value) in kernel.iter_mut().enumerate() {
            let at = k * area + s;
            *value =
                f32::from_le_bytes([0, 1, 2, 3].map(|plane: usize| planes[plane * values + at]));
            if !value.is_finite() {
                return Err(PartError::Damaged(format!(
                    "element {s} of kernel {k} is not a finite number"
                )));
            }
        }
        kernels.push(kernel);
    }
    Ok(Basis { kernels })
}
