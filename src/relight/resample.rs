//! Fitting a picture of a light to the light plane.

use super::tone;
use crate::transport::Extent;

/// Resamples linear RGB values, `[height, width, 3]`, from one extent to another by area: each
/// element gets the mean of what it covers, so that no light is lost or gained.
///
/// # Panics
/// If `values` does not have the length `from` gives it.
pub fn area_resample(values: &[f32], from: Extent, to: Extent) -> Vec<f32> {
    assert_eq!(values.len(), from.area() * 3, "three values a pixel");
    let mut means = AreaMeans::new(from, to);
    for row in values.chunks_exact(3 * from.width as usize) {
        means.add_linear(row);
    }
    means.finish()
}

/// What a picture becomes by [`area_resample`], of which there need be no more than a row at a time.
pub(super) struct AreaMeans {
    columns: Vec<Overlap>,
    rows: Vec<Overlap>,
    /// Sums of linear light, row by row.
    means: Vec<[f64; 3]>,
    /// Means along one row of the picture, which may be seen by several rows of elements.
    along: Vec<[f64; 3]>,
    /// The row of the picture that is next.
    y: usize,
    /// The first row of elements that is not complete.
    first: usize,
}

impl AreaMeans {
    /// Of a picture of which nothing is there yet.
    pub(super) fn new(from: Extent, to: Extent) -> Self {
        Self {
            columns: overlaps(from.width, to.width),
            rows: overlaps(from.height, to.height),
            means: vec![[0.0; 3]; to.area()],
            along: vec![[0.0; 3]; to.width as usize],
            y: 0,
            first: 0,
        }
    }

    /// The next row, in linear RGB.
    pub(super) fn add_linear(&mut self, row: &[f32]) {
        self.add(row.as_chunks().0, |rgb: [f32; 3]| rgb.map(f64::from));
    }

    /// The next row, in sRGB, alpha apart from the colours: it is the share of a pixel that shines.
    /// Decoded first, as the mean of codes is darker than that of light.
    pub(super) fn add_srgb(&mut self, row: &[u8]) {
        let linear = tone::srgb8_decoded();
        self.add(row.as_chunks().0, |[r, g, b, a]: [u8; 4]| {
            let share = f64::from(a) * (1.0 / 255.0);
            [r, g, b].map(|code| share * linear[usize::from(code)])
        });
    }

    #[inline(always)]
    fn add<P: Copy>(&mut self, row: &[P], emission: impl Fn(P) -> [f64; 3]) {
        for (mean, column) in self.along.iter_mut().zip(&self.columns) {
            *mean = column.mean(row, &emission);
        }
        let width = self.along.len();
        while let Some(down) = self.rows.get(self.first) {
            let Some(share) = (self.y.checked_sub(down.first)).and_then(|i| down.shares.get(i))
            else {
                break;
            };
            let means = &mut self.means[self.first * width..][..width];
            for (mean, along) in means.iter_mut().zip(&self.along) {
                (0..3).for_each(|c| mean[c] += share * along[c]);
            }
            if self.y + 1 < down.first + down.shares.len() {
                break;
            }
            self.first += 1;
        }
        self.y += 1;
    }

    /// All means, row by row, once all rows were added.
    pub(super) fn finish(self) -> Vec<f32> {
        let values = self.means.as_flattened();
        values.iter().map(|mean| *mean as f32).collect()
    }
}

/// What one cell covers of a row of others.
struct Overlap {
    /// The first that it covers.
    first: usize,
    /// By what share of itself it covers that one and those that follow.
    shares: Vec<f64>,
}

impl Overlap {
    #[inline(always)]
    fn mean<P: Copy>(&self, row: &[P], emission: impl Fn(P) -> [f64; 3]) -> [f64; 3] {
        let mut mean = [0.0; 3];
        for (pixel, share) in row[self.first..].iter().zip(&self.shares) {
            let emitted = emission(*pixel);
            (0..3).for_each(|c| mean[c] += share * emitted[c]);
        }
        mean
    }
}

/// What each of `to` cells covers of `from` cells.
fn overlaps(from: u32, to: u32) -> Vec<Overlap> {
    let scale = f64::from(from) / f64::from(to);
    (0..to)
        .map(|i| {
            let (start, end) = (f64::from(i) * scale, f64::from(i + 1) * scale);
            // Rounding may put an end beyond the last cell, or a sliver before it.
            let first = (start as u32).min(from - 1);
            let last = (end.ceil() as u32).clamp(first + 1, from);
            let shares = (first..last)
                .map(|j| (end.min(f64::from(j + 1)) - start.max(f64::from(j))).max(0.0) / scale);
            Overlap {
                first: first as usize,
                shares: shares.collect(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FROM: Extent = Extent {
        width: 7,
        height: 5,
    };

    /// Smaller, the same, larger, one element, and larger one way only.
    fn targets() -> [Extent; 5] {
        [(3, 2), (7, 5), (20, 11), (1, 1), (2, 9)].map(|(width, height)| Extent { width, height })
    }

    #[test]
    fn light_is_neither_lost_nor_gained() {
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
    fn every_element_has_the_mean_of_what_it_covers() {
        let values: Vec<f32> = (0..105).map(|i| (i * 31 % 17) as f32).collect();
        // Cells that pixels and elements both divide into.
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
    fn pixels_in_srgb_are_decoded_before_they_are_mixed() {
        let rgba: Vec<u8> = (0..140).map(|i| (i * 89 % 256) as u8).collect();
        let linear: Vec<f32> = rgba
            .chunks(4)
            .flat_map(|p| {
                let linear = |code: u8| tone::srgb_decode(f64::from(code) / 255.0);
                [0, 1, 2].map(|c| (linear(p[c]) * f64::from(p[3]) / 255.0) as f32)
            })
            .collect();
        for to in targets() {
            let want = area_resample(&linear, FROM, to);
            let mut means = AreaMeans::new(FROM, to);
            for row in rgba.chunks(28) {
                means.add_srgb(row);
            }
            for (got, want) in means.finish().iter().zip(want) {
                assert!((got - want).abs() <= 1e-6 * want, "{to}: {got}, not {want}");
            }
        }
    }
}
