//! Checking the parts of a file one by one, in little memory.

use super::codec::transform::Planes;
use super::codec::{PartError, basis, direct, halves, zeros};
use super::head::{Head, PartNumber};
use super::{Coding, FormatError};
use crate::transport::CHANNELS;

/// Checks the bytes of one part: its checksum, and that it can be decoded.
pub fn check(head: &Head, part: PartNumber, bytes: &[u8]) -> Result<(), FormatError> {
    let range = head.range(part);
    if bytes.len() as u64 != range.end - range.start {
        return Err(FormatError::Truncated {
            got: range.start + bytes.len() as u64,
            need: head.header.file_bytes,
        });
    }
    head.check_crc(part, bytes)?;
    decode(head, part, bytes).map_err(|e| e.of(part.into()))
}

fn decode(head: &Head, part: PartNumber, bytes: &[u8]) -> Result<(), PartError> {
    let (geometry, scan) = (&head.header.geometry, &head.scans[part.scan]);
    let area = geometry.window.area();
    let Some(tile) = part.tile else {
        return basis::decode(bytes, head.functions(part.scan).len(), area).map(|_| ());
    };
    let (extent, plain) = (
        geometry.tile(tile).extent,
        head.entry(part.scan, tile).plain,
    );
    let room = |each: usize| zeros::<[f32; CHANNELS]>(extent.area() * each);
    let places = || (0..scan.count).collect::<Vec<u16>>();
    match scan.coding {
        Coding::Transform => {
            let mut planes = match head.brings_palette(part.scan, tile) {
                true => Planes::default(),
                false => Planes::with_palette(),
            };
            planes.add(extent, scan, bytes, plain)
        }
        Coding::Direct => {
            let order = direct::order(geometry.window);
            direct::add(&mut room(area)?, &order, scan, bytes, plain)
        }
        Coding::Halves | Coding::DirectHalves => {
            let each = scan.count.into();
            halves::add(&mut room(each)?, each, &places(), scan.step, bytes)
        }
    }
}
