//! SNR against undersampling, for each method (paper, figures 3a and 3b).

use super::accuracy::judge;
use super::chart::{Chart, Series, TopAxis, level_range};
use super::known::Known;
use super::methods::{self, METHODS};
use super::report::{Section, Table, cell, seconds};
use super::{Progress, StudyError};
use crate::capture::{Measurements, Noise};
use crate::executor::Executor;

/// Numbers of patterns, `L`, rising.
pub const SNR_PATTERNS: [usize; 11] = [10, 14, 20, 28, 40, 56, 80, 112, 160, 224, 320];
/// Of those, the numbers that slow methods are given.
const SLOW_PATTERNS: [usize; 3] = [20, 80, 320];
/// Numbers that stand at the chart's axes.
const TICKS: [usize; 6] = [10, 20, 40, 80, 160, 320];
/// What the paper reaches with 80 patterns.
const PAPER_LEVEL: (f64, &str) = (25.0, "the paper at L = 80");

/// Figures 3a and 3b: recovers from the first patterns, ever fewer of them. Uses the measurements
/// up, because at the paper's scale a second copy would not fit beside them.
pub fn snr_curves(
    name: &str,
    known: &impl Known,
    mut measurements: Measurements,
    pixels: usize,
    executor: &impl Executor,
    progress: Progress,
) -> Result<Section, StudyError> {
    let available = measurements.patterns.len();
    let mut counts: Vec<usize> = SNR_PATTERNS
        .into_iter()
        .filter(|&l| l <= available)
        .collect();
    if counts.last().is_none_or(|&l| l < available) && available < SNR_PATTERNS[10] {
        counts.push(available);
    }
    let light = measurements.light.area() as f64;
    let mut results = Vec::new();
    for &l in counts.iter().rev() {
        measurements.patterns.truncate(l);
        measurements.full_scale.truncate(l);
        measurements.pictures.truncate(l);
        measurements.noise = Noise::with_gain_from(&measurements);
        for &method in METHODS {
            if methods::slow(method) && !SLOW_PATTERNS.contains(&l) {
                continue;
            }
            let accuracy = judge(known, &measurements, method, pixels, executor)?;
            progress(&format!(
                "{name}: {} from {l} patterns: {} dB",
                methods::name(method),
                cell(accuracy.snr)
            ));
            results.push((l, method, accuracy));
        }
    }
    results.reverse();

    let mut data = Table::new(&[
        "method",
        "patterns",
        "patterns_per_light_element",
        "snr_db",
        "standard_error_db",
        "pixels_judged",
        "pixels",
        "seconds_for_all_pixels",
    ]);
    let mut header = vec!["L", "L/M"];
    header.extend(METHODS.iter().map(|&m| methods::name(m)));
    let mut table = Table::new(&header);
    for &l in &counts {
        let mut row = vec![l.to_string(), format!("{:.5}", l as f64 / light)];
        for &method in METHODS {
            let found = results.iter().find(|r| (r.0, r.1) == (l, method));
            row.push(found.map_or(String::new(), |found| cell(found.2.snr)));
            if let Some((_, _, accuracy)) = found {
                data.row([
                    methods::name(method).to_owned(),
                    l.to_string(),
                    format!("{:.6}", l as f64 / light),
                    cell(accuracy.snr),
                    format!("{:.2}", accuracy.standard_error),
                    accuracy.pixels.to_string(),
                    measurements.camera.area().to_string(),
                    seconds(accuracy.seconds),
                ]);
            }
        }
        table.row(row);
    }
    let series: Vec<_> = METHODS
        .iter()
        .map(|&method| Series {
            name: methods::name(method).to_owned(),
            points: counts
                .iter()
                .filter_map(|&l| {
                    let found = results.iter().find(|r| (r.0, r.1) == (l, method))?;
                    Some((l as f64 / light, found.2.snr?.0))
                })
                .collect(),
            marked: true,
        })
        .collect();
    let all = measurements.camera.area();
    let ticks: Vec<f64> = TICKS
        .into_iter()
        .filter(|&l| l <= available)
        .map(|l| l as f64)
        .collect();
    let levels = series.iter().flat_map(|s| &s.points).map(|p| p.1);
    let chart = Chart {
        title: &format!("{name}, N = {all}, M = {}", measurements.light.area()),
        x_label: "undersampling L/M",
        y_label: "SNR of T (dB)",
        x_ticks: ticks.iter().map(|l| l / light).collect(),
        top: Some(TopAxis {
            label: "patterns L",
            factor: light,
            ticks,
        }),
        y: level_range(levels, 30.0),
        level: Some(PAPER_LEVEL),
        series,
    };
    let mut section = Section::new(&format!("Figure 3: SNR against undersampling, {name}"));
    let samples: Vec<String> = METHODS
        .iter()
        .filter_map(|&method| {
            let of_method = results.iter().filter(|r| r.1 == method);
            let doubt = of_method.clone().map(|r| r.2.standard_error);
            let pixels = of_method.map(|r| r.2.pixels).max()?;
            (pixels < all).then(|| {
                let doubt = doubt.fold(0.0, f64::max);
                let name = methods::name(method);
                format!("`{name}` {pixels} (standard error at most {doubt:.2} dB)")
            })
        })
        .collect();
    section.paragraph(&match samples.is_empty() {
        true => "Every camera pixel is judged.".to_owned(),
        false => format!(
            "Some methods are judged on camera pixels drawn at random, always the same: {}.",
            samples.join(", ")
        ),
    });
    section.picture(
        &format!("{name}-figure3"),
        &format!("SNR of the transport of {name} against the number of patterns, by method"),
        chart.svg()?,
    );
    section.paragraph(&table.markdown());
    section.data(&format!("{name}-figure3"), &data)?;
    Ok(section)
}
