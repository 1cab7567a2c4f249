//! What `simulate` and `photograph` write into capture folders alike.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use anyhow::{Context, Result};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use crate::transport::Extent;

/// With more electrons photon noise is far below a code, and Poisson sampling loses precision.
pub const MAX_ELECTRONS: u64 = 1_000_000_000_000;

/// Writes a PNG.
pub fn write_png(
    path: &Path,
    extent: Extent,
    bytes: &[u8],
    color: ExtendedColorType,
) -> Result<()> {
    let write = || -> Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        // Photographs are mostly noise, which no level compresses well.
        PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Sub)
            .write_image(bytes, extent.width, extent.height, color)?;
        Ok(file.flush()?)
    };
    write().with_context(|| path.display().to_string())
}
