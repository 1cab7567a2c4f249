//! Photometry of synthetic captures whose faults are known.

use super::*;
use crate::capture::{Measurements, Pattern};
use crate::job_executor::SequentialExecutor;
use crate::linalg::cubic_convolution;
use crate::recover::error::RecoverError;
use crate::recover::holdout_split::HoldoutSplit;
use crate::recover::mean_function::mean_function;
use crate::recover::prediction::predictions;
use crate::recover::preparation_input::RecoveryPreparationInput;
use crate::recover::test_problems::{SyntheticCapture, uniform};
use crate::transport::{CHANNELS, CameraPixel, Extent, TileRect};

const PATTERNS: usize = 40;

/// Photometry of a capture after `change`. Every pixel's function differs from the mean function by a tenth.
fn photometry(change: impl FnOnce(&mut Measurements)) -> Photometry {
    let mut capture = SyntheticCapture::with_variation(PATTERNS, 0.1);
    change(&mut capture.measurements);
    photometry_of(&capture)
}

fn photometry_of(capture: &SyntheticCapture) -> Photometry {
    let measurements = CalibratedMeasurements::uncorrected(&capture.measurements);
    let preparation = RecoveryPreparationInput {
        measurements: &measurements,
        geometry: capture.geometry.clone(),
        split: &HoldoutSplit::new(&capture.measurements.patterns),
        executor: &SequentialExecutor,
    };
    let photometry = pollster::block_on(async {
        let mean = mean_function(&preparation).await?;
        Ok::<_, RecoverError>(estimate(&preparation, &mean, true).await?)
    });
    photometry.unwrap_or_else(|error| panic!("{error}"))
}

/// Replaces the samples of photograph `l`.
fn replace(measurements: &mut Measurements, l: usize, y: impl Fn(usize, usize, f32) -> f32) {
    for (n, pixel) in measurements.photos[l].iter_mut().enumerate() {
        (0..CHANNELS).for_each(|c| pixel[c] = y(n, c, pixel[c]));
    }
}

#[test]
fn a_clean_capture_is_left_as_it_is() {
    let photometry = photometry(|_| {});
    assert!(!photometry.has_changes(), "{photometry:?}");
}

#[test]
fn gains_and_stray_light_are_found() {
    let mut random = uniform(11);
    let gains: Vec<f32> = (0..PATTERNS)
        .map(|_| 1.0 + 0.06 * random() as f32)
        .collect();
    let stray = |l: usize| 0.01 * l as f32 / PATTERNS as f32;
    let photometry = photometry(|measurements| {
        for l in 0..PATTERNS {
            replace(measurements, l, |_, _, y| gains[l] * y + stray(l));
        }
    });
    assert!(photometry.faults.is_empty());
    let ratio = |l: usize| photometry.corrections[l].gain() / f64::from(gains[l]);
    for l in 0..PATTERNS {
        let gain = ratio(l) / ratio(0);
        assert!((gain - 1.0).abs() < 0.004, "photograph {l}: {gain}");
        let difference = photometry.corrections[l].stray_light() - f64::from(stray(l));
        assert!(difference.abs() < 4e-4, "photograph {l}: {difference}");
    }
}

#[test]
fn a_single_exposure_is_corrected_and_the_others_are_not() {
    let photometry = photometry(|measurements| replace(measurements, 7, |_, _, y| 0.5 * y));
    assert!(photometry.faults.is_empty());
    for (l, correction) in photometry.corrections.iter().enumerate() {
        let expected = if l == 7 { 0.5 } else { 1.0 };
        assert!(
            (correction.gain() - expected).abs() < 0.005,
            "photograph {l}: {correction:?}"
        );
    }
}

/// Shifts the pictures of a capture, with an interpolation kernel at the places of the shift.
fn shift_pictures(
    measurements: &mut Measurements,
    kernel: impl Fn(f64) -> f64,
    shift: impl Fn(usize) -> [f64; 2],
) {
    let Extent { width, height } = measurements.camera;
    for (l, photo) in measurements.photos.iter_mut().enumerate() {
        let (picture, [dx, dy]) = (photo.clone(), shift(l));
        for (n, sample) in photo.iter_mut().enumerate() {
            let (x, y) = (n as i64 % i64::from(width), n as i64 / i64::from(width));
            let mut sum = [0.0; CHANNELS];
            for (j, i) in (-3..=3).flat_map(|j| (-3..=3).map(move |i| (j, i))) {
                let weight = kernel(i as f64 + dx) * kernel(j as f64 + dy);
                let (x, y) = (
                    (x + i).clamp(0, i64::from(width) - 1),
                    (y + j).clamp(0, i64::from(height) - 1),
                );
                let source = picture[(y * i64::from(width) + x) as usize];
                (0..CHANNELS).for_each(|c| sum[c] += weight * f64::from(source[c]));
            }
            *sample = sum.map(|value| value as f32);
        }
    }
}

#[test]
fn a_camera_that_trembles_is_followed() {
    let mut random = uniform(3);
    let mut shifts: Vec<[f64; 2]> = (0..PATTERNS)
        .map(|_| [0.5 * random(), 0.5 * random()])
        .collect();
    for axis in 0..2 {
        let mean = shifts.iter().map(|shift| shift[axis]).sum::<f64>() / PATTERNS as f64;
        shifts.iter_mut().for_each(|shift| shift[axis] -= mean);
    }
    let clean = SyntheticCapture::smooth(PATTERNS).measurements;
    let mut capture = SyntheticCapture::smooth(PATTERNS);
    shift_pictures(&mut capture.measurements, cubic_convolution, |l| shifts[l]);
    let photometry = photometry_of(&capture);
    assert!(photometry.faults.is_empty(), "{:?}", photometry.faults);
    for (l, correction) in photometry.corrections.iter().enumerate() {
        for axis in 0..2 {
            let error = correction.shift[axis] - shifts[l][axis];
            assert!(error.abs() < 0.02, "photograph {l}: {error}");
        }
    }
    let used: Vec<usize> = (0..PATTERNS).collect();
    let input = photometry.resampling_input(&capture.measurements, &capture.geometry, &used);
    let rect = TileRect {
        x: 8,
        y: 8,
        extent: Extent::new(16, 16),
    };
    let (mut before, mut after) = (0.0, 0.0);
    let (picture, region) = (
        ResampledPhotographs::of_picture(input).unwrap(),
        ResampledPhotographs::of_region(input, rect).unwrap(),
    );
    for pixel in rect.pixels() {
        for l in 0..PATTERNS {
            let expected = clean.sample(l, pixel, 0);
            before += (capture.measurements.sample(l, pixel, 0) - expected).powi(2);
            after += (picture.sample(l, pixel, 0) - expected).powi(2);
            let difference = picture.sample(l, pixel, 0) - region.sample(l, pixel, 0);
            assert!(difference.abs() < 1e-6, "{difference}");
        }
    }
    assert!(after < 0.02 * before, "{}", after / before);
    let outside = CameraPixel { x: 4, y: 9 };
    assert!(region.sample(0, outside, 0).is_nan());
}

#[test]
fn pictures_interpolate_as_softly_as_their_shifts_show() {
    let softness = |kernel: fn(f64) -> f64| {
        let mut random = uniform(7);
        let mut capture = SyntheticCapture::with_variation(PATTERNS, 0.1);
        let shifts: Vec<[f64; 2]> = (0..PATTERNS)
            .map(|_| [0.6 * random(), 0.6 * random()])
            .collect();
        shift_pictures(&mut capture.measurements, kernel, |l| shifts[l]);
        photometry_of(&capture).softness
    };
    let (cubic, line) = (
        softness(cubic_convolution),
        softness(|x| (1.0 - x.abs()).max(0.0)),
    );
    assert!((cubic - 0.5).abs() < 0.15, "{cubic}");
    assert!(line > 0.8, "{line}");
}

#[test]
fn photographs_after_a_move_are_left_out() {
    let mut capture = SyntheticCapture::smooth(PATTERNS);
    let after = 24;
    shift_pictures(&mut capture.measurements, cubic_convolution, |l| {
        if l < after { [0.0; 2] } else { [0.5, -0.3] }
    });
    let faults = photometry_of(&capture).faults;
    assert_eq!(faults.len(), PATTERNS - after, "{faults:?}");
    for (i, (l, fault)) in faults.into_iter().enumerate() {
        assert_eq!(l, after + i);
        let PhotographFault::Moved { shift: [x, y] } = fault else {
            panic!("photograph {l}: {fault:?}");
        };
        assert!((x - 0.5).abs() < 0.05 && (y + 0.3).abs() < 0.05, "{x} {y}");
    }
}

#[test]
fn faults_are_told_apart() {
    let found = |change: &dyn Fn(&mut Measurements)| photometry(change).faults;
    let swapped = found(&|measurements| measurements.photos.swap(3, 8));
    let pattern_of = |other| PhotographFault::PatternOf { other };
    assert_eq!(swapped, [(3, pattern_of(8)), (8, pattern_of(3))]);

    let blend = found(&|measurements| {
        let next = measurements.photos[8].clone();
        replace(measurements, 7, |n, c, y| 0.6 * y + 0.4 * next[n][c]);
    });
    let [(7, PhotographFault::Blend { other: 8, share })] = blend[..] else {
        panic!("{blend:?}");
    };
    assert!((share - 0.4).abs() < 0.02);

    // The object of another photograph, upside down.
    let object = found(&|measurements| measurements.photos[7].reverse());
    assert_eq!(object, [(7, PhotographFault::OtherObject)]);

    // By linearity, the photograph of a pattern that is in no list.
    let pattern = found(&|measurements| {
        let [a, b, c] = [20, 25, 30].map(|l| measurements.photos[l].clone());
        replace(measurements, 7, |n, i, _| a[n][i] + b[n][i] - c[n][i]);
    });
    assert_eq!(pattern, [(7, PhotographFault::UnknownPattern)]);
}

#[test]
fn nothing_is_changed_where_too_many_photographs_seem_not_to_belong() {
    let photometry = photometry(|measurements| measurements.photos.rotate_left(1));
    assert!(photometry.faults.is_empty());
}

#[test]
fn noisy_exposures_of_one_pattern_are_no_outliers() {
    let mut random = uniform(5);
    let mut normal = move || (0..12).map(|_| random()).sum::<f64>();
    let photometry = photometry(|measurements| {
        // Every fourth pattern again, at an eighth of the exposure.
        for l in (0..PATTERNS).step_by(4) {
            measurements.patterns[l + 1] = measurements.patterns[l].clone();
            measurements.photos[l + 1] = measurements.photos[l].clone();
            measurements.full_scale[l + 1] = 8.0;
        }
        measurements.noise.gain = [1e-4; CHANNELS];
        for l in 0..PATTERNS {
            let exposure = f64::from(measurements.full_scale[l]).recip();
            for sample in measurements.photos[l].iter_mut().flatten() {
                let variance = 1e-4 * f64::from(*sample) / exposure;
                *sample += (variance.sqrt() * normal()) as f32;
            }
        }
    });
    assert!(photometry.faults.is_empty(), "{photometry:?}");
}

#[test]
fn flicker_is_found_along_the_axis_of_the_shutter() {
    let flicker = |amplitude: f32, is_turned: bool| {
        let mut capture = SyntheticCapture::with_variation(PATTERNS, 0.1);
        let width = capture.measurements.camera.width as usize;
        let mut random = uniform(3);
        for l in 0..PATTERNS {
            let phase = random() as f32;
            replace(&mut capture.measurements, l, |n, _, y| {
                let row = if is_turned { n % width } else { n / width };
                let periods = 3.0 * row as f32 / width as f32 + phase;
                y * (1.0 + amplitude * (std::f32::consts::TAU * periods).sin())
            });
        }
        let photometry = photometry_of(&capture);
        assert!(photometry.faults.is_empty(), "{photometry:?}");
        let used: Vec<usize> = (0..PATTERNS).collect();
        let input = photometry.resampling_input(&capture.measurements, &capture.geometry, &used);
        find_flicker(input, &SequentialExecutor)
    };
    assert_eq!(flicker(0.0, false), None);
    for is_turned in [false, true] {
        let found = flicker(0.02, is_turned).unwrap();
        assert_eq!(found.is_along_rows, is_turned);
        assert!((found.amplitude - 0.02).abs() < 0.005, "{found:?}");
    }
}

#[test]
fn a_flood_photograph_that_is_dimmed_tells_by_how_much() {
    let dimming = |factor: f32, stray: f32| {
        let mut capture = SyntheticCapture::with_variation(PATTERNS, 0.1);
        let lit = [Pattern::Grey(vec![1.0; capture.geometry.light.area()])];
        let flood = predictions(&capture.geometry, &lit, &capture.functions(1.0));
        let (pixels, _) = flood.as_chunks::<CHANNELS>();
        let flood = pixels.iter().map(|y| y.map(|y| factor * y as f32 + stray));
        capture.measurements.flood = Some(flood.collect());
        let photometry = photometry_of(&capture);
        let used: Vec<usize> = (0..PATTERNS).collect();
        let input = photometry.resampling_input(&capture.measurements, &capture.geometry, &used);
        let shortfall = find_flood_shortfall(input, 1.0, &SequentialExecutor)?;
        assert_eq!(shortfall.compression, None);
        Some(shortfall.dimming)
    };
    for stray in [0.0, 0.02] {
        assert_eq!(dimming(1.0, stray), None);
        assert_eq!(dimming(1.1, stray), None);
        // Patterns have a mean emission of one half: this is a share of 0.2 for the flood.
        let found = dimming(0.8 / 0.9, stray).unwrap();
        assert!((found - 0.2).abs() < 0.01, "{found}");
        // Another exposure.
        assert_eq!(dimming(0.4, stray), None);
    }
}
