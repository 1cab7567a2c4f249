//! Why a whole capture does not follow from its patterns: a sequence that slipped, a map that is mirrored or turned, a
//! camera that moved.
//!
//! All three are found by correlation. Divided by the brightness of their pixel, photographs are correlated over sampled
//! pixels with what every pattern would give through a small blob of light around the correspondence. For most objects
//! the blob is crude, but a photograph correlates with its own pattern far better than with any other.

use super::mean_function;
use super::photometry;
use super::preparation_input;
use crate::capture::Measurements;
use crate::job_executor::{Cancelled, Executor};
use crate::linalg::median;
use crate::transport::{
    CHANNELS, CameraPixel, Correspondence, Extent, LightElement, LightPosition, Window,
};

/// Median correlation of photographs with their patterns above which a correspondence is right; it is 0.2 to 0.7, and 0.01
/// where photographs show other patterns.
const MIN_CORRELATION: f64 = 0.1;
/// Correlation of a photograph with the pattern that it resembles most, below which it resembles none.
const MIN_BEST_CORRELATION: f64 = 0.06;
/// Fewest photographs whose correlations say something.
const MIN_PHOTOGRAPHS: usize = 12;
/// Share of the photographs before a slip or move, and of those after it, that must be as the diagnosis says.
const MIN_EXPLAINED_SHARE: f64 = 0.8;
/// Fewest photographs that slipped or were taken after a move.
const MIN_AFFECTED: usize = 3;
/// Positions by which a sequence may have slipped.
const MAX_SLIP: isize = 3;
/// Largest move in camera pixels along each axis.
const MAX_MOVE: i32 = 8;
/// Pixels so near to the sampled ones are loaded, too.
const _: () = assert!(MAX_MOVE as u32 <= photometry::HALO);
/// Radius of the blob in light elements, and its standard deviation.
const BLOB_RADIUS: i32 = 3;
const BLOB_SIGMA: f64 = 1.2;

/// A fault of a capture as a whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CaptureFault {
    /// From photograph `first` on, each shows the pattern of the shot that is listed `by` positions later (earlier if
    /// negative).
    Slipped {
        /// Index in the measurements.
        first: usize,
        /// Positions in the list of all shots.
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

    /// The correspondence after the change.
    pub fn of_correspondence(
        self,
        light: Extent,
        correspondence: &Correspondence,
    ) -> Correspondence {
        let reversed = [self.is_mirrored, self.is_flipped];
        correspondence.turned(light, self.is_transposed, reversed)
    }
}

/// Looks for a cause that explains most photographs. `shots` are the positions of the measurements' patterns in the list of
/// all shots, and `ignored` the measurements that are left out. `None` if there is no such cause, or too little is measured
/// to tell.
///
/// # Errors
/// [`Cancelled`].
pub fn diagnose(
    measurements: &Measurements,
    window: Window,
    shots: &[usize],
    ignored: &[usize],
    executor: &impl Executor,
) -> Result<Option<CaptureFault>, Cancelled> {
    let used: Vec<usize> = (0..shots.len()).filter(|l| !ignored.contains(l)).collect();
    if used.len() < MIN_PHOTOGRAPHS || preparation_input::geometry(measurements, window).is_err() {
        return Ok(None);
    }
    let squares = mean_function::sample_squares(measurements.camera);
    let pixels = squares.into_iter().flat_map(|square| square.pixels());
    let search = Search {
        measurements,
        shots,
        used,
        pixels: pixels.collect(),
        executor,
    };
    let photographs = search.relative_measurements();
    let responses = search.relative_responses(&measurements.correspondence);
    executor.check_cancelled()?;
    if let Some(fault) = search.slipped(&photographs, &responses) {
        return Ok(Some(fault));
    }
    executor.check_cancelled()?;
    if let Some(fault) = search.wrong_correspondence(&photographs, &responses) {
        return Ok(Some(fault));
    }
    executor.check_cancelled()?;
    Ok(search.moved(&responses))
}

/// The measurements that a cause is searched in.
struct Search<'a, E> {
    measurements: &'a Measurements,
    shots: &'a [usize],
    /// The photographs that are looked at, by their indices in the measurements. Lists `[L]` are of these.
    used: Vec<usize>,
    /// The pixels that are looked at.
    pixels: Vec<CameraPixel>,
    executor: &'a E,
}

impl<E: Executor> Search<'_, E> {
    /// Sum over the channels of a photograph's sample; NaN where one is not measured.
    fn sample(&self, l: usize, pixel: CameraPixel) -> f64 {
        let samples = (0..CHANNELS).map(|c| self.measurements.sample(l, pixel, c));
        samples.sum()
    }

    /// `[L][pixel]`: each photograph relative to the mean of all, less 1; 0 where a sample is not measured.
    fn relative_measurements(&self) -> Vec<Vec<f64>> {
        let count = self.used.len();
        relative(count, self.pixels.len(), |i, n| {
            self.sample(self.used[i], self.pixels[n])
        })
    }

    /// `[L][pixel]`: the light of each pattern around a pixel's place by `correspondence`, relative to the mean over the
    /// patterns, less 1.
    fn relative_responses(&self, correspondence: &Correspondence) -> Vec<Vec<f64>> {
        let light = self.measurements.light;
        let mut blobs: Vec<Vec<(usize, f64)>> = Vec::with_capacity(self.pixels.len());
        for pixel in &self.pixels {
            let LightPosition { u, v } = correspondence.at(*pixel);
            let mut blob = Vec::new();
            let range = -BLOB_RADIUS..=BLOB_RADIUS;
            for (dv, du) in range
                .clone()
                .flat_map(|dv| range.clone().map(move |du| (dv, du)))
            {
                let element = LightElement {
                    u: u.floor() as i32 + du,
                    v: v.floor() as i32 + dv,
                };
                if let Some(m) = element.index_in(light) {
                    let x = f64::from(element.u) + 0.5 - u;
                    let y = f64::from(element.v) + 0.5 - v;
                    let weight = libm::exp(-0.5 * (x * x + y * y) / (BLOB_SIGMA * BLOB_SIGMA));
                    blob.push((m, weight));
                }
            }
            blobs.push(blob);
        }
        let emission = |l: usize, m: usize| -> f64 {
            let pattern = &self.measurements.patterns[l];
            (0..CHANNELS).map(|c| f64::from(pattern.plane(c)[m])).sum()
        };
        relative(self.used.len(), self.pixels.len(), |i, n| {
            let blob = blobs[n].iter();
            blob.map(|&(m, weight)| weight * emission(self.used[i], m))
                .sum()
        })
    }

    /// Finds where photographs begin to show other patterns of the sequence.
    fn slipped(&self, photographs: &[Vec<f64>], responses: &[Vec<f64>]) -> Option<CaptureFault> {
        let count = self.used.len();
        let shot = |i: usize| self.shots[self.used[i]];
        // The shot whose pattern a photograph resembles most.
        let best = self.executor.map(count, |i| {
            let correlations = (0..count).map(|k| (correlation(&photographs[i], &responses[k]), k));
            let best = correlations.fold((MIN_BEST_CORRELATION, None), |best, (value, k)| {
                if value > best.0 {
                    (value, Some(shot(k)))
                } else {
                    best
                }
            });
            best.1
        });
        let mut found = None;
        let mut most = 0;
        for by in (-MAX_SLIP..=MAX_SLIP).filter(|by| *by != 0) {
            // Patterns of shots that are held out cannot be recognised.
            let expected = |i: usize| shot(i).checked_add_signed(by);
            let is_listed = |i: usize| (0..count).any(|k| Some(shot(k)) == expected(i));
            let knowable: Vec<usize> = (0..count).filter(|&i| is_listed(i)).collect();
            for first in 0..count {
                let before = (0..first).filter(|&i| best[i] == Some(shot(i))).count();
                let after = knowable.iter().filter(|&&i| i >= first);
                let right = after
                    .clone()
                    .filter(|&&i| best[i].is_some() && best[i] == expected(i));
                let (after, right) = (after.count(), right.count());
                let is_explained =
                    right >= MIN_AFFECTED && is_most(right, after) && is_most(before, first);
                if is_explained && before + right > most {
                    most = before + right;
                    let first = self.used[first];
                    found = Some(CaptureFault::Slipped { first, by });
                }
            }
        }
        found
    }

    /// Finds the symmetry of the light plane after which photographs show their patterns.
    fn wrong_correspondence(
        &self,
        photographs: &[Vec<f64>],
        responses: &[Vec<f64>],
    ) -> Option<CaptureFault> {
        let typical = |responses: &[Vec<f64>]| {
            let pairs = photographs.iter().zip(responses);
            let correlations: Vec<f64> = pairs.map(|(a, b)| correlation(a, b)).collect();
            median(&correlations)
        };
        let light = self.measurements.light;
        let symmetries: Vec<LightPlaneSymmetry> = LightPlaneSymmetry::all(light).collect();
        let correlations = self.executor.map(symmetries.len(), |i| {
            let changed = symmetries[i].of_correspondence(light, &self.measurements.correspondence);
            (typical(&self.relative_responses(&changed)), symmetries[i])
        });
        let best = correlations
            .into_iter()
            .reduce(|best, other| if other.0 > best.0 { other } else { best })?;
        let is_right = best.0 > MIN_CORRELATION && best.0 > 2.0 * typical(responses);
        is_right.then_some(CaptureFault::Correspondence(best.1))
    }

    /// Finds when the picture shifted, by whole pixels.
    fn moved(&self, responses: &[Vec<f64>]) -> Option<CaptureFault> {
        let count = self.used.len();
        let quarter = count / 4;
        [(0..quarter, false), (count - quarter..count, true)]
            .into_iter()
            .filter_map(|(reference, is_end)| {
                let shifts = self.shifts(responses, reference);
                // Of the other end of the session.
                let shift = match is_end {
                    true => most_frequent(&shifts[..quarter]),
                    false => most_frequent(&shifts[count - quarter..]),
                };
                let are = |range: &[[i32; 2]], shift: [i32; 2]| {
                    range.iter().filter(|other| **other == shift).count()
                };
                let candidates = (MIN_AFFECTED..=count - MIN_AFFECTED).map(|first| {
                    let (before, after) = shifts.split_at(first);
                    let [still, moved] = if is_end {
                        [after, before]
                    } else {
                        [before, after]
                    };
                    let right = [are(still, [0, 0]), are(moved, shift)];
                    let is_explained =
                        is_most(right[0], still.len()) && is_most(right[1], moved.len());
                    (if is_explained { right[0] + right[1] } else { 0 }, first)
                });
                let best = candidates.fold(
                    (0, 0),
                    |best, other| if other.0 > best.0 { other } else { best },
                );
                let shift = if is_end { shift.map(|d| -d) } else { shift };
                let first = self.used[best.1];
                (shift != [0, 0] && best.0 > 0).then_some(CaptureFault::Moved { first, shift })
            })
            .next()
    }

    /// The shift of every photograph relative to the place of `reference`, the photographs that tell the object's
    /// brightness.
    fn shifts(&self, responses: &[Vec<f64>], reference: std::ops::Range<usize>) -> Vec<[i32; 2]> {
        let brightness = |&pixel: &CameraPixel| -> f64 {
            reference
                .clone()
                .map(|i| self.sample(self.used[i], pixel))
                .sum()
        };
        let brightness: Vec<f64> = self.pixels.iter().map(brightness).collect();
        let camera = self.measurements.camera;
        self.executor.map(self.used.len(), |i| {
            let pairs = brightness.iter().zip(&responses[i]);
            let predicted: Vec<f64> = pairs.map(|(f, response)| f * (1.0 + response)).collect();
            let range = -MAX_MOVE..=MAX_MOVE;
            let shifts = range
                .clone()
                .flat_map(|y| range.clone().map(move |x| [x, y]));
            let mut best = (0.0, [0, 0]);
            for [dx, dy] in shifts {
                let samples = self.pixels.iter().map(|pixel| {
                    let x = pixel.x.checked_add_signed(dx)?;
                    let y = pixel.y.checked_add_signed(dy)?;
                    let is_inside = x < camera.width && y < camera.height;
                    is_inside.then(|| self.sample(self.used[i], CameraPixel { x, y }))
                });
                let value = centred_correlation(samples, &predicted);
                if value > best.0 {
                    best = (value, [dx, dy]);
                }
            }
            best.1
        })
    }
}

fn is_most(right: usize, of: usize) -> bool {
    right as f64 >= MIN_EXPLAINED_SHARE * of as f64
}

/// The shift of most.
fn most_frequent(shifts: &[[i32; 2]]) -> [i32; 2] {
    let count = |shift: &[i32; 2]| shifts.iter().filter(|other| *other == shift).count();
    let counted = shifts.iter().map(|shift| (count(shift), *shift));
    counted
        .fold(
            (0, [0, 0]),
            |best, other| if other.0 > best.0 { other } else { best },
        )
        .1
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

/// Correlation of a photograph with a pattern's responses, both relative; 0 where not measured.
fn correlation(photograph: &[f64], response: &[f64]) -> f64 {
    // A dark pixel's ratios are mostly noise.
    let samples = photograph
        .iter()
        .map(|&y| (y != 0.0).then(|| y.clamp(-1.0, 1.0)));
    centred_correlation(samples, response)
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
    use crate::job_executor::SequentialExecutor;
    use crate::recover::test_problems::SyntheticCapture;

    const PATTERNS: usize = 40;

    fn fault(change: impl FnOnce(&mut Measurements)) -> Option<CaptureFault> {
        let mut capture = SyntheticCapture::with_variation(PATTERNS, 0.1);
        change(&mut capture.measurements);
        diagnose_shots(&capture, &(0..PATTERNS).collect::<Vec<_>>())
    }

    fn diagnose_shots(capture: &SyntheticCapture, shots: &[usize]) -> Option<CaptureFault> {
        let window = capture.geometry.window;
        let executor = &SequentialExecutor;
        let fault = diagnose(&capture.measurements, window, shots, &[], executor);
        fault.unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn a_clean_capture_has_no_fault() {
        assert_eq!(fault(|_| {}), None);
        // Nor is one found where photographs show nothing that is known.
        let reversed = |measurements: &mut Measurements| measurements.photos.reverse();
        assert_eq!(fault(reversed), None);
    }

    #[test]
    fn a_few_wrong_photographs_are_no_fault_of_the_capture() {
        for (a, b) in [(3, 5), (36, 39), (38, 39), (0, 3)] {
            let swap = |measurements: &mut Measurements| measurements.photos.swap(a, b);
            assert_eq!(fault(swap), None);
        }
        for l in [0, 20, 39] {
            let other = |measurements: &mut Measurements| measurements.photos[l].reverse();
            assert_eq!(fault(other), None);
            let shifted = |measurements: &mut Measurements| measurements.photos[l].rotate_right(1);
            assert_eq!(fault(shifted), None);
        }
    }

    #[test]
    fn a_slip_is_told_in_positions_of_all_shots() {
        // Every tenth shot is held out.
        let shots: Vec<usize> = (0..PATTERNS).map(|l| l + l / 9).collect();
        for (first, by) in [(10, 1), (10, 3), (0, 2), (20, -2)] {
            let mut capture = SyntheticCapture::with_variation(PATTERNS, 0.1);
            let photos = capture.measurements.photos.clone();
            for (l, &shot) in shots.iter().enumerate().filter(|(_, shot)| **shot >= first) {
                let shown = shot
                    .checked_add_signed(by)
                    .and_then(|shown| shots.iter().position(|s| *s == shown));
                // The photograph of a pattern that is held out, which resembles none.
                capture.measurements.photos[l] = match shown {
                    Some(k) => photos[k].clone(),
                    None => photos[l].iter().rev().copied().collect(),
                };
            }
            let Some(CaptureFault::Slipped {
                first: l,
                by: found,
            }) = diagnose_shots(&capture, &shots)
            else {
                panic!("{first} {by}");
            };
            assert_eq!((shots[l], found), (first, by));
        }
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
                let correspondence = measurements.correspondence.clone();
                measurements.correspondence =
                    symmetry.of_correspondence(measurements.light, &correspondence);
                right = Some((correspondence, measurements.correspondence.clone()));
            };
            let Some(CaptureFault::Correspondence(found)) = fault(change) else {
                panic!("{symmetry:?} is not found");
            };
            let (correspondence, wrong) = right.unwrap();
            let put_right = found.of_correspondence(Extent::new(16, 16), &wrong);
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
