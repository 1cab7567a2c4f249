//! Random samples of camera pixels, for methods that take too long on all of them.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardUniform};

use crate::transport::{Extent, Geometry, TileRect};

/// Side of a block. With two camera pixels for each light element, the pixels of a block share a window, so
/// that smaller blocks would take longer for each pixel. The errors of neighbours are correlated, so that
/// larger blocks would be less informative.
const BLOCK_SIDE_PX: u32 = 2;
/// Seed of the sample, which is the same in every run.
const SEED: u64 = 8;

/// Random blocks of about `pixels` pixels together, without replacement; all blocks if these are fewer.
pub(super) fn random_blocks(camera: Extent, pixels: usize) -> Vec<TileRect> {
    let mut blocks = all_blocks(camera);
    let count = pixels
        .div_ceil((BLOCK_SIDE_PX * BLOCK_SIDE_PX) as usize)
        .max(1);
    if blocks.len() > count {
        let indices = random_indices(blocks.len(), count);
        blocks = indices.into_iter().map(|i| blocks[i]).collect();
    }
    blocks
}

/// Fewer tiles would give no usable standard error.
const MIN_TILES: usize = 8;

/// Random tiles of about `pixels` pixels together, but at least [`MIN_TILES`].
pub(super) fn random_tiles(geometry: &Geometry, pixels: usize) -> Vec<TileRect> {
    let count = pixels.div_ceil((geometry.tile_side * geometry.tile_side) as usize);
    let indices = random_indices(geometry.tile_grid().area(), count.max(MIN_TILES));
    indices.into_iter().map(|i| geometry.tile(i)).collect()
}

/// `count` different indices below `len`, ascending: the start of a Fisher–Yates shuffle.
pub(super) fn random_indices(len: usize, count: usize) -> Vec<usize> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut indices: Vec<usize> = (0..len).collect();
    let count = count.min(len);
    for i in 0..count {
        let random: u64 = StandardUniform.sample(&mut rng);
        indices.swap(i, i + (random % (len - i) as u64) as usize);
    }
    indices.truncate(count);
    indices.sort_unstable();
    indices
}

fn all_blocks(camera: Extent) -> Vec<TileRect> {
    let steps = |side: u32| (0..side).step_by(BLOCK_SIDE_PX as usize);
    let block = |x, y| TileRect {
        x,
        y,
        extent: Extent {
            width: BLOCK_SIDE_PX.min(camera.width - x),
            height: BLOCK_SIDE_PX.min(camera.height - y),
        },
    };
    steps(camera.height)
        .flat_map(|y| steps(camera.width).map(move |x| block(x, y)))
        .collect()
}

/// Number of pixels in `blocks`.
pub(super) fn count_pixels(blocks: &[TileRect]) -> usize {
    blocks.iter().map(|b| b.extent.area()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_blocks_are_different_and_cover_the_requested_pixels() {
        let camera = Extent {
            width: 100,
            height: 60,
        };
        assert_eq!(
            count_pixels(&random_blocks(camera, usize::MAX)),
            camera.area()
        );
        let some = random_blocks(camera, 640);
        assert_eq!(some.len(), 160);
        assert!(some.windows(2).all(|b| (b[0].y, b[0].x) < (b[1].y, b[1].x)));
        assert_eq!(some, random_blocks(camera, 640));
    }
}
