//! Area resampling: a picture of any size becomes a light on the light plane. Element `m` gets the mean of the pixels
//! that it covers, weighted by the share of `m` that each covers, so the total of the light does not change.
//!
//! The filter is separable: each row is resampled along columns, then added to the rows of elements that it overlaps,
//! so that only one row of the picture need be in memory.

use std::ops::Range;

use crate::transport::{Extent, LightRegion};

/// Resamples linear RGB values, `[height, width, 3]`, from one extent to another.
///
/// # Panics
/// If `values` does not have the length of `from`.
pub fn area_resample(values: &[f32], from: Extent, to: Extent) -> Vec<f32> {
    // Not `assert_eq`, whose formatting code modules would have to carry.
    assert!(values.len() == from.area() * 3, "three values a pixel");
    let mut resampler = AreaResampler::new(from, to.into());
    for row in values.chunks_exact(3 * from.width as usize) {
        resampler.add_row(row);
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
    /// For a picture of extent `from` that covers the light plane of `to`.
    pub(super) fn new(from: Extent, to: LightRegion) -> Self {
        let rows = overlaps(from.height, to.plane.height, to.rows());
        Self {
            columns: overlaps(from.width, to.plane.width, to.columns()),
            next_row: rows.first().map_or(0, |overlap| overlap.first),
            rows,
            sums: vec![[0.0; 3]; to.extent.area()],
            row: vec![[0.0; 3]; to.extent.width as usize],
            first_open: 0,
        }
    }

    /// The rows of the picture to add, in turn.
    pub(super) fn rows(&self) -> Range<usize> {
        let last = self.rows.last();
        self.next_row..last.map_or(0, |overlap| overlap.first + overlap.weights.len())
    }

    /// Adds the next row, in linear RGB.
    pub(super) fn add_row(&mut self, row: &[f32]) {
        for (mean, column) in self.row.iter_mut().zip(&self.columns) {
            *mean = column.mean(row.as_chunks().0);
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
    fn mean(&self, row: &[[f32; 3]]) -> [f64; 3] {
        let mut mean = [0.0; 3];
        for (pixel, weight) in row[self.first..].iter().zip(&self.weights) {
            (0..3).for_each(|c| mean[c] += weight * f64::from(pixel[c]));
        }
        mean
    }
}

/// The overlaps of some of `to` equal cells with `from` equal cells of the same total length.
fn overlaps(from: u32, to: u32, cells: Range<u32>) -> Vec<CellOverlap> {
    let scale = f64::from(from) / f64::from(to);
    cells
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
}
