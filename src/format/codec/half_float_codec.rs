//! Codings 2 and 4: values as half-precision floats in units of the scan's step, for archives.
//!
//! Content of the frame: binary16 `[item, channel, pixel]` as [byte planes](super::byte_planes). An item is
//! a component, or a slot in centre-out order.

use half::f16;

use super::byte_planes::{join, split};
use super::colour::ColourVector;
use super::scan_functions::ScanFunctions;
use super::zstd_frame::{compress, decompress};
use crate::format::error::{FormatError, SectionError, damaged};
use crate::format::memory_budget::MemoryBudget;
use crate::format::scan::ProgressiveScan;
use crate::transport::CHANNELS;

/// Bytes of `values` values before compression.
pub fn content_bytes(values: usize) -> usize {
    2 * values
}

/// The power of two that brings values of this peak to half precision's most precise range.
pub fn step_for(peak: f32) -> f32 {
    // Half precision ends at 65504; a few binades remain for other tiles.
    match peak.is_normal() {
        true => libm::exp2f((libm::log2f(peak).ceil() - 14.0).clamp(-120.0, 100.0)),
        false => 1.0,
    }
}

/// Compresses values in units of `step`. Values that are not finite become zero; the range is clipped.
///
/// # Errors
/// [`FormatError::Compress`].
pub fn encode(values: &[f32], step: f32) -> Result<Vec<u8>, FormatError> {
    compress(&split(
        values.iter().map(|value| half(*value, step).to_bits()),
    ))
}

/// Whether a finite value is larger than a half-precision number of `step` reaches.
#[cfg(not(target_arch = "wasm32"))]
pub fn is_clipped(values: &[f32], step: f32) -> bool {
    let max = f16::MAX.to_f32();
    values
        .iter()
        .any(|value| value.is_finite() && (value / step).abs() > max)
}

/// Squared error of [`encode`] on finite values.
pub fn error(values: &[f32], step: f32) -> f64 {
    let error =
        |value: &f32| f64::from(half(*value, step).to_f32()) * f64::from(step) - f64::from(*value);
    values.iter().map(|value| error(value).powi(2)).sum()
}

fn half(value: f32, step: f32) -> f16 {
    let value = value / step;
    match value.is_finite() {
        true => f16::from_f32(value.clamp(f16::MIN.to_f32(), f16::MAX.to_f32())),
        false => f16::ZERO,
    }
}

/// The column of `values` that item `item` of a scan stands for; `order` is that of direct scans' slots.
fn column(scan: &ProgressiveScan, order: Option<&[u16]>, item: usize) -> usize {
    let at = usize::from(scan.first) + item;
    order.map_or(at, |order| order[at].into())
}

/// Adds the coefficients of a chunk to `values`, `[pixel, component]` of `rank` components.
///
/// # Errors
/// [`SectionError`] if the chunk is damaged or holds a value that is not finite, or the budget refuses memory.
pub fn add(
    values: &mut [ColourVector],
    rank: usize,
    scan: &ProgressiveScan,
    frame: &[u8],
    budget: &MemoryBudget,
) -> Result<(), SectionError> {
    let content = try_content(values.len() / rank * usize::from(scan.count), frame, budget)?;
    let mut halves = join(&content).map(half_value);
    for component in scan.items() {
        for c in 0..CHANNELS {
            let of_component = values.iter_mut().skip(component).step_by(rank);
            for (value, half) in of_component.zip(&mut halves) {
                value[c] += half * scan.step;
            }
        }
    }
    Ok(())
}

/// Reads a chunk of direct functions of a tile into `functions`.
///
/// # Errors
/// As [`add`].
pub fn read_functions(
    functions: &mut ScanFunctions,
    pixels: usize,
    slots: &[u16],
    frame: &[u8],
    budget: &MemoryBudget,
) -> Result<(), SectionError> {
    let content = try_content(pixels * slots.len(), frame, budget)?;
    let (low, high) = content.split_at(content.len() / 2);
    let half = |at: usize| i16::from_le_bytes([low[at], high[at]]);
    for p in 0..pixels {
        for (item, &slot) in slots.iter().enumerate() {
            let halves = [0, 1, 2].map(|c| half((item * CHANNELS + c) * pixels + p));
            functions.push(halves, slot);
        }
        functions.end_pixel();
    }
    Ok(())
}

/// The value of a half float.
#[inline(never)] // in WebAssembly a hundred instructions
pub fn half_value(bits: u16) -> f32 {
    f16::from_bits(bits).to_f32()
}

/// The content of a chunk of `colours` colours, whose values are finite.
fn try_content(
    colours: usize,
    frame: &[u8],
    budget: &MemoryBudget,
) -> Result<Vec<u8>, SectionError> {
    let content = decompress(frame, content_bytes(colours * CHANNELS), budget)?;
    let is_finite = join(&content).all(|bits| f16::from_bits(bits).is_finite());
    match is_finite {
        true => Ok(content),
        false => Err(damaged("a value is not a finite number")),
    }
}

/// The values that [`add`] and [`read_functions`] read, from `values`, `[pixel, column]` of `columns` columns.
pub fn gather(
    values: &[ColourVector],
    columns: usize,
    scan: &ProgressiveScan,
    order: Option<&[u16]>,
) -> Vec<f32> {
    let count = usize::from(scan.count);
    let mut gathered = Vec::with_capacity(values.len() / columns.max(1) * count * CHANNELS);
    for item in 0..count {
        let column = column(scan, order, item);
        for c in 0..CHANNELS {
            let of_column = values.iter().skip(column).step_by(columns);
            gathered.extend(of_column.map(|value| value[c]));
        }
    }
    gathered
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::scan::ScanCoding;
    use crate::transport::{entries_by_pixel, entry_slot};

    fn scan(first: u16, count: u16, step: f32) -> ProgressiveScan {
        ProgressiveScan::new(ScanCoding::DirectHalves, first, count, step)
    }

    #[test]
    fn decoded_values_have_eleven_bits() {
        let order = [3, 0, 1, 2, 4];
        let budget = MemoryBudget::unlimited();
        for (peak, is_direct) in [(1e-6f32, true), (0.3, false), (0.3, true), (7e5, false)] {
            let value = |i: usize| [1.0, 0.5, -0.7].map(|c| c * peak * (i as f32 * 0.37).sin());
            let values: Vec<ColourVector> = (0..5 * 40).map(value).collect();
            let step = step_for(peak);
            let mut got = vec![[0.0; CHANNELS]; values.len()];
            let mut claimed = 0.0;
            for scan in [scan(0, 2, step), scan(2, 3, step)] {
                let gathered = gather(&values, 5, &scan, is_direct.then_some(&order[..]));
                let frame = encode(&gathered, step).unwrap();
                claimed += error(&gathered, step);
                if !is_direct {
                    add(&mut got, 5, &scan, &frame, &budget).unwrap();
                    continue;
                }
                let mut functions = ScanFunctions::try_new(&scan, 40, 0, &budget).unwrap();
                let slots = &order[scan.items()];
                read_functions(&mut functions, 40, slots, &frame, &budget).unwrap();
                let pixels = entries_by_pixel(&functions.entries);
                for (function, entries) in got.chunks_exact_mut(5).zip(pixels) {
                    for entry in entries.iter().filter(|entry| entry[..3] != [0; 3]) {
                        function[entry_slot(entry)] = functions.value(entry);
                    }
                }
            }
            let square = |(got, want): (&f32, &f32)| f64::from(got - want).powi(2);
            let pairs = got.as_flattened().iter().zip(values.as_flattened());
            let error: f64 = pairs.map(square).sum();
            assert!(
                (error / claimed - 1.0).abs() < 1e-3,
                "{error:e}, not {claimed:e}"
            );
            for (got, want) in got.as_flattened().iter().zip(values.as_flattened()) {
                assert!((got - want).abs() <= want.abs() / 2048.0 + peak * 1e-7);
            }
        }
    }

    #[test]
    fn values_that_are_not_finite_are_written_as_zero_and_refused_in_a_file() {
        let mut got = [[1.0; CHANNELS]];
        let frame = encode(&[f32::NAN, f32::INFINITY, f32::MAX], 1.0).unwrap();
        let mut add = |frame: &[u8]| {
            let scan = scan(0, 1, 1.0);
            let budget = MemoryBudget::unlimited();
            let mut functions = ScanFunctions::try_new(&scan, 1, 0, &budget).unwrap();
            let read = read_functions(&mut functions, 1, &[0], frame, &budget);
            let added = add(&mut got, 1, &scan, frame, &budget);
            assert_eq!(read.is_ok(), added.is_ok());
            added.map(|()| got)
        };
        assert_eq!(add(&frame).unwrap(), [[1.0, 1.0, 65505.0]]);
        assert!(add(&compress(&[0, 0, 0, 0, 0, 0x7C]).unwrap()).is_err());
    }
}
