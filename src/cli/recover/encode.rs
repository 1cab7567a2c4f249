//! Encodes the recovered tiles of a checkpoint as an `.ltm` file.

use std::io::{self, ErrorKind};
use std::ops::Range;
use std::sync::Mutex;

use anyhow::{Error, Result};

use super::args::RecoverArgs;
use super::checkpoint::{Checkpoint, lock};
use super::memory_plan::FILE_TILE_SIDE;
use super::tile_record;
use crate::cli::process_resources::InterruptibleCores;
use crate::cli::progress;
use crate::format::{DistortionMetric, EncodedFile, EncoderInput, FormatError, Metadata};
use crate::job_executor::{Cancelled, Executor};
use crate::recover::{HoldoutValidation, PreparedRecovery};
use crate::transport::{Basis, Decibels, FloatTile, Geometry, TileTransportFunctions};

/// The loss of SNR on held-out patterns.
impl DistortionMetric for HoldoutValidation {
    fn tiles(&self) -> Vec<FloatTile> {
        self.tiles().cloned().collect()
    }

    fn loss(&self, functions: &[TileTransportFunctions]) -> Decibels {
        self.loss(functions)
    }
}

/// Encodes the tiles in `checkpoint` of `recovery`. An interruption is reported as [`Cancelled`].
pub fn encode_file(
    args: &RecoverArgs,
    checkpoint: &Mutex<Checkpoint>,
    recovery: &PreparedRecovery,
    metadata: Metadata,
    cores: &InterruptibleCores,
) -> Result<EncodedFile> {
    let _spinner = progress::spinner("compressing");
    let (recovered, basis) = (recovery.geometry(), recovery.basis());
    let geometry = Geometry {
        tile_side: FILE_TILE_SIDE,
        ..*recovered
    };
    let (rank, area) = (basis.map_or(0, Basis::rank), recovered.window.area());
    let tile = |i: usize| -> io::Result<FloatTile> {
        if cores.is_cancelled() {
            return Err(ErrorKind::Interrupted.into());
        }
        let rect = geometry.tile(i);
        let mut tile = FloatTile::dark(rect);
        let columns = tile_indices(rect.x, rect.extent.width, recovered.tile_side);
        let rows = tile_indices(rect.y, rect.extent.height, recovered.tile_side);
        for (x, y) in columns.flat_map(|x| rows.clone().map(move |y| (x, y))) {
            let i = (y * recovered.tile_grid().width + x) as usize;
            let record = lock(checkpoint).read(i)?;
            let recovered = tile_record::decode(recovered.tile(i), rank, area, &record)?;
            tile.insert(&recovered);
        }
        Ok(tile)
    };
    let source = EncoderInput {
        geometry,
        basis,
        tile: &tile,
        metadata,
        extensions: Vec::new(),
    };
    let metric = recovery.holdout_validation();
    let metric = metric.map(|validation| validation as &dyn DistortionMetric);
    let file = EncodedFile::new(source, args.encoding_target(metric), cores);
    file.map_err(|error| {
        let output = args.output.display();
        match error {
            FormatError::Source(e) if e.kind() == ErrorKind::Interrupted => Cancelled.into(),
            FormatError::TooLarge { .. } => Error::new(error).context(format!(
                "{output}: cannot be written; the recovered tiles are kept: give the same command with \
                 --resume and a larger --max-bytes, or without --max-bytes"
            )),
            other => Error::new(other).context(output.to_string()),
        }
    })
}

/// Columns or rows of the recovered tiles that cover `length` pixels from `start`.
fn tile_indices(start: u32, length: u32, side: u32) -> Range<u32> {
    start / side..(start + length).div_ceil(side)
}
