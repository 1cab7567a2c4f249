//! Encodes the recovered tiles of a checkpoint as an `.ltm` file.

use std::io::{self, ErrorKind};
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use clap::Args;

use super::checkpoint::Checkpoint;
use super::tile_record;
use crate::cli::arguments::{ByteCount, parse_number};
use crate::cli::process::Interrupt;
use crate::format::{EncodedFile, FormatError, HEADER_BYTES, Judge, Metadata, Quality, Source};
use crate::recover::{HoldoutValidation, Recovery};
use crate::transport::{BandTile, Basis, Decibels, Geometry, RecoveredTile, TransportFunctions};

/// Camera pixels along a side of a tile in the file. Larger tiles than those of the recovery compress
/// better; these are still small enough to load only the visible ones.
pub const FILE_TILE_SIDE: u32 = 128;
/// Default loss of SNR by the file, as hold-out validation estimates it. Validation recovers from fewer
/// patterns, and so with slightly more noise.
const DEFAULT_LOSS: Decibels = Decibels(0.5);
/// Default SNR of the file relative to the recovered transport without hold-out validation. With so few
/// patterns the transport is noisy.
const DEFAULT_SNR: Decibels = Decibels(32.0);

/// Quality or size of the file.
#[derive(Debug, Args)]
#[group(multiple = false)]
pub struct QualityArgs {
    /// SNR of the file relative to the recovered light transport, in dB; more is larger [default: as much as
    /// the noise of the photographs justifies]
    #[arg(long, value_name = "DB", value_parser = |text: &str| parse_number(text, 5.0, 75.0))]
    quality: Option<f32>,
    /// Write the best file of at most this size: 500kB, 2MB (kB and MB are powers of 1000, KiB and MiB of 1024)
    #[arg(long, value_name = "BYTES", value_parser = parse_max_bytes)]
    max_bytes: Option<ByteCount>,
    /// Store eleven bits of every coefficient, for archives; many times larger
    #[arg(long)]
    lossless: bool,
}

/// Parses a size larger than that of the header.
fn parse_max_bytes(text: &str) -> Result<ByteCount, String> {
    let max_bytes = ByteCount::parse(text)?;
    match max_bytes.0 > HEADER_BYTES as u64 {
        true => Ok(max_bytes),
        false => Err(format!(
            "the header of a file alone has {HEADER_BYTES} bytes; give more"
        )),
    }
}

impl QualityArgs {
    /// The quality asked for, or the default.
    fn quality<'a>(&self, metric: Option<&'a HoldoutMetric<'a>>) -> Quality<'a> {
        match (self.quality, self.max_bytes, metric) {
            (Some(snr), ..) => Quality::Snr(Decibels(f64::from(snr))),
            (_, Some(max_bytes), _) => Quality::Bytes(max_bytes.0),
            _ if self.lossless => Quality::Lossless,
            (.., Some(metric)) => Quality::Loss(DEFAULT_LOSS, metric),
            (.., None) => Quality::Snr(DEFAULT_SNR),
        }
    }
}

/// Distortion metric: the loss of SNR on held-out patterns.
struct HoldoutMetric<'a>(&'a HoldoutValidation);

impl Judge for HoldoutMetric<'_> {
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

/// Encodes the tiles in `checkpoint` of `recovery`. An interruption is reported as
/// [`FormatError::Source`] with [`ErrorKind::Interrupted`].
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
    EncodedFile::new(source, args.quality(metric.as_ref()), &interrupt.cores())
}

/// Columns or rows of the recovered tiles that cover `length` pixels from `start`.
fn tile_indices(start: u32, length: u32, side: u32) -> Range<u32> {
    start / side..(start + length).div_ceil(side)
}
