//! Area resampling: a picture of any size becomes a light on the light plane. Element `m` gets the mean of the pixels
//! that it covers, weighted by the share of `m` that each covers, so the total of the light does not change.
//!
//! The filter is separable: each row is resampled along columns, then added to the rows of elements that it overlaps,
//! so that only one row of the picture need be in memory.

use super::srgb;
use crate::transport::Extent;

/// Resamples linear RGB values, `[height, width, 3]`, from one extent to another.
///
/// # Panics
/// If `values` does not have the length of `from`.
pub fn area_resample(values: &[f32], from: Extent, to: Extent) -> Vec<f32> {
    // Not `assert_eq`, whose formatting code modules would have to carry.
    assert!(values.len() == from.area() * 3, "three values a pixel");
    let mut resampler = AreaResampler::new(from, to);
    for row in values.chunks_exact(3 * from.width as usize) {
        resampler.add_linear_row(row);
    }
    resampler.finish().flatten().collect()
}

/// [`area_resample`] row by row.
pub(super) struct AreaResampler {
    columns: Vec<CellOverlap>,
    rows: Vec<CellOverlap>,
    /// Sums of linear RGB, `[v, u]`.
    sums: Vec<[f64; 3]>,
    /// The last row, resampled along columns.
    row: Vec<[f64; 3]>,
    /// Index of the next row of the picture.
    next_row: usize,
    /// Index of the first row of elements that is not complete.
    first_open: usize,
}

impl AreaResampler {
    /// For a picture of extent `from` and a light plane of extent `to`.
    pub(super) fn new(from: Extent, to: Extent) -> Self {
        Self {
            columns: overlaps(from.width, to.width),
            rows: overlaps(from.height, to.height),
            sums: vec![[0.0; 3]; to.area()],
            row: vec![[0.0; 3]; to.width as usize],
            next_row: 0,
            first_open: 0,
        }
    }

    /// Adds the next row, in linear RGB.
    pub(super) fn add_linear_row(&mut self, row: &[f32]) {
        self.add_row(row.as_chunks().0, |rgb: [f32; 3]| rgb.map(f64::from));
    }

    /// Adds the next row, in sRGB with straight alpha: a pixel emits its alpha's share of its colour. Codes are
    /// decoded before they are averaged, as the mean of codes is darker than that of light.
    pub(super) fn add_srgb_row(&mut self, row: &[u8]) {
        let linear = srgb::srgb8_decoded();
        self.add_row(row.as_chunks().0, |[r, g, b, a]: [u8; 4]| {
            let alpha = f64::from(a) * (1.0 / 255.0);
            [r, g, b].map(|code| alpha * linear[usize::from(code)])
        });
    }

    #[inline(always)]
    fn add_row<P: Copy>(&mut self, row: &[P], emission: impl Fn(P) -> [f64; 3]) {
        for (mean, column) in self.row.iter_mut().zip(&self.columns) {
            *mean = column.mean(row, &emission);
        }
        let width = self.row.len();
        while let Some(overlap) = self.rows.get(self.first_open) {
            let i = self.next_row.checked_sub(overlap.first);
            let Some(weight) = i.and_then(|i| overlap.weights.get(i)) else {
                break;
            };
            let sums = &mut self.sums[self.first_open * width..][..width];
            for (sum, mean) in sums.iter_mut().zip(&self.row) {
                (0..3).for_each(|c| sum[c] += weight * mean[c]);
            }
            if self.next_row + 1 < overlap.first + overlap.weights.len() {
                break;
            }
            self.first_open += 1;
        }
        self.next_row += 1;
    }

    /// Linear RGB of each element, once all rows are added.
    pub(super) fn finish(self) -> impl Iterator<Item = [f32; 3]> {
        self.sums.into_iter().map(|rgb| rgb.map(|mean| mean as f32))
    }
}

/// The source cells that one target cell overlaps, along one axis.
struct CellOverlap {
    /// The first of them.
    first: usize,
    /// The share of the target cell that each covers.
    weights: Vec<f64>,
}

impl CellOverlap {
    #[inline(always)]
    fn mean<P: Copy>(&self, row: &[P], emission: impl Fn(P) -> [f64; 3]) -> [f64; 3] {
        let mut mean = [0.0; 3];
        for (pixel, weight) in row[self.first..].iter().zip(&self.weights) {
            let emitted = emission(*pixel);
            (0..3).for_each(|c| mean[c] += weight * emitted[c]);
        }
        mean
    }
}

/// The overlaps of `to` equal cells with `from` equal cells of the same total length.
fn overlaps(from: u32, to: u32) -> Vec<CellOverlap> {
    let scale = f64::from(from) / f64::from(to);
    (0..to)
        .map(|i| {
            let (start, end) = (f64::from(i) * scale, f64::from(i + 1) * scale);
            // Rounding may move an end past the last cell, or make an overlap slightly negative.
            let first = (start as u32).min(from - 1);
            let last = (end.ceil() as u32).clamp(first + 1, from);
            let weights = (first..last)
                .map(|j| (end.min(f64::from(j + 1)) - start.max(f64::from(j))).max(0.0) / scale);
            CellOverlap {
                first: first as usize,
                weights: weights.collect(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FROM: Extent = Extent::new(7, 5);

    /// Smaller, equal, larger, one element, larger along one axis only.
    fn targets() -> [Extent; 5] {
        [(3, 2), (7, 5), (20, 11), (1, 1), (2, 9)].map(|(width, height)| Extent { width, height })
    }

    #[test]
    fn the_mean_is_preserved() {
        let values: Vec<f32> = (0..105).map(|i| (i * 31 % 17) as f32).collect();
        let mean = |v: &[f32]| v.iter().map(|x| f64::from(*x)).sum::<f64>() / v.len() as f64;
        for to in targets() {
            let out = area_resample(&values, FROM, to);
            assert_eq!(out.len(), to.area() * 3);
            assert!((mean(&out) - mean(&values)).abs() < 1e-5, "{to}");
        }
        assert_eq!(area_resample(&values, FROM, FROM), values);
    }

    #[test]
    fn each_element_is_the_mean_of_its_area() {
        let values: Vec<f32> = (0..105).map(|i| (i * 31 % 17) as f32).collect();
        // Cells of a grid that refines both the picture and the light plane.
        let fine = |extent: Extent, to: Extent, x: u32, y: u32| {
            let (u, v) = (x / to.width, y / to.height);
            (v * extent.width + u) as usize
        };
        for to in targets() {
            let (width, height) = (FROM.width * to.width, FROM.height * to.height);
            let mut want = vec![0.0; to.area() * 3];
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let (pixel, element) = (fine(FROM, to, x, y), fine(to, FROM, x, y));
                for c in 0..3 {
                    want[3 * element + c] += f64::from(values[3 * pixel + c]) / FROM.area() as f64;
                }
            }
            for (got, want) in area_resample(&values, FROM, to).iter().zip(want) {
                assert!((f64::from(*got) - want).abs() <= 1e-6 * want, "{to}");
            }
        }
    }

    #[test]
    fn srgb_codes_are_decoded_before_they_are_averaged() {
        let rgba: Vec<u8> = (0..140).map(|i| (i * 89 % 256) as u8).collect();
        let linear: Vec<f32> = rgba
            .chunks(4)
            .flat_map(|p| {
                let linear = |code: u8| srgb::srgb_decode(f64::from(code) / 255.0);
                [0, 1, 2].map(|c| (linear(p[c]) * f64::from(p[3]) / 255.0) as f32)
            })
            .collect();
        for to in targets() {
            let want = area_resample(&linear, FROM, to);
            let mut resampler = AreaResampler::new(FROM, to);
            for row in rgba.chunks(28) {
                resampler.add_srgb_row(row);
            }
            for (got, want) in resampler.finish().flatten().zip(want) {
                assert!((got - want).abs() <= 1e-6 * want, "{to}: {got}, not {want}");
            }
        }
    }
}
