//! What a scan costs and gains, predicted from a sample without compression.
//!
//! Bytes are the entropy of the tokens in their three contexts, plus sign and mantissa bits. Both bytes and
//! squared errors are told apart by item: by component, or by slot in centre-out order.

use super::encoder::Encoder;
use super::sampling::SampledPart;
use crate::executor::Executor;
use crate::format::codec::direct::OrderedFunctions;
use crate::format::codec::tokens::{CONTEXTS, ItemRuns, for_tokens};
use crate::format::codec::transform_encoder::TransformedTile;
use crate::format::error::FormatError;
use crate::format::scan::Scan;

/// Bytes and squared error of one item at one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ItemCost {
    pub bytes: f64,
    /// Squared error if the item is left out.
    pub energy: f64,
    /// Squared error if the item is coded.
    pub error: f64,
}

/// The sample's values as the codecs quantise them.
pub struct CostModel {
    rank: usize,
    slots: usize,
    parts: Vec<ModelPart>,
}

struct ModelPart {
    weight: f64,
    coefficients: Option<TransformedTile>,
    functions: Option<OrderedFunctions>,
}

/// One token of an item.
struct ItemToken {
    item: u16,
    context: u8,
    token: u8,
}

/// Tokens and errors of the items of one part.
struct PartCosts {
    tokens: Vec<ItemToken>,
    energies: Vec<f64>,
    errors: Vec<f64>,
}

impl CostModel {
    pub fn new(encoder: &Encoder<'_>, sample: &[SampledPart], executor: &impl Executor) -> Self {
        let parts = executor.map(sample.len(), |i| {
            let SampledPart { tile, weight } = &sample[i];
            let has_functions = encoder.slots() > 0 && !tile.functions.is_empty();
            ModelPart {
                weight: *weight,
                coefficients: encoder
                    .rotated(tile)
                    .map(|tile| TransformedTile::new(&tile)),
                functions: has_functions
                    .then(|| OrderedFunctions::new(&tile.functions, &encoder.order)),
            }
        });
        Self {
            rank: encoder.rank(),
            slots: encoder.slots(),
            parts,
        }
    }

    /// The costs of each component at `step`.
    pub fn components(&self, step: f32, executor: &impl Executor) -> Vec<ItemCost> {
        self.costs(self.rank, |part| part.coefficients.as_ref(), step, executor)
    }

    /// The costs of each slot at `step`.
    pub fn slots(&self, step: f32, executor: &impl Executor) -> Vec<ItemCost> {
        self.costs(self.slots, |part| part.functions.as_ref(), step, executor)
    }

    /// Compressed bytes of a scan.
    ///
    /// # Errors
    /// [`FormatError::Compress`].
    pub fn compressed_bytes(
        &self,
        scan: &Scan,
        executor: &impl Executor,
    ) -> Result<f64, FormatError> {
        let items = usize::from(scan.first)..scan.end();
        let bytes = executor.map(self.parts.len(), |i| {
            let part = &self.parts[i];
            let items = items.clone();
            let bytes = match (scan.coding.is_direct(), &part.coefficients, &part.functions) {
                (false, Some(runs), _) => runs.compressed_bytes(items, scan.step),
                (true, _, Some(runs)) => runs.compressed_bytes(items, scan.step),
                _ => Ok(0),
            };
            Ok(part.weight * bytes? as f64)
        });
        bytes.into_iter().sum()
    }

    fn costs<R: ItemRuns + Sync>(
        &self,
        items: usize,
        runs: impl Fn(&ModelPart) -> Option<&R> + Sync + Send,
        step: f32,
        executor: &impl Executor,
    ) -> Vec<ItemCost> {
        if items == 0 {
            return Vec::new();
        }
        let parts = executor.map(self.parts.len(), |i| {
            runs(&self.parts[i]).map(|runs| PartCosts::new(runs, items, step))
        });
        let weighted = || {
            let parts = parts.iter().zip(&self.parts);
            parts.filter_map(|(costs, part)| Some((costs.as_ref()?, part.weight)))
        };
        let mut counts = [[0.0; 256]; CONTEXTS];
        for (part, weight) in weighted() {
            for token in &part.tokens {
                counts[usize::from(token.context)][usize::from(token.token)] += weight;
            }
        }
        let bits = counts.map(|counts| {
            let all: f64 = counts.iter().sum();
            // Sign and mantissa bits follow a token.
            std::array::from_fn::<f64, 256, _>(|token| {
                (all / counts[token].max(1.0)).log2() + (token % 16) as f64
            })
        });
        let mut costs = vec![ItemCost::default(); items];
        for (part, weight) in weighted() {
            for token in &part.tokens {
                let bits = bits[usize::from(token.context)][usize::from(token.token)];
                costs[usize::from(token.item)].bytes += weight * bits / 8.0;
            }
            let errors = part.energies.iter().zip(&part.errors);
            for (cost, (energy, error)) in costs.iter_mut().zip(errors) {
                cost.energy += weight * energy;
                cost.error += weight * error;
            }
        }
        costs
    }
}

impl PartCosts {
    fn new(runs: &impl ItemRuns, items: usize, step: f32) -> Self {
        let mut costs = Self {
            tokens: Vec::new(),
            energies: vec![0.0; items],
            errors: vec![0.0; items],
        };
        let square = |v: f32| f64::from(v).powi(2);
        runs.for_runs(0..items, step, |run| {
            // Ranks and slots are below 2^12.
            let item = |i: usize| run.first_item + i / run.values_per_item;
            for (i, (value, residual)) in run.values.iter().zip(run.residuals).enumerate() {
                costs.energies[item(i)] += square(*value);
                costs.errors[item(i)] += square(*residual);
            }
            for_tokens(run.numbers, |i, context, token, _| {
                costs.tokens.push(ItemToken {
                    item: item(i) as u16,
                    context: context as u8,
                    token,
                });
            });
        });
        costs
    }
}
