//! Coding 3: direct functions, slot by slot.
//!
//! Slots come in centre-out order, as functions peak near the window's centre: slots far away are mostly
//! zero, and zeros to the end of a run are one token. Red, green and blue of a slot are rounded to multiples
//! of the scan's step, so that sums over slots are kept (`sum_rounding`), then transformed to Y, Co, Cg. A chunk is
//! one token string with a run `[item, Y Co Cg]` for each pixel. Scans add up.

use std::ops::Range;

use super::colour::{ColourVector, finite, ycocg_forward};
use super::scan_functions::ScanFunctions;
use super::sum_rounding::{MAX_ROUNDED, RoundedSlot, restore_sums, sum_weight};
use super::tokens::{EncodableRuns, EntropyTokenReader, MAX_MAGNITUDE, QuantisedRun, TokenWriter};
use crate::format::chunk::EncodedChunk;
use crate::format::constants::MAX_CONTENT_BYTES;
use crate::format::error::{FormatError, SectionError, damaged};
use crate::format::memory_budget::{MemoryBudget, vec_bytes};
use crate::format::scan::ProgressiveScan;
use crate::transport::{CHANNELS, Extent, Window};

/// The centre-out order of a window's slots: by distance from its centre, then by slot.
///
/// # Errors
/// The errors of `budget`.
pub fn centre_out_order(window: Window, budget: &MemoryBudget) -> Result<Vec<u16>, FormatError> {
    let side = window.side() as i32;
    let distance = |slot: i32| (slot % side - side / 2).pow(2) + (slot / side - side / 2).pow(2);
    let scratch = budget.scratch();
    // A counting sort: the code of a general one would have to be downloaded.
    let mut next: Vec<u16> = budget.try_zeroed(distance(0) as usize + 2)?;
    for slot in 0..side * side {
        next[distance(slot) as usize + 1] += 1;
    }
    for d in 1..next.len() {
        next[d] += next[d - 1];
    }
    let mut order = budget.try_zeroed(window.area())?;
    for slot in 0..side * side {
        let at = &mut next[distance(slot) as usize];
        order[usize::from(*at)] = slot as u16;
        *at += 1;
    }
    scratch.keep(vec_bytes(&order));
    Ok(order)
}

/// Maximum tokens of a chunk: one for each number.
pub fn max_tokens(extent: Extent, count: u16) -> u64 {
    (extent.area() * CHANNELS) as u64 * u64::from(count)
}

/// Number of slots whose values fit into one chunk of any tile, in coding 3 and coding 4.
pub fn max_slots(tile_side: u32) -> u64 {
    MAX_CONTENT_BYTES / (2 * CHANNELS as u64 * u64::from(tile_side).pow(2))
}

/// The finest step that keeps the numbers of values up to `peak` within [`MAX_MAGNITUDE`].
pub fn finest_step(peak: f32) -> f32 {
    peak / MAX_ROUNDED as f32
}

/// Reads a tile's chunk of `scan`, which has `tokens` tokens, into `functions`.
///
/// # Errors
/// [`SectionError`] if the chunk is damaged, or the budget refuses memory.
pub fn read(
    functions: &mut ScanFunctions,
    pixels: usize,
    slots: &[u16],
    bytes: &[u8],
    tokens: u32,
    budget: &MemoryBudget,
) -> Result<(), SectionError> {
    let mut reader = EntropyTokenReader::new(bytes, tokens as usize, budget)?;
    if reader.tokens() < tokens as usize {
        return Err(damaged("it has fewer tokens than its entry says"));
    }
    let mut numbers: Vec<i32> = budget.try_zeroed(slots.len() * CHANNELS)?;
    for _ in 0..pixels {
        let end = reader.read_run(&mut numbers)?;
        let (items, _) = numbers.as_chunks_mut::<CHANNELS>();
        let used = end.div_ceil(CHANNELS);
        for (item, &slot) in items[..used].iter_mut().zip(slots) {
            functions.push(item.map(|number| number as i16), slot); // at most MAX_MAGNITUDE
            *item = [0; CHANNELS];
        }
        functions.end_pixel();
    }
    reader.finish()
}

/// The direct functions of a tile in centre-out order, before quantisation.
#[derive(Debug)]
pub struct CentreOutDirectFunctions {
    slots: usize,
    /// `[pixel, centre-out index]`.
    values: Vec<ColourVector>,
}

impl CentreOutDirectFunctions {
    /// Orders functions, `[pixel, slot]`.
    pub fn new(functions: &[ColourVector], order: &[u16]) -> Self {
        let pixels = functions.chunks_exact(order.len());
        let ordered = |function: &[ColourVector]| -> Vec<ColourVector> {
            let values = order.iter().map(|&slot| function[usize::from(slot)]);
            values.map(finite).collect()
        };
        Self {
            slots: order.len(),
            values: pixels.flat_map(ordered).collect(),
        }
    }
}

/// Rounds without keeping sums, which makes a first layer larger: the rate control compares the file with its plan.
impl EncodableRuns for CentreOutDirectFunctions {
    fn for_runs(&self, items: Range<usize>, step: f32, visit: &mut dyn FnMut(QuantisedRun<'_>)) {
        let (mut residuals, mut numbers) = (Vec::new(), Vec::new());
        for function in self.values.chunks_exact(self.slots) {
            residuals.clear();
            numbers.clear();
            let function = &function[items.clone()];
            for tau in function {
                let slot = RoundedSlot::new(*tau, step);
                residuals.extend(slot.residual.map(|r| r * step));
                numbers.extend(ycocg_forward(slot.numbers));
            }
            visit(QuantisedRun {
                string: 0,
                first_item: items.start,
                values_per_item: CHANNELS,
                values: function.as_flattened(),
                residuals: &residuals,
                numbers: &numbers,
            });
        }
    }
}

/// The direct functions of a tile, quantised scan by scan.
#[derive(Clone, Debug)]
pub struct QuantisedDirectFunctions {
    slots: usize,
    /// `[scan]`, then `[pixel, item, Y Co Cg]`; empty for scans of coefficients.
    numbers: Vec<Vec<i32>>,
    /// Sum of squared values, and of squared errors after each scan.
    pub errors: Vec<f64>,
    /// The error after the last scan, `[pixel, centre-out index]`.
    residual: Vec<ColourVector>,
}

impl QuantisedDirectFunctions {
    /// Quantises functions, `[pixel, slot]`, by `scans`.
    pub fn new(functions: &[ColourVector], order: &[u16], scans: &[ProgressiveScan]) -> Self {
        let mut residual = CentreOutDirectFunctions::new(functions, order).values;
        let mut numbers = vec![Vec::new(); scans.len()];
        let mut errors = vec![0.0; scans.len() + 1];
        let direct = scans.iter().rfind(|scan| scan.coding.is_direct());
        let last_step = direct.map_or(1.0, |scan| scan.step);
        for function in residual.chunks_exact_mut(order.len()) {
            errors[0] += square(function);
            let mut outputs = numbers.iter_mut().zip(&mut errors[1..]);
            // Scans of one step that follow each other without gaps are rounded together.
            let is_joined = |a: &ProgressiveScan, b: &ProgressiveScan| {
                (a.coding, a.step, a.end()) == (b.coding, b.step, b.items().start)
            };
            for layer in scans.chunk_by(is_joined) {
                let (first, step) = (layer[0].items().start, layer[0].step);
                let mut slots = Vec::new();
                if layer[0].coding.is_direct() {
                    let values = &function[first..layer[layer.len() - 1].end()];
                    slots.extend(values.iter().map(|tau| RoundedSlot::new(*tau, step)));
                    // Beyond that, another step could overflow.
                    if step < f32::MAX / MAX_MAGNITUDE as f32 {
                        restore_sums(&mut slots, sum_weight(step / last_step));
                    }
                }
                let mut slots = slots.into_iter();
                for (scan, (numbers, error)) in layer.iter().zip(&mut outputs) {
                    for (k, slot) in scan.items().zip(slots.by_ref()) {
                        for (t, number) in function[k].iter_mut().zip(slot.numbers) {
                            *t -= number as f32 * step;
                        }
                        numbers.extend(ycocg_forward(slot.numbers));
                    }
                    *error += square(function);
                }
            }
        }
        Self {
            slots: order.len(),
            numbers,
            errors,
            residual,
        }
    }

    /// The functions as a reader decodes them, of the `functions` that were quantised.
    pub fn decoded(&self, functions: &[ColourVector], order: &[u16]) -> Vec<ColourVector> {
        let mut decoded: Vec<ColourVector> = functions.iter().copied().map(finite).collect();
        let of_pixels = decoded.chunks_exact_mut(self.slots);
        for (function, residual) in of_pixels.zip(self.residual.chunks_exact(self.slots)) {
            for (&slot, residual) in order.iter().zip(residual) {
                for (value, residual) in function[usize::from(slot)].iter_mut().zip(residual) {
                    *value -= residual;
                }
            }
        }
        decoded
    }

    /// Whether a value is larger than the numbers of its last scan reach.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn is_clipped(&self, scans: &[ProgressiveScan]) -> bool {
        let mut steps = vec![f32::INFINITY; self.slots];
        for scan in scans.iter().filter(|scan| scan.coding.is_direct()) {
            steps[scan.items()].fill(scan.step);
        }
        // Rounding leaves less than a step, and a number whose sum is restored differs by one.
        let is_large =
            |(error, step): (&ColourVector, &f32)| error.iter().any(|e| e.abs() > 2.0 * step);
        let mut of_pixels = self.residual.chunks_exact(self.slots);
        of_pixels.any(|errors| errors.iter().zip(&steps).any(is_large))
    }

    /// The chunks of all scans.
    ///
    /// # Errors
    /// [`FormatError::Compress`].
    pub fn chunks(&self, scans: &[ProgressiveScan]) -> Result<Vec<EncodedChunk>, FormatError> {
        let chunks = self.numbers.iter().zip(scans).map(|(numbers, scan)| {
            if numbers.iter().all(|number| *number == 0) {
                return Ok(EncodedChunk::default());
            }
            let mut writer = TokenWriter::default();
            for function in numbers.chunks_exact(scan.items().len() * CHANNELS) {
                writer.write_run(function);
            }
            writer.finish()
        });
        chunks.collect()
    }
}

/// The sum of squares.
fn square(values: &[ColourVector]) -> f64 {
    let all = values.as_flattened().iter();
    all.map(|t| f64::from(*t).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::super::tokens;
    use super::*;
    use crate::format::scan::ScanCoding;
    use crate::transport::{entries_by_pixel, entry_slot};

    const EXTENT: Extent = Extent::new(9, 4);

    fn order(side: u32) -> Vec<u16> {
        centre_out_order(Window::new(side).unwrap(), &MemoryBudget::unlimited()).unwrap()
    }

    fn functions(area: usize) -> Vec<ColourVector> {
        let tau = |i: usize| {
            let near = 1.0 / (1.0 + (i % area) as f32);
            [0.3, 0.9, -0.2].map(|c| c * near * near * (1.0 + (i as f32 * 0.7).sin()))
        };
        (0..EXTENT.area() * area).map(tau).collect()
    }

    /// Decodes the chunk of a tile of so many pixels.
    fn decode(
        pixels: usize,
        order: &[u16],
        scan: &ProgressiveScan,
        bytes: &[u8],
        tokens: u32,
    ) -> Result<ScanFunctions, SectionError> {
        let budget = MemoryBudget::unlimited();
        let mut functions = ScanFunctions::try_new(scan, pixels, tokens, &budget)?;
        let slots = &order[scan.items()];
        read(&mut functions, pixels, slots, bytes, tokens, &budget)?;
        Ok(functions)
    }

    fn add(functions: &mut [ColourVector], area: usize, scan: &ScanFunctions) {
        let pixels = functions.chunks_exact_mut(area);
        for (function, entries) in pixels.zip(entries_by_pixel(&scan.entries)) {
            for entry in entries {
                let sum = &mut function[entry_slot(entry)];
                let value = scan.value(entry);
                (0..CHANNELS).for_each(|c| sum[c] += value[c]);
            }
        }
    }

    #[test]
    fn slots_are_ordered_from_the_centre() {
        assert_eq!(order(3), [4, 1, 3, 5, 7, 0, 2, 6, 8]);
    }

    #[test]
    fn decoded_functions_have_the_error_of_their_scans() {
        let order = order(5);
        let functions = functions(25);
        for step in [1e-4, 1e-2] {
            let scans = [
                ProgressiveScan::new(ScanCoding::Direct, 0, 25, 8.0 * step),
                ProgressiveScan::new(ScanCoding::Direct, 0, 10, step),
                ProgressiveScan::new(ScanCoding::Direct, 10, 15, step),
            ];
            let quantised = QuantisedDirectFunctions::new(&functions, &order, &scans);
            let mut got = vec![[0.0; CHANNELS]; functions.len()];
            let chunks = quantised.chunks(&scans).unwrap();
            for ((scan, chunk), error) in scans.iter().zip(chunks).zip(&quantised.errors[1..]) {
                if !chunk.bytes.is_empty() {
                    let decode = |bytes: &[u8]| {
                        decode(EXTENT.area(), &order, scan, bytes, chunk.content_bytes)
                    };
                    assert!(u64::from(chunk.content_bytes) <= max_tokens(EXTENT, scan.count));
                    let max_bytes = tokens::max_bytes(chunk.content_bytes.into());
                    assert!(chunk.bytes.len() as u64 <= max_bytes);
                    add(&mut got, 25, &decode(&chunk.bytes).unwrap());
                    for cut in 0..chunk.bytes.len() {
                        assert!(decode(&chunk.bytes[..cut]).is_err());
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
    fn a_layer_keeps_sums_however_it_is_cut_into_scans() {
        let order = order(5);
        let functions = functions(25);
        let step = 0.03;
        let quantised = |cuts: &[u16]| {
            let mut scans = vec![ProgressiveScan::new(ScanCoding::Direct, 0, 10, 8.0 * step)];
            let ranges = cuts.windows(2).map(|cut| (cut[0], cut[1] - cut[0]));
            let layer = ranges
                .map(|(first, count)| ProgressiveScan::new(ScanCoding::Direct, first, count, step));
            scans.extend(layer);
            QuantisedDirectFunctions::new(&functions, &order, &scans).residual
        };
        let restored = quantised(&[0, 25]);
        assert_eq!(restored, quantised(&[0, 3, 12, 25]));
        // Both layers without restoring sums.
        let mut rounded = CentreOutDirectFunctions::new(&functions, &order).values;
        for function in rounded.chunks_exact_mut(25) {
            for (count, step) in [(10, 8.0 * step), (25, step)] {
                for tau in &mut function[..count] {
                    *tau = RoundedSlot::new(*tau, step).residual.map(|r| r * step);
                }
            }
        }
        let sums = |residual: &[ColourVector]| -> f32 {
            let sum = |function: &[ColourVector]| function.iter().map(|tau| tau[1]).sum::<f32>();
            residual.chunks_exact(25).map(|f| sum(f).abs()).sum()
        };
        let (restored, rounded) = (sums(&restored), sums(&rounded));
        assert!(restored < 0.8 * rounded, "{restored} {rounded}");
    }

    #[test]
    fn scans_of_one_step_may_bring_a_slot_again() {
        let order = order(5);
        let functions = functions(25);
        let scan =
            |first, count, step| ProgressiveScan::new(ScanCoding::Direct, first, count, step);
        let scans = [scan(0, 10, 0.1), scan(0, 1, 0.1), scan(0, 25, 0.01)];
        let quantised = QuantisedDirectFunctions::new(&functions, &order, &scans);
        let mut got = vec![[0.0; CHANNELS]; functions.len()];
        for (scan, chunk) in scans.iter().zip(quantised.chunks(&scans).unwrap()) {
            if !chunk.bytes.is_empty() {
                let (bytes, tokens) = (&chunk.bytes, chunk.content_bytes);
                let decoded = decode(EXTENT.area(), &order, scan, bytes, tokens).unwrap();
                add(&mut got, 25, &decoded);
            }
        }
        let want = quantised.decoded(&functions, &order);
        for (got, want) in got.as_flattened().iter().zip(want.as_flattened()) {
            assert!((got - want).abs() < 1e-5, "{got} {want}");
        }
    }

    #[test]
    fn numbers_saturate() {
        let order = order(1);
        let scan = ProgressiveScan::new(ScanCoding::Direct, 0, 1, 1e-6);
        let functions = [[1.0, -1.0, f32::NAN]];
        let quantised = QuantisedDirectFunctions::new(&functions, &order, &[scan]);
        let chunk = quantised.chunks(&[scan]).unwrap().remove(0);
        let mut got = [[0.0; CHANNELS]];
        let decoded = decode(1, &order, &scan, &chunk.bytes, chunk.content_bytes).unwrap();
        add(&mut got, 1, &decoded);
        let max = (MAX_MAGNITUDE / 2) as f32 * 1e-6;
        assert_eq!(got, [[max, -max, 0.0]]);
    }
}
