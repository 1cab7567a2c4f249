//! Views that bend the correspondence: a lens that distorts, and a camera that looks aslant.

use std::sync::Arc;

use crate::transport::{Correspondence, DisplacementGrid, Extent, GeometryError};

/// Camera pixels between control points.
const SPACING: u32 = DisplacementGrid::MIN_SPACING;
/// Least step of a code, in light elements.
const MIN_STEP: f64 = 1.0 / 512.0;
/// Distance of the camera, in half widths of the object.
const DISTANCE: f64 = 3.0;

/// How the camera sees the light plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraView {
    /// Radial distortion: the corners are seen this share nearer to the centre than its surroundings would let expect.
    pub distortion: f64,
    /// Angle between the camera's axis and the normal of the object, about the vertical, in degrees.
    pub tilt: f64,
}

impl CameraView {
    /// The correspondence of a camera whose picture the light plane fills.
    ///
    /// # Errors
    /// [`GeometryError`] if the picture needs too many control points.
    pub(super) fn correspondence(
        self,
        camera: Extent,
        light: Extent,
    ) -> Result<Correspondence, GeometryError> {
        let [across, down] = [(light.width, camera.width), (light.height, camera.height)]
            .map(|(light, camera)| f64::from(light) / f64::from(camera));
        let mut correspondence =
            Correspondence::from_affine([[across, 0.0, 0.0], [0.0, down, 0.0]]);
        if self == Self::default() {
            return Ok(correspondence);
        }
        let points = DisplacementGrid::points_over(camera, SPACING);
        let displacement = |(i, j): (u32, u32)| {
            let straight = [i, j].map(|i| f64::from(i * SPACING));
            let undistorted = self.undistorted(camera, straight);
            [0, 1].map(|axis| (undistorted[axis] - straight[axis]) * [across, down][axis])
        };
        let displacements: Vec<[f64; 2]> = points.cells().map(displacement).collect();
        let largest = displacements
            .as_flattened()
            .iter()
            .fold(0.0, |max: f64, d| max.max(d.abs()));
        let step = MIN_STEP.max(1.001 * largest / f64::from(i16::MAX)) as f32;
        let code = |d: f64| (d / f64::from(step)).round() as i16;
        let codes = displacements.into_iter().map(|d| d.map(code));
        let grid = DisplacementGrid::new(SPACING, step, points, codes.collect())?;
        correspondence.displacement = Some(Arc::new(grid));
        Ok(correspondence)
    }

    /// The position at which a camera without distortion or tilt would see the point that this camera sees at `at`.
    fn undistorted(self, camera: Extent, at: [f64; 2]) -> [f64; 2] {
        let half = [camera.width, camera.height].map(|side| f64::from(side) / 2.0);
        let diagonal = half[0].hypot(half[1]);
        let [x, y] = [0, 1].map(|axis| at[axis] - half[axis]);
        let radius = x.hypot(y) / diagonal;
        let radial = 1.0 + self.distortion * (radius * radius - 1.0);
        // A plane that is turned about the vertical, scaled to stay within the picture.
        let slope = self.tilt.to_radians().tan() / DISTANCE;
        let perspective = (1.0 - slope.abs()) / (1.0 + slope * radial * x / half[0]);
        let scale = radial * perspective;
        [half[0] + scale * x, half[1] + scale * y]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_keep_their_places_under_distortion_and_the_centre_under_both() {
        let camera = Extent::new(64, 48);
        let near = |a: [f64; 2], b: [f64; 2]| {
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9, "{a:?} {b:?}");
        };
        let view = CameraView {
            distortion: 0.05,
            tilt: 0.0,
        };
        near(view.undistorted(camera, [0.0, 0.0]), [0.0, 0.0]);
        near(view.undistorted(camera, [32.0, 24.0]), [32.0, 24.0]);
        let tilted = CameraView { tilt: 10.0, ..view };
        near(tilted.undistorted(camera, [32.0, 24.0]), [32.0, 24.0]);
        let [left, right] =
            [0.0, 64.0].map(|x| (tilted.undistorted(camera, [x, 24.0])[0] - 32.0).abs());
        assert!(left > right + 2.0, "{left} {right}");
        let straight = CameraView::default()
            .correspondence(camera, camera)
            .unwrap();
        assert_eq!(straight.displacement, None);
    }
}
