//! Robust least squares for one row of the affine correspondence: `position ≈ a·(x+½, y+½, 1)`.
//!
//! Wrong bits of the Gray code put a pixel far off, so weights are iteratively reduced for pixels that disagree (Cauchy
//! weights).

use crate::transport::CameraPx;

/// The decoded position of one camera pixel along one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct DecodedPixel {
    pub pixel: CameraPx,
    /// Centre of the range of light elements it was decoded to.
    pub position: f64,
    /// Width of that range, in light elements.
    pub width: f64,
}

/// Rounds of reweighting; the weights converge within a few.
const REWEIGHTING_ROUNDS: usize = 10;

/// The row `a`; `None` if the pixels lie on one line.
pub(super) fn fit_affine_row(pixels: &[DecodedPixel]) -> Option<[f64; 3]> {
    let row = |p: &DecodedPixel| [f64::from(p.pixel.x) + 0.5, f64::from(p.pixel.y) + 0.5, 1.0];
    let precision = |p: &DecodedPixel| 1.0 / (p.width * p.width);
    let mut weights: Vec<f64> = pixels.iter().map(precision).collect();
    let mut fit = None;
    for _ in 0..REWEIGHTING_ROUNDS {
        let mut normal = [[0.0; 4]; 3];
        for (pixel, weight) in pixels.iter().zip(&weights) {
            let row = row(pixel);
            for i in 0..3 {
                for j in 0..3 {
                    normal[i][j] += weight * row[i] * row[j];
                }
                normal[i][3] += weight * row[i] * pixel.position;
            }
        }
        let solution = solve(normal)?;
        for (pixel, weight) in pixels.iter().zip(&mut weights) {
            let row = row(pixel);
            let predicted: f64 = row.iter().zip(&solution).map(|(r, a)| r * a).sum();
            // A correct position lies within the range; one a width away is probably wrong.
            let residual = (pixel.position - predicted) / pixel.width;
            *weight = precision(pixel) / (1.0 + residual * residual);
        }
        fit = Some(solution);
    }
    fit
}

/// Solves three equations, `[A | b]`, by Gaussian elimination with pivoting; `None` if singular.
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
