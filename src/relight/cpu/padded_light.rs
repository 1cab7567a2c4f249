//! The light with a dark border, where windows hang over the light plane, and which elements have changed.

use std::ops::Range;

use crate::transport::{ClippedRect, Extent, LightElement};

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
    pub fn new(light: Extent, origin: LightElement, extent: Extent) -> Self {
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

    /// Replaces row `v` of the light plane, if it is inside this.
    ///
    /// # Panics
    /// If the row has another width than the light plane.
    pub fn set_row(&mut self, v: u32, elements: &[[f32; 4]]) {
        let width = self.light.width as usize;
        // Not `assert_eq`, whose formatting code modules would have to carry.
        assert!(elements.len() == width, "width of a row");
        let rows = self.light_rows();
        if self.lit.is_empty() || !rows.contains(&v) {
            return;
        }
        let row = self.lit.rows.start + (v - rows.start) as usize;
        let ([first, _], lit) = (self.lit.first(), self.lit.columns.clone());
        let new = &elements[first..first + lit.len()];
        let start = row * self.stride();
        let old = &mut self.elements[start + lit.start..start + lit.end];
        let changed = changed_range(old, new);
        if changed.is_empty() {
            return;
        }
        old[changed.clone()].copy_from_slice(&new[changed.clone()]);
        let (start, end) = (lit.start + changed.start, lit.start + changed.end);
        let known = &mut self.changes[row];
        *known = match Range::is_empty(known) {
            true => start..end,
            false => known.start.min(start)..known.end.max(end),
        };
    }

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
        let extent = Extent::new(20, 3);
        // A border of seven columns and rows.
        let origin = LightElement { u: -7, v: -7 };
        let padded_extent = Extent::new(34, 17);
        let mut padded = PaddedLight::new(extent, origin, padded_extent);
        let mut values = vec![[0.0; 4]; 60];
        let mut set = |padded: &mut PaddedLight, element: usize, value: f32| {
            values[element][0] = value;
            for (v, row) in (0..).zip(values.chunks(20)) {
                padded.set_row(v, row);
            }
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
