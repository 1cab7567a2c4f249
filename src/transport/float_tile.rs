//! Tiles as real numbers: `τ_n = Σ_k c_nk v_k + d_n`, coefficients over a basis that all tiles share, and direct
//! functions.

use serde::{Deserialize, Serialize};

use super::geometry::{CHANNELS, Geometry, TileRect};
use crate::linalg::{BLOCK_SLOTS, combine_slots};

/// The basis functions `v_k` of a factored transport, `S` values each.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Basis {
    /// `v_k` as `[component, slot]`, the most important first.
    pub kernels: Vec<Vec<f32>>,
}

impl Basis {
    /// Number of basis functions, `r`.
    pub fn rank(&self) -> usize {
        self.kernels.len()
    }
}

/// The light transport functions of the pixels of a tile, before quantisation.
#[derive(Clone, Debug)]
pub struct TileTransportFunctions {
    /// The pixels of the tile.
    pub rect: TileRect,
    /// τ as `[pixel, slot, channel]`, pixels and slots row by row, in units of the measurement for a light element at
    /// full emission.
    pub tau: Vec<[f32; CHANNELS]>,
}

impl TileTransportFunctions {
    /// Zeros for `rect` and windows of `area` slots.
    pub fn zeros(rect: TileRect, area: usize) -> Self {
        Self {
            rect,
            tau: vec![[0.0; CHANNELS]; rect.extent.area() * area],
        }
    }
}

/// A tile before quantisation, in units of the measurement: `τ_n = Σ_k c_nk v_k + d_n`. Either part may be zero; a
/// recovered tile has one of both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FloatTile {
    /// The pixels of the tile.
    pub rect: TileRect,
    /// `c_nk` as `[pixel, component, channel]`; empty if all are zero.
    pub coefficients: Vec<[f32; CHANNELS]>,
    /// `d_n` as `[pixel, slot, channel]`; empty if all are zero.
    pub functions: Vec<[f32; CHANNELS]>,
}

impl FloatTile {
    /// A tile that is dark under every light.
    pub fn dark(rect: TileRect) -> Self {
        Self {
            rect,
            coefficients: Vec::new(),
            functions: Vec::new(),
        }
    }

    /// Whether both parts are zero.
    pub fn is_dark(&self) -> bool {
        self.coefficients.is_empty() && self.functions.is_empty()
    }

    /// Copies another tile into this tile.
    ///
    /// # Panics
    /// If `part` is not within the tile.
    pub fn insert(&mut self, part: &Self) {
        let (left, top) = (
            (part.rect.x - self.rect.x) as usize,
            (part.rect.y - self.rect.y) as usize,
        );
        for (values, part_values) in [
            (&mut self.coefficients, &part.coefficients),
            (&mut self.functions, &part.functions),
        ] {
            let values_per_pixel = part_values.len() / part.rect.extent.area();
            if values.is_empty() {
                values.resize(self.rect.extent.area() * values_per_pixel, [0.0; CHANNELS]);
            }
            let width = part.rect.extent.width as usize * values_per_pixel;
            for (y, row) in (top..).zip(part_values.chunks_exact(width.max(1))) {
                let at = (y * self.rect.extent.width as usize + left) * values_per_pixel;
                values[at..at + width].copy_from_slice(row);
            }
        }
    }

    /// The part of the tile in `rect`.
    ///
    /// # Panics
    /// If `rect` is not within the tile.
    pub fn crop(&self, rect: TileRect) -> Self {
        let pixels = self.rect.extent.area();
        let (left, top) = ((rect.x - self.rect.x) as usize, rect.y - self.rect.y);
        let (width, tile_width) = (rect.extent.width as usize, self.rect.extent.width as usize);
        let crop = |values: &[[f32; CHANNELS]]| {
            let values_per_pixel = values.len() / pixels;
            let rows = top as usize..(top + rect.extent.height) as usize;
            let rows = rows.flat_map(|y| {
                let at = (y * tile_width + left) * values_per_pixel;
                &values[at..at + width * values_per_pixel]
            });
            rows.copied().collect()
        };
        Self {
            rect,
            coefficients: crop(&self.coefficients),
            functions: crop(&self.functions),
        }
    }

    /// The light transport functions, zero at elements off the light plane. Coefficients need the `basis`. Negative
    /// values of the sum are kept: pictures would be too bright without them.
    pub fn functions(&self, geometry: &Geometry, basis: Option<&Basis>) -> TileTransportFunctions {
        let mut functions = TileTransportFunctions::zeros(self.rect, geometry.window.area());
        if !self.functions.is_empty() {
            functions.tau.copy_from_slice(&self.functions);
        }
        if let Some(basis) = basis.filter(|basis| basis.rank() > 0)
            && !self.coefficients.is_empty()
        {
            let tau = &mut functions.tau;
            add_expansion(tau, &self.coefficients, self.rect, geometry, basis);
        }
        functions
    }
}

impl From<TileTransportFunctions> for FloatTile {
    fn from(TileTransportFunctions { rect, tau }: TileTransportFunctions) -> Self {
        Self {
            functions: tau,
            ..Self::dark(rect)
        }
    }
}

/// Adds `Σ_k c_k v_k` to `tau`, `[pixel, slot]`, and zeroes elements off the light plane.
fn add_expansion(
    tau: &mut [[f32; CHANNELS]],
    coefficients: &[[f32; CHANNELS]],
    rect: TileRect,
    geometry: &Geometry,
    basis: &Basis,
) {
    let (area, rank) = (geometry.window.area(), basis.rank());
    // `[block, component, slot]`, so that the inner loop reads consecutive values.
    let mut kernels = vec![[0.0; BLOCK_SLOTS]; area.div_ceil(BLOCK_SLOTS) * rank];
    for (k, kernel) in basis.kernels.iter().enumerate() {
        for (b, slots) in kernel.chunks(BLOCK_SLOTS).enumerate() {
            kernels[b * rank + k][..slots.len()].copy_from_slice(slots);
        }
    }
    let pixels = rect.pixels().zip(tau.chunks_exact_mut(area));
    for ((pixel, tau), coefficients) in pixels.zip(coefficients.chunks_exact(rank)) {
        for (tau, kernels) in tau.chunks_mut(BLOCK_SLOTS).zip(kernels.chunks_exact(rank)) {
            let sums = combine_slots(coefficients, kernels);
            for (s, tau) in tau.iter_mut().enumerate() {
                (0..CHANNELS).for_each(|c| tau[c] += sums[c][s]);
            }
        }
        geometry.zero_off_light_plane(geometry.window_origin(pixel), tau);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::{Correspondence, Extent, FunctionCodes, Window};

    fn wave(i: usize) -> f32 {
        ((i * 7919 % 1009) as f32 / 504.0 - 1.0) * 0.3
    }

    #[test]
    fn expansion_is_the_sum_over_components() {
        // Windows cross every edge of the light plane; 49 slots are not a multiple of the block size.
        let extent = |width, height| Extent { width, height };
        let geometry = Geometry {
            camera: extent(21, 11),
            light: extent(9, 5),
            window: Window::new(7).unwrap(),
            correspondence: Correspondence::from_affine([[0.5, 0.02, -0.7], [-0.03, 0.5, 0.2]]),
            tile_side: 8,
        };
        let (rank, area) = (5, 49);
        let kernel = |k| (0..area).map(|s| wave(k * area + s)).collect();
        let basis = Basis {
            kernels: (0..rank).map(kernel).collect(),
        };
        for rect in geometry.tiles() {
            let n = rect.extent.area() * rank;
            let coefficient = |i| [0, 1, 2].map(|c| wave(i * 3 + c + rect.x as usize));
            let tile = FloatTile {
                coefficients: (0..n).map(coefficient).collect(),
                ..FloatTile::dark(rect)
            };
            let functions = tile.functions(&geometry, Some(&basis));
            for (p, pixel) in rect.pixels().enumerate() {
                let origin = geometry.window_origin(pixel);
                for s in 0..area {
                    let element = geometry.window.element(origin, s);
                    for c in 0..CHANNELS {
                        let terms = (0..rank).map(|k| {
                            let coefficient = tile.coefficients[p * rank + k][c];
                            f64::from(coefficient) * f64::from(basis.kernels[k][s])
                        });
                        let want = match element.index_in(geometry.light) {
                            Some(_) => terms.sum::<f64>(),
                            None => 0.0,
                        };
                        let got = f64::from(functions.tau[p * area + s][c]);
                        assert!((got - want).abs() < 1e-6, "{pixel:?}, {element:?}, {c}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_tile_is_the_sum_of_its_parts_and_crops_have_its_pixels() {
        let extent = |width, height| Extent { width, height };
        let geometry = Geometry {
            camera: extent(40, 30),
            light: extent(40, 30),
            window: Window::new(3).unwrap(),
            correspondence: Correspondence::from_affine([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
            tile_side: 32,
        };
        let rect = |x, y, width, height| TileRect {
            x,
            y,
            extent: extent(width, height),
        };
        let (rank, area, tile) = (2, 9, rect(5, 7, 20, 13));
        let basis = Basis {
            kernels: (0..rank)
                .map(|k| (0..area).map(|s| wave(k * area + s)).collect())
                .collect(),
        };
        let values = |each: usize, from: usize| -> Vec<_> {
            let count = tile.extent.area() * each;
            (0..count)
                .map(|i| [0, 1, 2].map(|c| wave(from + 3 * i + c)))
                .collect()
        };
        let whole = FloatTile {
            rect: tile,
            coefficients: values(rank, 0),
            functions: values(area, 500),
        };
        let functions = whole.functions(&geometry, Some(&basis));
        for (p, tau) in functions.tau.chunks_exact(area).enumerate() {
            for (s, tau) in tau.iter().enumerate() {
                for c in 0..CHANNELS {
                    let combined: f32 = (0..rank)
                        .map(|k| whole.coefficients[p * rank + k][c] * basis.kernels[k][s])
                        .sum();
                    let want = combined + whole.functions[p * area + s][c];
                    assert!((tau[c] - want).abs() < 1e-6);
                }
            }
        }
        for part in [
            tile,
            rect(5, 7, 3, 2),
            rect(21, 12, 4, 8),
            rect(10, 19, 15, 1),
        ] {
            let cropped = whole.crop(part);
            assert_eq!(cropped.rect, part);
            for (p, pixel) in part.pixels().enumerate() {
                let at = (pixel.y - tile.y) * tile.extent.width + pixel.x - tile.x;
                let of = |values: &[[f32; CHANNELS]], each: usize, p: usize| {
                    values[p * each..(p + 1) * each].to_vec()
                };
                let at = at as usize;
                assert_eq!(
                    of(&cropped.coefficients, rank, p),
                    of(&whole.coefficients, rank, at)
                );
                assert_eq!(
                    of(&cropped.functions, area, p),
                    of(&whole.functions, area, at)
                );
            }
        }
    }

    #[test]
    #[ignore = "a measurement, not a test: cargo test --release -- --ignored --nocapture expand"]
    fn time_to_expand_a_large_picture() {
        let extent = |side| Extent::new(side, side);
        let geometry = Geometry {
            camera: extent(512),
            light: extent(256),
            window: Window::new(15).unwrap(),
            correspondence: Correspondence::from_affine([[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]]),
            tile_side: 32,
        };
        let basis = Basis {
            kernels: (0..48)
                .map(|k| (0..225).map(|s| wave(k * 225 + s)).collect())
                .collect(),
        };
        let (mut expanding, mut quantising) = (0.0, 0.0);
        for rect in geometry.tiles() {
            let tile = FloatTile {
                coefficients: (0..rect.extent.area() * 48).map(|i| [wave(i); 3]).collect(),
                ..FloatTile::dark(rect)
            };
            let start = std::time::Instant::now();
            let functions = tile.functions(&geometry, Some(&basis));
            expanding += start.elapsed().as_secs_f64();
            let start = std::time::Instant::now();
            let codes = FunctionCodes::quantise(rect, &functions.tau, 225);
            std::hint::black_box(codes);
            quantising += start.elapsed().as_secs_f64();
        }
        println!("expand {expanding:.2} s, quantise {quantising:.2} s");
    }
}
