//! Which pixels and measurements are looked at.

use std::collections::BTreeMap;
use std::ops::Range;

use super::MIN_PATTERNS;
use crate::capture::Measurements;
use crate::transport::{CameraPx, Element, Extent, Geometry, TileRect};

/// Squares of `side` pixels spread evenly over the picture, none over another, at most `most`: all
/// there are room for where the picture is small. Only such whose measurements are at hand.
pub(super) fn spread_squares(measurements: &Measurements, side: u32, most: usize) -> Vec<TileRect> {
    let camera = measurements.camera;
    squares(camera, side, most, |square| measurements.covers(square))
}

fn squares(
    camera: Extent,
    side: u32,
    most: usize,
    at_hand: impl Fn(TileRect) -> bool,
) -> Vec<TileRect> {
    let extent = Extent {
        width: side.min(camera.width),
        height: side.min(camera.height),
    };
    let square = |x: u32, y: u32| TileRect {
        x: x * extent.width,
        y: y * extent.height,
        extent,
    };
    let across = camera.width / extent.width;
    let rows: Vec<u32> = (0..camera.height / extent.height)
        .filter(|&y| at_hand(square(0, y)))
        .collect();
    if across as usize * rows.len() <= most {
        let row = |&y: &u32| (0..across).map(move |x| square(x, y));
        return rows.iter().flat_map(row).collect();
    }
    let mut squares: Vec<TileRect> = Vec::with_capacity(most);
    // Roberts's R2 sequence: even, and in step with no pattern of the picture.
    for i in 1..=64 * most {
        let at =
            |step: f64, cells: usize| ((0.5 + step * i as f64).fract() * cells as f64) as usize;
        let square = square(
            at(0.754_877_666_246_69, across as usize) as u32,
            rows[at(0.569_840_290_998_05, rows.len())],
        );
        if !squares.contains(&square) {
            squares.push(square);
            if squares.len() == most {
                break;
            }
        }
    }
    squares
}

/// All pixels of a region by their common window: (number in the region, pixel).
pub(super) fn pixels_by_window(
    geometry: &Geometry,
    rect: TileRect,
) -> BTreeMap<Element, Vec<(usize, CameraPx)>> {
    let mut windows: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for (p, pixel) in rect.pixels().enumerate() {
        let origin = geometry.window_origin(pixel);
        windows.entry(origin).or_default().push((p, pixel));
    }
    windows
}

/// Whether any window reaches the display.
pub(super) fn reaches_display(geometry: &Geometry) -> bool {
    let mut pixels = geometry.tiles().flat_map(TileRect::pixels);
    pixels.any(|pixel| geometry.reaches_display(geometry.window_origin(pixel)))
}

/// Those of the patterns `rows` under which no channel of no pixel is saturated; all of them where
/// those are too few, for pixels that are not.
pub(super) fn unsaturated(
    measurements: &Measurements,
    rows: &[usize],
    pixels: &[(usize, CameraPx)],
    channels: Range<usize>,
) -> Vec<usize> {
    let seen = |&l: &usize| {
        let mut pixels = pixels.iter();
        pixels.all(|&(_, pixel)| {
            let mut channels = channels.clone();
            channels.all(|c| measurements.sample(l, pixel, c).is_finite())
        })
    };
    let usable: Vec<usize> = rows.iter().copied().filter(seen).collect();
    match usable.len() >= MIN_PATTERNS {
        true => usable,
        false => rows.to_vec(),
    }
}

/// Mean variance of measurements that are `y` on average, over the patterns `rows`, whose exposures
/// may differ.
pub(super) fn mean_variance(measurements: &Measurements, rows: &[usize], c: usize, y: f64) -> f64 {
    let variances = rows.iter().map(|&l| measurements.variance(l, c, y));
    variances.sum::<f64>() / rows.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_are_spread_and_apart() {
        let camera = Extent {
            width: 128,
            height: 96,
        };
        let chosen = squares(camera, 16, 24, |_| true);
        assert_eq!(chosen.len(), 24);
        for (i, a) in chosen.iter().enumerate() {
            assert!(a.x + 16 <= 128 && a.y + 16 <= 96);
            for b in &chosen[..i] {
                assert!(a.x.abs_diff(b.x) >= 16 || a.y.abs_diff(b.y) >= 16);
            }
        }
        assert_eq!(
            squares(
                Extent {
                    width: 3,
                    height: 5
                },
                16,
                24,
                |_| true
            )
            .len(),
            1
        );
    }
}
