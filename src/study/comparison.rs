//! The paper's comparison, at a size where every way to acquire a transport can be run: photographs
//! and time needed for 25 dB.

use std::time::Instant;

use super::accuracy::{judge, pooled};
use super::brute_force;
use super::chart::{Chart, Series, TopAxis, level_range};
use super::dense::Dense;
use super::known::SceneTruth;
use super::methods::{self, METHODS};
use super::nystrom::{Nystrom, Samples};
use super::photograph::first_shots;
use super::report::{Section, Table, cell, seconds};
use super::{Photographer, Picture, Progress, StudyError, blocks, unwindowed};
use crate::capture::Measurements;
use crate::executor::Executor;
use crate::simulate::{Ensemble, LightCodes};
use crate::transport::{CHANNELS, Decibels, Extent, TransportError};

/// Numbers of photographs that curves have points at, rising.
const PHOTOGRAPHS: [usize; 8] = [10, 20, 40, 80, 160, 320, 640, 1024];
/// Most patterns that methods with patterns are given.
const MOST_PATTERNS: usize = 640;
/// Of those, the numbers that slow methods are given.
const SLOW_PATTERNS: [usize; 4] = [20, 80, 160, 320];
/// Pixels that stand for all where every element is an unknown.
const UNWINDOWED_PIXELS: usize = 96;
/// The level to reach, in dB.
const LEVEL: f64 = 25.0;
/// Photographs of the first scanned element, row and dark frame: no two share their noise.
const ROW_NOISE: u32 = 1 << 20;

/// One way to acquire a transport.
struct Curve {
    name: String,
    points: Vec<Point>,
}

struct Point {
    photographs: usize,
    snr: Option<Decibels>,
    seconds: f64,
}

/// Holds the ways to acquire a transport against each other on one scene, named `name`.
pub fn comparison(
    name: &str,
    photographer: Photographer,
    ensemble: Ensemble,
    executor: &impl Executor,
    progress: Progress,
) -> Result<Section, StudyError> {
    let known = SceneTruth(photographer.scene);
    let (camera, light) = {
        let geometry = photographer.scene.geometry();
        (geometry.camera, geometry.light)
    };
    let truth = Dense::new(&known, executor);
    let elements = light.area();
    let counts = |most: usize| PHOTOGRAPHS.into_iter().filter(move |&k| k <= most);
    let tell = |curve: &Curve| {
        if let Some(last) = curve.points.last() {
            progress(&format!(
                "comparison, {name}: {}: {} dB from {}",
                curve.name,
                cell(last.snr),
                last.photographs
            ));
        }
    };

    let scans = photographer.photographs(&single_elements(light), executor)?;
    let start = Instant::now();
    let scanned = brute_force::scan(&truth, &scans);
    let taken = start.elapsed().as_secs_f64();
    let mut curves = vec![Curve {
        name: "scanning".to_owned(),
        points: scanned
            .into_iter()
            .enumerate()
            .map(|(i, snr)| Point {
                photographs: i + 1,
                snr,
                seconds: taken,
            })
            .collect(),
    }];
    tell(&curves[0]);

    let mut nystrom = Curve {
        name: "kernel Nyström".to_owned(),
        points: Vec::new(),
    };
    for photographs in counts(2 * elements.min(camera.area())) {
        let (snr, seconds) = low_rank(&truth, &photographer, &scans, photographs, executor)?;
        nystrom.points.push(Point {
            photographs,
            snr,
            seconds,
        });
    }
    tell(&nystrom);
    curves.push(nystrom);
    drop(scans);

    let measurements = photographer.measure(ensemble, MOST_PATTERNS, executor)?;
    let mut whole = Curve {
        name: "no window, nnls".to_owned(),
        points: Vec::new(),
    };
    for l in counts(MOST_PATTERNS) {
        let measurements = first_shots(&measurements, l);
        let (errors, seconds) =
            unwindowed::recover(&truth, &measurements, UNWINDOWED_PIXELS, executor);
        let share = errors.len() as f64 / truth.pixels() as f64;
        whole.points.push(Point {
            photographs: l,
            snr: pooled(&errors, share).0,
            seconds,
        });
    }
    tell(&whole);
    curves.push(whole);

    for &method in METHODS {
        let mut curve = Curve {
            name: format!("window, {}", methods::name(method)),
            points: Vec::new(),
        };
        // Every point of a slow method would take longer than all else here together.
        let wanted = |l: &usize| !methods::slow(method) || SLOW_PATTERNS.contains(l);
        for l in counts(MOST_PATTERNS).filter(wanted) {
            let measurements = first_shots(&measurements, l);
            let accuracy = judge(&known, &measurements, method, camera.area(), executor)?;
            curve.points.push(Point {
                photographs: l,
                snr: accuracy.snr,
                seconds: accuracy.seconds,
            });
        }
        tell(&curve);
        curves.push(curve);
    }
    section(name, camera, elements, &measurements, &curves)
}

fn section(
    name: &str,
    camera: Extent,
    elements: usize,
    measurements: &Measurements,
    curves: &[Curve],
) -> Result<Section, StudyError> {
    let mut section = Section::new(&format!("Photographs for {LEVEL} dB, {name}"));
    section.paragraph(&format!(
        "Camera {camera}, light {}, the same camera and noise for all. Scanning lights one element \
         a photograph, and what it has not scanned counts as dark; one element gives little light, \
         so that noise bounds what it reaches. Kernel Nyström photographs as \
         many rows of T as columns and keeps them as they are; rows need a projector at the camera's place and a camera at \
         the light's, which the other methods do without, and count as photographs all the same. \
         Without a window every light element is an unknown of every pixel; that is judged on {UNWINDOWED_PIXELS} pixels drawn at \
         random, its time scaled to all. Photographs for {LEVEL} dB are read off the curve, straight \
         between its points. Time is for computing alone.",
        measurements.light,
    ));
    let mut data = Table::new(&["method", "photographs", "snr_db", "seconds"]);
    let mut table = Table::new(&[
        "method",
        "photographs for 25 dB",
        "share of M",
        "dB from 80",
        "best dB (from)",
        "seconds there",
    ]);
    for curve in curves {
        for point in &curve.points {
            data.row([
                curve.name.clone(),
                point.photographs.to_string(),
                cell(point.snr),
                seconds(point.seconds),
            ]);
        }
        let needed = photographs_for(LEVEL, &curve.points);
        let most = curve.points.last().map_or(0, |p| p.photographs);
        let at_80 = curve.points.iter().find(|p| p.photographs == 80);
        let best = curve
            .points
            .iter()
            .max_by(|a, b| level(a).total_cmp(&level(b)));
        // Time at the level, or at the best where it is not reached.
        let timed = match needed {
            Some(needed) => curve.points.iter().find(|p| p.photographs >= needed),
            None => best,
        };
        table.row([
            curve.name.clone(),
            needed.map_or(format!("more than {most}"), |k| k.to_string()),
            needed.map_or(String::new(), |k| {
                format!("{:.1} %", 100.0 * k as f64 / elements as f64)
            }),
            cell(at_80.and_then(|p| p.snr)),
            best.map_or(String::new(), |p| {
                format!("{} ({})", cell(p.snr), p.photographs)
            }),
            timed.map_or(String::new(), |p| seconds(p.seconds)),
        ]);
    }
    let series: Vec<_> = curves
        .iter()
        .map(|curve| Series {
            name: curve.name.clone(),
            points: curve
                .points
                .iter()
                .filter(|p| p.photographs >= PHOTOGRAPHS[0])
                .filter_map(|p| Some((p.photographs as f64, p.snr?.0)))
                .collect(),
            marked: curve.points.len() <= PHOTOGRAPHS.len(),
        })
        .collect();
    let ticks: Vec<f64> = PHOTOGRAPHS.map(|k| k as f64).into();
    let levels = series.iter().flat_map(|s| &s.points).map(|p| p.1);
    let chart = Chart {
        title: &format!("{name}, N = {}, M = {elements}", camera.area()),
        x_label: "photographs",
        y_label: "SNR of T (dB)",
        top: Some(TopAxis {
            label: "photographs / M",
            factor: 1.0 / elements as f64,
            ticks: ticks.iter().map(|k| k / elements as f64).collect(),
        }),
        x_ticks: ticks,
        y: level_range(levels, 35.0),
        level: Some((LEVEL, "25 dB")),
        series,
    };
    section.picture(
        &format!("comparison-{name}"),
        &format!("SNR of the transport of {name} against photographs, by way of acquisition"),
        chart.svg()?,
    );
    section.paragraph(&table.markdown());
    section.data(&format!("comparison-{name}"), &data)?;
    Ok(section)
}

/// Every element alone at full brightness.
fn single_elements(light: Extent) -> Vec<LightCodes> {
    let single = |m: usize| {
        let mut codes = vec![0; light.area()];
        codes[m] = 255;
        LightCodes::Grey(codes)
    };
    (0..light.area()).map(single).collect()
}

/// Kernel Nyström from half as many columns and rows as `photographs`, drawn at random: its SNR, and
/// the seconds it takes once they are photographed.
fn low_rank(
    truth: &Dense,
    photographer: &Photographer,
    scans: &[Picture],
    photographs: usize,
    executor: &impl Executor,
) -> Result<(Option<Decibels>, f64), StudyError> {
    let elements = blocks::draw(truth.elements, photographs / 2);
    let pixels = blocks::draw(truth.pixels(), photographs - photographs / 2);
    let black = vec![[0.0; CHANNELS]; truth.elements];
    let dark = photographer.noisy(&black, ROW_NOISE)?;
    let rows = executor.map(pixels.len(), |i| {
        let row = truth.pixel(pixels[i]).to_vec();
        photographer.noisy(&row, ROW_NOISE + 1 + pixels[i] as u32)
    });
    let rows = rows.into_iter().collect::<Result<Vec<_>, _>>()?;
    let start = Instant::now();
    let mut parts = vec![TransportError::default(); truth.pixels()];
    for c in 0..CHANNELS {
        let columns = (0..truth.pixels())
            .flat_map(|n| elements.iter().map(move |&m| f64::from(scans[m][n][c])));
        let sampled = rows.iter().flat_map(|row| {
            let less_dark = row.iter().zip(&dark);
            less_dark.map(|(y, dark)| f64::from(y[c] - dark[c]))
        });
        let nystrom = Nystrom::new(
            &Samples {
                columns: columns.collect(),
                rows: sampled.collect(),
                elements: elements.clone(),
                pixels: pixels.clone(),
                light: truth.elements,
            },
            executor,
        );
        let errors = executor.map(truth.pixels(), |n| {
            let mut estimate = nystrom.pixel(n);
            // What was photographed is better known than what is predicted from it.
            for &m in &elements {
                estimate[m] = f64::from(scans[m][n][c].max(0.0));
            }
            if let Ok(i) = pixels.binary_search(&n) {
                for (m, estimate) in estimate.iter_mut().enumerate() {
                    *estimate = f64::from((rows[i][m][c] - dark[m][c]).max(0.0));
                }
            }
            let mut error = TransportError::default();
            for (truth, estimate) in truth.pixel(n).iter().zip(estimate) {
                error.add(f64::from(truth[c]), estimate);
            }
            error
        });
        for (part, error) in parts.iter_mut().zip(errors) {
            part.merge(error);
        }
    }
    Ok((pooled(&parts, 1.0).0, start.elapsed().as_secs_f64()))
}

/// A level to sort by.
fn level(point: &Point) -> f64 {
    point.snr.map_or(f64::INFINITY, |snr| snr.0)
}

/// Fewest photographs that reach `wanted` for good, straight between points in the logarithm of
/// their number.
fn photographs_for(wanted: f64, points: &[Point]) -> Option<usize> {
    let reached = points.iter().rposition(|p| level(p) < wanted);
    let (below, above) = match reached {
        None => return points.first().map(|p| p.photographs),
        Some(i) => (&points[i], points.get(i + 1)?),
    };
    let share = (wanted - level(below)) / (level(above) - level(below));
    let (a, b) = (below.photographs as f64, above.photographs as f64);
    Some((a * (b / a).powf(share) - 1e-9).ceil() as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::executor::SequentialExecutor;
    use crate::simulate::SceneKind;

    fn point(photographs: usize, db: f64) -> Point {
        Point {
            photographs,
            snr: Some(Decibels(db)),
            seconds: 0.0,
        }
    }

    #[test]
    fn photographs_needed_lie_between_points() {
        let curve = [point(10, 5.0), point(40, 25.0), point(160, 35.0)];
        assert_eq!(photographs_for(25.0, &curve), Some(40));
        assert_eq!(photographs_for(30.0, &curve), Some(80));
        assert_eq!(photographs_for(4.0, &curve), Some(10));
        assert_eq!(photographs_for(36.0, &curve), None);
    }

    #[test]
    fn every_way_is_tried_on_a_tiny_scene() {
        let side = |side| Extent {
            width: side,
            height: side,
        };
        let scene = SceneKind::Cookies.build(side(8), side(4)).unwrap();
        let photographer = Photographer {
            scene: scene.as_ref(),
            electrons: 1e6,
            seed: 3,
        };
        let section = comparison(
            "tiny",
            photographer,
            Ensemble::Bernoulli,
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
