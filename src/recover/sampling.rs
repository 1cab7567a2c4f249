//! Selects the pixels, patterns and light elements that an estimate uses.

use std::ops::Range;

use super::photometry::CalibratedMeasurements;
use crate::transport::{CameraPixel, Extent, Geometry, LightElement, TileRect};

/// Fewest patterns that recovery makes sense with.
pub const MIN_PATTERNS: usize = 4;

/// Pixels that share a window, each with its position in a region, row by row.
pub(super) type PixelsSharingWindow = [(usize, CameraPixel)];

/// Most pixels of a picture that is small enough to choose a sample from all of it.
pub(super) const MAX_SMALL_PICTURE: usize = 1 << 19;

/// Squares of `side²` pixels spread evenly over the picture, without overlap, at most `max_count`. They do not depend on
/// what is loaded of the picture: [`preparation_pixels`](super::preparation_pixels) lists what has to be.
pub(super) fn spread_squares(camera: Extent, side: u32, max_count: usize) -> Vec<TileRect> {
    let extent = Extent::new(side.min(camera.width), side.min(camera.height));
    let square = |(column, row): (u32, u32)| TileRect {
        x: column * extent.width,
        y: row * extent.height,
        extent,
    };
    let grid = Extent::new(camera.width / extent.width, camera.height / extent.height);
    if grid.area() <= max_count {
        return grid.cells().map(square).collect();
    }
    let mut squares: Vec<TileRect> = Vec::with_capacity(max_count);
    // Roberts's R2 sequence: even, and in step with no periodic structure of the picture.
    for i in 1..=64 * max_count {
        let position =
            |step: f64, cells: u32| ((0.5 + step * i as f64).fract() * f64::from(cells)) as u32;
        let column = position(0.754_877_666_246_69, grid.width);
        let square = square((column, position(0.569_840_290_998_05, grid.height)));
        if !squares.contains(&square) {
            squares.push(square);
            if squares.len() == max_count {
                break;
            }
        }
    }
    squares
}

/// Values with the key that they share.
pub(super) type Group<K, V> = (K, Vec<V>);

/// Adds `value` to the group of its key. Groups are in ascending order of keys; new keys are expected near the end.
pub(super) fn add_to_group<K: Ord, V>(groups: &mut Vec<Group<K, V>>, key: K, value: V) {
    match groups.binary_search_by(|group| group.0.cmp(&key)) {
        Ok(i) => groups[i].1.push(value),
        Err(i) => groups.insert(i, (key, vec![value])),
    }
}

/// The pixels of a region, grouped by the origin of their window.
pub(super) fn pixels_by_window(
    geometry: &Geometry,
    rect: TileRect,
) -> Vec<Group<LightElement, (usize, CameraPixel)>> {
    pixels_by_origin(rect, |pixel| geometry.window_origin(pixel))
}

/// The pixels of a region, grouped by the `origin` of a window near them.
pub(super) fn pixels_by_origin(
    rect: TileRect,
    origin: impl Fn(CameraPixel) -> LightElement,
) -> Vec<Group<LightElement, (usize, CameraPixel)>> {
    let mut windows = Vec::new();
    for (p, pixel) in rect.pixels().enumerate() {
        add_to_group(&mut windows, origin(pixel), (p, pixel));
    }
    windows
}

/// `rect` with a border of `margin` pixels, where the picture has such pixels.
pub(super) fn with_margin(camera: Extent, rect: TileRect, margin: u32) -> TileRect {
    let (x, y) = (rect.x.saturating_sub(margin), rect.y.saturating_sub(margin));
    let end = |start: u32, length: u32, side: u32| (start + length + margin).min(side);
    TileRect {
        x,
        y,
        extent: Extent::new(
            end(rect.x, rect.extent.width, camera.width) - x,
            end(rect.y, rect.extent.height, camera.height) - y,
        ),
    }
}

/// The patterns of `pattern_indices` under which none of the pixels and channels is saturated; all of them if those are
/// fewer than [`MIN_PATTERNS`].
pub(super) fn unsaturated(
    measurements: &CalibratedMeasurements<'_>,
    pattern_indices: &[usize],
    pixels: &PixelsSharingWindow,
    channels: Range<usize>,
) -> Vec<usize> {
    let is_finite = |l, pixel| {
        let mut channels = channels.clone();
        channels.all(|c| measurements.sample(l, pixel, c).is_finite())
    };
    let is_usable = |&l: &usize| pixels.iter().all(|&(_, pixel)| is_finite(l, pixel));
    let usable: Vec<usize> = pattern_indices.iter().copied().filter(is_usable).collect();
    match usable.len() >= MIN_PATTERNS {
        true => usable,
        false => pattern_indices.to_vec(),
    }
}

/// The patterns that do not saturate a pixel's channel, and its measurements under them. If these patterns are fewer than
/// [`MIN_PATTERNS`], all patterns; saturated measurements are then white, the least that they can be.
pub(super) fn usable_samples(
    measurements: &CalibratedMeasurements<'_>,
    pattern_indices: &[usize],
    pixel: CameraPixel,
    c: usize,
) -> (Vec<usize>, Vec<f64>) {
    let y = measurements.samples(pattern_indices, pixel, c);
    let mut samples: Vec<_> = pattern_indices.iter().copied().zip(y).collect();
    if samples.iter().filter(|(_, y)| y.is_finite()).count() >= MIN_PATTERNS {
        samples.retain(|(_, y)| y.is_finite());
    } else {
        let saturated = samples.iter_mut().filter(|(_, y)| !y.is_finite());
        saturated.for_each(|(l, y)| *y = measurements.white(*l));
    }
    samples.into_iter().unzip()
}

/// The mean of measurements; 0 of none.
pub(super) fn mean(y: &[f64]) -> f64 {
    y.iter().sum::<f64>() / y.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extent(width: u32, height: u32) -> Extent {
        Extent { width, height }
    }

    #[test]
    fn squares_are_spread_without_overlap() {
        let squares = spread_squares(extent(128, 96), 16, 24);
        assert_eq!(squares.len(), 24);
        for (i, a) in squares.iter().enumerate() {
            assert!(a.x + 16 <= 128 && a.y + 16 <= 96);
            for b in &squares[..i] {
                assert!(a.x.abs_diff(b.x) >= 16 || a.y.abs_diff(b.y) >= 16);
            }
        }
        assert_eq!(spread_squares(extent(3, 5), 16, 24).len(), 1);
    }
}
