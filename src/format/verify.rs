//! Checking the chunks of a file one by one, in little memory.

use super::budget::Budget;
use super::chunk::ChunkId;
use super::codec::transform::Planes;
use super::codec::{basis, direct, halves};
use super::error::{FormatError, SectionError};
use super::index::FileIndex;
use super::scan::{Coding, Scan};
use crate::transport::CHANNELS;

/// Checks that the bytes of one chunk have its length and its checksum, and decode.
///
/// # Errors
/// The [`FormatError`] that a reader would report.
pub fn check(index: &FileIndex, chunk: ChunkId, bytes: &[u8]) -> Result<(), FormatError> {
    let range = index.range(chunk);
    if bytes.len() as u64 != range.end - range.start {
        return Err(FormatError::Truncated {
            got: range.start + bytes.len() as u64,
            need: index.header.file_bytes,
        });
    }
    index.check_crc(chunk, bytes)?;
    decode(index, chunk, bytes).map_err(|error| error.in_chunk(chunk))
}

fn decode(index: &FileIndex, chunk: ChunkId, bytes: &[u8]) -> Result<(), SectionError> {
    let budget = &Budget::unlimited();
    let (geometry, scan) = (&index.header.geometry, &index.scans[chunk.scan]);
    let area = geometry.window.area();
    let Some(tile) = chunk.tile else {
        let functions = index.new_basis_functions(chunk.scan).len();
        let mut functions = basis::try_zeroed(functions, area, budget)?;
        return basis::decode(bytes, &mut functions, area, budget);
    };
    let extent = geometry.tile(tile).extent;
    let content_bytes = index.entry(chunk.scan, tile).content_bytes;
    let try_values = |columns: usize| budget.try_zeroed::<[f32; CHANNELS]>(extent.area() * columns);
    match scan.coding {
        Coding::Transform => {
            let mut planes = match index.has_colour_klt(chunk.scan, tile) {
                true => Planes::default(),
                false => Planes::with_klt(),
            };
            planes.add(extent, scan, bytes, content_bytes, budget)
        }
        Coding::Direct => {
            let order = direct::centre_out_order(geometry.window, budget)?;
            let mut functions = try_values(area)?;
            direct::add(&mut functions, &order, scan, bytes, content_bytes, budget)
        }
        Coding::Halves | Coding::DirectHalves => {
            let columns = scan.count.into();
            let scan = Scan { first: 0, ..*scan };
            halves::add(
                &mut try_values(columns)?,
                columns,
                &scan,
                None,
                bytes,
                budget,
            )
        }
    }
}
