//! Photometry of synthetic captures whose faults are known.

use super::*;
use crate::capture::Measurements;
use crate::job_executor::SequentialExecutor;
use crate::recover::error::RecoverError;
use crate::recover::holdout_split::HoldoutSplit;
use crate::recover::mean_function::mean_function;
use crate::recover::preparation_input::RecoveryPreparationInput;
use crate::recover::test_problems::{SyntheticCapture, uniform};
use crate::transport::CHANNELS;

const PATTERNS: usize = 40;

/// Photometry of a capture after `change`. Every pixel's function differs from the mean function by a tenth.
fn photometry(change: impl FnOnce(&mut Measurements)) -> Photometry {
    let mut capture = SyntheticCapture::with_variation(PATTERNS, 0.1);
    change(&mut capture.measurements);
    let measurements = CalibratedMeasurements::uncorrected(&capture.measurements);
    let preparation = RecoveryPreparationInput {
        measurements: &measurements,
        geometry: capture.geometry,
        split: &HoldoutSplit::new(&capture.measurements.patterns),
        executor: &SequentialExecutor,
    };
    let photometry = pollster::block_on(async {
        let mean = mean_function(&preparation).await?;
        Ok::<_, RecoverError>(estimate(&preparation, &mean).await?)
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
