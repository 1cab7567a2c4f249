//! The prior of one pixel on its own, learned by expectation–maximisation.

use super::equations::{Equations, PHASES};
use super::posterior::{Gaussian, Workspace};
use crate::executor::Executor;
use crate::linalg::{self, add_scaled, vectorise};
use crate::transport::CHANNELS;

/// Coefficients of light transport functions, scaled by the pixel's brightness, as Gaussian: a mean
/// for each sub-element position class, one covariance.
#[derive(Clone, Debug)]
pub(super) struct Prior {
    pub rank: usize,
    /// `[PHASES][r]`.
    pub mean: Vec<Vec<f64>>,
    /// `[r, r]`.
    pub covariance: Vec<f64>,
    pub gaussian: Gaussian,
    /// Variance of measurements against what was estimated for them: takes up what the kernels
    /// cannot show.
    pub noise: f64,
}

/// Who may be learned from: brightness below which a channel of a pixel is left out, by channel.
pub(super) type Threshold = [f64; CHANNELS];

/// Brightness against noise below which nothing can be learned from a pixel.
const LEAST_CONTRAST: f64 = 4.0;

/// Whether `member` is bright enough to learn from.
pub(super) fn bright(equations: &Equations, member: usize, threshold: &Threshold) -> bool {
    let of = &equations.members[member];
    of.rows > 0 && of.scale > threshold[member % CHANNELS] && of.contrast() > LEAST_CONTRAST
}

/// What a round of expectation gathers.
#[derive(Debug)]
struct Expected {
    count: [f64; PHASES],
    /// Posterior means, summed by class.
    sum: Vec<Vec<f64>>,
    /// `Σ zzᵀ + P`, upper triangle.
    moment: Vec<f64>,
    residual: f64,
    rows: f64,
}

impl Prior {
    /// A prior of equal means, from a covariance `[r, r]`.
    pub fn new(mean: &[f64], covariance: Vec<f64>) -> Self {
        let rank = mean.len();
        Self {
            rank,
            mean: vec![mean.to_vec(); PHASES],
            gaussian: Gaussian::new(&covariance, rank),
            covariance,
            noise: 1.0,
        }
    }

    /// One round of expectation–maximisation on all bright members of `patches`. The posterior
    /// covariance is part of the second moment: without it the prior shrinks from round to round.
    pub fn improve(
        &mut self,
        patches: &[Equations],
        threshold: &Threshold,
        executor: &impl Executor,
    ) {
        let rank = self.rank;
        // Where much of a window lies off the display little is seen of its functions, and learning
        // from them is slow: they are left out where there are others enough.
        let whole = patches
            .iter()
            .flat_map(|p| &p.members)
            .filter(|m| m.whole)
            .count();
        let all: usize = patches.iter().map(|p| p.members.len()).sum();
        let only_whole = ENOUGH_WHOLE * whole >= all;
        let parts = executor.map(patches.len(), |i| {
            vectorise(
                #[inline(always)]
                || self.expect(&patches[i], threshold, only_whole),
            )
        });
        let mut total = Expected::new(rank);
        parts.iter().for_each(|part| total.add(part));
        let count: f64 = total.count.iter().sum();
        if count < 1.0 {
            return;
        }
        let pooled: Vec<f64> = (0..rank)
            .map(|k| total.sum.iter().map(|sum| sum[k]).sum::<f64>() / count)
            .collect();
        let mut covariance = total.moment;
        for (phase, sum) in total.sum.iter().enumerate() {
            let n = total.count[phase];
            // A class with few members leans on all the others.
            self.mean[phase] = (0..rank)
                .map(|k| (sum[k] + PULL * pooled[k]) / (n + PULL))
                .collect();
            let mean = &self.mean[phase];
            for i in 0..rank {
                for j in i..rank {
                    // Σ (z − m)(z − m)ᵀ = Σ zzᵀ − s mᵀ − m sᵀ + n m mᵀ
                    covariance[i * rank + j] +=
                        n * mean[i] * mean[j] - sum[i] * mean[j] - mean[i] * sum[j];
                }
            }
        }
        covariance.iter_mut().for_each(|c| *c /= count);
        linalg::mirror_upper(&mut covariance, rank);
        self.gaussian = Gaussian::new(&covariance, rank);
        self.covariance = covariance;
        self.noise = (total.residual / total.rows).max(LEAST_NOISE);
    }

    #[inline(always)]
    fn expect(&self, patch: &Equations, threshold: &Threshold, only_whole: bool) -> Expected {
        let rank = self.rank;
        let mut out = Expected::new(rank);
        let mut work = Workspace::new(rank);
        for member in (0..patch.members.len()).filter(|&m| bright(patch, m, threshold)) {
            let of = patch.members[member];
            if only_whole && !of.whole {
                continue;
            }
            work.infer(
                patch,
                member,
                self.noise,
                &self.gaussian,
                &self.mean[of.phase],
            );
            work.covariance();
            out.count[of.phase] += 1.0;
            add_scaled(&mut out.sum[of.phase], 1.0, &work.z);
            for i in 0..rank {
                let row = i * rank + i..(i + 1) * rank;
                let moment = &mut out.moment[row.clone()];
                add_scaled(moment, work.z[i], &work.z[i..]);
                add_scaled(moment, 1.0, &work.inverse[row]);
            }
            out.residual += work.residual(patch, member) / of.variance;
            out.rows += of.rows as f64;
        }
        out
    }
}

/// One in how many members must have its whole window on the display for the others to be left out.
const ENOUGH_WHOLE: usize = 4;
/// Members of the pooled mean that a class's mean starts from.
const PULL: f64 = 20.0;
/// Noise never comes out below this share of its estimate.
const LEAST_NOISE: f64 = 0.1;

impl Expected {
    fn new(rank: usize) -> Self {
        Self {
            count: [0.0; PHASES],
            sum: vec![vec![0.0; rank]; PHASES],
            moment: vec![0.0; rank * rank],
            residual: 0.0,
            rows: 0.0,
        }
    }

    fn add(&mut self, other: &Self) {
        for phase in 0..PHASES {
            self.count[phase] += other.count[phase];
            add_scaled(&mut self.sum[phase], 1.0, &other.sum[phase]);
        }
        add_scaled(&mut self.moment, 1.0, &other.moment);
        self.residual += other.residual;
        self.rows += other.rows;
    }
}
