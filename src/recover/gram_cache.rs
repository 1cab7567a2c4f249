//! The equations that all pixels with the same window share.

use super::CommonMode;
use crate::capture::Pattern;
use crate::linalg::{add_scaled, dot, vectorise};
use crate::transport::{Element, Extent, Window};

/// A rectangle of light elements, all on the display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Region {
    u: usize,
    v: usize,
    width: usize,
    height: usize,
}

impl Region {
    /// What of the windows that start between two origins lies on the display.
    fn of_windows(first: Element, last: Element, window: Window, light: Extent) -> Self {
        let clip = |first: i32, last: i32, length: u32| {
            let length = i64::from(length);
            let start = i64::from(first).clamp(0, length);
            let end = (i64::from(last) + i64::from(window.side())).clamp(start, length);
            (start as usize, (end - start) as usize)
        };
        let (u, width) = clip(first.u, last.u, light.width);
        let (v, height) = clip(first.v, last.v, light.height);
        Self {
            u,
            v,
            width,
            height,
        }
    }

    fn area(self) -> usize {
        self.width * self.height
    }

    /// Number in this region of the element in column `u` and row `v` of `inner`, which lies in it.
    fn index(self, inner: Self, u: usize, v: usize) -> usize {
        (inner.v + v - self.v) * self.width + inner.u + u - self.u
    }
}

/// A part of the display under some of the patterns, as one channel sees it, with what the windows
/// in it share.
#[derive(Debug)]
pub(super) struct Patch {
    light: Extent,
    window: Window,
    region: Region,
    /// What each pattern counts for, `[pattern]`.
    weights: Vec<f64>,
    /// Emissions times the pattern's weight, `[element, pattern]`.
    emissions: Vec<f64>,
    /// Mean emission over the patterns, each by the square of its weight, `[element]`.
    mean: Vec<f64>,
    /// Correlations with the neighbours, `G[m, m + δ]`, as `[element, δv, δu]`, each δ from
    /// `-(w − 1)` to `w − 1`; empty where few windows are to share them.
    correlations: Vec<f64>,
}

/// Largest table of correlations: what one thread may have in memory of them.
const MOST_TABLE_BYTES: usize = 64 << 20;

impl Patch {
    /// About the most memory that the windows of a square of `side²` origins take to share what they
    /// do under so many patterns, and one design made from it, in bytes.
    pub fn bytes(window: Window, side: usize, patterns: usize) -> usize {
        let region = (side + window.side() as usize - 1).pow(2);
        let table = region * (2 * window.side() as usize - 1).pow(2) * size_of::<f64>();
        let table = if table <= MOST_TABLE_BYTES { table } else { 0 };
        let emissions = (region + window.area()) * patterns * size_of::<f64>();
        table + emissions + window.area().pow(2) * size_of::<f64>()
    }

    /// The part of the display that `windows` windows see, all of them starting between the origins
    /// `first` and `last`, under the patterns numbered `rows`; `weights` of all patterns.
    pub fn new(
        (patterns, weights): (&[Pattern], &[f64]),
        rows: &[usize],
        channel: usize,
        light: Extent,
        window: Window,
        [first, last]: [Element; 2],
        windows: usize,
    ) -> Self {
        let region = Region::of_windows(first, last, window, light);
        let l = rows.len();
        let mut emissions = vec![0.0; region.area() * l];
        for (i, &row) in rows.iter().enumerate() {
            let plane = patterns[row].plane(channel);
            for v in 0..region.height {
                let start = (region.v + v) * light.width as usize + region.u;
                for (u, &p) in plane[start..start + region.width].iter().enumerate() {
                    emissions[(v * region.width + u) * l + i] = weights[row] * f64::from(p);
                }
            }
        }
        let weights: Vec<f64> = rows.iter().map(|&row| weights[row]).collect();
        let columns = emissions.chunks_exact(l.max(1));
        let mut patch = Self {
            light,
            window,
            region,
            mean: columns.map(|e| mean(&weights, e)).collect(),
            weights,
            emissions,
            correlations: Vec::new(),
        };
        // The table has a dot product for each pair of elements that any window could hold, a Gram
        // matrix of its own one for each pair that its window does hold.
        let entries = region.area() * patch.reach().pow(2);
        if entries * size_of::<f64>() <= MOST_TABLE_BYTES
            && entries < windows * window.area().pow(2)
        {
            patch.correlations = vectorise(
                #[inline(always)]
                || patch.correlate(),
            );
        }
        patch
    }

    /// Number of offsets along an axis between two elements of a window.
    fn reach(&self) -> usize {
        2 * self.window.side() as usize - 1
    }

    /// Emissions of the region's element `m`.
    #[inline(always)]
    fn emission(&self, m: usize) -> &[f64] {
        let rows = self.weights.len();
        &self.emissions[m * rows..(m + 1) * rows]
    }

    #[inline(always)]
    fn correlate(&self) -> Vec<f64> {
        let (region, reach) = (self.region, self.reach());
        let most = self.window.side() as usize - 1;
        let mut table = vec![0.0; region.area() * reach * reach];
        for v in 0..region.height {
            for u in 0..region.width {
                let m = v * region.width + u;
                let here = self.emission(m);
                for below in v..region.height.min(v + most + 1) {
                    let first = if below == v {
                        u
                    } else {
                        u.saturating_sub(most)
                    };
                    for beside in first..region.width.min(u + most + 1) {
                        let n = below * region.width + beside;
                        let value = dot(here, self.emission(n));
                        // δ seen from m, and −δ from n.
                        let (dv, du) = (below - v, beside + most - u);
                        table[(m * reach + most + dv) * reach + du] = value;
                        table[(n * reach + most - dv) * reach + 2 * most - du] = value;
                    }
                }
            }
        }
        table
    }

    /// The equations of the window that starts at `origin`, from all of the patch's patterns but
    /// those at `dropped`, places among its rows.
    pub fn design(&self, origin: Element, common_mode: CommonMode, dropped: &[usize]) -> Design {
        let here = Region::of_windows(origin, origin, self.window, self.light);
        let elements: Vec<usize> = (0..here.area())
            .map(|i| self.region.index(here, i % here.width, i / here.width))
            .collect();
        let side = self.window.side() as usize;
        // Columns and rows of the window that lie off the display before its first element.
        let (left, above) = (
            (here.u as i64 - i64::from(origin.u)) as usize,
            (here.v as i64 - i64::from(origin.v)) as usize,
        );
        let slots = (0..here.area())
            .map(|i| (above + i / here.width) * side + left + i % here.width)
            .collect();
        let kept = |i: &usize| !dropped.contains(i);
        let weights: Vec<f64> = (0..self.weights.len())
            .filter(kept)
            .map(|i| self.weights[i])
            .collect();
        let k = elements.len();
        let mut design = Design {
            slots,
            emissions: Vec::with_capacity(k * weights.len()),
            total: weights.iter().map(|w| w * w).sum(),
            weights,
            mean: Vec::with_capacity(k),
            common_mode,
            gram: vec![0.0; k * k],
        };
        for &m in &elements {
            let start = design.emissions.len();
            let all = self.emission(m).iter().enumerate();
            design
                .emissions
                .extend(all.filter(|(i, _)| kept(i)).map(|(_, e)| e));
            let level = match dropped.is_empty() {
                true => self.mean[m],
                false => mean(&design.weights, &design.emissions[start..]),
            };
            design.mean.push(level);
        }
        vectorise(
            #[inline(always)]
            || {
                match self.correlations.is_empty() {
                    true => design.multiply_out(),
                    false => self.look_up(here, &elements, dropped, &mut design.gram),
                }
                design.weigh_common_mode();
            },
        );
        design
    }

    /// The Gram matrix of the elements `here` from the table, less what `dropped` rows add to it.
    #[inline(always)]
    fn look_up(&self, here: Region, elements: &[usize], dropped: &[usize], gram: &mut [f64]) {
        let (k, reach, most) = (
            elements.len(),
            self.reach(),
            self.window.side() as usize - 1,
        );
        for (i, row) in gram.chunks_exact_mut(k.max(1)).enumerate() {
            let (u, v) = (i % here.width, i / here.width);
            for (to, row) in row.chunks_exact_mut(here.width.max(1)).enumerate() {
                let start = (elements[i] * reach + most + to - v) * reach + most - u;
                row.copy_from_slice(&self.correlations[start..start + here.width]);
            }
        }
        for &r in dropped {
            let of: Vec<f64> = elements.iter().map(|&m| self.emission(m)[r]).collect();
            for (i, row) in gram.chunks_exact_mut(k.max(1)).enumerate() {
                for (g, e) in row.iter_mut().zip(&of) {
                    *g -= of[i] * e;
                }
            }
        }
    }
}

/// Patterns as one window sees them through one channel, `P̂`, by what they count for and with their
/// common mode weighted: the equations are `Wy = WP̂τ`, where `W = (I − (1 − ω) wwᵀ/‖w‖²) diag(w)` for
/// weights `w` leaves alone what differs between patterns and scales their mean by ω. Elements off the
/// display are left out.
#[derive(Debug)]
pub(super) struct Design {
    /// Window slots (row · side + column) of the `k` elements on the display.
    pub slots: Vec<usize>,
    /// `(diag(w)P̂)ᵀ`, `[k, rows]`: each element's emissions over the patterns in one run.
    emissions: Vec<f64>,
    /// `w`, `[rows]`, and `‖w‖²`.
    weights: Vec<f64>,
    total: f64,
    /// Mean emission over patterns, `[k]`.
    mean: Vec<f64>,
    common_mode: CommonMode,
    /// `(WP̂)ᵀ(WP̂)`, `[k, k]`.
    pub gram: Vec<f64>,
}

impl Design {
    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.slots.len()
    }

    /// Number of equations, `L`.
    pub fn rows(&self) -> usize {
        self.weights.len()
    }

    /// Turns measurements, one for each of the design's patterns, into `Wy`.
    pub fn weigh(&self, mut y: Vec<f64>) -> Vec<f64> {
        y.iter_mut().zip(&self.weights).for_each(|(y, w)| *y *= w);
        let less = (1.0 - self.common_mode.weight()) * mean(&self.weights, &y);
        y.iter_mut()
            .zip(&self.weights)
            .for_each(|(y, w)| *y -= less * w);
        y
    }

    /// `‖Wy − WP̂x‖²` for weighted measurements `Wy`.
    pub fn squared_residual(&self, weighted_y: &[f64], x: &[f64]) -> f64 {
        let mut difference = weighted_y.to_vec();
        let columns = self.emissions.chunks_exact(self.rows().max(1));
        let mut weighted_mean = 0.0;
        for ((column, mean), &x) in columns.zip(&self.mean).zip(x).filter(|(_, x)| **x != 0.0) {
            add_scaled(&mut difference, -x, column);
            weighted_mean += (1.0 - self.common_mode.weight()) * mean * x;
        }
        let difference = difference.iter().zip(&self.weights);
        difference
            .map(|(d, w)| (d + weighted_mean * w).powi(2))
            .sum()
    }

    /// `(WP̂)ᵀ`, `[k, rows]`.
    pub fn weighted(&self) -> Vec<f64> {
        let mut all = self.emissions.clone();
        for (column, mean) in all.chunks_exact_mut(self.rows().max(1)).zip(&self.mean) {
            let less = (1.0 - self.common_mode.weight()) * mean;
            let column = column.iter_mut().zip(&self.weights);
            column.for_each(|(e, w)| *e -= less * w);
        }
        all
    }

    /// `(WP̂)ᵀ Wy` for weighted measurements `Wy`.
    pub fn right_hand_side(&self, weighted_y: &[f64]) -> Vec<f64> {
        // Of (WP̂)ᵀ = (diag(w)P̂)ᵀ − (1 − ω) p̄wᵀ the second part only meets wᵀWy.
        let less = (1.0 - self.common_mode.weight()) * dot(&self.weights, weighted_y);
        vectorise(
            #[inline(always)]
            || {
                let columns = self.emissions.chunks_exact(self.rows().max(1));
                columns
                    .zip(&self.mean)
                    .map(|(e, mean)| dot(e, weighted_y) - less * mean)
                    .collect()
            },
        )
    }

    #[inline(always)]
    fn multiply_out(&mut self) {
        let (k, l) = (self.unknowns(), self.rows());
        for i in 0..k {
            let a = &self.emissions[i * l..(i + 1) * l];
            for j in 0..=i {
                let value = dot(a, &self.emissions[j * l..(j + 1) * l]);
                self.gram[i * k + j] = value;
                self.gram[j * k + i] = value;
            }
        }
    }

    /// `A = (diag(w)P̂)ᵀdiag(w)P̂` to `P̂ᵀW²P̂ = A − (1 − ω²) ‖w‖² p̄p̄ᵀ`.
    #[inline(always)]
    fn weigh_common_mode(&mut self) {
        let factor = (1.0 - self.common_mode.weight().powi(2)) * self.total;
        if factor == 0.0 {
            return;
        }
        let rows = self.gram.chunks_exact_mut(self.mean.len().max(1));
        for (row, mean) in rows.zip(&self.mean) {
            let scaled = factor * mean;
            for (g, mean) in row.iter_mut().zip(&self.mean) {
                *g -= scaled * mean;
            }
        }
    }
}

/// The mean of values that come times their weights, each by the square of its weight.
fn mean(weights: &[f64], weighted: &[f64]) -> f64 {
    let sum: f64 = weights.iter().zip(weighted).map(|(w, e)| w * e).sum();
    sum / weights.iter().map(|w| w * w).sum::<f64>()
}
