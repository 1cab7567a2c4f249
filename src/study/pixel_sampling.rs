//! Random samples of camera pixels, for methods that take too long on all of them.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardUniform};

use crate::transport::{Geometry, TileRect};

/// Seed of the sample, which is the same in every run.
const SEED: u64 = 8;

/// Random tiles of about `pixels` pixels together, at least `min_tiles`, without replacement; all tiles if these are
/// fewer.
pub(super) fn random_tiles(geometry: &Geometry, pixels: usize, min_tiles: usize) -> Vec<TileRect> {
    let count = pixels.div_ceil((geometry.tile_side * geometry.tile_side) as usize);
    let indices = random_indices(geometry.tile_grid().area(), count.max(min_tiles));
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

/// Number of pixels in `tiles`.
pub(super) fn count_pixels(tiles: &[TileRect]) -> usize {
    tiles.iter().map(|tile| tile.extent.area()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::{Correspondence, Extent, Window};

    #[test]
    fn random_tiles_are_different_and_cover_the_requested_pixels() {
        let camera = Extent::new(100, 60);
        let geometry = Geometry {
            camera,
            light: camera,
            window: Window::new(1).unwrap(),
            correspondence: Correspondence::from_affine([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
            tile_side: 2,
        };
        let all = random_tiles(&geometry, usize::MAX, 1);
        assert_eq!(count_pixels(&all), camera.area());
        let some = random_tiles(&geometry, 640, 1);
        assert_eq!(some.len(), 160);
        assert!(some.windows(2).all(|b| (b[0].y, b[0].x) < (b[1].y, b[1].x)));
        assert_eq!(some, random_tiles(&geometry, 640, 1));
        assert_eq!(random_tiles(&geometry, 4, 8).len(), 8);
    }
}
