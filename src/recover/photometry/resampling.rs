//! Equations of photographs that were taken from slightly different places, as if all were taken from one.
//!
//! A photograph whose picture is shifted by d measures `S(pT)`, where S interpolates the picture at shifted places. Its
//! equations are resampled, not the photograph: `y' = y − (S − I) ŷ`, with the picture ŷ that all other photographs
//! predict (leave-one-out, as in [`equations`](super::equations)). So nothing of y is interpolated, and what the
//! prediction lacks counts by the small operator `S − I` only. The predictions follow from photographs that are
//! corrected so far; in the first rounds, photographs count less the larger their shift is.

use std::sync::OnceLock;

use super::window_covariance::WindowModel;
use super::{CalibratedMeasurements, PhotographCorrection};
use crate::capture::Measurements;
use crate::linalg::{self, vectorise};
use crate::recover::sampling::{self, MAX_SMALL_PICTURE, PixelsSharingWindow};
use crate::transport::{CHANNELS, CameraPixel, Extent, Geometry, LightElement, TileRect};

/// Largest shift that is undone, in camera pixels.
pub(super) const MAX_SHIFT: f64 = 0.75;
/// Rounds of prediction and correction. A third would gain less than a decibel of the photographs' SNR.
const ROUNDS: u32 = 2;
/// Camera pixels on either side of a place that interpolation uses.
const RADIUS: u32 = 4;
/// Distance from a pixel, in camera pixels, of the measurements that its resampled ones depend on.
pub(in crate::recover) const HALO: u32 = ROUNDS * RADIUS;
/// Variance of what a shift of one pixel changes, relative to brightness, by which its photograph counts less in the first
/// round; and its share in the next.
const SHIFT_VARIANCE: f64 = 0.05;
const VARIANCE_DECAY: f64 = 0.1;
/// Distance, in light elements, between the windows whose covariance predicts those around them too: computing it takes
/// most of the time.
const SPACING: i32 = 3;
/// Least side of such windows. A smaller one would lose too much of a function that is one element further.
const MIN_SHARING_SIDE: u32 = 11;
/// Pixels of the picture for each of its sampled squares up to which it is resampled as a whole.
const MAX_PIXELS_PER_SQUARE: usize = 160;
/// Variance of what no function explains, relative to brightness.
const UNEXPLAINED_VARIANCE: f64 = 1e-4;
/// Most camera pixels that preparing a recovery uses, in blocks of [`SMALL_BLOCK_SIDE`]: 64 training regions with their
/// neighbours touch 16 blocks each, 96 validated squares 9, and 176 other squares one.
const MAX_PREPARED_PIXELS: usize = 2064 * (SMALL_BLOCK_SIDE * SMALL_BLOCK_SIDE) as usize;
/// Side of a block in camera pixels: of a picture that may be resampled whole, and of a larger one.
const BLOCK_SIDE: u32 = Geometry::DEFAULT_TILE_SIDE;
pub(in crate::recover) const SMALL_BLOCK_SIDE: u32 = 8;
/// All of a small picture is loaded. (Of a larger one, what [`preparation_pixels`](super::super::preparation_pixels) lists.)
const _: () = assert!(MAX_PREPARED_PIXELS <= MAX_SMALL_PICTURE);

/// Upper bound on the memory that the samples of a picture take while a recovery from so many photographs is prepared, in
/// bytes.
pub(in crate::recover) fn max_prepared_bytes(photographs: usize) -> usize {
    MAX_PREPARED_PIXELS * photographs * size_of::<[f32; CHANNELS]>()
}

/// Upper bound on the memory that resampling takes for a tile of so many photographs with a border of `halo`, in bytes:
/// photographs as corrected, as predicted in both rounds (an allocator may keep the first), and the samples.
pub(in crate::recover) fn max_tile_bytes(photographs: usize, halo: u32) -> usize {
    let side = (Geometry::DEFAULT_TILE_SIDE + 2 * (halo + HALO)) as usize;
    side * side * photographs * (3 * size_of::<[f64; CHANNELS]>() + size_of::<[f32; CHANNELS]>())
}

/// The measurements, and the estimates that resampling depends on.
#[derive(Clone, Copy, Debug)]
pub(in crate::recover) struct ResamplingInput<'a> {
    pub measurements: &'a Measurements,
    pub corrections: &'a [PhotographCorrection],
    pub geometry: &'a Geometry,
    /// `[slot]`.
    pub mean_function: &'a [f64],
    /// [`Photometry::softness`](super::Photometry::softness).
    pub softness: f64,
    /// The photographs that belong to the capture; others are not resampled.
    pub used: &'a [usize],
    /// Whether every window has a covariance of its own in the last round. Estimates of shifts do not need it.
    pub is_exact: bool,
}

/// The samples of a region as if taken from one place, block by block when they are first needed.
#[derive(Debug)]
pub(in crate::recover) struct ResampledPhotographs<'a> {
    input: ResamplingInput<'a>,
    rect: TileRect,
    block: Extent,
    /// Samples, `[pixel, L, channel]`.
    blocks: Vec<OnceLock<Vec<f32>>>,
}

impl<'a> ResampledPhotographs<'a> {
    /// The region `rect` as one block. `None` if no photograph is shifted.
    pub fn of_region(input: ResamplingInput<'a>, rect: TileRect) -> Option<Self> {
        Self::new(input, rect, rect.extent)
    }

    /// The whole picture. `None` if no photograph is shifted.
    pub fn of_picture(input: ResamplingInput<'a>) -> Option<Self> {
        let rect = TileRect {
            x: 0,
            y: 0,
            extent: input.measurements.camera,
        };
        let side = match rect.extent.area() <= MAX_PREPARED_PIXELS {
            true => BLOCK_SIDE,
            false => SMALL_BLOCK_SIDE,
        };
        Self::new(input, rect, Extent::new(side, side))
    }

    /// The whole picture, if resampling it takes less time than `squares` small squares of it, each with its own border.
    pub fn of_small_picture(input: ResamplingInput<'a>, squares: usize) -> Option<Self> {
        let is_small = input.measurements.camera.area() <= squares * MAX_PIXELS_PER_SQUARE;
        is_small.then(|| Self::of_picture(input)).flatten()
    }

    fn new(input: ResamplingInput<'a>, rect: TileRect, block: Extent) -> Option<Self> {
        let corrections = input.used.iter().map(|&l| input.corrections.get(l));
        let is_shifted = corrections
            .flatten()
            .any(|correction| correction.is_shifted());
        let (columns, rows) = blocks(rect, block);
        is_shifted.then(|| Self {
            input,
            rect,
            block,
            blocks: (0..columns * rows).map(|_| OnceLock::new()).collect(),
        })
    }

    /// Channel `c` of a pixel under pattern `l`; NaN if saturated, not loaded or outside the region.
    pub fn sample(&self, l: usize, CameraPixel { x, y }: CameraPixel, c: usize) -> f64 {
        let TileRect {
            x: left,
            y: top,
            extent,
        } = self.rect;
        let is_inside =
            (left..left + extent.width).contains(&x) && (top..top + extent.height).contains(&y);
        if !is_inside {
            return f64::NAN;
        }
        let (x, y) = (x - left, y - top);
        let (column, row) = (x / self.block.width, y / self.block.height);
        let (columns, _) = blocks(self.rect, self.block);
        let rect = self.block_rect(column, row);
        let samples = self.blocks[(row * columns + column) as usize]
            .get_or_init(|| self.input.resample(rect));
        let (x, y) = (x + left - rect.x, y + top - rect.y);
        let pixel = (y * rect.extent.width + x) as usize;
        let patterns = self.input.measurements.patterns.len();
        f64::from(samples[(pixel * patterns + l) * CHANNELS + c])
    }

    fn block_rect(&self, column: u32, row: u32) -> TileRect {
        let TileRect { x, y, extent } = self.rect;
        let (dx, dy) = (column * self.block.width, row * self.block.height);
        let extent = Extent::new(
            self.block.width.min(extent.width - dx),
            self.block.height.min(extent.height - dy),
        );
        TileRect {
            x: x + dx,
            y: y + dy,
            extent,
        }
    }
}

/// Columns and rows of blocks in a region.
fn blocks(rect: TileRect, block: Extent) -> (u32, u32) {
    let columns = rect.extent.width.div_ceil(block.width);
    (columns, rect.extent.height.div_ceil(block.height))
}

impl<'a> ResamplingInput<'a> {
    /// The measurements as they are corrected, and `resampled` if that is something.
    pub fn calibrated(
        self,
        resampled: Option<&'a ResampledPhotographs<'a>>,
    ) -> CalibratedMeasurements<'a> {
        CalibratedMeasurements::new(self.measurements, self.corrections).with_resampled(resampled)
    }

    /// The corrected samples of a region, `[pixel, L, channel]`; NaN where saturated.
    fn resample(&self, rect: TileRect) -> Vec<f32> {
        let measurements = self.calibrated(None);
        let camera = self.measurements.camera;
        let with_margin = |margin: u32| sampling::with_margin(camera, rect, margin);
        let region = with_margin(HALO);
        let mut corrected = Vec::with_capacity(self.used.len());
        for &l in self.used {
            let mut photograph = Vec::with_capacity(region.extent.area() * CHANNELS);
            for pixel in region.pixels() {
                (0..CHANNELS)
                    .for_each(|c| photograph.push(measurements.sample_or_white(l, pixel, c)));
            }
            corrected.push(photograph);
        }
        let mut shift_variance = SHIFT_VARIANCE;
        for round in 0..ROUNDS {
            let inner = with_margin((ROUNDS - round) * RADIUS);
            let target = with_margin((ROUNDS - round - 1) * RADIUS);
            let variance = |&l: &usize| {
                let [x, y] = self.corrections[l].shift;
                UNEXPLAINED_VARIANCE + shift_variance * (x * x + y * y)
            };
            let variances: Vec<f64> = self.used.iter().map(variance).collect();
            let is_narrow = self.geometry.window.side() < MIN_SHARING_SIDE;
            let is_exact = is_narrow || self.is_exact && round + 1 == ROUNDS;
            let spacing = if is_exact { 1 } else { SPACING };
            let predicted = vectorise(
                #[cfg_attr(target_arch = "x86_64", inline(always))]
                || {
                    self.predict(
                        &measurements,
                        &corrected,
                        region,
                        inner,
                        &variances,
                        spacing,
                    )
                },
            );
            for (i, &l) in self.used.iter().enumerate() {
                if self.corrections[l].is_shifted() {
                    let shift = self.corrections[l].shift;
                    let taps = shift.map(|d| taps(d, self.softness));
                    let changes = shift_changes(&predicted[i], inner, target, taps);
                    for (pixel, change) in target.pixels().zip(&changes) {
                        let n = index_in(region, pixel);
                        for c in 0..CHANNELS {
                            let measured = measurements.sample_or_white(l, pixel, c);
                            corrected[i][n + c] = measured - change[c];
                        }
                    }
                }
            }
            shift_variance *= VARIANCE_DECAY;
        }
        let patterns = self.measurements.patterns.len();
        let mut resampled = Vec::with_capacity(rect.extent.area() * patterns * CHANNELS);
        for pixel in rect.pixels() {
            let n = index_in(region, pixel);
            for l in 0..patterns {
                for c in 0..CHANNELS {
                    resampled.push(measurements.sample(l, pixel, c) as f32);
                }
            }
            let samples = resampled.len() - patterns * CHANNELS;
            for (&l, photograph) in self.used.iter().zip(&corrected) {
                for c in 0..CHANNELS {
                    let sample = &mut resampled[samples + l * CHANNELS + c];
                    if sample.is_finite() {
                        *sample = photograph[n + c] as f32;
                    }
                }
            }
        }
        resampled
    }

    /// Leave-one-out predictions of every photograph in the region `inner`, `[L][pixel, channel]`, from photographs
    /// `[L][pixel, channel]` of `region`, with covariances of windows at distances of `spacing`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn predict(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        photographs: &[Vec<f64>],
        region: TileRect,
        inner: TileRect,
        variances: &[f64],
        spacing: i32,
    ) -> Vec<Vec<f64>> {
        let mut predicted = vec![vec![0.0; inner.extent.area() * CHANNELS]; photographs.len()];
        let nearest = |pixel| {
            let LightElement { v, u } = self.geometry.window_origin(pixel);
            let [v, u] = [v, u].map(|i| i.div_euclid(spacing) * spacing + spacing / 2);
            LightElement { v, u }
        };
        for (origin, pixels) in sampling::pixels_by_origin(inner, nearest) {
            for (plane, channels) in measurements.planes() {
                let model = WindowModel::new(
                    measurements,
                    self.geometry,
                    self.mean_function,
                    origin,
                    plane,
                    self.used,
                );
                let pixels: &PixelsSharingWindow = &pixels;
                let samples = pixels
                    .iter()
                    .flat_map(|&(p, pixel)| {
                        let channels = channels.clone();
                        channels.map(move |c| (p * CHANNELS + c, index_in(region, pixel) + c))
                    })
                    .collect::<Vec<_>>();
                predict_window(&model, photographs, &samples, variances, &mut predicted);
            }
        }
        predicted
    }
}

/// Predicts the samples of a window, given as their indices in `predicted` and in `photographs`. What the model cannot
/// predict, as off the light plane, stays as it is.
#[cfg_attr(target_arch = "x86_64", inline(always))]
fn predict_window(
    model: &WindowModel,
    photographs: &[Vec<f64>],
    samples: &[(usize, usize)],
    variances: &[f64],
    predicted: &mut [Vec<f64>],
) {
    let count = photographs.len();
    let level = model.means.iter().sum::<f64>() / count as f64;
    let inverse = model.inverse_covariance(|i| variances[i]);
    let mut solved = vec![0.0; count];
    for &(to, from) in samples {
        let y: Vec<f64> = photographs
            .iter()
            .map(|photograph| photograph[from])
            .collect();
        let brightness = sampling::mean(&y) / level;
        let residual: Vec<f64> = y
            .iter()
            .zip(&model.means)
            .map(|(y, mean)| y - brightness * mean)
            .collect();
        match &inverse {
            Some(inverse) if brightness > 0.0 && brightness.is_finite() => {
                linalg::multiply_vector(inverse, &residual, &mut solved);
                for i in 0..count {
                    predicted[i][to] = y[i] - solved[i] / inverse[i * count + i];
                }
            }
            _ => (0..count).for_each(|i| predicted[i][to] = y[i]),
        }
    }
}

/// What a shift by the taps along x and y changes of the picture `[pixel, channel]` of the region `inner`, in the region
/// `target` inside it.
/// Beyond the border of the picture its last pixels repeat.
fn shift_changes(
    picture: &[f64],
    inner: TileRect,
    target: TileRect,
    [(x_taps, x_first), (y_taps, y_first)]: [Taps; 2],
) -> Vec<[f64; CHANNELS]> {
    let (width, height) = (
        i64::from(inner.extent.width),
        i64::from(inner.extent.height),
    );
    // Along the rows of `inner` first, at the columns of `target`.
    let columns = target.x - inner.x..target.x - inner.x + target.extent.width;
    let mut rows = Vec::with_capacity((height * columns.len() as i64) as usize);
    for y in 0..height {
        for x in columns.clone() {
            let mut sum = [0.0; CHANNELS];
            for (k, weight) in x_taps.iter().enumerate() {
                let x = (i64::from(x) + x_first + k as i64).clamp(0, width - 1);
                let n = (y * width + x) as usize * CHANNELS;
                (0..CHANNELS).for_each(|c| sum[c] += weight * picture[n + c]);
            }
            rows.push(sum);
        }
    }
    let mut changes = Vec::with_capacity(target.extent.area());
    for pixel in target.pixels() {
        let (x, y) = (pixel.x - target.x, i64::from(pixel.y - inner.y));
        let n = index_in(inner, pixel);
        let mut change: [f64; CHANNELS] = std::array::from_fn(|c| -picture[n + c]);
        for (k, weight) in y_taps.iter().enumerate() {
            let y = (y + y_first + k as i64).clamp(0, height - 1);
            let row = &rows[y as usize * columns.len() + x as usize];
            (0..CHANNELS).for_each(|c| change[c] += weight * row[c]);
        }
        changes.push(change);
    }
    changes
}

/// Number of pixels that interpolation takes along one axis.
const TAPS: usize = 2 * RADIUS as usize;

/// Weights that interpolate along one axis, and the distance of the first of their pixels.
type Taps = ([f64; TAPS], i64);

/// Interpolates at a place shifted by `-d`. How a picture changes when the camera moves depends on its sharpness, and on
/// earlier interpolation. At a `softness` of 0 by the cardinal cubic spline (Unser, Splines: a perfect fit for
/// signal and image processing, 1999), cut off where it has fallen to a hundredth, which suits a smooth picture; at ½ by
/// cubic convolution (Keys 1981); at 1 by a straight line, which suits edges sharper than the pixels. Between them by the
/// parabola through these three.
fn taps(d: f64, softness: f64) -> Taps {
    let cell = (-d).floor();
    let fraction = -d - cell;
    let first = 1 - i64::from(RADIUS);
    let mut taps: [f64; TAPS] = std::array::from_fn(|k| {
        let x = fraction - (first + k as i64) as f64;
        let line = (1.0 - x.abs()).max(0.0);
        let (rest, twice) = (1.0 - softness, 2.0 * softness);
        rest * ((1.0 - twice) * cardinal_spline(x) + 2.0 * twice * cubic_convolution(x))
            - softness * (1.0 - twice) * line
    });
    let sum: f64 = taps.iter().sum();
    taps.iter_mut().for_each(|tap| *tap /= sum);
    (taps, cell as i64 + first)
}

fn cubic_convolution(x: f64) -> f64 {
    let x = x.abs();
    let beyond = ((2.0 - x).max(0.0) * (1.0 - x)).min(0.0) * (2.0 - x);
    let line = (1.0 - x).max(0.0);
    0.5 * beyond + line * (1.0 + x - 1.5 * x * x)
}

fn cardinal_spline(x: f64) -> f64 {
    /// Pole of the filter that turns samples into spline coefficients.
    const POLE: f64 = -0.267_949_192_431_122_7;
    const GAIN: f64 = -6.0 * POLE / (1.0 - POLE * POLE);
    let nearest = x.floor();
    let mut sum = 0.0;
    // Other B-splines are zero at x.
    for k in [nearest - 1.0, nearest, nearest + 1.0, nearest + 2.0] {
        let distance = (x - k).abs();
        let b_spline = match 2.0 - distance {
            _ if distance < 1.0 => 2.0 / 3.0 - distance * distance * (1.0 - distance / 2.0),
            rest => rest * rest * rest / 6.0,
        };
        let mut coefficient = GAIN;
        (0..k.abs() as u32).for_each(|_| coefficient *= POLE);
        sum += coefficient * b_spline;
    }
    sum
}

/// Index of a pixel's first channel in a region, `[pixel, channel]`.
fn index_in(rect: TileRect, pixel: CameraPixel) -> usize {
    let row = (pixel.y - rect.y) as usize * rect.extent.width as usize;
    (row + (pixel.x - rect.x) as usize) * CHANNELS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_follows_a_smooth_curve_and_keeps_samples() {
        let (still, first) = taps(0.0, 0.3);
        for (k, tap) in still.iter().enumerate() {
            let expected = if k as i64 + first == 0 { 1.0 } else { 0.0 };
            assert!((tap - expected).abs() < 1e-12, "{still:?}");
        }
        for d in [-0.6, -0.2, 0.05, 0.5] {
            let value = |softness: f64, curve: &dyn Fn(f64) -> f64| -> f64 {
                let (taps, first) = taps(d, softness);
                let values = taps.iter().enumerate();
                values
                    .map(|(k, tap)| tap * curve((first + k as i64) as f64))
                    .sum()
            };
            let curve = |x: f64| (0.9 * x + 0.4).sin();
            let smooth = value(0.0, &curve);
            assert!((smooth - curve(-d)).abs() < 0.006, "{d}: {smooth}");
            // Cubic convolution is exact for parabolas.
            let parabola = |x: f64| 0.3 * x * x - x;
            assert!((value(0.5, &parabola) - parabola(-d)).abs() < 1e-12, "{d}");
            let edge = |x: f64| if x > 0.5 { 1.0 } else { 0.0 };
            let soft = value(1.0, &edge);
            assert!((soft - (-d).max(0.0)).abs() < 1e-12, "{d}: {soft}");
        }
    }
}
