//! SNR against undersampling L/M for each method (paper, figures 3a and 3b).

use super::accuracy::{MethodCurve, measure_accuracy};
use super::chart::{LineChart, axis_range};
use super::error::StudyError;
use super::method_sample_sizes;
use super::section::{MarkdownTable, ProgressLog, ReportSection, seconds_cell, snr_cell};
use crate::capture::{Measurements, NoiseModel};
use crate::job_executor::Executor;
use crate::recover::Method;
use crate::transport::{Extent, KnownTransport};

/// Numbers of patterns L, ascending.
pub const SNR_PATTERNS: [usize; 11] = [10, 14, 20, 28, 40, 56, 80, 112, 160, 224, 320];
/// Numbers of patterns for slow methods.
const SLOW_PATTERN_COUNTS: [usize; 3] = [20, 80, 320];
/// Ticks of the chart's axes.
const TICKS: [usize; 6] = [10, 20, 40, 80, 160, 320];
/// The paper's SNR in dB with 80 patterns.
const PAPER_SNR: (f64, &str) = (25.0, "the paper at L = 80");

/// All points of the figure, and the extents that it names.
struct SnrCurves {
    camera: Extent,
    light: Extent,
    /// Numbers of patterns, ascending.
    counts: Vec<usize>,
    /// One for each of [`Method::ALL`].
    curves: Vec<MethodCurve>,
}

/// The section of figure 3: recovers from the first L patterns for each L, with samples of about `pixels` pixels.
/// Consumes the measurements, because at the paper's scale memory has no room for a second copy.
///
/// # Errors
/// Those of [`PreparedRecovery::prepare`](crate::recover::Recovery::prepare), and [`StudyError`] if the chart or a table
/// cannot be written.
pub fn snr_curves(
    name: &str,
    known: &impl KnownTransport,
    measurements: Measurements,
    pixels: usize,
    executor: &impl Executor,
    progress: ProgressLog,
) -> Result<ReportSection, StudyError> {
    let curves = SnrCurves::measure(name, known, measurements, pixels, executor, progress)?;
    let mut section = ReportSection::new(&format!("Figure 3: SNR against undersampling, {name}"));
    section.add_paragraph(&curves.samples());
    section.add_picture(
        &format!("{name}-figure3"),
        &format!("SNR of the transport of {name} against the number of patterns, by method"),
        curves.chart(name)?,
    );
    let (data, table) = curves.tables();
    section.add_paragraph(&table.markdown());
    section.add_csv(&format!("{name}-figure3"), &data)?;
    Ok(section)
}

impl SnrCurves {
    fn measure(
        name: &str,
        known: &impl KnownTransport,
        mut measurements: Measurements,
        pixels: usize,
        executor: &impl Executor,
        progress: ProgressLog,
    ) -> Result<Self, StudyError> {
        let available = measurements.patterns.len();
        let mut counts = SNR_PATTERNS.to_vec();
        counts.retain(|&l| l <= available);
        if counts.last().is_none_or(|&l| l < available) && available < SNR_PATTERNS[10] {
            counts.push(available);
        }
        let curve = |&method: &Method| MethodCurve {
            name: method_sample_sizes::name(method).to_owned(),
            points: Vec::new(),
        };
        let mut curves: Vec<MethodCurve> = Method::ALL.iter().map(curve).collect();
        for &l in counts.iter().rev() {
            measurements.patterns.truncate(l);
            measurements.full_scale.truncate(l);
            measurements.photos.truncate(l);
            measurements.noise = NoiseModel::with_gain_from(&measurements);
            for (curve, &method) in curves.iter_mut().zip(Method::ALL) {
                if method_sample_sizes::is_slow(method) && !SLOW_PATTERN_COUNTS.contains(&l) {
                    continue;
                }
                let accuracy = measure_accuracy(known, &measurements, method, pixels, executor)?;
                let (method, snr) = (&curve.name, snr_cell(accuracy.snr));
                progress(&format!("{name}: {method} from {l} patterns: {snr} dB"));
                curve.points.insert(0, accuracy);
            }
        }
        Ok(Self {
            camera: measurements.camera,
            light: measurements.light,
            counts,
            curves,
        })
    }

    fn undersampling(&self, patterns: usize) -> f64 {
        patterns as f64 / self.light.area() as f64
    }

    /// All figures, for the CSV file; and the SNR by number of patterns and method.
    fn tables(&self) -> (MarkdownTable, MarkdownTable) {
        let mut data = MarkdownTable::new(
            "method | patterns | patterns_per_light_element | snr_db | standard_error_db | \
             pixels_judged | pixels | seconds_for_all_pixels",
        );
        let mut table = MarkdownTable::new(&format!("L | L/M | {}", method_sample_sizes::names()));
        for &l in &self.counts {
            let mut row = vec![l.to_string(), format!("{:.5}", self.undersampling(l))];
            for curve in &self.curves {
                let accuracy = curve.at(l);
                row.push(snr_cell(accuracy.and_then(|point| point.snr)));
                if let Some(accuracy) = accuracy {
                    data.add_row([
                        curve.name.clone(),
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
            table.add_row(row);
        }
        (data, table)
    }

    fn chart(&self, name: &str) -> Result<String, StudyError> {
        let curves = self.curves.iter();
        let series: Vec<_> = curves
            .map(|curve| curve.series(|l| self.undersampling(l)))
            .collect();
        let elements = self.light.area();
        let max_patterns = self.counts.last().copied().unwrap_or(0);
        let ticks = TICKS.into_iter().filter(|&l| l <= max_patterns);
        let levels = series.iter().flat_map(|s| &s.points).map(|p| p.1);
        let chart = LineChart {
            title: &format!("{name}, N = {}, M = {elements}", self.camera.area()),
            x_label: "undersampling L/M",
            y_label: "SNR of T (dB)",
            x_ticks: ticks.map(|l| self.undersampling(l)).collect(),
            top: Some(("patterns L", elements as f64)),
            y: axis_range(levels, 30.0),
            reference: Some(PAPER_SNR),
            series,
        };
        chart.svg()
    }

    /// A sentence about the sample of pixels of each method.
    fn samples(&self) -> String {
        let all = self.camera.area();
        let sample = |curve: &MethodCurve| {
            let pixels = curve.points.iter().map(|point| point.pixels).max()?;
            let errors = curve.points.iter().map(|point| point.standard_error);
            (pixels < all).then(|| {
                let (name, error) = (&curve.name, errors.fold(0.0, f64::max));
                format!("`{name}` {pixels} (standard error at most {error:.2} dB)")
            })
        };
        let samples: Vec<String> = self.curves.iter().filter_map(sample).collect();
        match samples.is_empty() {
            true => "Every camera pixel is evaluated.".to_owned(),
            false => format!(
                "Some methods are evaluated on a random sample of camera pixels, the same in every run: {}.",
                samples.join(", ")
            ),
        }
    }
}
