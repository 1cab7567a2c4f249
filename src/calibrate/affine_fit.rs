//! Robust least squares for one row of the affine correspondence: `position ≈ a·(x+½, y+½, 1)`.
//!
//! Wrong bits of the Gray code put a pixel far off, so weights are iteratively reduced for pixels that disagree (Cauchy
//! weights).

use crate::linalg;
use crate::transport::CameraPixel;

/// The decoded position of one camera pixel along one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct GrayCodePosition {
    pub pixel: CameraPixel,
    /// Centre of the range of light elements it was decoded to.
    pub position: f64,
    /// Width of that range, in light elements.
    pub width: f64,
}

/// Rounds of reweighting; the weights converge within a few.
const REWEIGHTING_ROUNDS: usize = 10;

/// Smallest pivot, relative to the largest entry of the normal equations, of pixels that do not lie on one line.
const MIN_PIVOT_RATIO: f64 = 1e-12;

/// The row `a`; `None` if the pixels lie on one line.
pub(super) fn fit_affine_row(pixels: &[GrayCodePosition]) -> Option<[f64; 3]> {
    let row = |p: &GrayCodePosition| [f64::from(p.pixel.x) + 0.5, f64::from(p.pixel.y) + 0.5, 1.0];
    let precision = |p: &GrayCodePosition| 1.0 / (p.width * p.width);
    let mut weights: Vec<f64> = pixels.iter().map(precision).collect();
    let mut solution = [0.0; 3];
    for _ in 0..REWEIGHTING_ROUNDS {
        let mut normal = [0.0; 9];
        solution = [0.0; 3];
        for (pixel, weight) in pixels.iter().zip(&weights) {
            let row = row(pixel);
            for (i, normal) in normal.chunks_exact_mut(3).enumerate() {
                linalg::add_scaled(normal, weight * row[i], &row);
                solution[i] += weight * row[i] * pixel.position;
            }
        }
        let min_pivot = MIN_PIVOT_RATIO * normal.iter().copied().fold(0.0, f64::max);
        linalg::cholesky(&mut normal, 3)?;
        if (0..3).any(|i| normal[4 * i].powi(2) <= min_pivot) {
            return None;
        }
        linalg::cholesky_solve(&normal, &mut solution);
        for (pixel, weight) in pixels.iter().zip(&mut weights) {
            let row = row(pixel);
            let predicted: f64 = row.iter().zip(&solution).map(|(r, a)| r * a).sum();
            // A correct position lies within the range; one a width away is probably wrong.
            let residual = (pixel.position - predicted) / pixel.width;
            *weight = precision(pixel) / (1.0 + residual * residual);
        }
    }
    Some(solution)
}
