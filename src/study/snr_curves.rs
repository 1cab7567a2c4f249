//! SNR against undersampling L/M for each method (paper, figures 3a and 3b).

use super::accuracy::{Accuracy, measure_accuracy};
use super::chart::{Chart, Series, TopAxis, axis_range};
use super::error::StudyError;
use super::known_transport::KnownTransport;
use super::methods;
use super::section::{ProgressCallback, Section, Table, seconds_cell, snr_cell};
use crate::capture::{Measurements, NoiseModel};
use crate::executor::Executor;
use crate::recover::Method;
use crate::transport::Extent;

/// Numbers of patterns L, ascending.
pub const SNR_PATTERNS: [usize; 11] = [10, 14, 20, 28, 40, 56, 80, 112, 160, 224, 320];
/// Numbers of patterns for slow methods.
const SLOW_PATTERN_COUNTS: [usize; 3] = [20, 80, 320];
/// Ticks of the chart's axes.
const TICKS: [usize; 6] = [10, 20, 40, 80, 160, 320];
/// The paper's SNR in dB with 80 patterns.
const PAPER_SNR: (f64, &str) = (25.0, "the paper at L = 80");

/// The accuracy of one method with one number of patterns.
struct CurvePoint {
    patterns: usize,
    method: Method,
    accuracy: Accuracy,
}

/// All points of the figure, and the extents that it names.
struct SnrCurves {
    camera: Extent,
    light: Extent,
    /// Numbers of patterns, ascending.
    counts: Vec<usize>,
    points: Vec<CurvePoint>,
}

/// The section of figure 3: recovers from the first L patterns for each L, with samples of about `pixels` pixels.
/// Consumes the measurements, because at the paper's scale memory has no room for a second copy.
///
/// # Errors
/// Those of [`Recovery::prepare`](crate::recover::Recovery::prepare), and [`StudyError`] if the chart or a table
/// cannot be written.
pub fn snr_curves(
    name: &str,
    known: &impl KnownTransport,
    measurements: Measurements,
    pixels: usize,
    executor: &impl Executor,
    progress: ProgressCallback,
) -> Result<Section, StudyError> {
    let curves = SnrCurves::measure(name, known, measurements, pixels, executor, progress)?;
    let mut section = Section::new(&format!("Figure 3: SNR against undersampling, {name}"));
    section.add_paragraph(&curves.samples());
    section.add_picture(
        &format!("{name}-figure3"),
        &format!("SNR of the transport of {name} against the number of patterns, by method"),
        curves.chart(name)?,
    );
    section.add_paragraph(&curves.table().markdown());
    section.add_csv(&format!("{name}-figure3"), &curves.data())?;
    Ok(section)
}

impl SnrCurves {
    fn measure(
        name: &str,
        known: &impl KnownTransport,
        mut measurements: Measurements,
        pixels: usize,
        executor: &impl Executor,
        progress: ProgressCallback,
    ) -> Result<Self, StudyError> {
        let available = measurements.patterns.len();
        let mut counts: Vec<usize> = SNR_PATTERNS
            .into_iter()
            .filter(|&l| l <= available)
            .collect();
        if counts.last().is_none_or(|&l| l < available) && available < SNR_PATTERNS[10] {
            counts.push(available);
        }
        let mut points = Vec::new();
        for &l in counts.iter().rev() {
            measurements.patterns.truncate(l);
            measurements.full_scale.truncate(l);
            measurements.photos.truncate(l);
            measurements.noise = NoiseModel::with_gain_from(&measurements);
            for &method in Method::ALL {
                if methods::is_slow(method) && !SLOW_PATTERN_COUNTS.contains(&l) {
                    continue;
                }
                let accuracy = measure_accuracy(known, &measurements, method, pixels, executor)?;
                progress(&format!(
                    "{name}: {} from {l} patterns: {} dB",
                    methods::name(method),
                    snr_cell(accuracy.snr)
                ));
                points.push(CurvePoint {
                    patterns: l,
                    method,
                    accuracy,
                });
            }
        }
        points.reverse();
        Ok(Self {
            camera: measurements.camera,
            light: measurements.light,
            counts,
            points,
        })
    }

    fn undersampling(&self, patterns: usize) -> f64 {
        patterns as f64 / self.light.area() as f64
    }

    fn accuracy(&self, patterns: usize, method: Method) -> Option<&Accuracy> {
        let mut points = self.points.iter();
        let point = points.find(|p| (p.patterns, p.method) == (patterns, method));
        point.map(|point| &point.accuracy)
    }

    /// All figures, for the CSV file.
    fn data(&self) -> Table {
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
        for &l in &self.counts {
            for &method in Method::ALL {
                if let Some(accuracy) = self.accuracy(l, method) {
                    data.add_row([
                        methods::name(method).to_owned(),
                        l.to_string(),
                        format!("{:.6}", self.undersampling(l)),
                        snr_cell(accuracy.snr),
                        format!("{:.2}", accuracy.standard_error),
                        accuracy.pixels.to_string(),
                        self.camera.area().to_string(),
                        seconds_cell(accuracy.seconds),
                    ]);
                }
            }
        }
        data
    }

    /// The SNR by number of patterns and method.
    fn table(&self) -> Table {
        let mut header = vec!["L", "L/M"];
        header.extend(Method::ALL.iter().map(|&m| methods::name(m)));
        let mut table = Table::new(&header);
        for &l in &self.counts {
            let mut row = vec![l.to_string(), format!("{:.5}", self.undersampling(l))];
            row.extend(Method::ALL.iter().map(|&method| {
                let accuracy = self.accuracy(l, method);
                accuracy.map_or(String::new(), |accuracy| snr_cell(accuracy.snr))
            }));
            table.add_row(row);
        }
        table
    }

    fn chart(&self, name: &str) -> Result<String, StudyError> {
        let series: Vec<_> = Method::ALL
            .iter()
            .map(|&method| Series {
                name: methods::name(method).to_owned(),
                points: (self.counts.iter())
                    .filter_map(|&l| {
                        Some((self.undersampling(l), self.accuracy(l, method)?.snr?.0))
                    })
                    .collect(),
                has_markers: true,
            })
            .collect();
        let max_patterns = self.counts.last().copied().unwrap_or(0);
        let ticks: Vec<usize> = TICKS.into_iter().filter(|&l| l <= max_patterns).collect();
        let levels = series.iter().flat_map(|s| &s.points).map(|p| p.1);
        let chart = Chart {
            title: &format!(
                "{name}, N = {}, M = {}",
                self.camera.area(),
                self.light.area()
            ),
            x_label: "undersampling L/M",
            y_label: "SNR of T (dB)",
            x_ticks: ticks.iter().map(|&l| self.undersampling(l)).collect(),
            top: Some(TopAxis {
                label: "patterns L",
                factor: self.light.area() as f64,
                ticks: ticks.iter().map(|&l| l as f64).collect(),
            }),
            y: axis_range(levels, 30.0),
            reference: Some(PAPER_SNR),
            series,
        };
        chart.svg()
    }

    /// A sentence about the sample of pixels of each method.
    fn samples(&self) -> String {
        let all = self.camera.area();
        let sample = |&method: &Method| {
            let accuracies = || {
                let points = self.points.iter().filter(move |p| p.method == method);
                points.map(|p| &p.accuracy)
            };
            let pixels = accuracies().map(|a| a.pixels).max()?;
            let errors = accuracies().map(|a| a.standard_error);
            (pixels < all).then(|| {
                let (name, error) = (methods::name(method), errors.fold(0.0, f64::max));
                format!("`{name}` {pixels} (standard error at most {error:.2} dB)")
            })
        };
        let samples: Vec<String> = Method::ALL.iter().filter_map(sample).collect();
        match samples.is_empty() {
            true => "Every camera pixel is evaluated.".to_owned(),
            false => format!(
                "Some methods are evaluated on a random sample of camera pixels, the same in every run: {}.",
                samples.join(", ")
            ),
        }
    }
}
