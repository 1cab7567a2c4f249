//! Which pixels look at which square of the light plane.

use std::ops::Range;

use crate::transport::{CameraPx, Element, Extent, Geometry, Transport};

/// Origins along a square's side where nothing is correlated.
pub const DIRECT_REACH: usize = 64;

/// Window origins of all pixels that see any of the display.
#[derive(Clone, Debug, Default)]
pub struct Bounds {
    /// Along u.
    pub columns: Range<i32>,
    /// Along v.
    pub rows: Range<i32>,
}

/// Pixels side by side that one tile holds and that look at one square.
#[derive(Clone, Debug)]
pub struct Run {
    /// The tile.
    pub tile: usize,
    /// The first pixel's number in the tile.
    pub first: usize,
    /// The first pixel.
    pub pixel: CameraPx,
    /// The first pixel's number among those of the square.
    pub begin: usize,
    /// Number of pixels.
    pub length: usize,
}

/// Window origins in a square of the light plane, and the pixels that have them.
#[derive(Clone, Debug, Default)]
pub struct Square {
    /// Its first origin's column and row, counted from [`Squares::origin`].
    pub at: [usize; 2],
    /// Its pixels.
    pub runs: Vec<Run>,
    /// Of each pixel the number of its origin in the square, row by row.
    pub places: Vec<u16>,
}

/// The squares that pixels which may be lit look at.
#[derive(Clone, Debug)]
pub struct Squares {
    /// The first of the origins in any of them.
    pub origin: Element,
    /// Origins along each one's side, at most 256.
    pub reach: usize,
    /// Origins along u, and along v, from the first to the last of them.
    across: usize,
    down: usize,
    /// One by one.
    pub all: Vec<Square>,
}

/// The origins that matter: of pixels with windows not wholly off the display. Those of dark tiles count
/// too: where squares lie decides how sums are rounded, and a photograph's tiles may be shared out.
pub fn bounds(geometry: &Geometry) -> Bounds {
    let mut bounds: Option<Bounds> = None;
    for rect in geometry.tiles() {
        for pixel in rect.pixels() {
            let origin = geometry.window_origin(pixel);
            if geometry.clip_window(origin).is_empty() {
                continue;
            }
            let Element { u, v } = origin;
            let known = bounds.get_or_insert(Bounds {
                columns: u..u + 1,
                rows: v..v + 1,
            });
            known.columns = known.columns.start.min(u)..known.columns.end.max(u + 1);
            known.rows = known.rows.start.min(v)..known.rows.end.max(v + 1);
        }
    }
    bounds.unwrap_or_default()
}

/// As many squares as a reach of at most `most` asks for along `spans`, but no larger than that takes.
pub fn even_reach(most: usize, spans: [usize; 2]) -> usize {
    let even = |span: usize| span.div_ceil(span.div_ceil(most).max(1));
    spans.map(even).into_iter().fold(1, usize::max)
}

impl Squares {
    /// Shares the pixels out to squares of `reach` origins a side.
    pub fn new(transport: &Transport, bounds: &Bounds, reach: usize) -> Self {
        let across = bounds.columns.len().div_ceil(reach);
        let down = bounds.rows.len().div_ceil(reach);
        // As much to spare on either side, so that halves of a photograph are halves of the squares.
        let first = |origins: &Range<i32>, count: usize| {
            origins.start - ((count * reach - origins.len()) / 2) as i32
        };
        let grid = Element {
            u: first(&bounds.columns, across),
            v: first(&bounds.rows, down),
        };
        let mut all = vec![Square::default(); across * down];
        for_each_pixel(transport, |tile, p, pixel, Element { u, v }| {
            let (u, v) = ((u - grid.u) as usize, (v - grid.v) as usize);
            let square = &mut all[v / reach * across + u / reach];
            let place = v % reach * reach + u % reach;
            square.at = [u / reach * reach, v / reach * reach];
            let begin = square.places.len();
            square.places.push(place as u16); // a reach is at most 256
            match square.runs.last_mut() {
                // The next of the same row and tile.
                Some(run)
                    if run.tile == tile
                        && run.first + run.length == p
                        && run.pixel.y == pixel.y =>
                {
                    run.length += 1;
                }
                _ => square.runs.push(Run {
                    tile,
                    first: p,
                    pixel,
                    begin,
                    length: 1,
                }),
            }
        });
        all.retain(|square| !square.places.is_empty());
        // Of the grid, what is left.
        let ends = |axis: usize| {
            let places = all.iter().map(|square| square.at[axis]);
            let end = places.clone().max().map_or(0, |last| last + reach);
            places.min().unwrap_or(0)..end
        };
        let (columns, rows) = (ends(0), ends(1));
        for square in &mut all {
            square.at = [square.at[0] - columns.start, square.at[1] - rows.start];
            square.runs.shrink_to_fit();
            square.places.shrink_to_fit();
        }
        Self {
            origin: Element {
                u: grid.u + columns.start as i32,
                v: grid.v + rows.start as i32,
            },
            reach,
            across: columns.len(),
            down: rows.len(),
            all,
        }
    }

    /// What all squares see, through windows of that side.
    pub fn seen(&self, window: usize) -> Extent {
        let span = |origins: usize| (origins + window - 1) as u32;
        Extent {
            width: span(self.across),
            height: span(self.down),
        }
    }
}

/// Tile, number in it, pixel and window origin of all that may be lit.
fn for_each_pixel(transport: &Transport, mut each: impl FnMut(usize, usize, CameraPx, Element)) {
    let geometry = &transport.geometry;
    for (i, tile) in transport.tiles.iter().enumerate() {
        if tile.is_dark() {
            continue;
        }
        for (p, pixel) in tile.rect().pixels().enumerate() {
            let origin = geometry.window_origin(pixel);
            if !geometry.clip_window(origin).is_empty() {
                each(i, p, pixel, origin);
            }
        }
    }
}
