//! The orthonormal discrete cosine transform of blocks of 8 x 8 pixels (Ahmed, Natarajan and Rao 1974).

/// Pixels along a block's side.
pub const SIDE: usize = 8;
/// Pixels of a block.
pub const AREA: usize = SIDE * SIDE;

/// A block's pixels, or its coefficients, row by row.
pub type DctBlock = [f32; AREA];

/// `cos(i π / 16)` for i from 0 to 8, as f32.
const COSINES: [f32; 9] = [
    1.0,
    0.980_785_25,
    0.923_879_5,
    0.831_469_6,
    0.707_106_77,
    0.555_570_24,
    0.382_683_43,
    0.195_090_32,
    0.0,
];

/// `[frequency][x]`: `½ cos((2x + 1) frequency π / 16)`, and `√⅛` for frequency 0.
pub const BASIS: [[f32; SIDE]; SIDE] = basis();

const fn basis() -> [[f32; SIDE]; SIDE] {
    let mut basis = [[0.0; SIDE]; SIDE];
    let mut frequency = 0;
    while frequency < SIDE {
        let mut x = 0;
        while x < SIDE {
            // The angle in sixteenths of π, folded into the first quarter of the circle.
            let angle = (2 * x + 1) * frequency % 32;
            let half = if angle > 16 { 32 - angle } else { angle };
            let cosine = if half > 8 {
                -COSINES[16 - half]
            } else {
                COSINES[half]
            };
            basis[frequency][x] = 0.5 * if frequency == 0 { COSINES[4] } else { cosine };
            x += 1;
        }
        frequency += 1;
    }
    basis
}

/// JPEG's order of coefficients: by the sum of their frequencies, diagonals in alternating direction.
pub const ZIGZAG: [u8; AREA] = [
    0, 1, 8, 16, 9, 2, 3, 10, 17, 24, 32, 25, 18, 11, 4, 5, 12, 19, 26, 33, 40, 48, 41, 34, 27, 20,
    13, 6, 7, 14, 21, 28, 35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23, 30, 37, 44, 51, 58, 59,
    52, 45, 38, 31, 39, 46, 53, 60, 61, 54, 47, 55, 62, 63,
];

/// The coefficients of a block's pixels.
pub fn forward(pixels: &DctBlock) -> DctBlock {
    let mut rows = [0.0; AREA];
    for y in 0..SIDE {
        for u in 0..SIDE {
            rows[y * SIDE + u] = (0..SIDE).map(|x| BASIS[u][x] * pixels[y * SIDE + x]).sum();
        }
    }
    let mut coefficients = [0.0; AREA];
    for v in 0..SIDE {
        for u in 0..SIDE {
            coefficients[v * SIDE + u] = (0..SIDE).map(|y| BASIS[v][y] * rows[y * SIDE + u]).sum();
        }
    }
    coefficients
}

/// The pixels of a block's coefficients: columns first, then rows, each sum from frequency 0 upwards.
pub fn inverse(coefficients: &DctBlock) -> DctBlock {
    let mut columns = [0.0f32; AREA];
    for v in 0..SIDE {
        let row = &coefficients[v * SIDE..(v + 1) * SIDE];
        if row.iter().all(|c| *c == 0.0) {
            continue;
        }
        for y in 0..SIDE {
            for u in 0..SIDE {
                columns[y * SIDE + u] += BASIS[v][y] * row[u];
            }
        }
    }
    let mut pixels = [0.0f32; AREA];
    for y in 0..SIDE {
        for u in 0..SIDE {
            for x in 0..SIDE {
                pixels[y * SIDE + x] += columns[y * SIDE + u] * BASIS[u][x];
            }
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_basis_is_the_cosines_and_orthonormal() {
        for u in 0..SIDE {
            for x in 0..SIDE {
                let angle = (2 * x + 1) as f64 * u as f64 * std::f64::consts::PI / 16.0;
                let norm = if u == 0 { 0.125f64.sqrt() } else { 0.5 };
                assert!((f64::from(BASIS[u][x]) - norm * angle.cos()).abs() < 1e-7);
            }
            for v in 0..SIDE {
                let dot: f32 = BASIS[u].iter().zip(&BASIS[v]).map(|(a, b)| a * b).sum();
                assert!((dot - f32::from(u8::from(u == v))).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn the_zigzag_order_is_that_of_jpeg() {
        assert_eq!(ZIGZAG[..10], [0, 1, 8, 16, 9, 2, 3, 10, 17, 24]);
        let mut all = ZIGZAG;
        all.sort();
        assert!(all.iter().enumerate().all(|(i, at)| usize::from(*at) == i));
    }

    #[test]
    fn the_inverse_gives_the_pixels_back() {
        let pixels: DctBlock = std::array::from_fn(|i| ((i * i) as f32 * 0.37).sin());
        let back = inverse(&forward(&pixels));
        for (a, b) in back.iter().zip(&pixels) {
            assert!((a - b).abs() < 1e-5);
        }
    }
}
