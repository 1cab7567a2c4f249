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
        let brightest = brightest(rows.clone());
        let base = (1..CHANNELS).fold(0, |best, c| match brightest[c] > brightest[best] {
            true => c,
            false => best,
        });
        if brightest[base] <= 0.0 {
            return Self::One(base, [0.0; CHANNELS]);
        }
        let factors = brightest.map(|value| value / brightest[base]);
        for row in rows {
            let mut off = [0.0f32; 4];
            for element in row {
                let base = element[base];
                // The smallest numbers there are have no such precision.
                let most = ROUNDING * base + f32::MIN_POSITIVE;
                for c in 0..4 {
                    off[c] = larger(off[c], (element[c] - factors[c] * base).abs() - most);
                }
            }
            if off[..CHANNELS].iter().any(|off| *off > 0.0) {
                return Self::Many;
            }
        }
        let [red, green, blue, _] = factors;
        Self::One(base, [red, green, blue])
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

/// The most of each channel.
#[inline(always)]
fn brightest<'a>(rows: impl Iterator<Item = &'a [[f32; 4]]>) -> [f32; 4] {
    // Four by four: each maximum waits for the last.
    let mut most = [[0.0f32; 4]; 4];
    for row in rows {
        let (fours, rest) = row.as_chunks::<4>();
        for four in fours {
            for (most, element) in most.iter_mut().zip(four) {
                for c in 0..4 {
                    most[c] = larger(most[c], element[c]);
                }
            }
        }
        for element in rest {
            for c in 0..4 {
                most[0][c] = larger(most[0][c], element[c]);
            }
        }
    }
    let [a, b, c, d] = most;
    std::array::from_fn(|i| larger(larger(a[i], b[i]), larger(c[i], d[i])))
}

/// Of numbers that are numbers, for which this is one instruction.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
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
