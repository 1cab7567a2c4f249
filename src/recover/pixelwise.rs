//! The paper's recovery: each camera pixel and channel by itself (section 3).
//!
//! Case (a) is non-negative least squares, `min ‖W(y − P̂τ)‖` over `τ ≥ 0`; case (b) is basis pursuit denoising,
//! `min ‖φᵀτ‖₁` subject to `‖W(y − P̂τ)‖ ≤ ε`, `τ ≥ 0`. `P̂` `[L, k]` are the patterns on the k elements of the pixel's
//! window. All pixels and channels of a window share their equations ([`super::gram_cache`]), except those with
//! saturated measurements, which drop out.

use std::collections::BTreeMap;
use std::ops::Range;

use super::bpdn::{BpdnConstraint, Homotopy, InteriorPoint, SparsityBasis, Tolerance};
use super::common_mode::CommonMode;
use super::gram_cache::{GramCache, WindowEquations};
use super::nnls::Nnls;
use super::sampling::{self, MIN_PATTERNS, PixelsOfWindow};
use crate::capture::Measurements;
use crate::transport::{CameraPx, Element, Geometry, TileRect, TransportFunctions, Window};

/// Side, in light elements, of the squares of window origins that share a [`GramCache`]: a default tile has one, at two
/// camera pixels an element.
const CACHE_SIDE: i32 = 16;

/// Largest squared residual above ε², as a share of the measurements' energy, of a valid homotopy path.
const MAX_EXCESS_RESIDUAL: f64 = 1e-6;

/// The problem that is solved for each pixel and channel.
#[derive(Clone, Copy, Debug)]
pub(super) enum PixelProblem {
    /// Case (a).
    LeastSquares,
    /// Case (b).
    Denoising(SparsityBasis, Tolerance),
}

/// Recovers each pixel and channel by itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelwiseRecovery {
    pub geometry: Geometry,
    pub common_mode: CommonMode,
    pub problem: PixelProblem,
}

/// Receives the solution of a pixel and channel: the window's origin, the pixel's position in the region, the channel,
/// the window's slots on the light plane, and the light transport function on these.
type Solutions<'a> = dyn FnMut(Element, usize, usize, &[usize], &[f64]) + 'a;

/// The measurements of a pixel and channel, one for each pattern of its equations.
struct PixelSamples {
    pixel: usize,
    channel: usize,
    y: Vec<f64>,
}

impl PixelwiseRecovery {
    /// Upper bound on the memory that recovering a tile takes beside its functions, in bytes.
    pub fn max_tile_bytes(window: Window, patterns: usize) -> usize {
        // The solvers' matrices of the Gram matrix's size, and their copies of the equations.
        let solver = 4 * window.area().pow(2) + 2 * window.area() * patterns;
        GramCache::max_bytes(window, CACHE_SIDE as usize, patterns) + solver * size_of::<f64>()
    }

    /// Recovers a tile from all patterns.
    pub fn tile(&self, measurements: &Measurements, rect: TileRect) -> TransportFunctions {
        let all: Vec<usize> = (0..measurements.patterns.len()).collect();
        self.tile_from(measurements, &all, rect)
    }

    /// Recovers a tile from the patterns `pattern_indices`.
    pub fn tile_from(
        &self,
        measurements: &Measurements,
        pattern_indices: &[usize],
        rect: TileRect,
    ) -> TransportFunctions {
        let area = self.geometry.window.area();
        let mut functions = TransportFunctions::zeros(rect, area);
        let mut squares: BTreeMap<_, BTreeMap<_, _>> = BTreeMap::new();
        for (origin, pixels) in sampling::pixels_by_window(&self.geometry, rect) {
            let square = [origin.v, origin.u].map(|at| at.div_euclid(CACHE_SIDE));
            squares.entry(square).or_default().insert(origin, pixels);
        }
        for windows in squares.values() {
            let mut store = |_, pixel: usize, c: usize, slots: &[usize], x: &[f64]| {
                for (&slot, &x) in slots.iter().zip(x) {
                    functions.tau[pixel * area + slot][c] = x as f32;
                }
            };
            self.solve_windows(measurements, windows, pattern_indices, &mut store);
        }
        functions
    }

    /// Solves for the pixels of neighbouring windows from the patterns `pattern_indices`.
    pub fn solve_windows(
        &self,
        measurements: &Measurements,
        windows: &BTreeMap<Element, Vec<(usize, CameraPx)>>,
        pattern_indices: &[usize],
        solutions: &mut Solutions<'_>,
    ) {
        let Some(mut corners) = windows.keys().next().map(|&first| [first, first]) else {
            return;
        };
        for origin in windows.keys() {
            corners[0].u = corners[0].u.min(origin.u);
            corners[1].u = corners[1].u.max(origin.u);
            corners[1].v = corners[1].v.max(origin.v);
        }
        let weights = measurements.pattern_weights();
        // Grey patterns drive all channels alike: one set of equations for all of them.
        for (plane, channels) in measurements.planes() {
            let cache = GramCache::new(
                (&measurements.patterns, &weights),
                pattern_indices,
                plane,
                self.geometry.light,
                self.geometry.window,
                corners,
                windows.len(),
            );
            for (&origin, pixels) in windows {
                let samples = (&pixels[..], channels.clone(), pattern_indices);
                self.solve_window(measurements, &cache, origin, samples, solutions);
            }
        }
    }

    /// Solves for the pixels and channels of one window.
    fn solve_window(
        &self,
        measurements: &Measurements,
        cache: &GramCache,
        origin: Element,
        (pixels, channels, pattern_indices): (&PixelsOfWindow, Range<usize>, &[usize]),
        solutions: &mut Solutions<'_>,
    ) {
        let mut unsaturated = Vec::with_capacity(pixels.len() * channels.len());
        for &(pixel, at) in pixels {
            for channel in channels.clone() {
                let y = pattern_indices.iter();
                let mut y: Vec<f64> = y.map(|&l| measurements.sample(l, at, channel)).collect();
                let saturated: Vec<usize> = (0..y.len()).filter(|&i| !y[i].is_finite()).collect();
                if !saturated.is_empty() && y.len() - saturated.len() >= MIN_PATTERNS {
                    // Saturated samples drop out, and the pixel has equations of its own.
                    y.retain(|y| y.is_finite());
                    let equations = cache.equations(origin, self.common_mode, &saturated);
                    let samples = vec![PixelSamples { pixel, channel, y }];
                    self.solve(origin, &equations, samples, solutions);
                    continue;
                }
                // All that is known of a pixel that is nearly always saturated is a lower bound, white.
                for i in saturated {
                    y[i] = f64::from(measurements.full_scale[pattern_indices[i]]);
                }
                unsaturated.push(PixelSamples { pixel, channel, y });
            }
        }
        if !unsaturated.is_empty() {
            let equations = cache.equations(origin, self.common_mode, &[]);
            self.solve(origin, &equations, unsaturated, solutions);
        }
    }

    /// Solves the equations of one window for all `samples`.
    fn solve(
        &self,
        origin: Element,
        equations: &WindowEquations,
        samples: Vec<PixelSamples>,
        solutions: &mut Solutions<'_>,
    ) {
        let slots = &equations.slots[..];
        let mut nnls = Nnls::new(&equations.gram, slots.len());
        match self.problem {
            PixelProblem::LeastSquares => {
                for PixelSamples { pixel, channel, y } in samples {
                    let x = nnls.solve(&equations.right_hand_side(&equations.weight(y)));
                    solutions(origin, pixel, channel, slots, &x);
                }
            }
            PixelProblem::Denoising(SparsityBasis::Identity, tolerance) => {
                let mut homotopy = Homotopy::new(&equations.gram, slots.len());
                for PixelSamples { pixel, channel, y } in samples {
                    let epsilon = tolerance.epsilon(y.len(), mean(&y));
                    let y = equations.weight(y);
                    let energy: f64 = y.iter().map(|y| y * y).sum();
                    let h = equations.right_hand_side(&y);
                    let mut x = homotopy.solve(&h, energy, epsilon);
                    // With no more patterns than elements on the path its equations may be singular to rounding, and
                    // the path leads elsewhere.
                    let residual = equations.columns.squared_residual(&y, &x);
                    let max_residual = epsilon * epsilon + MAX_EXCESS_RESIDUAL * energy;
                    if residual.is_nan() || residual > max_residual {
                        x = nnls.solve(&h);
                    }
                    solutions(origin, pixel, channel, slots, &x);
                }
            }
            PixelProblem::Denoising(basis, tolerance) => {
                let solver = InteriorPoint::new(
                    basis,
                    &equations.columns.columns,
                    equations.columns.weights.len(),
                    slots,
                    self.geometry.window.side() as usize,
                );
                let prepared = samples.iter().map(|PixelSamples { y, .. }| {
                    let epsilon = tolerance.epsilon(y.len(), mean(y));
                    let y = equations.weight(y.clone());
                    let least_squares = nnls.solve(&equations.right_hand_side(&y));
                    (y, epsilon, least_squares)
                });
                let prepared: Vec<_> = prepared.collect();
                let constraints =
                    prepared
                        .iter()
                        .map(|(y, epsilon, least_squares)| BpdnConstraint {
                            y,
                            epsilon: *epsilon,
                            least_squares,
                        });
                let solved = solver.solve(&constraints.collect::<Vec<_>>());
                for (PixelSamples { pixel, channel, .. }, solution) in samples.iter().zip(&solved) {
                    solutions(origin, *pixel, *channel, slots, &solution.x);
                }
            }
        }
    }
}

/// The mean of measurements; 0 of none.
pub(super) fn mean(y: &[f64]) -> f64 {
    y.iter().sum::<f64>() / y.len().max(1) as f64
}
