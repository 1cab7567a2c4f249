//! Photographs with pseudo-random coefficients: the time of relighting does not depend on their values.

use rayon::prelude::*;
use relightable_photo::job_executor::Executor;
use relightable_photo::transport::{
    Basis, CHANNELS, Correspondence, Extent, FloatTile, Geometry, TEXEL_COMPONENTS, TexelCodes,
    Window,
};

const WINDOW: u32 = 15;

/// Sides of the pictures, in camera pixels, and numbers of components.
pub const SIDES: [u32; 3] = [128, 512, 2048];
pub const RANKS: [usize; 3] = [8, 16, 32];

/// Runs jobs on all cores.
pub struct RayonExecutor;

impl Executor for RayonExecutor {
    fn map<T: Send>(&self, count: usize, job: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..count).into_par_iter().map(job).collect()
    }
}

/// A square picture with two camera pixels for each light element.
pub fn geometry(side: u32) -> Geometry {
    Geometry {
        camera: square(side),
        light: square(side / 2),
        window: Window::new(WINDOW).unwrap(),
        correspondence: Correspondence::from_affine([[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]]),
        tile_side: 128,
    }
}

pub fn square(side: u32) -> Extent {
    Extent {
        width: side,
        height: side,
    }
}

pub fn basis(geometry: &Geometry, rank: usize) -> Basis {
    let area = geometry.window.area();
    let kernel = |k: usize| {
        (0..area)
            .map(|s| noise(k * area + s) / WINDOW as f32)
            .collect()
    };
    Basis {
        kernels: (0..rank).map(kernel).collect(),
    }
}

/// The tile of this index.
pub fn tile(geometry: &Geometry, rank: usize, index: usize) -> FloatTile {
    let mut tile = FloatTile::dark(geometry.tile(index));
    let values = tile.rect.extent.area() * rank;
    let coefficient = |i| [0, 1, 2].map(|c| (noise(3 * (i + index * values) + c) - 0.3) * 0.02);
    tile.coefficients = (0..values).map(coefficient).collect();
    tile
}

/// Bytes of a frame: the codes that it reads, and the picture that it writes.
pub fn bytes(side: u32, rank: usize) -> usize {
    let codes = CHANNELS * rank.div_ceil(TEXEL_COMPONENTS) * size_of::<TexelCodes>();
    square(side).area() * (codes + size_of::<[u8; 4]>())
}

/// A pseudo-random number from 0 to 1 for each index.
pub fn noise(i: usize) -> f32 {
    let mut h = (i as u32).wrapping_mul(0x9e37_79b9);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    (h ^ (h >> 16)) as f32 / u32::MAX as f32
}
