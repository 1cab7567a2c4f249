//! Geometries of the levels of a picture, and of their shards.

use crate::job_executor::Executor;
use crate::transport::{
    CameraPixel, Correspondence, DisplacementGrid, Extent, Geometry, GeometryError, LightElement,
    ShardOrigin, TileRect, Window,
};

/// The geometry of the next level: half the pixels and light elements along each axis, and the smallest window that covers
/// those of the pixels it averages.
///
/// # Errors
/// [`GeometryError::Window`] if no window does.
pub fn halved(geometry: &Geometry, executor: &impl Executor) -> Result<Geometry, GeometryError> {
    let Correspondence {
        affine,
        displacement,
        origin,
    } = &geometry.correspondence;
    let half = |side: u32| side.div_ceil(2);
    let camera = Extent::new(half(geometry.camera.width), half(geometry.camera.height));
    let displacement = displacement.as_ref();
    let displacement = displacement.map(|grid| halved_displacement(grid, camera));
    let point = Geometry {
        camera,
        light: Extent::new(half(geometry.light.width), half(geometry.light.height)),
        window: Window::new(1)?,
        correspondence: Correspondence {
            affine: affine.map(|[x, y, constant]| [x, y, constant / 2.0]),
            displacement: displacement.transpose()?.map(Into::into),
            origin: *origin,
        },
        tile_side: geometry.tile_side,
    };
    let radius = coarse_radius(geometry, &point, executor);
    let window = Window::new(u32::try_from(2 * radius + 1).unwrap_or(u32::MAX))?;
    Ok(Geometry { window, ..point })
}

fn halved_displacement(
    grid: &DisplacementGrid,
    camera: Extent,
) -> Result<DisplacementGrid, GeometryError> {
    let spacing = grid.spacing();
    // As many control points, or every other one.
    let (spacing, stride) =
        match spacing.is_multiple_of(2) && spacing / 2 >= DisplacementGrid::MIN_SPACING {
            true => (spacing / 2, 1),
            false => (spacing, 2),
        };
    let fine = grid.points();
    let code = |(i, j): (u32, u32)| {
        let [i, j] = [(i, fine.width), (j, fine.height)]
            .map(|(at, points)| (at * stride).min(points - 1) as usize);
        grid.codes()[j * fine.width as usize + i]
    };
    let points = DisplacementGrid::points_over(camera, spacing);
    let codes = points.cells().map(code).collect();
    DisplacementGrid::new(spacing, grid.step() / 2.0, points, codes)
}

/// The largest distance along an axis from the coarse element behind a coarse pixel to the windows of its pixels, as far as
/// they see any light.
fn coarse_radius(fine: &Geometry, coarse: &Geometry, executor: &impl Executor) -> i64 {
    let side = i64::from(fine.window.side());
    let distance = |centre: i32, origin: i32| {
        let [first, last] = [i64::from(origin), i64::from(origin) + side - 1];
        let centre = i64::from(centre);
        (centre - first.div_euclid(2)).max(last.div_euclid(2) - centre)
    };
    let largest_of_row = |y: usize| {
        let pixels = (0..fine.camera.width).map(|x| CameraPixel { x, y: y as u32 });
        // Positions far off the light plane saturate.
        let pixels =
            pixels.filter(|pixel| !fine.clip_window(fine.window_origin(*pixel)).is_empty());
        let distances = pixels.map(|pixel| {
            let centre = coarse.window_origin(CameraPixel {
                x: pixel.x / 2,
                y: pixel.y / 2,
            });
            let origin = fine.window_origin(pixel);
            distance(centre.u, origin.u).max(distance(centre.v, origin.v))
        });
        distances.max().unwrap_or(0)
    };
    let rows = executor.map(fine.camera.height as usize, largest_of_row);
    rows.into_iter().max().unwrap_or(0)
}

/// The shard of `geometry` with the pixels `rect`: the light elements that they see, and the correspondence between both.
pub fn shard(geometry: &Geometry, rect: TileRect) -> Geometry {
    let side = i64::from(geometry.window.side());
    let (mut first, mut last) = ([i64::MAX; 2], [i64::MIN; 2]);
    for pixel in rect.pixels() {
        let LightElement { u, v } = geometry.window_origin(pixel);
        for (axis, at) in [u, v].map(i64::from).into_iter().enumerate() {
            first[axis] = first[axis].min(at);
            last[axis] = last[axis].max(at + side);
        }
    }
    let sides = [geometry.light.width, geometry.light.height].map(i64::from);
    // At least one element, also where all windows lie off the light plane.
    let start = [0, 1].map(|axis| first[axis].clamp(0, sides[axis] - 1));
    let end = [0, 1].map(|axis| last[axis].clamp(start[axis] + 1, sides[axis]));
    let Correspondence {
        affine,
        displacement,
        ..
    } = &geometry.correspondence;
    let origin = ShardOrigin {
        camera: [rect.x, rect.y],
        light: start.map(|at| at as u32),
        plane: [geometry.light.width, geometry.light.height],
    };
    let displacement = displacement.as_ref();
    Geometry {
        camera: rect.extent,
        light: Extent::new((end[0] - start[0]) as u32, (end[1] - start[1]) as u32),
        window: geometry.window,
        correspondence: Correspondence {
            affine: *affine,
            displacement: displacement
                .and_then(|grid| shard_displacement(grid, rect.extent, origin))
                .map(Into::into),
            origin,
        },
        tile_side: geometry.tile_side,
    }
}

/// The geometry of a level of `camera` pixels and `light` elements, from those of all its shards, at least one: the inverse of
/// [`shard`].
///
/// # Errors
/// [`GeometryError`] if the control points do not fit together, or the level is too large.
pub fn whole(
    camera: Extent,
    light: Extent,
    shards: &[Geometry],
) -> Result<Geometry, GeometryError> {
    let first = shards.first().ok_or(GeometryError::Displacement)?;
    let grids = shards.iter().filter_map(|shard| {
        let Correspondence {
            displacement,
            origin,
            ..
        } = &shard.correspondence;
        Some((displacement.as_ref()?, origin.camera))
    });
    let mut displacement: Option<(&DisplacementGrid, Extent, Vec<[i16; 2]>)> = None;
    for (grid, [x, y]) in grids {
        let spacing = grid.spacing();
        let points = DisplacementGrid::points_over(camera, spacing);
        if !DisplacementGrid::is_allowed(points) {
            return Err(GeometryError::Displacement);
        }
        let (_, points, codes) =
            displacement.get_or_insert_with(|| (grid, points, vec![[0; 2]; points.area()]));
        let [column, row] = [x, y].map(|first| first / spacing);
        for ((i, j), code) in grid.points().cells().zip(grid.codes()) {
            let (i, j) = (column + i, row + j);
            if i < points.width && j < points.height {
                codes[(j * points.width + i) as usize] = *code;
            }
        }
    }
    let displacement = displacement.map(|(grid, points, codes)| {
        DisplacementGrid::new(grid.spacing(), grid.step(), points, codes)
    });
    let geometry = Geometry {
        camera,
        light,
        window: first.window,
        correspondence: Correspondence {
            affine: first.correspondence.affine,
            displacement: displacement.transpose()?.map(Into::into),
            origin: ShardOrigin::ZERO,
        },
        tile_side: first.tile_side,
    };
    geometry.validate()
}

/// The control points of a shard of `camera` pixels.
fn shard_displacement(
    grid: &DisplacementGrid,
    camera: Extent,
    origin: ShardOrigin,
) -> Option<DisplacementGrid> {
    let (spacing, whole) = (grid.spacing(), grid.points());
    let points = DisplacementGrid::points_over(origin.covered(camera, spacing), spacing);
    let [column, row] = origin.camera.map(|first| first / spacing);
    let code = |(i, j): (u32, u32)| {
        let [i, j] = [(column + i, whole.width), (row + j, whole.height)]
            .map(|(at, points)| at.min(points - 1) as usize);
        grid.codes()[j * whole.width as usize + i]
    };
    let codes = points.cells().map(code).collect();
    DisplacementGrid::new(spacing, grid.step(), points, codes).ok()
}
