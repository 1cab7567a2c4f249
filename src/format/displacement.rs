//! The extension `DISP`: the displacement of a correspondence that bends.
//!
//! ```text
//! u16 spacing     camera pixels between control points
//! u16 reserved    0
//! f32 step        light elements of a code of 1
//! zstd frame      codes, [axis, row, column], each minus the one to its left, as byte planes
//! ```

use super::codec::byte_planes;
use super::codec::zstd_frame::{compress, decompress};
use super::error::{FormatError, SectionError, damaged};
use super::extension::FormatExtension;
use super::fields::FieldReader;
use super::memory_budget::MemoryBudget;
use crate::transport::{DisplacementGrid, Extent};

/// The name of the extension.
pub const TAG: [u8; 4] = *b"DISP";
/// Bytes before the frame.
const FIXED_BYTES: usize = 8;
/// Bytes of a control point's codes.
const POINT_BYTES: usize = 4;

/// The extension of a grid.
///
/// # Errors
/// [`FormatError::Compress`].
pub fn encode(grid: &DisplacementGrid) -> Result<FormatExtension, FormatError> {
    let width = grid.points().width as usize;
    let differences: Vec<u16> = (0..2)
        .flat_map(|axis| {
            grid.codes().chunks(width).flat_map(move |row| {
                let before = std::iter::once(0).chain(row.iter().map(move |code| code[axis]));
                let pairs = row.iter().zip(before);
                pairs
                    .map(move |(code, before)| byte_planes::zigzag(code[axis].wrapping_sub(before)))
            })
        })
        .collect();
    let frame = compress(&byte_planes::split(differences.into_iter()))?;
    let mut data = Vec::with_capacity(FIXED_BYTES + frame.len());
    data.extend(
        [grid.spacing() as u16, 0]
            .map(u16::to_le_bytes)
            .as_flattened(),
    ); // at most 4096
    data.extend(grid.step().to_le_bytes());
    data.extend(frame);
    Ok(FormatExtension {
        tag: TAG,
        must_understand: true,
        data,
    })
}

/// The grid over the pixels that a grid with a given spacing covers.
pub fn decode(
    data: &[u8],
    covered: impl FnOnce(u32) -> Extent,
    budget: &MemoryBudget,
) -> Result<DisplacementGrid, SectionError> {
    let invalid = || damaged("the displacement of the correspondence is invalid");
    let mut fields = FieldReader(data);
    let fixed = fields.try_bytes(FIXED_BYTES).ok_or_else(invalid)?;
    let [spacing, _] = FieldReader(fixed).u16s();
    let [step] = FieldReader(&fixed[4..]).u32s().map(f32::from_bits);
    let spacing = u32::from(spacing);
    if !(DisplacementGrid::MIN_SPACING..=DisplacementGrid::MAX_SPACING).contains(&spacing) {
        return Err(invalid());
    }
    let points = DisplacementGrid::points_over(covered(spacing), spacing);
    if points.area() > DisplacementGrid::MAX_POINTS {
        return Err(invalid());
    }
    let planes = decompress(fields.0, POINT_BYTES * points.area(), budget)?;
    let mut codes: Vec<[i16; 2]> = budget.try_zeroed(points.area())?;
    {
        let mut differences = byte_planes::join(&planes).map(byte_planes::unzigzag);
        for axis in 0..2 {
            for row in codes.chunks_mut(points.width as usize) {
                let mut code = 0i16;
                for (point, difference) in row.iter_mut().zip(&mut differences) {
                    code = code.wrapping_add(difference);
                    point[axis] = code;
                }
            }
        }
    }
    budget.release_vec(planes);
    DisplacementGrid::new(spacing, step, points, codes).map_err(|_| invalid())
}
