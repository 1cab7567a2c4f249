//! Which camera pixels a slow method is judged on.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardUniform};

use crate::transport::{Extent, Geometry, TileRect};

/// Camera pixels along a block's side. At two pixels a light element a block is one window's, so that
/// smaller ones would cost more; larger ones would tell less, as neighbours are alike.
pub(super) const SIDE: u32 = 2;
/// The sample is random, but always the same.
const SEED: u64 = 8;

/// Blocks that together cover about `pixels` pixels of `camera`, drawn at random without
/// replacement; all of them where that is enough.
pub(super) fn sample(camera: Extent, pixels: usize) -> Vec<TileRect> {
    let mut blocks = all(camera);
    let wanted = pixels.div_ceil((SIDE * SIDE) as usize).max(1);
    if blocks.len() > wanted {
        let drawn = draw(blocks.len(), wanted);
        blocks = drawn.into_iter().map(|i| blocks[i]).collect();
    }
    blocks
}

/// Fewest tiles of a sample: of fewer there is no telling how far they are from all.
const FEWEST_TILES: usize = 8;

/// Whole tiles that together cover about `pixels` pixels, drawn likewise, but at least
/// [`FEWEST_TILES`].
pub(super) fn tiles(geometry: &Geometry, pixels: usize) -> Vec<TileRect> {
    let count = geometry.tile_grid().area();
    let wanted = pixels.div_ceil((geometry.tile_side * geometry.tile_side) as usize);
    let drawn = draw(count, wanted.max(FEWEST_TILES));
    drawn.into_iter().map(|i| geometry.tile(i)).collect()
}

/// `wanted` different numbers below `count`, rising: the start of a shuffle by Fisher and Yates.
pub(super) fn draw(count: usize, wanted: usize) -> Vec<usize> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut numbers: Vec<usize> = (0..count).collect();
    let wanted = wanted.min(count);
    for i in 0..wanted {
        let random: u64 = StandardUniform.sample(&mut rng);
        numbers.swap(i, i + (random % (count - i) as u64) as usize);
    }
    numbers.truncate(wanted);
    numbers.sort_unstable();
    numbers
}

fn all(camera: Extent) -> Vec<TileRect> {
    let steps = |side: u32| (0..side).step_by(SIDE as usize);
    let block = |x, y| TileRect {
        x,
        y,
        extent: Extent {
            width: SIDE.min(camera.width - x),
            height: SIDE.min(camera.height - y),
        },
    };
    steps(camera.height)
        .flat_map(|y| steps(camera.width).map(move |x| block(x, y)))
        .collect()
}

/// Pixels in `blocks`.
pub(super) fn pixels(blocks: &[TileRect]) -> usize {
    blocks.iter().map(|b| b.extent.area()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_different_and_as_many_as_asked_for() {
        let camera = Extent {
            width: 100,
            height: 60,
        };
        assert_eq!(pixels(&sample(camera, usize::MAX)), camera.area());
        let some = sample(camera, 640);
        assert_eq!(some.len(), 160);
        assert!(some.windows(2).all(|b| (b[0].y, b[0].x) < (b[1].y, b[1].x)));
        assert_eq!(some, sample(camera, 640));
    }
}
