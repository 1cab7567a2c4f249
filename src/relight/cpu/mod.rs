//! Relighting on the CPU: the picture `y = pT` in linear light, single precision.
//!
//! Pixels are grouped by *origin block* ([`origin_blocks`]), a square of window origins. Where the light under a
//! block has changed, the block's basis response is computed ([`correlation`]) and combined with the pixels'
//! coefficients while it is in the cache ([`combine`]); the functions of direct tiles are summed slot by slot
//! ([`windowed_sum`]). Other blocks keep their pixels, and so do blocks out of view. Blocks are independent, so threads share
//! them. A relighter keeps linear light, or the codes of a canvas, which take a third of the memory ([`StoredPixel`]).
//!
//! A basis response is exact to about a millionth of the block's brightest element.

mod block_size;
mod combine;
mod correlation;
mod fft;
mod light_fft;
mod origin_blocks;
mod padded_light;
mod simd;
mod stored_pixel;

use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};

use super::output_transform::TabulatedOutputTransform;
use super::{Light, LightChroma, LinearPicture, OutputTransform, Rgba8Picture, used_count};
use crate::job_executor::Executor;
use crate::transport::{
    CHANNELS, FunctionEntry, Tile, TileRect, Transport, entries_by_pixel, entry_slot,
};
use combine::{OriginBlockResponse, combine};
use correlation::{CorrelationScratch, Correlator};
use origin_blocks::{DIRECT_BLOCK_SIDE, OriginBlock, OriginBlocks, OriginBoundingBox, PixelSpan};
use padded_light::PaddedLight;
use simd::{Simd, SimdKernel, SimdLevel};
pub use stored_pixel::StoredPixel;
use stored_pixel::{EncodedPixel, LinearPixel, PixelEncoder};

/// The instructions that this build relights by.
pub const KERNEL: &str = if cfg!(all(target_arch = "wasm32", target_feature = "simd128")) {
    "simd128"
} else if cfg!(target_arch = "wasm32") {
    "scalar"
} else {
    "native"
};

/// Rows of the picture that are encoded at once.
pub const STRIP_ROWS: usize = 64;

/// A transport and its picture under the last light, in linear light.
pub type LinearRelighter = CpuRelighter<LinearPixel>;

/// A transport and its picture under the last light, after an output transform.
pub type EncodedRelighter = CpuRelighter<EncodedPixel>;

/// A transport and its picture under the last light.
#[derive(Debug)]
pub struct CpuRelighter<P: StoredPixel> {
    transport: Arc<Transport>,
    /// `None` where no tile is factored.
    correlator: Option<Correlator>,
    blocks: OriginBlocks,
    /// Elements along the side of a block's footprint.
    footprint: usize,
    light: PaddedLight,
    /// Distance of each slot's light element from the window's first one.
    slot_offsets: Vec<u32>,
    /// The picture, block by block; locked one by one, as threads share the blocks.
    pixels: Vec<RwLock<Vec<P>>>,
    /// Makes stored pixels from linear ones.
    encoder: P::Encoder,
    /// Quads of components in use.
    quads: usize,
    /// Whether each block is out of date, whatever has changed in the light since.
    is_stale: Vec<bool>,
    /// The pixels in view.
    view: TileRect,
    /// Memory of threads that are idle, kept from frame to frame.
    scratch_pool: Mutex<Vec<CorrelationScratch>>,
}

impl<P: StoredPixel> CpuRelighter<P> {
    /// Prepares a transport. The picture is dark until the first light.
    pub fn new(transport: Arc<Transport>) -> Self {
        let geometry = &transport.geometry;
        let window = geometry.window.side() as usize;
        let bounds = OriginBoundingBox::new(geometry);
        let is_factored = transport.tiles.iter().any(is_factored);
        let (columns, rows) = (bounds.columns.len(), bounds.rows.len());
        let correlator =
            is_factored.then(|| Correlator::new(&transport.basis, geometry.window, columns, rows));
        let (side, quads) = match &correlator {
            Some(correlator) => (correlator.block_side, correlator.quads),
            None => (DIRECT_BLOCK_SIDE, 0),
        };
        let blocks = OriginBlocks::new(&transport, &bounds, side);
        let light = PaddedLight::new(geometry.light, blocks.origin, blocks.footprint);
        let mut slot_offsets = Vec::with_capacity(geometry.window.area());
        for row in 0..window {
            for column in 0..window {
                slot_offsets.push((row * light.stride() + column) as u32);
            }
        }
        let dark = |block: &OriginBlock| RwLock::new(vec![P::DARK; block.offsets.len()]);
        Self {
            pixels: blocks.blocks.iter().map(dark).collect(),
            encoder: P::Encoder::default(),
            quads,
            is_stale: vec![false; blocks.blocks.len()],
            view: TileRect {
                x: 0,
                y: 0,
                extent: geometry.camera,
            },
            footprint: side + window - 1,
            correlator,
            blocks,
            scratch_pool: Mutex::default(),
            slot_offsets,
            light,
            transport,
        }
    }

    /// The transport.
    pub fn transport(&self) -> &Transport {
        &self.transport
    }

    /// Sets the share of the components in use, 0 to 1, rounded up to quads; at least one quad is used. Takes
    /// effect with the next light or [`update`](Self::update).
    pub fn set_quality(&mut self, quality: f32) {
        let all = self
            .correlator
            .as_ref()
            .map_or(0, |correlator| correlator.quads);
        let quads = used_count(all, quality);
        if quads != self.quads {
            self.is_stale.fill(true);
        }
        self.quads = quads;
    }

    /// The pixels in view.
    pub fn view(&self) -> TileRect {
        self.view
    }

    /// Sets the pixels in view, at first all. Others are not kept up to date, and not encoded: they become so with the next
    /// [`update`](Self::update) that has them in view.
    pub fn set_view(&mut self, view: TileRect) {
        self.view = view;
    }

    /// Relights under a light. Blocks whose light has not changed keep their pixels.
    ///
    /// # Panics
    /// If the light's extent is not the transport's.
    pub fn relight(&mut self, light: &Light, executor: &impl Executor) {
        let extent = self.transport.geometry.light;
        // Not `assert_eq`, whose formatting code modules would have to carry.
        assert!(light.extent() == extent, "extent of the light");
        let width = extent.width as usize;
        for v in self.light_rows() {
            self.set_light_row(v, &light.elements()[v as usize * width..][..width]);
        }
        self.update(executor);
    }

    /// Rows of the light plane that any window covers.
    pub fn light_rows(&self) -> Range<u32> {
        self.light.light_rows()
    }

    /// Sets the elements of row `v` of the light, finite and not negative, for the next [`update`](Self::update).
    ///
    /// # Panics
    /// If the row has another width than the light plane.
    pub fn set_light_row(&mut self, v: u32, elements: &[[f32; 4]]) {
        self.light.set_row(v, elements);
    }

    /// Relights the blocks in view that are out of date.
    pub fn update(&mut self, executor: &impl Executor) {
        let mut stale = Vec::new();
        for (i, (block, is_stale)) in
            (self.blocks.blocks.iter().zip(&mut self.is_stale)).enumerate()
        {
            let [u, v] = block.at;
            let (columns, rows) = (u..u + self.footprint, v..v + self.footprint);
            *is_stale |= self.light.has_changed(columns, rows);
            if *is_stale && block.spans.iter().any(|span| span.is_in(&self.view)) {
                *is_stale = false;
                stale.push(i);
            }
        }
        let this = &*self;
        executor.map(stale.len(), |i| {
            let mut scratch = lock(&this.scratch_pool).pop();
            SimdLevel::widest().run(BlockRelightKernel {
                relighter: this,
                block: stale[i],
                scratch: &mut scratch,
            });
            lock(&this.scratch_pool).extend(scratch);
        });
        self.light.clear_changes();
    }

    /// Frees the memory that is kept from frame to frame to compute in.
    pub fn release_scratch(&self) {
        *lock(&self.scratch_pool) = Vec::new();
    }

    #[inline(always)]
    fn relight_block<S: Simd>(
        &self,
        simd: S,
        index: usize,
        scratch: &mut Option<CorrelationScratch>,
    ) {
        let block = &self.blocks.blocks[index];
        let mut pixels = self.pixels[index]
            .write()
            .unwrap_or_else(PoisonError::into_inner);
        let mut computed = Vec::new();
        let linear = P::linear(&mut pixels, &mut computed);
        self.compute(simd, block, scratch, linear);
        let spans = block.spans.iter().map(|span| (span.pixel, span.range()));
        P::store(&self.encoder, &computed, spans, &mut pixels);
    }

    /// Relights a block.
    #[inline(always)]
    fn compute<S: Simd>(
        &self,
        simd: S,
        block: &OriginBlock,
        scratch: &mut Option<CorrelationScratch>,
        linear: &mut [LinearPixel],
    ) {
        let [u, v] = block.at;
        let row = |r: usize| &self.light.elements_from(u, v + r)[..self.footprint];
        let chroma = LightChroma::of_rows((0..self.footprint).map(row));
        if chroma.is_dark() {
            linear.fill([0.0; CHANNELS]);
            return;
        }
        let mut has_factored = false;
        for span in &block.spans {
            match is_factored(self.tile(span)) {
                true => has_factored = true,
                false => linear[span.range()].fill([0.0; CHANNELS]),
            }
        }
        if let Some(correlator) = &self.correlator
            && has_factored
        {
            let scratch = scratch.get_or_insert_with(|| correlator.scratch());
            let quads = self.quads;
            let texels = correlator.correlate(simd, row, chroma.channels(), quads, scratch);
            let response = OriginBlockResponse {
                texels,
                quads,
                chroma,
            };
            for span in &block.spans {
                let tile = self.tile(span);
                if is_factored(tile) {
                    let offsets = &block.offsets[span.range()];
                    let out = &mut linear[span.range()];
                    combine(simd, &tile.coefficients, span.first, offsets, response, out);
                }
            }
        }
        self.add_direct(block, linear);
    }

    #[inline(always)]
    fn add_direct(&self, block: &OriginBlock, linear: &mut [[f32; CHANNELS]]) {
        let [u, v] = block.at;
        for span in &block.spans {
            let functions = &self.tile(span).functions;
            if functions.is_dark() {
                continue;
            }
            let offsets = &block.offsets[span.range()];
            let pixels = entries_by_pixel(&functions.entries[span.first_entry..]);
            let linear = linear[span.range()].iter_mut().zip(offsets);
            for ((y, offset), entries) in linear.zip(pixels) {
                let offset = usize::from(*offset);
                let (column, row) = (offset % self.blocks.side, offset / self.blocks.side);
                let light = self.light.elements_from(u + column, v + row);
                let sum = windowed_sum(entries, light, &self.slot_offsets);
                (0..CHANNELS).for_each(|c| y[c] += sum[c] * functions.step[c]);
            }
        }
    }

    fn tile(&self, span: &PixelSpan) -> &Tile {
        &self.transport.tiles[span.tile]
    }

    fn for_each_span(&self, rows: Range<u32>, mut visit: impl FnMut(&PixelSpan, &[P])) {
        for (block, pixels) in self.blocks.blocks.iter().zip(&self.pixels) {
            let pixels = pixels.read().unwrap_or_else(PoisonError::into_inner);
            for span in &block.spans {
                if rows.contains(&span.pixel.y) {
                    visit(span, &pixels[span.range()]);
                }
            }
        }
    }
}

impl LinearRelighter {
    /// The picture in linear light, in units of the measurement.
    pub fn linear(&self) -> LinearPicture {
        let camera = self.transport.geometry.camera;
        let mut picture = LinearPicture::filled(camera, [0.0; 4]);
        self.for_each_span(0..camera.height, |span, linear| {
            let first = camera.index(span.pixel);
            let pixels = &mut picture.pixels[first..first + span.length];
            for (y, &[r, g, b]) in pixels.iter_mut().zip(linear) {
                *y = [r, g, b, 0.0];
            }
        });
        picture
    }

    /// The picture after an output transform.
    pub fn picture(&self, output: &OutputTransform, executor: &impl Executor) -> Rgba8Picture {
        let camera = self.transport.geometry.camera;
        let mut picture = Rgba8Picture::filled(camera, [0, 0, 0, 255]);
        self.encode_rows(output, 0..camera.height, &mut picture.pixels, executor);
        picture
    }

    /// Writes rows of the picture after an output transform. Pixels out of view may be black.
    ///
    /// # Panics
    /// If `out` is not as large as the rows.
    pub fn encode_rows(
        &self,
        output: &OutputTransform,
        rows: Range<u32>,
        out: &mut [[u8; 4]],
        executor: &impl Executor,
    ) {
        let width = self.transport.geometry.camera.width as usize;
        assert_eq!(out.len(), rows.len() * width, "pixels of the rows");
        let encoder = TabulatedOutputTransform::new(output);
        // Locked one by one, as threads share them.
        let strips: Vec<_> = out
            .chunks_mut((STRIP_ROWS * width).max(1))
            .map(Mutex::new)
            .collect();
        executor.map(strips.len(), |i| {
            let out = &mut *lock(&strips[i]);
            out.fill([0, 0, 0, 255]);
            let first = rows.start + (i * STRIP_ROWS) as u32;
            let end = first + (out.len() / width) as u32;
            self.for_each_span(first..end, |span, linear| {
                if !span.is_in(&self.view) {
                    return;
                }
                let at = (span.pixel.y - first) as usize * width + span.pixel.x as usize;
                encoder.encode(linear, span.pixel, &mut out[at..at + span.length]);
            });
        });
    }
}

impl EncodedRelighter {
    /// Sets the output transform, without which the picture is black; pixels follow with the next
    /// [`update`](Self::update).
    pub fn set_output(&mut self, output: &OutputTransform) {
        if PixelEncoder::set(&mut self.encoder, output) {
            self.is_stale.fill(true);
        }
    }

    /// Copies rows of the picture to `out`. Pixels out of view may be those of an earlier light.
    ///
    /// # Panics
    /// If `out` is not as large as the rows.
    pub fn copy_rows(&self, rows: Range<u32>, out: &mut [EncodedPixel]) {
        let width = self.transport.geometry.camera.width as usize;
        assert!(out.len() == rows.len() * width, "pixels of the rows");
        out.fill(EncodedPixel::DARK);
        let first = rows.start;
        self.for_each_span(rows, |span, pixels| {
            let at = (span.pixel.y - first) as usize * width + span.pixel.x as usize;
            out[at..at + span.length].copy_from_slice(pixels);
        });
    }
}

struct BlockRelightKernel<'a, P: StoredPixel> {
    relighter: &'a CpuRelighter<P>,
    block: usize,
    scratch: &'a mut Option<CorrelationScratch>,
}

impl<P: StoredPixel> SimdKernel for BlockRelightKernel<'_, P> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.relighter.relight_block(simd, self.block, self.scratch);
    }
}

/// A direct pixel's `Σ_s code(s) p(o_n + s)` in each channel, over the slots with entries. `light` begins with the
/// window's first element.
#[inline(always)]
fn windowed_sum(entries: &[FunctionEntry], light: &[[f32; 4]], slot_offsets: &[u32]) -> [f32; 4] {
    let mut sum = [0.0f32; 4];
    for entry in entries {
        let element = light[slot_offsets[entry_slot(entry)] as usize];
        // The fourth lane, a slot, is computed because four are one instruction.
        for c in 0..4 {
            sum[c] += f32::from(entry[c]) * element[c];
        }
    }
    sum
}

fn is_factored(tile: &Tile) -> bool {
    !tile.coefficients.is_dark()
}

/// Locks whatever a panic on another thread has left: everything behind these locks is written before it is read.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
