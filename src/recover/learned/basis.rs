//! The basis that all light transport functions share, and its responses to the patterns.
//!
//! [`LearnedBasis`] holds V, `[S, r]`, orthonormal columns, and the mean light transport function h, `[S]`. For a window
//! whose elements emit P̂, `[L, S]`, it computes P̂V, `[L, r]`, and P̂h, `[L]`, together. V and h are interleaved by light
//! element in f32, which is as exact as the measurements, so that a block of responses stays in vector registers while a
//! pattern is read once.

use serde::{Deserialize, Serialize};

use crate::linalg::{multiply_rows, vectorise};
use crate::recover::photometry::CalibratedMeasurements;
use crate::transport::{Basis, Geometry, LightElement};

/// Responses computed together at least: two vector registers of f32 on the narrowest machine of note.
const RESPONSE_BLOCK: usize = 8;

/// An orthonormal basis of functions on the window, and the mean light transport function.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct LearnedBasis {
    pub functions: Basis,
    /// `[element, stride]`: basis functions, the mean function, zeros.
    interleaved: Vec<f32>,
    stride: usize,
}

impl LearnedBasis {
    /// `functions` are `[r, element]`; `mean` is the mean light transport function, `[element]`.
    pub fn new(functions: &[f64], mean: &[f64]) -> Self {
        let area = mean.len();
        let rank = functions.len() / area;
        let stride = (rank + 1).next_multiple_of(RESPONSE_BLOCK);
        let mut interleaved = vec![0.0; area * stride];
        for (s, values) in interleaved.chunks_exact_mut(stride).enumerate() {
            for k in 0..rank {
                values[k] = functions[k * area + s] as f32;
            }
            values[rank] = mean[s] as f32;
        }
        let functions = functions.chunks_exact(area);
        let kernels = functions.map(|v| v.iter().map(|&v| v as f32).collect());
        Self {
            functions: Basis {
                kernels: kernels.collect(),
            },
            interleaved,
            stride,
        }
    }

    pub fn rank(&self) -> usize {
        self.functions.rank()
    }

    /// The responses to every pattern, in the colour of channel `plane`, of the window at `origin`.
    pub fn respond(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        geometry: &Geometry,
        origin: LightElement,
        plane: usize,
    ) -> PatternResponses {
        let side = geometry.window.side() as usize;
        let width = geometry.light.width as usize;
        let clipped = geometry.clip_window(origin);
        let (columns, rows, [u, v]) = (&clipped.columns, &clipped.rows, clipped.first());
        let mut responses = vec![0.0; measurements.patterns.len() * self.stride];
        let mut emission = vec![0.0f32; clipped.area()];
        let mut functions = Vec::with_capacity(emission.len() * self.stride);
        for row in rows.clone() {
            let first = (row * side + columns.start) * self.stride;
            functions
                .extend_from_slice(&self.interleaved[first..first + columns.len() * self.stride]);
        }
        let of_patterns = responses.chunks_exact_mut(self.stride);
        for (pattern, responses) in measurements.patterns.iter().zip(of_patterns) {
            let pattern = pattern.plane(plane);
            let emission_rows = emission.chunks_exact_mut(columns.len().max(1));
            for (row, emission) in emission_rows.enumerate() {
                let first = (v + row) * width + u;
                emission.copy_from_slice(&pattern[first..first + columns.len()]);
            }
            vectorise(
                #[cfg_attr(target_arch = "x86_64", inline(always))]
                || multiply_rows(&emission, &functions, responses),
            );
        }
        PatternResponses {
            has_full_window: clipped.area() == side * side,
            responses,
            stride: self.stride,
            rank: self.rank(),
        }
    }
}

/// Responses of the basis on one window to every pattern.
#[derive(Debug)]
pub(super) struct PatternResponses {
    /// `[pattern, stride]`: the basis functions' responses, the mean function's, zeros.
    responses: Vec<f32>,
    stride: usize,
    /// Number of basis functions.
    pub rank: usize,
    /// Whether all of the window is inside the light plane.
    pub has_full_window: bool,
}

impl PatternResponses {
    /// Responses of the basis functions to pattern `l`, `[r]`.
    pub fn row(&self, l: usize) -> &[f32] {
        &self.responses[l * self.stride..l * self.stride + self.rank]
    }

    /// Response of the mean light transport function to pattern `l`.
    pub fn mean(&self, l: usize) -> f64 {
        f64::from(self.responses[l * self.stride + self.rank])
    }
}
