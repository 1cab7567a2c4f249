//! A set of camera rows.

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// A set of camera rows, stored as disjoint strips.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CameraRowSet {
    /// From the top down; none empty, none adjacent to the next.
    strips: Vec<Range<u32>>,
    /// For each camera row up to the end of the last strip its index in the set, or [`ABSENT`].
    indices: Vec<u32>,
}

const ABSENT: u32 = u32::MAX;

impl CameraRowSet {
    /// The first `height` rows: a whole picture.
    pub fn all(height: u32) -> Self {
        Self::from_strips(std::iter::once(0..height))
    }

    /// The union of `strips`, which must be sorted by their start.
    pub fn from_strips(strips: impl IntoIterator<Item = Range<u32>>) -> Self {
        let mut joined: Vec<Range<u32>> = Vec::new();
        for strip in strips {
            match joined.last_mut() {
                Some(last) if strip.start <= last.end => last.end = last.end.max(strip.end),
                _ if strip.is_empty() => {}
                _ => joined.push(strip),
            }
        }
        let mut indices = vec![ABSENT; joined.last().map_or(0, |last| last.end as usize)];
        for (i, y) in joined.iter().cloned().flatten().enumerate() {
            indices[y as usize] = i as u32;
        }
        Self {
            strips: joined,
            indices,
        }
    }

    /// The strips, from the top down; no two are adjacent.
    pub fn strips(&self) -> &[Range<u32>] {
        &self.strips
    }

    /// Row numbers, from the top down.
    pub fn iter(&self) -> impl Iterator<Item = u32> {
        self.strips.iter().cloned().flatten()
    }

    /// Number of rows.
    pub fn count(&self) -> usize {
        self.strips.iter().map(|strip| strip.len()).sum()
    }

    /// Whether the set contains row `y`.
    pub fn contains(&self, y: u32) -> bool {
        self.index_of(y).is_some()
    }

    /// The first row from `y` on.
    pub fn first_from(&self, y: u32) -> Option<u32> {
        let mut strips = self.strips.iter();
        let strip = strips.find(|strip| strip.end > y)?;
        Some(strip.start.max(y))
    }

    /// The row below the last; 0 if there are none.
    pub fn end(&self) -> u32 {
        self.strips.last().map_or(0, |strip| strip.end)
    }

    /// Whether the set contains every row of `strip`.
    pub fn contains_all(&self, strip: Range<u32>) -> bool {
        let mut strips = self.strips.iter();
        strip.is_empty() || strips.any(|s| s.start <= strip.start && strip.end <= s.end)
    }

    /// Index of row `y` in the set: the number of its rows above `y`.
    pub fn index_of(&self, y: u32) -> Option<usize> {
        let index = *self.indices.get(y as usize)?;
        (index != ABSENT).then_some(index as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_are_merged_and_rows_indexed() {
        let rows = CameraRowSet::from_strips([2..4, 4..5, 5..5, 8..10, 9..11]);
        assert_eq!(rows.strips(), [2..5, 8..11]);
        assert_eq!(rows.count(), 6);
        let indices = (0..12).map(|y| rows.index_of(y));
        let present: Vec<_> = indices
            .enumerate()
            .filter_map(|(y, i)| Some((y, i?)))
            .collect();
        assert_eq!(present, [(2, 0), (3, 1), (4, 2), (8, 3), (9, 4), (10, 5)]);
        assert!(
            rows.iter()
                .enumerate()
                .all(|(i, y)| rows.index_of(y) == Some(i))
        );
        let first = [0, 2, 4, 5, 10, 11].map(|y| rows.first_from(y));
        let expected = [Some(2), Some(2), Some(4), Some(8), Some(10), None];
        assert_eq!((first, rows.end()), (expected, 11));
        assert!(rows.contains_all(2..5) && rows.contains_all(9..10) && rows.contains_all(6..6));
        assert!(!rows.contains_all(4..9) && !rows.contains_all(10..12));
        assert_eq!(
            CameraRowSet::all(3),
            CameraRowSet::from_strips([0..1, 1..3])
        );
        let none = CameraRowSet::from_strips([]);
        assert_eq!((none.count(), none.end()), (0, 0));
    }
}
