//! The structure of a light transport matrix (paper, figure 2): how few elements hold its energy (the sparsity
//! profile), where they are in the matrix, and one light transport function.

use std::collections::BTreeMap;

use super::chart::{ChartSeries, LineChart};
use super::error::StudyError;
use super::picture_sheet::{CaptionedPanel, PanelImage, PictureSheet};
use super::section::{MarkdownTable, ProgressLog, ReportSection};
use crate::job_executor::Executor;
use crate::transport::{CHANNELS, CameraPixel, Extent, Geometry, KnownTransport};

/// Ignored low bits of the mantissa: elements within 1/64 of each other are in one class.
const IGNORED_BITS: u32 = 17;
const CLASSES: usize = 1 << (31 - IGNORED_BITS);
const CURVE_POINTS: usize = 120;
const ENERGY_SHARES: [f64; 4] = [0.5, 0.9, 0.99, 0.999];
/// Side of the overview of the whole matrix, in cells.
const OVERVIEW_SIDE: u32 = 512;
/// Side of the zoomed part, in camera pixels and light elements.
const ZOOM_SIDE: u32 = 96;

/// A histogram of the magnitudes of many elements that are not zero, from which follow the shares of energy (sum of
/// squares) that the largest elements hold. Classes are so narrow that shares are exact to about 1 % of one element's
/// energy.
#[derive(Clone, Debug)]
struct SparsityProfile {
    /// Number and energy of the elements in each class of magnitude, ascending.
    classes: Vec<(u64, f64)>,
}

impl Default for SparsityProfile {
    fn default() -> Self {
        Self {
            classes: vec![(0, 0.0); CLASSES],
        }
    }
}

impl SparsityProfile {
    fn add(&mut self, element: f32) {
        if element != 0.0 {
            // The bits of a positive float ascend with its value.
            let class = &mut self.classes[(element.abs().to_bits() >> IGNORED_BITS) as usize];
            class.0 += 1;
            class.1 += f64::from(element).powi(2);
        }
    }

    fn merge(&mut self, other: &Self) {
        for (class, other) in self.classes.iter_mut().zip(&other.classes) {
            class.0 += other.0;
            class.1 += other.1;
        }
    }

    fn energy(&self) -> f64 {
        self.classes.iter().map(|(_, energy)| energy).sum()
    }

    /// The share of the energy in the `k` largest elements, 0 to 1.
    fn share_of_largest(&self, k: f64) -> f64 {
        let total = self.energy();
        let (mut remaining, mut held) = (k, 0.0);
        for (count, energy) in self.largest_first() {
            held += (remaining / count).min(1.0) * energy;
            remaining -= count;
            if remaining <= 0.0 {
                break;
            }
        }
        if total > 0.0 { held / total } else { 0.0 }
    }

    /// The number of largest elements that hold `share` of the energy.
    fn count_for_share(&self, share: f64) -> f64 {
        let mut missing = share * self.energy();
        let mut counted = 0.0;
        for (count, energy) in self.largest_first() {
            if energy >= missing {
                return counted + count * missing / energy;
            }
            missing -= energy;
            counted += count;
        }
        counted
    }

    fn largest_first(&self) -> impl Iterator<Item = (f64, f64)> {
        let classes = self.classes.iter().rev().filter(|(count, _)| *count > 0);
        classes.map(|&(count, energy)| (count as f64, energy))
    }
}

/// The section of figure 2.
///
/// # Errors
/// [`StudyError`] if a chart, a picture or a table cannot be written.
pub fn sparsity(
    name: &str,
    known: &impl KnownTransport,
    executor: &impl Executor,
    progress: ProgressLog,
) -> Result<ReportSection, StudyError> {
    progress(&format!("{name}: structure of the transport"));
    let geometry = known.geometry();
    let rows = executor.map(geometry.camera.height as usize, |y| {
        survey_row(known, y as u32)
    });
    let mut whole = SparsityProfile::default();
    let mut overview = vec![0.0f32; (OVERVIEW_SIDE * OVERVIEW_SIDE) as usize];
    let mut energies = Vec::with_capacity(geometry.camera.area());
    for row in rows {
        whole.merge(&row.profile);
        for (cell, value) in row.overview {
            overview[cell] = overview[cell].max(value);
        }
        energies.extend(row.energies);
    }
    let pixel = median_pixel(geometry.camera, &energies);
    let mut tau = vec![[0.0; CHANNELS]; geometry.window.area()];
    known.transport_function(pixel, &mut tau);
    let mut example = SparsityProfile::default();
    tau.as_flattened().iter().for_each(|&t| example.add(t));

    let mut section = ReportSection::new(&format!("Figure 2: structure of the transport, {name}"));
    let side = geometry.window.side();
    section.add_paragraph(&format!(
        "Camera {}, light {}, window {side}x{side}: {} of the matrix's {:.1e} elements lie in the \
         band ({:.2} %).",
        geometry.camera,
        geometry.light,
        geometry.camera.area() * geometry.window.area(),
        geometry.camera.area() as f64 * geometry.light.area() as f64,
        100.0 * geometry.window.area() as f64 / geometry.light.area() as f64,
    ));
    profile_chart(name, geometry, &whole, &example, &mut section)?;
    let panels = vec![
        CaptionedPanel {
            panel: grey_panel(Extent::new(OVERVIEW_SIDE, OVERVIEW_SIDE), &overview),
            caption: "T: pixels horizontally, light elements\nvertically, maximum of each cell"
                .to_owned(),
        },
        zoomed_part(known),
        CaptionedPanel {
            panel: function_panel(side, &tau),
            caption: format!(
                "Light transport function of pixel {}, {}:\n{side} x {side} light elements",
                pixel.x, pixel.y
            ),
        },
    ];
    let sheet = PictureSheet {
        columns: vec![String::new(); 3],
        rows: vec![(String::new(), panels)],
        side_px: 300,
    };
    section.add_picture(
        &format!("{name}-figure2-band"),
        &format!(
            "The band of the transport of {name}, a zoom into it, and one light transport function"
        ),
        sheet.svg()?,
    );
    Ok(section)
}

/// The statistics of one row of camera pixels.
#[derive(Default)]
struct CameraRowSparsity {
    profile: SparsityProfile,
    /// The largest element in each cell of the overview.
    overview: BTreeMap<usize, f32>,
    energies: Vec<f32>,
}

fn survey_row(known: &impl KnownTransport, y: u32) -> CameraRowSparsity {
    let geometry = known.geometry();
    let mut row = CameraRowSparsity::default();
    let mut tau = vec![[0.0; CHANNELS]; geometry.window.area()];
    let scale = |i: usize, of: usize| i * OVERVIEW_SIDE as usize / of;
    for x in 0..geometry.camera.width {
        let pixel = CameraPixel { x, y };
        known.transport_function(pixel, &mut tau);
        let column = scale(geometry.camera.index(pixel), geometry.camera.area());
        let elements = tau.as_flattened().iter();
        row.energies.push(elements.clone().map(|t| t * t).sum());
        elements.for_each(|&t| row.profile.add(t));
        for (s, m) in geometry.elements_of_window(known.origin(pixel)) {
            let cell = scale(m, geometry.light.area()) * OVERVIEW_SIDE as usize + column;
            let maximum = row.overview.entry(cell).or_insert(0.0f32);
            *maximum = maximum.max(mean(tau[s]));
        }
    }
    row
}

fn profile_chart(
    name: &str,
    geometry: &Geometry,
    whole: &SparsityProfile,
    example: &SparsityProfile,
    section: &mut ReportSection,
) -> Result<(), StudyError> {
    let functions = (geometry.camera.area() * CHANNELS) as f64;
    let area = geometry.window.area() as f64;
    let series = |name: &str, profile: &SparsityProfile, functions: f64| {
        let first: f64 = 0.1;
        let points = (0..=CURVE_POINTS)
            .map(|i| first * (area / first).powf(i as f64 / CURVE_POINTS as f64))
            .map(|k| (k, 100.0 * profile.share_of_largest(k * functions)));
        ChartSeries {
            name: name.to_owned(),
            points: points.collect(),
        }
    };
    let series = vec![
        series("all of T", whole, functions),
        series("the function below", example, CHANNELS as f64),
    ];
    let mut data = MarkdownTable::new(
        "largest_elements_per_function | energy_percent_whole | energy_percent_one",
    );
    for (whole, example) in series[0].points.iter().zip(&series[1].points) {
        data.add_row([
            format!("{:.4}", whole.0),
            format!("{:.3}", whole.1),
            format!("{:.3}", example.1),
        ]);
    }
    let mut table =
        MarkdownTable::new("energy | elements per function, all of T | the function below");
    for share in ENERGY_SHARES {
        table.add_row([
            format!("{} %", 100.0 * share),
            format!("{:.1}", whole.count_for_share(share) / functions),
            format!("{:.1}", example.count_for_share(share) / CHANNELS as f64),
        ]);
    }
    let ticks = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0].into_iter();
    let chart = LineChart {
        title: &format!("Sparsity profile of T, {name}"),
        x_label: "largest elements kept, per light transport function and channel",
        y_label: "energy held (%)",
        x_ticks: ticks.filter(|tick| *tick <= area).collect(),
        top: None,
        y: 0.0..100.0,
        reference: None,
        series,
    };
    section.add_picture(
        &format!("{name}-figure2-profile"),
        &format!("Share of the energy of {name} held by its largest elements"),
        chart.svg()?,
    );
    section.add_csv(&format!("{name}-figure2"), &data)?;
    section.add_paragraph(&table.markdown());
    Ok(())
}

/// A small part of T: consecutive pixels of the camera's middle row, and consecutive elements of the row of the light
/// plane behind them.
fn zoomed_part(known: &impl KnownTransport) -> CaptionedPanel {
    let geometry = known.geometry();
    let half = (geometry.window.side() / 2) as i32;
    let width = geometry.camera.width.min(ZOOM_SIDE);
    let height = geometry.light.width.min(ZOOM_SIDE);
    let left = (geometry.camera.width - width) / 2;
    let y = geometry.camera.height / 2;
    let x = left + width / 2;
    let middle = known.origin(CameraPixel { x, y });
    let row = middle.v + half;
    let max_first = (geometry.light.width - height) as i32;
    let first = (middle.u + half - height as i32 / 2).clamp(0, max_first);
    let mut values = vec![0.0f32; (width * height) as usize];
    let mut tau = vec![[0.0; CHANNELS]; geometry.window.area()];
    for i in 0..width {
        let pixel = CameraPixel { x: left + i, y };
        let origin = known.origin(pixel);
        known.transport_function(pixel, &mut tau);
        for (s, tau) in tau.iter().enumerate() {
            let element = geometry.window.element(origin, s);
            let line = element.u - first;
            if element.v == row && (0..height as i32).contains(&line) {
                values[(line as u32 * width + i) as usize] = mean(*tau);
            }
        }
    }
    let caption =
        format!("Detail: {width} pixels of row {y},\n{height} light elements of row {row}");
    let panel = grey_panel(Extent::new(width, height), &values);
    CaptionedPanel { panel, caption }
}

/// The pixel whose function has the median energy, among those in the centre of the picture, whose windows are inside the
/// light plane.
fn median_pixel(camera: Extent, energies: &[f32]) -> CameraPixel {
    let middle = |side: u32| side / 4..(3 * side).div_ceil(4);
    let row = |y: u32| middle(camera.width).map(move |x| CameraPixel { x, y });
    let mut pixels: Vec<CameraPixel> = middle(camera.height).flat_map(row).collect();
    let energy = |pixel: &CameraPixel| energies[camera.index(*pixel)];
    pixels.sort_by(|a, b| energy(a).total_cmp(&energy(b)));
    pixels[pixels.len() / 2]
}

/// One function in colour, scaled to its maximum.
fn function_panel(side: u32, tau: &[[f32; CHANNELS]]) -> PanelImage {
    let peak = tau.as_flattened().iter().fold(0.0f32, |a, &b| a.max(b));
    let scale = 1.0 / f64::from(peak.max(f32::MIN_POSITIVE));
    let linear = tau.iter().map(|t| t.map(|t| f64::from(t) * scale));
    PanelImage {
        is_data: true,
        ..PanelImage::photograph(Extent::new(side, side), linear)
    }
}

/// Elements in grey, on a logarithmic scale over three decades.
fn grey_panel(extent: Extent, values: &[f32]) -> PanelImage {
    let peak = values.iter().fold(0.0f32, |a, &b| a.max(b));
    let code = |v: f32| {
        let decades = (v / peak.max(f32::MIN_POSITIVE)).log10();
        (255.0 * (1.0 + decades / 3.0).clamp(0.0, 1.0)) as u8
    };
    PanelImage {
        extent,
        rgb: values.iter().flat_map(|&v| [code(v); 3]).collect(),
        is_data: true,
    }
}

fn mean(tau: [f32; CHANNELS]) -> f32 {
    tau.iter().sum::<f32>() / CHANNELS as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profile_returns_shares_and_counts() {
        let mut profile = SparsityProfile::default();
        // Energies 16, 4, 1, 1 and 0.
        for element in [2.0, -4.0, 1.0, 0.0, 1.0] {
            profile.add(element);
        }
        assert_eq!(profile.classes.iter().map(|class| class.0).sum::<u64>(), 4);
        for (k, energy) in [
            (0.0, 0.0),
            (1.0, 16.0),
            (1.5, 18.0),
            (2.0, 20.0),
            (3.0, 21.0),
        ] {
            assert!((profile.share_of_largest(k) - energy / 22.0).abs() < 1e-12);
            if energy > 0.0 {
                assert!((profile.count_for_share(energy / 22.0) - k).abs() < 1e-9);
            }
        }
        assert_eq!(profile.share_of_largest(4.0), 1.0);
        assert_eq!(profile.share_of_largest(99.0), 1.0);
    }

    #[test]
    fn merged_profiles_equal_one_profile() {
        let (mut a, mut b, mut both) =
            <(SparsityProfile, SparsityProfile, SparsityProfile)>::default();
        for i in 0..50 {
            let (x, y) = (i as f32, 1.0 / (1 + i) as f32);
            a.add(x);
            b.add(y);
            both.add(x);
            both.add(y);
        }
        a.merge(&b);
        for k in [1.0, 7.0, 60.0] {
            assert!((a.share_of_largest(k) - both.share_of_largest(k)).abs() < 1e-12);
        }
    }
}
