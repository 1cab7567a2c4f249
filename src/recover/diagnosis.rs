//! Why a whole capture does not follow from its patterns: a sequence that slipped, a map that is mirrored or turned, a
//! camera that moved.
//!
//! All three are found by correlation. Divided by the brightness of their pixel, photographs are correlated over sampled
//! pixels with what every pattern would give through a small blob of light around the correspondence. For most objects
//! the blob is crude, but a photograph correlates with its own pattern far better than with any other.

use super::mean_function;
use super::preparation_input;
use crate::capture::Measurements;
use crate::linalg::median;
use crate::transport::{
    CHANNELS, CameraPixel, Correspondence, Extent, LightElement, LightPosition, Window,
};

/// Median correlation of photographs with their patterns above which a correspondence is right; it is 0.2 to 0.7, and 0.01
/// where photographs show other patterns.
const MIN_CORRELATION: f64 = 0.1;
/// Share of the photographs that a diagnosis must explain.
const MIN_EXPLAINED_SHARE: f64 = 0.8;
/// Fewest photographs that slipped or were taken after a move.
const MIN_AFFECTED: usize = 3;
/// Positions by which a sequence may have slipped.
const MAX_SLIP: isize = 3;
/// Largest move in camera pixels along each axis.
const MAX_MOVE: i32 = 8;
/// Radius of the blob in light elements, and its standard deviation.
const BLOB_RADIUS: i32 = 3;
const BLOB_SIGMA: f64 = 1.2;

/// What is wrong with a capture as a whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CaptureFault {
    /// From photograph `first` on, each shows the pattern that is listed `by` positions later (earlier if negative).
    Slipped {
        /// Index in the measurements.
        first: usize,
        /// Positions.
        by: isize,
    },
    /// The correspondence is right after this change of the light plane.
    Correspondence(LightPlaneSymmetry),
    /// The camera or the object moved before photograph `first`.
    Moved {
        /// Index in the measurements.
        first: usize,
        /// By how many camera pixels the picture shifted, to the right and down.
        shift: [i32; 2],
    },
}

/// A symmetry of the light plane: `u` and `v` are exchanged first, then reversed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightPlaneSymmetry {
    /// Whether columns become rows.
    pub is_transposed: bool,
    /// Whether columns are counted from the right.
    pub is_mirrored: bool,
    /// Whether rows are counted from the bottom.
    pub is_flipped: bool,
}

impl LightPlaneSymmetry {
    /// All but the identity that map a light plane onto itself.
    fn all(light: Extent) -> impl Iterator<Item = Self> {
        let all = (1..8).map(|bits| Self {
            is_transposed: bits & 4 != 0,
            is_mirrored: bits & 1 != 0,
            is_flipped: bits & 2 != 0,
        });
        all.filter(move |symmetry| !symmetry.is_transposed || light.width == light.height)
    }

    fn apply(self, light: Extent, at: LightPosition) -> LightPosition {
        let (mut u, mut v) = (at.u, at.v);
        if self.is_transposed {
            (u, v) = (v, u);
        }
        if self.is_mirrored {
            u = f64::from(light.width) - u;
        }
        if self.is_flipped {
            v = f64::from(light.height) - v;
        }
        LightPosition { u, v }
    }

    /// The correspondence after the change.
    pub fn of_correspondence(
        self,
        light: Extent,
        correspondence: Correspondence,
    ) -> Correspondence {
        let [mut u, mut v] = correspondence.affine;
        if self.is_transposed {
            (u, v) = (v, u);
        }
        let reverse = |[x, y, shift]: [f64; 3], side: u32| [-x, -y, f64::from(side) - shift];
        if self.is_mirrored {
            u = reverse(u, light.width);
        }
        if self.is_flipped {
            v = reverse(v, light.height);
        }
        Correspondence { affine: [u, v] }
    }
}

/// Looks for a cause that explains most photographs. `None` if there is none, or too little is measured.
pub fn diagnose(measurements: &Measurements, window: Window) -> Option<CaptureFault> {
    preparation_input::geometry(measurements, window).ok()?;
    let squares = mean_function::sample_squares(measurements);
    let pixels: Vec<CameraPixel> = squares
        .into_iter()
        .flat_map(|square| square.pixels())
        .collect();
    let brightness = relative_measurements(measurements, &pixels);
    let responses = relative_responses(measurements, &pixels, |at| at);
    let count = measurements.patterns.len();
    let own: Vec<f64> = (0..count)
        .map(|l| correlation(&brightness[l], &responses[l]))
        .collect();
    slipped(&brightness, &responses)
        .or_else(|| wrong_correspondence(measurements, &pixels, &brightness, &own))
        .or_else(|| moved(measurements, &pixels, &responses))
}

/// `[L][pixel]`: all channels of each photograph relative to their mean over the photographs, less 1; 0 where a sample is
/// not measured.
fn relative_measurements(measurements: &Measurements, pixels: &[CameraPixel]) -> Vec<Vec<f64>> {
    let sample = |l: usize, pixel: CameraPixel| {
        (0..CHANNELS)
            .map(|c| measurements.sample(l, pixel, c))
            .sum::<f64>()
    };
    relative(measurements.patterns.len(), pixels.len(), |l, n| {
        sample(l, pixels[n])
    })
}

/// `[L][pixel]`: the light of each pattern around a pixel's correspondence relative to the mean over the patterns, less 1,
/// after `change` of positions on the light plane.
fn relative_responses(
    measurements: &Measurements,
    pixels: &[CameraPixel],
    change: impl Fn(LightPosition) -> LightPosition,
) -> Vec<Vec<f64>> {
    let light = measurements.light;
    let mut blobs: Vec<Vec<(usize, f64)>> = Vec::with_capacity(pixels.len());
    for pixel in pixels {
        let LightPosition { u, v } = change(measurements.correspondence.at(*pixel));
        let mut blob = Vec::new();
        for (dv, du) in (-BLOB_RADIUS..=BLOB_RADIUS)
            .flat_map(|dv| (-BLOB_RADIUS..=BLOB_RADIUS).map(move |du| (dv, du)))
        {
            let element = LightElement {
                u: u.floor() as i32 + du,
                v: v.floor() as i32 + dv,
            };
            if let Some(m) = element.index_in(light) {
                let [x, y] = [
                    f64::from(element.u) + 0.5 - u,
                    f64::from(element.v) + 0.5 - v,
                ];
                let weight = libm::exp(-0.5 * (x * x + y * y) / (BLOB_SIGMA * BLOB_SIGMA));
                blob.push((m, weight));
            }
        }
        blobs.push(blob);
    }
    let emission = |l: usize, m: usize| -> f64 {
        let pattern = &measurements.patterns[l];
        (0..CHANNELS).map(|c| f64::from(pattern.plane(c)[m])).sum()
    };
    relative(measurements.patterns.len(), pixels.len(), |l, n| {
        blobs[n]
            .iter()
            .map(|&(m, weight)| weight * emission(l, m))
            .sum()
    })
}

fn relative(patterns: usize, pixels: usize, value: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    let mut values: Vec<Vec<f64>> = (0..patterns)
        .map(|l| (0..pixels).map(|n| value(l, n)).collect())
        .collect();
    for n in 0..pixels {
        let measured = values
            .iter()
            .map(|photograph| photograph[n])
            .filter(|y| y.is_finite());
        let (sum, count) = measured.fold((0.0, 0.0), |(sum, count), y| (sum + y, count + 1.0));
        for photograph in &mut values {
            let relative = photograph[n] * count / sum - 1.0;
            photograph[n] = if relative.is_finite() { relative } else { 0.0 };
        }
    }
    values
}

/// Correlation of two lists over their values that are not zero in either.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        // A dark pixel's ratios are mostly noise.
        let a = a.clamp(-1.0, 1.0);
        ab += a * b;
        aa += a * a;
        bb += b * b;
    }
    ab / (aa * bb).sqrt().max(f64::MIN_POSITIVE)
}

/// Finds where photographs begin to show other patterns of the sequence.
fn slipped(brightness: &[Vec<f64>], responses: &[Vec<f64>]) -> Option<CaptureFault> {
    let count = brightness.len();
    let best =
        |photograph: &Vec<f64>| {
            let correlations = responses
                .iter()
                .map(|response| correlation(photograph, response));
            let best = correlations.enumerate().fold((0, 0.0), |best, other| {
                if other.1 > best.1 { other } else { best }
            });
            best.0
        };
    let best: Vec<usize> = brightness.iter().map(best).collect();
    let shows = |l: usize, by: isize| Some(best[l]) == l.checked_add_signed(by);
    let unslipped = (0..count).filter(|&l| shows(l, 0)).count();
    let mut found = None;
    let mut most = (unslipped + MIN_AFFECTED).max((MIN_EXPLAINED_SHARE * count as f64) as usize);
    for by in (-MAX_SLIP..=MAX_SLIP).filter(|by| *by != 0) {
        let mut explained = (0..count).filter(|&l| shows(l, by)).count();
        for first in 0..count {
            // Those past the end of the sequence cannot be told.
            if explained + by.unsigned_abs() > most {
                most = explained + by.unsigned_abs();
                found = Some(CaptureFault::Slipped { first, by });
            }
            explained += usize::from(shows(first, 0));
            explained -= usize::from(shows(first, by));
        }
    }
    found
}

/// Finds the symmetry of the light plane after which photographs show their patterns.
fn wrong_correspondence(
    measurements: &Measurements,
    pixels: &[CameraPixel],
    brightness: &[Vec<f64>],
    own: &[f64],
) -> Option<CaptureFault> {
    let light = measurements.light;
    let correlations = LightPlaneSymmetry::all(light).map(|symmetry| {
        let change = |at| symmetry.apply(light, at);
        let responses = relative_responses(measurements, pixels, change);
        let pairs = brightness.iter().zip(&responses);
        let correlations: Vec<f64> = pairs.map(|(a, b)| correlation(a, b)).collect();
        (median(&correlations), symmetry)
    });
    let best = correlations.reduce(|best, other| if other.0 > best.0 { other } else { best })?;
    let is_right = best.0 > MIN_CORRELATION && best.0 > 2.0 * median(own);
    is_right.then_some(CaptureFault::Correspondence(best.1))
}

/// Finds when the picture shifted, by whole pixels.
fn moved(
    measurements: &Measurements,
    pixels: &[CameraPixel],
    responses: &[Vec<f64>],
) -> Option<CaptureFault> {
    let count = responses.len();
    let quarter = count.div_ceil(4);
    let first = shifts(measurements, pixels, responses, 0..quarter);
    let last = shifts(measurements, pixels, responses, count - quarter..count);
    let negative = |[x, y]: [i32; 2]| [-x, -y];
    let moves = [(first, false), (last, true)]
        .into_iter()
        .filter_map(|(shifts, from_end)| {
            // Shifts relative to the end are those before the move, with the other sign.
            let affected = if from_end {
                &shifts[..1]
            } else {
                &shifts[count - 1..]
            };
            let shift = affected[0];
            let place = |l: usize, first: usize| match (l >= first) == from_end {
                true => [0, 0],
                false => shift,
            };
            let explained =
                |first: usize| (0..count).filter(|&l| shifts[l] == place(l, first)).count();
            let best = (MIN_AFFECTED..=count - MIN_AFFECTED)
                .map(|first| (explained(first), first))
                .fold(
                    (0, 0),
                    |best, other| if other.0 > best.0 { other } else { best },
                );
            let is_found = shift != [0, 0] && best.0 as f64 >= MIN_EXPLAINED_SHARE * count as f64;
            let shift = if from_end { negative(shift) } else { shift };
            is_found.then_some(CaptureFault::Moved {
                first: best.1,
                shift,
            })
        });
    moves.into_iter().next()
}

/// The shift of every photograph relative to the place of `reference`, the photographs that tell the object's brightness.
fn shifts(
    measurements: &Measurements,
    pixels: &[CameraPixel],
    responses: &[Vec<f64>],
    reference: std::ops::Range<usize>,
) -> Vec<[i32; 2]> {
    let sample = |l: usize, pixel: CameraPixel| measurements.sample(l, pixel, 1);
    let brightness: Vec<f64> = pixels
        .iter()
        .map(|&pixel| reference.clone().map(|l| sample(l, pixel)).sum::<f64>())
        .collect();
    let range = -MAX_MOVE..=MAX_MOVE;
    let shifts = || {
        range
            .clone()
            .flat_map(|y| range.clone().map(move |x| [x, y]))
    };
    let best = |l: usize| {
        let predicted: Vec<f64> = brightness
            .iter()
            .zip(&responses[l])
            .map(|(brightness, response)| brightness * (1.0 + response))
            .collect();
        let correlations = shifts().map(|[dx, dy]| {
            let shifted = pixels.iter().map(|pixel| {
                let (x, y) = (
                    pixel.x.checked_add_signed(dx)?,
                    pixel.y.checked_add_signed(dy)?,
                );
                let is_inside = x < measurements.camera.width && y < measurements.camera.height;
                is_inside.then(|| sample(l, CameraPixel { x, y }))
            });
            (centred_correlation(shifted, &predicted), [dx, dy])
        });
        let best = correlations.fold(
            (0.0, [0, 0]),
            |best, other| {
                if other.0 > best.0 { other } else { best }
            },
        );
        best.1
    };
    (0..responses.len()).map(best).collect()
}

/// Correlation of the samples that are measured with their predictions, both less their means.
fn centred_correlation(samples: impl Iterator<Item = Option<f64>>, predicted: &[f64]) -> f64 {
    let [mut count, mut a, mut b, mut aa, mut bb, mut ab] = [0.0; 6];
    for (sample, prediction) in samples.zip(predicted) {
        let Some(sample) = sample.filter(|sample| (sample * prediction).is_finite()) else {
            continue;
        };
        count += 1.0;
        a += sample;
        b += prediction;
        aa += sample * sample;
        bb += prediction * prediction;
        ab += sample * prediction;
    }
    let variance = |sum: f64, squares: f64| squares - sum * sum / count;
    let covariance = ab - a * b / count;
    covariance
        / (variance(a, aa) * variance(b, bb))
            .sqrt()
            .max(f64::MIN_POSITIVE)
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::*;
    use crate::recover::test_problems::SyntheticCapture;

    const PATTERNS: usize = 40;

    fn fault(change: impl FnOnce(&mut Measurements)) -> Option<CaptureFault> {
        let mut capture = SyntheticCapture::with_variation(PATTERNS, 0.1);
        change(&mut capture.measurements);
        diagnose(&capture.measurements, capture.geometry.window)
    }

    #[test]
    fn a_clean_capture_has_no_fault() {
        assert_eq!(fault(|_| {}), None);
        // Nor is one found where photographs show nothing that is known.
        let reversed = |measurements: &mut Measurements| measurements.photos.reverse();
        assert_eq!(fault(reversed), None);
    }

    #[test]
    fn a_sequence_that_slipped_is_found_with_its_place() {
        for (first, by) in [(0, 1), (12, 1), (12, 2)] {
            let slip = |measurements: &mut Measurements| {
                measurements.photos[first..].rotate_left(by);
            };
            let by = by as isize;
            assert_eq!(fault(slip), Some(CaptureFault::Slipped { first, by }));
        }
        let late = |measurements: &mut Measurements| {
            let repeated = measurements.photos[19].clone();
            measurements.photos.insert(20, repeated);
            measurements.photos.pop();
        };
        let (first, by) = (20, -1);
        assert_eq!(fault(late), Some(CaptureFault::Slipped { first, by }));
    }

    #[test]
    fn a_mirrored_or_turned_correspondence_is_put_right() {
        for symmetry in LightPlaneSymmetry::all(Extent::new(16, 16)) {
            let mut right = None;
            let change = |measurements: &mut Measurements| {
                let correspondence = measurements.correspondence;
                measurements.correspondence =
                    symmetry.of_correspondence(measurements.light, correspondence);
                right = Some((correspondence, measurements.correspondence));
            };
            let Some(CaptureFault::Correspondence(found)) = fault(change) else {
                panic!("{symmetry:?} is not found");
            };
            let (correspondence, wrong) = right.unwrap();
            let put_right = found.of_correspondence(Extent::new(16, 16), wrong);
            assert_eq!(put_right, correspondence, "{symmetry:?}");
        }
    }

    #[test]
    fn a_move_is_found_with_its_place() {
        for first in [6, 20, 34] {
            let change = |measurements: &mut Measurements| {
                for photo in &mut measurements.photos[first..] {
                    let picture = photo.clone();
                    for y in 0..30 {
                        for x in 3..32 {
                            photo[(y + 2) * 32 + x] = picture[y * 32 + x - 3];
                        }
                    }
                }
            };
            let shift = [3, 2];
            assert_eq!(fault(change), Some(CaptureFault::Moved { first, shift }));
        }
    }
}
