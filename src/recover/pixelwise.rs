//! The paper's recovery: each camera pixel and channel by itself (section 3).
//!
//! Case (a) is non-negative least squares, `min ‖W(y − P̂τ)‖` over `τ ≥ 0`; case (b) is basis pursuit denoising,
//! `min ‖φᵀτ‖₁` subject to `‖W(y − P̂τ)‖ ≤ ε`, `τ ≥ 0`. `P̂` `[L, k]` are the patterns on the k elements of the pixel's
//! window. All pixels and channels of a window that the same patterns do not saturate share their equations
//! ([`super::gram_cache`]).

use serde::{Deserialize, Serialize};

use super::bpdn::{
    BpdnConstraint, Homotopy, ResidualTolerance, SensingOperator, SparsityBasis, interior_point,
};
use super::common_mode_weight::CommonModeWeight;
use super::gram_cache::{GramCache, WindowEquations};
use super::nnls::Nnls;
use super::sampling::{self, Group};
use crate::recover::photometry::CalibratedMeasurements;
use crate::transport::{
    CameraPixel, Geometry, LightElement, TileRect, TileTransportFunctions, Window,
};

/// Side, in light elements, of the squares of window origins that share a [`GramCache`]: a default tile has one, at two
/// camera pixels an element.
const CACHE_SIDE: i32 = 16;

/// Largest squared residual above ε², as a share of the measurements' energy, of a valid homotopy path.
const MAX_EXCESS_RESIDUAL: f64 = 1e-6;

/// The problem that is solved for each pixel and channel.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) enum PixelwiseMethod {
    /// Case (a).
    LeastSquares,
    /// Case (b).
    Denoising(SparsityBasis, ResidualTolerance),
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct PixelwiseRecovery {
    pub geometry: Geometry,
    pub common_mode: CommonModeWeight,
    pub problem: PixelwiseMethod,
}

/// Pixels that share a window, by its origin.
pub(super) type PixelsByWindow = Group<LightElement, (usize, CameraPixel)>;

/// The measurements of a pixel and channel, one for each pattern of its equations.
pub(super) struct PixelSamples {
    /// Position of the pixel in its region.
    pub index: usize,
    pub pixel: CameraPixel,
    pub channel: usize,
    pub y: Vec<f64>,
}

/// Receives the equations and the measurements of a pixel and channel, and the light transport function that solves
/// them, on the equations' slots.
type SolutionCallback<'a> = dyn FnMut(&WindowEquations, &PixelSamples, &[f64]) + 'a;

/// Solves a pixel's equations, given its weighted measurements, their right-hand side, and the measurements.
type PixelSolver<'a> = Box<dyn FnMut(&[f64], &[f64], &[f64]) -> Vec<f64> + 'a>;

impl PixelwiseRecovery {
    /// Upper bound on the memory that recovering a tile takes beside its functions, in bytes.
    pub fn max_tile_bytes(window: Window, patterns: usize) -> usize {
        // The solvers' matrices of the Gram matrix's size, and their copies of the equations.
        let solver = 4 * window.area().pow(2) + 2 * window.area() * patterns;
        GramCache::max_bytes(window, CACHE_SIDE as usize, patterns) + solver * size_of::<f64>()
    }

    /// Recovers a tile from the patterns `pattern_indices`.
    pub fn tile(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        pattern_indices: &[usize],
        rect: TileRect,
    ) -> TileTransportFunctions {
        let area = self.geometry.window.area();
        let mut functions = TileTransportFunctions::zeros(rect, area);
        let mut squares: Vec<Group<_, PixelsByWindow>> = Vec::new();
        for (origin, pixels) in sampling::pixels_by_window(&self.geometry, rect) {
            let square = [origin.v, origin.u].map(|at| at.div_euclid(CACHE_SIDE));
            sampling::add_to_group(&mut squares, square, (origin, pixels));
        }
        for (_, windows) in &squares {
            let mut store = |equations: &WindowEquations, samples: &PixelSamples, x: &[f64]| {
                for (&slot, &x) in equations.slots.iter().zip(x) {
                    functions.tau[samples.index * area + slot][samples.channel] = x as f32;
                }
            };
            self.solve_windows(measurements, windows, pattern_indices, &mut store);
        }
        functions
    }

    /// Solves for the pixels of neighbouring windows from the patterns `pattern_indices`.
    pub fn solve_windows(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        windows: &[PixelsByWindow],
        pattern_indices: &[usize],
        on_solution: &mut SolutionCallback<'_>,
    ) {
        let origins: Vec<LightElement> = windows.iter().map(|window| window.0).collect();
        // Grey patterns drive all channels alike: one set of equations for all of them.
        for (plane, channels) in measurements.planes() {
            let geometry = &self.geometry;
            let cache = GramCache::new(measurements, geometry, pattern_indices, plane, &origins);
            for (origin, pixels) in windows {
                let mut samples_by_patterns = Vec::new();
                for &(index, pixel) in pixels {
                    for channel in channels.clone() {
                        let (usable, y) =
                            sampling::usable_samples(measurements, pattern_indices, pixel, channel);
                        let samples = PixelSamples {
                            index,
                            pixel,
                            channel,
                            y,
                        };
                        sampling::add_to_group(&mut samples_by_patterns, usable, samples);
                    }
                }
                for (usable, samples) in &samples_by_patterns {
                    let equations = cache.equations(*origin, self.common_mode, usable);
                    self.solve(&equations, samples, on_solution);
                }
            }
        }
    }

    /// Solves the equations of one window for all `samples`.
    fn solve(
        &self,
        equations: &WindowEquations,
        samples: &[PixelSamples],
        on_solution: &mut SolutionCallback<'_>,
    ) {
        let unknowns = equations.slots.len();
        let mut nnls = Nnls::new(&equations.gram, unknowns);
        let mut solve: PixelSolver<'_> = match self.problem {
            PixelwiseMethod::LeastSquares => Box::new(move |_, h, _| nnls.solve(h)),
            PixelwiseMethod::Denoising(SparsityBasis::Identity, tolerance) => {
                let mut homotopy = Homotopy::new(&equations.gram, unknowns);
                Box::new(move |weighted_y, h, y| {
                    let epsilon = tolerance.epsilon(y);
                    let energy: f64 = weighted_y.iter().map(|y| y * y).sum();
                    let x = homotopy.solve(h, energy, epsilon);
                    // With no more patterns than elements on the path its equations may be singular to rounding, and
                    // the path leads elsewhere.
                    let residual = equations.columns.squared_residual(weighted_y, &x);
                    let max_residual = epsilon * epsilon + MAX_EXCESS_RESIDUAL * energy;
                    match residual <= max_residual {
                        true => x,
                        false => nnls.solve(h),
                    }
                })
            }
            PixelwiseMethod::Denoising(basis, tolerance) => {
                let side = self.geometry.window.side() as usize;
                let operator = SensingOperator::new(basis, equations, side);
                Box::new(move |weighted_y, h, y| {
                    let constraint = BpdnConstraint {
                        y: weighted_y,
                        epsilon: tolerance.epsilon(y),
                        least_squares: &nnls.solve(h),
                    };
                    interior_point::solve(&operator, &constraint).x
                })
            }
        };
        for samples in samples {
            let weighted_y = equations.weight(&samples.y);
            let h = equations.right_hand_side(&weighted_y);
            on_solution(equations, samples, &solve(&weighted_y, &h, &samples.y));
        }
    }
}
