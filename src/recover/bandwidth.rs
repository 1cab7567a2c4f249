//! How wide the band is: what share of a pixel's light reaches it from how far off.
//!
//! What the rings of light elements around a pixel send it, as a share of all, is fitted to many pixels'
//! measurements at once by plain least squares. What its own few elements send differs from pixel to
//! pixel, and is left out: the equations are projected onto what does not depend on it. No sign is
//! imposed, so that rings beyond the band come out near zero, on either side of it, rather than
//! gathering noise.

use super::RecoverError;
use super::holdout::numbers;
use super::pooled::DEVIATION;
use super::sampling::{
    mean_variance, pixels_by_window, reaches_display, spread_squares, unsaturated,
};
use crate::capture::{Measurements, distinct};
use crate::executor::Executor;
use crate::linalg::{self, add_scaled, dot, vectorise};
use crate::transport::{CameraPx, Element, Geometry, Window};

/// Side of the window that the band is looked for in.
const PROBE: u32 = 31;
/// Side of the smallest window.
const LEAST: u32 = 7;
/// Side where nothing can be told.
const USUAL: u32 = 15;
/// Sides of what counts as a pixel's own elements; the largest whose number is at most three quarters
/// of that of the patterns.
const OWN: [u32; 4] = [7, 5, 3, 1];
/// Largest share of a pixel's light left outside the window chosen.
const LEAK: f64 = 0.01;
/// Rings added: the mean function is narrower than the widest ones.
const MARGIN: usize = 1;
/// Squares of the picture looked at, and their side in pixels.
const SQUARES: (usize, u32) = (1024, 4);
/// Parts that the squares are divided into; fixed, so that sums do not depend on threads.
const PARTS: usize = 8;

/// A window to recover with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowEstimate {
    /// The smallest window that holds nearly all of the band, as far as that is known.
    pub window: Window,
    /// What is known of the light from outside it.
    pub bandwidth: BandwidthEstimate,
}

/// How far the band reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BandwidthEstimate {
    /// Not much farther than the window.
    Bounded {
        /// Estimated share of a pixel's light that comes from outside the window.
        tail_fraction: f64,
    },
    /// As far as was looked, or farther.
    Unbounded,
    /// Too few measurements to tell.
    Undetermined,
}

impl WindowEstimate {
    /// The largest window an estimate may come to.
    pub const MAX_WINDOW: Window = match Window::new(PROBE) {
        Ok(window) => window,
        Err(_) => panic!("the probing window is a window"),
    };

    /// Estimates the band from what is at hand of `measurements`.
    pub fn from_measurements(
        measurements: &Measurements,
        executor: &impl Executor,
    ) -> Result<Self, RecoverError> {
        let light = measurements.light;
        let probe = PROBE.min((light.width.min(light.height) / 2).saturating_sub(1) | 1);
        let geometry = Geometry {
            camera: measurements.camera,
            light,
            window: Window::new(probe)?,
            correspondence: measurements.correspondence,
            tile_side: Geometry::DEFAULT_TILE_SIDE,
        }
        .validate()?;
        if !reaches_display(&geometry) {
            return Err(RecoverError::CorrespondenceOffLightPlane);
        }
        let patterns = distinct(&numbers(&measurements.patterns));
        let rings = Rings::new(probe, patterns);
        let mut squares = spread_squares(measurements, SQUARES.1, SQUARES.0);
        // Each part a piece of the picture: what lies beside each other errs alike.
        squares.sort_by_key(|square| (square.y, square.x));
        executor.check_cancelled()?;
        let parts = executor.map(PARTS, |part| {
            let mut sums = Sums::new(rings.sizes.len());
            let share = |part: usize| part * squares.len() / PARTS;
            for square in &squares[share(part)..share(part + 1)] {
                for (origin, pixels) in pixels_by_window(&geometry, *square) {
                    vectorise(
                        #[inline(always)]
                        || sums.add(measurements, &geometry, &rings, (origin, &pixels)),
                    );
                }
            }
            sums
        });
        // From all parts but one, and from all.
        let leaks = |but: usize| {
            let mut total = Sums::new(rings.sizes.len());
            let parts = parts.iter().enumerate().filter(|(part, _)| *part != but);
            parts.for_each(|(_, part)| total.merge(part));
            let flux = total.solve();
            flux.map(|flux| rings.leaks(&flux, probe))
        };
        let Some(all) = leaks(PARTS) else {
            return unclear(probe); // or dark, which recovery says
        };
        let without: Option<Vec<Vec<f64>>> = (0..PARTS).map(leaks).collect();
        let errors = match without {
            Some(without) => jackknife(&without, &all),
            None => vec![f64::INFINITY; all.len()],
        };
        band(&all, &errors, probe)
    }
}

/// Elements of the probing window by their distance from its middle.
struct Rings {
    /// Side of what is a pixel's own.
    own: u32,
    /// Of each slot: its place among the pixel's own, or the ring it is in.
    of: Vec<Place>,
    /// Elements in each ring, from the inside out.
    sizes: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
enum Place {
    Own(usize),
    Ring(usize),
}

impl Rings {
    fn new(probe: u32, patterns: usize) -> Self {
        let fits = |own: &u32| *own < probe && 4 * (own * own) as usize <= 3 * patterns;
        let own = OWN.into_iter().find(fits).unwrap_or(1);
        let half = probe / 2;
        let distance = |s: u32| (s / probe).abs_diff(half).max((s % probe).abs_diff(half));
        let mut sizes = vec![0.0; (half - own / 2) as usize];
        let mut next = 0;
        let place = |s: u32| match distance(s).checked_sub(own / 2 + 1) {
            Some(ring) => {
                sizes[ring as usize] += 1.0;
                Place::Ring(ring as usize)
            }
            None => {
                next += 1;
                Place::Own(next - 1)
            }
        };
        let of = (0..probe * probe).map(place).collect();
        Self { own, of, sizes }
    }

    /// Light from outside the least window and the first rings, for every number of rings but all,
    /// of the flux in each ring.
    fn leaks(&self, flux: &[f64], probe: u32) -> Vec<f64> {
        let rings = &flux[((LEAST.min(probe) - self.own) / 2) as usize..];
        let mut outside = 0.0;
        let leaks = rings.iter().rev().map(|ring| {
            outside += ring;
            outside
        });
        let mut leaks: Vec<f64> = leaks.collect();
        leaks.reverse();
        leaks
    }
}

/// The band, where windows from the least on leave out `leaks`, give or take `errors`.
fn band(leaks: &[f64], errors: &[f64], probe: u32) -> Result<WindowEstimate, RecoverError> {
    let rings = leaks.len();
    // One that is low by chance is not enough, and beyond the last there is none.
    let low = |i: usize| match (leaks.get(i), errors.get(i)) {
        (Some(leak), Some(error)) => leak.abs() <= LEAK && *error <= LEAK,
        _ => true,
    };
    let held = (0..rings).find(|&i| low(i) && low(i + 1));
    let side = |inside: usize| Window::new(LEAST.min(probe) + 2 * inside as u32);
    if let Some(inside) = held.map(|held| held + MARGIN).filter(|&i| i < rings) {
        return Ok(WindowEstimate {
            window: side(inside)?,
            bandwidth: BandwidthEstimate::Bounded {
                tail_fraction: leaks[inside].max(0.0),
            },
        });
    }
    // The last may be low: the band then ends where the looking does.
    let mut but_last = leaks.iter().zip(errors).take(rings.saturating_sub(1));
    match rings > 1 && but_last.all(|(leak, error)| *leak > LEAK + 2.0 * error) {
        true => Ok(WindowEstimate {
            window: side(rings)?,
            bandwidth: BandwidthEstimate::Unbounded,
        }),
        false => unclear(probe),
    }
}

fn unclear(probe: u32) -> Result<WindowEstimate, RecoverError> {
    Ok(WindowEstimate {
        window: Window::new(USUAL.min(probe))?,
        bandwidth: BandwidthEstimate::Undetermined,
    })
}

/// Standard errors of `all`, from what they are `without` each part.
fn jackknife(without: &[Vec<f64>], all: &[f64]) -> Vec<f64> {
    let parts = without.len() as f64;
    let error = |(i, all): (usize, &f64)| {
        let squares = without.iter().map(|leaks| (leaks[i] - all).powi(2));
        (squares.sum::<f64>() * (parts - 1.0) / parts).sqrt()
    };
    all.iter().enumerate().map(error).collect()
}

/// Normal equations of the rings' flux.
struct Sums {
    rings: usize,
    /// `[ring, ring]`, upper triangle.
    gram: Vec<f64>,
    right: Vec<f64>,
}

impl Sums {
    fn new(rings: usize) -> Self {
        Self {
            rings,
            gram: vec![0.0; rings * rings],
            right: vec![0.0; rings],
        }
    }

    fn merge(&mut self, other: &Self) {
        add_scaled(&mut self.gram, 1.0, &other.gram);
        add_scaled(&mut self.right, 1.0, &other.right);
    }

    #[inline(always)]
    fn add(
        &mut self,
        measurements: &Measurements,
        geometry: &Geometry,
        rings: &Rings,
        (origin, pixels): (Element, &[(usize, CameraPx)]),
    ) {
        let (light, window) = (geometry.light, geometry.window);
        let elements: Vec<(usize, Place)> = (0..window.area())
            .filter_map(|slot| {
                let m = window.element(origin, slot).index_in(light)?;
                Some((m, rings.of[slot]))
            })
            .collect();
        let own = |(_, place): &&(usize, Place)| matches!(place, Place::Own(_));
        if elements.iter().filter(own).count() < (rings.own * rings.own) as usize {
            return; // How bright it is cannot be told.
        }
        let all: Vec<usize> = (0..measurements.patterns.len()).collect();
        for (plane, channels) in measurements.planes() {
            let rows = unsaturated(measurements, &all, pixels, channels.clone());
            let patterns = rows.len();
            let mut own = vec![0.0; (rings.own * rings.own) as usize * patterns];
            let mut columns = vec![0.0; self.rings * patterns];
            for (i, &l) in rows.iter().enumerate() {
                let pattern = measurements.patterns[l].plane(plane);
                for &(m, place) in &elements {
                    let p = f64::from(pattern[m]);
                    match place {
                        Place::Own(k) => own[k * patterns + i] += p,
                        Place::Ring(r) => columns[r * patterns + i] += p / rings.sizes[r],
                    }
                }
            }
            let level = own.iter().sum::<f64>() / own.len() as f64;
            if level <= 0.0 || !leave_out(&mut own, &mut columns, patterns) {
                continue;
            }
            let mut seen = vec![0.0; patterns];
            let mut energy = 0.0;
            for &(_, pixel) in pixels {
                for c in channels.clone() {
                    let y = rows.iter().map(|&l| measurements.sample(l, pixel, c));
                    let y: Vec<f64> = y.collect();
                    let mean = y.iter().sum::<f64>() / patterns as f64;
                    // Also false where some sample is saturated.
                    if mean > 0.0 {
                        let brightness = mean / level;
                        let noise =
                            mean_variance(measurements, &rows, c, mean) / brightness.powi(2);
                        let weight = 1.0 / (DEVIATION.powi(2) + noise);
                        energy += weight;
                        add_scaled(&mut seen, weight / brightness, &y);
                    }
                }
            }
            for i in 0..self.rings {
                let a = &columns[i * patterns..(i + 1) * patterns];
                self.right[i] += dot(a, &seen);
                for j in i..self.rings {
                    let b = &columns[j * patterns..(j + 1) * patterns];
                    self.gram[i * self.rings + j] += energy * dot(a, b);
                }
            }
        }
    }

    /// Flux of each ring; `None` without light.
    fn solve(mut self) -> Option<Vec<f64>> {
        linalg::cholesky(&mut self.gram, self.rings)?;
        linalg::cholesky_solve(&self.gram, &mut self.right);
        Some(self.right)
    }
}

/// Takes from `columns`, `[ring, pattern]`, their means and all that those of a pixel's own elements,
/// `[element, pattern]`, can show. False where these are not independent.
#[inline(always)]
fn leave_out(own: &mut [f64], columns: &mut [f64], patterns: usize) -> bool {
    for column in own
        .chunks_exact_mut(patterns)
        .chain(columns.chunks_exact_mut(patterns))
    {
        let mean = column.iter().sum::<f64>() / patterns as f64;
        column.iter_mut().for_each(|p| *p -= mean);
    }
    let own: Vec<&[f64]> = own.chunks_exact(patterns).collect();
    let k = own.len();
    let mut gram = vec![0.0; k * k];
    for i in 0..k {
        for j in i..k {
            gram[i * k + j] = dot(own[i], own[j]);
        }
    }
    if linalg::cholesky(&mut gram, k).is_none() {
        return false;
    }
    let mut share = vec![0.0; k];
    for column in columns.chunks_exact_mut(patterns) {
        for (share, own) in share.iter_mut().zip(&own) {
            *share = dot(own, column);
        }
        linalg::cholesky_solve(&gram, &mut share);
        for (share, own) in share.iter().zip(&own) {
            add_scaled(column, -share, own);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_band_ends_where_rings_stay_dark() {
        let rings = Rings::new(15, 100);
        let flux = [0.06, 0.035, 0.004, 0.001]; // out to sides 9, 11, 13 and 15
        let leaks = rings.leaks(&flux, 15);
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        for (leak, expected) in leaks.iter().zip([0.1, 0.04, 0.005, 0.001]) {
            assert!(close(*leak, expected), "{leaks:?}");
        }
        let sure = [0.001; 4];
        // A window of 11 leaves 0.5 %, and there is a ring of margin.
        let found = band(&leaks, &sure, 15).unwrap();
        assert_eq!(found.window.side(), 13);
        assert!(
            matches!(found.bandwidth, BandwidthEstimate::Bounded { tail_fraction } if close(tail_fraction, 0.001))
        );
        // Where rings never stay dark the band is as wide as was looked, if that is sure.
        let far = [0.1, 0.06, 0.04, 0.02];
        let beyond = band(&far, &sure, 15).unwrap();
        assert_eq!(
            (beyond.window.side(), beyond.bandwidth),
            (15, BandwidthEstimate::Unbounded)
        );
        let edge = band(&[0.1, 0.06, 0.04, 0.002], &sure, 15).unwrap();
        assert_eq!(edge.bandwidth, BandwidthEstimate::Unbounded);
        let unclear = band(&[0.1; 12], &[0.06; 12], 31).unwrap();
        assert_eq!(
            (unclear.window.side(), unclear.bandwidth),
            (15, BandwidthEstimate::Undetermined)
        );
    }

    #[test]
    fn rings_cover_the_window() {
        for (probe, patterns, own) in [(3, 80, 1), (7, 80, 5), (9, 20, 3), (31, 80, 7)] {
            let rings = Rings::new(probe, patterns);
            assert_eq!(rings.own, own);
            let elements = rings.sizes.iter().sum::<f64>() + f64::from(own * own);
            assert_eq!(elements, f64::from(probe * probe));
            assert!(rings.sizes.iter().all(|&size| size >= 1.0));
        }
    }
}
