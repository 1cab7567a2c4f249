//! Relighting on the CPU: square by square of the light plane, and of the squares only those in
//! which the light has changed.
//!
//! A square's light is correlated with the basis ([`correlation`]), and the pixels that look at the
//! square are combined from that while it is in the cache ([`combine`]). Elements that a tile has
//! besides are summed one by one ([`direct`]).
//!
//! Single precision: what is seen of a square is exact to about a millionth of its brightest element.

mod combine;
mod correlation;
mod direct;
mod fft;
mod lanes;
mod padded;
mod squares;

use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};

use super::display::Encoder;
use super::{Display, Light, LinearPicture, Rgba8Picture, Tint, detailed};
use crate::executor::Executor;
use crate::transport::{CHANNELS, Tile, Transport};
use correlation::{Correlator, Workspace};
use lanes::{Vector, Work, widest};
pub use padded::LightRows;
use padded::PaddedLight;
use squares::{Run, Square, Squares};

/// The kernel this build uses.
pub const KERNEL: &str = if cfg!(all(target_arch = "wasm32", target_feature = "simd128")) {
    "simd128"
} else if cfg!(target_arch = "wasm32") {
    "scalar"
} else {
    "native"
};

/// One photograph, ready to be relit.
#[derive(Debug)]
pub struct Relighter {
    transport: Arc<Transport>,
    /// None where no tile has coefficients.
    correlator: Option<Correlator>,
    squares: Squares,
    light: PaddedLight,
    /// Of each square's pixels; in a lock of its own for threads to share the squares out.
    linear: Vec<RwLock<Vec<[f32; CHANNELS]>>>,
    /// Of components, in fours, those that are used.
    quads: usize,
    /// Whether all has to be done anew, whatever of the light has changed.
    stale: bool,
    /// Of threads that are not at work, kept from frame to frame.
    spare: Mutex<Vec<Workspace>>,
}

impl Relighter {
    /// Plans the work. All is dark until the first light.
    pub fn new(transport: Arc<Transport>) -> Self {
        let geometry = &transport.geometry;
        let bounds = squares::bounds(geometry);
        let factored = transport
            .tiles
            .iter()
            .any(|tile| !tile.coefficients.is_dark());
        let (across, down) = (bounds.columns.len(), bounds.rows.len());
        let correlator =
            factored.then(|| Correlator::new(&transport.basis, geometry.window, across, down));
        let reach = correlator
            .as_ref()
            .map_or(squares::DIRECT_REACH, Correlator::reach);
        let squares = Squares::new(&transport, &bounds, reach);
        let light = PaddedLight::new(
            geometry.light,
            squares.origin,
            squares.seen(geometry.window.side() as usize),
        );
        let dark = |square: &Square| RwLock::new(vec![[0.0; CHANNELS]; square.places.len()]);
        Self {
            linear: squares.all.iter().map(dark).collect(),
            quads: correlator.as_ref().map_or(0, Correlator::quads),
            stale: false,
            correlator,
            squares,
            spare: Mutex::default(),
            light,
            transport,
        }
    }

    /// What is relit.
    pub fn transport(&self) -> &Transport {
        &self.transport
    }

    /// Uses the first of the components only, a share of them of 0 to 1, from the next light or
    /// [`update`](Self::update) on. They come in fours, of which there is always one.
    pub fn set_detail(&mut self, share: f32) {
        let all = self.correlator.as_ref().map_or(0, Correlator::quads);
        let quads = detailed(all, share);
        self.stale |= quads != self.quads;
        self.quads = quads;
    }

    /// Takes a light in the place of the last one; does only what its changes ask for.
    ///
    /// # Panics
    /// If the light's extent is not the transport's.
    pub fn relight(&mut self, light: &Light, executor: &impl Executor) {
        let extent = self.transport.geometry.light;
        assert_eq!(light.extent(), extent, "a light of another extent");
        self.relight_rows(light, executor);
    }

    /// Rows of the light that any pixel sees.
    pub fn light_rows(&self) -> Range<u32> {
        self.light.rows_seen()
    }

    /// [`relight`](Self::relight) by each of the [`light_rows`](Self::light_rows), asked for from the
    /// first on.
    ///
    /// # Panics
    /// If a row has another width.
    pub fn relight_rows(&mut self, light: impl LightRows, executor: &impl Executor) {
        self.light.put(light);
        self.update(executor);
    }

    /// Does what [`set_detail`](Self::set_detail) asks for under the light that is there.
    pub fn update(&mut self, executor: &impl Executor) {
        let side = self.squares.reach + self.transport.geometry.window.side() as usize - 1;
        let stale: Vec<usize> = (0..self.squares.all.len())
            .filter(|&i| {
                let [u, v] = self.squares.all[i].at;
                self.stale || self.light.changed(u..u + side, v..v + side)
            })
            .collect();
        let this = &*self;
        executor.map(stale.len(), |i| {
            let mut work = lock(&this.spare).pop();
            widest(SquareWork {
                relighter: this,
                square: stale[i],
                work: &mut work,
            });
            lock(&this.spare).extend(work);
        });
        self.stale = false;
        self.light.settle();
    }

    #[inline(always)]
    fn relight_square<V: Vector>(&self, i: usize, work: &mut Option<Workspace>) {
        let square = &self.squares.all[i];
        let mut linear = self.linear[i]
            .write()
            .unwrap_or_else(PoisonError::into_inner);
        let [u, v] = square.at;
        let side = self.squares.reach + self.transport.geometry.window.side() as usize - 1;
        let rows = (v..v + side).map(|v| &self.light.row(u, v)[..side]);
        let tint = Tint::of(rows);
        let is_factored = |run: &Run| !self.tile(run).coefficients.is_dark();
        if tint.is_dark() {
            linear.fill([0.0; CHANNELS]);
            return;
        }
        for run in square.runs.iter().filter(|run| !is_factored(run)) {
            linear[run.begin..run.begin + run.length].fill([0.0; CHANNELS]);
        }
        if let Some(correlator) = &self.correlator
            && square.runs.iter().any(is_factored)
        {
            let work = work.get_or_insert_with(|| correlator.workspace());
            let quads = self.quads;
            let row = |r: usize| &self.light.row(u, v + r)[..side];
            let texels = correlator.correlate::<V>(row, tint.channels(), quads, work);
            let from = combine::Seen {
                texels,
                quads,
                tint,
            };
            for run in square.runs.iter().filter(|run| is_factored(run)) {
                let tile = &self.tile(run).coefficients;
                let places = &square.places[run.begin..run.begin + run.length];
                let linear = &mut linear[run.begin..run.begin + run.length];
                combine::combine::<V>(tile, run.first, places, from, linear);
            }
        }
        let window = self.transport.geometry.window.side() as usize;
        for run in &square.runs {
            let tile = &self.tile(run).functions;
            if tile.is_dark() {
                continue;
            }
            for at in 0..run.length {
                let place = usize::from(square.places[run.begin + at]);
                let (column, row) = (place % self.squares.reach, place / self.squares.reach);
                let seen = self.light.elements_from(u + column, v + row);
                let sum = direct::sum(tile, run.first + at, seen, window, self.light.stride());
                let y = &mut linear[run.begin + at];
                (0..CHANNELS).for_each(|c| y[c] += sum[c]);
            }
        }
    }

    fn tile(&self, run: &Run) -> &Tile {
        &self.transport.tiles[run.tile]
    }

    /// The picture, in units of the measurement.
    pub fn linear(&self) -> LinearPicture {
        let mut picture = LinearPicture::black(self.transport.geometry.camera);
        let camera = self.transport.geometry.camera;
        self.for_each_run(0..camera.height, |run, linear| {
            let at = camera.index(run.pixel);
            for (y, &[r, g, b]) in picture.pixels[at..at + run.length].iter_mut().zip(linear) {
                *y = [r, g, b, 0.0];
            }
        });
        picture
    }

    /// The picture as a display shows it.
    pub fn picture(&self, display: &Display, executor: &impl Executor) -> Rgba8Picture {
        let mut picture = Rgba8Picture::black(self.transport.geometry.camera);
        self.show(
            display,
            0..picture.extent.height,
            &mut picture.pixels,
            executor,
        );
        picture
    }

    /// These rows of the picture, as a display shows them.
    ///
    /// # Panics
    /// If `out` has not as many pixels.
    pub fn show(
        &self,
        display: &Display,
        rows: Range<u32>,
        out: &mut [[u8; 4]],
        executor: &impl Executor,
    ) {
        let width = self.transport.geometry.camera.width as usize;
        assert_eq!(out.len(), rows.len() * width, "pixels of other rows");
        let encoder = Encoder::new(display);
        // A lock for each, as threads share them out.
        let bands: Vec<_> = out
            .chunks_mut((BAND_ROWS * width).max(1))
            .map(Mutex::new)
            .collect();
        executor.map(bands.len(), |i| {
            let first = rows.start + (i * BAND_ROWS) as u32;
            self.show_band(&encoder, first, &mut lock(&bands[i]));
        });
    }

    fn show_band(&self, encoder: &Encoder, first: u32, out: &mut [[u8; 4]]) {
        let width = self.transport.geometry.camera.width as usize;
        let end = first + (out.len() / width) as u32;
        out.fill([0, 0, 0, 255]);
        self.for_each_run(first..end, |run, linear| {
            let at = (run.pixel.y - first) as usize * width + run.pixel.x as usize;
            encoder.encode(linear, run.pixel, &mut out[at..at + run.length]);
        });
    }

    fn for_each_run(&self, rows: Range<u32>, mut each: impl FnMut(&Run, &[[f32; CHANNELS]])) {
        for (square, linear) in self.squares.all.iter().zip(&self.linear) {
            let linear = linear.read().unwrap_or_else(PoisonError::into_inner);
            for run in square.runs.iter().filter(|run| rows.contains(&run.pixel.y)) {
                each(run, &linear[run.begin..run.begin + run.length]);
            }
        }
    }
}

/// Rows that are encoded at a time.
pub const BAND_ROWS: usize = 64;

/// A square to relight.
struct SquareWork<'a> {
    relighter: &'a Relighter,
    square: usize,
    work: &'a mut Option<Workspace>,
}

impl Work for SquareWork<'_> {
    #[inline(always)]
    fn run<V: Vector>(self) {
        self.relighter.relight_square::<V>(self.square, self.work);
    }
}

/// What is written whole, whatever became of another thread.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
