//! From the tiles of a checkpoint to a file.

use std::io::{self, ErrorKind};
use std::sync::{Mutex, PoisonError};

use clap::Args;

use super::checkpoint::Checkpoint;
use super::memory::Bytes;
use super::process::Interrupt;
use super::tile_record;
use crate::format::{EncodedFile, FormatError, HEADER_BYTES, Judge, Metadata, Quality, Source};
use crate::recover::{HoldoutValidation, Recovery};
use crate::transport::{BandTile, Basis, Decibels, Geometry, RecoveredTile, TransportFunctions};

/// Camera pixels along a tile's side in a file: more than those of a recovered tile, for what is
/// compressed together is smaller, and few enough to fetch what is seen alone.
pub const TILE_SIDE: u32 = 128;
/// SNR that may be lost in a file unless another quality is asked for, by what hold-out validation tells. It
/// recovered from fewer patterns than the file is made of, and so a little more noise.
const LOSS: Decibels = Decibels(0.5);
/// SNR against what was recovered where there is no hold-out validation: with so few patterns that is noisy.
const USUAL: Decibels = Decibels(32.0);

/// How good, or how small, the file is to be.
#[derive(Debug, Args)]
#[group(multiple = false)]
pub struct QualityArgs {
    /// SNR of the file against what was recovered, in dB: more is larger [default: as much as tells by the photographs]
    #[arg(long, value_name = "DB", value_parser = |text: &str| super::number_in(text, 5.0, 75.0))]
    quality: Option<f32>,
    /// Make the best file of at most so many bytes: 500kB, 2MB (kB and MB are powers of 1000, KiB and MiB of 1024)
    #[arg(long, value_name = "BYTES", value_parser = parse_most)]
    max_bytes: Option<Bytes>,
    /// Keep eleven bits of every coefficient, for archives: many times larger
    #[arg(long)]
    lossless: bool,
}

/// Parses the most bytes of a file.
fn parse_most(text: &str) -> Result<Bytes, String> {
    let most = Bytes::parse(text)?;
    match most.0 > HEADER_BYTES as u64 {
        true => Ok(most),
        false => Err(format!(
            "a file's header alone has {HEADER_BYTES} bytes; give more"
        )),
    }
}

impl QualityArgs {
    /// What was asked for.
    fn quality<'a>(&self, judge: Option<&'a Judging<'a>>) -> Quality<'a> {
        match (self.quality, self.max_bytes, judge) {
            (Some(snr), ..) => Quality::Snr(Decibels(f64::from(snr))),
            (_, Some(most), _) => Quality::Bytes(most.0),
            _ if self.lossless => Quality::Lossless,
            (.., Some(judge)) => Quality::Loss(LOSS, judge),
            (.., None) => Quality::Snr(USUAL),
        }
    }
}

/// The hold-out validation of a recovery as the judge of a file.
struct Judging<'a>(&'a HoldoutValidation);

impl Judge for Judging<'_> {
    fn tiles(&self) -> Vec<BandTile> {
        let of_square = |tile: &RecoveredTile| {
            let mut square = BandTile::dark(tile.rect());
            square.put(tile.clone());
            square
        };
        self.0.tiles().map(of_square).collect()
    }

    fn loss(&self, functions: &[TransportFunctions]) -> Decibels {
        self.0.loss(functions)
    }
}

/// Encodes the tiles that `checkpoint` keeps of a recovery. Told to stop, it ends with
/// [`FormatError::Source`] of [`ErrorKind::Interrupted`].
pub fn file(
    args: &QualityArgs,
    checkpoint: &Mutex<Checkpoint>,
    recovery: &Recovery,
    metadata: Metadata,
    interrupt: &Interrupt,
) -> Result<EncodedFile, FormatError> {
    let (recovered, basis) = (recovery.geometry(), recovery.basis());
    let geometry = Geometry {
        tile_side: TILE_SIDE,
        ..*recovered
    };
    let (rank, area) = (basis.map_or(0, Basis::rank), recovered.window.area());
    let tile = |i: usize| -> io::Result<BandTile> {
        if interrupt.told() {
            return Err(ErrorKind::Interrupted.into());
        }
        let rect = geometry.tile(i);
        let mut tile = BandTile::dark(rect);
        for (x, y) in parts(rect.x, rect.extent.width, recovered.tile_side).flat_map(|x| {
            parts(rect.y, rect.extent.height, recovered.tile_side).map(move |y| (x, y))
        }) {
            let i = (y * recovered.tile_grid().width + x) as usize;
            let kept = checkpoint.lock();
            let record = kept.unwrap_or_else(PoisonError::into_inner).record(i)?;
            let part = tile_record::decode(recovered.tile(i), rank, area, &record)?;
            tile.put(part);
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
    let judge = recovery.holdout_validation().map(Judging);
    EncodedFile::new(source, args.quality(judge.as_ref()), &interrupt.cores())
}

/// Columns or rows of recovered tiles within a file's tile from `start` on.
fn parts(start: u32, length: u32, side: u32) -> impl Iterator<Item = u32> + Clone {
    start / side..(start + length).div_ceil(side)
}
