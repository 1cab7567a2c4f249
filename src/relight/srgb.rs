//! The sRGB transfer function (IEC 61966-2-1), between linear values and codes. Display P3 has the same one.

use std::sync::LazyLock;

use super::platform_math;

/// A linear value, clamped to 0..=1, to an encoded one of 0..=1.
pub fn srgb_encode(linear: f64) -> f64 {
    let y = linear.clamp(0.0, 1.0);
    if y <= 0.003_130_8 {
        12.92 * y
    } else {
        1.055 * platform_math::pow(y, 1.0 / 2.4) - 0.055
    }
}

/// An encoded value of 0..=1 to a linear one of 0..=1.
pub fn srgb_decode(encoded: f64) -> f64 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        platform_math::pow((encoded + 0.055) / 1.055, 2.4)
    }
}

/// The linear value of each 8-bit code.
pub fn srgb8_decoded() -> &'static [f64; 256] {
    static DECODED: LazyLock<[f64; 256]> =
        LazyLock::new(|| std::array::from_fn(|code| srgb_decode(code as f64 / 255.0)));
    &DECODED
}

/// The 8-bit code nearest to a linear value; 0 for NaN.
pub fn srgb8(linear: f64) -> u8 {
    (srgb_encode(linear) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_code_survives_a_round_trip() {
        for code in 0..=255u8 {
            assert_eq!(srgb8(srgb_decode(f64::from(code) / 255.0)), code);
            assert_eq!(srgb8(srgb8_decoded()[usize::from(code)]), code);
        }
        assert_eq!(srgb8(-1.0), 0);
        assert_eq!(srgb8(7.0), 255);
        assert_eq!(srgb8(f64::NAN), 0);
    }
}
