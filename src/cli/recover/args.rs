//! Arguments of `ltm-export recover`, and the options that it shares with its stages.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use crate::cli::value_parsers::{ByteCount, UsageError, parse_number};
use crate::export::FileQuality;
use crate::format::HEADER_BYTES;
use crate::recover::{Method, SparsityBasis};
use crate::transport::{Decibels, Window};

/// Enough for about four megapixels under 80 patterns to be read once. A constant, so that the same command fits, or is
/// refused, on every machine.
pub const DEFAULT_MEMORY: &str = "4G";

/// Recover the light transport of an object from a folder of photographs
#[derive(Debug, Args)]
pub struct RecoverArgs {
    /// Capture folder: capture.json and the files it names
    pub capture: PathBuf,
    /// File to write
    #[arg(short, long, value_name = "FILE.ltm")]
    pub output: PathBuf,
    #[command(flatten)]
    pub options: RecoveryOptions,
    /// Limit on memory; photographs that do not fit are read twice, in strips. The file is the same
    #[arg(long, value_name = "BYTES", default_value = DEFAULT_MEMORY, value_parser = ByteCount::parse)]
    pub memory: ByteCount,
    /// Continue an interrupted recovery from FILE.ltm.checkpoint
    #[arg(long)]
    pub resume: bool,
    /// Print one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// What determines the file that is recovered from a capture.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
pub struct RecoveryOptions {
    /// Recovery method
    #[arg(long, value_enum, default_value_t = MethodName::Learned)]
    method: MethodName,
    /// Basis in which --method bpdn finds sparse light transport functions [default: identity]
    #[arg(long, value_enum)]
    pub basis: Option<SparsityBasis>,
    /// Side of the window of light elements around each camera pixel's correspondence: an odd number, or "auto" to
    /// estimate it
    #[arg(long, value_name = "W", default_value = "15", value_parser = parse_window)]
    pub window: WindowArg,
    /// Use the first K shots only [default: all but every tenth, which are held out]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    pub patterns: Option<u32>,
    /// SNR of the file relative to the recovered light transport, in dB; more is larger [default: as much as the noise
    /// of the photographs justifies]
    #[arg(long, value_name = "DB", group = "rate", value_parser = |text: &str| parse_number(text, 5.0, 75.0))]
    quality: Option<f32>,
    /// Write the best file of at most this size: 500kB, 2MB (kB and MB are powers of 1000, KiB and MiB of 1024)
    #[arg(long, value_name = "BYTES", group = "rate", value_parser = parse_max_bytes)]
    max_bytes: Option<ByteCount>,
    /// Store eleven bits of every coefficient, for archives; many times larger
    #[arg(long, group = "rate")]
    lossless: bool,
    /// Number of levels, each with half the pixels a side of the one before: 1, or down to at most 512 pixels [default: as
    /// many for pictures of more than 1024 pixels a side, otherwise 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=12))]
    pub levels: Option<u32>,
    /// Which responses of display and camera to use where the photographs contradict capture.json
    #[arg(long, value_enum, default_value_t = TrustedCalibration::Declared)]
    pub trust: TrustedCalibration,
    /// Do not estimate and correct shifts of the picture between photographs
    #[arg(long)]
    pub no_register: bool,
    /// Fail with exit status 65, and write nothing, if there is a warning
    #[arg(long)]
    pub strict: bool,
    /// Write the file even if the photographs do not follow from their patterns
    #[arg(long)]
    pub force: bool,
}

impl RecoveryOptions {
    /// # Errors
    /// [`UsageError`] if options contradict one another.
    pub fn check(&self) -> Result<(), UsageError> {
        match self.basis.is_some() && self.method().basis().is_none() {
            true => Err(UsageError("--basis is for --method bpdn")),
            false => Ok(()),
        }
    }

    pub fn method(&self) -> Method {
        match self.method {
            MethodName::Learned => Method::Learned,
            MethodName::Nnls => Method::Nnls,
            MethodName::Bpdn => Method::Bpdn(self.basis.unwrap_or(SparsityBasis::Identity)),
        }
    }

    /// The quality or size asked for.
    pub fn quality(&self) -> FileQuality {
        match (self.quality, self.max_bytes) {
            (Some(snr), _) => FileQuality::Snr(Decibels(f64::from(snr))),
            (_, Some(max_bytes)) => FileQuality::MaxBytes(max_bytes.0),
            _ if self.lossless => FileQuality::Lossless,
            _ => FileQuality::ByNoise,
        }
    }
}

fn parse_max_bytes(text: &str) -> Result<ByteCount, String> {
    let max_bytes = ByteCount::parse(text)?;
    match max_bytes.0 > HEADER_BYTES as u64 {
        true => Ok(max_bytes),
        false => Err(format!(
            "the header of a file alone has {HEADER_BYTES} bytes; give more"
        )),
    }
}

/// The value of `--window`; `None` for "auto". The alias hides the `Option` from clap, which would take it as an
/// argument without a default.
pub type WindowArg = Option<Window>;

pub fn parse_window(text: &str) -> Result<WindowArg, String> {
    if text == "auto" {
        return Ok(None);
    }
    let hint = "give an odd number of light elements, or auto";
    let side = text.parse::<u32>().map_err(|e| format!("{e}; {hint}"))?;
    Window::new(side).map(Some).map_err(|e| e.to_string())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MethodName {
    /// A prior learned from the photographs themselves
    Learned,
    /// Non-negative least squares
    Nnls,
    /// Basis pursuit denoising: the sparsest function that explains the photographs
    Bpdn,
}

/// Which responses are used where the photographs contradict `capture.json`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrustedCalibration {
    /// capture.json; differences are warnings
    Declared,
    /// Responses of display and camera as the photographs show them
    Estimated,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_memory_is_a_byte_count() {
        assert_eq!(ByteCount::parse(DEFAULT_MEMORY), Ok(ByteCount(4 << 30)));
    }
}
