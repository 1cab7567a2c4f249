//! A set of camera pixels: those of the photographs that are loaded.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::camera_row_set::CameraRowSet;
use crate::transport::{CameraPixel, Extent, TileRect};

/// A set of camera pixels: whole rows, or spans of columns in some rows. Lists of its pixels, as photographs are, go row by
/// row.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CameraPixelSet {
    /// Columns of the camera grid.
    width: u32,
    /// The rows that have pixels of the set.
    rows: CameraRowSet,
    /// Their pixels, unless the rows are whole, as they always are in pages.
    #[cfg(not(target_arch = "wasm32"))]
    spans: Option<RowSpans>,
}

/// The spans of columns of some rows.
#[cfg(not(target_arch = "wasm32"))]
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct RowSpans {
    /// Number of the first span of each row of the set, and at last the number of all spans.
    first: Vec<usize>,
    /// Row by row, from left to right; none empty, none adjacent to the next.
    columns: Vec<Range<u32>>,
    /// Index in the set of the first pixel of each span, and at last the number of all pixels.
    starts: Vec<usize>,
}

impl CameraPixelSet {
    /// All pixels of a camera grid.
    pub fn all(camera: Extent) -> Self {
        Self::row_range(0..camera.height, camera.width)
    }

    /// Whole rows of a camera grid with `width` columns.
    pub fn of_rows(rows: CameraRowSet, width: u32) -> Self {
        Self {
            width,
            rows,
            #[cfg(not(target_arch = "wasm32"))]
            spans: None,
        }
    }

    /// The whole rows from `rows.start` to `rows.end` of a camera grid with `width` columns.
    pub fn row_range(rows: Range<u32>, width: u32) -> Self {
        Self::of_rows(CameraRowSet::from_strips(std::iter::once(rows)), width)
    }

    /// The union of rectangles that lie on a `camera` grid.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn union(camera: Extent, rects: &[TileRect]) -> Self {
        let mut columns_of_rows: Vec<Vec<Range<u32>>> = vec![Vec::new(); camera.height as usize];
        for rect in rects {
            let columns = rect.x..rect.x + rect.extent.width;
            for y in rect.y..rect.y + rect.extent.height {
                columns_of_rows[y as usize].push(columns.clone());
            }
        }
        let mut rows = Vec::new();
        let (mut first, mut columns, mut starts) = (vec![0], Vec::new(), vec![0]);
        for (y, mut own) in (0..).zip(columns_of_rows) {
            own.sort_by_key(|columns| columns.start);
            // The same union as that of strips of rows.
            for span in CameraRowSet::from_strips(own).strips() {
                starts.push(starts[starts.len() - 1] + span.len());
                columns.push(span.clone());
            }
            if columns.len() > first[first.len() - 1] {
                first.push(columns.len());
                rows.push(y..y + 1);
            }
        }
        let is_whole = columns.iter().all(|span| *span == (0..camera.width));
        let spans = (!is_whole).then_some(RowSpans {
            first,
            columns,
            starts,
        });
        Self {
            spans,
            ..Self::of_rows(CameraRowSet::from_strips(rows), camera.width)
        }
    }

    /// The rows that have pixels of the set.
    pub fn rows(&self) -> &CameraRowSet {
        &self.rows
    }

    /// Index of a pixel in the set: the number of pixels before it, row by row.
    #[inline]
    pub fn index_of(&self, pixel: CameraPixel) -> Option<usize> {
        let row = self.rows.index_of(pixel.y)?;
        #[cfg(not(target_arch = "wasm32"))]
        if let Some(spans) = &self.spans {
            return spans.index_of(row, pixel.x);
        }
        Some(row * self.width as usize + pixel.x as usize)
    }

    /// The columns of the set in row `y`, from left to right.
    pub fn spans_of(&self, y: u32) -> impl Iterator<Item = Range<u32>> {
        let whole = 0..self.width;
        #[cfg(target_arch = "wasm32")]
        return self.rows.contains(y).then_some(whole).into_iter();
        #[cfg(not(target_arch = "wasm32"))]
        match (&self.spans, self.rows.index_of(y)) {
            (Some(spans), Some(row)) => spans.of_row(row).to_vec(),
            (None, Some(_)) => vec![whole],
            (_, None) => Vec::new(),
        }
        .into_iter()
    }

    /// Whether the set contains every pixel of a rectangle that lies on the camera grid.
    pub fn contains_all(&self, rect: TileRect) -> bool {
        let rows = rect.y..rect.y + rect.extent.height;
        #[cfg(not(target_arch = "wasm32"))]
        if self.spans.is_some() {
            let end = rect.x + rect.extent.width;
            let is_in = |span: Range<u32>| span.start <= rect.x && end <= span.end;
            return { rows }.all(|y| self.spans_of(y).any(is_in));
        }
        self.rows.contains_all(rows)
    }

    /// Number of pixels.
    pub fn count(&self) -> usize {
        #[cfg(not(target_arch = "wasm32"))]
        if let Some(spans) = &self.spans {
            return spans.starts[spans.columns.len()];
        }
        self.rows.count() * self.width as usize
    }

    /// Number of pixels above row `y`.
    pub fn count_above(&self, y: u32) -> usize {
        let above = self.rows.iter().take_while(|row| *row < y).count();
        #[cfg(not(target_arch = "wasm32"))]
        if let Some(spans) = &self.spans {
            return spans.starts[spans.first[above]];
        }
        above * self.width as usize
    }

    /// The set as rectangles of one row, row by row.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn rects(&self) -> impl Iterator<Item = TileRect> {
        self.rows.iter().flat_map(|y| {
            self.spans_of(y).map(move |span| TileRect {
                x: span.start,
                y,
                extent: Extent::new(span.end - span.start, 1),
            })
        })
    }
}

#[cfg(not(target_arch = "wasm32"))]
impl RowSpans {
    fn of_row(&self, row: usize) -> &[Range<u32>] {
        &self.columns[self.first[row]..self.first[row + 1]]
    }

    fn index_of(&self, row: usize, x: u32) -> Option<usize> {
        let spans = self.of_row(row);
        let i = spans.partition_point(|span| span.end <= x);
        let span = spans.get(i).filter(|span| span.start <= x)?;
        Some(self.starts[self.first[row] + i] + (x - span.start) as usize)
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::*;

    const CAMERA: Extent = Extent::new(9, 7);

    fn rect(x: u32, y: u32, width: u32, height: u32) -> TileRect {
        let extent = Extent::new(width, height);
        TileRect { x, y, extent }
    }

    /// The indices of a set's pixels are their places in a list that goes row by row, and there are no others.
    fn check(set: &CameraPixelSet, is_in: impl Fn(CameraPixel) -> bool) {
        let mut count = 0;
        for pixel in rect(0, 0, CAMERA.width, CAMERA.height).pixels() {
            if pixel.x == 0 {
                assert_eq!(set.count_above(pixel.y), count);
            }
            let expected = is_in(pixel).then_some(count);
            assert_eq!(set.index_of(pixel), expected, "{pixel:?}");
            assert_eq!(
                set.spans_of(pixel.y).any(|span| span.contains(&pixel.x)),
                is_in(pixel)
            );
            count += usize::from(is_in(pixel));
        }
        assert_eq!(set.count(), count);
        for side in 1..6 {
            for (x, y) in Extent::new(CAMERA.width - side + 1, CAMERA.height - side + 1).cells() {
                let rect = rect(x, y, side, side);
                assert_eq!(
                    set.contains_all(rect),
                    rect.pixels().all(&is_in),
                    "{rect:?}"
                );
            }
        }
    }

    #[test]
    fn pixels_are_indexed_row_by_row() {
        check(&CameraPixelSet::all(CAMERA), |_| true);
        let rows = CameraRowSet::from_strips([1..3, 5..6]);
        let rows = CameraPixelSet::of_rows(rows, CAMERA.width);
        check(&rows, |CameraPixel { y, .. }| [1, 2, 5].contains(&y));
        // Apart, overlapping, adjacent, one in another, and empty rows.
        let rects = [
            rect(5, 0, 2, 2),
            rect(0, 1, 3, 2),
            rect(2, 1, 2, 1),
            rect(7, 1, 2, 1),
            rect(1, 4, 5, 2),
            rect(2, 5, 1, 1),
        ];
        let set = CameraPixelSet::union(CAMERA, &rects);
        check(&set, |pixel| {
            rects
                .iter()
                .any(|rect| rect.pixels().any(|other| other == pixel))
        });
        check(&CameraPixelSet::union(CAMERA, &[]), |_| false);
    }

    #[test]
    fn a_union_of_whole_rows_is_a_set_of_rows() {
        let halves = [rect(0, 0, 5, 7), rect(5, 0, 4, 7)];
        assert_eq!(
            CameraPixelSet::union(CAMERA, &halves),
            CameraPixelSet::all(CAMERA)
        );
        let rows = CameraRowSet::from_strips([1..3, 5..6]);
        assert_eq!(
            CameraPixelSet::union(CAMERA, &[rect(0, 1, 9, 2), rect(0, 5, 9, 1)]),
            CameraPixelSet::of_rows(rows, CAMERA.width)
        );
    }
}
