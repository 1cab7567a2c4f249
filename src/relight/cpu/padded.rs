//! A light with a dark border, and what of it has changed.

use std::ops::Range;

use crate::relight::Light;
use crate::transport::{Element, Extent};

/// A light that is there row by row.
pub trait LightRows {
    /// Emission of the elements of a row, as [`Light::elements`] has it: finite, and none below zero.
    fn row(&mut self, v: u32) -> &[[f32; 4]];
}

impl LightRows for &Light {
    fn row(&mut self, v: u32) -> &[[f32; 4]] {
        let width = self.extent().width as usize;
        &self.elements()[v as usize * width..][..width]
    }
}

/// The light as all windows see it, those that hang over the display's edge too. Remembers the last
/// light it was given.
#[derive(Clone, Debug)]
pub struct PaddedLight {
    /// Its first element, on the light plane.
    origin: Element,
    extent: Extent,
    light: Extent,
    elements: Vec<[f32; 4]>,
    /// Columns that have changed, row by row.
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

    /// Rows of the light that are seen.
    pub fn rows_seen(&self) -> Range<u32> {
        let top = i64::from(self.origin.v);
        let on_display = |row: i64| row.clamp(0, i64::from(self.light.height)) as u32;
        on_display(top)..on_display(top + i64::from(self.extent.height))
    }

    /// Takes a light in the place of the last one: each row that is seen, from the first on.
    ///
    /// # Panics
    /// If a row has another width.
    pub fn put(&mut self, mut light: impl LightRows) {
        let seen = self.rows_seen();
        let (width, stride) = (self.light.width as usize, self.extent.width as usize);
        // The part of a row that is on the display.
        let left = i64::from(self.origin.u);
        let (from, to) = (left.max(0), (left + stride as i64).min(width as i64));
        if from >= to {
            return;
        }
        let (from, start, length) = (from as usize, (from - left) as usize, (to - from) as usize);
        for v in seen {
            let new = light.row(v);
            assert_eq!(new.len(), width, "a light of another width");
            let new = &new[from..from + length];
            let row = (i64::from(v) - i64::from(self.origin.v)) as usize;
            let old = &mut self.elements[row * stride + start..][..length];
            let differing = differing(old, new);
            if differing.is_empty() {
                continue;
            }
            old[differing.clone()].copy_from_slice(&new[differing.clone()]);
            let (first, end) = (start + differing.start, start + differing.end);
            let changed = &mut self.changed[row];
            *changed = match changed.start < changed.end {
                true => changed.start.min(first)..changed.end.max(end),
                false => first..end,
            };
        }
    }

    /// From here on nothing has changed.
    pub fn settle(&mut self) {
        self.changed.fill(0..0);
    }

    /// Whether anything has changed in a rectangle.
    pub fn changed(&self, columns: Range<usize>, rows: Range<usize>) -> bool {
        self.changed[rows].iter().any(|changed| {
            !changed.is_empty() && changed.start < columns.end && columns.start < changed.end
        })
    }

    /// Elements of a row, from a column on.
    #[inline(always)]
    pub fn row(&self, column: usize, row: usize) -> &[[f32; 4]] {
        let stride = self.extent.width as usize;
        &self.elements[row * stride + column..(row + 1) * stride]
    }

    /// Elements from a column and row on, [`stride`](Self::stride) from row to row.
    #[inline(always)]
    pub fn elements_from(&self, column: usize, row: usize) -> &[[f32; 4]] {
        &self.elements[row * self.stride() + column..]
    }

    /// Elements from one row to the next.
    pub fn stride(&self) -> usize {
        self.extent.width as usize
    }
}

/// From the first to the last of the elements that are not the same.
fn differing(old: &[[f32; 4]], new: &[[f32; 4]]) -> Range<usize> {
    // Bits, some elements at once: nearly all are the same, or nearly none.
    const AT_ONCE: usize = 8;
    let differ = |(old, new): (&[[f32; 4]], &[[f32; 4]])| {
        bytemuck::cast_slice::<_, u32>(old) != bytemuck::cast_slice::<_, u32>(new)
    };
    let mut blocks = old.chunks(AT_ONCE).zip(new.chunks(AT_ONCE));
    let Some(first) = blocks.position(differ) else {
        return 0..0;
    };
    let last = old
        .chunks(AT_ONCE)
        .zip(new.chunks(AT_ONCE))
        .rposition(differ)
        .unwrap_or(first);
    let one = |i: &usize| old[*i].map(f32::to_bits) != new[*i].map(f32::to_bits);
    let end = old.len().min((last + 1) * AT_ONCE);
    let start = (first * AT_ONCE..end).find(one).unwrap_or(end);
    start..(start..end).rfind(one).map_or(start, |last| last + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_what_differs_until_they_are_settled() {
        let extent = Extent {
            width: 20,
            height: 3,
        };
        // Seven columns and rows of darkness on each side.
        let origin = Element { u: -7, v: -7 };
        let seen = Extent {
            width: 34,
            height: 17,
        };
        let mut padded = PaddedLight::new(extent, origin, seen);
        let mut values = vec![0.0; 60 * 3];
        let mut put = |padded: &mut PaddedLight, element: usize, value: f32| {
            values[3 * element] = value;
            let light = Light::from_linear_rgb(extent, &values).unwrap();
            padded.put(&light);
        };
        let is_all = |padded: &PaddedLight, columns: Range<usize>| {
            assert!(padded.changed(columns.clone(), 8..9));
            assert!(!padded.changed(0..columns.start, 0..17));
            assert!(!padded.changed(columns.end..34, 0..17));
            assert!(!padded.changed(0..34, 0..8) && !padded.changed(0..34, 9..17));
        };
        put(&mut padded, 20, 1.0);
        is_all(&padded, 7..8);
        padded.settle();
        put(&mut padded, 20, 1.0);
        assert!(!padded.changed(0..34, 0..17));
        put(&mut padded, 38, 0.5);
        is_all(&padded, 25..26);
        // Two lights before anybody looks.
        put(&mut padded, 29, 0.5);
        is_all(&padded, 16..26);
        padded.settle();
        put(&mut padded, 20, 0.0);
        is_all(&padded, 7..8);
    }
}
