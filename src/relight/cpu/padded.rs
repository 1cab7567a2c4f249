//! A light with a dark border, and what of it has changed.

use std::ops::Range;

use crate::relight::Light;
use crate::transport::{Element, Extent};

/// The light as all windows see it, those that hang over the display's edge too. Remembers the last
/// light it was given.
#[derive(Clone, Debug)]
pub struct PaddedLight {
    /// Its first element, on the light plane.
    origin: Element,
    extent: Extent,
    light: Extent,
    elements: Vec<[f32; 4]>,
    /// Columns that the last light changed, row by row.
    changed: Vec<Range<usize>>,
}

impl PaddedLight {
    /// A dark light of the given extent, seen from `origin` on as far as `extent`.
    pub fn new(light: Extent, origin: Element, extent: Extent) -> Self {
        Self {
            origin,
            extent,
            light,
            elements: vec![[0.0; 4]; extent.area()],
            changed: vec![0..0; extent.height as usize],
        }
    }

    /// Takes a light in the place of the last one.
    pub fn put(&mut self, light: &Light) {
        let (width, stride) = (self.light.width as usize, self.extent.width as usize);
        let rows = self
            .elements
            .chunks_exact_mut(stride.max(1))
            .zip(self.origin.v..);
        for ((row, v), changed) in rows.zip(&mut self.changed) {
            *changed = 0..0;
            // The part of the row that is on the display.
            let left = i64::from(self.origin.u);
            let (from, to) = (left.max(0), (left + stride as i64).min(width as i64));
            if !(0..self.light.height as i32).contains(&v) || from >= to {
                continue;
            }
            let length = (to - from) as usize;
            let new = &light.elements()[v as usize * width + from as usize..][..length];
            let start = (from - left) as usize;
            let old = &mut row[start..start + length];
            let differ = |(a, b): (&[f32; 4], &[f32; 4])| a != b;
            let Some(first) = old.iter().zip(new).position(differ) else {
                continue;
            };
            let last = old.iter().zip(new).rposition(differ).unwrap_or(first);
            old[first..=last].copy_from_slice(&new[first..=last]);
            *changed = start + first..start + last + 1;
        }
    }

    /// Whether anything has changed in a rectangle.
    pub fn changed(&self, columns: Range<usize>, rows: Range<usize>) -> bool {
        self.changed[rows]
            .iter()
            .any(|changed| changed.start < columns.end && columns.start < changed.end)
    }

    /// Elements of a row, from a column on.
    #[inline(always)]
    pub fn row(&self, column: usize, row: usize) -> &[[f32; 4]] {
        let stride = self.extent.width as usize;
        &self.elements[row * stride + column..(row + 1) * stride]
    }

    /// Elements from a column and row on, [`stride`](Self::stride) from row to row.
    #[inline(always)]
    pub fn rows(&self, column: usize, row: usize) -> &[[f32; 4]] {
        &self.elements[row * self.stride() + column..]
    }

    /// Elements from one row to the next.
    pub fn stride(&self) -> usize {
        self.extent.width as usize
    }
}
