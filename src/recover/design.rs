//! The equations that all pixels with the same window share.

use super::CommonMode;
use crate::capture::Pattern;
use crate::transport::{Element, Extent, Window};

/// Patterns as one window sees them through one channel: centred over patterns, with the weighted
/// mean row kept apart, and their Gram matrix. Elements off the display are left out.
#[derive(Debug)]
pub(super) struct Design {
    /// Window slots (row · side + column) of the `k` elements on the display.
    pub slots: Vec<usize>,
    /// Centred patterns `[k, rows]`, each element's emissions over the patterns in one run.
    centred: Vec<f64>,
    rows: usize,
    /// Mean emission over patterns, `[k]`.
    mean: Vec<f64>,
    /// Weight of the squared mean row, L·ω².
    mean_weight: f64,
    /// `[k, k]`.
    pub gram: Vec<f64>,
}

impl Design {
    /// The equations for the window that starts at `origin`, from the patterns numbered `rows`.
    pub fn new(
        patterns: &[Pattern],
        rows: &[usize],
        channel: usize,
        light: Extent,
        window: Window,
        origin: Element,
        common_mode: CommonMode,
    ) -> Self {
        let (slots, elements): (Vec<usize>, Vec<usize>) = (0..window.area())
            .filter_map(|slot| {
                let m = window.element(origin, slot).index_in(light)?;
                Some((slot, m))
            })
            .unzip();
        let (k, l) = (slots.len(), rows.len());
        let mut centred = vec![0.0; k * l];
        let mut mean = vec![0.0; k];
        for (i, &row) in rows.iter().enumerate() {
            let plane = patterns[row].plane(channel);
            for (j, &m) in elements.iter().enumerate() {
                centred[j * l + i] = f64::from(plane[m]);
            }
        }
        for (emissions, mean) in centred.chunks_exact_mut(l.max(1)).zip(&mut mean) {
            *mean = emissions.iter().sum::<f64>() / l as f64;
            emissions.iter_mut().for_each(|e| *e -= *mean);
        }
        let mut design = Self {
            slots,
            centred,
            rows: l,
            mean,
            mean_weight: l as f64 * common_mode.weight().powi(2),
            gram: Vec::new(),
        };
        design.gram = design.gram();
        design
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.slots.len()
    }

    /// `Aᵀb` for measurements `y`, one for each of the design's patterns.
    pub fn right_hand_side(&self, y: &[f64]) -> Vec<f64> {
        let mean_y = y.iter().sum::<f64>() / y.len() as f64;
        // Centred columns sum to zero, so y need not be centred.
        let emissions = self.centred.chunks_exact(self.rows.max(1));
        emissions
            .zip(&self.mean)
            .map(|(e, mean)| dot(e, y) + self.mean_weight * mean * mean_y)
            .collect()
    }

    fn gram(&self) -> Vec<f64> {
        let (k, l) = (self.unknowns(), self.rows);
        let mut gram = vec![0.0; k * k];
        for i in 0..k {
            let a = &self.centred[i * l..(i + 1) * l];
            for j in 0..=i {
                let b = &self.centred[j * l..(j + 1) * l];
                let value = dot(a, b) + self.mean_weight * self.mean[i] * self.mean[j];
                gram[i * k + j] = value;
                gram[j * k + i] = value;
            }
        }
        gram
    }
}

/// Dot product in four lanes, which the compiler turns into vectors.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0f64; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4
        .remainder()
        .iter()
        .zip(b4.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in a4.zip(b4) {
        for lane in 0..4 {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    lanes.iter().sum::<f64>() + rest
}
