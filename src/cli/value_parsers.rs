//! What several commands' arguments share: wrong combinations, numbers in a range, amounts of bytes.

use std::fmt;
use std::ops::RangeInclusive;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use crate::transport::Extent;

/// A wrong combination of options that are valid on their own.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct UsageError(pub &'static str);

/// Parses a number from `min` to `max`.
pub fn parse_number(text: &str, min: f32, max: f32) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(number) if (min..=max).contains(&number) => Ok(number),
        _ => Err(format!("it must be a number from {min} to {max}")),
    }
}

/// Parses `WxH` with both sides in the range `sides`.
pub fn parse_extent(text: &str, sides: RangeInclusive<u32>) -> Result<Extent, String> {
    let (min, max) = (sides.start(), sides.end());
    let side = |s: &str| {
        let side = s.parse().ok().filter(|n| sides.contains(n));
        side.ok_or_else(|| format!("each side must be between {min} and {max}"))
    };
    let (width, height) = text
        .split_once('x')
        .ok_or("give it as WIDTHxHEIGHT, for instance 128x128")?;
    Ok(Extent::new(side(width)?, side(height)?))
}

/// The name of an option's value, as on the command line.
pub fn value_name(value: impl ValueEnum) -> String {
    let value = value.to_possible_value();
    value.map_or_else(String::new, |value| value.get_name().to_owned())
}

/// A number of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ByteCount(pub u64);

impl ByteCount {
    /// Parses `512M`, `4GiB`, `500kB` or a number of bytes. `K`, `M`, `G` and `T` are powers of 1024; `kB`, `MB`, `GB`
    /// and `TB`, the units of printed amounts, are powers of 1000.
    pub fn parse(text: &str) -> Result<Self, String> {
        let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
        let unit: u64 = match text[digits.len()..].to_ascii_lowercase().as_str() {
            "" | "b" => 1,
            "kb" => 1_000,
            "mb" => 1_000_000,
            "gb" => 1_000_000_000,
            "tb" => 1_000_000_000_000,
            "k" | "kib" => 1 << 10,
            "m" | "mib" => 1 << 20,
            "g" | "gib" => 1 << 30,
            "t" | "tib" => 1 << 40,
            _ => return Err("give it like 512M, 4G or 4GiB, or as a number of bytes".to_owned()),
        };
        let number: u64 = digits.trim().parse().map_err(|_| {
            format!("{digits:?} is not a whole number; give it like 512M, 4G or 4GiB")
        })?;
        let bytes = number.checked_mul(unit).ok_or("it is too large")?;
        Ok(Self(bytes))
    }
}

impl fmt::Display for ByteCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let units = [(30, "G"), (20, "M"), (10, "K"), (0, "")];
        let divides = |(shift, _): &(u32, &str)| self.0 > 0 && self.0.is_multiple_of(1 << shift);
        let (shift, unit) = units.into_iter().find(divides).unwrap_or_default();
        write!(f, "{}{unit}", self.0 >> shift)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn byte_counts_parse_with_and_without_units() {
        for (text, bytes) in [
            ("4096", 4096),
            ("512M", 512 << 20),
            ("4G", 4 << 30),
            ("4GiB", 4 << 30),
            ("4gb", 4_000_000_000),
            ("100kB", 100_000),
            ("1 T", 1 << 40),
        ] {
            let count = ByteCount(bytes);
            assert_eq!(ByteCount::parse(text), Ok(count), "{text}");
            assert_eq!(ByteCount::parse(&count.to_string()), Ok(count));
        }
        for text in ["", "G", "4X", "4.5G", "-1G", "99999999999T"] {
            assert!(ByteCount::parse(text).is_err(), "{text}");
        }
    }
}
