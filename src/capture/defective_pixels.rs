//! Hot and dead pixels of the sensor: their samples are filled from their neighbours.
//!
//! A pixel is hot if it is saturated in nearly all photographs, and neither of its neighbours in the row is. It is dead if it
//! has one code in all photographs, and both of its neighbours receive light: lead between panes of glass receives none
//! either, but its codes vary by the read noise. Only neighbours in the row are compared, so that a pixel is filled alike
//! whatever pixels are loaded beside it and [`MARGIN`] pixels on either side.

use std::ops::{AddAssign, Range};

use serde::{Deserialize, Serialize};

use super::measurements::Measurements;
use crate::transport::CHANNELS;

/// Distance in the row, in camera pixels, of the measurements that a filled pixel depends on: a dead pixel is filled from its
/// neighbours, which are filled from theirs if they are hot.
pub(crate) const MARGIN: u32 = 2;

/// Share of the photographs that saturate a hot pixel, at least, and its neighbours, at most.
const MIN_HOT_SHARE: f64 = 0.9;
const MAX_NEIGHBOUR_SHARE: f64 = 0.1;
/// Fewest photographs in which a dead pixel has one code.
const MIN_DEAD_PHOTOGRAPHS: usize = 8;
/// Standard deviation of the read noise, by the distance of the codes, below which a pixel without light may have one code
/// in all photographs, too.
const MIN_READ_NOISE: f64 = 0.5;
/// Standard deviations of the read noise that neighbours of a dead pixel exceed on the average of all photographs.
const MIN_NEIGHBOUR_LIGHT: f64 = 10.0;

/// Numbers of pixels whose samples are filled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DefectivePixels {
    /// Those that are saturated in nearly all photographs.
    pub hot: usize,
    /// Those that have one code in all photographs.
    pub dead: usize,
}

impl AddAssign for DefectivePixels {
    fn add_assign(&mut self, other: Self) {
        self.hot = self.hot.saturating_add(other.hot);
        self.dead = self.dead.saturating_add(other.dead);
    }
}

impl Measurements {
    /// Fills hot pixels, then dead ones, in the loaded part of `rows`; codes are `quantum` apart.
    /// Pixels without a loaded neighbour stay as they are. Returns the numbers of filled pixels.
    pub fn fill_defective_pixels(&mut self, rows: Range<u32>, quantum: f64) -> DefectivePixels {
        DefectivePixels {
            hot: self.fill_hot_pixels(rows.clone()),
            dead: self.fill_dead_pixels(rows, quantum),
        }
    }

    /// Replaces the samples of hot pixels by the means of their neighbours in the row. Returns their number.
    fn fill_hot_pixels(&mut self, rows: Range<u32>) -> usize {
        let is_hot = |row: &PixelSpan<f64>, x: usize, neighbours: [usize; 2]| {
            let [a, b] = neighbours.map(|x| row.values[x]);
            row.values[x] >= MIN_HOT_SHARE && a.max(b) <= MAX_NEIGHBOUR_SHARE
        };
        self.fill_pixels(rows, Self::saturated_share, is_hot)
    }

    /// Replaces the samples of dead pixels by the means of their neighbours in the row. Returns their number.
    fn fill_dead_pixels(&mut self, rows: Range<u32>, quantum: f64) -> usize {
        let read_noise = self.noise.floor.map(f64::sqrt);
        if read_noise
            .iter()
            .any(|noise| *noise < MIN_READ_NOISE * quantum)
        {
            return 0;
        }
        let is_dead = |row: &PixelSpan<bool>, x: usize, neighbours: [usize; 2]| {
            let is_lit = |n: usize| {
                (0..CHANNELS)
                    .any(|c| row.measurements.mean(n, c) > MIN_NEIGHBOUR_LIGHT * read_noise[c])
            };
            row.values[x] && neighbours.iter().all(|&x| is_lit(row.start + x))
        };
        // The first photograph of the same exposure, at which one code is one measurement.
        let full_scales = self.full_scale.iter();
        let first = full_scales.map(|own| self.full_scale.iter().position(|other| other == own));
        let first: Vec<usize> = first.flatten().collect();
        self.fill_pixels(
            rows,
            |measurements, n| measurements.has_one_code(n, &first),
            is_dead,
        )
    }

    /// Fills the pixels of which `is_defective` holds, given their span with a value of each pixel, their place in it and
    /// those of their neighbours. Returns their number.
    fn fill_pixels<V>(
        &mut self,
        rows: Range<u32>,
        value: impl Fn(&Self, usize) -> V,
        is_defective: impl Fn(&PixelSpan<'_, V>, usize, [usize; 2]) -> bool,
    ) -> usize {
        let width = self.camera.width;
        if width < 2 {
            return 0;
        }
        let mut filled = 0;
        let mut start = self.loaded.count_above(rows.start);
        let rows = self.loaded.rows().iter().filter(|y| rows.contains(y));
        let spans: Vec<Range<u32>> = rows.flat_map(|y| self.loaded.spans_of(y)).collect();
        for columns in spans {
            let count = columns.len();
            // At the border of the picture there is one neighbour.
            let neighbours = |x: usize| match x {
                0 if columns.start == 0 => (count > 1).then_some([1, 1]),
                x if x + 1 == count && columns.end == width => Some([x.checked_sub(1)?; 2]),
                x => (x + 1 < count).then_some([x.checked_sub(1)?, x + 1]),
            };
            let span = PixelSpan {
                measurements: self,
                start,
                values: (start..start + count).map(|n| value(self, n)).collect(),
            };
            let defective = (0..count).filter_map(|x| {
                let neighbours = neighbours(x)?;
                is_defective(&span, x, neighbours).then_some((x, neighbours))
            });
            let defective: Vec<(usize, [usize; 2])> = defective.collect();
            for photo in &mut self.photos {
                // Not from neighbours that are filled now.
                let mean = |&(x, [a, b]): &(usize, [usize; 2])| {
                    let [a, b] = [a, b].map(|x| photo[start + x]);
                    (x, std::array::from_fn(|c| 0.5 * (a[c] + b[c])))
                };
                let means: Vec<(usize, [f32; CHANNELS])> = defective.iter().map(mean).collect();
                (means.into_iter()).for_each(|(x, mean)| photo[start + x] = mean);
            }
            filled += defective.len();
            start += count;
        }
        filled
    }

    /// Share of the photographs that saturate a channel of pixel `n`.
    fn saturated_share(&self, n: usize) -> f64 {
        let saturated = |photo: &&Vec<[f32; 3]>| photo[n].iter().any(|y| y.is_nan());
        let count = self.photos.iter().filter(saturated).count();
        count as f64 / self.photos.len() as f64
    }

    /// Whether pixel `n` has one code in all photographs: the measurement of the `first` photograph of each one's exposure.
    fn has_one_code(&self, n: usize, first: &[usize]) -> bool {
        let repeated = first.iter().enumerate().filter(|(l, first)| *l != **first);
        repeated.clone().count() + 1 >= MIN_DEAD_PHOTOGRAPHS
            && repeated
                .into_iter()
                .all(|(l, &first)| self.photos[l][n] == self.photos[first][n])
    }

    /// Mean of the samples of pixel `n` that are not saturated, in channel `c`.
    fn mean(&self, n: usize, c: usize) -> f64 {
        let samples = self.photos.iter().map(|photo| f64::from(photo[n][c]));
        let samples = samples.filter(|y| !y.is_nan());
        let (sum, count) = samples.fold((0.0, 0.0), |(sum, count), y| (sum + y, count + 1.0));
        sum / f64::max(count, 1.0)
    }
}

/// Loaded pixels that are adjacent in a row, with a value of each.
struct PixelSpan<'a, V> {
    measurements: &'a Measurements,
    /// Index of its first pixel.
    start: usize,
    values: Vec<V>,
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use crate::recover::test_problems::SyntheticCapture;

    #[test]
    fn hot_pixels_are_filled_and_no_others() {
        let mut measurements = SyntheticCapture::smooth(12).measurements;
        let clean = measurements.photos.clone();
        assert_eq!(measurements.fill_hot_pixels(0..u32::MAX), 0);
        assert_eq!(measurements.photos, clean);
        let (hot, corner) = (5 * 32 + 7, 31 * 32 + 31);
        for photo in &mut measurements.photos {
            photo[hot] = [f32::NAN; 3];
            photo[corner] = [f32::NAN; 3];
        }
        assert_eq!(measurements.fill_hot_pixels(0..u32::MAX), 2);
        for (photo, clean) in measurements.photos.iter().zip(&clean) {
            for n in 0..clean.len() {
                let expected = match n {
                    n if n == hot => 0.5 * (clean[n - 1][1] + clean[n + 1][1]),
                    n if n == corner => clean[n - 1][1],
                    n => clean[n][1],
                };
                assert!((photo[n][1] - expected).abs() < 1e-6, "pixel {n}");
            }
        }
        // A saturated area is no defect.
        for photo in &mut measurements.photos {
            photo[40..50].fill([f32::NAN; 3]);
        }
        assert_eq!(measurements.fill_hot_pixels(0..u32::MAX), 0);
    }

    #[test]
    fn dead_pixels_are_filled_unless_the_read_noise_cannot_tell_them() {
        const QUANTUM: f64 = 1e-5;
        let mut measurements = SyntheticCapture::smooth(12).measurements;
        measurements.noise.floor = [QUANTUM * QUANTUM; 3];
        // Two photographs have another exposure, of which one code is another measurement.
        for l in [3, 7] {
            measurements.full_scale[l] = 2.0;
        }
        let clean = measurements.photos.clone();
        assert_eq!(measurements.fill_dead_pixels(0..u32::MAX, QUANTUM), 0);
        let (dead, dark) = (5 * 32 + 7, 9 * 32 + 7);
        for (l, photo) in measurements.photos.iter_mut().enumerate() {
            photo[dead] = [if [3, 7].contains(&l) { -0.0005 } else { -0.001 }; 3];
            // Without light, samples vary.
            photo[dark] = [1e-5 * (l % 2) as f32; 3];
        }
        let coarse = measurements
            .clone()
            .fill_dead_pixels(0..u32::MAX, 3.0 * QUANTUM);
        assert_eq!(coarse, 0);
        assert_eq!(measurements.fill_dead_pixels(0..u32::MAX, QUANTUM), 1);
        for (photo, clean) in measurements.photos.iter().zip(&clean) {
            let expected = 0.5 * (clean[dead - 1][1] + clean[dead + 1][1]);
            assert!((photo[dead][1] - expected).abs() < 1e-6);
            assert!(photo[dark][1] < 2e-5);
        }
        // Beside lead, a pixel without light is none.
        for photo in &mut measurements.photos {
            photo[dead - 1] = [0.0; 3];
            photo[dead] = [0.0; 3];
        }
        assert_eq!(measurements.fill_dead_pixels(0..u32::MAX, QUANTUM), 0);
    }
}
