//! The light as all windows see it, with a dark border where they hang over the light plane, and which of its
//! elements the last light has changed.

use std::ops::Range;

use crate::relight::Light;
use crate::transport::{ClippedRect, Element, Extent};

/// A light that is read row by row.
pub trait LightRows {
    /// The elements of row `v`, as [`Light::elements`] has them: finite and not negative.
    fn row(&mut self, v: u32) -> &[[f32; 4]];
}

impl LightRows for &Light {
    fn row(&mut self, v: u32) -> &[[f32; 4]] {
        let width = self.extent().width as usize;
        &self.elements()[v as usize * width..][..width]
    }
}

/// A light with a dark border. Coordinates are columns and rows from its first element.
#[derive(Clone, Debug)]
pub struct PaddedLight {
    extent: Extent,
    /// Extent of the light plane.
    light: Extent,
    /// The part on the light plane.
    lit: ClippedRect,
    elements: Vec<[f32; 4]>,
    /// Changed columns of each row.
    changes: Vec<Range<usize>>,
}

impl PaddedLight {
    /// A dark light, for a light plane of extent `light`: `extent` elements from `origin` on.
    pub fn new(light: Extent, origin: Element, extent: Extent) -> Self {
        Self {
            extent,
            light,
            lit: ClippedRect::new(origin, extent, light),
            elements: vec![[0.0; 4]; extent.area()],
            changes: vec![0..0; extent.height as usize],
        }
    }

    /// Rows of the light plane inside this.
    pub fn light_rows(&self) -> Range<u32> {
        let [_, first] = self.lit.first();
        first as u32..(first + self.lit.rows.len()) as u32
    }

    /// Replaces the light: reads each of the [`light_rows`](Self::light_rows) once, from the first on.
    ///
    /// # Panics
    /// If a row has another width than the light plane.
    pub fn update(&mut self, mut light: impl LightRows) {
        if self.lit.is_empty() {
            return;
        }
        let stride = self.stride();
        let ([first, _], left) = (self.lit.first(), self.lit.columns.start);
        let width = self.lit.columns.len();
        for (row, v) in self.lit.rows.clone().zip(self.light_rows()) {
            let new = light.row(v);
            assert_eq!(
                new.len(),
                self.light.width as usize,
                "width of a light's row"
            );
            let new = &new[first..first + width];
            let old = &mut self.elements[row * stride + left..][..width];
            let changed = changed_range(old, new);
            if changed.is_empty() {
                continue;
            }
            old[changed.clone()].copy_from_slice(&new[changed.clone()]);
            let (start, end) = (left + changed.start, left + changed.end);
            let known = &mut self.changes[row];
            *known = match known.start < known.end {
                true => known.start.min(start)..known.end.max(end),
                false => start..end,
            };
        }
    }

    /// Forgets all changes.
    pub fn clear_changes(&mut self) {
        self.changes.fill(0..0);
    }

    /// Whether an element of a rectangle has changed.
    pub fn has_changed(&self, columns: Range<usize>, rows: Range<usize>) -> bool {
        self.changes[rows].iter().any(|changed| {
            !changed.is_empty() && changed.start < columns.end && columns.start < changed.end
        })
    }

    /// The elements from a column and row on, [`stride`](Self::stride) from row to row.
    #[inline(always)]
    pub fn elements_from(&self, column: usize, row: usize) -> &[[f32; 4]] {
        &self.elements[row * self.stride() + column..]
    }

    /// Elements from one row to the next.
    #[inline(always)]
    pub fn stride(&self) -> usize {
        self.extent.width as usize
    }
}

/// From the first to the last element whose bits differ.
fn changed_range(old: &[[f32; 4]], new: &[[f32; 4]]) -> Range<usize> {
    // In chunks first: usually nearly all elements are equal, or nearly none.
    const CHUNK: usize = 8;
    let chunk_differs = |(old, new): (&[[f32; 4]], &[[f32; 4]])| {
        bytemuck::cast_slice::<_, u32>(old) != bytemuck::cast_slice::<_, u32>(new)
    };
    let chunks = || old.chunks(CHUNK).zip(new.chunks(CHUNK));
    let Some(first) = chunks().position(chunk_differs) else {
        return 0..0;
    };
    let last = chunks().rposition(chunk_differs).unwrap_or(first);
    let differs = |i: &usize| old[*i].map(f32::to_bits) != new[*i].map(f32::to_bits);
    let end = old.len().min((last + 1) * CHUNK);
    let start = (first * CHUNK..end).find(differs).unwrap_or(end);
    start..(start..end).rfind(differs).map_or(start, |last| last + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_accumulate_until_they_are_cleared() {
        let extent = Extent {
            width: 20,
            height: 3,
        };
        // A border of seven columns and rows.
        let origin = Element { u: -7, v: -7 };
        let padded_extent = Extent {
            width: 34,
            height: 17,
        };
        let mut padded = PaddedLight::new(extent, origin, padded_extent);
        let mut values = vec![0.0; 60 * 3];
        let mut set = |padded: &mut PaddedLight, element: usize, value: f32| {
            values[3 * element] = value;
            let light = Light::from_linear_rgb(extent, &values).unwrap();
            padded.update(&light);
        };
        let assert_changed = |padded: &PaddedLight, columns: Range<usize>| {
            assert!(padded.has_changed(columns.clone(), 8..9));
            assert!(!padded.has_changed(0..columns.start, 0..17));
            assert!(!padded.has_changed(columns.end..34, 0..17));
            assert!(!padded.has_changed(0..34, 0..8) && !padded.has_changed(0..34, 9..17));
        };
        set(&mut padded, 20, 1.0);
        assert_changed(&padded, 7..8);
        padded.clear_changes();
        set(&mut padded, 20, 1.0);
        assert!(!padded.has_changed(0..34, 0..17));
        set(&mut padded, 38, 0.5);
        assert_changed(&padded, 25..26);
        // Two lights without a clear between them.
        set(&mut padded, 29, 0.5);
        assert_changed(&padded, 16..26);
        padded.clear_changes();
        set(&mut padded, 20, 0.0);
        assert_changed(&padded, 7..8);
    }
}
