//! Hot pixels of the sensor: their samples are filled from their neighbours.
//!
//! A pixel is hot if it is saturated in nearly all photographs, and neither of its neighbours in the row is. Only rows are
//! compared, so that a row is filled alike whatever other rows are loaded. A dead pixel cannot be told from lead between
//! panes of glass, and spoils no more than itself.

use super::measurements::Measurements;

/// Share of the photographs that saturate a hot pixel, at least, and its neighbours, at most.
const MIN_HOT_SHARE: f64 = 0.9;
const MAX_NEIGHBOUR_SHARE: f64 = 0.1;

impl Measurements {
    /// Replaces the samples of hot pixels by the means of their neighbours in the row. Returns their number.
    pub fn fill_hot_pixels(&mut self) -> usize {
        let width = self.camera.width as usize;
        if width < 2 {
            return 0;
        }
        let mut filled = 0;
        for row in 0..self.rows.count() {
            let saturated: Vec<f64> = (row * width..(row + 1) * width)
                .map(|n| self.saturated_share(n))
                .collect();
            for x in 0..width {
                // At the border, the only one.
                let neighbours = match x {
                    0 => [1, 1],
                    x if x + 1 == width => [x - 1, x - 1],
                    x => [x - 1, x + 1],
                };
                let is_steady = neighbours
                    .iter()
                    .all(|&x| saturated[x] <= MAX_NEIGHBOUR_SHARE);
                if saturated[x] >= MIN_HOT_SHARE && is_steady {
                    let [a, b] = neighbours.map(|x| row * width + x);
                    for photo in &mut self.photos {
                        photo[row * width + x] =
                            std::array::from_fn(|c| 0.5 * (photo[a][c] + photo[b][c]));
                    }
                    filled += 1;
                }
            }
        }
        filled
    }

    /// Share of the photographs that saturate a channel of pixel `n`.
    fn saturated_share(&self, n: usize) -> f64 {
        let saturated = |photo: &&Vec<[f32; 3]>| photo[n].iter().any(|y| y.is_nan());
        let count = self.photos.iter().filter(saturated).count();
        count as f64 / self.photos.len() as f64
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use crate::recover::test_problems::SyntheticCapture;

    #[test]
    fn hot_pixels_are_filled_and_no_others() {
        let mut measurements = SyntheticCapture::smooth(12).measurements;
        let clean = measurements.photos.clone();
        assert_eq!(measurements.fill_hot_pixels(), 0);
        assert_eq!(measurements.photos, clean);
        let (hot, corner) = (5 * 32 + 7, 31 * 32 + 31);
        for photo in &mut measurements.photos {
            photo[hot] = [f32::NAN; 3];
            photo[corner] = [f32::NAN; 3];
        }
        assert_eq!(measurements.fill_hot_pixels(), 2);
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
        assert_eq!(measurements.fill_hot_pixels(), 0);
    }
}
