//! Fit of the displacement of a correspondence that bends, to positions that Gray code gives.
//!
//! Along each axis of the light plane the displacements d at control points minimise
//!
//! ```text
//! Σ_n log(1 + ((r_n − B_n d) / σ_n)²) + ‖D d‖² / τ²
//! ```
//!
//! r_n is the position of pixel n minus the affine map, B_n interpolates bilinearly between control points, σ_n is the
//! standard deviation of a position within the range of light elements that was decoded, and D takes second differences:
//! their squares are the bending energy of a thin plate, `d_xx² + 2 d_xy² + d_yy²` (Duchon 1977). Cauchy's loss ignores
//! wrong bits; smoothness fills what receives no light. The minimum is found by reweighted least squares.

use super::affine_fit::GrayCodePosition;
use crate::linalg::{BandedMatrix, median};
use crate::transport::{DisplacementGrid, Extent};

/// Least distance of control points, in camera pixels.
const MIN_SPACING: f64 = 16.0;
/// Maximum number of control points, roughly: a file keeps 16 kilobytes for them.
const MAX_POINTS: f64 = 4096.0;
/// τ: typical second difference of the displacements of neighbouring control points, in light elements. Where pixels are
/// decoded, their number outweighs it.
const TYPICAL_SECOND_DIFFERENCE: f64 = 0.1;
/// Weight of a displacement itself: it tends to zero far from all decoded pixels.
const RIDGE: f64 = 1e-4;
/// Least number of pixels whose median is a first estimate of a control point.
const MIN_MEDIAN_PIXELS: usize = 8;
/// Weight of a median against smoothness in the first estimate.
const MEDIAN_WEIGHT: f64 = 1000.0;
/// Rounds of reweighting; the weights converge within a few.
const REWEIGHTING_ROUNDS: usize = 8;
/// Root mean square displacement, in light elements, below which a correspondence counts as affine. Windows begin at whole
/// elements, so that they would hardly move; relief, which displaces some pixels by parallax, is not for them to follow.
const MIN_DISPLACEMENT: f64 = 0.5;
/// Share of the affine map's loss that remains, above which a displacement explains nothing.
const MAX_LOSS_RATIO: f64 = 0.95;
/// Pixels that the fit takes at most, as one: far more than control points.
const MAX_PIXELS: usize = 1 << 19;
/// Least step of a code, in light elements.
const MIN_STEP: f32 = 1.0 / 256.0;

/// Fits the displacements along u and v to the decoded positions of pixels, of which `affine` is the affine part. `None` if
/// the correspondence does not bend.
pub(super) fn fit_displacement(
    camera: Extent,
    positions: [&[GrayCodePosition]; 2],
    affine: &[[f64; 3]; 2],
) -> Option<DisplacementGrid> {
    let area = camera.area() as f64;
    let spacing = MIN_SPACING.max((area / MAX_POINTS).sqrt()).ceil() as u32;
    let spacing = spacing.min(DisplacementGrid::MAX_SPACING);
    let points = DisplacementGrid::points_over(camera, spacing);
    let fit = |axis: usize| AxisFit::new(spacing, points, positions[axis], &affine[axis]);
    let fits = [fit(0), fit(1)];
    let [u, v] = [fits[0].solve()?, fits[1].solve()?];
    let square = fits[0].squared_displacement(&u) + fits[1].squared_displacement(&v);
    let zero = vec![0.0; points.area()];
    let affine_loss = fits[0].loss(&zero) + fits[1].loss(&zero);
    let is_bent = square > MIN_DISPLACEMENT * MIN_DISPLACEMENT
        && fits[0].loss(&u) + fits[1].loss(&v) < MAX_LOSS_RATIO * affine_loss;
    if !is_bent {
        return None;
    }
    let largest = u.iter().chain(&v).fold(0.0, |max, d| d.abs().max(max));
    let step = MIN_STEP.max((largest / f64::from(i16::MAX)) as f32 * (1.0 + f32::EPSILON));
    let code = |d: f64| (d / f64::from(step)).round() as i16;
    let codes = points.cells().map(|(column, row)| {
        let at = point_index(points, column as usize, row as usize);
        [code(u[at]), code(v[at])]
    });
    DisplacementGrid::new(spacing, step, points, codes.collect()).ok()
}

/// Index of a control point in the systems of equations, which count along the shorter side: the band is twice as wide as that.
fn point_index(points: Extent, column: usize, row: usize) -> usize {
    match points.width <= points.height {
        true => row * points.width as usize + column,
        false => column * points.height as usize + row,
    }
}

/// A pixel's residual of the affine map, and its bilinear weights.
struct Residual {
    /// In light elements.
    value: f64,
    /// Its standard deviation.
    deviation: f64,
    /// Control points around the pixel, each with its weight.
    weights: [(usize, f64); 4],
}

struct AxisFit {
    points: Extent,
    residuals: Vec<Residual>,
}

impl AxisFit {
    fn new(
        spacing: u32,
        points: Extent,
        positions: &[GrayCodePosition],
        &[a, b, constant]: &[f64; 3],
    ) -> Self {
        let cell = |pixel: u32, points: u32| {
            let at = (f64::from(pixel) + 0.5) / f64::from(spacing);
            let first = (at as u32).min(points - 2);
            (first as usize, at - f64::from(first))
        };
        let residual = |position: &GrayCodePosition| {
            let pixel = position.pixel;
            let (column, right) = cell(pixel.x, points.width);
            let (row, down) = cell(pixel.y, points.height);
            let point = |column: usize, row: usize| point_index(points, column, row);
            let (left, up) = (1.0 - right, 1.0 - down);
            let predicted =
                a * (f64::from(pixel.x) + 0.5) + b * (f64::from(pixel.y) + 0.5) + constant;
            Residual {
                value: position.position - predicted,
                deviation: position.width / 12f64.sqrt(),
                weights: [
                    (point(column, row), left * up),
                    (point(column + 1, row), right * up),
                    (point(column, row + 1), left * down),
                    (point(column + 1, row + 1), right * down),
                ],
            }
        };
        let step = positions.len().div_ceil(MAX_PIXELS).max(1);
        // An odd step does not keep to some columns of a picture whose width is even.
        let chosen = positions.iter().step_by(step | 1);
        Self {
            points,
            residuals: chosen.map(residual).collect(),
        }
    }

    /// The displacements, `[row, column]`; `None` if too few pixels are decoded to tell.
    fn solve(&self) -> Option<Vec<f64>> {
        let mut displacements = self.first_estimate()?;
        for _ in 0..REWEIGHTING_ROUNDS {
            let (mut matrix, mut sums) = (self.smoothness(), vec![0.0; self.points.area()]);
            for residual in &self.residuals {
                let error = residual.error(&displacements);
                let precision = residual.deviation.powi(2).recip() / (1.0 + error * error);
                matrix.add_square(precision, &residual.weights);
                for (point, weight) in residual.weights {
                    sums[point] += precision * weight * residual.value;
                }
            }
            matrix.solve(&mut sums)?;
            displacements = sums;
        }
        Some(displacements)
    }

    /// Medians of the residuals next to each control point, which wrong bits and the borders of planes hardly move; smooth
    /// where there are few.
    fn first_estimate(&self) -> Option<Vec<f64>> {
        let mut nearest = vec![Vec::new(); self.points.area()];
        for residual in &self.residuals {
            let heaviest = residual.weights.into_iter();
            let heaviest =
                heaviest.reduce(|best, next| if next.1 > best.1 { next } else { best })?;
            nearest[heaviest.0].push(residual.value);
        }
        let (mut matrix, mut sums) = (self.smoothness(), vec![0.0; self.points.area()]);
        for (point, values) in nearest.iter().enumerate() {
            if values.len() >= MIN_MEDIAN_PIXELS {
                matrix.add_square(MEDIAN_WEIGHT, &[(point, 1.0)]);
                sums[point] = MEDIAN_WEIGHT * median(values);
            }
        }
        matrix.solve(&mut sums)?;
        Some(sums)
    }

    /// DᵀD / τ², and the ridge.
    fn smoothness(&self) -> BandedMatrix {
        let points = self.points;
        let [width, height] = [points.width, points.height].map(|side| side as usize);
        let mut matrix = BandedMatrix::zeros(width * height, 2 * width.min(height));
        let weight = TYPICAL_SECOND_DIFFERENCE.powi(2).recip();
        let at = |column, row| point_index(points, column, row);
        for row in 0..height {
            for column in 0..width {
                let here = at(column, row);
                matrix.add_square(RIDGE, &[(here, 1.0)]);
                let mut add_curvature = |next: usize, last: usize| {
                    matrix.add_square(weight, &[(here, 1.0), (next, -2.0), (last, 1.0)]);
                };
                if column + 2 < width {
                    add_curvature(at(column + 1, row), at(column + 2, row));
                }
                if row + 2 < height {
                    add_curvature(at(column, row + 1), at(column, row + 2));
                }
                if column + 1 < width && row + 1 < height {
                    let (right, below) = (at(column + 1, row), at(column, row + 1));
                    let corner = at(column + 1, row + 1);
                    let twist = [(here, 1.0), (right, -1.0), (below, -1.0), (corner, 1.0)];
                    matrix.add_square(2.0 * weight, &twist);
                }
            }
        }
        matrix
    }

    /// Mean of the squared displacements of the decoded pixels, in squared light elements.
    fn squared_displacement(&self, displacements: &[f64]) -> f64 {
        let squares = self
            .residuals
            .iter()
            .map(|r| r.interpolated(displacements).powi(2));
        squares.sum::<f64>() / self.residuals.len() as f64
    }

    /// Cauchy's loss of the decoded pixels.
    fn loss(&self, displacements: &[f64]) -> f64 {
        let losses = self
            .residuals
            .iter()
            .map(|r| libm::log1p(r.error(displacements).powi(2)));
        losses.sum()
    }
}

impl Residual {
    /// B_n d.
    fn interpolated(&self, displacements: &[f64]) -> f64 {
        let terms = self
            .weights
            .iter()
            .map(|&(point, weight)| weight * displacements[point]);
        terms.sum()
    }

    /// (r_n − B_n d) / σ_n.
    fn error(&self, displacements: &[f64]) -> f64 {
        (self.value - self.interpolated(displacements)) / self.deviation
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::CameraPixel;

    const AFFINE: [[f64; 3]; 2] = [[0.5, 0.0, 1.0], [0.0, 0.5, 2.0]];

    /// Positions along an axis that are displaced by `displacement`, of every pixel that it displaces at all.
    fn positions(
        camera: Extent,
        [a, b, constant]: [f64; 3],
        displacement: impl Fn(f64, f64) -> Option<f64>,
    ) -> Vec<GrayCodePosition> {
        let position = |(x, y): (u32, u32)| {
            let [px, py] = [x, y].map(|at| f64::from(at) + 0.5);
            let exact = a * px + b * py + constant + displacement(px, py)?;
            Some(GrayCodePosition {
                pixel: CameraPixel { x, y },
                position: exact.floor() + 0.5,
                width: 1.0,
            })
        };
        camera.cells().filter_map(position).collect()
    }

    /// The largest error of a fitted grid at the pixels of a picture.
    fn error(
        camera: Extent,
        displacement: impl Fn(f64, f64) -> Option<f64>,
        wanted: impl Fn(f64, f64) -> f64,
    ) -> f64 {
        let u = positions(camera, AFFINE[0], displacement);
        let v = positions(camera, AFFINE[1], |_, _| Some(0.0));
        let grid = fit_displacement(camera, [&u, &v], &AFFINE).unwrap();
        let errors = camera.cells().map(|(x, y)| {
            let [x, y] = [x, y].map(|at| f64::from(at) + 0.5);
            let [du, dv] = grid.at(x, y);
            (du - wanted(x, y)).hypot(dv)
        });
        errors.fold(0.0, f64::max)
    }

    fn bowl(x: f64, y: f64) -> f64 {
        0.0005 * ((x - 60.0).powi(2) + (y - 40.0).powi(2))
    }

    #[test]
    fn a_smooth_displacement_is_found_in_both_orders_of_control_points() {
        for camera in [Extent::new(120, 80), Extent::new(80, 120)] {
            let error = error(camera, |x, y| Some(bowl(x, y)), bowl);
            assert!(error < 0.3, "{camera}: {error}");
        }
    }

    #[test]
    fn wrong_bits_and_dark_parts_do_not_matter() {
        let wrong = |x: f64, y: f64| {
            let is_dark = (70.0..95.0).contains(&x) && (20.0..50.0).contains(&y);
            let is_wrong = ((x + 7.0 * y) as u32).is_multiple_of(5);
            (!is_dark).then(|| bowl(x, y) + if is_wrong { 32.0 } else { 0.0 })
        };
        let error = error(Extent::new(120, 80), wrong, bowl);
        assert!(error < 0.6, "{error}");
    }

    #[test]
    fn small_displacements_and_few_pixels_are_no_bend() {
        let camera = Extent::new(120, 80);
        let fit = |scale: f64, every: usize| {
            let [u, v] = [scale, 0.0].map(|scale| {
                let row = AFFINE[usize::from(scale == 0.0)];
                let all = positions(camera, row, |x, y| Some(scale * bowl(x, y)));
                all.into_iter().step_by(every).collect::<Vec<_>>()
            });
            fit_displacement(camera, [&u, &v], &AFFINE)
        };
        assert!(fit(0.05, 1).is_none());
        assert!(fit(1.0, 1).is_some());
        assert!(fit(0.05, 9_000).is_none());
    }
}
