//! A correspondence fitted to decoded Gray code, and how well it fits.

use std::sync::Arc;

use super::affine_fit::GrayCodePosition;
use super::displacement_fit::fit_displacement;
use crate::linalg;
use crate::transport::{CameraPixel, Correspondence, Extent};

/// A correspondence from Gray code, and its residuals.
#[derive(Clone, Debug, PartialEq)]
pub struct GrayCodeFit {
    /// The correspondence.
    pub correspondence: Correspondence,
    /// Share of the camera pixels that are decoded along both axes.
    pub decoded: f64,
    /// Distances from the decoded positions; `None` if no pixel is decoded to a single element.
    pub residual: Option<ResidualSummary>,
    /// Those of the affine map alone.
    pub affine_residual: Option<ResidualSummary>,
}

/// Distances between a correspondence and the positions of the pixels that are decoded to one light element, in light
/// elements. A position is the centre of an element, so that even a perfect correspondence leaves a median of 0.3 to 0.4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResidualSummary {
    /// Half of the distances are smaller.
    pub median: f64,
    /// 95 % of the distances are smaller.
    pub percentile_95: f64,
}

impl GrayCodeFit {
    /// Fits a displacement to the decoded positions along u and v, of `pixels` camera pixels; `affine` is the fitted affine
    /// map.
    pub(super) fn new(
        camera: Extent,
        pixels: usize,
        positions: [&[GrayCodePosition]; 2],
        affine: [[f64; 3]; 2],
    ) -> Self {
        let displacement = fit_displacement(camera, positions, &affine);
        let correspondence = Correspondence {
            displacement: displacement.map(Arc::new),
            ..Correspondence::from_affine(affine)
        };
        let both = both_axes(positions);
        let affine = Correspondence::from_affine(affine);
        Self {
            decoded: both.len() as f64 / pixels as f64,
            residual: summary(&both, &correspondence),
            affine_residual: summary(&both, &affine),
            correspondence,
        }
    }
}

/// A camera pixel with its position along u and v, and whether both are single elements.
type DecodedPixel = (CameraPixel, [f64; 2], bool);

/// The pixels in both lists, which are in the same order.
fn both_axes([u, v]: [&[GrayCodePosition]; 2]) -> Vec<DecodedPixel> {
    let order = |position: &GrayCodePosition| (position.pixel.y, position.pixel.x);
    let mut v = v.iter().peekable();
    let mut both = Vec::new();
    for u in u {
        while v.next_if(|v| order(v) < order(u)).is_some() {}
        if let Some(v) = v.next_if(|v| order(v) == order(u)) {
            let is_single = u.width <= 1.0 && v.width <= 1.0;
            both.push((u.pixel, [u.position, v.position], is_single));
        }
    }
    both
}

fn summary(pixels: &[DecodedPixel], correspondence: &Correspondence) -> Option<ResidualSummary> {
    let single = pixels.iter().filter(|pixel| pixel.2);
    let mut distances: Vec<f64> = single
        .map(|(pixel, [u, v], _)| {
            let at = correspondence.at(*pixel);
            libm::hypot(at.u - u, at.v - v)
        })
        .collect();
    linalg::sort(&mut distances);
    let last = distances.len().checked_sub(1)?;
    Some(ResidualSummary {
        median: distances[last / 2],
        percentile_95: distances[last * 95 / 100],
    })
}
