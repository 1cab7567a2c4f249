//! The kernels that light transport functions are combined from, and patterns seen through them.

use super::equations::Projected;
use crate::capture::Measurements;
use crate::linalg::vectorise;
use crate::transport::{Basis, Element, Geometry};

/// Responses computed together: two vector registers of f32 on the narrowest machine of note.
const LANES: usize = 8;

/// An orthonormal set of kernels on the window, and the mean light transport function.
#[derive(Clone, Debug)]
pub(super) struct Kernels {
    rank: usize,
    /// `[element, stride]`: kernels, then the mean function, then zeros up to a multiple of
    /// [`LANES`].
    values: Vec<f32>,
    stride: usize,
}

impl Kernels {
    /// `kernels` are `[r, element]`; `mean` is the mean light transport function, `[element]`.
    pub fn new(kernels: &[f64], mean: &[f64]) -> Self {
        let area = mean.len();
        let rank = kernels.len() / area;
        let stride = (rank + 1).next_multiple_of(LANES);
        let mut values = vec![0.0; area * stride];
        for (s, values) in values.chunks_exact_mut(stride).enumerate() {
            for k in 0..rank {
                values[k] = kernels[k * area + s] as f32;
            }
            values[rank] = mean[s] as f32;
        }
        Self {
            rank,
            values,
            stride,
        }
    }

    /// Number of kernels, `r`.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// The kernels by themselves.
    pub fn basis(&self) -> Basis {
        let kernel = |k| {
            let rows = self.values.chunks_exact(self.stride);
            rows.map(|row| row[k]).collect()
        };
        Basis {
            kernels: (0..self.rank).map(kernel).collect(),
        }
    }

    /// The kernels as `[element, r]`, and the mean function's peak.
    pub fn by_element(&self) -> (Vec<f64>, f64) {
        let mut elements = Vec::with_capacity(self.values.len());
        let mut peak = 0.0f64;
        for row in self.values.chunks_exact(self.stride) {
            elements.extend(row[..self.rank].iter().map(|&v| f64::from(v)));
            peak = peak.max(f64::from(row[self.rank]));
        }
        (elements, peak)
    }

    /// Every pattern, in the colour of channel `plane`, seen by the window that starts at `origin`.
    pub fn project(
        &self,
        measurements: &Measurements,
        geometry: &Geometry,
        origin: Element,
        plane: usize,
    ) -> Projected {
        let (window, light) = (geometry.window, geometry.light);
        let side = window.side() as usize;
        let width = light.width as usize;
        // The part of the window that lies on the display.
        let clip = |at: i32, length: u32| {
            let (at, length) = (i64::from(at), i64::from(length));
            let first = (-at).clamp(0, side as i64);
            let end = (length - at).clamp(first, side as i64);
            (first as usize..end as usize, at)
        };
        let (columns, u) = clip(origin.u, light.width);
        let (lines, v) = clip(origin.v, light.height);
        let mut responses = vec![0.0; measurements.patterns.len() * self.stride];
        let mut emission = vec![0.0f32; lines.len() * columns.len()];
        let mut kernels = Vec::with_capacity(emission.len() * self.stride);
        for line in lines.clone() {
            let first = (line * side + columns.start) * self.stride;
            kernels.extend_from_slice(&self.values[first..first + columns.len() * self.stride]);
        }
        let rows = responses.chunks_exact_mut(self.stride);
        for (pattern, row) in measurements.patterns.iter().zip(rows) {
            let pattern = pattern.plane(plane);
            for (line, out) in lines
                .clone()
                .zip(emission.chunks_exact_mut(columns.len().max(1)))
            {
                let first =
                    (v + line as i64) as usize * width + (u + columns.start as i64) as usize;
                out.copy_from_slice(&pattern[first..first + columns.len()]);
            }
            vectorise(
                #[inline(always)]
                || respond(&emission, &kernels, row),
            );
        }
        Projected {
            whole: columns.len() == side && lines.len() == side,
            responses,
            stride: self.stride,
            rank: self.rank,
        }
    }
}

/// `row = emission · kernels`, `kernels` `[element, stride]`.
#[inline(always)]
fn respond(emission: &[f32], kernels: &[f32], row: &mut [f32]) {
    let stride = row.len();
    let mut at = 0;
    // Sums stay in registers: as many as the machine has, then fewer for the rest.
    while at < stride {
        match stride - at {
            32.. => at += block::<32>(emission, kernels, row, at),
            16.. => at += block::<16>(emission, kernels, row, at),
            _ => at += block::<LANES>(emission, kernels, row, at),
        }
    }
}

#[inline(always)]
fn block<const WIDTH: usize>(
    emission: &[f32],
    kernels: &[f32],
    row: &mut [f32],
    at: usize,
) -> usize {
    let mut sums = [0.0f32; WIDTH];
    for (p, kernels) in emission.iter().zip(kernels.chunks_exact(row.len())) {
        if let Some(values) = kernels[at..].first_chunk::<WIDTH>() {
            for (sum, v) in sums.iter_mut().zip(values) {
                *sum += p * v;
            }
        }
    }
    row[at..at + WIDTH].copy_from_slice(&sums);
    WIDTH
}
