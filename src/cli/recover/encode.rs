//! Encodes the recovered tiles of a checkpoint as an `.ltm` file.

use std::io::{self, ErrorKind};
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use super::args::QualityArgs;
use super::checkpoint::Checkpoint;
use super::memory_plan::FILE_TILE_SIDE;
use super::tile_record;
use crate::cli::process::Interrupt;
use crate::format::{DistortionMetric, EncodedFile, FormatError, Metadata, Source};
use crate::recover::{HoldoutValidation, Recovery};
use crate::transport::{BandTile, Basis, Decibels, Geometry, RecoveredTile, TransportFunctions};

/// Distortion metric: the loss of SNR on held-out patterns.
struct HoldoutMetric<'a>(&'a HoldoutValidation);

impl DistortionMetric for HoldoutMetric<'_> {
    fn tiles(&self) -> Vec<BandTile> {
        let to_band_tile = |recovered: &RecoveredTile| {
            let mut tile = BandTile::dark(recovered.rect());
            tile.insert(recovered.clone());
            tile
        };
        self.0.tiles().map(to_band_tile).collect()
    }

    fn loss(&self, functions: &[TransportFunctions]) -> Decibels {
        self.0.loss(functions)
    }
}

/// Encodes the tiles in `checkpoint` of `recovery`. An interruption is reported as [`FormatError::Source`] with
/// [`ErrorKind::Interrupted`].
pub fn encode_file(
    args: &QualityArgs,
    checkpoint: &Mutex<Checkpoint>,
    recovery: &Recovery,
    metadata: Metadata,
    interrupt: &Interrupt,
) -> Result<EncodedFile, FormatError> {
    let (recovered, basis) = (recovery.geometry(), recovery.basis());
    let geometry = Geometry {
        tile_side: FILE_TILE_SIDE,
        ..*recovered
    };
    let (rank, area) = (basis.map_or(0, Basis::rank), recovered.window.area());
    let tile = |i: usize| -> io::Result<BandTile> {
        if interrupt.is_requested() {
            return Err(ErrorKind::Interrupted.into());
        }
        let rect = geometry.tile(i);
        let mut tile = BandTile::dark(rect);
        let columns = tile_indices(rect.x, rect.extent.width, recovered.tile_side);
        let rows = tile_indices(rect.y, rect.extent.height, recovered.tile_side);
        for (x, y) in columns.flat_map(|x| rows.clone().map(move |y| (x, y))) {
            let i = (y * recovered.tile_grid().width + x) as usize;
            let checkpoint = checkpoint.lock();
            let record = checkpoint.unwrap_or_else(PoisonError::into_inner).read(i)?;
            tile.insert(tile_record::decode(recovered.tile(i), rank, area, &record)?);
        }
        Ok(tile)
    };
    let source = Source {
        geometry,
        basis,
        tile: &tile,
        metadata,
        extensions: Vec::new(),
    };
    let metric = recovery.holdout_validation().map(HoldoutMetric);
    EncodedFile::new(
        source,
        args.quality(
            metric
                .as_ref()
                .map(|metric| metric as &dyn DistortionMetric),
        ),
        &interrupt.cores(),
    )
}

/// Columns or rows of the recovered tiles that cover `length` pixels from `start`.
fn tile_indices(start: u32, length: u32, side: u32) -> Range<u32> {
    start / side..(start + length).div_ceil(side)
}
