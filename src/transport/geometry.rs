//! Grids and maps between them: camera pixels, light elements, windows, tiles.
//!
//! Coordinates are continuous with cell `i` covering `[i, i + 1)`: the centre of camera pixel `(x, y)` is `(x + ½, y +
//! ½)`, and the correspondence maps it to `(u, v)` on the light plane, in light elements.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::correspondence::Correspondence;
use super::light_region::LightRegion;

/// Camera channels: red, green, blue.
pub const CHANNELS: usize = 3;
/// Maximum side of the camera grid and the light plane.
pub const MAX_SIDE: u32 = 1 << 20;
/// Maximum number of cells of either. The number of tiles fits in `u32`, and that of cells in `usize`, which has 32 bits in
/// WebAssembly.
pub const MAX_AREA: u64 = if usize::BITS > 32 { 1 << 36 } else { 1 << 30 };
/// Maximum side of a window: an object that needs more is not nearly planar.
pub const MAX_WINDOW: u32 = 63;

/// Width and height of a grid, in its cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Extent {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Extent {
    /// The extent of a grid with `width` columns and `height` rows.
    pub const fn new(width: u32, height: u32) -> Self {
        Self { width, height }
    }

    /// Row-major index of a pixel of this grid.
    pub fn index(self, pixel: CameraPixel) -> usize {
        pixel.y as usize * self.width as usize + pixel.x as usize
    }

    /// Column and row of each cell, row by row.
    pub fn cells(self) -> impl Iterator<Item = (u32, u32)> {
        (0..self.height).flat_map(move |y| (0..self.width).map(move |x| (x, y)))
    }

    /// Number of cells.
    pub fn area(self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Whether there are more than [`MAX_AREA`] cells; [`area`](Self::area) may overflow then.
    pub fn is_too_large(self) -> bool {
        self.area_u64() > MAX_AREA
    }

    /// Number of cells, whatever the sides are.
    pub fn area_u64(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

impl std::fmt::Display for Extent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// A camera pixel; its centre lies at `(x + ½, y + ½)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraPixel {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
}

/// A continuous position on the light plane, in light elements: element `m` covers `[m, m + 1)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightPosition {
    /// Along columns.
    pub u: f64,
    /// Along rows.
    pub v: f64,
}

/// A light element by column and row. It may lie off the light plane, where there is no emission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LightElement {
    /// Row; the first field, so that elements sort row by row.
    pub v: i32,
    /// Column.
    pub u: i32,
}

impl LightElement {
    /// Row-major index on a light plane of this extent, or `None` off it.
    pub fn index_in(self, light: Extent) -> Option<usize> {
        let (u, v) = (u32::try_from(self.u).ok()?, u32::try_from(self.v).ok()?);
        (u < light.width && v < light.height)
            .then(|| v as usize * light.width as usize + u as usize)
    }
}

/// A square window of `side x side` light elements, side odd.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Window {
    side: u32,
}

impl Window {
    /// A window of odd side 1 to [`MAX_WINDOW`].
    ///
    /// # Errors
    /// If the side is even or too large.
    pub const fn new(side: u32) -> Result<Self, GeometryError> {
        if side % 2 == 1 && side <= MAX_WINDOW {
            Ok(Self { side })
        } else {
            Err(GeometryError::Window(side))
        }
    }

    /// Elements along one side, `w`.
    pub fn side(self) -> u32 {
        self.side
    }

    /// Elements in the window, `S = w²`.
    pub fn area(self) -> usize {
        (self.side * self.side) as usize
    }

    /// Window origin: the top left element of the window around `floor(centre)`.
    pub fn origin(self, centre: LightPosition) -> LightElement {
        let half = (self.side / 2) as i32;
        // Positions far off the light plane saturate; their windows are off it as well.
        LightElement {
            u: (centre.u.floor() as i32).saturating_sub(half),
            v: (centre.v.floor() as i32).saturating_sub(half),
        }
    }

    /// Element of slot `slot`, 0 to S - 1, in the window with this origin.
    pub fn element(self, origin: LightElement, slot: usize) -> LightElement {
        let side = self.side as usize;
        LightElement {
            u: origin.u.saturating_add((slot % side) as i32),
            v: origin.v.saturating_add((slot / side) as i32),
        }
    }

    /// Slot of an element in the window with this origin, or `None` outside it.
    pub fn slot(self, origin: LightElement, element: LightElement) -> Option<usize> {
        let side = i64::from(self.side);
        let u = i64::from(element.u) - i64::from(origin.u);
        let v = i64::from(element.v) - i64::from(origin.v);
        ((0..side).contains(&u) && (0..side).contains(&v)).then(|| (v * side + u) as usize)
    }
}

/// The camera pixels of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TileRect {
    /// Column of the first pixel.
    pub x: u32,
    /// Row of the first pixel.
    pub y: u32,
    /// Size; smaller than other tiles at the right and bottom borders.
    pub extent: Extent,
}

impl TileRect {
    /// Tile number `index`, in row-major order, of `grid` tiles of side `side` over the camera grid.
    fn new(index: usize, grid: Extent, camera: Extent, side: u32) -> Self {
        let [x, y] = [index as u32 % grid.width, index as u32 / grid.width].map(|at| at * side);
        Self {
            x,
            y,
            extent: Extent::new(side.min(camera.width - x), side.min(camera.height - y)),
        }
    }

    /// Whether all pixels lie on a grid of this extent.
    pub fn is_within(self, grid: Extent) -> bool {
        let is_in = |first: u32, count: u32, side: u32| {
            first.checked_add(count).is_some_and(|end| end <= side)
        };
        let Self { x, y, extent } = self;
        is_in(x, extent.width, grid.width) && is_in(y, extent.height, grid.height)
    }

    /// The pixels, row by row.
    pub fn pixels(self) -> impl Iterator<Item = CameraPixel> {
        let TileRect { x, y, extent } = self;
        (y..y + extent.height)
            .flat_map(move |y| (x..x + extent.width).map(move |x| CameraPixel { x, y }))
    }
}

/// The grids, windows and tiles of a transport; everything except its values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// The camera grid, `N` pixels.
    pub camera: Extent,
    /// The light plane, `M` elements.
    pub light: Extent,
    /// The window around the correspondence of each pixel.
    pub window: Window,
    /// Maps camera pixels to light elements.
    pub correspondence: Correspondence,
    /// Camera pixels along a side of a tile.
    pub tile_side: u32,
}

impl Geometry {
    /// Default side of a tile. At two camera pixels a light element the windows of such a tile overlap by half, and a
    /// direct tile fits in a CPU cache.
    pub const DEFAULT_TILE_SIDE: u32 = 32;

    /// Checks the range of every field, on which all other code relies.
    ///
    /// # Errors
    /// If a field is out of range; the error names it.
    pub fn check(&self) -> Result<(), GeometryError> {
        self.check_area()?;
        self.check_fields()
    }

    /// Checks the numbers of camera pixels and light elements.
    ///
    /// # Errors
    /// [`GeometryError::Area`] if there are too many.
    pub fn check_area(&self) -> Result<(), GeometryError> {
        let cells = self.camera.area_u64().max(self.light.area_u64());
        match cells > MAX_AREA {
            true => Err(GeometryError::Area(cells)),
            false => Ok(()),
        }
    }

    fn check_fields(&self) -> Result<(), GeometryError> {
        let names = [
            "camera width",
            "camera height",
            "light width",
            "light height",
        ];
        for (name, &value) in names.into_iter().zip(self.sides().as_flattened()) {
            if !(1..=MAX_SIDE).contains(&value) {
                return Err(GeometryError::Side { name, value });
            }
        }
        if !(8..=256).contains(&self.tile_side) {
            return Err(GeometryError::TileSide(self.tile_side));
        }
        let Correspondence {
            affine,
            displacement,
            origin,
        } = &self.correspondence;
        if !affine.as_flattened().iter().all(|a| a.is_finite()) {
            return Err(GeometryError::Correspondence);
        }
        match displacement
            .as_ref()
            .is_none_or(|grid| grid.fits(origin.covered(self.camera, grid.spacing())))
        {
            true => Ok(()),
            false => Err(GeometryError::Displacement),
        }
    }

    /// This geometry, [checked](Self::check).
    ///
    /// # Errors
    /// If a field is out of range; the error names it.
    pub fn validate(self) -> Result<Self, GeometryError> {
        self.check().map(|()| self)
    }

    /// Width and height of the camera grid and of the light plane, and the sides of a window and of a tile.
    pub fn sides(&self) -> [[u32; 2]; 3] {
        let [camera, light] = [self.camera, self.light].map(|grid| [grid.width, grid.height]);
        [camera, light, [self.window.side, self.tile_side]]
    }

    /// The geometry with these [`sides`](Self::sides), checked but for its [area](Self::check_area).
    ///
    /// # Errors
    /// If a field is out of range; the error names it.
    pub fn from_sides(
        [camera, light, [window, tile_side]]: [[u32; 2]; 3],
        correspondence: Correspondence,
    ) -> Result<Self, GeometryError> {
        let [camera, light] = [camera, light].map(|[width, height]| Extent { width, height });
        let geometry = Self {
            camera,
            light,
            window: Window::new(window)?,
            correspondence,
            tile_side,
        };
        geometry.check_fields().map(|()| geometry)
    }

    /// The light plane, or the part of its level's that a shard sees.
    pub fn light_region(&self) -> LightRegion {
        self.correspondence.origin.light_region(self.light)
    }

    /// Tiles along a row and down a column.
    pub fn tile_grid(&self) -> Extent {
        Extent::new(
            self.camera.width.div_ceil(self.tile_side),
            self.camera.height.div_ceil(self.tile_side),
        )
    }

    /// The tiles, row by row.
    pub fn tiles(&self) -> impl ExactSizeIterator<Item = TileRect> + use<> {
        let (camera, tile_side) = (self.camera, self.tile_side);
        let grid = self.tile_grid();
        (0..grid.area()).map(move |i| TileRect::new(i, grid, camera, tile_side))
    }

    /// Tile number `index` in row-major order.
    pub fn tile(&self, index: usize) -> TileRect {
        TileRect::new(index, self.tile_grid(), self.camera, self.tile_side)
    }

    /// Window origin of a pixel.
    pub fn window_origin(&self, pixel: CameraPixel) -> LightElement {
        self.window.origin(self.correspondence.at(pixel))
    }

    /// The slots on the light plane of the window that starts at `origin`, each with its light element's index.
    pub(crate) fn elements_of_window(
        &self,
        origin: LightElement,
    ) -> impl Iterator<Item = (usize, usize)> {
        (0..self.window.area()).filter_map(move |slot| {
            let element = self.window.element(origin, slot);
            Some((slot, element.index_in(self.light)?))
        })
    }

    /// The part of the window that starts at `origin` which lies on the light plane.
    pub(crate) fn clip_window(&self, origin: LightElement) -> ClippedRect {
        let side = self.window.side();
        let size = Extent::new(side, side);
        ClippedRect::new(origin, size, self.light)
    }

    /// Zeroes the slots off the light plane, for the window that starts at `origin`.
    pub(crate) fn zero_off_light_plane<T: Copy + Default>(
        &self,
        origin: LightElement,
        slots: &mut [T],
    ) {
        let ClippedRect { columns, rows, .. } = self.clip_window(origin);
        let side = self.window.side() as usize;
        for (v, row) in slots.chunks_exact_mut(side).enumerate() {
            let (before, after) = match rows.contains(&v) {
                true => (columns.start, columns.end),
                false => (side, side),
            };
            row[..before].fill(T::default());
            row[after..].fill(T::default());
        }
    }
}

/// The part of a rectangle of light elements that lies on the light plane.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ClippedRect {
    /// The rectangle's first element, which may lie off the light plane.
    origin: LightElement,
    /// Columns on the light plane, counted from the rectangle's first.
    pub columns: Range<usize>,
    /// Rows on the light plane, counted from the rectangle's first.
    pub rows: Range<usize>,
}

impl ClippedRect {
    /// Clips the rectangle of this size that starts at `origin`.
    pub fn new(origin: LightElement, size: Extent, light: Extent) -> Self {
        let clip = |origin: i32, size: u32, light: u32| {
            let clamp = |at: i64| at.clamp(0, i64::from(size)) as usize;
            let start = clamp(-i64::from(origin));
            start..clamp(i64::from(light) - i64::from(origin)).max(start)
        };
        Self {
            origin,
            columns: clip(origin.u, size.width, light.width),
            rows: clip(origin.v, size.height, light.height),
        }
    }

    /// Whether nothing of the rectangle lies on the light plane.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty() || self.rows.is_empty()
    }

    /// Number of elements on the light plane.
    pub fn area(&self) -> usize {
        self.columns.len() * self.rows.len()
    }

    /// Column and row, on the light plane, of the first element on it.
    pub fn first(&self) -> [usize; 2] {
        let first = |origin: i32, range: &Range<usize>| {
            (i64::from(origin) + range.start as i64).max(0) as usize
        };
        [
            first(self.origin.u, &self.columns),
            first(self.origin.v, &self.rows),
        ]
    }
}

/// A field of a [`Geometry`] that is out of range.
#[derive(Debug, Error, PartialEq)]
pub enum GeometryError {
    /// A side of a grid is zero or too large.
    #[error("{name} is {value}; it must be between 1 and {MAX_SIDE}")]
    Side {
        /// The grid and its side.
        name: &'static str,
        /// The value given.
        value: u32,
    },
    /// A grid has so many cells, more than [`MAX_AREA`].
    #[error("too many pixels or light elements")]
    Area(u64),
    /// The side of the window is even or too large.
    #[error("window side is {0}; it must be odd and at most {MAX_WINDOW}")]
    Window(u32),
    /// The side of a tile is out of range.
    #[error("tile side is {0}; it must be between 8 and 256")]
    TileSide(u32),
    /// A coefficient is infinite or NaN.
    #[error("the correspondence has a coefficient that is not a finite number")]
    Correspondence,
    /// The displacements are not those of a regular grid over the camera's pixels.
    #[error(
        "the displacement of the correspondence is not a grid of control points over the picture"
    )]
    Displacement,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_are_bounded_by_side_and_area() {
        let of = |camera: [u32; 2], light: [u32; 2]| {
            let correspondence = Correspondence::from_affine([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
            Geometry::from_sides([camera, light, [9, 8]], correspondence)?.validate()
        };
        let side = |name, value| GeometryError::Side { name, value };
        let long = of([MAX_SIDE, 1 << 16], [1 << 16, MAX_SIDE]).unwrap();
        let last = long.tile(long.tile_grid().area() - 1);
        let end = [last.x + last.extent.width, last.y + last.extent.height];
        assert_eq!(end, [MAX_SIDE, 1 << 16]);
        let corner = LightElement {
            u: (1 << 16) - 1,
            v: MAX_SIDE as i32 - 1,
        };
        assert_eq!(corner.index_in(long.light), Some(long.light.area() - 1));
        assert_eq!(
            of([MAX_SIDE + 1, 1], [9, 9]),
            Err(side("camera width", MAX_SIDE + 1))
        );
        let wide = [(1 << 16) + 1, MAX_SIDE];
        let area = GeometryError::Area((1 << 36) + (1 << 20));
        assert_eq!(of(wide, [9, 9]), Err(area));
        assert_eq!(of([9, 9], wide), of(wide, [9, 9]));
    }

    #[test]
    fn windows_are_clipped_to_the_light_plane() {
        let light = Extent::new(6, 4);
        let size = Extent::new(5, 5);
        let clip = |u, v| ClippedRect::new(LightElement { v, u }, size, light);
        let corner = clip(-2, -1);
        assert_eq!((corner.columns.clone(), corner.rows.clone()), (2..5, 1..5));
        assert_eq!((corner.first(), corner.area()), ([0, 0], 12));
        let edge = clip(3, 1);
        assert_eq!((edge.columns.clone(), edge.rows.clone()), (0..3, 0..3));
        assert_eq!(edge.first(), [3, 1]);
        for (u, v) in [
            (-5, 0),
            (6, 0),
            (0, -5),
            (0, 4),
            (i32::MIN, 0),
            (0, i32::MAX),
        ] {
            assert!(clip(u, v).is_empty(), "{u} {v}");
        }
    }
}
