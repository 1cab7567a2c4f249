//! The inner loops of recovery.
//!
//! Elsewhere the compiler makes vector instructions of the [`portable`] loops. The WebAssembly module of recovery is
//! compiled for size, where it makes none: there these are written out ([`simd128`]), with the same operations on the
//! same lanes, and so the same bits.

#[cfg(any(test, not(all(target_arch = "wasm32", target_feature = "simd128"))))]
mod portable;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128;

#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
pub(crate) use portable::*;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
pub(crate) use simd128::*;

/// Partial sums of a dot product: as many `f64` as the widest vector registers hold.
pub(crate) const LANES: usize = 8;
/// Values of a basis function that [`combine_slots`] computes together. The sums of three channels take nine of
/// sixteen four-lane registers, which leaves enough for the basis function and the coefficients.
pub(crate) const BLOCK_SLOTS: usize = 12;

#[cfg(all(test, target_arch = "wasm32", target_feature = "simd128"))]
mod tests {
    use wasm_bindgen_test::wasm_bindgen_test;

    use super::{BLOCK_SLOTS, LANES, portable, simd128};

    fn value(i: usize) -> f64 {
        (i * 7919 % 1009) as f64 / 97.0 - 5.0
    }

    fn vector(n: usize, seed: usize) -> Vec<f64> {
        (0..n).map(|i| value(i + 31 * seed)).collect()
    }

    fn blocks(n: usize, seed: usize) -> Vec<[f64; LANES]> {
        (0..n)
            .map(|i| std::array::from_fn(|lane| value(i * LANES + lane + 17 * seed)))
            .collect()
    }

    #[wasm_bindgen_test]
    fn simd_returns_the_bits_of_the_portable_loops() {
        for n in 0..20 {
            let rows: [Vec<f64>; 5] = std::array::from_fn(|i| vector(n, i));
            let [a, b, c, d, y] = &rows;
            assert_eq!(portable::dot(a, b).to_bits(), simd128::dot(a, b).to_bits());
            let run = |kernel: &dyn Fn(&mut [f64])| {
                let mut y = y.clone();
                kernel(&mut y);
                y
            };
            let factors = [0.3, -1.7, 2.9, 0.1];
            assert_eq!(
                run(&|y| portable::add_scaled(y, 0.3, a)),
                run(&|y| simd128::add_scaled(y, 0.3, a))
            );
            assert_eq!(
                run(&|y| portable::add_four_scaled(y, [a, b, c, d], factors)),
                run(&|y| simd128::add_four_scaled(y, [a, b, c, d], factors))
            );
            assert_eq!(
                run(&|y| portable::add_products(y, a, b)),
                run(&|y| simd128::add_products(y, a, b))
            );
            assert_eq!(
                run(&|y| portable::set_scaled_sum(y, a, 0.7, b)),
                run(&|y| simd128::set_scaled_sum(y, a, 0.7, b))
            );
        }
        let panel = blocks(12, 1);
        let factors: Vec<[f64; 4]> = vector(12, 3).as_chunks().0.to_vec();
        assert_eq!(
            portable::combine_blocks(&panel, &factors),
            simd128::combine_blocks(&panel, &factors)
        );
        let (mut plain, mut wide) = (panel.clone(), panel);
        let block = blocks(1, 5)[0];
        portable::add_outer_block(&mut plain, &factors, block);
        simd128::add_outer_block(&mut wide, &factors, block);
        assert_eq!(plain, wide);
    }

    #[wasm_bindgen_test]
    fn single_precision_returns_the_bits_of_the_portable_loops() {
        let values = |n: usize, seed: usize| -> Vec<f32> {
            vector(n, seed).into_iter().map(|v| v as f32).collect()
        };
        let (factors, stride) = (values(9, 1), 56);
        let rows = values(9 * stride, 2);
        let (mut plain, mut wide) = (vec![0.0; stride], vec![0.0; stride]);
        portable::multiply_rows(&factors, &rows, &mut plain);
        simd128::multiply_rows(&factors, &rows, &mut wide);
        assert_eq!(plain, wide);
        let coefficients: Vec<[f32; 3]> = values(21, 3).as_chunks().0.to_vec();
        let kernels: Vec<[f32; BLOCK_SLOTS]> = values(7 * BLOCK_SLOTS, 4).as_chunks().0.to_vec();
        assert_eq!(
            portable::combine_slots(&coefficients, &kernels),
            simd128::combine_slots(&coefficients, &kernels)
        );
    }
}
