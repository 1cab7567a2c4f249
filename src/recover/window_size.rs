//! Estimates how wide a window has to be to hold nearly all of the light that a pixel receives.
//!
//! T is zero far from a pixel's correspondence (paper, section 3): it is a band, whose width depends on the object. The
//! light elements around a pixel are divided into square rings. The flux of each ring, relative to the pixel's light,
//! is taken to be the same for all pixels and estimated from many pixels at once by plain least squares. What the few
//! elements in the middle send differs from pixel to pixel, so the equations are projected onto the complement of these
//! elements' columns. No sign is imposed: the flux of rings beyond the band is then zero on average, and does not
//! gather noise.
//!
//! The *tail fraction* of a window is the flux of all rings outside it. Its standard error is that of a jackknife over
//! parts of the picture.

use super::common_mode_weight::CommonModeWeight;
use super::error::RecoverError;
use super::holdout_split::pattern_ids;
use super::mean_function::PooledMeasurements;
use super::normal_equations::{EquationWeights, NormalEquations, WeightedColumns};
use super::photometry::CalibratedMeasurements;
use super::preparation_input;
use super::sampling::{self, PixelsSharingWindow};
use crate::capture::{Measurements, group_count};
use crate::job_executor::{Executor, PARTS, set_values, share_of_jobs, values};
use crate::linalg::{self, add_scaled, ascending_order, vectorise};
use crate::transport::{CameraPixel, Extent, Geometry, LightElement, TileRect, Window};

/// Side of the widest window that is searched.
const MAX_SIDE: u32 = 31;
/// Side of the narrowest.
const MIN_SIDE: u32 = 7;
/// Side if the measurements do not determine it.
const DEFAULT_SIDE: u32 = 15;
/// Sides of the middle of the window, which differs from pixel to pixel. The largest one is used whose number of
/// elements is at most three quarters of the number of patterns.
const CENTRE_SIDES: [u32; 4] = [7, 5, 3, 1];
const MAX_TAIL_FRACTION: f64 = 0.01;
/// Rings added to the window found: the mean function is narrower than the widest ones.
const MARGIN_RINGS: usize = 1;
/// Squares of the picture that are used, and their side in camera pixels.
const MAX_SQUARES: usize = 1024;
const SQUARE_SIDE: u32 = 4;

/// The squares of the picture that are used.
pub(super) fn sample_squares(camera: Extent) -> Vec<TileRect> {
    sampling::spread_squares(camera, SQUARE_SIDE, MAX_SQUARES)
}

/// A window for the recovery, as estimated from measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowSizeEstimate {
    /// The smallest window that holds nearly all light, as far as that is known.
    pub window: Window,
    /// The light from outside it.
    pub band: TailEstimate,
}

/// How wide the band of T is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TailEstimate {
    /// Hardly wider than the window.
    Bounded {
        /// Estimated share of a pixel's light that comes from outside the window.
        tail_fraction: f64,
    },
    /// At least as wide as the widest window that was searched.
    Unbounded,
    /// Too few measurements to estimate it.
    Undetermined,
}

impl WindowSizeEstimate {
    /// The widest window that an estimate may come to.
    pub const MAX_WINDOW: Window = match Window::new(MAX_SIDE) {
        Ok(window) => window,
        Err(_) => panic!("the widest window is a window"),
    };

    /// Estimates the window.
    ///
    /// # Errors
    /// If the geometry is out of range, if no pixel sees the light plane, and if the executor is cancelled.
    pub async fn from_measurements(
        measurements: &Measurements,
        executor: &impl Executor,
    ) -> Result<Self, RecoverError> {
        let light = measurements.light;
        let max_side = MAX_SIDE.min((light.width.min(light.height) / 2).saturating_sub(1) | 1);
        let geometry = preparation_input::geometry(measurements, Window::new(max_side)?)?;
        let rings = WindowRings::new(max_side, group_count(&pattern_ids(&measurements.patterns)));
        let squares = sample_squares(measurements.camera);
        // Errors of neighbouring squares are correlated: each part is a strip of the picture.
        let position = |&TileRect { x, y, .. }: &TileRect| {
            measurements.camera.index(CameraPixel { x, y }) as f64
        };
        let order = ascending_order(squares.iter().map(position));
        let squares: Vec<TileRect> = order.into_iter().map(|i| squares[i]).collect();
        executor.check_cancelled()?;
        let uncorrected = CalibratedMeasurements::uncorrected(measurements);
        // A part of the picture for each job, and for the jackknife.
        let sum_part = |part: usize| {
            let mut sums = NormalEquations::zeros(rings.count());
            for square in &squares[share_of_jobs(squares.len(), part, PARTS)] {
                for (origin, pixels) in sampling::pixels_by_window(&geometry, *square) {
                    vectorise(
                        #[cfg_attr(target_arch = "x86_64", inline(always))]
                        || rings.add_window(&mut sums, &uncorrected, &geometry, origin, &pixels),
                    );
                }
            }
            values(&mut sums)
        };
        let parts = executor.all_gather(PARTS, sum_part).await?;
        let tail_fractions_without = |left_out: usize| {
            let mut total = NormalEquations::zeros(rings.count());
            let mut sums = values(&mut total);
            let used = (0..PARTS).filter(|&part| part != left_out);
            used.for_each(|part| add_scaled(&mut sums, 1.0, &parts[part]));
            set_values(&mut total, &sums);
            Some(rings.tail_fractions(&total.solve()?, max_side))
        };
        // None from too few measurements, or from dark photographs, which the recovery reports.
        let tails = tail_fractions_without(PARTS).unwrap_or_default();
        let without_part: Option<Vec<_>> = (0..PARTS).map(tail_fractions_without).collect();
        let errors = match without_part {
            Some(without_part) => jackknife_errors(&without_part, &tails),
            None => vec![f64::INFINITY; tails.len()],
        };
        choose_window(&tails, &errors, max_side)
    }
}

/// The division of the widest window into a centre and rings around it.
struct WindowRings {
    centre: u32,
    /// The region of each slot: the centre's elements are regions by themselves, and come first; then the rings, from
    /// the inside out.
    regions: Vec<usize>,
    sizes: Vec<f64>,
}

impl WindowRings {
    fn new(side: u32, patterns: usize) -> Self {
        let fits = |centre: &u32| *centre < side && 4 * (centre * centre) as usize <= 3 * patterns;
        let centre = CENTRE_SIDES.into_iter().find(fits).unwrap_or(1);
        let half = side / 2;
        let distance = |s: u32| (s / side).abs_diff(half).max((s % side).abs_diff(half));
        let centre_area = (centre * centre) as usize;
        let mut sizes = vec![0.0; centre_area + (half - centre / 2) as usize];
        let mut next = 0..centre_area;
        let region = |s: u32| {
            let region = match distance(s).checked_sub(centre / 2 + 1) {
                Some(ring) => centre_area + ring as usize,
                None => next.next().unwrap_or(0),
            };
            sizes[region] += 1.0;
            region
        };
        Self {
            centre,
            regions: (0..side * side).map(region).collect(),
            sizes,
        }
    }

    fn centre_area(&self) -> usize {
        (self.centre * self.centre) as usize
    }

    fn count(&self) -> usize {
        self.sizes.len() - self.centre_area()
    }

    /// Adds the equations of one window's pixels, for the flux of each ring.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn add_window(
        &self,
        sums: &mut NormalEquations,
        measurements: &CalibratedMeasurements<'_>,
        geometry: &Geometry,
        origin: LightElement,
        pixels: &PixelsSharingWindow,
    ) {
        let elements: Vec<_> = geometry.elements_of_window(origin).collect();
        let centre_area = self.centre_area();
        let is_centre = |&&(slot, _): &&(usize, usize)| self.regions[slot] < centre_area;
        if elements.iter().filter(is_centre).count() < centre_area {
            return; // The pixel's brightness is unknown.
        }
        let all: Vec<usize> = (0..measurements.patterns.len()).collect();
        let rings: Vec<usize> = (0..self.count()).collect();
        for (plane, channels) in measurements.planes() {
            let indices = sampling::unsaturated(measurements, &all, pixels, channels.clone());
            let patterns = indices.len();
            let mut centre = vec![0.0; self.sizes.len() * patterns];
            for (i, &l) in indices.iter().enumerate() {
                let pattern = measurements.patterns[l].plane(plane);
                for &(slot, m) in &elements {
                    let region = self.regions[slot];
                    centre[region * patterns + i] += f64::from(pattern[m]) / self.sizes[region];
                }
            }
            let columns = centre.split_off(centre_area * patterns);
            let weights = EquationWeights::uniform(patterns, CommonModeWeight::EXCLUDED);
            let centre = WeightedColumns::new(centre, weights.clone());
            let mut columns = WeightedColumns::new(columns, weights);
            let level = centre.means.iter().sum::<f64>() / centre_area as f64;
            if level <= 0.0 || !project_out(&mut columns, &centre) {
                continue;
            }
            let mut pooled =
                PooledMeasurements::new(measurements, &indices, pixels, channels, level);
            columns.weights.apply(&mut pooled.y);
            sums.add(&columns, &rings, pooled.certainty, &pooled.y);
        }
    }

    /// The tail fraction of each window from the narrowest to the last but one, of the flux of each ring.
    fn tail_fractions(&self, flux: &[f64], max_side: u32) -> Vec<f64> {
        let mut tails = flux[((MIN_SIDE.min(max_side) - self.centre) / 2) as usize..].to_vec();
        for ring in (1..tails.len()).rev() {
            tails[ring - 1] += tails[ring];
        }
        tails
    }
}

/// Replaces `columns` by their projection onto the complement of `others`. Returns false if the others depend on each
/// other linearly.
#[cfg_attr(target_arch = "x86_64", inline(always))]
fn project_out(columns: &mut WeightedColumns, others: &WeightedColumns) -> bool {
    let mut gram = others.gram();
    if linalg::cholesky(&mut gram, others.unknowns()).is_none() {
        return false;
    }
    for column in columns.columns.chunks_exact_mut(columns.weights.len()) {
        let mut shares: Vec<f64> = others.right_hand_side(column).collect();
        linalg::cholesky_solve(&gram, &mut shares);
        for (share, other) in shares.iter().zip(others.iter()) {
            add_scaled(column, -share, other);
        }
    }
    true
}

/// Standard errors of the values `all`, given their values `without_part` each part.
fn jackknife_errors(without_part: &[Vec<f64>], all: &[f64]) -> Vec<f64> {
    let parts = without_part.len() as f64;
    let error = |(i, all): (usize, &f64)| {
        let squares = without_part.iter().map(|values| (values[i] - all).powi(2));
        (squares.sum::<f64>() * (parts - 1.0) / parts).sqrt()
    };
    all.iter().enumerate().map(error).collect()
}

/// Chooses the window by the tail fractions of windows from the narrowest on, and their standard errors.
fn choose_window(
    tails: &[f64],
    errors: &[f64],
    max_side: u32,
) -> Result<WindowSizeEstimate, RecoverError> {
    let rings = tails.len();
    let is_small = |i: usize| match (tails.get(i), errors.get(i)) {
        (Some(tail), Some(error)) => tail.abs() <= MAX_TAIL_FRACTION && *error <= MAX_TAIL_FRACTION,
        _ => true, // Nothing is known of light from beyond the last ring.
    };
    // A single small value may be due to chance.
    let mut small = (0..rings).filter(|&i| is_small(i) && is_small(i + 1));
    let side = |rings: usize| MIN_SIDE.min(max_side) + 2 * rings as u32;
    let inside = small.next().map(|first| first + MARGIN_RINGS);
    // The last ring may be dark: the band then ends with the widest window.
    let mut but_last = tails.iter().zip(errors).take(rings.saturating_sub(1));
    let (side, band) = if let Some(inside) = inside.filter(|&i| i < rings) {
        let tail_fraction = tails[inside].max(0.0);
        (side(inside), TailEstimate::Bounded { tail_fraction })
    } else if rings > 1 && but_last.all(|(tail, error)| *tail > MAX_TAIL_FRACTION + 2.0 * error) {
        (side(rings), TailEstimate::Unbounded)
    } else {
        (DEFAULT_SIDE.min(max_side), TailEstimate::Undetermined)
    };
    Ok(WindowSizeEstimate {
        window: Window::new(side)?,
        band,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn window_ends_where_tail_fractions_are_small() {
        let rings = WindowRings::new(15, 100);
        let flux = [0.06, 0.035, 0.004, 0.001]; // out to sides 9, 11, 13 and 15
        let tails = rings.tail_fractions(&flux, 15);
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        for (tail, expected) in tails.iter().zip([0.1, 0.04, 0.005, 0.001]) {
            assert!(close(*tail, expected), "{tails:?}");
        }
        let errors = [0.001; 4];
        // A window of 11 leaves 0.5 %, and there is a ring of margin.
        let bounded = choose_window(&tails, &errors, 15).unwrap();
        assert_eq!(bounded.window.side(), 13);
        assert!(matches!(
            bounded.band,
            TailEstimate::Bounded { tail_fraction } if close(tail_fraction, 0.001)
        ));
        // Where no ring is dark, and that is certain, the band is as wide as the widest window.
        let unbounded = choose_window(&[0.1, 0.06, 0.04, 0.02], &errors, 15).unwrap();
        assert_eq!(unbounded.window.side(), 15);
        assert_eq!(unbounded.band, TailEstimate::Unbounded);
        let edge = choose_window(&[0.1, 0.06, 0.04, 0.002], &errors, 15).unwrap();
        assert_eq!(edge.band, TailEstimate::Unbounded);
        let uncertain = choose_window(&[0.1; 12], &[0.06; 12], 31).unwrap();
        assert_eq!(uncertain.window.side(), 15);
        assert_eq!(uncertain.band, TailEstimate::Undetermined);
    }

    #[test]
    fn centre_and_rings_cover_the_window() {
        for (side, patterns, centre) in [(3, 80, 1), (7, 80, 5), (9, 20, 3), (31, 80, 7)] {
            let rings = WindowRings::new(side, patterns);
            assert_eq!(rings.centre, centre);
            assert_eq!(rings.sizes.iter().sum::<f64>(), f64::from(side * side));
            assert!(rings.sizes.iter().all(|&size| size >= 1.0));
        }
    }
}
