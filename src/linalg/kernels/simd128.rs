//! The inner loops in the vector instructions of WebAssembly.

use std::arch::wasm32::{
    f32x4_add, f32x4_mul, f32x4_splat, f64x2_add, f64x2_extract_lane, f64x2_mul, f64x2_splat, v128,
};

use bytemuck::{Pod, must_cast, must_cast_mut, must_cast_ref};

use super::{BLOCK_SLOTS, LANES};

/// The vector of two or four values.
#[inline(always)]
fn load<T: Pod>(values: &T) -> v128 {
    must_cast(*values)
}

#[inline(always)]
fn store<T: Pod>(values: &mut T, vector: v128) {
    *values = must_cast(vector);
}

/// Stores vectors one after the other, as far as `values` go.
#[inline(always)]
fn store_all<const N: usize>(values: &mut [f32], vectors: [v128; N]) {
    for (to, vector) in values.as_chunks_mut::<4>().0.iter_mut().zip(vectors) {
        store(to, vector);
    }
}

#[inline(always)]
fn pairs(four: &[f64; 4]) -> &[[f64; 2]; 2] {
    must_cast_ref(four)
}

/// The vectors of a block.
#[inline(always)]
fn load_block(block: &[f64; LANES]) -> [v128; 4] {
    let [a, b, c, d]: &[[f64; 2]; 4] = must_cast_ref(block);
    [load(a), load(b), load(c), load(d)]
}

#[inline(always)]
fn store_block(block: &mut [f64; LANES], [a, b, c, d]: [v128; 4]) {
    let [to_a, to_b, to_c, to_d]: &mut [[f64; 2]; 4] = must_cast_mut(block);
    store(to_a, a);
    store(to_b, b);
    store(to_c, c);
    store(to_d, d);
}

#[inline(always)]
fn splat_each([a, b, c, d]: [f64; 4]) -> [v128; 4] {
    [
        f64x2_splat(a),
        f64x2_splat(b),
        f64x2_splat(c),
        f64x2_splat(d),
    ]
}

/// `y + a · b`, lane by lane.
#[inline(always)]
fn add_product(y: v128, a: v128, b: v128) -> v128 {
    f64x2_add(y, f64x2_mul(a, b))
}

#[inline(always)]
fn add_block_product(y: [v128; 4], a: [v128; 4], b: [v128; 4]) -> [v128; 4] {
    [
        add_product(y[0], a[0], b[0]),
        add_product(y[1], a[1], b[1]),
        add_product(y[2], a[2], b[2]),
        add_product(y[3], a[3], b[3]),
    ]
}

/// As [`add_product`], in single precision.
#[inline(always)]
fn add_product_single(y: v128, a: v128, b: v128) -> v128 {
    f32x4_add(y, f32x4_mul(a, b))
}

/// Computes `y[i] = f(y[i], a[i], b[i])`: by two vectors, and by one and by `scalar` for up to three entries at the end.
#[inline(always)]
fn update(
    y: &mut [f64],
    a: &[f64],
    b: &[f64],
    vector: impl Fn(v128, v128, v128) -> v128,
    scalar: impl Fn(f64, f64, f64) -> f64,
) {
    let n = y.len().min(a.len()).min(b.len());
    let (y, y_rest) = y[..n].as_chunks_mut::<4>();
    let ((a, a_rest), (b, b_rest)) = (a[..n].as_chunks::<4>(), b[..n].as_chunks::<4>());
    for ((y, a), b) in y.iter_mut().zip(a).zip(b) {
        let [y0, y1]: &mut [[f64; 2]; 2] = must_cast_mut(y);
        let ([a0, a1], [b0, b1]) = (pairs(a), pairs(b));
        store(y0, vector(load(y0), load(a0), load(b0)));
        store(y1, vector(load(y1), load(a1), load(b1)));
    }
    let ((y, y_last), (a, a_last), (b, b_last)) = (
        y_rest.as_chunks_mut::<2>(),
        a_rest.as_chunks::<2>(),
        b_rest.as_chunks::<2>(),
    );
    if let ([y], [a], [b]) = (y, a, b) {
        store(y, vector(load(y), load(a), load(b)));
    }
    if let ([y], [a], [b]) = (y_last, a_last, b_last) {
        *y = scalar(*y, *a, *b);
    }
}

/// Returns `aᵀb` for vectors of one length.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut sums = [f64x2_splat(0.0); 4];
    for (a, b) in a.iter().zip(b) {
        sums = add_block_product(sums, load_block(a), load_block(b));
    }
    let [mut ab, mut cd, ef, gh] = sums;
    let ((a, a_rest), (b, b_rest)) = (a_rest.as_chunks::<4>(), b_rest.as_chunks::<4>());
    if let ([a], [b]) = (a, b) {
        let ([a0, a1], [b0, b1]) = (pairs(a), pairs(b));
        ab = add_product(ab, load(a0), load(b0));
        cd = add_product(cd, load(a1), load(b1));
    }
    let mut rest = 0.0;
    for (a, b) in a_rest.iter().zip(b_rest) {
        rest += a * b;
    }
    let sum = f64x2_add(f64x2_add(ab, ef), f64x2_add(cd, gh));
    f64x2_extract_lane::<0>(sum) + f64x2_extract_lane::<1>(sum) + rest
}

/// Computes `y += factor · x`.
pub(crate) fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) {
    let factors = f64x2_splat(factor);
    let vector = |y, x, _| add_product(y, factors, x);
    update(y, x, x, vector, |y, x, _| y + factor * x);
}

/// Computes `y += Σ_i factors[i] · rows[i]`.
pub(crate) fn add_four_scaled(y: &mut [f64], [a, b, c, d]: [&[f64]; 4], f: [f64; 4]) {
    let [fa, fb, fc, fd] = splat_each(f);
    let sum = |a, b, c, d| {
        let first = add_product(f64x2_mul(fa, a), fb, b);
        f64x2_add(first, add_product(f64x2_mul(fc, c), fd, d))
    };
    let n = y.len();
    let (y, y_rest) = y.as_chunks_mut::<4>();
    let ((a, a_rest), (b, b_rest)) = (a[..n].as_chunks::<4>(), b[..n].as_chunks::<4>());
    let ((c, c_rest), (d, d_rest)) = (c[..n].as_chunks::<4>(), d[..n].as_chunks::<4>());
    for ((((y, a), b), c), d) in y.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        let [y0, y1]: &mut [[f64; 2]; 2] = must_cast_mut(y);
        let ([a0, a1], [b0, b1]) = (pairs(a), pairs(b));
        let ([c0, c1], [d0, d1]) = (pairs(c), pairs(d));
        let first = sum(load(a0), load(b0), load(c0), load(d0));
        let second = sum(load(a1), load(b1), load(c1), load(d1));
        store(y0, f64x2_add(load(y0), first));
        store(y1, f64x2_add(load(y1), second));
    }
    let ((y, y_last), (a, a_last), (b, b_last)) = (
        y_rest.as_chunks_mut::<2>(),
        a_rest.as_chunks::<2>(),
        b_rest.as_chunks::<2>(),
    );
    let ((c, c_last), (d, d_last)) = (c_rest.as_chunks::<2>(), d_rest.as_chunks::<2>());
    if let ([y], [a], [b], [c], [d]) = (y, a, b, c, d) {
        store(
            y,
            f64x2_add(load(y), sum(load(a), load(b), load(c), load(d))),
        );
    }
    if let ([y], [a], [b], [c], [d]) = (y_last, a_last, b_last, c_last, d_last) {
        *y += (f[0] * a + f[1] * b) + (f[2] * c + f[3] * d);
    }
}

/// Computes `sums += a ∘ b`, entry by entry.
pub(crate) fn add_products(sums: &mut [f64], a: &[f64], b: &[f64]) {
    update(sums, a, b, add_product, |sum, a, b| sum + a * b);
}

/// Computes `y = a + factor · b`.
pub(crate) fn set_scaled_sum(y: &mut [f64], a: &[f64], factor: f64, b: &[f64]) {
    let factors = f64x2_splat(factor);
    let vector = |_, a, b| add_product(a, factors, b);
    update(y, a, b, vector, |_, a, b| a + factor * b);
}

/// Returns `Σ_i factors[i] · rows[i]`, four rows at a time.
pub(crate) fn combine_blocks(rows: &[[f64; LANES]], factors: &[[f64; 4]]) -> [f64; LANES] {
    let mut sum = [f64x2_splat(0.0); 4];
    for ([a, b, c, d], f) in rows.as_chunks().0.iter().zip(factors) {
        let (a, b, c, d) = (load_block(a), load_block(b), load_block(c), load_block(d));
        let [fa, fb, fc, fd] = splat_each(*f);
        let product = |i: usize| {
            let first = add_product(f64x2_mul(fa, a[i]), fb, b[i]);
            let second = add_product(f64x2_mul(fc, c[i]), fd, d[i]);
            f64x2_add(sum[i], f64x2_add(first, second))
        };
        sum = [product(0), product(1), product(2), product(3)];
    }
    let mut block = [0.0; LANES];
    store_block(&mut block, sum);
    block
}

/// Computes `rows[i] += factors[i] · block`.
pub(crate) fn add_outer_block(
    rows: &mut [[f64; LANES]],
    factors: &[[f64; 4]],
    block: [f64; LANES],
) {
    let [a, b, c, d] = load_block(&block);
    for (row, factor) in rows.iter_mut().zip(factors.as_flattened()) {
        let factor = f64x2_splat(*factor);
        let [row_a, row_b, row_c, row_d] = load_block(row);
        let sums = [
            add_product(row_a, factor, a),
            add_product(row_b, factor, b),
            add_product(row_c, factor, c),
            add_product(row_d, factor, d),
        ];
        store_block(row, sums);
    }
}

/// Computes `row = factors · rows`, for `rows` `[_, stride]` and a `row` of `stride` entries, a multiple of eight.
pub(crate) fn multiply_rows(factors: &[f32], rows: &[f32], row: &mut [f32]) {
    let stride = row.len();
    let mut at = 0;
    // As many sums at a time as registers are sure to hold. They are written out: a loop over them, compiled for size,
    // would keep them in memory.
    while at + 16 <= stride {
        let mut sums = [f32x4_splat(0.0); 4];
        for (p, values) in factors.iter().zip(rows.chunks_exact(stride)) {
            if let Some(values) = values[at..].first_chunk::<16>() {
                let [a, b, c, d]: &[[f32; 4]; 4] = must_cast_ref(values);
                let p = f32x4_splat(*p);
                sums = [
                    add_product_single(sums[0], p, load(a)),
                    add_product_single(sums[1], p, load(b)),
                    add_product_single(sums[2], p, load(c)),
                    add_product_single(sums[3], p, load(d)),
                ];
            }
        }
        store_all(&mut row[at..], sums);
        at += 16;
    }
    if at < stride {
        let mut sums = [f32x4_splat(0.0); 2];
        for (p, values) in factors.iter().zip(rows.chunks_exact(stride)) {
            if let Some(values) = values[at..].first_chunk::<8>() {
                let [a, b]: &[[f32; 4]; 2] = must_cast_ref(values);
                let p = f32x4_splat(*p);
                sums = [
                    add_product_single(sums[0], p, load(a)),
                    add_product_single(sums[1], p, load(b)),
                ];
            }
        }
        store_all(&mut row[at..], sums);
    }
}

/// `Σ_k c_k v_k` on one block of slots by channel. Sums run over `k` in order, so that results do not depend on the
/// size of blocks.
pub(crate) fn combine_slots(
    coefficients: &[[f32; 3]],
    kernels: &[[f32; BLOCK_SLOTS]],
) -> [[f32; BLOCK_SLOTS]; 3] {
    let mut sums = [[f32x4_splat(0.0); 3]; 3];
    for (coefficient, kernel) in coefficients.iter().zip(kernels) {
        let [a, b, c]: &[[f32; 4]; 3] = must_cast_ref(kernel);
        let (a, b, c) = (load(a), load(b), load(c));
        let add = |sum: [v128; 3], coefficient: f32| {
            let factor = f32x4_splat(coefficient);
            [
                add_product_single(sum[0], factor, a),
                add_product_single(sum[1], factor, b),
                add_product_single(sum[2], factor, c),
            ]
        };
        let [red, green, blue] = *coefficient;
        sums = [add(sums[0], red), add(sums[1], green), add(sums[2], blue)];
    }
    sums.map(|sum| {
        let mut block = [0.0; BLOCK_SLOTS];
        store_all(&mut block, sum);
        block
    })
}
