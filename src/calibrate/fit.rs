//! Fitting a plane to where pixels look along one axis.

use crate::transport::CameraPx;

/// What one pixel tells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub pixel: CameraPx,
    /// Middle of the cell it looks at, in light elements.
    pub position: f64,
    /// That cell's size: how coarsely it tells.
    pub cell: f64,
}

/// Rounds of reweighting: the weights settle within a few.
const ROUNDS: usize = 10;

/// Least squares for `position = a·(x+½, y+½, 1)`, weighted by precision and reweighted so that
/// wrong bits count for little (Cauchy weights). `None` where the pixels do not span a plane.
pub(super) fn robust_affine(samples: &[Sample]) -> Option<[f64; 3]> {
    let row = |s: &Sample| [f64::from(s.pixel.x) + 0.5, f64::from(s.pixel.y) + 0.5, 1.0];
    let mut weights: Vec<f64> = samples.iter().map(|s| 1.0 / (s.cell * s.cell)).collect();
    let mut fit = None;
    for _ in 0..ROUNDS {
        let mut normal = [[0.0; 4]; 3];
        for (sample, weight) in samples.iter().zip(&weights) {
            let row = row(sample);
            for i in 0..3 {
                for j in 0..3 {
                    normal[i][j] += weight * row[i] * row[j];
                }
                normal[i][3] += weight * row[i] * sample.position;
            }
        }
        let solution = solve(normal)?;
        for (sample, weight) in samples.iter().zip(&mut weights) {
            let row = row(sample);
            let predicted: f64 = row.iter().zip(&solution).map(|(r, a)| r * a).sum();
            // Within its cell a right answer is anywhere; a cell away it is likely wrong.
            let off = (sample.position - predicted) / sample.cell;
            *weight = 1.0 / (sample.cell * sample.cell * (1.0 + off * off));
        }
        fit = Some(solution);
    }
    fit
}

/// Gaussian elimination with pivoting on three equations.
fn solve(mut m: [[f64; 4]; 3]) -> Option<[f64; 3]> {
    let scale = m
        .iter()
        .flat_map(|r| &r[..3])
        .fold(0.0f64, |a, b| a.max(b.abs()));
    for i in 0..3 {
        let pivot = (i..3).max_by(|&a, &b| m[a][i].abs().total_cmp(&m[b][i].abs()))?;
        m.swap(i, pivot);
        if m[i][i].abs() <= 1e-12 * scale {
            return None;
        }
        for r in 0..3 {
            if r != i {
                let factor = m[r][i] / m[i][i];
                for c in i..4 {
                    m[r][c] -= factor * m[i][c];
                }
            }
        }
    }
    Some(std::array::from_fn(|i| m[i][3] / m[i][i]))
}
