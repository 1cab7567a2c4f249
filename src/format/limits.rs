//! How much memory a file may ask for.

use super::codec::{MOST_PLAIN, basis};
use super::{ChunkEntry, FormatError, Head, Header};
use crate::transport::{CHANNELS, CoefficientTile, TexelCode};

/// Bounds on what a reader allocates on a file's word.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Bytes of the head, of all tiles as they are decoded, of what decoding one takes for a while,
    /// and of a light and a picture.
    pub decoded_bytes: u64,
}

impl Default for Limits {
    /// 2 GiB: a 512² picture with a window of 15 that is not factored decodes to a third of it, and
    /// it is as much as a 32-bit browser module can hold.
    fn default() -> Self {
        Self {
            decoded_bytes: 2 << 30,
        }
    }
}

impl Limits {
    /// Refuses a file whose head would take more than allowed.
    pub(super) fn check_header(&self, header: &Header) -> Result<(), FormatError> {
        self.allow(head_bytes(header))
    }

    /// Refuses a file that would take more than allowed.
    pub(super) fn check(&self, head: &Head) -> Result<(), FormatError> {
        let Header { geometry, rank, .. } = head.header;
        let value = (CHANNELS * size_of::<f32>()) as u64;
        let (rank, area) = (usize::from(rank), geometry.window.area() as u64);
        let has = |tile: usize, direct: bool| {
            let scans = head.scans.iter().enumerate();
            let mut scans = scans.filter(|(_, scan)| scan.coding.is_direct() == direct);
            scans.any(|(i, _)| head.entry(i, tile).bytes > 0)
        };
        // At most 2^30 pixels of 63² elements of 12 bytes: no overflow.
        let (mut kept, mut working) = (0, 0);
        for (i, rect) in geometry.tiles().enumerate() {
            let pixels = rect.extent.area() as u64;
            // A tile is kept as numbers until it is whole, and then as codes.
            let codes = (CoefficientTile::texels(rect, rank) * size_of::<TexelCode>()) as u64;
            let numbers = pixels * rank as u64 * value;
            let functions = pixels * area * value;
            let [factored, direct] = [false, true].map(|direct| u64::from(has(i, direct)));
            kept += factored * codes.max(numbers) + direct * functions;
            // Coefficients in red, green and blue, and codes of both.
            working = working.max(factored * (numbers + codes) + direct * functions);
        }
        self.allow(head_bytes(&head.header) + kept + working + 2 * MOST_PLAIN)
    }

    fn allow(&self, need: u64) -> Result<(), FormatError> {
        if need <= self.decoded_bytes {
            Ok(())
        } else {
            Err(FormatError::Limit {
                need,
                limit: self.decoded_bytes,
            })
        }
    }
}

/// What a file takes whatever its tiles: the bytes of the head, which are gathered before they are
/// read, what they decompress to, and what that becomes; and as soon as it is relit a picture, a light,
/// and the light as it was last.
fn head_bytes(header: &Header) -> u64 {
    let geometry = &header.geometry;
    let pixel = size_of::<[f32; 4]>() as u64;
    let relit = (geometry.camera.area() as u64 + 2 * geometry.light.area() as u64) * pixel;
    let functions = 2 * basis::plain_bytes(header.rank.into(), geometry.window.area()) as u64;
    let entries = u64::from(header.scans) * (geometry.tile_grid().area() as u64 + 1);
    let kept = (size_of::<ChunkEntry>() + size_of::<u64>() + 1) as u64;
    2 * header.directory_plain_bytes() + entries * kept + functions + header.head_bytes() + relit
}
