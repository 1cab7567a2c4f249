//! How well photographs of Gray code show where camera pixels lie, and how well a correspondence agrees with them.

use serde::Serialize;

use super::graycode::{BitPair, GrayCodePhotos, decode};
use crate::linalg;
use crate::transport::{Correspondence, Extent, LightPosition};

/// What the Gray code says along one axis of the light plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GrayCodeQuality {
    /// Share of the camera pixels, in the rows that were read, that show clear Gray code.
    pub decoded_share: f64,
    /// Median distance of these pixels' correspondence from the range of light elements that they were decoded to, in
    /// elements: 0 if the correspondence agrees with most.
    pub residual: f64,
}

impl GrayCodePhotos {
    /// Compares a correspondence with the Gray code along both axes: columns and rows. `camera` is the size of the camera
    /// grid.
    pub fn quality(&self, camera: Extent, correspondence: &Correspondence) -> [GrayCodeQuality; 2] {
        let coordinates: [fn(LightPosition) -> f64; 2] = [|at| at.u, |at| at.v];
        let axis = |bits: &[BitPair], coordinate: fn(LightPosition) -> f64| {
            let decoded = match bits.is_empty() {
                true => Vec::new(),
                false => decode(bits, &self.rows, camera.width),
            };
            let distances = decoded.iter().map(|decoded| {
                let at = coordinate(correspondence.at(decoded.pixel));
                ((at - decoded.position).abs() - 0.5 * decoded.width).max(0.0)
            });
            let distances: Vec<f64> = distances.collect();
            let pixels = (self.rows.len() * camera.width as usize).max(1);
            GrayCodeQuality {
                decoded_share: distances.len() as f64 / pixels as f64,
                residual: match distances.is_empty() {
                    true => f64::INFINITY,
                    false => linalg::median(&distances),
                },
            }
        };
        [axis(&self.x, coordinates[0]), axis(&self.y, coordinates[1])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::{CHANNELS, CameraPixel};

    /// Ideal photographs of Gray code with one light element behind each camera pixel.
    fn photograph(camera: Extent) -> GrayCodePhotos {
        let bits = |coordinate: fn(CameraPixel) -> u32| {
            let bit = |b: u32| {
                let brightness = |(x, y)| {
                    let m = coordinate(CameraPixel { x, y });
                    [(((m ^ m >> 1) >> b) & 1) as f32; CHANNELS]
                };
                let plain: Vec<_> = camera.cells().map(brightness).collect();
                BitPair {
                    inverted: plain.iter().map(|p| p.map(|v| 1.0 - v)).collect(),
                    plain,
                }
            };
            (0..4).rev().map(bit).collect()
        };
        GrayCodePhotos {
            x: bits(|pixel| pixel.x),
            y: bits(|pixel| pixel.y),
            rows: (0..camera.height).collect(),
        }
    }

    #[test]
    fn a_correspondence_is_measured_by_the_code_that_pixels_show() {
        let camera = Extent::new(16, 16);
        let code = photograph(camera);
        let quality = |affine| code.quality(camera, &Correspondence::from_affine(affine));
        let right = GrayCodeQuality {
            decoded_share: 1.0,
            residual: 0.0,
        };
        assert_eq!(quality([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), [right; 2]);
        let [x, y] = quality([[1.0, 0.0, 3.0], [0.0, 1.0, 0.0]]);
        assert!((x.residual - 2.5).abs() < 1e-9, "{x:?}");
        assert_eq!(y, right);
    }

    #[test]
    fn dark_photographs_show_nothing() {
        let camera = Extent::new(16, 16);
        let mut code = photograph(camera);
        code.x.clear();
        let identity = Correspondence::from_affine([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let [x, _] = code.quality(camera, &identity);
        assert_eq!(x.decoded_share, 0.0);
    }
}
