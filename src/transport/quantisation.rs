//! Rounding to 16-bit codes: `value ≈ code · step`, with a step for each channel.

use super::geometry::CHANNELS;

/// The largest magnitude in each channel. Values that are not finite count as zero.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ChannelPeaks([f32; CHANNELS]);

impl ChannelPeaks {
    /// Of all values.
    pub fn of(values: &[[f32; CHANNELS]]) -> Self {
        // A local variable, which stays in registers.
        let mut peaks = Self::default();
        for value in values {
            peaks.add(value);
        }
        peaks
    }

    #[inline(always)]
    pub fn add(&mut self, value: &[f32; CHANNELS]) {
        for c in 0..CHANNELS {
            if value[c].is_finite() {
                self.0[c] = self.0[c].max(value[c].abs());
            }
        }
    }

    /// For each channel the step by which its largest value has the code `max_code`; `None` if all are dark.
    pub fn steps(self, max_code: f32) -> Option<[f32; CHANNELS]> {
        // A channel whose step would be subnormal is dark.
        let is_lit = |step: &f32| *step >= f32::MIN_POSITIVE;
        let steps = self.0.map(|peak| peak / max_code);
        let any_lit = steps.iter().any(is_lit);
        any_lit.then(|| steps.map(|step| if is_lit(&step) { step } else { 1.0 }))
    }
}

/// The code nearest to a value; 0 for a value that is not finite.
pub(super) fn code(value: f32, step: f32) -> i16 {
    match value.is_finite() {
        true => (value / step + 0.5f32.copysign(value)) as i16, // rounds; `as` saturates
        false => 0,
    }
}
