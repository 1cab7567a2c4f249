//! Coding 1: coefficients by colour transform, cosine transform and quantisation.
//!
//! For pixel p and component k, with c_pk in red, green and blue and q_pk on three other axes:
//!
//! ```text
//! q_p0 = K c_p0           K: the colour KLT of the tile's component 0
//! q_pk = H(c_p0) c_pk     H: the Householder reflection that maps the pixel's own colour to axis 0
//! ```
//!
//! Most energy lies on axis 0 then, as the components of a pixel have similar colours. Each axis goes
//! through the cosine transform in blocks of 8 x 8 pixels and is rounded to multiples of the scan's step.
//! With an orthonormal basis every stage is orthonormal: an error of a number is as large in τ. Scans add
//! up. Values are `[component, axis, pixel]`.
//!
//! A chunk is the KLT (18 bytes, in the tile's first chunk with component 0), the length of the main token
//! string, the main token string (axis 0, a run of 64 numbers for each component and block) and the side
//! token string (axes 1 and 2 interleaved, a run of 128).

use super::colour::{ColourKlt, ColourVector, HouseholderReflection};
use super::dct::{self, AREA, DctBlock, SIDE, ZIGZAG};
use super::tokens::{self, EntropyTokenReader, MAX_MAGNITUDE};
use crate::format::constants::MAX_CONTENT_BYTES;
use crate::format::error::{FormatError, SectionError, damaged};
use crate::format::fields::FieldReader;
use crate::format::memory_budget::{MemoryBudget, vec_bytes};
use crate::format::scan::ProgressiveScan;
use crate::transport::{CHANNELS, Extent, Geometry};

/// The axes of one component of a tile, `[axis, pixel]`; empty if all are zero.
pub type CoefficientPlane = Vec<f32>;

/// Coefficients of a tile on their transformed axes: the sum of its scans so far.
#[derive(Clone, Debug, Default)]
pub struct CoefficientPlanes {
    pub klt: Option<ColourKlt>,
    pub components: Vec<CoefficientPlane>,
    /// Number of components that are read, if not all.
    pub max_components: Option<usize>,
}

impl CoefficientPlanes {
    /// Planes to which one of a tile's later chunks, without a KLT, can be added.
    pub fn with_klt() -> Self {
        Self {
            klt: Some(ColourKlt([[0; CHANNELS]; CHANNELS])),
            ..Self::default()
        }
    }

    /// Whether all coefficients are zero.
    pub fn is_dark(&self) -> bool {
        self.components.iter().all(Vec::is_empty)
    }

    /// Bytes allocated.
    pub fn bytes(&self) -> u64 {
        vec_bytes(&self.components) + self.components.iter().map(vec_bytes).sum::<u64>()
    }

    /// Red, green and blue as `[pixel, component]`, of the first `rank` components.
    ///
    /// # Errors
    /// The errors of `budget`.
    pub fn coefficients(
        &self,
        extent: Extent,
        rank: usize,
        budget: &MemoryBudget,
    ) -> Result<Vec<ColourVector>, FormatError> {
        let pixels = extent.area();
        let mut coefficients: Vec<ColourVector> = budget.try_zeroed(pixels * rank)?;
        let mut reflections = budget.try_with_capacity(pixels)?;
        if let (Some(klt), Some(plane)) = (self.klt, self.components.first())
            && !plane.is_empty()
            && rank > 0
        {
            for p in 0..pixels {
                let rgb = klt.inverse(axis_values(plane, pixels, p));
                coefficients[p * rank] = rgb;
                reflections.push(HouseholderReflection::of_colour(rgb));
            }
        } else {
            reflections.resize(pixels, HouseholderReflection::of_colour([0.0; CHANNELS]));
        }
        let others = self.components.iter().enumerate().take(rank).skip(1);
        for (k, plane) in others.filter(|(_, plane)| !plane.is_empty()) {
            for (p, reflection) in reflections.iter().enumerate() {
                coefficients[p * rank + k] = reflection.apply(axis_values(plane, pixels, p));
            }
        }
        budget.release_vec(reflections);
        Ok(coefficients)
    }

    /// Adds a tile's chunk of `scan`, which has `tokens` tokens.
    ///
    /// # Errors
    /// [`SectionError`] if the chunk is damaged, or the budget refuses memory.
    pub fn add(
        &mut self,
        extent: Extent,
        scan: &ProgressiveScan,
        bytes: &[u8],
        tokens: u32,
        budget: &MemoryBudget,
    ) -> Result<(), SectionError> {
        let too_short = || damaged("it is shorter than it says");
        let mut fields = FieldReader(bytes);
        if scan.first == 0 && self.klt.is_none() {
            let klt = fields.try_bytes(ColourKlt::BYTES).ok_or_else(too_short)?;
            self.klt = Some(ColourKlt::from_bytes(klt));
        }
        let length = fields.try_length().ok_or_else(too_short)?;
        let main = fields.try_bytes(length).ok_or_else(too_short)?;
        let tokens = tokens as usize;
        let mut main = EntropyTokenReader::new(main, tokens, budget)?;
        let mut side = EntropyTokenReader::new(fields.0, tokens - main.tokens(), budget)?;
        if main.tokens() + side.tokens() < tokens {
            return Err(damaged("it has fewer tokens than its entry says"));
        }
        let end = self
            .max_components
            .map_or(scan.end(), |most| most.min(scan.end()));
        let components = usize::from(scan.first).min(end)..end;
        if self.components.len() < components.end {
            let mut grown = budget.try_with_capacity(components.end)?;
            grown.append(&mut self.components);
            grown.resize(components.end, CoefficientPlane::new());
            self.components = grown;
        }
        let planes = &mut self.components[components];
        let mut numbers = [0; 2 * AREA];
        for plane in &mut *planes {
            for corner in block_corners(extent) {
                let end = main.read_run(&mut numbers[..AREA])?;
                if end > 0 {
                    let block = dequantise(&numbers[..end], scan.step);
                    let axis = try_axis(plane, extent, 0, budget)?;
                    add_block(axis, extent, corner, &block);
                    numbers[..end].fill(0);
                }
            }
        }
        if end == scan.end() {
            main.finish()?;
        }
        for plane in planes {
            for corner in block_corners(extent) {
                let end = side.read_run(&mut numbers)?;
                for a in [1, 2] {
                    let of_axis = numbers[..end].iter().skip(a - 1).step_by(2);
                    let mut own = [0; AREA];
                    let mut is_zero = true;
                    for (own, &number) in own.iter_mut().zip(of_axis) {
                        *own = number;
                        is_zero &= number == 0;
                    }
                    if !is_zero {
                        let block = dequantise(&own, scan.step);
                        let axis = try_axis(plane, extent, a, budget)?;
                        add_block(axis, extent, corner, &block);
                    }
                }
                numbers[..end].fill(0);
            }
        }
        match end == scan.end() {
            true => side.finish(),
            false => Ok(()),
        }
    }
}

/// Maximum tokens of a chunk: one for each number.
pub fn max_tokens(extent: Extent, count: u16) -> u64 {
    (block_count(extent) * AREA * CHANNELS) as u64 * u64::from(count)
}

/// Maximum bytes of a chunk of `tokens` tokens.
pub fn max_bytes(tokens: u64) -> u64 {
    ColourKlt::BYTES as u64 + 4 + tokens::max_bytes(0) + tokens::max_bytes(tokens)
}

/// Number of components whose tokens fit into one chunk of any tile.
pub fn max_components(tile_side: u32) -> u64 {
    MAX_CONTENT_BYTES / max_tokens(Extent::new(tile_side, tile_side), 1)
}

/// Upper bound on the ratio of a block's energy with its padding, which repeats the last column and row of
/// a tile, to that without.
pub fn padding_factor(geometry: &Geometry) -> f64 {
    let copies = |camera: u32| {
        let lengths = [geometry.tile_side.min(camera), camera % geometry.tile_side];
        let copies = lengths.map(|length| match length % SIDE as u32 {
            0 => 1,
            rest => SIDE as u32 + 1 - rest,
        });
        f64::from(copies[0].max(copies[1]))
    };
    copies(geometry.camera.width) * copies(geometry.camera.height)
}

/// The finest step that keeps numbers within [`MAX_MAGNITUDE`], for coefficients up to `peak` whose squares sum
/// to `energy`.
pub fn finest_step(peak: f32, energy: f64) -> f32 {
    // Frequency 0 is eight times a block's mean, and a colour transform adds up to √3; no number exceeds
    // the norm of all. Rounded colour axes are a little longer than 1.
    let max_value = (peak * (8 * 2) as f32).min(1.01 * energy.sqrt() as f32);
    max_value / MAX_MAGNITUDE as f32
}

/// Number of blocks of a tile.
pub fn block_count(extent: Extent) -> usize {
    (extent.width as usize).div_ceil(SIDE) * (extent.height as usize).div_ceil(SIDE)
}

/// Column and row of each block's top left pixel.
pub fn block_corners(extent: Extent) -> impl Iterator<Item = (usize, usize)> {
    let (width, height) = (extent.width as usize, extent.height as usize);
    let tops = (0..height).step_by(SIDE);
    tops.flat_map(move |top| (0..width).step_by(SIDE).map(move |left| (left, top)))
}

fn axis_values(plane: &[f32], pixels: usize, p: usize) -> ColourVector {
    std::array::from_fn(|axis| plane[axis * pixels + p])
}

/// One axis of a component, whose plane is allocated with its first number that is not zero.
///
/// # Errors
/// The errors of `budget`.
pub fn try_axis<'a>(
    plane: &'a mut CoefficientPlane,
    extent: Extent,
    axis: usize,
    budget: &MemoryBudget,
) -> Result<&'a mut [f32], FormatError> {
    let pixels = extent.area();
    if plane.is_empty() {
        *plane = budget.try_zeroed(CHANNELS * pixels)?;
    }
    Ok(&mut plane[axis * pixels..(axis + 1) * pixels])
}

/// The pixels of a block of numbers in zigzag order.
pub fn dequantise(numbers: &[i32], step: f32) -> DctBlock {
    let mut block = [0.0; AREA];
    for (number, i) in numbers.iter().zip(ZIGZAG) {
        block[usize::from(i)] = *number as f32 * step;
    }
    dct::inverse(&block)
}

/// Adds a block's pixels to the axis of a tile, cut at the tile's edges.
pub fn add_block(axis: &mut [f32], extent: Extent, corner: (usize, usize), block: &DctBlock) {
    let (width, height) = (extent.width as usize, extent.height as usize);
    let (left, top) = corner;
    let columns = SIDE.min(width - left);
    for (y, row) in (top..height).zip(block.chunks_exact(SIDE)) {
        let at = y * width + left;
        for (pixel, value) in axis[at..at + columns].iter_mut().zip(row) {
            *pixel += value;
        }
    }
}
