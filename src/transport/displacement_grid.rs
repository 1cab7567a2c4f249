//! The part of a correspondence that is not affine: a displacement on the light plane at control points, interpolated
//! bilinearly. Lens distortion, perspective, a bowed canvas and objects of several planes bend a correspondence.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::geometry::{Extent, GeometryError};

/// Displacements on the light plane at control points in a regular grid over the picture.
///
/// Control point (i, j) lies at camera position (i · spacing, j · spacing); the last ones lie on the picture's right and
/// bottom borders or beyond. Displacements are codes, so that a file keeps the window origins with which a transport was
/// recovered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "UncheckedGrid")]
pub struct DisplacementGrid {
    /// Camera pixels from one control point to the next.
    spacing: u32,
    /// Light elements of a code of 1.
    step: f32,
    /// Control points.
    points: Extent,
    /// `[row, column]`, along u and v.
    codes: Vec<[i16; 2]>,
}

/// As geometries hold it, which are copied often.
pub type SharedGrid = Arc<DisplacementGrid>;

/// A grid as JSON has it.
#[derive(Deserialize)]
struct UncheckedGrid {
    spacing: u32,
    step: f32,
    points: Extent,
    codes: Vec<[i16; 2]>,
}

impl TryFrom<UncheckedGrid> for DisplacementGrid {
    type Error = GeometryError;

    fn try_from(grid: UncheckedGrid) -> Result<Self, GeometryError> {
        let UncheckedGrid { spacing, step, .. } = grid;
        Self::new(spacing, step, grid.points, grid.codes)
    }
}

impl DisplacementGrid {
    /// Least distance of control points, in camera pixels.
    pub const MIN_SPACING: u32 = 8;
    /// Maximum distance of control points, in camera pixels.
    pub const MAX_SPACING: u32 = 4096;
    /// Maximum number of control points.
    pub const MAX_POINTS: usize = 1 << 20;

    /// Displacements of `step` light elements times `codes`, `[row, column]`.
    ///
    /// # Errors
    /// [`GeometryError::Displacement`] if a value is out of range, or there is not one code for each control point.
    pub fn new(
        spacing: u32,
        step: f32,
        points: Extent,
        codes: Vec<[i16; 2]>,
    ) -> Result<Self, GeometryError> {
        let is_step = step.is_finite() && step > 0.0;
        let is_spacing = (Self::MIN_SPACING..=Self::MAX_SPACING).contains(&spacing);
        let is_grid = points.width >= 2 && points.height >= 2 && Self::is_allowed(points);
        match is_step && is_spacing && is_grid && codes.len() == points.area() {
            true => Ok(Self {
                spacing,
                step,
                points,
                codes,
            }),
            false => Err(GeometryError::Displacement),
        }
    }

    /// Whether there are not too many control points.
    pub fn is_allowed(points: Extent) -> bool {
        !points.is_too_large() && points.area() <= Self::MAX_POINTS
    }

    /// The control points that a camera grid needs.
    pub fn points_over(camera: Extent, spacing: u32) -> Extent {
        let count = |side: u32| side.div_ceil(spacing) + 1;
        Extent::new(count(camera.width), count(camera.height))
    }

    /// Whether the control points are those of this camera grid.
    pub fn fits(&self, camera: Extent) -> bool {
        self.points == Self::points_over(camera, self.spacing)
    }

    /// Camera pixels from one control point to the next.
    pub fn spacing(&self) -> u32 {
        self.spacing
    }

    /// Light elements of a code of 1.
    pub fn step(&self) -> f32 {
        self.step
    }

    /// Number of control points along a row and down a column.
    pub fn points(&self) -> Extent {
        self.points
    }

    /// The codes along u and v, `[row, column]`.
    pub fn codes(&self) -> &[[i16; 2]] {
        &self.codes
    }

    /// Length of the largest displacement at a control point, in light elements.
    pub fn largest(&self) -> f64 {
        let square = |[u, v]: &[i16; 2]| f64::from(*u).powi(2) + f64::from(*v).powi(2);
        let largest = self.codes.iter().map(square).fold(0.0, f64::max);
        largest.sqrt() * f64::from(self.step)
    }

    /// The displacement along u and v at a camera position, in light elements.
    #[inline(never)] // WebAssembly modules would have it many times
    pub fn at(&self, x: f64, y: f64) -> [f64; 2] {
        self.at_from([x, y], [0; 2])
    }

    /// The displacement where the first control point is that with this column and row of a larger grid.
    #[inline(always)]
    pub(super) fn at_from(&self, [x, y]: [f64; 2], first: [u32; 2]) -> [f64; 2] {
        let cell = |at: f64, first: u32, points: u32| {
            let at = at / f64::from(self.spacing) - f64::from(first); // exact, as `first` is smaller
            let at = at.clamp(0.0, f64::from(points - 1));
            let first = (at as u32).min(points - 2);
            (first as usize, at - f64::from(first))
        };
        let (column, right) = cell(x, first[0], self.points.width);
        let (row, down) = cell(y, first[1], self.points.height);
        let first = row * self.points.width as usize + column;
        let second = first + self.points.width as usize;
        std::array::from_fn(|axis| {
            let code = |i: usize| f64::from(self.codes[i][axis]);
            let across = |i: usize| code(i) + (code(i + 1) - code(i)) * right;
            let (above, below) = (across(first), across(second));
            (above + (below - above) * down) * f64::from(self.step)
        })
    }

    /// The displacements after the light plane is turned as by
    /// [`Correspondence::turned`](super::Correspondence::turned).
    pub(super) fn turned(&self, is_transposed: bool, is_reversed: [bool; 2]) -> Self {
        let mut grid = self.clone();
        for code in &mut grid.codes {
            if is_transposed {
                code.swap(0, 1);
            }
            for (code, reversed) in code.iter_mut().zip(is_reversed) {
                if reversed {
                    *code = code.saturating_neg();
                }
            }
        }
        grid
    }

    /// The displacements of a picture that is shifted by camera pixels to the right and down.
    pub(super) fn shifted(&self, [dx, dy]: [i32; 2]) -> Self {
        let code = |(i, j): (u32, u32)| {
            let place = |i: u32, shift: i32| f64::from(i * self.spacing) - f64::from(shift);
            let displacement = self.at(place(i, dx), place(j, dy));
            displacement.map(|d| (d / f64::from(self.step)).round() as i16)
        };
        Self {
            codes: self.points.cells().map(code).collect(),
            ..self.clone()
        }
    }
}
