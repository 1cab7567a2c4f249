//! Fitting a picture of a light to the light plane.

use crate::transport::Extent;

/// Resamples linear RGB values, `[height, width, 3]`, from one extent to another by area: each
/// element gets the mean of what it covers, so that no light is lost or gained.
///
/// # Panics
/// If `values` does not have the length `from` gives it.
pub fn area_resample(values: &[f32], from: Extent, to: Extent) -> Vec<f32> {
    assert_eq!(values.len(), from.area() * 3, "three values a pixel");
    let columns = overlaps(from.width, to.width);
    let rows = overlaps(from.height, to.height);
    let mut out = Vec::with_capacity(to.area() * 3);
    for row in &rows {
        for column in &columns {
            let mut sum = [0.0f64; 3];
            for &(y, wy) in row {
                for &(x, wx) in column {
                    let at = (y * from.width as usize + x) * 3;
                    for c in 0..3 {
                        sum[c] += wy * wx * f64::from(values[at + c]);
                    }
                }
            }
            out.extend(sum.map(|s| s as f32));
        }
    }
    out
}

/// For each of `to` cells, which of `from` cells it covers and by what share of itself.
fn overlaps(from: u32, to: u32) -> Vec<Vec<(usize, f64)>> {
    let scale = f64::from(from) / f64::from(to);
    (0..to)
        .map(|i| {
            let (start, end) = (f64::from(i) * scale, f64::from(i + 1) * scale);
            let last = (end.ceil() as u32).min(from);
            (start as u32..last)
                .map(|j| {
                    let overlap = end.min(f64::from(j + 1)) - start.max(f64::from(j));
                    (j as usize, overlap / scale)
                })
                .filter(|(_, share)| *share > 0.0)
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_neither_lost_nor_gained() {
        let extent = |width, height| Extent { width, height };
        let from = extent(7, 5);
        let values: Vec<f32> = (0..105).map(|i| (i * 31 % 17) as f32).collect();
        let mean = |v: &[f32]| v.iter().map(|x| f64::from(*x)).sum::<f64>() / v.len() as f64;
        for to in [extent(3, 2), extent(7, 5), extent(20, 11), extent(1, 1)] {
            let out = area_resample(&values, from, to);
            assert_eq!(out.len(), to.area() * 3);
            assert!((mean(&out) - mean(&values)).abs() < 1e-5, "{to}");
        }
        assert_eq!(area_resample(&values, from, from), values);
    }
}
