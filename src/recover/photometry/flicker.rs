//! Whether the light flickers.
//!
//! The mains modulate many lamps, and a shutter exposes one row of a picture after the other: every photograph has bright and
//! dark bands of its own. Each photograph is predicted from all others (leave-one-out, as in
//! [`equations`](super::equations)), and regression of the prediction errors on the predictions gives the exposure of each
//! band of rows, relative to the rest, and of each band of columns. Functions that differ from the model cause errors along
//! both axes alike; flicker does along one.

use super::equations::for_scaled_pixels;
use super::resampling::{ResampledPhotographs, ResamplingInput};
use crate::job_executor::Executor;
use crate::linalg;
use crate::recover::mean_function;
use crate::transport::TileRect;

/// Most bands that the picture is divided into, their least width in camera pixels, and their least number.
const MAX_BANDS: u32 = 16;
const MIN_BAND_WIDTH: u32 = 4;
const MIN_BANDS: u32 = 8;
/// Ratio of the mean squared errors of bands along both axes that is flicker.
const MIN_RATIO: f64 = 1.6;
/// Least amplitude that is told.
const MIN_AMPLITUDE: f64 = 0.003;

/// Bands of exposure that differ from photograph to photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flicker {
    /// Amplitude of the exposure along the picture, relative to its mean.
    pub amplitude: f64,
    /// Whether the camera exposes one column after the other, as if it were turned; otherwise one row.
    pub is_along_rows: bool,
}

/// Sums over the pixels of a square, for each photograph: prediction errors times predictions, and squared predictions.
type SquareSums = Vec<[f64; 2]>;

/// Looks for flicker in the photographs that `input` uses. `None` if there is none, or too little is measured to tell.
pub(in crate::recover) fn find(
    input: ResamplingInput<'_>,
    executor: &impl Executor,
) -> Option<Flicker> {
    let measurements = input.measurements;
    let bands = measurements.camera.width.min(measurements.camera.height) / MIN_BAND_WIDTH;
    let bands = bands.min(MAX_BANDS);
    if input.mean_function.is_empty() || bands < MIN_BANDS {
        return None;
    }
    let squares = mean_function::sample_squares(measurements.camera);
    let picture = ResampledPhotographs::of_small_picture(input, squares.len());
    let sums_of = |i: usize| square_sums(input, picture.as_ref(), squares[i]);
    let sums = executor.map(squares.len(), sums_of);
    let across = |square: &TileRect| square.x * bands / measurements.camera.width;
    let down = |square: &TileRect| square.y * bands / measurements.camera.height;
    let [rows, columns] = [
        BandErrors::new(&squares, &sums, bands, down),
        BandErrors::new(&squares, &sums, bands, across),
    ];
    let is_along_rows = columns.mean_square > rows.mean_square;
    let (stronger, weaker) = match is_along_rows {
        true => (columns, rows),
        false => (rows, columns),
    };
    // A sine wave has half its squared amplitude as variance.
    let variance = (stronger.mean_square - weaker.mean_square) / stronger.mean_weight;
    let amplitude = (2.0 * variance).sqrt();
    let is_flicker = stronger.mean_square > MIN_RATIO * weaker.mean_square;
    (is_flicker && amplitude > MIN_AMPLITUDE).then_some(Flicker {
        amplitude,
        is_along_rows,
    })
}

/// Errors of the exposures of all bands and photographs.
struct BandErrors {
    /// Mean of squared exposures, each times the squared predictions of its band: without flicker, the same whatever the
    /// band.
    mean_square: f64,
    /// Mean of these squared predictions.
    mean_weight: f64,
}

impl BandErrors {
    /// For bands along one axis; `band` gives that of a square.
    fn new(
        squares: &[TileRect],
        sums: &[SquareSums],
        bands: u32,
        band: impl Fn(&TileRect) -> u32,
    ) -> Self {
        let patterns = sums.first().map_or(0, Vec::len);
        let (mut mean_square, mut mean_weight, mut count) = (0.0, 0.0, 0.0);
        for l in 0..patterns {
            let mut of_bands = vec![[0.0; 2]; bands as usize];
            let mut total = [0.0; 2];
            for (square, sums) in squares.iter().zip(sums) {
                let own = &mut of_bands[band(square) as usize];
                for k in 0..2 {
                    own[k] += sums[l][k];
                    total[k] += sums[l][k];
                }
            }
            // Relative to the exposure of the whole photograph.
            let exposure = total[0] / total[1];
            for [product, weight] in of_bands {
                if weight > 0.0 {
                    mean_square += (product - exposure * weight).powi(2) / weight;
                    mean_weight += weight;
                    count += 1.0;
                }
            }
        }
        Self {
            mean_square: mean_square / count,
            mean_weight: mean_weight / count,
        }
    }
}

fn square_sums(
    input: ResamplingInput<'_>,
    picture: Option<&ResampledPhotographs<'_>>,
    square: TileRect,
) -> SquareSums {
    let count = input.used.len();
    let mut sums = vec![[0.0; 2]; count];
    let mut solved = vec![0.0; count];
    for_scaled_pixels(input, picture, square, |_, window, pixels| {
        for pixel in pixels {
            let residual = pixel.residual(&window.model.means);
            linalg::multiply_vector(&window.inverse, &residual, &mut solved);
            for (i, [product, weight]) in sums.iter_mut().enumerate() {
                let error = solved[i] / window.inverse[i * count + i];
                let predicted = pixel.y[i] - error;
                *product += error * predicted;
                *weight += predicted * predicted;
            }
        }
    });
    sums
}
