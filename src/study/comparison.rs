//! Comparison of acquisition methods (paper, section 1): the photographs and the time that each needs for an SNR
//! of 25 dB, on a scene so small that all of them are feasible.

use std::time::Instant;

use super::accuracy::{AccuracyPoint, MethodCurve, measure_accuracy, pooled_snr};
use super::brute_force_scan;
use super::chart::{LineChart, axis_range};
use super::error::StudyError;
use super::known_transport::{DenseTransport, dense_transport};
use super::method_sample_sizes;
use super::nystrom::{NystromSamples, NystromTransport};
use super::pixel_sampling;
use super::section::{MarkdownTable, ProgressLog, ReportSection, seconds_cell, snr_cell};
use super::unwindowed;
use crate::capture::LinearPhoto;
use crate::job_executor::Executor;
use crate::recover::Method;
use crate::simulate::{PatternEnsemble, PatternImage, SimulatedCapture, first_shots};
use crate::transport::{CHANNELS, Extent, Geometry, SnrAccumulator};

/// Numbers of photographs at the points of curves, ascending.
const PHOTOGRAPH_COUNTS: [usize; 8] = [10, 20, 40, 80, 160, 320, 640, 1024];
/// Largest number of patterns for the methods that use patterns.
const MAX_PATTERNS: usize = 640;
/// Numbers of patterns for slow methods.
const SLOW_PATTERN_COUNTS: [usize; 4] = [20, 80, 160, 320];
const UNWINDOWED_PIXELS: usize = 96;
const TARGET_SNR_DB: f64 = 25.0;
/// Index of the first photograph of a row, so that its noise differs from that of all other photographs.
const FIRST_ROW_PHOTOGRAPH: u32 = 1 << 20;

/// Compares the acquisition methods on one scene, named `name`.
///
/// # Errors
/// Those of photographing and recovering the scene, and [`StudyError`] if a chart or a table cannot be written.
pub fn comparison(
    name: &str,
    simulated_capture: SimulatedCapture,
    ensemble: PatternEnsemble,
    executor: &impl Executor,
    progress: ProgressLog,
) -> Result<ReportSection, StudyError> {
    let geometry = simulated_capture.scene.geometry();
    let truth = dense_transport(&simulated_capture, executor);
    let counts = |max: usize| PHOTOGRAPH_COUNTS.into_iter().filter(move |&k| k <= max);
    let mut curves = Vec::new();
    let mut add_curve = |method: String, points: Vec<AccuracyPoint>| {
        if let Some(last) = points.last() {
            let (snr, photographs) = (snr_cell(last.snr), last.photographs);
            progress(&format!(
                "comparison, {name}: {method}: {snr} dB from {photographs}"
            ));
        }
        curves.push(MethodCurve {
            name: method,
            points,
        });
    };

    let scans = simulated_capture.photographs(&single_elements(geometry.light), executor);
    let start = Instant::now();
    let scanned = brute_force_scan::snr_by_scans(&truth, &scans);
    let seconds = start.elapsed().as_secs_f64();
    let point = |(snr, photographs)| AccuracyPoint {
        photographs,
        snr,
        standard_error: 0.0,
        pixels: truth.len(),
        seconds,
    };
    let points = scanned.into_iter().zip(1..).map(point);
    add_curve("scanning".to_owned(), points.collect());

    let nystrom = counts(2 * geometry.light.area().min(truth.len()))
        .map(|photographs| run_nystrom(&truth, &simulated_capture, &scans, photographs, executor));
    add_curve("kernel Nyström".to_owned(), nystrom.collect());
    drop(scans);

    let measurements = simulated_capture.measure(ensemble, MAX_PATTERNS, executor);
    let unwindowed = counts(MAX_PATTERNS).map(|l| {
        let measurements = first_shots(&measurements, l);
        unwindowed::measure_accuracy(&truth, &measurements, UNWINDOWED_PIXELS, executor)
    });
    add_curve("no window, nnls".to_owned(), unwindowed.collect());

    for &method in Method::ALL {
        // All points of a slow method would take longer than everything else here.
        let is_measured =
            |l: &usize| !method_sample_sizes::is_slow(method) || SLOW_PATTERN_COUNTS.contains(l);
        let points: Result<_, _> = counts(MAX_PATTERNS)
            .filter(is_measured)
            .map(|l| {
                let measurements = first_shots(&measurements, l);
                measure_accuracy(
                    &simulated_capture,
                    &measurements,
                    method,
                    truth.len(),
                    executor,
                )
            })
            .collect();
        add_curve(
            format!("window, {}", method_sample_sizes::name(method)),
            points?,
        );
    }
    section(name, geometry, &curves)
}

fn section(
    name: &str,
    geometry: &Geometry,
    curves: &[MethodCurve],
) -> Result<ReportSection, StudyError> {
    let (camera, light, elements) = (geometry.camera, geometry.light, geometry.light.area());
    let mut section = ReportSection::new(&format!("Photographs for {TARGET_SNR_DB} dB, {name}"));
    section.add_paragraph(&format!(
        "Camera {camera}, light plane {light}, the same camera and noise for all methods. Scanning photographs \
         one light element at a time; the elements not yet scanned count as dark. One element gives \
         little light, so that noise limits the SNR. Kernel Nyström photographs as many rows of T as \
         columns. Rows need a second projector at the camera's position and a second camera at the \
         light's, which the other methods do not need; each row counts as one photograph. Without a \
         window every light element is an unknown of every pixel; this method is evaluated on \
         {UNWINDOWED_PIXELS} random pixels, and its time is extrapolated to all pixels. The number of \
         photographs for {TARGET_SNR_DB} dB is interpolated between the points of the curve. Times are \
         computing times without the photographing."
    ));
    let mut data = MarkdownTable::new("method | photographs | snr_db | seconds");
    let mut table = MarkdownTable::new(
        "method | photographs for 25 dB | share of M | dB from 80 | best dB (from) | seconds there",
    );
    for curve in curves {
        for point in &curve.points {
            data.add_row([
                curve.name.clone(),
                point.photographs.to_string(),
                snr_cell(point.snr),
                seconds_cell(point.seconds),
            ]);
        }
        let needed = photographs_for(TARGET_SNR_DB, &curve.points);
        let share = needed.map(|k| k as f64 / elements as f64);
        let max = curve.points.last().map_or(0, |p| p.photographs);
        let mut points = curve.points.iter();
        let by_snr = |a: &&AccuracyPoint, b: &&AccuracyPoint| snr_db(a).total_cmp(&snr_db(b));
        let best = points.clone().max_by(by_snr);
        // The time at the target SNR, or at the best SNR if the target is not reached.
        let timed = match needed {
            Some(needed) => points.find(|p| p.photographs >= needed),
            None => best,
        };
        table.add_row([
            curve.name.clone(),
            needed.map_or(format!("more than {max}"), |k| k.to_string()),
            share.map_or(String::new(), |share| format!("{:.1} %", 100.0 * share)),
            snr_cell(curve.at(80).and_then(|p| p.snr)),
            best.map_or(String::new(), |p| {
                format!("{} ({})", snr_cell(p.snr), p.photographs)
            }),
            timed.map_or(String::new(), |p| seconds_cell(p.seconds)),
        ]);
    }
    let series = curves.iter().map(|curve| {
        let mut series = curve.series(|photographs| photographs as f64);
        let min_photographs = PHOTOGRAPH_COUNTS[0] as f64;
        series.points.retain(|point| point.0 >= min_photographs);
        series
    });
    let series: Vec<_> = series.collect();
    let levels = series.iter().flat_map(|s| &s.points).map(|p| p.1);
    let chart = LineChart {
        title: &format!("{name}, N = {}, M = {elements}", camera.area()),
        x_label: "photographs",
        y_label: "SNR of T (dB)",
        x_ticks: PHOTOGRAPH_COUNTS.map(|k| k as f64).into(),
        top: Some(("photographs / M", 1.0 / elements as f64)),
        y: axis_range(levels, 35.0),
        reference: Some((TARGET_SNR_DB, "25 dB")),
        series,
    };
    section.add_picture(
        &format!("comparison-{name}"),
        &format!("SNR of the transport of {name} against photographs, by way of acquisition"),
        chart.svg()?,
    );
    section.add_paragraph(&table.markdown());
    section.add_csv(&format!("comparison-{name}"), &data)?;
    Ok(section)
}

/// The codes of each light element alone at full brightness.
fn single_elements(light: Extent) -> Vec<PatternImage> {
    let single = |m: usize| {
        let mut codes = vec![0; light.area()];
        codes[m] = 255;
        PatternImage::Grey(codes)
    };
    (0..light.area()).map(single).collect()
}

/// Kernel Nyström from random columns and rows, half of `photographs` each.
fn run_nystrom(
    truth: &DenseTransport,
    simulated_capture: &SimulatedCapture,
    scans: &[LinearPhoto],
    photographs: usize,
    executor: &impl Executor,
) -> AccuracyPoint {
    let light = scans.len();
    let elements = pixel_sampling::random_indices(light, photographs / 2);
    let pixels = pixel_sampling::random_indices(truth.len(), photographs - photographs / 2);
    let black = vec![[0.0; CHANNELS]; light];
    let dark = simulated_capture.add_noise(&black, FIRST_ROW_PHOTOGRAPH);
    let rows = executor.map(pixels.len(), |i| {
        let number = FIRST_ROW_PHOTOGRAPH + 1 + pixels[i] as u32;
        simulated_capture.add_noise(&truth[pixels[i]], number)
    });
    let start = Instant::now();
    let mut parts = vec![SnrAccumulator::default(); truth.len()];
    for c in 0..CHANNELS {
        let columns =
            (0..truth.len()).flat_map(|n| elements.iter().map(move |&m| f64::from(scans[m][n][c])));
        let sampled = rows.iter().flat_map(|row| {
            let less_dark = row.iter().zip(&dark);
            less_dark.map(|(y, dark)| f64::from(y[c] - dark[c]))
        });
        let nystrom = NystromTransport::new(
            &NystromSamples {
                columns: columns.collect(),
                rows: sampled.collect(),
                elements: elements.clone(),
                pixels: pixels.clone(),
                light,
            },
            executor,
        );
        let errors = executor.map(truth.len(), |n| {
            let mut estimate = nystrom.pixel(n);
            // Photographed columns and rows replace their predictions.
            for &m in &elements {
                estimate[m] = f64::from(scans[m][n][c].max(0.0));
            }
            if let Ok(i) = pixels.binary_search(&n) {
                for (m, estimate) in estimate.iter_mut().enumerate() {
                    *estimate = f64::from((rows[i][m][c] - dark[m][c]).max(0.0));
                }
            }
            let mut error = SnrAccumulator::default();
            for (truth, estimate) in truth[n].iter().zip(estimate) {
                error.add(f64::from(truth[c]), estimate);
            }
            error
        });
        for (part, error) in parts.iter_mut().zip(errors) {
            part.merge(error);
        }
    }
    AccuracyPoint {
        photographs,
        snr: pooled_snr(&parts, 1.0).0,
        standard_error: 0.0,
        pixels: truth.len(),
        seconds: start.elapsed().as_secs_f64(),
    }
}

/// The SNR in dB, infinite without error.
fn snr_db(point: &AccuracyPoint) -> f64 {
    point.snr.map_or(f64::INFINITY, |snr| snr.0)
}

/// The number of photographs from which on the SNR is at least `target` dB, interpolated linearly in the logarithm of the
/// number; `None` if the curve ends below.
fn photographs_for(target: f64, points: &[AccuracyPoint]) -> Option<usize> {
    let reached = points.iter().rposition(|p| snr_db(p) < target);
    let (below, above) = match reached {
        None => return points.first().map(|p| p.photographs),
        Some(i) => (&points[i], points.get(i + 1)?),
    };
    let share = (target - snr_db(below)) / (snr_db(above) - snr_db(below));
    let (a, b) = (below.photographs as f64, above.photographs as f64);
    Some((a * (b / a).powf(share) - 1e-9).ceil() as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job_executor::SequentialExecutor;
    use crate::simulate::SceneKind;
    use crate::transport::Decibels;

    fn point(photographs: usize, db: f64) -> AccuracyPoint {
        AccuracyPoint {
            photographs,
            snr: Some(Decibels(db)),
            standard_error: 0.0,
            pixels: 0,
            seconds: 0.0,
        }
    }

    #[test]
    fn photographs_for_interpolates_between_points() {
        let curve = [point(10, 5.0), point(40, 25.0), point(160, 35.0)];
        assert_eq!(photographs_for(25.0, &curve), Some(40));
        assert_eq!(photographs_for(30.0, &curve), Some(80));
        assert_eq!(photographs_for(4.0, &curve), Some(10));
        assert_eq!(photographs_for(36.0, &curve), None);
    }

    #[test]
    fn comparison_runs_every_method_on_a_tiny_scene() {
        let side = |side| Extent::new(side, side);
        let scene = SceneKind::Cookies.build(side(8), side(4)).unwrap();
        let simulated_capture = SimulatedCapture {
            scene: scene.as_ref(),
            electrons: 1e6,
            seed: 3,
        };
        let section = comparison(
            "tiny",
            simulated_capture,
            PatternEnsemble::Bernoulli,
            &SequentialExecutor,
            &|_| {},
        )
        .unwrap();
        for word in ["scanning", "Nyström", "no window", "window, nnls"] {
            assert!(section.markdown.contains(word), "no {word}");
        }
        let csv = &section
            .files
            .iter()
            .find(|f| f.0 == "comparison-tiny.csv")
            .unwrap()
            .1;
        let csv = String::from_utf8(csv.clone()).unwrap();
        assert!(
            csv.lines()
                .all(|line| line.matches(',').count() == 3 || line.contains('"'))
        );
        // 16 scans, 3 of Nyström (10 and 20 and up to 32), 7 of each other way, and the header.
        assert!(csv.lines().count() > 16 + 2 + 7 + 7);
    }
}
