//! The scan plan: which components and slots each scan brings, and at which step.
//!
//! A coarse first layer gives a picture under any light. The last layer has the step that the rate control
//! has found; it is cut into scans of consecutive components or slots. At one step all values have the same
//! slope of error against bytes, which makes the layers efficient. More layers would cost some per cent
//! of the file each. Two shares of the file bound the plan:
//!
//! - the index and the first layer: its step is the finest that fits, and it leaves out items that reduce
//!   the error by less than the same bytes do elsewhere;
//! - any later scan. An item that is larger by itself is refined in several scans.

use std::ops::Range;

use super::exp2;
use super::scan_costs::{RateDistortion, RateDistortionModel};
use super::source_analysis::AnalysedSource;
use crate::bisect::bisect;
use crate::format::codec::{direct_functions, transform};
use crate::format::constants::FIRST_BYTES;
use crate::format::error::FormatError;
use crate::format::scan::{ProgressiveScan, ScanCoding, rank_of};
use crate::job_executor::Executor;

/// The shares that a plan aims for. Predictions err: files keep [`MAX_SHARES`].
pub const SHARES: ByteShareLimits = ByteShareLimits {
    first: 0.08,
    scan: 0.18,
};
/// The shares of files that fit into a reader's first request, where many scans cost more than they give.
const SMALL_FILE_SHARES: ByteShareLimits = ByteShareLimits {
    first: 0.3,
    scan: f64::INFINITY,
};
/// The shares that files of usual metadata keep: a tenth and a quarter.
pub const MAX_SHARES: ByteShareLimits = ByteShareLimits {
    first: 0.1,
    scan: 0.25,
};
/// The step of component 0 in the first and in the last layer, relative to the others: under a flat light it
/// alone is the picture, and under most lights most of it.
const FIRST_FLAT_STEP_RATIO: f32 = 0.15;
const LAST_FLAT_STEP_RATIO: f32 = 0.25;
/// Ratio of the steps of two scans that refine the same item, but for the last scan of component 0, which has a finer step.
const PASS_STEP_RATIO: f32 = 4.0;
/// Ratio of the first step to the last, and the inverse share of items in the first layer, in a plan for measuring.
const TRIAL_FIRST_STEP_RATIO: f32 = 16.0;
const TRIAL_FIRST_ITEMS: usize = 5;
/// Largest ratio of the first step to the last, as a power of two, and trials of the search.
const MAX_FIRST_STEP_EXPONENT: f64 = 12.0;
const FIRST_STEP_TRIALS: usize = 6;

/// Ratio of steps of a scan for values that are only expected, not in the sample. It is nearly the largest whose rounding errors
/// do not overflow, so that the scan has nothing but such values.
const OUTLIER_STEP_RATIO: f32 = 8192.0;

/// Bytes of a basis function in a basis chunk, for each slot.
const BASIS_BYTES_PER_SLOT: f64 = 1.2;

/// The scans of a file.
pub struct ProgressiveScanPlan {
    pub scans: Vec<ProgressiveScan>,
    /// Number of scans of the first layer.
    pub first_scans: usize,
}

/// Bounds on the parts of a file, as shares of its bytes.
#[derive(Clone, Copy, Debug)]
pub struct ByteShareLimits {
    /// Of the index and the first layer.
    pub first: f64,
    /// Of any later scan.
    pub scan: f64,
}

/// Components, or slots.
#[derive(Clone, Debug)]
struct CodingItems {
    coding: ScanCoding,
    /// Maximum number in one scan.
    max_per_scan: usize,
    /// `[item]`: the finest step at which its numbers do not overflow.
    finest_steps: Vec<f32>,
    /// The least ratio of the step of a scan against overflow to that of the scan after it.
    overflow_step_ratio: f32,
}

impl CodingItems {
    /// Components and slots of a source, where there are some.
    fn of(analysed: &AnalysedSource<'_, impl Executor>) -> Vec<Self> {
        let side = analysed.geometry.tile_side;
        let overflow_step_ratio = match analysed.expected_peaks {
            Some(_) => OUTLIER_STEP_RATIO,
            None => 1.0,
        };
        let components = Self {
            coding: ScanCoding::Transform,
            max_per_scan: transform::max_components(side) as usize,
            finest_steps: (0..analysed.rank())
                .map(|k| analysed.finest_step(k))
                .collect(),
            overflow_step_ratio,
        };
        let slots = Self {
            coding: ScanCoding::Direct,
            max_per_scan: direct_functions::max_slots(side) as usize,
            finest_steps: vec![
                direct_functions::finest_step(analysed.function_peak);
                analysed.slots()
            ],
            overflow_step_ratio,
        };
        let mut kinds = Vec::from([components, slots]);
        kinds.retain(|items| items.count() > 0);
        kinds
    }

    fn count(&self) -> usize {
        self.finest_steps.len()
    }

    /// The finest step at which no number of `items` overflows.
    fn finest_step(&self, items: Range<usize>) -> f32 {
        self.finest_steps[items].iter().copied().fold(0.0, f32::max)
    }

    /// Codes the first `count` items at `step`, or at the finest step that does not overflow.
    fn first_layer(&self, count: usize, step: f32, scans: &mut Vec<ProgressiveScan>) {
        let flat_step = (step * FIRST_FLAT_STEP_RATIO).max(self.finest_step(0..1));
        let others = usize::from(!self.coding.is_direct())..self.count();
        let step = step.max(self.finest_step(others));
        self.layer(
            0,
            &vec![0.0; count],
            [flat_step, step],
            f64::INFINITY,
            scans,
        );
    }

    /// Codes all items, of the given bytes, at `step`, in scans of at most `max_bytes`. Items from `coded` on, which no
    /// scan has coded yet, get a coarser scan before if they would overflow.
    fn last_layer(
        &self,
        coded: usize,
        bytes: &[f64],
        step: f32,
        max_bytes: f64,
        scans: &mut Vec<ProgressiveScan>,
    ) {
        let finest = self.finest_step(coded..self.count());
        if finest > step {
            let coarse = finest.max(self.overflow_step_ratio * step);
            self.layer(coded, &bytes[coded..], [coarse; 2], f64::INFINITY, scans);
        }
        let steps = [step * LAST_FLAT_STEP_RATIO, step];
        self.layer(0, bytes, steps, max_bytes, scans);
    }

    /// Codes the items from `first` on, of the given bytes, at `step`, in scans of at most `max_bytes`.
    /// Component 0 has a scan and a step of its own.
    fn layer(
        &self,
        first: usize,
        bytes: &[f64],
        [flat_step, step]: [f32; 2],
        max_bytes: f64,
        scans: &mut Vec<ProgressiveScan>,
    ) {
        let is_flat = |item: usize| item == 0 && !self.coding.is_direct();
        let mut push = |first: usize, end: usize, step: f32| {
            let (first, count) = (first as u16, (end - first) as u16); // below 2^12
            scans.push(ProgressiveScan::new(self.coding, first, count, step));
        };
        let (mut start, mut scan_bytes) = (first, 0.0);
        for (item, item_bytes) in (first..).zip(bytes) {
            let is_full = scan_bytes + item_bytes > max_bytes || item - start == self.max_per_scan;
            if item > start && (is_full || is_flat(start)) {
                push(start, item, if is_flat(start) { flat_step } else { step });
                (start, scan_bytes) = (item, 0.0);
            }
            scan_bytes += item_bytes;
            // Coarser scans first, for an item that exceeds the bytes by itself.
            let passes = (item_bytes / max_bytes).ceil() as i32;
            for pass in (1..passes).rev() {
                push(item, item + 1, step * PASS_STEP_RATIO.powi(pass));
            }
        }
        let end = first + bytes.len();
        push(start, end, if is_flat(start) { flat_step } else { step });
    }
}

/// A plan without shares, by which the rate control measures a step.
pub fn trial(analysed: &AnalysedSource<'_, impl Executor>, step: f32) -> Vec<ProgressiveScan> {
    let mut scans = Vec::new();
    for items in CodingItems::of(analysed) {
        let count = items.count().div_ceil(TRIAL_FIRST_ITEMS);
        items.first_layer(count, TRIAL_FIRST_STEP_RATIO * step, &mut scans);
        let bytes = vec![0.0; items.count()];
        items.last_layer(count, &bytes, step, f64::INFINITY, &mut scans);
    }
    scans
}

/// The plan of a file whose last layer has `step`.
///
/// # Errors
/// [`FormatError::Compress`].
pub fn plan(
    analysed: &AnalysedSource<'_, impl Executor>,
    model: &RateDistortionModel,
    step: f32,
    shares: ByteShareLimits,
) -> Result<ProgressiveScanPlan, FormatError> {
    let executor = analysed.executor;
    let area = analysed.order.len() as f64;
    let kinds = CodingItems::of(analysed);
    let costs =
        |items: &CodingItems, step| model.costs(items.coding, items.count(), step, executor);
    let last: Vec<Vec<RateDistortion>> = kinds.iter().map(|items| costs(items, step)).collect();
    let basis_bytes = BASIS_BYTES_PER_SLOT * area;
    let file_bytes = basis_bytes * analysed.rank() as f64
        + last.iter().flatten().map(|cost| cost.bytes).sum::<f64>();
    // A reader fetches small files at once.
    let shares = match file_bytes <= FIRST_BYTES as f64 {
        true => SMALL_FILE_SHARES,
        false => shares,
    };
    let first_layer = |step: f32| {
        let mut scans = Vec::new();
        for items in &kinds {
            let mut costs = costs(items, step);
            let of_basis = f64::from(u8::from(!items.coding.is_direct())) * basis_bytes;
            costs.iter_mut().for_each(|cost| cost.bytes += of_basis);
            let count = worthwhile(&costs, step).max(1);
            items.first_layer(count, step, &mut scans);
        }
        scans
    };
    let exceeds = |exponent: f64| {
        let scans = first_layer(step * exp2(exponent) as f32);
        let compressed = |scan| model.compressed_bytes(scan, executor);
        let chunks = scans
            .iter()
            .map(compressed)
            .sum::<Result<f64, FormatError>>()?;
        let bytes = chunks + basis_bytes * rank_of(&scans) as f64;
        Ok::<_, FormatError>(bytes > shares.first * file_bytes)
    };
    let [_, exponent] = bisect([0.0, MAX_FIRST_STEP_EXPONENT], FIRST_STEP_TRIALS, exceeds)?;
    let mut scans = first_layer(step * exp2(exponent) as f32);
    let first_scans = scans.len();
    let max_bytes = shares.scan * file_bytes;
    for (items, last) in kinds.iter().zip(&last) {
        let of_kind = scans.iter().filter(|scan| scan.coding == items.coding);
        let coded = of_kind.map(ProgressiveScan::end).max().unwrap_or(0);
        let bytes: Vec<f64> = last.iter().map(|cost| cost.bytes).collect();
        items.last_layer(coded, &bytes, step, max_bytes, &mut scans);
    }
    Ok(ProgressiveScanPlan { scans, first_scans })
}

/// Number of first items up to the last whose gain is worth its bytes: at a step, a bit reduces the squared
/// error of a value by 2 ln 2 step² / 12.
fn worthwhile(costs: &[RateDistortion], step: f32) -> usize {
    let gain_per_byte = 8.0 * 2.0 * std::f64::consts::LN_2 * f64::from(step).powi(2) / 12.0;
    let is_worthwhile = |cost: &RateDistortion| {
        cost.energy - cost.error > gain_per_byte * cost.bytes && cost.bytes > 0.0
    };
    costs
        .iter()
        .rposition(is_worthwhile)
        .map_or(0, |last| last + 1)
}
