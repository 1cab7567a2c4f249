//! Coefficients over the basis, in few bytes.
//!
//! Channels first: the first component's are turned to the tile's principal colours, every other's
//! are mirrored so that the pixel's own colour, that of its first component, becomes the first axis;
//! what is left on the others is small. Then, component by component, blocks of 8 by 8 pixels of each
//! axis go through the cosine transform and are rounded to multiples of the scan's step. The basis is
//! orthonormal and so are these: an error in any number is as large in the transport.
//!
//! Scans add up: what one has rounded away a later one, of a smaller step, may bring.

use super::bytes::Fields;
use super::colour::{Mirror, Palette, Pixel};
use super::dct::{self, AREA, Block, SIDE, ZIGZAG};
use super::tokens::{self, MOST, Reader, Writer};
use super::{MOST_PLAIN, PartError, damaged, zeros};
use crate::format::FormatError;
use crate::format::chunk::Chunk;
use crate::format::scan::Scan;
use crate::transport::{CHANNELS, Extent, FactoredTile};

/// What is added to a magnitude, in steps, before it is cut to a whole number: by how many units the
/// numbers before and after it come to, up to two each. Below a half, numbers that are mostly noise
/// become zero, which costs fewer bits than the error is worth; those that stand alone cost most.
const ROUNDING: [f32; 5] = [0.0, 0.2, 0.3, 0.3, 0.3];
/// The same for a first guess at the neighbours.
const ROUNDING_ALONE: f32 = 0.2;
/// The same where a later scan brings the rest.
const ROUNDING_AT_FIRST: f32 = 0.3;

/// The axes of one component of a tile, `[axis, pixel]`; empty where all are zero.
type Plane = Vec<f32>;

/// Coefficients of a tile as far as scans have brought them.
#[derive(Clone, Debug, Default)]
pub struct Planes {
    palette: Option<Palette>,
    components: Vec<Plane>,
}

impl Planes {
    /// Planes to which a tile's later chunks may be added by themselves.
    pub fn with_palette() -> Self {
        Self {
            palette: Some(Palette([[0; CHANNELS]; CHANNELS])),
            components: Vec::new(),
        }
    }

    /// Whether no scan has brought anything.
    pub fn is_dark(&self) -> bool {
        self.components.iter().all(Vec::is_empty)
    }

    /// Red, green and blue as `[pixel, component]`, of the first `rank` components.
    pub fn coefficients(&self, extent: Extent, rank: usize) -> Result<Vec<Pixel>, PartError> {
        let pixels = extent.area();
        let mut coefficients: Vec<Pixel> = zeros(pixels * rank)?;
        let mut mirrors: Vec<Mirror> = Vec::new();
        if let (Some(palette), Some(plane)) = (self.palette, self.components.first())
            && !plane.is_empty()
            && rank > 0
        {
            for p in 0..pixels {
                let rgb = palette.turn_back(shares(plane, pixels, p));
                coefficients[p * rank] = rgb;
                mirrors.push(Mirror::of(rgb));
            }
        } else {
            mirrors.resize(pixels, Mirror::of([0.0; CHANNELS]));
        }
        let others = self.components.iter().enumerate().take(rank).skip(1);
        for (k, plane) in others.filter(|(_, plane)| !plane.is_empty()) {
            for (p, mirror) in mirrors.iter().enumerate() {
                coefficients[p * rank + k] = mirror.apply(shares(plane, pixels, p));
            }
        }
        Ok(coefficients)
    }

    /// Adds a tile's chunk of `scan`.
    pub fn add(
        &mut self,
        extent: Extent,
        scan: &Scan,
        bytes: &[u8],
        plain: u32,
    ) -> Result<(), PartError> {
        let mut fields = Fields(bytes);
        if scan.first == 0 && self.palette.is_none() {
            self.palette = Some(Palette::from_bytes(fields.bytes(Palette::BYTES)?));
        }
        let length = fields.length()?;
        let most = plain as usize;
        let mut first = Reader::new(fields.bytes(length)?, most)?;
        let mut second = Reader::new(fields.0, most - first.tokens())?;
        if first.tokens() + second.tokens() < most {
            return Err(damaged("it has fewer tokens than it says"));
        }
        let components = usize::from(scan.first)..usize::from(scan.first) + usize::from(scan.count);
        if self.components.len() < components.end {
            self.components.resize(components.end, Vec::new());
        }
        let mut numbers = [0; 2 * AREA];
        for plane in &mut self.components[components.clone()] {
            for corner in corners(extent) {
                let end = first.block(&mut numbers[..AREA])?;
                if end > 0 {
                    let block = dequantise(&numbers[..end], scan.step);
                    add_block(axis(plane, extent, 0)?, extent, corner, &block);
                    numbers[..end].fill(0);
                }
            }
        }
        first.finish()?;
        for plane in &mut self.components[components] {
            for corner in corners(extent) {
                let end = second.block(&mut numbers)?;
                for a in [1, 2] {
                    let of_axis = numbers[..end].iter().skip(a - 1).step_by(2);
                    let mut own = [0; AREA];
                    let mut any = false;
                    for (own, &number) in own.iter_mut().zip(of_axis) {
                        *own = number;
                        any |= number != 0;
                    }
                    if any {
                        let block = dequantise(&own, scan.step);
                        add_block(axis(plane, extent, a)?, extent, corner, &block);
                    }
                }
                numbers[..end].fill(0);
            }
        }
        second.finish()
    }
}

/// Most tokens of a tile in a scan: one a number.
pub fn most_plain(extent: Extent, count: u16) -> u64 {
    (blocks(extent) * AREA * CHANNELS) as u64 * u64::from(count)
}

/// Most bytes of a chunk of so many tokens.
pub fn bound(plain: u64) -> u64 {
    Palette::BYTES as u64 + 4 + tokens::bound(0) + tokens::bound(plain)
}

/// Components of which any tile's tokens are few enough for one chunk.
pub fn most_components(tile_side: u32) -> u64 {
    let extent = Extent {
        width: tile_side,
        height: tile_side,
    };
    MOST_PLAIN / most_plain(extent, 1)
}

/// The finest step by which no number is too large, of coefficients of this peak.
pub fn finest_step(peak: f32) -> f32 {
    // A block's lowest frequency is eight times its pixels' mean; a turn may gather three channels.
    peak * (8 * 2) as f32 / MOST as f32
}

fn blocks(extent: Extent) -> usize {
    (extent.width as usize).div_ceil(SIDE) * (extent.height as usize).div_ceil(SIDE)
}

/// Upper left corners of a tile's blocks.
fn corners(extent: Extent) -> impl Iterator<Item = (usize, usize)> {
    let (across, down) = (extent.width as usize, extent.height as usize);
    let tops = (0..down).step_by(SIDE);
    tops.flat_map(move |top| (0..across).step_by(SIDE).map(move |left| (left, top)))
}

fn shares(plane: &[f32], pixels: usize, p: usize) -> Pixel {
    std::array::from_fn(|axis| plane[axis * pixels + p])
}

/// One axis of a component, which is made where there is none yet.
fn axis(plane: &mut Plane, extent: Extent, axis: usize) -> Result<&mut [f32], PartError> {
    let pixels = extent.area();
    if plane.is_empty() {
        *plane = zeros(CHANNELS * pixels)?;
    }
    Ok(&mut plane[axis * pixels..(axis + 1) * pixels])
}

/// The pixels that a block's numbers stand for.
fn dequantise(numbers: &[i32], step: f32) -> Block {
    let mut block = [0.0; AREA];
    for (number, i) in numbers.iter().zip(ZIGZAG) {
        block[usize::from(i)] = *number as f32 * step;
    }
    dct::inverse(&block)
}

/// Adds a block's pixels where they belong, as far as the tile goes.
fn add_block(axis: &mut [f32], extent: Extent, corner: (usize, usize), block: &Block) {
    let (across, down) = (extent.width as usize, extent.height as usize);
    let (left, top) = corner;
    let width = SIDE.min(across - left);
    for (y, row) in (top..down).zip(block.chunks_exact(SIDE)) {
        let at = y * across + left;
        for (pixel, value) in axis[at..at + width].iter_mut().zip(row) {
            *pixel += value;
        }
    }
}

/// A tile's coefficients as the numbers of its scans.
#[derive(Clone, Debug)]
pub struct Numbers {
    palette: Palette,
    blocks: usize,
    /// `[scan]`, then `[component, axis, block, coefficient in zigzag order]`.
    scans: Vec<Vec<i32>>,
    /// Squared coefficients.
    pub energy: f64,
    /// Squared errors that are left after each scan, but for the palette's.
    pub errors: Vec<f64>,
    /// Squared error of the first component's colours by a palette that is rounded, which no step mends.
    pub of_palette: f64,
    /// What a reader will have of it: the first component, and the others if they are wanted.
    planes: Planes,
}

impl Numbers {
    /// Transforms a tile and rounds it as `scans` say, which cover its components; `keep` says whether
    /// what it will be [decoded](Self::decoded) to is wanted.
    pub fn new(tile: &FactoredTile, scans: &[&Scan], keep: bool) -> Self {
        let extent = tile.rect.extent;
        let rank = tile.coefficients.len() / extent.area();
        let of = |p: usize, k: usize| {
            tile.coefficients[p * rank + k].map(|c| if c.is_finite() { c } else { 0.0 })
        };
        let mut numbers = Self {
            palette: Palette::principal((0..extent.area()).map(|p| of(p, 0))),
            blocks: blocks(extent),
            scans: Vec::new(),
            energy: 0.0,
            errors: vec![0.0; scans.len()],
            of_palette: 0.0,
            planes: Planes::default(),
        };
        for scan in scans {
            let length = usize::from(scan.count) * CHANNELS * numbers.blocks * AREA;
            numbers.scans.push(vec![0; length]);
        }
        let mut planes = Planes {
            palette: Some(numbers.palette),
            components: vec![Vec::new()],
        };
        let turned = |p: usize| numbers.palette.turn(of(p, 0));
        let pixels: Vec<Pixel> = (0..extent.area()).map(turned).collect();
        let off = |(p, turned): (usize, &Pixel)| -> f64 {
            let (got, want) = (numbers.palette.turn_back(*turned), of(p, 0));
            (0..CHANNELS)
                .map(|c| f64::from(got[c] - want[c]).powi(2))
                .sum()
        };
        numbers.of_palette = pixels.iter().enumerate().map(off).sum();
        let first = Some(&mut planes.components[0]);
        numbers.component(0, &pixels, extent, scans, first);
        // As a reader will know them once every scan has come.
        let mirrors: Vec<Mirror> = match planes.coefficients(extent, 1) {
            Ok(colours) => colours.into_iter().map(Mirror::of).collect(),
            Err(_) => vec![Mirror::of([0.0; CHANNELS]); extent.area()],
        };
        let mut pixels = pixels;
        for k in 1..rank {
            for (p, pixel) in pixels.iter_mut().enumerate() {
                *pixel = mirrors[p].apply(of(p, k));
            }
            let mut plane = Plane::new();
            numbers.component(k, &pixels, extent, scans, keep.then_some(&mut plane));
            planes.components.push(plane);
        }
        numbers.planes = planes;
        numbers
    }

    /// The coefficients that a reader will have, `[pixel, component]`, where they were kept.
    pub fn decoded(&self, extent: Extent) -> Result<Vec<Pixel>, PartError> {
        self.planes
            .coefficients(extent, self.planes.components.len())
    }

    /// Rounds component `k`; leaves what a reader will see of it in `seen`.
    fn component(
        &mut self,
        k: usize,
        pixels: &[Pixel],
        extent: Extent,
        scans: &[&Scan],
        mut seen: Option<&mut Plane>,
    ) {
        let covers = |scan: &Scan| (usize::from(scan.first)..scan.end()).contains(&k);
        let last = scans.iter().rposition(|scan| covers(scan));
        for a in 0..CHANNELS {
            for (b, (left, top)) in corners(extent).enumerate() {
                let mut rest = transformed(pixels, extent, (left, top), a);
                let inside = (
                    SIDE.min(extent.width as usize - left),
                    SIDE.min(extent.height as usize - top),
                );
                let mut left_over = square(&rest, inside);
                self.energy += left_over;
                for (s, scan) in scans.iter().enumerate() {
                    if covers(scan) {
                        let at = (k - usize::from(scan.first)) * CHANNELS + a;
                        let at = (at * self.blocks + b) * AREA;
                        let numbers = &mut self.scans[s][at..at + AREA];
                        match Some(s) == last {
                            true => round_block(&rest, scan.step, numbers),
                            false => round_all(&rest, scan.step, |_| ROUNDING_AT_FIRST, numbers),
                        }
                        for (number, rest) in numbers.iter().zip(&mut rest) {
                            *rest -= *number as f32 * scan.step;
                        }
                        left_over = square(&rest, inside);
                        if let Some(plane) = &mut seen
                            && numbers.iter().any(|number| *number != 0)
                            && let Ok(axis) = axis(plane, extent, a)
                        {
                            add_block(axis, extent, (left, top), &dequantise(numbers, scan.step));
                        }
                    }
                    self.errors[s] += left_over;
                }
            }
        }
    }

    /// Compresses the chunks, `None` where there is none.
    pub fn chunks(&self, scans: &[&Scan]) -> Result<Vec<Option<Chunk>>, FormatError> {
        let mut has_palette = false;
        let mut chunks = Vec::with_capacity(scans.len());
        for (scan, numbers) in scans.iter().zip(&self.scans) {
            if numbers.iter().all(|number| *number == 0) {
                chunks.push(None);
                continue;
            }
            let mut bytes = Vec::new();
            if scan.first == 0 && !has_palette {
                bytes.extend(self.palette.to_bytes());
                has_palette = true;
            }
            chunks.push(Some(self.chunk(numbers, bytes)?));
        }
        Ok(chunks)
    }

    /// The chunk of some numbers, after what `bytes` has already.
    fn chunk(&self, numbers: &[i32], mut bytes: Vec<u8>) -> Result<Chunk, FormatError> {
        let axis = self.blocks * AREA;
        let mut writer = Writer::default();
        for component in numbers.chunks_exact(CHANNELS * axis) {
            for block in component[..axis].chunks_exact(AREA) {
                writer.block(block);
            }
        }
        let (first, first_tokens) = writer.finish()?;
        let mut writer = Writer::default();
        let mut both = [0; 2 * AREA];
        for component in numbers.chunks_exact(CHANNELS * axis) {
            let (second, third) = component[axis..].split_at(axis);
            for (second, third) in second.chunks_exact(AREA).zip(third.chunks_exact(AREA)) {
                for i in 0..AREA {
                    [both[2 * i], both[2 * i + 1]] = [second[i], third[i]];
                }
                writer.block(&both);
            }
        }
        let (second, second_tokens) = writer.finish()?;
        bytes.extend((first.len() as u32).to_le_bytes()); // a chunk is below some times MOST_PLAIN
        bytes.extend(first);
        bytes.extend(second);
        Ok(Chunk {
            bytes,
            plain: first_tokens + second_tokens,
        })
    }
}

/// A block's coefficients in zigzag order.
fn transformed(
    pixels: &[Pixel],
    extent: Extent,
    (left, top): (usize, usize),
    axis: usize,
) -> Block {
    let (across, down) = (extent.width as usize, extent.height as usize);
    // Beyond the tile's edge its last pixels go on.
    let block: Block = std::array::from_fn(|i| {
        let x = (left + i % SIDE).min(across - 1);
        let y = (top + i / SIDE).min(down - 1);
        pixels[y * across + x][axis]
    });
    let coefficients = dct::forward(&block);
    ZIGZAG.map(|i| coefficients[usize::from(i)])
}

/// Rounds a block to the numbers that are worth their bits.
fn round_block(block: &Block, step: f32, numbers: &mut [i32]) {
    round_all(block, step, |_| ROUNDING_ALONE, numbers);
    let mut first = [0; AREA + 2];
    for (first, number) in first[1..].iter_mut().zip(numbers.iter()) {
        *first = number.unsigned_abs().min(2);
    }
    let neighbours = |i: usize| (first[i] + first[i + 2]) as usize;
    round_all(block, step, |i| ROUNDING[neighbours(i)], numbers);
}

fn round_all(block: &Block, step: f32, rounding: impl Fn(usize) -> f32, numbers: &mut [i32]) {
    for (i, (number, x)) in numbers.iter_mut().zip(block).enumerate() {
        let steps = (x.abs() / step + rounding(i)) as i32; // `as` saturates
        *number = steps.min(MOST) * if *x < 0.0 { -1 } else { 1 };
    }
}

/// Squared pixels of a block whose coefficients in zigzag order are these, of as many columns and rows
/// as lie inside the tile.
fn square(zigzag: &Block, (columns, rows): (usize, usize)) -> f64 {
    let sum = |values: &[f32]| values.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
    if (columns, rows) == (SIDE, SIDE) {
        return sum(zigzag);
    }
    let mut block = [0.0; AREA];
    for (value, i) in zigzag.iter().zip(ZIGZAG) {
        block[usize::from(i)] = *value;
    }
    let pixels = dct::inverse(&block);
    let lines = pixels.chunks_exact(SIDE).take(rows);
    lines.map(|line| sum(&line[..columns])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::scan::Coding;
    use crate::transport::TileRect;

    /// Coefficients that fall off from one component to the next, smooth in space, of a few colours.
    fn tile(width: u32, height: u32, rank: usize) -> FactoredTile {
        let rect = TileRect {
            x: 0,
            y: 0,
            extent: Extent { width, height },
        };
        let mut coefficients = Vec::new();
        for pixel in rect.pixels() {
            let (x, y) = (pixel.x as f32, pixel.y as f32);
            let colour = match x > y {
                true => [1.0, 0.3, 0.1],
                false => [0.2, 0.5, 0.9],
            };
            for k in 0..rank {
                let wave = (0.2 * x + 0.31 * k as f32).sin() * (0.17 * y - k as f32).cos();
                let size = if k == 0 { 2.0 + wave } else { wave / k as f32 };
                coefficients.push(colour.map(|c| c * size));
            }
        }
        FactoredTile { rect, coefficients }
    }

    fn scan(first: u16, count: u16, step: f32) -> Scan {
        Scan::new(Coding::Transform, first, count, step)
    }

    fn squared_error(planes: &Planes, tile: &FactoredTile, rank: usize) -> f64 {
        let decoded = planes.coefficients(tile.rect.extent, rank).unwrap();
        let off = decoded.iter().zip(&tile.coefficients);
        let off = off.flat_map(|(a, b)| (0..CHANNELS).map(move |c| f64::from(a[c] - b[c])));
        off.map(|off| off * off).sum()
    }

    #[test]
    fn a_tile_comes_back_scan_by_scan_as_near_as_it_says() {
        for (width, height) in [(32, 32), (29, 9), (1, 1), (8, 16)] {
            let rank = 6;
            let tile = tile(width, height, rank);
            let extent = tile.rect.extent;
            for step in [1e-4, 1e-2, 0.1] {
                let scans = [
                    scan(0, 2, 8.0 * step),
                    scan(0, 1, step / 3.0),
                    scan(1, 1, step),
                    scan(2, 4, step),
                ];
                let scans: Vec<&Scan> = scans.iter().collect();
                let numbers = Numbers::new(&tile, &scans, true);
                let mut planes = Planes::default();
                let decoded = numbers.decoded(extent).unwrap();
                let chunks = numbers.chunks(&scans).unwrap();
                for ((scan, chunk), error) in scans.iter().zip(chunks).zip(&numbers.errors) {
                    if let Some(chunk) = chunk {
                        assert!(u64::from(chunk.plain) <= most_plain(extent, scan.count));
                        assert!(chunk.bytes.len() as u64 <= bound(chunk.plain.into()));
                        planes.add(extent, scan, &chunk.bytes, chunk.plain).unwrap();
                    }
                    // But for mirrors of a first component that is not there yet, and for errors of
                    // which one happens to mend the other.
                    let left = squared_error(&planes, &tile, rank);
                    let said = error + numbers.of_palette;
                    assert!((left - said).abs() <= 0.03 * said + 1e-6, "{left} {said}");
                }
                assert_eq!(planes.coefficients(extent, rank).unwrap(), decoded);
            }
        }
    }

    #[test]
    fn what_is_dark_takes_nothing_and_what_is_cut_is_an_error() {
        let mut dark = tile(16, 16, 3);
        dark.coefficients.fill([0.0; CHANNELS]);
        let scan = scan(0, 3, 1e-2);
        let chunks = |tile| {
            Numbers::new(tile, &[&scan], false)
                .chunks(&[&scan])
                .unwrap()
        };
        assert!(chunks(&dark)[0].is_none());
        let tile = tile(16, 16, 3);
        let chunk = chunks(&tile).pop().unwrap().unwrap();
        let decode =
            |bytes: &[u8], plain: u32| Planes::default().add(tile.rect.extent, &scan, bytes, plain);
        decode(&chunk.bytes, chunk.plain).unwrap();
        for cut in 0..chunk.bytes.len() {
            assert!(decode(&chunk.bytes[..cut], chunk.plain).is_err());
        }
        assert!(decode(&[&chunk.bytes[..], &[0]].concat(), chunk.plain).is_err());
        assert!(decode(&chunk.bytes, chunk.plain + 1).is_err());
    }
}
