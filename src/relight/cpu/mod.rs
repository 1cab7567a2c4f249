//! Relighting on the CPU, tile by tile.
//!
//! The inner loop is one kernel with a scalar twin and a `simd128` one. Both do the same operations
//! in the same order in each lane, so their results are equal to the bit.

#[cfg_attr(
    all(target_arch = "wasm32", target_feature = "simd128"),
    allow(dead_code) // the twin, then used by the equality test alone
)]
mod scalar;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128;

use super::{Light, LinearPicture};
use crate::transport::{DirectTile, Element, Geometry, Transport};

/// The kernel this build uses.
pub const KERNEL: &str = if cfg!(all(target_arch = "wasm32", target_feature = "simd128")) {
    "simd128"
} else {
    "scalar"
};

#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
use simd128::accumulate;

#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
use scalar::accumulate;

/// A light with a dark border, so that windows reaching over the display's edge need no tests.
#[derive(Clone, Debug)]
pub struct PaddedLight {
    elements: Vec<[f32; 4]>,
    stride: usize,
    rows: usize,
    border: i32,
}

impl PaddedLight {
    /// Pads a light for windows of the given geometry.
    ///
    /// # Panics
    /// If the light's extent is not the geometry's.
    pub fn new(geometry: &Geometry, light: &Light) -> Self {
        let extent = geometry.light;
        assert_eq!(light.extent(), extent, "a light of another extent");
        let border = geometry.window.side() as usize - 1;
        let stride = extent.width as usize + 2 * border;
        let rows = extent.height as usize + 2 * border;
        let mut elements = vec![[0.0; 4]; stride * rows];
        for (v, row) in light
            .elements()
            .chunks_exact(extent.width as usize)
            .enumerate()
        {
            let at = (v + border) * stride + border;
            elements[at..at + row.len()].copy_from_slice(row);
        }
        Self {
            elements,
            stride,
            rows,
            border: border as i32,
        }
    }

    /// The part of the light a window of `side` elements sees, or `None` where all of it is dark.
    fn window(&self, origin: Element, side: usize) -> Option<&[[f32; 4]]> {
        let u = usize::try_from(origin.u.checked_add(self.border)?).ok()?;
        let v = usize::try_from(origin.v.checked_add(self.border)?).ok()?;
        (u + side <= self.stride && v + side <= self.rows)
            .then(|| &self.elements[v * self.stride + u..])
    }
}

/// Relights one tile: its pixels' linear RGB, row by row, into `out`.
///
/// # Panics
/// If `out` or the tile's codes do not have the length the geometry gives them.
pub fn relight_tile(
    geometry: &Geometry,
    tile: &DirectTile,
    light: &PaddedLight,
    out: &mut [[f32; 4]],
) {
    let (side, area) = (geometry.window.side() as usize, geometry.window.area());
    assert_eq!(out.len(), tile.rect.extent.area(), "one output a pixel");
    if tile.is_dark() {
        out.fill([0.0; 4]);
        return;
    }
    assert_eq!(tile.codes.len(), out.len() * area, "one code an element");
    let functions = tile.codes.chunks_exact(area);
    for ((pixel, codes), y) in tile.rect.pixels().zip(functions).zip(out) {
        let sum = light
            .window(geometry.window_origin(pixel), side)
            .map_or([0.0; 4], |seen| accumulate(codes, seen, side, light.stride));
        *y = [
            sum[0] * tile.step[0],
            sum[1] * tile.step[1],
            sum[2] * tile.step[2],
            0.0,
        ];
    }
}

/// Relights the whole picture on the calling thread.
pub fn relight(transport: &Transport, light: &Light) -> LinearPicture {
    let geometry = &transport.geometry;
    let padded = PaddedLight::new(geometry, light);
    let mut picture = LinearPicture::black(geometry.camera);
    let mut scratch = Vec::new();
    for tile in &transport.tiles {
        scratch.clear();
        scratch.resize(tile.rect.extent.area(), [0.0; 4]);
        relight_tile(geometry, tile, &padded, &mut scratch);
        picture.put(tile.rect, &scratch);
    }
    picture
}

#[cfg(all(test, target_arch = "wasm32", target_feature = "simd128"))]
mod twins {
    use super::{scalar, simd128};
    use wasm_bindgen_test::wasm_bindgen_test;

    #[wasm_bindgen_test]
    fn simd128_equals_scalar_to_the_bit() {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state >> 8
        };
        for side in [1, 3, 15, 17] {
            let stride = side + 5;
            let codes: Vec<_> = (0..side * side)
                .map(|_| std::array::from_fn(|_| next() as i16))
                .collect();
            let seen: Vec<_> = (0..stride * side)
                .map(|_| std::array::from_fn(|_| next() as f32 / 16_777_216.0))
                .collect();
            let fast = simd128::accumulate(&codes, &seen, side, stride);
            let plain = scalar::accumulate(&codes, &seen, side, stride);
            assert_eq!(fast.map(f32::to_bits), plain.map(f32::to_bits));
        }
    }
}
