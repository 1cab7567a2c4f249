//! Singular values of light transport: how far `T` is from a matrix of low rank.

use super::float_tile::TileTransportFunctions;
use super::geometry::{CHANNELS, ClippedRect, Extent, Geometry, LightElement};
use crate::linalg::{add_scaled, mirror_upper, symmetric_eigenvalues};

/// Side of the largest block of light elements. The time of the eigenvalues grows with the sixth power of the side: those
/// of 32² elements take about two seconds.
const MAX_BLOCK_SIDE: u32 = 32;

/// Sums `TTᵀ` over pixels and channels, for a block of light elements in the middle of the light plane. The square roots of
/// its eigenvalues are the singular values of `T`, `[M, 3N]`, or of its rows for those elements if the light plane is
/// larger than the block.
#[derive(Clone, Debug)]
pub struct SingularValueAnalysis {
    geometry: Geometry,
    /// The block, and its first light element.
    block: Extent,
    first: LightElement,
    /// The upper triangle of `TTᵀ`.
    gram: Vec<f64>,
}

impl SingularValueAnalysis {
    /// An analysis of functions whose windows are those of `geometry`.
    pub fn new(geometry: Geometry) -> Self {
        let Extent { width, height } = geometry.light;
        let block = Extent::new(width.min(MAX_BLOCK_SIDE), height.min(MAX_BLOCK_SIDE));
        let first = LightElement {
            u: ((width - block.width) / 2) as i32,
            v: ((height - block.height) / 2) as i32,
        };
        Self {
            geometry,
            block,
            first,
            gram: vec![0.0; block.area() * block.area()],
        }
    }

    /// The block of light elements.
    pub fn block(&self) -> Extent {
        self.block
    }

    /// Adds the pixels of a tile.
    pub fn add(&mut self, functions: &TileTransportFunctions) {
        let (window, n) = (self.geometry.window, self.block.area());
        let side = window.side();
        let block_width = self.block.width as usize;
        let mut part = Vec::with_capacity(window.area());
        let by_pixel = functions.tau.chunks_exact(window.area());
        for (pixel, tau) in functions.rect.pixels().zip(by_pixel) {
            let LightElement { u, v } = self.geometry.window_origin(pixel);
            // Relative to the block, which stands for the light plane.
            let origin = LightElement {
                u: u.saturating_sub(self.first.u),
                v: v.saturating_sub(self.first.v),
            };
            let clipped = ClippedRect::new(origin, Extent::new(side, side), self.block);
            if clipped.is_empty() {
                continue;
            }
            let [first_u, first_v] = clipped.first();
            let width = clipped.columns.len();
            for c in 0..CHANNELS {
                part.clear();
                for v in clipped.rows.clone() {
                    let row = &tau[v * side as usize..][clipped.columns.clone()];
                    part.extend(row.iter().map(|tau| f64::from(tau[c])));
                }
                for (s, &value) in part.iter().enumerate() {
                    let (u, v) = (first_u + s % width, first_v + s / width);
                    let row = &mut self.gram[(v * block_width + u) * n..][..n];
                    let rows = part.chunks_exact(width).enumerate().skip(s / width);
                    for (dv, values) in rows {
                        let target = (first_v + dv) * block_width + first_u;
                        add_scaled(&mut row[target..target + width], value, values);
                    }
                }
            }
        }
    }

    /// The singular values, largest first.
    pub fn singular_values(mut self) -> Vec<f64> {
        let n = self.block.area();
        mirror_upper(&mut self.gram, n);
        let eigenvalues = symmetric_eigenvalues(self.gram, n).into_iter();
        eigenvalues.map(|value| value.max(0.0).sqrt()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::symmetric_eigen;
    use crate::transport::{Correspondence, Window};

    /// Functions whose windows hang over the edges, on light planes smaller and larger than the block.
    #[test]
    fn they_are_those_of_the_dense_matrix() {
        for light in [Extent::new(7, 5), Extent::new(36, 4)] {
            let geometry = Geometry {
                camera: Extent::new(9, 8),
                light,
                window: Window::new(3).unwrap(),
                correspondence: Correspondence::from_affine([
                    [f64::from(light.width) / 9.0, 0.0, -0.3],
                    [0.1, f64::from(light.height) / 8.0, 0.0],
                ]),
                tile_side: 8,
            };
            let mut analysis = SingularValueAnalysis::new(geometry.clone());
            let block = analysis.block();
            let left = (light.width as usize - block.width as usize) / 2;
            // `[m, 3N]`
            let columns = CHANNELS * geometry.camera.area();
            let mut dense = vec![0.0; block.area() * columns];
            for rect in geometry.tiles() {
                let mut functions = TileTransportFunctions::zeros(rect, 9);
                for (p, pixel) in rect.pixels().enumerate() {
                    let origin = geometry.window_origin(pixel);
                    for (s, m) in geometry.elements_of_window(origin) {
                        let value = |c: usize| ((p * 31 + s * 7 + c * 3) % 17) as f32 - 6.0;
                        let tau = [value(0), value(1), value(2)];
                        functions.tau[9 * p + s] = tau;
                        let (u, v) = (m % light.width as usize, m / light.width as usize);
                        if (left..left + block.width as usize).contains(&u) {
                            let row = v * block.width as usize + u - left;
                            for c in 0..CHANNELS {
                                let column = CHANNELS * geometry.camera.index(pixel) + c;
                                dense[row * columns + column] = f64::from(tau[c]);
                            }
                        }
                    }
                }
                analysis.add(&functions);
            }
            let n = block.area();
            let row = |i: usize| &dense[i * columns..(i + 1) * columns];
            let product =
                |i: usize, j: usize| -> f64 { row(i).iter().zip(row(j)).map(|(a, b)| a * b).sum() };
            let gram = (0..n * n).map(|i| product(i / n, i % n)).collect();
            let (eigenvalues, _) = symmetric_eigen(gram, n);
            let got = analysis.singular_values();
            assert_eq!(got.len(), n);
            for (got, want) in got.iter().zip(&eigenvalues) {
                assert!((got * got - want).abs() < 1e-10 * eigenvalues[0]);
            }
        }
    }
}
