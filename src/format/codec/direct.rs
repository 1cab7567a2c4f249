//! Light transport functions element by element, in few bytes.
//!
//! Elements come by their distance from the window's middle, where functions peak: what is far is
//! mostly zero, and a run of zeros to the end is one token. Channels of an element are rounded to
//! multiples of the scan's step, then luma and differences of colours are kept. Scans add up.

use super::colour::{Pixel, luma_chroma, red_green_blue};
use super::tokens::{self, MOST, Reader, Writer};
use super::{MOST_PLAIN, PartError, damaged, zeros};
use crate::format::FormatError;
use crate::format::chunk::Chunk;
use crate::format::scan::Scan;
use crate::transport::{CHANNELS, Extent, Window};

/// As in the cosine transform's: small elements are noise.
const ROUNDING: f32 = 0.2;
const ROUNDING_AT_FIRST: f32 = 0.3;

/// Slots of a window from its middle outwards, equally far ones row by row.
pub fn order(window: Window) -> Vec<u16> {
    let side = window.side() as i32;
    let distance = |slot: i32| (slot % side - side / 2).pow(2) + (slot / side - side / 2).pow(2);
    // By rings, not by sorting, which browsers would have to load.
    let mut rings = vec![Vec::new(); distance(0) as usize + 1];
    for slot in 0..side * side {
        rings[distance(slot) as usize].push(slot as u16);
    }
    rings.concat()
}

/// Most tokens of a tile in a scan: one a number.
pub fn most_plain(extent: Extent, count: u16) -> u64 {
    (extent.area() * CHANNELS) as u64 * u64::from(count)
}

/// Most bytes of a chunk of so many tokens.
pub fn bound(plain: u64) -> u64 {
    tokens::bound(plain)
}

/// Slots of which any tile's numbers are few enough for one chunk, however they are kept.
pub fn most_slots(tile_side: u32) -> u64 {
    MOST_PLAIN / (2 * CHANNELS as u64 * u64::from(tile_side).pow(2))
}

/// The finest step by which no number is too large, of elements of this peak.
pub fn finest_step(peak: f32) -> f32 {
    2.0 * peak / MOST as f32
}

/// Adds a tile's chunk of `scan` to functions as `[pixel, element]`.
pub fn add(
    functions: &mut [Pixel],
    order: &[u16],
    scan: &Scan,
    bytes: &[u8],
    plain: u32,
) -> Result<(), PartError> {
    let mut reader = Reader::new(bytes, plain as usize)?;
    if reader.tokens() < plain as usize {
        return Err(damaged("it has fewer tokens than it says"));
    }
    let slots = &order[usize::from(scan.first)..scan.end()];
    let mut numbers: Vec<i32> = zeros(slots.len() * CHANNELS)?;
    for function in functions.chunks_exact_mut(order.len()) {
        let end = reader.block(&mut numbers)?;
        let (elements, _) = numbers.as_chunks_mut::<CHANNELS>();
        let used = end.div_ceil(CHANNELS);
        for (element, &slot) in elements[..used].iter_mut().zip(slots) {
            let rgb = red_green_blue(*element);
            for (value, number) in function[usize::from(slot)].iter_mut().zip(rgb) {
                *value += number as f32 * scan.step;
            }
            *element = [0; CHANNELS];
        }
    }
    reader.finish()
}

/// Light transport functions as the numbers of their scans.
#[derive(Clone, Debug)]
pub struct Numbers {
    /// `[scan]`, then `[pixel, slot in order, channel]`.
    scans: Vec<Vec<i32>>,
    /// Squared elements.
    pub energy: f64,
    /// Squared errors that are left after each scan.
    pub errors: Vec<f64>,
    /// What is left at the end, `[pixel, slot in order]`.
    rest: Vec<Pixel>,
}

impl Numbers {
    /// Rounds functions as `[pixel, element]` as `scans` say.
    pub fn new(functions: &[Pixel], order: &[u16], scans: &[&Scan]) -> Self {
        let mut rest: Vec<Pixel> = Vec::with_capacity(functions.len());
        for function in functions.chunks_exact(order.len()) {
            let ordered = order.iter().map(|&slot| function[usize::from(slot)]);
            rest.extend(ordered.map(finite));
        }
        let square = |rest: &[Pixel]| {
            let all = rest.iter().flatten();
            all.map(|t| f64::from(*t).powi(2)).sum::<f64>()
        };
        let mut numbers = Self {
            scans: Vec::new(),
            energy: square(&rest),
            errors: Vec::new(),
            rest: Vec::new(),
        };
        for (s, scan) in scans.iter().enumerate() {
            let later = scans[s + 1..].iter().any(|later| later.first == scan.first);
            let rounding = if later { ROUNDING_AT_FIRST } else { ROUNDING };
            let mut own = Vec::new();
            for function in rest.chunks_exact_mut(order.len()) {
                for tau in &mut function[usize::from(scan.first)..scan.end()] {
                    let rgb = tau.map(|t| round(t, scan.step, rounding));
                    for (t, number) in tau.iter_mut().zip(rgb) {
                        *t -= number as f32 * scan.step;
                    }
                    own.extend(luma_chroma(rgb));
                }
            }
            numbers.scans.push(own);
            numbers.errors.push(square(&rest));
        }
        numbers.rest = rest;
        numbers
    }

    /// What a reader will have of the `functions` that these are of.
    pub fn decoded(&self, functions: &[Pixel], order: &[u16]) -> Vec<Pixel> {
        let mut decoded: Vec<Pixel> = functions.iter().copied().map(finite).collect();
        let of_pixels = decoded.chunks_exact_mut(order.len());
        for (function, rest) in of_pixels.zip(self.rest.chunks_exact(order.len())) {
            for (&slot, rest) in order.iter().zip(rest) {
                for (value, rest) in function[usize::from(slot)].iter_mut().zip(rest) {
                    *value -= rest;
                }
            }
        }
        decoded
    }

    /// Compresses the chunks, `None` where there is none.
    pub fn chunks(&self, scans: &[&Scan]) -> Result<Vec<Option<Chunk>>, FormatError> {
        let each = self.scans.iter().zip(scans);
        each.map(|(numbers, scan)| {
            if numbers.iter().all(|number| *number == 0) {
                return Ok(None);
            }
            let mut writer = Writer::default();
            for function in numbers.chunks_exact(usize::from(scan.count) * CHANNELS) {
                writer.block(function);
            }
            let (bytes, plain) = writer.finish()?;
            Ok(Some(Chunk { bytes, plain }))
        })
        .collect()
    }
}

/// What is no number counts for none.
fn finite(tau: Pixel) -> Pixel {
    tau.map(|t| if t.is_finite() { t } else { 0.0 })
}

fn round(x: f32, step: f32, rounding: f32) -> i32 {
    // Differences of colours are up to twice as large.
    let steps = (x.abs() / step + rounding) as i32; // `as` saturates
    steps.min(MOST / 2) * if x < 0.0 { -1 } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::scan::Coding;

    const EXTENT: Extent = Extent {
        width: 9,
        height: 4,
    };

    fn functions(area: usize) -> Vec<Pixel> {
        let tau = |i: usize| {
            let near = 1.0 / (1.0 + (i % area) as f32);
            [0.3, 0.9, -0.2].map(|c| c * near * near * (1.0 + (i as f32 * 0.7).sin()))
        };
        (0..EXTENT.area() * area).map(tau).collect()
    }

    #[test]
    fn slots_come_from_the_middle() {
        let window = Window::new(3).unwrap();
        assert_eq!(order(window), [4, 1, 3, 5, 7, 0, 2, 6, 8]);
    }

    #[test]
    fn functions_come_back_scan_by_scan() {
        let order = order(Window::new(5).unwrap());
        let functions = functions(25);
        for step in [1e-4, 1e-2] {
            let scans = [
                Scan::new(Coding::Direct, 0, 25, 8.0 * step),
                Scan::new(Coding::Direct, 0, 10, step),
                Scan::new(Coding::Direct, 10, 15, step),
            ];
            let scans: Vec<&Scan> = scans.iter().collect();
            let numbers = Numbers::new(&functions, &order, &scans);
            let mut got = vec![[0.0; CHANNELS]; functions.len()];
            let chunks = numbers.chunks(&scans).unwrap();
            for ((scan, chunk), error) in scans.iter().zip(chunks).zip(&numbers.errors) {
                if let Some(chunk) = chunk {
                    assert!(u64::from(chunk.plain) <= most_plain(EXTENT, scan.count));
                    assert!(chunk.bytes.len() as u64 <= bound(chunk.plain.into()));
                    add(&mut got, &order, scan, &chunk.bytes, chunk.plain).unwrap();
                    for cut in 0..chunk.bytes.len() {
                        let cut = &chunk.bytes[..cut];
                        assert!(add(&mut got.clone(), &order, scan, cut, chunk.plain).is_err());
                    }
                }
                let off = got.iter().zip(&functions);
                let off = off.flat_map(|(a, b)| (0..CHANNELS).map(move |c| f64::from(a[c] - b[c])));
                let left: f64 = off.map(|off| off * off).sum();
                assert!((left / error - 1.0).abs() < 0.01, "{left} {error}");
            }
        }
    }

    #[test]
    fn numbers_too_large_saturate() {
        let order = order(Window::new(1).unwrap());
        let scan = Scan::new(Coding::Direct, 0, 1, 1e-6);
        let functions = [[1.0, -1.0, f32::NAN]];
        let numbers = Numbers::new(&functions, &order, &[&scan]);
        let chunk = numbers.chunks(&[&scan]).unwrap().pop().unwrap().unwrap();
        let mut got = [[0.0; CHANNELS]];
        add(&mut got, &order, &scan, &chunk.bytes, chunk.plain).unwrap();
        let most = (MOST / 2) as f32 * 1e-6;
        assert_eq!(got, [[most, -most, 0.0]]);
    }
}
