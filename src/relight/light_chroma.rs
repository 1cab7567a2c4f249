//! The ratio between a light's channels. Where it is uniform, one channel's basis response serves all three.

use crate::transport::CHANNELS;

/// How far an element may be from the common ratio, relative to its brightness: the rounding of single precision.
const CHROMA_TOLERANCE: f32 = 1e-6;

/// The ratio between the channels of a light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LightChroma {
    /// The same for all elements: channel `c` equals `factors[c]` times channel `base`.
    Uniform {
        /// The brightest channel.
        base: usize,
        /// At most 1; all 0 if the light is dark.
        factors: [f32; CHANNELS],
    },
    /// Not the same for all elements, or unknown.
    #[default]
    Varying,
}

impl LightChroma {
    /// The chroma of the elements in `rows`.
    #[inline(always)]
    pub fn of_rows<'a>(rows: impl Iterator<Item = &'a [[f32; 4]]> + Clone) -> Self {
        let brightest = channel_maxima(rows.clone());
        let base = (1..CHANNELS).fold(0, |best, c| match brightest[c] > brightest[best] {
            true => c,
            false => best,
        });
        if brightest[base] <= 0.0 {
            let factors = [0.0; CHANNELS];
            return Self::Uniform { base, factors };
        }
        let ratios = brightest.map(|value| value / brightest[base]);
        for row in rows {
            let mut excess = [0.0f32; 4];
            for element in row {
                let base = element[base];
                // Subnormal values do not have that precision.
                let tolerance = CHROMA_TOLERANCE * base + f32::MIN_POSITIVE;
                for c in 0..4 {
                    excess[c] = max(excess[c], (element[c] - ratios[c] * base).abs() - tolerance);
                }
            }
            if excess[..CHANNELS].iter().any(|excess| *excess > 0.0) {
                return Self::Varying;
            }
        }
        let [red, green, blue, _] = ratios;
        Self::Uniform {
            base,
            factors: [red, green, blue],
        }
    }

    /// Whether all elements are zero.
    pub fn is_dark(&self) -> bool {
        match self {
            Self::Uniform { factors, .. } => *factors == [0.0; CHANNELS],
            Self::Varying => false,
        }
    }

    /// The channels whose basis response is needed.
    pub fn channels(&self) -> &[usize] {
        const ALL: [usize; CHANNELS] = [0, 1, 2];
        match self {
            Self::Uniform { base, .. } => &ALL[*base..=*base],
            Self::Varying => &ALL,
        }
    }
}

/// The largest value of each channel.
#[inline(always)]
fn channel_maxima<'a>(rows: impl Iterator<Item = &'a [[f32; 4]]>) -> [f32; 4] {
    // Four independent chains: within one, each maximum waits for the last.
    let mut maxima = [[0.0f32; 4]; 4];
    for row in rows {
        let (fours, rest) = row.as_chunks::<4>();
        for four in fours {
            for (maxima, element) in maxima.iter_mut().zip(four) {
                for c in 0..4 {
                    maxima[c] = max(maxima[c], element[c]);
                }
            }
        }
        for element in rest {
            for c in 0..4 {
                maxima[0][c] = max(maxima[0][c], element[c]);
            }
        }
    }
    let [a, b, c, d] = maxima;
    std::array::from_fn(|i| max(max(a[i], b[i]), max(c[i], d[i])))
}

/// One instruction, unlike [`f32::max`], as it does not deal with NaN.
#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_and_varying_chroma_are_told_apart() {
        let chroma = |elements: &[[f32; 4]]| LightChroma::of_rows(elements.chunks(2));
        let warm = |x: f32| [x, 0.93 * x, 0.8 * x, 0.0];
        assert_eq!(
            chroma(&[warm(0.0), warm(0.3), warm(0.7)]),
            LightChroma::Uniform {
                base: 0,
                factors: [1.0, 0.93 * 0.7 / 0.7, 0.8 * 0.7 / 0.7]
            }
        );
        assert!(chroma(&[[0.0; 4]; 3]).is_dark());
        assert_eq!(
            chroma(&[warm(0.1), [0.1, 0.1, 0.1, 0.0]]),
            LightChroma::Varying
        );
        assert_eq!(
            chroma(&[[1e4, 1e4, 1e4, 0.0], [0.005, 0.0, 0.0, 0.0]]),
            LightChroma::Varying
        );
        assert!(matches!(
            chroma(&[warm(1.0), warm(1e-39)]),
            LightChroma::Uniform { base: 0, .. }
        ));
        assert_eq!(chroma(&[[0.0, 0.0, 0.5, 0.0]]).channels(), [2]);
    }
}
