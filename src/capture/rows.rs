//! Which camera rows are at hand.

use std::ops::Range;

/// A set of camera rows: all of them, a strip, or several strips.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rows {
    /// Strips from the top down, none empty, none touching the next.
    strips: Vec<Range<u32>>,
    /// Where each camera row up to the last strip's end is kept, or [`ABSENT`].
    places: Vec<u32>,
}

const ABSENT: u32 = u32::MAX;

impl Rows {
    /// The first `height` rows: a whole picture.
    pub fn all(height: u32) -> Self {
        Self::from_strips(std::iter::once(0..height))
    }

    /// The rows of all `strips`, which may touch or overlap but must come from the top down.
    pub fn from_strips(strips: impl IntoIterator<Item = Range<u32>>) -> Self {
        let mut joined: Vec<Range<u32>> = Vec::new();
        for strip in strips {
            match joined.last_mut() {
                Some(last) if strip.start <= last.end => last.end = last.end.max(strip.end),
                _ if strip.is_empty() => {}
                _ => joined.push(strip),
            }
        }
        let mut places = vec![ABSENT; joined.last().map_or(0, |last| last.end as usize)];
        for (place, y) in joined.iter().cloned().flatten().enumerate() {
            places[y as usize] = place as u32;
        }
        Self {
            strips: joined,
            places,
        }
    }

    /// The strips, from the top down; no two touch.
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

    /// Whether row `y` is among them.
    pub fn contains(&self, y: u32) -> bool {
        self.place(y).is_some()
    }

    /// Whether every row of `strip` is.
    pub fn contains_all(&self, strip: Range<u32>) -> bool {
        let mut holders = self.strips.iter();
        strip.is_empty() || holders.any(|s| s.start <= strip.start && strip.end <= s.end)
    }

    /// How many of the rows lie above row `y`, if it is among them.
    pub fn place(&self, y: u32) -> Option<usize> {
        let place = *self.places.get(y as usize)?;
        (place != ABSENT).then_some(place as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_join_and_rows_have_their_places() {
        let rows = Rows::from_strips([2..4, 4..5, 5..5, 8..10, 9..11]);
        assert_eq!(rows.strips(), [2..5, 8..11]);
        assert_eq!(rows.count(), 6);
        let places = (0..12).map(|y| rows.place(y));
        let kept: Vec<_> = places
            .enumerate()
            .filter_map(|(y, p)| Some((y, p?)))
            .collect();
        assert_eq!(kept, [(2, 0), (3, 1), (4, 2), (8, 3), (9, 4), (10, 5)]);
        assert!(
            rows.iter()
                .enumerate()
                .all(|(i, y)| rows.place(y) == Some(i))
        );
        assert!(rows.contains_all(2..5) && rows.contains_all(9..10) && rows.contains_all(6..6));
        assert!(!rows.contains_all(4..9) && !rows.contains_all(10..12));
        assert_eq!(Rows::all(3), Rows::from_strips([0..1, 1..3]));
        assert_eq!(Rows::from_strips([]).count(), 0);
    }
}
