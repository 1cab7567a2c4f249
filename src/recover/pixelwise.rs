//! Recovery window by window, each on its own: what the paper does.

use std::collections::BTreeMap;
use std::ops::Range;

use super::bpdn::{Constraint, Homotopy, InteriorPoint, SparsityBasis, Tolerance};
use super::gram_cache::{Design, Patch};
use super::holdout::HoldoutSplit;
use super::sampling::pixels_by_window;
use super::{CommonMode, MIN_PATTERNS, Nnls, RecoverError};
use crate::capture::{Measurements, Pattern};
use crate::executor::Executor;
use crate::transport::{
    CHANNELS, CameraPx, Decibels, Element, Geometry, TileRect, TransportError, TransportFunctions,
    Window,
};

/// Windows the choice is made on, spread over the picture, and pixels of each: enough that they tell
/// candidates apart by hundredths of a decibel, few enough to cost seconds.
#[derive(Clone, Copy, Debug)]
struct Sample {
    windows: usize,
    pixels: usize,
}

/// For least squares every pixel costs as much as the next, so that all may be far apart.
const SCATTERED: Sample = Sample {
    windows: 48,
    pixels: 1,
};
/// Denoising takes longer, for seven candidates: fewer windows, some pixels sharing the equations
/// of each.
const GATHERED: Sample = Sample {
    windows: 16,
    pixels: 4,
};

/// Windows whose origins fall in the same square of this side share their pattern correlations: a
/// default tile's at two camera pixels an element.
const BLOCK: i32 = 16;

/// Squared residual above what is allowed, as a share of the measurements', at which a path of
/// solutions has gone astray.
const LOST: f64 = 1e-6;

/// What is solved for each pixel and channel of a window.
#[derive(Clone, Copy, Debug)]
enum Problem {
    LeastSquares,
    Denoising(SparsityBasis, Tolerance),
}

/// A solver of single windows, with what it chose on patterns held out.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelwiseRecovery {
    geometry: Geometry,
    common_mode: CommonMode,
    problem: Problem,
}

/// A pixel of a window, with its number among the caller's.
type Numbered = (usize, CameraPx);

/// What a pixel and channel saw under the patterns of a design.
struct Seen {
    pixel: usize,
    channel: usize,
    y: Vec<f64>,
}

impl PixelwiseRecovery {
    /// About the most memory that recovering a tile takes beside its functions, in bytes.
    pub fn tile_bytes(window: Window, patterns: usize) -> usize {
        // What solvers keep of the Gram matrix's size, and of the equations'.
        let solver = 4 * window.area().pow(2) + 2 * window.area() * patterns;
        Patch::bytes(window, BLOCK as usize, patterns) + solver * size_of::<f64>()
    }

    /// Non-negative least squares: chooses how far the common mode is trusted.
    pub fn least_squares(
        measurements: &Measurements,
        geometry: Geometry,
        split: &HoldoutSplit,
        executor: &impl Executor,
    ) -> Result<Self, RecoverError> {
        executor.check_cancelled()?;
        let trial = HeldOut::new(measurements, geometry, split, SCATTERED)?;
        Ok(trial.choose(
            CommonMode::CANDIDATES.map(|common_mode| Self {
                geometry,
                common_mode,
                problem: Problem::LeastSquares,
            }),
            executor,
        ))
    }

    /// Basis pursuit denoising: chooses, as well, how near to the measurements to stay.
    pub fn denoising(
        measurements: &Measurements,
        geometry: Geometry,
        basis: SparsityBasis,
        split: &HoldoutSplit,
        executor: &impl Executor,
    ) -> Result<Self, RecoverError> {
        let least_squares = Self::least_squares(measurements, geometry, split, executor)?;
        let noise =
            HeldOut::new(measurements, geometry, split, SCATTERED)?.noise(&least_squares, executor);
        executor.check_cancelled()?;
        let trial = HeldOut::new(measurements, geometry, split, GATHERED)?;
        Ok(trial.choose(
            Tolerance::CANDIDATE_SHARES.map(|share| Self {
                problem: Problem::Denoising(basis, Tolerance { share, ..noise }),
                ..least_squares
            }),
            executor,
        ))
    }

    /// The weight chosen for the common mode.
    pub fn common_mode(&self) -> CommonMode {
        self.common_mode
    }

    /// Recovers the light transport functions of one tile.
    pub fn tile(&self, measurements: &Measurements, rect: TileRect) -> TransportFunctions {
        let rows: Vec<usize> = (0..measurements.patterns.len()).collect();
        self.tile_from(measurements, &rows, rect)
    }

    /// Recovers one tile from the patterns numbered `rows`.
    pub fn tile_from(
        &self,
        measurements: &Measurements,
        rows: &[usize],
        rect: TileRect,
    ) -> TransportFunctions {
        let area = self.geometry.window.area();
        let mut functions = TransportFunctions::zeros(rect, area);
        let mut blocks: BTreeMap<_, BTreeMap<_, _>> = BTreeMap::new();
        for (origin, pixels) in pixels_by_window(&self.geometry, rect) {
            let block = (origin.v.div_euclid(BLOCK), origin.u.div_euclid(BLOCK));
            blocks.entry(block).or_default().insert(origin, pixels);
        }
        for windows in blocks.values() {
            self.block(measurements, windows, rows, |_, pixel, c, slots, x| {
                for (&slot, &x) in slots.iter().zip(x) {
                    functions.tau[pixel * area + slot][c] = x as f32;
                }
            });
        }
        functions
    }

    /// Solves for all pixels of neighbouring windows from the patterns numbered `rows`; `take` gets
    /// each one's window, pixel number, channel, and solution on the window slots.
    fn block(
        &self,
        measurements: &Measurements,
        windows: &BTreeMap<Element, Vec<Numbered>>,
        rows: &[usize],
        mut take: impl FnMut(Element, usize, usize, &[usize], &[f64]),
    ) {
        let Some(mut corners) = windows.keys().next().map(|&first| [first, first]) else {
            return;
        };
        for origin in windows.keys() {
            corners[0].u = corners[0].u.min(origin.u);
            corners[1].u = corners[1].u.max(origin.u);
            corners[1].v = corners[1].v.max(origin.v);
        }
        let weights = measurements.weights();
        // Grey patterns drive all channels alike: one set of equations for all of them.
        for (plane, channels) in measurements.planes() {
            let patch = Patch::new(
                (&measurements.patterns, &weights),
                rows,
                plane,
                self.geometry.light,
                self.geometry.window,
                corners,
                windows.len(),
            );
            for (&origin, pixels) in windows {
                self.window(
                    measurements,
                    &patch,
                    origin,
                    (pixels, channels.clone()),
                    rows,
                    |pixel, c, slots, x| take(origin, pixel, c, slots, x),
                );
            }
        }
    }

    /// Solves for the pixels and channels of one window.
    fn window(
        &self,
        measurements: &Measurements,
        patch: &Patch,
        origin: Element,
        (pixels, channels): (&[Numbered], Range<usize>),
        rows: &[usize],
        mut take: impl FnMut(usize, usize, &[usize], &[f64]),
    ) {
        let mut whole = Vec::with_capacity(pixels.len() * channels.len());
        for &(pixel, at) in pixels {
            for channel in channels.clone() {
                let mut y: Vec<f64> = rows
                    .iter()
                    .map(|&l| measurements.sample(l, at, channel))
                    .collect();
                let saturated: Vec<usize> = (0..y.len()).filter(|&i| !y[i].is_finite()).collect();
                if !saturated.is_empty() && rows.len() - saturated.len() >= MIN_PATTERNS {
                    // Saturated samples drop out, and with them the shared equations.
                    y.retain(|y| y.is_finite());
                    let own = patch.design(origin, self.common_mode, &saturated);
                    self.solve(&own, vec![Seen { pixel, channel, y }], |pixel, c, x| {
                        take(pixel, c, &own.slots, x)
                    });
                    continue;
                }
                // Of a pixel saturated nearly always, all that is known is that it is at least
                // white: it is shown so, not black.
                for i in saturated {
                    y[i] = f64::from(measurements.full_scale[rows[i]]);
                }
                whole.push(Seen { pixel, channel, y });
            }
        }
        if !whole.is_empty() {
            let shared = patch.design(origin, self.common_mode, &[]);
            self.solve(&shared, whole, |pixel, c, x| {
                take(pixel, c, &shared.slots, x);
            });
        }
    }

    /// Solves for all that was seen through one design; `take` gets pixel, channel and solution.
    fn solve(&self, design: &Design, seen: Vec<Seen>, mut take: impl FnMut(usize, usize, &[f64])) {
        let mut nnls = Nnls::new(&design.gram, design.unknowns());
        match self.problem {
            Problem::LeastSquares => {
                for Seen { pixel, channel, y } in seen {
                    let h = design.right_hand_side(&design.weigh(y));
                    take(pixel, channel, &nnls.solve(&h));
                }
            }
            Problem::Denoising(SparsityBasis::Identity, tolerance) => {
                let mut homotopy = Homotopy::new(&design.gram, design.unknowns());
                for Seen { pixel, channel, y } in seen {
                    let epsilon = tolerance.epsilon(y.len(), mean(&y));
                    let y = design.weigh(y);
                    let energy: f64 = y.iter().map(|y| y * y).sum();
                    let h = design.right_hand_side(&y);
                    let mut x = homotopy.solve(&h, energy, epsilon);
                    // With no more patterns than elements on the path its equations may be singular
                    // to rounding, and the path lost.
                    let residual = design.squared_residual(&y, &x);
                    if residual.is_nan() || residual > epsilon * epsilon + LOST * energy {
                        x = nnls.solve(&h);
                    }
                    take(pixel, channel, &x);
                }
            }
            Problem::Denoising(basis, tolerance) => {
                let denoiser = InteriorPoint::new(
                    basis,
                    &design.weighted(),
                    design.rows(),
                    &design.slots,
                    self.geometry.window.side() as usize,
                );
                let prepared: Vec<_> = seen
                    .into_iter()
                    .map(|Seen { pixel, channel, y }| {
                        let epsilon = tolerance.epsilon(y.len(), mean(&y));
                        let y = design.weigh(y);
                        let least_squares = nnls.solve(&design.right_hand_side(&y));
                        (pixel, channel, y, epsilon, least_squares)
                    })
                    .collect();
                let constraints: Vec<_> = prepared
                    .iter()
                    .map(|(_, _, y, epsilon, least_squares)| Constraint {
                        y,
                        epsilon: *epsilon,
                        least_squares,
                    })
                    .collect();
                let solutions = denoiser.solve(&constraints);
                for ((pixel, channel, ..), solution) in prepared.iter().zip(&solutions) {
                    take(*pixel, *channel, &solution.x);
                }
            }
        }
    }
}

/// What is missed, `[pixel, held, channel]`, in predicting the patterns numbered `held` by a tile's
/// functions; NaN where saturated.
pub(super) fn held_out_residuals(
    geometry: &Geometry,
    measurements: &Measurements,
    held: &[usize],
    functions: &TransportFunctions,
) -> Vec<f64> {
    let patterns = held.iter().map(|&l| &measurements.patterns[l]);
    let mut misses = predictions(geometry, patterns, functions);
    let of_pixels = misses.chunks_exact_mut(held.len() * CHANNELS);
    for (pixel, misses) in functions.rect.pixels().zip(of_pixels) {
        for (misses, &l) in misses.chunks_exact_mut(CHANNELS).zip(held) {
            for (c, miss) in misses.iter_mut().enumerate() {
                *miss = measurements.sample(l, pixel, c) - *miss;
            }
        }
    }
    misses
}

/// What a tile's functions make of patterns, `[pixel, pattern, channel]`.
pub(super) fn predictions<'a>(
    geometry: &Geometry,
    patterns: impl IntoIterator<Item = &'a Pattern, IntoIter: Clone>,
    functions: &TransportFunctions,
) -> Vec<f64> {
    let (area, rect) = (geometry.window.area(), functions.rect);
    let patterns = patterns.into_iter();
    let mut predictions = Vec::new();
    for (pixel, tau) in rect.pixels().zip(functions.tau.chunks_exact(area)) {
        let origin = geometry.window_origin(pixel);
        for pattern in patterns.clone() {
            let mut y = [0.0; CHANNELS];
            for (slot, tau) in tau.iter().enumerate() {
                let element = geometry.window.element(origin, slot);
                if let Some(m) = element.index_in(geometry.light) {
                    for c in 0..CHANNELS {
                        y[c] += f64::from(pattern.plane(c)[m] * tau[c]);
                    }
                }
            }
            predictions.extend(y);
        }
    }
    predictions
}

/// The mean of measurements and their noise variance, from what least squares leaves of them, where
/// it leaves them degrees of freedom.
fn mean_and_noise(design: &Design, y: Vec<f64>) -> Option<(f64, f64)> {
    let (mean, y) = (mean(&y), design.weigh(y));
    let mut nnls = Nnls::new(&design.gram, design.unknowns());
    let x = nnls.solve(&design.right_hand_side(&y));
    let spare = design.rows() as f64 - nnls.degrees_of_freedom() as f64;
    (spare >= 1.0).then(|| (mean, design.squared_residual(&y, &x) / spare))
}

fn mean(y: &[f64]) -> f64 {
    y.iter().sum::<f64>() / y.len().max(1) as f64
}

/// A spread of windows with some of their pixels, and the patterns to choose settings by.
struct HeldOut<'a> {
    measurements: &'a Measurements,
    geometry: Geometry,
    windows: Vec<(Element, Vec<CameraPx>)>,
    split: &'a HoldoutSplit,
}

impl<'a> HeldOut<'a> {
    fn new(
        measurements: &'a Measurements,
        geometry: Geometry,
        split: &'a HoldoutSplit,
        sample: Sample,
    ) -> Result<Self, RecoverError> {
        let mut lit: BTreeMap<_, Vec<_>> = BTreeMap::new();
        let covered = geometry.tiles().filter(|&tile| measurements.covers(tile));
        for rect in covered {
            for (origin, pixels) in pixels_by_window(&geometry, rect) {
                if geometry.reaches_display(origin) {
                    let pixels = pixels.into_iter().take(sample.pixels);
                    lit.insert(origin, pixels.map(|(_, pixel)| pixel).collect());
                }
            }
        }
        if lit.is_empty() {
            return Err(RecoverError::CorrespondenceOffLightPlane);
        }
        let every = lit.len().div_ceil(sample.windows);
        Ok(Self {
            measurements,
            geometry,
            windows: lit.into_iter().step_by(every).collect(),
            split,
        })
    }

    /// Of `candidates` the one that predicts the patterns held out best, or the first where none
    /// can be.
    fn choose<const N: usize>(
        &self,
        candidates: [PixelwiseRecovery; N],
        executor: &impl Executor,
    ) -> PixelwiseRecovery {
        let mut chosen = candidates[0];
        if self.split.held_out.is_empty() {
            return chosen;
        }
        let errors = executor.map(self.windows.len(), |i| {
            candidates.map(|candidate| self.error(&candidate, &self.windows[i]))
        });
        let mut best: Option<Decibels> = None;
        for (n, candidate) in candidates.into_iter().enumerate() {
            let mut error = TransportError::default();
            errors.iter().for_each(|errors| error.merge(errors[n]));
            if let Some(snr) = error.snr()
                && best.is_none_or(|most| snr > most)
            {
                (best, chosen) = (Some(snr), candidate);
            }
        }
        chosen
    }

    /// Of what a candidate says that one window's pixels see under the patterns held out.
    fn error(
        &self,
        candidate: &PixelwiseRecovery,
        (origin, pixels): &(Element, Vec<CameraPx>),
    ) -> TransportError {
        let mut error = TransportError::default();
        let numbered = pixels.iter().copied().enumerate().collect();
        let window = BTreeMap::from([(*origin, numbered)]);
        candidate.block(
            self.measurements,
            &window,
            &self.split.training,
            |_, pixel, c, slots, x| {
                for &l in &self.split.held_out {
                    let y = self.measurements.sample(l, pixels[pixel], c);
                    if y.is_finite() {
                        error.add(y, self.predict(l, c, *origin, slots, x));
                    }
                }
            },
        );
        error
    }

    /// What solution `x` says a pixel of the window sees under pattern `l`.
    fn predict(&self, l: usize, c: usize, origin: Element, slots: &[usize], x: &[f64]) -> f64 {
        let plane = self.measurements.patterns[l].plane(c);
        let terms = slots.iter().zip(x).filter_map(|(&slot, &x)| {
            let element = self.geometry.window.element(origin, slot);
            let m = element.index_in(self.geometry.light)?;
            Some(f64::from(plane[m]) * x)
        });
        terms.sum()
    }

    /// The noise of the measurements, from what least squares leaves of them, degrees of freedom
    /// allowed for.
    fn noise(&self, least_squares: &PixelwiseRecovery, executor: &impl Executor) -> Tolerance {
        let rows: Vec<usize> = (0..self.measurements.patterns.len()).collect();
        let weights = self.measurements.weights();
        let pairs = executor.map(self.windows.len(), |i| {
            let (origin, pixel) = (self.windows[i].0, self.windows[i].1[0]);
            let patch = |c| {
                Patch::new(
                    (&self.measurements.patterns, &weights),
                    &rows,
                    c,
                    self.geometry.light,
                    self.geometry.window,
                    [origin, origin],
                    1,
                )
            };
            let mut pairs = Vec::new();
            for channel in 0..CHANNELS {
                let mut y: Vec<f64> = rows
                    .iter()
                    .map(|&l| self.measurements.sample(l, pixel, channel))
                    .collect();
                let saturated: Vec<usize> = (0..y.len()).filter(|&i| !y[i].is_finite()).collect();
                y.retain(|y| y.is_finite());
                if y.len() >= MIN_PATTERNS {
                    let design =
                        patch(channel).design(origin, least_squares.common_mode, &saturated);
                    pairs.extend(mean_and_noise(&design, y));
                }
            }
            pairs
        });
        Tolerance::fit(&pairs.concat())
    }
}
