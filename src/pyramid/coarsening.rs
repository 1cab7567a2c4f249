//! A level from the next finer one: `T' = U T D`, where U sums 2 × 2 light elements and D averages 2 × 2 camera pixels.
//!
//! For a light that is constant on 2 × 2 elements the coarse picture is the average of the fine one. With both halved, the
//! window halves as well: down to 5 × 5 elements, which cover the border of 2 × 2 whichever way they fall.

use std::collections::HashMap;
use std::io;

use crate::format::MAX_RANK;
use crate::linalg::{BLOCK_SLOTS, combine_slots};
use crate::transport::{
    Basis, CHANNELS, CameraPixel, Extent, FloatTile, Geometry, LightElement, TileRect, Window,
};

/// Two levels.
pub struct Coarsening<'a> {
    /// The finer level.
    pub fine: &'a Geometry,
    /// The geometry [halved](super::geometry::halved).
    pub coarse: &'a Geometry,
}

/// Values of the functions of a coarse tile, `[pixel, slot]`.
struct Sums<'a> {
    levels: &'a Coarsening<'a>,
    rect: TileRect,
    tau: Vec<[f32; CHANNELS]>,
}

impl Coarsening<'_> {
    /// The coarse tile `rect`. `tiles` are the fine tiles that cover it, each with the basis of its coefficients. If all are
    /// factored the tile has a coefficient for each slot, over [`unit_basis`], from which the encoder finds principal
    /// components.
    ///
    /// # Errors
    /// Those of `tiles`.
    pub fn tile<'b>(
        &self,
        rect: TileRect,
        tiles: impl Iterator<Item = io::Result<(FloatTile, &'b Basis)>>,
    ) -> io::Result<FloatTile> {
        let mut is_factored = self.coarse.window.area() <= usize::from(MAX_RANK);
        let mut sums = Sums {
            levels: self,
            rect,
            tau: Vec::new(),
        };
        for tile in tiles {
            let (tile, basis) = tile?;
            if tile.is_dark() {
                continue;
            }
            sums.tau.resize(
                rect.extent.area() * self.coarse.window.area(),
                [0.0; CHANNELS],
            );
            if !tile.coefficients.is_empty() {
                sums.add_coefficients(&tile, basis);
            }
            if !tile.functions.is_empty() {
                is_factored = false;
                sums.add_functions(tile.rect, &tile.functions);
            }
        }
        Ok(match is_factored {
            true => FloatTile {
                coefficients: sums.tau,
                ..FloatTile::dark(rect)
            },
            false => FloatTile {
                functions: sums.tau,
                ..FloatTile::dark(rect)
            },
        })
    }

    /// The pixels that a coarse tile averages.
    pub fn fine_rect(&self, rect: TileRect) -> TileRect {
        let Extent { width, height } = self.fine.camera;
        let [x, y] = [rect.x, rect.y].map(|at| 2 * at);
        let extent = Extent::new(
            (2 * rect.extent.width).min(width - x),
            (2 * rect.extent.height).min(height - y),
        );
        TileRect { x, y, extent }
    }

    /// The window origin of a fine pixel, and its offset from that of the coarse pixel, in fine elements.
    fn origins(&self, pixel: CameraPixel) -> (LightElement, [i32; 2]) {
        let fine = self.fine.window_origin(pixel);
        let coarse = self.coarse.window_origin(coarse_pixel(pixel));
        // Far off the light plane origins saturate, and nothing is lit.
        let offset = |fine: i32, coarse: i32| fine.saturating_sub(coarse.saturating_mul(2));
        (fine, [offset(fine.u, coarse.u), offset(fine.v, coarse.v)])
    }

    /// The share of a fine pixel in its coarse pixel.
    fn share(&self, pixel: CameraPixel) -> f32 {
        let Extent { width, height } = self.fine.camera;
        let count = |at: u32, side: u32| if at | 1 < side { 2.0 } else { 1.0 };
        1.0 / (count(pixel.x, width) * count(pixel.y, height))
    }
}

impl Sums<'_> {
    /// The slots of the coarse pixel of `pixel`.
    fn slots(&mut self, pixel: CameraPixel) -> &mut [[f32; CHANNELS]] {
        let area = self.levels.coarse.window.area();
        let CameraPixel { x, y } = coarse_pixel(pixel);
        let at = CameraPixel {
            x: x - self.rect.x,
            y: y - self.rect.y,
        };
        &mut self.tau[self.rect.extent.index(at) * area..][..area]
    }

    /// Adds direct functions, `[pixel, slot]`, of the fine pixels of `rect` that lie in this tile.
    fn add_functions(&mut self, rect: TileRect, functions: &[[f32; CHANNELS]]) {
        let levels = self.levels;
        let (fine, coarse) = (levels.fine.window, levels.coarse.window);
        let within = levels.fine_rect(self.rect);
        for (pixel, tau) in rect.pixels().zip(functions.chunks_exact(fine.area())) {
            if !contains(within, pixel) {
                continue;
            }
            let (origin, offset) = levels.origins(pixel);
            let share = levels.share(pixel);
            let slots = self.slots(pixel);
            for (slot, _) in levels.fine.elements_of_window(origin) {
                if let Some(at) = coarse_slot([fine, coarse], offset, slot) {
                    (0..CHANNELS).for_each(|c| slots[at][c] += share * tau[slot][c]);
                }
            }
        }
    }

    /// Adds `Σ_k c_k v_k` of the pixels of a tile that lie in this tile.
    fn add_coefficients(&mut self, tile: &FloatTile, basis: &Basis) {
        let levels = self.levels;
        let rank = basis.rank();
        let within = levels.fine_rect(self.rect);
        let whole = levels.fine.window.area();
        // `[block, component, slot]` of the coarse window, for each offset.
        let mut kernels: HashMap<[i32; 2], Vec<[f32; BLOCK_SLOTS]>> = HashMap::new();
        let pixels = tile.rect.pixels().zip(tile.coefficients.chunks_exact(rank));
        for (pixel, coefficients) in pixels {
            if !contains(within, pixel) {
                continue;
            }
            let (origin, offset) = levels.origins(pixel);
            let share = levels.share(pixel);
            let clipped = levels.fine.clip_window(origin);
            let at_border;
            let kernels = if clipped.area() == whole {
                kernels
                    .entry(offset)
                    .or_insert_with(|| levels.coarse_kernels(basis, offset, |_| true))
            } else {
                let side = levels.fine.window.side() as usize;
                at_border = levels.coarse_kernels(basis, offset, |slot| {
                    clipped.columns.contains(&(slot % side))
                        && clipped.rows.contains(&(slot / side))
                });
                &at_border
            };
            let slots = self.slots(pixel).chunks_mut(BLOCK_SLOTS);
            for (slots, kernels) in slots.zip(kernels.chunks_exact(rank)) {
                let sums = combine_slots(coefficients, kernels);
                for (s, tau) in slots.iter_mut().enumerate() {
                    (0..CHANNELS).for_each(|c| tau[c] += share * sums[c][s]);
                }
            }
        }
    }
}

impl Coarsening<'_> {
    /// The basis functions with the elements `is_lit` summed to coarse elements, `[block, component, slot]`.
    fn coarse_kernels(
        &self,
        basis: &Basis,
        offset: [i32; 2],
        is_lit: impl Fn(usize) -> bool,
    ) -> Vec<[f32; BLOCK_SLOTS]> {
        let windows = [self.fine.window, self.coarse.window];
        let rank = basis.rank();
        let blocks = windows[1].area().div_ceil(BLOCK_SLOTS);
        let mut kernels = vec![[0.0; BLOCK_SLOTS]; blocks * rank];
        for slot in (0..windows[0].area()).filter(|slot| is_lit(*slot)) {
            if let Some(at) = coarse_slot(windows, offset, slot) {
                let block = &mut kernels[at / BLOCK_SLOTS * rank..][..rank];
                for (coarse, fine) in block.iter_mut().zip(&basis.kernels) {
                    coarse[at % BLOCK_SLOTS] += fine[slot];
                }
            }
        }
        kernels
    }
}

/// A basis function for each slot; `None` if there are more than a file can have.
pub fn unit_basis(window: Window) -> Option<Basis> {
    let area = window.area();
    let kernel = |slot: usize| {
        let mut kernel = vec![0.0; area];
        kernel[slot] = 1.0;
        kernel
    };
    (area <= usize::from(MAX_RANK)).then(|| Basis {
        kernels: (0..area).map(kernel).collect(),
    })
}

/// The slot in the coarse window of a slot in a fine window.
fn coarse_slot([fine, coarse]: [Window; 2], [u, v]: [i32; 2], slot: usize) -> Option<usize> {
    let origin = LightElement { u, v };
    let LightElement { u, v } = fine.element(origin, slot);
    let halved = LightElement {
        u: u.div_euclid(2),
        v: v.div_euclid(2),
    };
    coarse.slot(LightElement { u: 0, v: 0 }, halved)
}

fn coarse_pixel(CameraPixel { x, y }: CameraPixel) -> CameraPixel {
    CameraPixel { x: x / 2, y: y / 2 }
}

fn contains(rect: TileRect, CameraPixel { x, y }: CameraPixel) -> bool {
    let is_in = |at: u32, first: u32, count: u32| (first..first + count).contains(&at);
    is_in(x, rect.x, rect.extent.width) && is_in(y, rect.y, rect.extent.height)
}
