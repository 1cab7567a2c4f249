//! How wide the band is: what share of a pixel's light reaches it from how far off.
//!
//! The mean light transport function, a pixel's brightness taken out, is fitted to many pixels'
//! measurements at once by plain least squares: single elements near the centre, whole rings farther
//! out. No sign is imposed, so that rings beyond the band come out near zero, on either side of it,
//! rather than gathering noise.

use super::dense;
use super::pooled::{DEVIATION, dark_or_overexposed};
use super::sample::{mean_variance, reaches_display, spread, unsaturated, windows};
use super::vector::{add_scaled, dot, vectorised};
use super::workers::go_on;
use super::{RecoverError, Workers};
use crate::capture::Measurements;
use crate::transport::{CameraPx, Element, Geometry, Window};

/// Side of the window that the band is looked for in.
const PROBE: u32 = 31;
/// Side of the window's middle, where elements count one by one.
const MIDDLE: u32 = 7;
/// Largest share of a pixel's light left outside the window chosen.
const LEAK: f64 = 0.01;
/// Rings added: the mean function is narrower than the widest ones.
const MARGIN: usize = 1;
/// Squares of the picture looked at, and their side in pixels.
const SQUARES: (usize, u32) = (1024, 4);
/// Parts that the squares are divided into; fixed, so that sums do not depend on threads.
const PARTS: usize = 8;

/// A window, and the light that it leaves out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// The smallest window that holds nearly all of the band.
    pub window: Window,
    /// Estimated share of a pixel's light that comes from outside it; `None` where the window is as
    /// wide as was looked, so that nothing is known of what lies outside.
    pub leak: Option<f64>,
}

impl Band {
    /// The largest window an estimate may come to.
    pub const MOST: Window = match Window::new(PROBE) {
        Ok(window) => window,
        Err(_) => panic!("the probing window is a window"),
    };

    /// Estimates the band from what is at hand of `measurements`.
    pub fn estimate(
        measurements: &Measurements,
        workers: &impl Workers,
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
            return Err(RecoverError::NoLight);
        }
        let groups = Groups::new(probe);
        let squares = spread(measurements, SQUARES.1, SQUARES.0);
        // Brightness is known only once the function is, roughly.
        let mut profile = vec![1.0 / groups.count as f64; groups.count];
        for _ in 0..3 {
            go_on(workers)?;
            let parts = workers.map(PARTS, |part| {
                let mut sums = Sums::new(groups.count);
                for square in squares.iter().skip(part).step_by(PARTS) {
                    for (origin, pixels) in windows(&geometry, *square) {
                        vectorised(
                            #[inline(always)]
                            || {
                                sums.add(
                                    measurements,
                                    &geometry,
                                    (&groups, &profile),
                                    (origin, &pixels),
                                )
                            },
                        );
                    }
                }
                sums
            });
            let mut total = Sums::new(groups.count);
            parts.iter().for_each(|part| total.merge(part));
            profile = total
                .solve()
                .ok_or_else(|| dark_or_overexposed(measurements, &squares))?;
        }
        groups.band(&profile, probe)
    }
}

/// Elements of the probing window that are taken together.
struct Groups {
    /// Group of each slot.
    of: Vec<usize>,
    /// Elements in each group.
    sizes: Vec<f64>,
    count: usize,
}

impl Groups {
    fn new(probe: u32) -> Self {
        let (half, middle) = (probe / 2, MIDDLE.min(probe));
        let first = (middle * middle) as usize;
        let ring = |s: u32| (s / probe).abs_diff(half).max((s % probe).abs_diff(half));
        let mut next = 0;
        let of: Vec<usize> = (0..probe * probe)
            .map(|s| match ring(s) {
                r if r <= middle / 2 => {
                    next += 1;
                    next - 1
                }
                r => first + (r - middle / 2 - 1) as usize,
            })
            .collect();
        let count = first + (half - middle / 2) as usize;
        let mut sizes = vec![0.0; count];
        of.iter().for_each(|&g| sizes[g] += 1.0);
        Self { of, sizes, count }
    }

    /// The band of the flux in each group.
    fn band(&self, flux: &[f64], probe: u32) -> Result<Band, RecoverError> {
        let total: f64 = flux.iter().sum();
        let rings = &flux[(MIDDLE * MIDDLE).min(probe * probe) as usize..];
        // Light from outside the middle and the first rings, for every number of rings.
        let mut leaks = vec![0.0; rings.len() + 1];
        for (i, ring) in rings.iter().enumerate().rev() {
            leaks[i] = leaks[i + 1] + ring / total;
        }
        // Estimates are good to some half per cent: one that is low by chance is not enough.
        let low = |leak: &f64| leak.abs() <= LEAK;
        let held = leaks.windows(2).position(|pair| pair.iter().all(low));
        let inside = (held.unwrap_or(rings.len()) + MARGIN).min(rings.len());
        Ok(Band {
            window: Window::new(MIDDLE.min(probe) + 2 * inside as u32)?,
            leak: (inside < rings.len()).then(|| leaks[inside].max(0.0)),
        })
    }
}

/// Normal equations of the groups' flux.
struct Sums {
    count: usize,
    /// `[group, group]`, upper triangle.
    gram: Vec<f64>,
    right: Vec<f64>,
}

impl Sums {
    fn new(count: usize) -> Self {
        Self {
            count,
            gram: vec![0.0; count * count],
            right: vec![0.0; count],
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
        (groups, flux): (&Groups, &[f64]),
        (origin, pixels): (Element, &[(usize, CameraPx)]),
    ) {
        let (light, window) = (geometry.light, geometry.window);
        let elements: Vec<usize> = (0..window.area())
            .map_while(|slot| window.element(origin, slot).index_in(light))
            .collect();
        if elements.len() < window.area() {
            return; // Of what lies off the display nothing can be said.
        }
        let all: Vec<usize> = (0..measurements.patterns.len()).collect();
        for (plane, channels) in measurements.planes() {
            let rows = unsaturated(measurements, &all, pixels, channels.clone());
            let patterns = rows.len();
            let mut columns = vec![0.0; groups.count * patterns];
            for (i, &l) in rows.iter().enumerate() {
                let pattern = measurements.patterns[l].plane(plane);
                for (&m, &g) in elements.iter().zip(&groups.of) {
                    columns[g * patterns + i] += f64::from(pattern[m]);
                }
            }
            let mut level = 0.0;
            for ((column, size), flux) in columns
                .chunks_exact_mut(patterns)
                .zip(&groups.sizes)
                .zip(flux)
            {
                let mean = column.iter().sum::<f64>() / patterns as f64;
                column.iter_mut().for_each(|p| *p = (*p - mean) / size);
                level += flux * mean / size;
            }
            if level <= 0.0 {
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
            for i in 0..groups.count {
                let a = &columns[i * patterns..(i + 1) * patterns];
                self.right[i] += dot(a, &seen);
                for j in i..groups.count {
                    let b = &columns[j * patterns..(j + 1) * patterns];
                    self.gram[i * groups.count + j] += energy * dot(a, b);
                }
            }
        }
    }

    /// Flux of each group; `None` without light.
    fn solve(mut self) -> Option<Vec<f64>> {
        let ridge = 1e-9 * self.gram[0];
        (0..self.count).for_each(|i| self.gram[i * self.count + i] += ridge);
        dense::cholesky(&mut self.gram, self.count)?;
        dense::solve(&self.gram, &mut self.right);
        (self.right.iter().sum::<f64>() > 0.0).then_some(self.right)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_band_ends_where_rings_stay_dark() {
        let groups = Groups::new(15);
        let middle = (MIDDLE * MIDDLE) as usize;
        let mut flux = vec![0.0; groups.count];
        flux[middle / 2] = 0.9;
        flux[middle] = 0.06; // out to side 9
        flux[middle + 1] = 0.035; // out to side 11
        flux[middle + 2] = 0.004; // out to side 13
        flux[middle + 3] = 0.001; // out to side 15
        let band = groups.band(&flux, 15).unwrap();
        assert_eq!(band.window.side(), 13); // 11 leaves 0.5 %, and a ring of margin
        assert!((band.leak.unwrap() - 0.001).abs() < 1e-12);
        // Where rings never stay dark the window is as wide as was looked, and that is all there is to
        // say.
        flux[middle + 3] = 0.02;
        let band = groups.band(&flux, 15).unwrap();
        assert_eq!((band.window.side(), band.leak), (15, None));
    }

    #[test]
    fn groups_cover_the_window() {
        for probe in [3, 7, 9, 31] {
            let groups = Groups::new(probe);
            assert_eq!(groups.sizes.iter().sum::<f64>(), f64::from(probe * probe));
            assert!(groups.sizes.iter().all(|&size| size >= 1.0));
        }
    }
}
