//! The prior of one pixel given its neighbours.
//!
//! Neighbouring pixels look through the same pane of glass or at the same clay: what their own
//! measurements say of them says much of this pixel too. Each coefficient is predicted linearly from
//! the same coefficient of the pixels around, and from the other channels'; what the prediction
//! leaves open is Gaussian again, and learned in the same way. Where the object has an edge the
//! prediction fails, so that each pixel weighs both priors by how well they explain its own
//! measurements.

use super::equations::{Equations, Member, PHASES};
use super::nonnegative::NonNegative;
use super::posterior::{Gaussian, Workspace};
use super::prior::{Prior, Threshold, bright};
use crate::executor::Executor;
use crate::linalg::{self, add_scaled, vectorise};
use crate::transport::{CHANNELS, Extent, TileRect};

/// Pixels around one that it is predicted from.
pub(super) const REACH: i32 = 2;
/// Rounds of expectation–maximisation.
const ROUNDS: usize = 4;
/// Share of a feature's mean square that is added to keep the regression well posed.
const RIDGE: f64 = 1e-3;
/// Parts that patches are divided into for learning. Fixed, so that sums come out the same however
/// many threads there are.
const PARTS: usize = 8;

/// One thing a coefficient is predicted from: the same coefficient elsewhere.
#[derive(Clone, Copy, Debug)]
struct Feature {
    dx: i32,
    dy: i32,
    /// Added to the channel, modulo [`CHANNELS`].
    channel: usize,
}

/// All neighbours in the same channel; those in its row and column, and the pixel itself, in the
/// others.
fn features() -> Vec<Feature> {
    let mut features = Vec::new();
    for dy in -REACH..=REACH {
        for dx in -REACH..=REACH {
            let straight = dx == 0 || dy == 0;
            for channel in 0..CHANNELS {
                let itself = dx == 0 && dy == 0;
                if if channel == 0 { !itself } else { straight } {
                    features.push(Feature { dx, dy, channel });
                }
            }
        }
    }
    features
}

/// Posterior means of a region under the prior without neighbours.
#[derive(Debug)]
pub(super) struct Field {
    rect: TileRect,
    rank: usize,
    /// `[pixel, channel, r]`.
    pub z: Vec<f64>,
    /// The same, but zero where a member is not bright.
    lit: Vec<f64>,
    /// Logarithm of the evidence, `[pixel, channel]`.
    evidence: Vec<f64>,
    /// `[pixel, channel]`.
    pub bright: Vec<bool>,
}

impl Field {
    /// Infers every member of `equations` on its own.
    pub fn new(equations: &Equations, prior: &Prior, threshold: &Threshold) -> Self {
        let (rank, members) = (equations.rank, equations.members.len());
        let mut field = Self {
            rect: equations.rect,
            rank,
            z: Vec::with_capacity(members * rank),
            lit: Vec::with_capacity(members * rank),
            evidence: Vec::with_capacity(members),
            bright: Vec::with_capacity(members),
        };
        vectorise(
            #[inline(always)]
            || {
                let mut work = Workspace::new(rank);
                for member in 0..members {
                    let mean = &prior.mean[equations.members[member].phase];
                    let evidence =
                        work.infer(equations, member, prior.noise, &prior.gaussian, mean);
                    let bright = bright(equations, member, threshold);
                    field.z.extend_from_slice(&work.z);
                    let lit = if bright { 1.0 } else { 0.0 };
                    field.lit.extend(work.z.iter().map(|z| lit * z));
                    field.evidence.push(evidence);
                    field.bright.push(bright);
                }
            },
        );
        field
    }

    /// The best estimate for every pixel of `patch.inner` without its neighbours, `[pixel, channel,
    /// r]`.
    pub fn refine(&self, patch: &Patch, prior: &Prior, nonnegative: &NonNegative) -> Vec<f64> {
        let mut out = Vec::with_capacity(patch.inner.extent.area() * CHANNELS * self.rank);
        vectorise(
            #[inline(always)]
            || {
                let mut work = Workspace::new(self.rank);
                for (_, _, _, member) in self.members(patch.inner) {
                    let mut z = self.z[member * self.rank..(member + 1) * self.rank].to_vec();
                    if self.bright[member] {
                        let mean = &prior.mean[patch.equations.members[member].phase];
                        let (noise, gaussian) = (prior.noise, &prior.gaussian);
                        work.infer(&patch.equations, member, noise, gaussian, mean);
                        work.pull(nonnegative, &mut z);
                    }
                    out.extend(z);
                }
            },
        );
        out
    }

    /// What `feature` of pixel (x, y), counted from the region's first, is; `None` off the region.
    #[inline(always)]
    fn feature(&self, x: u32, y: u32, channel: usize, feature: &Feature) -> Option<&[f64]> {
        let Extent { width, height } = self.rect.extent;
        let (x, y) = (x as i32 + feature.dx, y as i32 + feature.dy);
        let (x, y) = (u32::try_from(x).ok()?, u32::try_from(y).ok()?);
        if x >= width || y >= height {
            return None;
        }
        let pixel = (y * width + x) as usize;
        let member = pixel * CHANNELS + (channel + feature.channel) % CHANNELS;
        Some(&self.lit[member * self.rank..(member + 1) * self.rank])
    }

    /// Members of the pixels of `inner`, which lies in the region: (x, y, channel, member).
    fn members(&self, inner: TileRect) -> impl Iterator<Item = (u32, u32, usize, usize)> + use<> {
        let rect = self.rect;
        inner.pixels().flat_map(move |pixel| {
            let (x, y) = (pixel.x - rect.x, pixel.y - rect.y);
            let pixel = (y * rect.extent.width + x) as usize;
            (0..CHANNELS).map(move |c| (x, y, c, pixel * CHANNELS + c))
        })
    }
}

/// A part of the picture to learn from: equations and what they say by themselves.
#[derive(Debug)]
pub(super) struct Patch {
    pub equations: Equations,
    pub field: Field,
    /// The pixels whose neighbours are all there, unless the picture, or what is at hand of it, ends.
    pub inner: TileRect,
}

/// The prior given the neighbours.
#[derive(Clone, Debug)]
pub(super) struct Context {
    rank: usize,
    features: Vec<Feature>,
    /// `[phase, channel][1 + feature, r]`; first the constant.
    weights: Vec<Vec<f64>>,
    /// Covariance of what the prediction leaves open.
    gaussian: Gaussian,
    /// Share of pixels that their neighbours predict.
    share: f64,
}

/// Normal equations of the regressions of one class: for each coefficient its own.
#[derive(Clone, Debug)]
struct Normal {
    /// `[1 + feature, 1 + feature, r]`, first index at most the second.
    gram: Vec<f64>,
    /// `[1 + feature, r]`.
    right: Vec<f64>,
}

/// What a round of expectation gathers.
#[derive(Debug)]
struct Expected {
    /// Cross moments of features and posterior means, by class.
    right: Vec<Vec<f64>>,
    /// `Σ q ((z − m)(z − m)ᵀ + P)`, upper triangle.
    moment: Vec<f64>,
    weight: f64,
    count: f64,
}

const CLASSES: usize = PHASES * CHANNELS;

fn class(member: &Member, channel: usize) -> usize {
    member.phase * CHANNELS + channel
}

impl Context {
    /// Learns to predict from the bright members of `patches`. `None` where there are too few.
    pub fn learn(
        patches: &[Patch],
        prior: &Prior,
        threshold: &Threshold,
        executor: &impl Executor,
    ) -> Option<Self> {
        let rank = prior.rank;
        let features = features();
        let width = 1 + features.len();
        let parts = executor.map(PARTS, |part| {
            let mut normals = vec![Normal::new(width, rank); CLASSES];
            let mut count = 0usize;
            for patch in patches.iter().skip(part).step_by(PARTS) {
                vectorise(
                    #[inline(always)]
                    || {
                        for (x, y, c, member) in patch.field.members(patch.inner) {
                            if patch.field.bright[member] {
                                let of = &patch.equations.members[member];
                                let normal = &mut normals[class(of, c)];
                                normal.add(&patch.field, &features, (x, y, c, member));
                                count += 1;
                            }
                        }
                    },
                );
            }
            (normals, count)
        });
        let mut normals = vec![Normal::new(width, rank); CLASSES];
        let mut count = 0;
        for (part, members) in &parts {
            count += members;
            for (sum, part) in normals.iter_mut().zip(part) {
                add_scaled(&mut sum.gram, 1.0, &part.gram);
                add_scaled(&mut sum.right, 1.0, &part.right);
            }
        }
        drop(parts);
        if count < 4 * width * CLASSES {
            return None;
        }
        let factors = executor.map(CLASSES, |i| normals[i].factors(width, rank));
        let rights: Vec<Vec<f64>> = normals.into_iter().map(|n| n.right).collect();
        let mut context = Self {
            rank,
            features,
            weights: Vec::new(),
            gaussian: prior.gaussian.clone(),
            share: 0.5,
        };
        context.regress(&factors, &rights, executor);
        context.gaussian = context.first_guess(patches, prior, threshold);
        for _ in 0..ROUNDS {
            let parts = executor.map(PARTS, |part| {
                let mut sums = Expected::new(width, rank);
                for patch in patches.iter().skip(part).step_by(PARTS) {
                    vectorise(
                        #[inline(always)]
                        || context.expect(patch, prior.noise, &mut sums),
                    );
                }
                sums
            });
            let mut total = Expected::new(width, rank);
            parts.iter().for_each(|part| total.add(part));
            total
                .moment
                .iter_mut()
                .for_each(|m| *m /= total.weight.max(1.0));
            linalg::mirror_upper(&mut total.moment, rank);
            context.gaussian = Gaussian::new(&total.moment, rank);
            context.share = (total.weight / total.count.max(1.0)).clamp(0.01, 0.99);
            context.regress(&factors, &total.right, executor);
        }
        Some(context)
    }

    /// Solves all regressions for their right-hand sides.
    fn regress(&mut self, factors: &[Vec<f64>], rights: &[Vec<f64>], executor: &impl Executor) {
        let (rank, width) = (self.rank, 1 + self.features.len());
        self.weights = executor.map(CLASSES, |i| {
            let mut weights = vec![0.0; width * rank];
            let mut b = vec![0.0; width];
            for (k, factor) in factors[i].chunks_exact(width * width).enumerate() {
                (0..width).for_each(|f| b[f] = rights[i][f * rank + k]);
                linalg::cholesky_solve(factor, &mut b);
                (0..width).for_each(|f| weights[f * rank + k] = b[f]);
            }
            weights
        });
    }

    /// Covariance of what the first prediction misses, with some of the uncertainty that the
    /// means it was made from have themselves.
    fn first_guess(&self, patches: &[Patch], prior: &Prior, threshold: &Threshold) -> Gaussian {
        let rank = self.rank;
        let mut moment = vec![0.0; rank * rank];
        let mut spread = vec![0.0; rank];
        let (mut count, mut sampled) = (0.0, 0.0);
        let mut work = Workspace::new(rank);
        let mut mean = vec![0.0; rank];
        for patch in patches {
            let members = patch.field.members(patch.inner);
            for (i, (x, y, c, member)) in members.enumerate() {
                if !bright(&patch.equations, member, threshold) {
                    continue;
                }
                self.predict(patch, (x, y, c, member), &mut mean);
                let z = &patch.field.z[member * rank..(member + 1) * rank];
                let miss: Vec<f64> = z.iter().zip(&mean).map(|(z, m)| z - m).collect();
                for i in 0..rank {
                    add_scaled(
                        &mut moment[i * rank + i..(i + 1) * rank],
                        miss[i],
                        &miss[i..],
                    );
                }
                count += 1.0;
                if i % 64 == 0 {
                    let of = &patch.equations.members[member];
                    let mean = &prior.mean[of.phase];
                    work.infer(&patch.equations, member, prior.noise, &prior.gaussian, mean);
                    work.covariance();
                    (0..rank).for_each(|k| spread[k] += work.inverse[k * rank + k]);
                    sampled += 1.0;
                }
            }
        }
        moment.iter_mut().for_each(|m| *m /= f64::max(count, 1.0));
        for k in 0..rank {
            moment[k * rank + k] += 0.5 * spread[k] / f64::max(sampled, 1.0);
        }
        linalg::mirror_upper(&mut moment, rank);
        Gaussian::new(&moment, rank)
    }

    /// What the neighbours say of a member.
    #[inline(always)]
    fn predict(&self, patch: &Patch, at: (u32, u32, usize, usize), mean: &mut [f64]) {
        let (x, y, c, member) = at;
        let weights = &self.weights[class(&patch.equations.members[member], c)];
        let mut rows = weights.chunks_exact(self.rank);
        if let Some(constant) = rows.next() {
            mean.copy_from_slice(constant);
        }
        for (feature, weights) in self.features.iter().zip(rows) {
            if let Some(z) = patch.field.feature(x, y, c, feature) {
                for ((m, w), z) in mean.iter_mut().zip(weights).zip(z) {
                    *m += w * z;
                }
            }
        }
    }

    /// Infers a member given its neighbours, into `work`; how far they are to be believed, 0 to 1.
    #[inline(always)]
    fn infer(
        &self,
        patch: &Patch,
        noise: f64,
        at: (u32, u32, usize, usize),
        mean: &mut [f64],
        work: &mut Workspace,
    ) -> f64 {
        let member = at.3;
        self.predict(patch, at, mean);
        let evidence = work.infer(&patch.equations, member, noise, &self.gaussian, mean);
        let odds = (self.share / (1.0 - self.share)).ln() + evidence - patch.field.evidence[member];
        1.0 / (1.0 + (-odds).exp())
    }

    #[inline(always)]
    fn expect(&self, patch: &Patch, noise: f64, sums: &mut Expected) {
        let rank = self.rank;
        let mut work = Workspace::new(rank);
        let (mut mean, mut miss) = (vec![0.0; rank], vec![0.0; rank]);
        for at in patch.field.members(patch.inner) {
            let (x, y, c, member) = at;
            if !patch.field.bright[member] {
                continue;
            }
            let q = self.infer(patch, noise, at, &mut mean, &mut work);
            work.covariance();
            for k in 0..rank {
                miss[k] = work.z[k] - mean[k];
            }
            for i in 0..rank {
                let row = i * rank + i..(i + 1) * rank;
                let moment = &mut sums.moment[row.clone()];
                add_scaled(moment, q * miss[i], &miss[i..]);
                add_scaled(moment, q, &work.inverse[row]);
            }
            sums.weight += q;
            sums.count += 1.0;
            let right = &mut sums.right[class(&patch.equations.members[member], c)];
            let mut rows = right.chunks_exact_mut(rank);
            if let Some(constant) = rows.next() {
                add_scaled(constant, 1.0, &work.z);
            }
            for (feature, row) in self.features.iter().zip(rows) {
                if let Some(f) = patch.field.feature(x, y, c, feature) {
                    for ((r, f), z) in row.iter_mut().zip(f).zip(&work.z) {
                        *r += f * z;
                    }
                }
            }
        }
    }

    /// The best estimate for every pixel of `patch.inner`, `[pixel, channel, r]`.
    pub fn refine(&self, patch: &Patch, noise: f64, nonnegative: &NonNegative) -> Vec<f64> {
        let rank = self.rank;
        let mut out = Vec::with_capacity(patch.inner.extent.area() * CHANNELS * rank);
        vectorise(
            #[inline(always)]
            || {
                let mut work = Workspace::new(rank);
                let (mut mean, mut best) = (vec![0.0; rank], vec![0.0; rank]);
                for at in patch.field.members(patch.inner) {
                    let member = at.3;
                    let alone = &patch.field.z[member * rank..(member + 1) * rank];
                    if patch.field.bright[member] {
                        let q = self.infer(patch, noise, at, &mut mean, &mut work);
                        for (best, (z, a)) in best.iter_mut().zip(work.z.iter().zip(alone)) {
                            *best = q * z + (1.0 - q) * a;
                        }
                        work.pull(nonnegative, &mut best);
                        out.extend_from_slice(&best);
                    } else {
                        out.extend_from_slice(alone);
                    }
                }
            },
        );
        out
    }
}

impl Normal {
    fn new(width: usize, rank: usize) -> Self {
        Self {
            gram: vec![0.0; width * width * rank],
            right: vec![0.0; width * rank],
        }
    }

    #[inline(always)]
    fn add(&mut self, field: &Field, features: &[Feature], at: (u32, u32, usize, usize)) {
        let (x, y, c, member) = at;
        let rank = field.rank;
        let width = 1 + features.len();
        let ones = vec![1.0; rank];
        let mut present: Vec<(usize, &[f64])> = vec![(0, &ones)];
        for (i, feature) in features.iter().enumerate() {
            if let Some(values) = field.feature(x, y, c, feature) {
                present.push((1 + i, values));
            }
        }
        let target = &field.z[member * rank..(member + 1) * rank];
        for (n, &(i, a)) in present.iter().enumerate() {
            for ((r, a), z) in self.right[i * rank..(i + 1) * rank]
                .iter_mut()
                .zip(a)
                .zip(target)
            {
                *r += a * z;
            }
            for &(j, b) in &present[n..] {
                let at = (i * width + j) * rank;
                for ((g, a), b) in self.gram[at..at + rank].iter_mut().zip(a).zip(b) {
                    *g += a * b;
                }
            }
        }
    }

    /// Cholesky factors of each coefficient's normal equations, `[r][width, width]`.
    fn factors(&self, width: usize, rank: usize) -> Vec<f64> {
        let mut out = Vec::with_capacity(rank * width * width);
        for k in 0..rank {
            let entry = |i: usize, j: usize| self.gram[(i * width + j) * rank + k];
            let trace: f64 = (1..width).map(|i| entry(i, i)).sum();
            let ridge = (RIDGE * trace / width as f64).max(f64::MIN_POSITIVE);
            let mut a = vec![0.0; width * width];
            for i in 0..width {
                for j in i..width {
                    a[i * width + j] = entry(i, j);
                }
                a[i * width + i] += ridge;
            }
            if linalg::cholesky(&mut a, width).is_none() {
                // Nothing to learn from in this class: predict nothing.
                a.fill(0.0);
                (0..width).for_each(|i| a[i * width + i] = 1e150);
            }
            out.extend(a);
        }
        out
    }
}

impl Expected {
    fn new(width: usize, rank: usize) -> Self {
        Self {
            right: vec![vec![0.0; width * rank]; CLASSES],
            moment: vec![0.0; rank * rank],
            weight: 0.0,
            count: 0.0,
        }
    }

    fn add(&mut self, other: &Self) {
        for (sum, other) in self.right.iter_mut().zip(&other.right) {
            add_scaled(sum, 1.0, other);
        }
        add_scaled(&mut self.moment, 1.0, &other.moment);
        self.weight += other.weight;
        self.count += other.count;
    }
}
