//! What a scan costs and gains, predicted from a sample without compression.
//!
//! Bytes are the entropy of the tokens in their three contexts, plus sign and mantissa bits. Both bytes and
//! squared errors are told apart by item: by component, or by slot in centre-out order.

use super::rate_control_sample::SampledTilePart;
use super::source_analysis::{AnalysedSource, non_empty};
use crate::format::codec::direct_functions::CentreOutDirectFunctions;
use crate::format::codec::tokens::{CONTEXTS, EncodableRuns, compressed_bytes, for_tokens};
use crate::format::codec::transform_encoder::TransformedTile;
use crate::format::error::FormatError;
use crate::format::scan::{ProgressiveScan, ScanCoding};
use crate::job_executor::Executor;

/// Bytes and squared error of one item at one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RateDistortion {
    pub bytes: f64,
    /// Squared error if the item is left out.
    pub energy: f64,
    /// Squared error if the item is coded.
    pub error: f64,
}

/// The sample's values as the codecs quantise them.
pub struct RateDistortionModel {
    parts: Vec<TransformedTilePart>,
    /// Number of parts that are compressed together.
    parts_per_chunk: usize,
}

struct TransformedTilePart {
    weight: f64,
    coefficients: Option<TransformedTile>,
    functions: Option<CentreOutDirectFunctions>,
}

/// One token of an item.
struct EntropyToken {
    item: u16,
    context: u8,
    token: u8,
}

impl RateDistortionModel {
    /// Of parts that are as large as tiles, or nearly.
    pub fn new(analysed: &AnalysedSource<'_, impl Executor>, sample: &[SampledTilePart]) -> Self {
        let parts = analysed.executor.map(sample.len(), |i| {
            let SampledTilePart { tile, weight } = &sample[i];
            let (extent, functions) = (tile.rect.extent, non_empty(&tile.functions));
            let coefficients = non_empty(&tile.coefficients);
            TransformedTilePart {
                weight: *weight,
                coefficients: coefficients
                    .map(|c| TransformedTile::new(extent, c, analysed.rank())),
                functions: functions.map(|tau| CentreOutDirectFunctions::new(tau, &analysed.order)),
            }
        });
        Self {
            parts,
            parts_per_chunk: 1,
        }
    }

    /// Of parts that are much smaller than tiles, and equally heavy. As many as fill a tile are compressed together, as their
    /// values would be.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn of_squares(
        analysed: &AnalysedSource<'_, impl Executor>,
        sample: &[SampledTilePart],
    ) -> Self {
        let area = |part: &SampledTilePart| part.tile.rect.extent.area();
        let tile = (analysed.geometry.tile_side as usize).pow(2);
        let largest = sample.iter().map(area).max().unwrap_or(tile);
        Self {
            parts_per_chunk: (tile / largest.max(1)).max(1),
            ..Self::new(analysed, sample)
        }
    }

    /// Compressed bytes of a scan.
    ///
    /// # Errors
    /// [`FormatError::Compress`].
    pub fn compressed_bytes(
        &self,
        scan: &ProgressiveScan,
        executor: &impl Executor,
    ) -> Result<f64, FormatError> {
        let chunks: Vec<_> = self.parts.chunks(self.parts_per_chunk).collect();
        let bytes = executor.map(chunks.len(), |i| {
            let runs = chunks[i].iter().filter_map(|part| part.runs(scan.coding));
            let bytes = compressed_bytes(runs, scan.items(), scan.step)?;
            Ok(chunks[i][0].weight * bytes as f64)
        });
        bytes.into_iter().sum()
    }

    /// The costs at `step` of each of `count` components or slots, by the coding.
    pub fn costs(
        &self,
        coding: ScanCoding,
        count: usize,
        step: f32,
        executor: &impl Executor,
    ) -> Vec<RateDistortion> {
        let parts = executor.map(self.parts.len(), |i| {
            let runs = self.parts[i].runs(coding);
            let (tokens, costs) = runs
                .map(|runs| part_costs(runs, count, step))
                .unwrap_or_default();
            (tokens, costs, self.parts[i].weight)
        });
        let mut counts = [[0.0; 256]; CONTEXTS];
        for (tokens, _, weight) in &parts {
            for token in tokens {
                counts[usize::from(token.context)][usize::from(token.token)] += weight;
            }
        }
        let bits = counts.map(|counts| {
            let all: f64 = counts.iter().sum();
            // Sign and mantissa bits follow a token.
            std::array::from_fn::<f64, 256, _>(|token| {
                libm::log2(all / counts[token].max(1.0)) + (token % 16) as f64
            })
        });
        let mut sums = vec![RateDistortion::default(); count];
        for (tokens, costs, weight) in parts {
            for token in tokens {
                let bits = bits[usize::from(token.context)][usize::from(token.token)];
                sums[usize::from(token.item)].bytes += weight * bits / 8.0;
            }
            for (sum, cost) in sums.iter_mut().zip(costs) {
                sum.energy += weight * cost.energy;
                sum.error += weight * cost.error;
            }
        }
        sums
    }
}

impl TransformedTilePart {
    fn runs(&self, coding: ScanCoding) -> Option<&dyn EncodableRuns> {
        match coding.is_direct() {
            true => self.functions.as_ref().map(|runs| runs as _),
            false => self.coefficients.as_ref().map(|runs| runs as _),
        }
    }
}

/// The tokens of `count` items, and their squared values and errors.
fn part_costs(
    runs: &dyn EncodableRuns,
    count: usize,
    step: f32,
) -> (Vec<EntropyToken>, Vec<RateDistortion>) {
    let (mut tokens, mut costs) = (Vec::new(), vec![RateDistortion::default(); count]);
    let square = |v: f32| f64::from(v).powi(2);
    runs.for_runs(0..count, step, &mut |run| {
        let item = |i: usize| run.first_item + i / run.values_per_item;
        for (i, (value, residual)) in run.values.iter().zip(run.residuals).enumerate() {
            costs[item(i)].energy += square(*value);
            costs[item(i)].error += square(*residual);
        }
        for_tokens(run.numbers, |i, context, token, _| {
            tokens.push(EntropyToken {
                item: item(i) as u16, // ranks and slots are below 2^12
                context: context as u8,
                token,
            });
        });
    });
    (tokens, costs)
}
