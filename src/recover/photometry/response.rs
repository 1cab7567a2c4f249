//! Whether the responses of display and camera are as declared.
//!
//! A wrong response makes photographs less predictable from one another. For each hypothesis, every photograph is
//! predicted from all others (leave-one-out, as in [`equations`](super::equations)), and the energy of the prediction
//! errors is compared with that of the differences between photographs, square by square of the picture. The measurements
//! are those before photometric correction, which would take part of a wrong response for exposure and stray light.

use super::CalibratedMeasurements;
use super::equations::{MAX_PHOTOGRAPHS, for_largest_window};
use super::flood_shortfall;
use super::resampling::ResamplingInput;
use super::window_covariance::{MODEL_VARIANCE, UNEXPLAINED_VARIANCE, WindowModel};
use crate::capture::{CameraResponse, Measurements, Pattern};
use crate::job_executor::{Cancelled, Executor};
use crate::linalg::{self, vectorise};
use crate::recover::{mean_function, sampling};
use crate::transport::{Geometry, LightElement, TileRect};

/// Squares of the picture that are compared.
const MAX_SQUARES: usize = 64;
/// Fewest squares and photographs that tell a response.
const MIN_SQUARES: usize = 16;
const MIN_PHOTOGRAPHS: usize = 24;
/// Logarithm of the ratio of neighbouring exponents, or ratios of slopes, of the search, and their range.
const LOG_STEP: f64 = 0.1;
const MAX_LOG_PARAMETER: f64 = 1.25;
/// Rounds of parabolic interpolation.
const REFINEMENTS: usize = 5;
/// Logarithm of the smallest exponent, or ratio of slopes, that is told.
const MIN_LOG_PARAMETER: f64 = 0.01;
/// Fall of the logarithm of the relative prediction error that is worth a trial, and the standard errors by which it must
/// differ from zero.
const MIN_IMPROVEMENT: f64 = 0.01;
const MIN_SIGNIFICANCE: f64 = 4.0;
/// Fall of the same logarithm by which another curve must explain the photographs better than that of sRGB, which is
/// likelier.
const MIN_ADVANTAGE_OVER_SRGB: f64 = 0.3;

/// A response that explains the photographs better than the declared one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ResponseHypothesis {
    /// The display emits the declared emission to this power.
    Display {
        /// The exponent.
        exponent: f64,
    },
    /// Light is the declared measurement, linearised by this response.
    Camera(CameraResponse),
}

use ResponseHypothesis as Hypothesis;

/// Looks for responses with which the photographs `used` predict one another better than with the declared one, the best
/// first; `mean_function` is `[slot]`, smoothed, and `flood_white` the measurement at which the flood photograph is white.
/// Empty if there is none, or too little is measured to tell.
///
/// # Errors
/// [`Cancelled`].
pub(in crate::recover) fn find(
    measurements: &Measurements,
    geometry: &Geometry,
    mean_function: &[f64],
    used: &[usize],
    flood_white: f64,
    executor: &impl Executor,
) -> Result<Vec<ResponseHypothesis>, Cancelled> {
    let squares = mean_function::sample_squares(measurements.camera);
    let step = squares.len().div_ceil(MAX_SQUARES).max(1);
    let squares: Vec<TileRect> = squares.into_iter().step_by(step).collect();
    if squares.len() < MIN_SQUARES || !(MIN_PHOTOGRAPHS..=MAX_PHOTOGRAPHS).contains(&used.len()) {
        return Ok(Vec::new());
    }
    let search = ResponseSearch {
        measurements: CalibratedMeasurements::uncorrected(measurements),
        geometry,
        mean_function,
        used,
        flood_white,
        squares,
        executor,
    };
    search.run()
}

impl ResponseHypothesis {
    /// Whether it differs from the declared response by more than estimates are accurate.
    fn is_far(self) -> bool {
        match self {
            Self::Display {
                exponent: parameter,
            }
            | Self::Camera(
                CameraResponse::Gamma(parameter) | CameraResponse::Compression(parameter),
            ) => libm::log(parameter).abs() > MIN_LOG_PARAMETER,
            Self::Camera(_) => true,
        }
    }
}

struct ResponseSearch<'a, E> {
    measurements: CalibratedMeasurements<'a>,
    geometry: &'a Geometry,
    mean_function: &'a [f64],
    used: &'a [usize],
    flood_white: f64,
    squares: Vec<TileRect>,
    executor: &'a E,
}

/// A hypothesis with the logarithm of each square's relative prediction error.
#[derive(Clone)]
struct Scored {
    hypothesis: Hypothesis,
    scores: Vec<f64>,
}

impl Scored {
    /// The mean over the squares that are measured.
    fn mean(&self) -> f64 {
        let measured = self.scores.iter().filter(|score| score.is_finite());
        let (sum, count) = measured.fold((0.0, 0.0), |(sum, n), score| (sum + score, n + 1.0));
        sum / count
    }

    /// Whether the relative prediction errors are significantly lower than those of `declared`.
    fn is_better_than(&self, declared: &Self) -> bool {
        let pairs = self.scores.iter().zip(&declared.scores);
        let falls: Vec<f64> = pairs
            .map(|(own, other)| other - own)
            .filter(|fall| fall.is_finite())
            .collect();
        let count = falls.len() as f64;
        let mean = falls.iter().sum::<f64>() / count;
        let variance =
            falls.iter().map(|fall| (fall - mean).powi(2)).sum::<f64>() / (count * (count - 1.0));
        falls.len() >= MIN_SQUARES
            && mean > MIN_IMPROVEMENT
            && mean > MIN_SIGNIFICANCE * variance.sqrt()
    }
}

impl<E: Executor> ResponseSearch<'_, E> {
    fn run(&self) -> Result<Vec<Hypothesis>, Cancelled> {
        let declared = Hypothesis::Camera(CameraResponse::Linear);
        let declared = self.score(declared);
        let camera = |exponent| Hypothesis::Camera(CameraResponse::Gamma(exponent));
        let mut candidates = vec![self.best_parameter(&declared, camera)?];
        let patterns = &self.measurements.patterns;
        if patterns.iter().any(Pattern::has_grey_levels) {
            let display = |exponent| Hypothesis::Display { exponent };
            candidates.push(self.best_parameter(&declared, display)?);
        }
        // A curve of compressed highlights resembles a power, of either.
        if candidates.iter().any(|c| c.is_better_than(&declared)) {
            candidates.push(self.best_compression(&declared)?);
        }
        // Only a curve of about this exponent can be that of sRGB.
        if let Hypothesis::Camera(CameraResponse::Gamma(1.4..)) = candidates[0].hypothesis {
            let srgb = self.score(Hypothesis::Camera(CameraResponse::Srgb));
            let is_of_camera = |c: &Scored| matches!(c.hypothesis, Hypothesis::Camera(_));
            let of_camera = candidates.iter().filter(|c| is_of_camera(c));
            let best = of_camera.map(Scored::mean).fold(f64::INFINITY, f64::min);
            if srgb.mean() < best + MIN_ADVANTAGE_OVER_SRGB {
                candidates.retain(|c| !is_of_camera(c));
                candidates.push(srgb);
            }
        }
        candidates.retain(|scored| scored.hypothesis.is_far() && scored.is_better_than(&declared));
        let order = linalg::ascending_order(candidates.iter().map(Scored::mean));
        let hypotheses = order.into_iter().map(|i| candidates[i].hypothesis);
        Ok(hypotheses.collect())
    }

    /// If the flood photograph tells compressed highlights, it does so best.
    fn best_compression(&self, declared: &Scored) -> Result<Scored, Cancelled> {
        let camera = |slope| Hypothesis::Camera(CameraResponse::Compression(slope));
        let input = ResamplingInput {
            measurements: &self.measurements,
            corrections: &[],
            geometry: self.geometry,
            mean_function: self.mean_function,
            softness: 0.0,
            used: self.used,
            is_exact: true,
        };
        let shortfall = flood_shortfall::find(input, self.flood_white, self.executor);
        let slope = shortfall.and_then(|shortfall| shortfall.compression);
        let scored = slope.map(|slope| self.score(camera(slope)));
        if let Some(scored) = scored.filter(|scored| scored.is_better_than(declared)) {
            return Ok(scored);
        }
        self.best_parameter(declared, camera)
    }

    /// The exponent, or ratio of slopes, with the lowest prediction errors: by steps as long as these fall, then by parabolas
    /// through the three best.
    fn best_parameter(
        &self,
        declared: &Scored,
        hypothesis: impl Fn(f64) -> Hypothesis,
    ) -> Result<Scored, Cancelled> {
        let at = |log: f64| (log, self.score(hypothesis(libm::exp(log))));
        let mut points = vec![at(-LOG_STEP), (0.0, declared.clone()), at(LOG_STEP)];
        let mut step = LOG_STEP;
        loop {
            let lowest = lowest(&points);
            let (end, next) = match lowest {
                0 => (points[0].0, points[0].0 - step),
                last if last + 1 == points.len() => (points[last].0, points[last].0 + step),
                _ => break,
            };
            let next = next.clamp(-MAX_LOG_PARAMETER, MAX_LOG_PARAMETER);
            if next == end {
                break;
            }
            self.executor.check_cancelled()?;
            points.insert(if lowest == 0 { 0 } else { points.len() }, at(next));
            step *= 1.5;
        }
        for _ in 0..REFINEMENTS {
            let lowest = lowest(&points);
            if lowest == 0 || lowest + 1 == points.len() {
                break;
            }
            let [a, b, c] =
                [lowest - 1, lowest, lowest + 1].map(|i| (points[i].0, points[i].1.mean()));
            let minimum = parabola_minimum(a, b, c);
            if (minimum - b.0).abs() < 0.1 * MIN_LOG_PARAMETER {
                break;
            }
            self.executor.check_cancelled()?;
            let place = if minimum < b.0 { lowest } else { lowest + 1 };
            points.insert(place, at(minimum));
        }
        let lowest = lowest(&points);
        Ok(points.swap_remove(lowest).1)
    }

    fn score(&self, hypothesis: Hypothesis) -> Scored {
        let scores = self.executor.map(self.squares.len(), |i| {
            let mut energies = [0.0; 2];
            for_largest_window(self.geometry, self.squares[i], |origin, pixels| {
                vectorise(
                    #[cfg_attr(target_arch = "x86_64", inline(always))]
                    || self.add_window(&mut energies, hypothesis, origin, pixels),
                );
            });
            libm::log(energies[0] / energies[1])
        });
        Scored { hypothesis, scores }
    }

    /// Adds the energies of prediction errors and of differences between photographs, relative to the brightness of each
    /// pixel.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn add_window(
        &self,
        energies: &mut [f64; 2],
        hypothesis: Hypothesis,
        origin: LightElement,
        pixels: &sampling::PixelsSharingWindow,
    ) {
        let (measurements, used) = (&self.measurements, self.used);
        let count = used.len();
        for (plane, channels) in measurements.planes() {
            let model = self.model(hypothesis, origin, plane);
            let level = sampling::mean(&model.means);
            let Some(inverse) = model.inverse_covariance(|_| UNEXPLAINED_VARIANCE) else {
                continue;
            };
            let mut solved = vec![0.0; count];
            for (&(_, pixel), c) in pixels
                .iter()
                .flat_map(|pixel| channels.clone().map(move |c| (pixel, c)))
            {
                let sample = |&l: &usize| {
                    let y = measurements.sample(l, pixel, c);
                    match hypothesis {
                        Hypothesis::Camera(response) => {
                            let white = f64::from(measurements.full_scale[l]);
                            white * response.linearise(y / white)
                        }
                        Hypothesis::Display { .. } => y,
                    }
                };
                let y: Vec<f64> = used.iter().map(sample).collect();
                let mean = sampling::mean(&y);
                let brightness = mean / level;
                // The mean is NaN if a sample is saturated.
                if !(brightness > 0.0 && brightness.is_finite()) {
                    continue;
                }
                let noise = |&l: &usize| measurements.variance(l, c, mean);
                let noise: f64 = used.iter().map(noise).sum::<f64>() / count as f64;
                let weight = 1.0 / (MODEL_VARIANCE * brightness.powi(2) + noise);
                let residual: Vec<f64> = y
                    .iter()
                    .zip(&model.means)
                    .map(|(y, m)| y - brightness * m)
                    .collect();
                linalg::multiply_vector(&inverse, &residual, &mut solved);
                for i in 0..count {
                    energies[0] += weight * (solved[i] / inverse[i * count + i]).powi(2);
                    energies[1] += weight * (y[i] - mean).powi(2);
                }
            }
        }
    }

    fn model(&self, hypothesis: Hypothesis, origin: LightElement, plane: usize) -> WindowModel {
        let (measurements, geometry, used) = (&self.measurements, &self.geometry, self.used);
        match hypothesis {
            Hypothesis::Display { exponent } => {
                let power = |e: f32| {
                    if e > 0.0 {
                        libm::exp(exponent * libm::log(f64::from(e)))
                    } else {
                        0.0
                    }
                };
                let patterns = &measurements.patterns;
                let emission = |i: usize, m: usize| power(patterns[used[i]].plane(plane)[m]) as f32;
                WindowModel::of_emissions(
                    geometry,
                    self.mean_function,
                    origin,
                    used.len(),
                    emission,
                )
            }
            Hypothesis::Camera(_) => WindowModel::new(
                measurements,
                geometry,
                self.mean_function,
                origin,
                plane,
                used,
            ),
        }
    }
}

/// Index of the point with the lowest score.
fn lowest(points: &[(f64, Scored)]) -> usize {
    let means = points.iter().map(|(_, scored)| scored.mean());
    let lowest = means
        .enumerate()
        .fold((0, f64::INFINITY), |best, (i, mean)| {
            if mean < best.1 { (i, mean) } else { best }
        });
    lowest.0
}

/// Where the parabola through three points has its minimum, the middle one being the lowest.
fn parabola_minimum((xa, ya): (f64, f64), (xb, yb): (f64, f64), (xc, yc): (f64, f64)) -> f64 {
    let (left, right) = ((xb - xa) * (yb - yc), (xb - xc) * (yb - ya));
    let curvature = left - right;
    if curvature == 0.0 {
        return xb;
    }
    xb - 0.5 * ((xb - xa) * left - (xb - xc) * right) / curvature
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::*;
    use crate::job_executor::SequentialExecutor;
    use crate::recover::{find_response, test_problems::SyntheticCapture};
    use crate::relight::srgb::srgb_encode;

    const PATTERNS: usize = 40;

    fn response(change: impl FnOnce(&mut Measurements)) -> Option<ResponseHypothesis> {
        let mut capture = SyntheticCapture::with_variation(PATTERNS, 0.1);
        change(&mut capture.measurements);
        let window = capture.geometry.window;
        let found = find_response(&capture.measurements, window, 1.0, &SequentialExecutor);
        let found = pollster::block_on(found).unwrap_or_else(|error| panic!("{error}"));
        found.first().copied()
    }

    fn change_samples(measurements: &mut Measurements, change: impl Fn(f32) -> f32) {
        for sample in measurements.photos.iter_mut().flatten() {
            *sample = sample.map(&change);
        }
    }

    #[test]
    fn a_capture_with_the_declared_responses_is_not_doubted() {
        assert_eq!(response(|_| {}), None);
        // Exposures that differ are none either.
        let jitter = |measurements: &mut Measurements| {
            for (l, photo) in measurements.photos.iter_mut().enumerate() {
                let gain = 1.0 + 0.03 * (2.4 * l as f32).sin();
                photo
                    .iter_mut()
                    .for_each(|sample| *sample = sample.map(|y| gain * y));
            }
        };
        assert_eq!(response(jitter), None);
    }

    #[test]
    fn the_exponent_of_the_display_is_found() {
        for exponent in [0.8, 1.25] {
            let found = response(|measurements| {
                for pattern in &mut measurements.patterns {
                    if let Pattern::Grey(plane) = pattern {
                        plane.iter_mut().for_each(|e| *e = e.powf(1.0 / exponent));
                    }
                }
            });
            let Some(ResponseHypothesis::Display { exponent: found }) = found else {
                panic!("{found:?}");
            };
            assert!(
                (found / f64::from(exponent) - 1.0).abs() < 0.01,
                "{found} of {exponent}"
            );
        }
    }

    #[test]
    fn the_tone_curve_of_the_camera_is_found() {
        for exponent in [0.9, 1.5, 2.4] {
            let found = response(|measurements| {
                change_samples(measurements, |y| y.powf(1.0 / exponent));
            });
            let Some(ResponseHypothesis::Camera(CameraResponse::Gamma(found))) = found else {
                panic!("{found:?}");
            };
            assert!(
                (found / f64::from(exponent) - 1.0).abs() < 0.01,
                "{found} of {exponent}"
            );
        }
        let found = response(|measurements| {
            change_samples(measurements, |y| srgb_encode(f64::from(y)) as f32);
        });
        assert_eq!(
            found,
            Some(ResponseHypothesis::Camera(CameraResponse::Srgb))
        );
    }

    #[test]
    fn compressed_highlights_are_found() {
        for slope in [1.3, 2.0] {
            let found = response(|measurements| {
                change_samples(measurements, |y| slope * y / (1.0 + (slope - 1.0) * y));
            });
            let Some(ResponseHypothesis::Camera(CameraResponse::Compression(found))) = found else {
                panic!("{found:?}");
            };
            assert!(
                (found / f64::from(slope) - 1.0).abs() < 0.02,
                "{found} of {slope}"
            );
        }
    }

    #[test]
    fn a_parabola_is_minimised() {
        let y = |x: f64| 2.0 * (x - 0.3).powi(2) + 1.0;
        let point = |x: f64| (x, y(x));
        let minimum = parabola_minimum(point(-1.0), point(0.0), point(2.0));
        assert!((minimum - 0.3).abs() < 1e-12, "{minimum}");
    }
}
