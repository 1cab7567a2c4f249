//! The inner loops in plain Rust.

use super::{BLOCK_SLOTS, LANES};

/// Returns `aᵀb` for vectors of one length.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut lanes = [0.0f64; LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    // Lanes by a number known to the compiler only: others would be in memory.
    let ((a, a_rest), (b, b_rest)) = (a_rest.as_chunks::<4>(), b_rest.as_chunks::<4>());
    if let ([a], [b]) = (a, b) {
        for lane in 0..4 {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    let mut rest = 0.0;
    for (a, b) in a_rest.iter().zip(b_rest) {
        rest += a * b;
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h)) + rest
}

/// Computes `y += factor · x`.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

/// Computes `y += Σ_i factors[i] · rows[i]`.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn add_four_scaled(y: &mut [f64], [a, b, c, d]: [&[f64]; 4], f: [f64; 4]) {
    let [f0, f1, f2, f3] = f;
    let rows = a.iter().zip(b).zip(c).zip(d);
    for (y, (((a, b), c), d)) in y.iter_mut().zip(rows) {
        *y += (f0 * a + f1 * b) + (f2 * c + f3 * d);
    }
}

/// Computes `sums += a ∘ b`, entry by entry.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn add_products(sums: &mut [f64], a: &[f64], b: &[f64]) {
    for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
        *sum += a * b;
    }
}

/// Computes `y = a + factor · b`.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn set_scaled_sum(y: &mut [f64], a: &[f64], factor: f64, b: &[f64]) {
    for ((y, a), b) in y.iter_mut().zip(a).zip(b) {
        *y = a + factor * b;
    }
}

/// Returns `Σ_i factors[i] · rows[i]`, four rows at a time.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn combine_blocks(rows: &[[f64; LANES]], factors: &[[f64; 4]]) -> [f64; LANES] {
    let mut sum = [0.0; LANES];
    for ([a, b, c, d], f) in rows.as_chunks().0.iter().zip(factors) {
        for i in 0..LANES {
            sum[i] += (f[0] * a[i] + f[1] * b[i]) + (f[2] * c[i] + f[3] * d[i]);
        }
    }
    sum
}

/// Computes `rows[i] += factors[i] · block`.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn add_outer_block(
    rows: &mut [[f64; LANES]],
    factors: &[[f64; 4]],
    block: [f64; LANES],
) {
    for (rows, factors) in rows.as_chunks_mut::<4>().0.iter_mut().zip(factors) {
        let mut sums = *rows;
        for (sum, v) in sums.iter_mut().zip(factors) {
            for lane in 0..LANES {
                sum[lane] += v * block[lane];
            }
        }
        *rows = sums;
    }
}

/// Computes `row = factors · rows`, for `rows` `[_, stride]` and a `row` of `stride` entries, a multiple of eight.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn multiply_rows(factors: &[f32], rows: &[f32], row: &mut [f32]) {
    let stride = row.len();
    let mut at = 0;
    // As many sums at a time as the registers of the machine hold, then fewer for the rest.
    while at < stride {
        match stride - at {
            32.. => at += multiply_block::<32>(factors, rows, row, at),
            16.. => at += multiply_block::<16>(factors, rows, row, at),
            _ => at += multiply_block::<8>(factors, rows, row, at),
        }
    }
}

/// Entries `at..at + WIDTH` of `row`; returns `WIDTH`.
#[cfg_attr(target_arch = "x86_64", inline(always))]
fn multiply_block<const WIDTH: usize>(
    factors: &[f32],
    rows: &[f32],
    row: &mut [f32],
    at: usize,
) -> usize {
    let mut sums = [0.0f32; WIDTH];
    for (p, values) in factors.iter().zip(rows.chunks_exact(row.len())) {
        if let Some(values) = values[at..].first_chunk::<WIDTH>() {
            for (sum, v) in sums.iter_mut().zip(values) {
                *sum += p * v;
            }
        }
    }
    row[at..at + WIDTH].copy_from_slice(&sums);
    WIDTH
}

/// `Σ_k c_k v_k` on one block of slots by channel. Sums run over `k` in order, so that results do not depend on the
/// size of blocks.
pub(crate) fn combine_slots(
    coefficients: &[[f32; 3]],
    kernels: &[[f32; BLOCK_SLOTS]],
) -> [[f32; BLOCK_SLOTS]; 3] {
    // Three variables instead of an array, which the compiler would keep in memory.
    let (mut red, mut green, mut blue) =
        ([0.0; BLOCK_SLOTS], [0.0; BLOCK_SLOTS], [0.0; BLOCK_SLOTS]);
    for ([r, g, b], kernel) in coefficients.iter().zip(kernels) {
        for (s, v) in kernel.iter().enumerate() {
            red[s] += r * v;
            green[s] += g * v;
            blue[s] += b * v;
        }
    }
    [red, green, blue]
}
