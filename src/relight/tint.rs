//! Lights of one colour, which are seen through the basis once and not three times.

use crate::transport::CHANNELS;

/// How far from its colour an element may be, of itself: rounding of single precision.
const ROUNDING: f32 = 1e-6;

/// What channels of a light have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tint {
    /// Each channel is the same as the one of that number, times its factor.
    One(usize, [f32; CHANNELS]),
    /// Elements have colours of their own.
    Many,
}

impl Tint {
    /// Of all elements of these rows.
    #[inline(always)]
    pub fn of<'a>(rows: impl Iterator<Item = &'a [[f32; 4]]> + Clone) -> Self {
        if differs(rows.clone().flatten()) {
            return Self::Many;
        }
        let mut sums = [0.0f32; 4];
        for row in rows.clone() {
            for element in row {
                (0..4).for_each(|c| sums[c] += element[c]);
            }
        }
        let base = (1..CHANNELS).fold(0, |best, c| if sums[c] > sums[best] { c } else { best });
        if sums[base] <= 0.0 {
            return Self::One(base, [0.0; CHANNELS]);
        }
        // From the brightest element: sums have rounding of their own.
        let brightest = rows
            .clone()
            .flatten()
            .max_by(|a, b| a[base].total_cmp(&b[base]));
        let brightest = brightest.copied().unwrap_or_default();
        let factors = std::array::from_fn(|c| brightest[c] / brightest[base]);
        for row in rows {
            let mut off = [0.0f32; CHANNELS];
            for element in row {
                // The smallest numbers there are have no such precision.
                let size = element[0].max(element[1]).max(element[2]);
                let most = ROUNDING * size + f32::MIN_POSITIVE;
                for c in 0..CHANNELS {
                    off[c] = off[c].max((element[c] - factors[c] * element[base]).abs() - most);
                }
            }
            if off.iter().any(|off| *off > 0.0) {
                return Self::Many;
            }
        }
        Self::One(base, factors)
    }

    /// Whether there is no light.
    pub fn is_dark(&self) -> bool {
        matches!(self, Self::One(_, [0.0, 0.0, 0.0]))
    }

    /// The channels that have to be looked at.
    pub fn channels(&self) -> &[usize] {
        const ALL: [usize; CHANNELS] = [0, 1, 2];
        match self {
            Self::One(base, _) => &ALL[*base..=*base],
            Self::Many => &ALL,
        }
    }
}

/// Whether elements have plainly another colour than the first that shines: what most lights of many
/// colours show at once.
#[inline(always)]
fn differs<'a>(elements: impl Iterator<Item = &'a [f32; 4]>) -> bool {
    let of = |element: &[f32; 4]| element[0].max(element[1]).max(element[2]);
    // The smallest numbers there are have no colour to speak of.
    let mut shining = elements.filter(|element| of(element) > 1e-20);
    let Some(first) = shining.next() else {
        return false;
    };
    let colour = first.map(|value| value / of(first));
    let off = |element: &[f32; 4]| {
        let size = of(element);
        (0..CHANNELS).any(|c| (element[c] - colour[c] * size).abs() > 1e-3 * size)
    };
    shining.any(off)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_colour_is_told_from_many() {
        let tint = |elements: &[[f32; 4]]| Tint::of(elements.chunks(2));
        let warm = |x: f32| [x, 0.93 * x, 0.8 * x, 0.0];
        assert_eq!(
            tint(&[warm(0.0), warm(0.3), warm(0.7)]),
            Tint::One(0, [1.0, 0.93 * 0.7 / 0.7, 0.8 * 0.7 / 0.7])
        );
        assert!(tint(&[[0.0; 4]; 3]).is_dark());
        assert_eq!(tint(&[warm(0.1), [0.1, 0.1, 0.1, 0.0]]), Tint::Many);
        assert_eq!(
            tint(&[[1e4, 1e4, 1e4, 0.0], [0.005, 0.0, 0.0, 0.0]]),
            Tint::Many
        );
        assert!(matches!(tint(&[warm(1.0), warm(1e-39)]), Tint::One(0, _)));
        assert_eq!(tint(&[[0.0, 0.0, 0.5, 0.0]]).channels(), [2]);
    }
}
