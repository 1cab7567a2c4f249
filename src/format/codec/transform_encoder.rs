//! The encoder of coding 1: coefficients to quantised numbers and chunks.
//!
//! Scans are quantised one after another, each the residual of those before it.

use std::array::from_fn;
use std::ops::Range;

use super::colour::{ColourKlt, ColourVector, HouseholderReflection, finite};
use super::dct::{self, AREA, DctBlock, SIDE, ZIGZAG};
use super::tokens::{EncodableRuns, MAX_MAGNITUDE, QuantisedRun, TokenWriter};
use super::transform::{
    CoefficientPlane, CoefficientPlanes, add_block, block_corners, block_count, dequantise,
    try_axis,
};
use crate::format::chunk::EncodedChunk;
use crate::format::error::FormatError;
use crate::format::memory_budget::MemoryBudget;
use crate::format::scan::ProgressiveScan;
use crate::transport::{CHANNELS, Extent};

/// Added to a magnitude in steps before it is truncated, by the sum of the magnitudes of the numbers before
/// and after it, each counted as 2 at most. Less than a half: small values are mostly noise, whose bits
/// reduce the error less than those of large ones; isolated ones cost most.
const ROUNDING_OFFSETS: [f32; 5] = [0.0, 0.2, 0.3, 0.3, 0.3];
/// The same for a first estimate of the neighbours.
const ISOLATED_ROUNDING_OFFSET: f32 = 0.2;
/// The same where a later scan refines the value.
const COARSE_ROUNDING_OFFSET: f32 = 0.3;

/// Numbers of a run of the side string: axes 1 and 2 of a block, interleaved.
const SIDE_RUN: usize = 2 * AREA;

/// The cosine transform of a tile's coefficients, `[component, axis, block, zigzag index]`, before quantisation.
#[derive(Debug)]
pub struct TransformedTile {
    blocks: usize,
    values: Vec<f32>,
}

impl TransformedTile {
    /// Transforms the first `rank` of coefficients, `[pixel, component]`. Reflections are those of their exact colours.
    pub fn new(extent: Extent, coefficients: &[ColourVector], rank: usize) -> Self {
        let pixels = extent.area();
        let components = coefficients.len() / pixels;
        let of = |p: usize, k: usize| finite(coefficients[p * components + k]);
        let klt = ColourKlt::of_pixels((0..pixels).map(|p| of(p, 0)));
        let mut values = Vec::with_capacity(rank * CHANNELS * block_count(extent) * AREA);
        for k in 0..rank {
            let on_axes = |p: usize| match k {
                0 => klt.forward(of(p, 0)),
                _ => HouseholderReflection::of_colour(of(p, 0)).apply(of(p, k)),
            };
            let component: Vec<ColourVector> = (0..pixels).map(on_axes).collect();
            for axis in 0..CHANNELS {
                for corner in block_corners(extent) {
                    values.extend(transformed(&component, extent, corner, axis));
                }
            }
        }
        Self {
            blocks: block_count(extent),
            values,
        }
    }
}

impl EncodableRuns for TransformedTile {
    fn for_runs(&self, items: Range<usize>, step: f32, visit: &mut dyn FnMut(QuantisedRun<'_>)) {
        let axis = self.blocks * AREA;
        let components = self.values.chunks_exact(CHANNELS * axis).enumerate();
        for (k, component) in components.take(items.end).skip(items.start) {
            for b in (0..axis).step_by(AREA) {
                let values = |a: usize| &component[a * axis + b..][..AREA];
                let numbers: [_; CHANNELS] = from_fn(|a| {
                    let mut numbers = [0; AREA];
                    round_by_neighbours(values(a), step, &mut numbers);
                    numbers
                });
                let residual = |a: usize, i: usize| values(a)[i] - numbers[a][i] as f32 * step;
                visit(QuantisedRun {
                    string: 0,
                    first_item: k,
                    values_per_item: AREA,
                    values: values(0),
                    residuals: &from_fn::<_, AREA, _>(|i| residual(0, i)),
                    numbers: &numbers[0],
                });
                visit(QuantisedRun {
                    string: 1,
                    first_item: k,
                    values_per_item: SIDE_RUN,
                    values: &from_fn::<_, SIDE_RUN, _>(|i| values(1 + i % 2)[i / 2]),
                    residuals: &from_fn::<_, SIDE_RUN, _>(|i| residual(1 + i % 2, i / 2)),
                    numbers: &from_fn::<_, SIDE_RUN, _>(|i| numbers[1 + i % 2][i / 2]),
                });
            }
        }
    }
}

/// The coefficients of a tile, quantised scan by scan.
#[derive(Clone, Debug)]
pub struct QuantisedCoefficients {
    klt: ColourKlt,
    blocks: usize,
    /// `[scan]`, then `[component, axis, block, zigzag index]`; empty for scans of direct functions.
    numbers: Vec<Vec<i32>>,
    /// Sum of squared coefficients, and of squared errors after each scan, without the error of the KLT.
    pub errors: Vec<f64>,
    /// Squared error of component 0 from the rounding of the KLT, which no step reduces.
    pub klt_error: f64,
    /// The planes as a reader decodes them: component 0, and the others if they were kept.
    planes: CoefficientPlanes,
}

impl QuantisedCoefficients {
    /// Transforms and quantises the first `rank` of coefficients, `[pixel, component]`, by `scans`, which cover all
    /// of these; `keep_decoded` says whether [`decoded`](Self::decoded) will be called.
    pub fn new(
        extent: Extent,
        coefficients: &[ColourVector],
        rank: usize,
        scans: &[ProgressiveScan],
        keep_decoded: bool,
    ) -> Self {
        let (pixels, blocks) = (extent.area(), block_count(extent));
        let components = coefficients.len() / pixels;
        let of = |p: usize, k: usize| finite(coefficients[p * components + k]);
        let zeros = |scan: &ProgressiveScan| match scan.coding.is_direct() {
            true => Vec::new(),
            false => vec![0; scan.items().len() * CHANNELS * blocks * AREA],
        };
        let mut quantised = Self {
            klt: ColourKlt::of_pixels((0..pixels).map(|p| of(p, 0))),
            blocks,
            numbers: scans.iter().map(zeros).collect(),
            errors: vec![0.0; 1 + scans.len()],
            klt_error: 0.0,
            planes: CoefficientPlanes::default(),
        };
        let mut planes = CoefficientPlanes {
            klt: Some(quantised.klt),
            components: vec![Vec::new()],
            max_components: None,
        };
        let on_axes = |p: usize| quantised.klt.forward(of(p, 0));
        let mut component: Vec<ColourVector> = (0..pixels).map(on_axes).collect();
        let square = |(p, on_axes): (usize, &ColourVector)| -> f64 {
            let (got, want) = (quantised.klt.inverse(*on_axes), of(p, 0));
            let square = |c: usize| f64::from(got[c] - want[c]).powi(2);
            (0..CHANNELS).map(square).sum()
        };
        quantised.klt_error = component.iter().enumerate().map(square).sum();
        let first = Some(&mut planes.components[0]);
        quantised.quantise_component(0, &component, extent, scans, first);
        // The colours that a reader knows after the last scan.
        let colours = planes.coefficients(extent, 1, &MemoryBudget::unlimited());
        let colours = colours.unwrap_or_else(|_| vec![[0.0; CHANNELS]; pixels]);
        let reflections = colours.into_iter().map(HouseholderReflection::of_colour);
        let reflections: Vec<_> = reflections.collect();
        for k in 1..rank {
            for (p, pixel) in component.iter_mut().enumerate() {
                *pixel = reflections[p].apply(of(p, k));
            }
            let mut plane = CoefficientPlane::new();
            let kept = keep_decoded.then_some(&mut plane);
            quantised.quantise_component(k, &component, extent, scans, kept);
            planes.components.push(plane);
        }
        quantised.planes = planes;
        quantised
    }

    /// The coefficients as a reader decodes them, `[pixel, component]`, if they were kept.
    ///
    /// # Errors
    /// [`FormatError::Memory`].
    pub fn decoded(&self, extent: Extent) -> Result<Vec<ColourVector>, FormatError> {
        let rank = self.planes.components.len();
        self.planes
            .coefficients(extent, rank, &MemoryBudget::unlimited())
    }

    /// Whether a coefficient has the largest number of its last scan, which does not reach larger ones.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn is_clipped(&self, scans: &[ProgressiveScan]) -> bool {
        let values = CHANNELS * self.blocks * AREA;
        (0..self.planes.components.len()).any(|k| {
            last_scan(scans, k).is_some_and(|s| {
                let at = (k - usize::from(scans[s].first)) * values;
                let mut numbers = self.numbers[s][at..at + values].iter();
                numbers.any(|number| number.abs() == MAX_MAGNITUDE)
            })
        })
    }

    /// Quantises component `k`, and adds its decoded values to `decoded`.
    fn quantise_component(
        &mut self,
        k: usize,
        pixels: &[ColourVector],
        extent: Extent,
        scans: &[ProgressiveScan],
        mut decoded: Option<&mut CoefficientPlane>,
    ) {
        let last = last_scan(scans, k);
        for a in 0..CHANNELS {
            for (b, (left, top)) in block_corners(extent).enumerate() {
                let mut residual = transformed(pixels, extent, (left, top), a);
                let inside = (
                    SIDE.min(extent.width as usize - left),
                    SIDE.min(extent.height as usize - top),
                );
                let mut error = squared_pixels(&residual, inside);
                self.errors[0] += error;
                for (s, scan) in scans.iter().enumerate() {
                    if covers(scan, k) {
                        let at = (k - usize::from(scan.first)) * CHANNELS + a;
                        let at = (at * self.blocks + b) * AREA;
                        let numbers = &mut self.numbers[s][at..at + AREA];
                        match Some(s) == last {
                            true => round_by_neighbours(&residual, scan.step, numbers),
                            false => {
                                round(&residual, scan.step, |_| COARSE_ROUNDING_OFFSET, numbers);
                            }
                        }
                        for (number, residual) in numbers.iter().zip(&mut residual) {
                            *residual -= *number as f32 * scan.step;
                        }
                        error = squared_pixels(&residual, inside);
                        if let Some(plane) = &mut decoded
                            && numbers.iter().any(|number| *number != 0)
                            && let Ok(axis) = try_axis(plane, extent, a, &MemoryBudget::unlimited())
                        {
                            add_block(axis, extent, (left, top), &dequantise(numbers, scan.step));
                        }
                    }
                    self.errors[s + 1] += error;
                }
            }
        }
    }

    /// The chunks of all scans.
    ///
    /// # Errors
    /// [`FormatError::Compress`].
    pub fn chunks(&self, scans: &[ProgressiveScan]) -> Result<Vec<EncodedChunk>, FormatError> {
        let mut klt = Some(self.klt);
        let chunks = scans.iter().zip(&self.numbers).map(|(scan, numbers)| {
            if numbers.iter().all(|number| *number == 0) {
                return Ok(EncodedChunk::default());
            }
            let klt = klt.take_if(|_| scan.first == 0);
            let bytes = klt.map_or(Vec::new(), |klt| klt.to_bytes().to_vec());
            self.chunk(numbers, bytes)
        });
        chunks.collect()
    }

    /// Appends the token strings of a scan's numbers to `bytes`.
    fn chunk(&self, numbers: &[i32], mut bytes: Vec<u8>) -> Result<EncodedChunk, FormatError> {
        let axis = self.blocks * AREA;
        let mut writer = TokenWriter::default();
        for component in numbers.chunks_exact(CHANNELS * axis) {
            for block in component[..axis].chunks_exact(AREA) {
                writer.write_run(block);
            }
        }
        let main = writer.finish()?;
        let mut writer = TokenWriter::default();
        for component in numbers.chunks_exact(CHANNELS * axis) {
            for b in (axis..2 * axis).step_by(AREA) {
                let number = |i: usize| component[b + i % 2 * axis + i / 2];
                writer.write_run(&from_fn::<_, SIDE_RUN, _>(number));
            }
        }
        let side = writer.finish()?;
        bytes.extend((main.bytes.len() as u32).to_le_bytes()); // a chunk is below 2^25 bytes
        bytes.extend([main.bytes, side.bytes].concat());
        Ok(EncodedChunk {
            bytes,
            content_bytes: main.content_bytes + side.content_bytes,
        })
    }
}

/// Whether a scan has component `k`.
fn covers(scan: &ProgressiveScan, k: usize) -> bool {
    !scan.coding.is_direct() && scan.items().contains(&k)
}

/// The last scan that has component `k`.
fn last_scan(scans: &[ProgressiveScan], k: usize) -> Option<usize> {
    scans.iter().rposition(|scan| covers(scan, k))
}

/// A block's coefficients in zigzag order.
fn transformed(
    pixels: &[ColourVector],
    extent: Extent,
    (left, top): (usize, usize),
    axis: usize,
) -> DctBlock {
    let (width, height) = (extent.width as usize, extent.height as usize);
    // Beyond its edges the tile repeats its last column and row.
    let block: DctBlock = from_fn(|i| {
        let x = (left + i % SIDE).min(width - 1);
        let y = (top + i / SIDE).min(height - 1);
        pixels[y * width + x][axis]
    });
    let coefficients = dct::forward(&block);
    ZIGZAG.map(|i| coefficients[usize::from(i)])
}

/// Rounds a block with an offset that depends on each number's neighbours.
fn round_by_neighbours(block: &[f32], step: f32, numbers: &mut [i32]) {
    round(block, step, |_| ISOLATED_ROUNDING_OFFSET, numbers);
    let mut estimates = [0; AREA + 2];
    for (estimate, number) in estimates[1..].iter_mut().zip(numbers.iter()) {
        *estimate = number.unsigned_abs().min(2);
    }
    let neighbours = |i: usize| (estimates[i] + estimates[i + 2]) as usize;
    round(block, step, |i| ROUNDING_OFFSETS[neighbours(i)], numbers);
}

fn round(block: &[f32], step: f32, offset: impl Fn(usize) -> f32, numbers: &mut [i32]) {
    for (i, (number, x)) in numbers.iter_mut().zip(block).enumerate() {
        let steps = (x.abs() / step + offset(i)) as i32; // `as` saturates
        *number = steps.min(MAX_MAGNITUDE) * if *x < 0.0 { -1 } else { 1 };
    }
}

/// Sum of squared pixels of a block in zigzag order, over the columns and rows inside the tile.
fn squared_pixels(zigzag: &DctBlock, (columns, rows): (usize, usize)) -> f64 {
    let square = |v: f32| f64::from(v).powi(2);
    if (columns, rows) == (SIDE, SIDE) {
        // Independent sums fill vector registers.
        let mut sums = [0.0; SIDE];
        for values in zigzag.as_chunks::<SIDE>().0 {
            for (sum, v) in sums.iter_mut().zip(values) {
                *sum += square(*v);
            }
        }
        return sums.iter().sum();
    }
    let mut block = [0.0; AREA];
    for (value, i) in zigzag.iter().zip(ZIGZAG) {
        block[usize::from(i)] = *value;
    }
    let pixels = dct::inverse(&block);
    let lines = pixels.chunks_exact(SIDE).take(rows);
    let inside = lines.flat_map(|line| &line[..columns]);
    inside.map(|v| square(*v)).sum()
}

#[cfg(test)]
mod tests {
    use super::super::transform::{max_bytes, max_tokens};
    use super::*;
    use crate::format::scan::ScanCoding;
    use crate::transport::TileRect;

    /// Coefficients that fall off from one component to the next, smooth in space, of a few colours.
    fn tile(extent: Extent, rank: usize) -> Vec<ColourVector> {
        let rect = TileRect { x: 0, y: 0, extent };
        let mut coefficients = Vec::new();
        for pixel in rect.pixels() {
            let (x, y) = (pixel.x as f32, pixel.y as f32);
            let colour = match x > y {
                true => [1.0, 0.3, 0.1],
                false => [0.2, 0.5, 0.9],
            };
            for k in 0..rank {
                let wave = (0.2 * x + 0.31 * k as f32).sin() * (0.17 * y - k as f32).cos();
                let size = if k == 0 { 2.0 + wave } else { wave / k as f32 };
                coefficients.push(colour.map(|c| c * size));
            }
        }
        coefficients
    }

    fn scan(first: u16, count: u16, step: f32) -> ProgressiveScan {
        ProgressiveScan::new(ScanCoding::Transform, first, count, step)
    }

    fn decoded(planes: &CoefficientPlanes, extent: Extent, rank: usize) -> Vec<ColourVector> {
        planes
            .coefficients(extent, rank, &MemoryBudget::unlimited())
            .unwrap()
    }

    fn squared_error(
        planes: &CoefficientPlanes,
        extent: Extent,
        tile: &[ColourVector],
        rank: usize,
    ) -> f64 {
        let decoded = decoded(planes, extent, rank);
        let pairs = decoded.iter().zip(tile);
        let errors = pairs.flat_map(|(a, b)| (0..CHANNELS).map(move |c| f64::from(a[c] - b[c])));
        errors.map(|error| error * error).sum()
    }

    #[test]
    fn a_decoded_tile_has_the_error_of_its_scans() {
        for (width, height) in [(32, 32), (29, 9), (1, 1), (8, 16)] {
            let rank = 6;
            let extent = Extent { width, height };
            let tile = tile(extent, rank);
            for step in [1e-4, 1e-2, 0.1] {
                let scans = [
                    scan(0, 2, 8.0 * step),
                    scan(0, 1, step / 3.0),
                    scan(1, 1, step),
                    scan(2, 4, step),
                ];
                let quantised = QuantisedCoefficients::new(extent, &tile, rank, &scans, true);
                let mut planes = CoefficientPlanes::default();
                let chunks = quantised.chunks(&scans).unwrap();
                for ((scan, chunk), error) in scans.iter().zip(chunks).zip(&quantised.errors[1..]) {
                    if !chunk.bytes.is_empty() {
                        let tokens = chunk.content_bytes;
                        assert!(u64::from(tokens) <= max_tokens(extent, scan.count));
                        assert!(chunk.bytes.len() as u64 <= max_bytes(tokens.into()));
                        let budget = MemoryBudget::unlimited();
                        planes
                            .add(extent, scan, &chunk.bytes, tokens, &budget)
                            .unwrap();
                    }
                    // Reflections by a coarse component 0, and errors that cancel, differ a little.
                    let got = squared_error(&planes, extent, &tile, rank);
                    let claimed = error + quantised.klt_error;
                    assert!(
                        (got - claimed).abs() <= 0.03 * claimed + 1e-6,
                        "{got} {claimed}"
                    );
                }
                assert_eq!(
                    decoded(&planes, extent, rank),
                    quantised.decoded(extent).unwrap()
                );
            }
        }
    }

    #[cfg(not(target_arch = "wasm32"))]
    #[test]
    fn values_beyond_the_numbers_of_their_last_scan_are_told() {
        let extent = Extent::new(16, 9);
        let mut tile = tile(extent, 3);
        let scans = [scan(0, 3, 1e-2), scan(0, 1, 1e-3), scan(1, 1, 1e-2)];
        let is_clipped = |tile: &[ColourVector]| {
            QuantisedCoefficients::new(extent, tile, 3, &scans, false).is_clipped(&scans)
        };
        assert!(!is_clipped(&tile));
        // The first scan does not reach so far, but the second has the rest.
        tile[0] = [350.0; CHANNELS];
        tile[3] = [-350.0; CHANNELS];
        assert!(!is_clipped(&tile));
        for (k, value) in [(0, 3e4), (1, 6e3), (2, -6e3)] {
            let mut tile = tile.clone();
            tile[3 * 20 + k] = [value; CHANNELS];
            assert!(is_clipped(&tile), "{k}");
        }
    }

    #[test]
    fn components_beyond_the_rank_are_left_out() {
        let extent = Extent::new(11, 9);
        let tile = tile(extent, 4);
        let first: Vec<ColourVector> = tile
            .chunks_exact(4)
            .flat_map(|pixel| &pixel[..2])
            .copied()
            .collect();
        let scans = [scan(0, 2, 1e-2)];
        let bytes = |coefficients: &[ColourVector]| {
            let quantised = QuantisedCoefficients::new(extent, coefficients, 2, &scans, false);
            quantised.chunks(&scans).unwrap().remove(0).bytes
        };
        assert_eq!(bytes(&tile), bytes(&first));
        let values = |coefficients| TransformedTile::new(extent, coefficients, 2).values;
        assert_eq!(values(&tile), values(&first));
    }

    #[test]
    fn dark_tiles_have_no_chunks_and_cut_chunks_are_errors() {
        let extent = Extent {
            width: 16,
            height: 16,
        };
        let tile = tile(extent, 3);
        let dark = vec![[0.0; CHANNELS]; tile.len()];
        let scan = scan(0, 3, 1e-2);
        let chunk = |tile| {
            let quantised = QuantisedCoefficients::new(extent, tile, 3, &[scan], false);
            quantised.chunks(&[scan]).unwrap().remove(0)
        };
        assert!(chunk(&dark).bytes.is_empty());
        let chunk = chunk(&tile);
        let decode = |bytes: &[u8], tokens: u32| {
            CoefficientPlanes::default().add(
                extent,
                &scan,
                bytes,
                tokens,
                &MemoryBudget::unlimited(),
            )
        };
        let tokens = chunk.content_bytes;
        decode(&chunk.bytes, tokens).unwrap();
        for length in 0..chunk.bytes.len() {
            assert!(decode(&chunk.bytes[..length], tokens).is_err());
        }
        assert!(decode(&[&chunk.bytes[..], &[0]].concat(), tokens).is_err());
        assert!(decode(&chunk.bytes, tokens + 1).is_err());
    }
}
