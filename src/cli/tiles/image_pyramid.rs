//! Halves a picture again and again, and cuts each size into tiles, from its rows. Memory
//! holds a row of tiles of each size.

use anyhow::Result;
use image::RgbImage;

use super::tile_layout::TILE_SIDE;
use crate::relight::srgb;
use crate::transport::Extent;

/// Writes a tile: the number of its size, from the largest, and its column and row.
pub type WriteTile<'a> = dyn FnMut(usize, [u32; 2], &RgbImage) -> Result<()> + 'a;

/// The sizes of a picture, from the whole.
pub struct ImagePyramid<'a> {
    sizes: Vec<SizeRows>,
    write: &'a mut WriteTile<'a>,
}

/// The rows of a size so far.
struct SizeRows {
    extent: Extent,
    /// Number of rows that have come.
    rows: u32,
    /// sRGB codes of the rows of the present row of tiles.
    codes: Vec<[u8; 3]>,
    /// The last row as linear RGB, if the row below it is averaged with it.
    above: Option<Vec<[f32; 3]>>,
}

impl<'a> ImagePyramid<'a> {
    /// Takes a picture of the first size, and makes all `sizes`; each has half the rows and columns of the one before.
    pub fn new(sizes: &[Extent], write: &'a mut WriteTile<'a>) -> Self {
        let empty = |&extent: &Extent| SizeRows {
            extent,
            rows: 0,
            codes: Vec::new(),
            above: None,
        };
        Self {
            sizes: sizes.iter().map(empty).collect(),
            write,
        }
    }

    /// Takes the next row of the picture.
    ///
    /// # Errors
    /// Those of writing tiles.
    pub fn add_row(&mut self, row: &[[u8; 4]]) -> Result<()> {
        let decoded = srgb::srgb8_decoded();
        let linear =
            |&[r, g, b, _]: &[u8; 4]| [r, g, b].map(|code| decoded[usize::from(code)] as f32);
        let linear = row.iter().map(linear).collect();
        let codes: Vec<[u8; 3]> = row.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
        self.add(0, &codes, linear)
    }

    fn add(&mut self, number: usize, codes: &[[u8; 3]], linear: Vec<[f32; 3]>) -> Result<()> {
        let has_next = number + 1 < self.sizes.len();
        let size = &mut self.sizes[number];
        size.codes.extend_from_slice(codes);
        size.rows += 1;
        let is_last = size.rows == size.extent.height;
        if is_last || size.rows.is_multiple_of(TILE_SIDE) {
            size.write_tiles(number, self.write)?;
        }
        if !has_next {
            return Ok(());
        }
        let above = size.above.take();
        if above.is_none() && !is_last {
            size.above = Some(linear);
            return Ok(());
        }
        let half = halved(above.as_deref(), &linear);
        let codes: Vec<[u8; 3]> = half
            .iter()
            .map(|pixel| pixel.map(|value| srgb::srgb8(f64::from(value))))
            .collect();
        self.add(number + 1, &codes, half)
    }
}

impl SizeRows {
    /// Writes the present row of tiles, and begins the next.
    fn write_tiles(&mut self, number: usize, write: &mut WriteTile<'_>) -> Result<()> {
        let width = self.extent.width;
        let row = (self.rows - 1) / TILE_SIDE;
        let height = self.codes.len() as u32 / width;
        for (column, x) in (0..width).step_by(TILE_SIDE as usize).enumerate() {
            let tile = RgbImage::from_fn(TILE_SIDE.min(width - x), height, |i, j| {
                image::Rgb(self.codes[(j * width + x + i) as usize])
            });
            write(number, [column as u32, row], &tile)?;
        }
        self.codes.clear();
        Ok(())
    }
}

/// The mean of 2 × 2 pixels of two rows, of those that there are.
fn halved(above: Option<&[[f32; 3]]>, below: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let rows: Vec<&[[f32; 3]]> = above.into_iter().chain([below]).collect();
    let pixel = |x: usize| {
        let pixels = rows.iter().flat_map(|row| row[2 * x..].iter().take(2));
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for pixel in pixels {
            (0..3).for_each(|c| sum[c] += pixel[c]);
            count += 1.0;
        }
        sum.map(|value: f32| value / count)
    };
    (0..below.len().div_ceil(2)).map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture whose codes tell the place, in three rows and columns of tiles.
    #[test]
    fn tiles_have_the_pixels_of_their_place() {
        let sizes = [Extent::new(1100, 1030), Extent::new(550, 515)];
        let code = |x: u32, y: u32| {
            [
                (x % 251) as u8,
                (y % 251) as u8,
                (x / 251 + 16 * (y / 251)) as u8,
            ]
        };
        let mut cells = Vec::new();
        let mut write = |number: usize, [column, row]: [u32; 2], tile: &RgbImage| {
            cells.push((number, column, row, tile.dimensions()));
            if number == 0 {
                for (x, y, pixel) in tile.enumerate_pixels() {
                    assert_eq!(pixel.0, code(512 * column + x, 512 * row + y));
                }
            }
            Ok(())
        };
        let mut pyramid = ImagePyramid::new(&sizes, &mut write);
        for y in 0..1030 {
            let row: Vec<[u8; 4]> = (0..1100)
                .map(|x| {
                    let [r, g, b] = code(x, y);
                    [r, g, b, 255]
                })
                .collect();
            pyramid.add_row(&row).unwrap();
        }
        cells.sort_unstable();
        let side = |cell: u32, side: u32| 512.min(side - 512 * cell);
        let expected: Vec<_> = [(0, 3, sizes[0]), (1, 2, sizes[1])]
            .into_iter()
            .flat_map(|(number, count, Extent { width, height })| {
                let cells = (0..count).flat_map(move |x| (0..count).map(move |y| (x, y)));
                cells.map(move |(x, y)| (number, x, y, (side(x, width), side(y, height))))
            })
            .collect();
        assert_eq!(cells, expected);
    }

    #[test]
    fn halves_are_means_of_the_pixels_that_there_are() {
        let row = |values: [f32; 3]| values.map(|value| [value; 3]);
        let means = halved(Some(&row([1.0, 2.0, 3.0])), &row([3.0, 6.0, 9.0]));
        assert_eq!(means, [[3.0; 3], [6.0; 3]]);
        assert_eq!(halved(None, &row([3.0, 6.0, 9.0])), [[4.5; 3], [9.0; 3]]);
    }
}
