//! What a photograph that does not belong most looks like.
//!
//! Its measurements are fitted by regression on what they could be: the prediction for its own pattern, the photograph of
//! another pattern, both together, or the brightness of the object alone.

use serde::{Deserialize, Serialize};

use super::equations::{for_largest_window, predict};
use super::window_covariance::WindowModel;
use crate::job_executor::{Cancelled, Executor, PARTS, share_of_jobs};
use crate::linalg::{self, add_scaled, median};
use crate::recover::holdout_split::pattern_ids;
use crate::recover::preparation_input::RecoveryPreparationInput;
use crate::transport::TileRect;

/// Unexplained share of what brightness alone leaves unexplained, up to which a regression explains a photograph.
const MAX_UNEXPLAINED_SHARE: f64 = 0.2;
/// Shares of a blend's smaller part.
const MIN_BLEND_SHARE: f64 = 0.08;
/// Share of a photograph that brightness alone explains, relative to that of the others, below which it shows another
/// object.
const MIN_BRIGHTNESS_SHARE: f64 = 0.8;
/// Regressors before the photographs': a constant, and the object's brightness.
const CONSTANT: usize = 0;
const BRIGHTNESS: usize = 1;
const FIRST_PHOTOGRAPH: usize = 2;

/// Name in reports of photographs from another place.
pub const MOVED_CODE: &str = "photograph-moved";

/// Why a photograph does not belong to its capture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum PhotographFault {
    /// It shows the pattern of another photograph.
    PatternOf {
        /// The other photograph's index in the measurements.
        other: usize,
    },
    /// It was taken while the screen changed between two patterns.
    Blend {
        /// Index of the photograph with the other pattern.
        other: usize,
        /// The other pattern's share of the light.
        share: f64,
    },
    /// It shows a pattern that no photograph is listed with.
    UnknownPattern,
    /// It shows something else.
    OtherObject,
    /// The camera or the object had moved.
    Moved {
        /// The picture's shift in camera pixels, to the right and down. Shifts above 0.75 pixels are underestimated.
        shift: [f64; 2],
    },
    /// It shows its pattern and object, but not as the others do: blurred, or covered in part.
    Distorted,
}

impl PhotographFault {
    /// Whether the camera or the object had moved.
    pub fn is_moved(self) -> bool {
        matches!(self, Self::Moved { .. })
    }

    /// The fault's name in reports.
    pub fn code(self) -> &'static str {
        match self {
            Self::PatternOf { .. } => "photograph-pattern",
            Self::Blend { .. } => "photograph-blend",
            Self::UnknownPattern => "photograph-unknown-pattern",
            Self::OtherObject => "photograph-object",
            Self::Moved { .. } => MOVED_CODE,
            Self::Distorted => "photograph-distorted",
        }
    }
}

/// Classifies the photographs `outliers` of `preparation` by the photographs `used`.
///
/// # Errors
/// [`Cancelled`].
pub(super) async fn classify(
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
    mean_function: &[f64],
    squares: &[TileRect],
    used: &[usize],
    outliers: &[usize],
) -> Result<Vec<(usize, PhotographFault)>, Cancelled> {
    if outliers.is_empty() {
        return Ok(Vec::new());
    }
    let patterns = &preparation.measurements.patterns;
    let (count, ids) = (patterns.len(), pattern_ids(patterns));
    let left_out: Vec<usize> = (0..count).filter(|l| !used.contains(l)).collect();
    let size = FIRST_PHOTOGRAPH + count + outliers.len();
    let sum_part = |part: usize| {
        let mut moments = vec![0.0; size * size];
        for square in &squares[share_of_jobs(squares.len(), part, PARTS)] {
            let lists = [used, &left_out, outliers];
            add_square(&mut moments, preparation, mean_function, *square, lists);
        }
        moments
    };
    let parts = preparation.executor.all_gather(PARTS, sum_part).await?;
    let mut moments = Moments {
        size,
        sums: vec![0.0; size * size],
    };
    parts
        .iter()
        .for_each(|part| add_scaled(&mut moments.sums, 1.0, part));
    let brightness_share =
        |i: usize| 1.0 - moments.unexplained(i, &[BRIGHTNESS]) / moments.energy(i);
    let shares = used.iter().map(|&l| brightness_share(FIRST_PHOTOGRAPH + l));
    let typical_share = median(&shares.collect::<Vec<f64>>());
    let fault = |(i, &l): (usize, &usize)| {
        let target = FIRST_PHOTOGRAPH + count + i;
        let own = FIRST_PHOTOGRAPH + l;
        // Of other patterns, not of other exposures.
        let others = (0..count).filter(|&other| ids[other] != ids[l]);
        let best = |regressors: &dyn Fn(usize) -> Vec<usize>| {
            let errors = others.clone().map(|other| {
                let unexplained =
                    moments.unexplained(target, &regressors(FIRST_PHOTOGRAPH + other));
                (unexplained, other)
            });
            errors.fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a })
        };
        let limit = MAX_UNEXPLAINED_SHARE * moments.unexplained(target, &[CONSTANT, BRIGHTNESS]);
        let alone = moments.unexplained(target, &[CONSTANT, own]);
        let (error, other) = best(&|other| vec![CONSTANT, other]);
        if error < limit.min(alone) {
            return (l, PhotographFault::PatternOf { other });
        }
        let (error, other) = best(&|other| vec![CONSTANT, own, other]);
        let regressors = [CONSTANT, own, FIRST_PHOTOGRAPH + other];
        let weights = moments.regress(target, &regressors);
        let share = weights[2] / (weights[1] + weights[2]);
        let is_blend = (MIN_BLEND_SHARE..=1.0 - MIN_BLEND_SHARE).contains(&share);
        if is_blend && error < MAX_UNEXPLAINED_SHARE * alone && error < limit {
            return (l, PhotographFault::Blend { other, share });
        }
        let fault = if brightness_share(target) < MIN_BRIGHTNESS_SHARE * typical_share {
            PhotographFault::OtherObject
        } else if alone < limit {
            PhotographFault::Distorted
        } else {
            PhotographFault::UnknownPattern
        };
        (l, fault)
    };
    Ok(outliers.iter().enumerate().map(fault).collect())
}

/// Adds the products of a square's regressors: a constant, brightness, each photograph (as measured if it is `used`, else as
/// predicted), and the outliers as measured.
fn add_square(
    moments: &mut [f64],
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
    mean_function: &[f64],
    square: TileRect,
    [used, left_out, outliers]: [&[usize]; 3],
) {
    let (measurements, geometry) = (preparation.measurements, &preparation.geometry);
    let count = measurements.patterns.len();
    for_largest_window(geometry, square, |origin, pixels| {
        for (plane, channels) in measurements.planes() {
            let model = |indices: &[usize]| {
                WindowModel::new(
                    measurements,
                    geometry,
                    mean_function,
                    origin,
                    plane,
                    indices,
                )
            };
            let others = model(left_out);
            let window = model(used).with_pixels(measurements, used, pixels, channels);
            let Some((window, pixels)) = window else {
                continue;
            };
            for scaled in &pixels {
                let measured = measurements.samples(outliers, scaled.pixel, scaled.channel);
                if measured.iter().any(|y| y.is_nan()) {
                    continue;
                }
                let mut regressors = vec![0.0; FIRST_PHOTOGRAPH + count];
                regressors[CONSTANT] = scaled.unit;
                regressors[BRIGHTNESS] = scaled.weight;
                for (&l, y) in used.iter().zip(&scaled.y) {
                    regressors[FIRST_PHOTOGRAPH + l] = *y;
                }
                for (&l, y) in left_out.iter().zip(predict(&window, &others, scaled)) {
                    regressors[FIRST_PHOTOGRAPH + l] = y;
                }
                regressors.extend(measured.iter().map(|y| scaled.unit * y));
                let rows = moments.chunks_exact_mut(regressors.len());
                for (row, factor) in rows.zip(&regressors) {
                    add_scaled(row, *factor, &regressors);
                }
            }
        }
    });
}

/// Sums of the products of regressors, `[size, size]`.
struct Moments {
    size: usize,
    sums: Vec<f64>,
}

impl Moments {
    fn get(&self, i: usize, j: usize) -> f64 {
        self.sums[i * self.size + j]
    }

    fn energy(&self, i: usize) -> f64 {
        self.get(i, i)
    }

    /// Least-squares weights of `regressors` for `target`.
    fn regress(&self, target: usize, regressors: &[usize]) -> Vec<f64> {
        let n = regressors.len();
        let gram: Vec<f64> = regressors
            .iter()
            .flat_map(|&i| regressors.iter().map(move |&j| self.get(i, j)))
            .collect();
        let mut weights: Vec<f64> = regressors.iter().map(|&i| self.get(i, target)).collect();
        let trace: f64 = (0..n).map(|i| gram[i * n + i]).sum();
        match linalg::cholesky_with_ridge(&gram, n, 1e-12 * trace) {
            Some((u, _)) => linalg::cholesky_solve(&u, &mut weights),
            None => weights.fill(0.0),
        }
        weights
    }

    /// The part of `target`'s energy that `regressors` do not explain.
    fn unexplained(&self, target: usize, regressors: &[usize]) -> f64 {
        let weights = self.regress(target, regressors);
        let explained = regressors.iter().zip(&weights);
        let explained: f64 = explained.map(|(&i, w)| w * self.get(i, target)).sum();
        self.energy(target) - explained
    }
}
