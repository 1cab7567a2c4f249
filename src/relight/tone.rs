//! The display transform: linear light to sRGB and back.

use std::sync::LazyLock;

/// sRGB transfer function (IEC 61966-2-1), linear to encoded, clamped to 0..=1.
pub fn srgb_encode(linear: f64) -> f64 {
    let y = linear.clamp(0.0, 1.0);
    if y <= 0.003_130_8 {
        12.92 * y
    } else {
        1.055 * y.powf(1.0 / 2.4) - 0.055
    }
}

/// sRGB transfer function, encoded to linear, for 0..=1.
pub fn srgb_decode(encoded: f64) -> f64 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear light to the nearest 8-bit sRGB code. NaN is black.
pub fn srgb8(linear: f64) -> u8 {
    (srgb_encode(linear) * 255.0).round() as u8
}

/// The curve as a table, for pictures.
#[derive(Debug)]
pub struct Curve([u8; CODES]);

/// Entries of the table: where the curve is steepest, at black, one is a fifth of a code.
const CODES: usize = 1 << 14;

impl Curve {
    /// The one there is.
    pub fn get() -> &'static Self {
        static CURVE: LazyLock<Curve> = LazyLock::new(|| {
            Curve(std::array::from_fn(|i| {
                srgb8(i as f64 / (CODES - 1) as f64)
            }))
        });
        &CURVE
    }

    /// [`srgb8`], to within one code.
    #[inline(always)]
    pub fn srgb8(&self, linear: f32) -> u8 {
        const TOP: f32 = (CODES - 1) as f32;
        // NaN is neither more nor less, and `as` makes it 0.
        self.0[(linear.clamp(0.0, 1.0) * TOP + 0.5) as usize & (CODES - 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives_the_round_trip() {
        for code in 0..=255u8 {
            assert_eq!(srgb8(srgb_decode(f64::from(code) / 255.0)), code);
        }
        for i in 0..=100_000 {
            let linear = (f64::from(i) / 9e4 - 0.01) as f32;
            let (fast, exact) = (Curve::get().srgb8(linear), srgb8(f64::from(linear)));
            assert!(fast.abs_diff(exact) <= 1, "{linear}: {fast}, not {exact}");
        }
        for odd in [f32::NAN, f32::INFINITY, -f32::INFINITY] {
            assert_eq!(Curve::get().srgb8(odd), srgb8(f64::from(odd)));
        }
        assert_eq!(srgb8(-1.0), 0);
        assert_eq!(srgb8(7.0), 255);
        assert_eq!(srgb8(f64::NAN), 0);
    }
}
