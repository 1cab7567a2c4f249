//! The equations of every window in a region of the light plane, made from correlations that the windows share.
//!
//! Pixels whose correspondence falls in the same light element have one window, and so one Gram matrix. Neighbouring
//! windows overlap: the entry for two light elements m and m + δ is the same in each window that holds both. The
//! [`GramCache`] computes it once, and a window's matrix is then copied from a table instead of multiplied out, at L
//! products an entry.

use super::common_mode_weight::CommonModeWeight;
use super::normal_equations::{EquationWeights, WeightedColumns};
use crate::linalg::{add_scaled, dot, vectorise};
use crate::recover::photometry::CalibratedMeasurements;
use crate::transport::{ClippedRect, Extent, Geometry, LightElement, Window};

/// Largest table of correlations that one thread may have in memory.
const MAX_TABLE_BYTES: usize = 64 << 20;

/// The patterns on a region of the light plane, with the correlations that the windows in it share.
#[derive(Debug)]
pub(super) struct GramCache {
    geometry: Geometry,
    region: ClippedRect,
    /// The patterns, and the weight of each, `[L]`.
    pattern_indices: Vec<usize>,
    weights: Vec<f64>,
    /// Emissions times the pattern's weight, `[element, L]`.
    emissions: Vec<f64>,
    /// Inner products of an element's emissions and those of its neighbours, as `[element, δv, δu]` with δ from −(w −
    /// 1) to w − 1. Empty if the region has too few windows to share them.
    correlations: Vec<f64>,
}

/// The least-squares equations of one window: `WP̂`, and its Gram matrix.
#[derive(Debug)]
pub(super) struct WindowEquations {
    /// Window slots of the k elements on the light plane: the unknowns.
    pub slots: Vec<usize>,
    /// `(WP̂)ᵀ`.
    pub columns: WeightedColumns,
    /// `(WP̂)ᵀ(WP̂)`, `[k, k]`.
    pub gram: Vec<f64>,
}

impl WindowEquations {
    /// `Wy` for measurements y, one for each pattern of the equations.
    pub fn weight(&self, y: &[f64]) -> Vec<f64> {
        let mut weighted = y.to_vec();
        self.columns.weights.apply(&mut weighted);
        weighted
    }

    /// `(WP̂)ᵀ Wy` for weighted measurements `Wy`, `[k]`.
    pub fn right_hand_side(&self, weighted_y: &[f64]) -> Vec<f64> {
        vectorise(
            #[cfg_attr(target_arch = "x86_64", inline(always))]
            || self.columns.right_hand_side(weighted_y).collect(),
        )
    }
}

impl GramCache {
    /// Upper bound on the memory of a cache for `side²` window origins and the equations of one window, in bytes.
    pub fn max_bytes(window: Window, side: usize, patterns: usize) -> usize {
        let region = (side + window.side() as usize - 1).pow(2);
        let table = region * offsets(window).pow(2) * size_of::<f64>();
        let table = if table <= MAX_TABLE_BYTES { table } else { 0 };
        let emissions = (region + window.area()) * patterns * size_of::<f64>();
        table + emissions + window.area().pow(2) * size_of::<f64>()
    }

    /// A cache for the windows with these origins. The equations are those of the patterns `pattern_indices`, in the
    /// colour of `channel`.
    pub fn new(
        measurements: &CalibratedMeasurements<'_>,
        geometry: &Geometry,
        pattern_indices: &[usize],
        channel: usize,
        origins: &[LightElement],
    ) -> Self {
        let (light, window) = (geometry.light, geometry.window);
        let us = || origins.iter().map(|origin| origin.u);
        let vs = || origins.iter().map(|origin| origin.v);
        let (v, u) = (vs().min().unwrap_or(0), us().min().unwrap_or(0));
        let size = Extent::new(
            us().max().unwrap_or(0).abs_diff(u) + window.side(),
            vs().max().unwrap_or(0).abs_diff(v) + window.side(),
        );
        let region = ClippedRect::new(LightElement { v, u }, size, light);
        let (width, height, [u, v]) = (region.columns.len(), region.rows.len(), region.first());
        let (l, weights) = (pattern_indices.len(), measurements.pattern_weights());
        let mut emissions = vec![0.0; region.area() * l];
        for (i, &index) in pattern_indices.iter().enumerate() {
            let plane = measurements.patterns[index].plane(channel);
            for row in 0..height {
                let start = (v + row) * light.width as usize + u;
                for (column, &p) in plane[start..start + width].iter().enumerate() {
                    emissions[(row * width + column) * l + i] = weights[index] * f64::from(p);
                }
            }
        }
        let mut cache = Self {
            geometry: geometry.clone(),
            region,
            pattern_indices: pattern_indices.to_vec(),
            weights: pattern_indices.iter().map(|&i| weights[i]).collect(),
            emissions,
            correlations: Vec::new(),
        };
        // The table takes an inner product for each pair of elements that any window could hold; a window's own Gram
        // matrix takes one for each pair that it does hold.
        let entries = cache.region.area() * offsets(window).pow(2);
        let products = origins.len() * window.area().pow(2);
        if entries * size_of::<f64>() <= MAX_TABLE_BYTES && entries < products {
            cache.correlations = vectorise(
                #[cfg_attr(target_arch = "x86_64", inline(always))]
                || cache.correlate(),
            );
        }
        cache
    }

    /// Weighted emissions of the region's element `m`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn emission(&self, m: usize) -> &[f64] {
        let patterns = self.weights.len();
        &self.emissions[m * patterns..(m + 1) * patterns]
    }

    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn correlate(&self) -> Vec<f64> {
        let window = self.geometry.window;
        let (width, height) = (self.region.columns.len(), self.region.rows.len());
        let offsets = offsets(window);
        let reach = window.side() as usize - 1;
        let mut table = vec![0.0; width * height * offsets * offsets];
        for m in 0..width * height {
            let (u, v) = (m % width, m / width);
            let here = self.emission(m);
            for row in v..height.min(v + reach + 1) {
                let start = if row == v { u } else { u.saturating_sub(reach) };
                for column in start..width.min(u + reach + 1) {
                    let n = row * width + column;
                    let value = dot(here, self.emission(n));
                    // δ as seen from m, and −δ from n.
                    let (dv, du) = (row - v, column + reach - u);
                    table[(m * offsets + reach + dv) * offsets + du] = value;
                    table[(n * offsets + reach - dv) * offsets + 2 * reach - du] = value;
                }
            }
        }
        table
    }

    /// The equations of the window that starts at `origin`, from the patterns `pattern_indices` of the cache's.
    pub fn equations(
        &self,
        origin: LightElement,
        common_mode: CommonModeWeight,
        pattern_indices: &[usize],
    ) -> WindowEquations {
        let columns = self.geometry.clip_window(origin).columns.len();
        let light_width = self.geometry.light.width as usize;
        let width = self.region.columns.len();
        let [left, top] = self.region.first();
        let in_region = |m: usize| (m / light_width - top) * width + m % light_width - left;
        let elements = self.geometry.elements_of_window(origin);
        let (slots, elements): (Vec<usize>, Vec<usize>) =
            elements.map(|(slot, m)| (slot, in_region(m))).unzip();
        // Pattern indices rise.
        let position = |i: usize| pattern_indices.binary_search(&self.pattern_indices[i]);
        let is_included = |&i: &usize| position(i).is_ok();
        let (included, excluded): (Vec<usize>, Vec<usize>) =
            (0..self.weights.len()).partition(is_included);
        let weights = included.iter().map(|&i| self.weights[i]).collect();
        let mut emissions = Vec::with_capacity(elements.len() * included.len());
        for &m in &elements {
            let emission = self.emission(m);
            match excluded.is_empty() {
                true => emissions.extend_from_slice(emission),
                false => emissions.extend(included.iter().map(|&i| emission[i])),
            }
        }
        let (columns, gram) = vectorise(
            #[cfg_attr(target_arch = "x86_64", inline(always))]
            || {
                let weights = EquationWeights::new(weights, common_mode);
                let weighted = WeightedColumns::from_weighted(emissions, weights);
                let gram = match self.correlations.is_empty() {
                    true => weighted.gram(),
                    false => self.look_up(&weighted, &elements, columns, &excluded),
                };
                (weighted, gram)
            },
        );
        WindowEquations {
            slots,
            columns,
            gram,
        }
    }

    /// The Gram matrix of `elements`, which are in rows of `width`, from the table.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn look_up(
        &self,
        columns: &WeightedColumns,
        elements: &[usize],
        width: usize,
        excluded: &[usize],
    ) -> Vec<f64> {
        let (k, offsets) = (elements.len(), offsets(self.geometry.window));
        let reach = self.geometry.window.side() as usize - 1;
        let mut gram = vec![0.0; k * k];
        // (diag(w)P̂)ᵀ diag(w)P̂ of all patterns.
        for (i, row) in gram.chunks_exact_mut(k.max(1)).enumerate() {
            let (u, v) = (i % width, i / width);
            for (to, row) in row.chunks_exact_mut(width.max(1)).enumerate() {
                let start = (elements[i] * offsets + reach + to - v) * offsets + reach - u;
                row.copy_from_slice(&self.correlations[start..start + width]);
            }
        }
        for &pattern in excluded {
            let emissions = elements.iter().map(|&m| self.emission(m)[pattern]);
            subtract_outer_product(&mut gram, 1.0, &emissions.collect::<Vec<_>>());
        }
        // W scales the means: (WP̂)ᵀ(WP̂) = (diag(w)P̂)ᵀ diag(w)P̂ − (1 − ω²) ‖w‖² p̄p̄ᵀ.
        let weights = &columns.weights;
        let factor = (1.0 - weights.common_mode.weight().powi(2)) * weights.energy;
        if factor != 0.0 {
            subtract_outer_product(&mut gram, factor, &columns.means);
        }
        gram
    }
}

fn offsets(window: Window) -> usize {
    2 * window.side() as usize - 1
}

/// Computes `A −= factor · vvᵀ`.
#[cfg_attr(target_arch = "x86_64", inline(always))]
fn subtract_outer_product(a: &mut [f64], factor: f64, v: &[f64]) {
    for (row, x) in a.chunks_exact_mut(v.len().max(1)).zip(v) {
        add_scaled(row, -factor * x, v);
    }
}

#[cfg(test)]
mod tests {
    use super::super::preparation_input;
    use super::*;
    use crate::capture::Measurements;
    use crate::capture::{CameraPixelSet, NoiseModel, Pattern};
    use crate::transport::{CHANNELS, Correspondence};

    const LIGHT: Extent = Extent::new(7, 6);
    const PATTERNS: usize = 9;

    fn measurements() -> Measurements {
        let emission = |i: usize| (i * 7919 % 1009) as f32 / 1009.0;
        let patterns = (0..PATTERNS)
            .map(|l| Pattern::Grey((0..LIGHT.area()).map(|m| emission(l * 101 + m)).collect()));
        Measurements {
            camera: LIGHT,
            light: LIGHT,
            correspondence: Correspondence::from_affine([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
            patterns: patterns.collect(),
            full_scale: (0..PATTERNS).map(|l| 0.5 + 0.2 * l as f32).collect(),
            loaded: CameraPixelSet::all(LIGHT),
            photos: Vec::new(),
            flood: None,
            noise: NoiseModel {
                gain: [0.0; CHANNELS],
                floor: [0.0; CHANNELS],
            },
        }
    }

    /// Equations from the table are those multiplied out, for windows inside and across the border, with all patterns
    /// and without some.
    #[test]
    fn table_agrees_with_products() {
        let (measurements, indices) = (measurements(), (0..PATTERNS).collect::<Vec<_>>());
        let measurements = CalibratedMeasurements::uncorrected(&measurements);
        let window = Window::new(3).unwrap();
        let geometry = preparation_input::geometry(&measurements, window).unwrap();
        let cache = |origins: &[LightElement]| {
            GramCache::new(&measurements, &geometry, &indices, 0, origins)
        };
        let origins: Vec<LightElement> = (-2..=4)
            .flat_map(|v| (-1..=5).map(move |u| LightElement { v, u }))
            .collect();
        let shared = cache(&origins);
        assert!(!shared.correlations.is_empty());
        for origin in [(-1, -2), (2, 1), (5, 4), (0, 0)].map(|(u, v)| LightElement { u, v }) {
            let own = cache(&[origin]);
            for excluded in [&[][..], &[3], &[0, 8]] {
                let mut included = indices.clone();
                included.retain(|l| !excluded.contains(l));
                for common_mode in [CommonModeWeight::FULL, CommonModeWeight::POOLED] {
                    let ours = shared.equations(origin, common_mode, &included);
                    let expected = own.equations(origin, common_mode, &included);
                    assert_eq!(ours.slots, expected.slots);
                    assert_eq!(ours.columns.columns, expected.columns.columns);
                    assert_eq!(ours.columns.weights.len(), PATTERNS - excluded.len());
                    for (a, b) in ours.gram.iter().zip(expected.columns.gram()) {
                        assert!((a - b).abs() < 1e-12, "{a} {b}");
                    }
                }
            }
        }
        // Slot 0 of the window at (-1, -2) is off the light plane, as all but its last row are.
        let corner = shared.equations(origins[0], CommonModeWeight::FULL, &indices);
        assert_eq!(corner.slots, [7, 8]);
        let emission = f64::from(measurements.patterns[4].plane(0)[1]);
        let weight = measurements.pattern_weights()[4];
        assert!((corner.columns.column(1)[4] - weight * emission).abs() < 1e-12);
    }
}
