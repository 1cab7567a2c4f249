//! The structure of a transport (paper, figure 2): how few elements hold its energy, where they lie
//! in the matrix, and what one light transport function looks like.

use super::chart::{Chart, Series};
use super::known::Known;
use super::report::{Section, Table};
use super::sheet::{Captioned, Panel, Sheet};
use super::{Progress, StudyError};
use crate::executor::Executor;
use crate::transport::{CHANNELS, CameraPx, Extent, Geometry};

/// Low mantissa bits that do not count: elements within 1/64 of each other are one class.
const DROPPED_BITS: u32 = 17;
const CLASSES: usize = 1 << (31 - DROPPED_BITS);
/// Points of a profile's curve.
const POINTS: usize = 120;
/// Shares of the energy that the table tells of.
const SHARES: [f64; 4] = [0.5, 0.9, 0.99, 0.999];
/// Side of the picture of the whole matrix, in cells.
const PICTURE: u32 = 512;
/// Side of the zoom, in pixels and elements.
const ZOOM: u32 = 96;

/// How the energy (the sum of squares) of many elements is spread over them: a histogram of their
/// magnitudes, fine enough that shares are exact to about a percent of an element's energy.
#[derive(Clone, Debug)]
pub struct SparsityProfile {
    /// By class of magnitude, rising.
    counts: Vec<u64>,
    energies: Vec<f64>,
    zeros: u64,
}

impl Default for SparsityProfile {
    fn default() -> Self {
        Self {
            counts: vec![0; CLASSES],
            energies: vec![0.0; CLASSES],
            zeros: 0,
        }
    }
}

impl SparsityProfile {
    /// Adds one element.
    pub fn add(&mut self, element: f32) {
        if element == 0.0 {
            self.zeros += 1;
            return;
        }
        // The bits of a float, its sign aside, rise with its magnitude.
        let class = (element.abs().to_bits() >> DROPPED_BITS) as usize;
        self.counts[class] += 1;
        self.energies[class] += f64::from(element).powi(2);
    }

    /// Joins what was gathered elsewhere.
    pub fn merge(&mut self, other: &Self) {
        for class in 0..CLASSES {
            self.counts[class] += other.counts[class];
            self.energies[class] += other.energies[class];
        }
        self.zeros += other.zeros;
    }

    /// Elements added, zeros included.
    pub fn len(&self) -> u64 {
        self.zeros + self.counts.iter().sum::<u64>()
    }

    /// Whether nothing was added.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Share of the energy that the `k` largest elements hold, 0 to 1.
    pub fn share_of_largest(&self, k: f64) -> f64 {
        let total: f64 = self.energies.iter().sum();
        let (mut left, mut held) = (k, 0.0);
        for (count, energy) in self.largest_first() {
            let taken = (left / count).min(1.0);
            held += taken * energy;
            left -= count;
            if left <= 0.0 {
                break;
            }
        }
        if total > 0.0 { held / total } else { 0.0 }
    }

    /// How many of the largest elements hold `share` of the energy.
    pub fn largest_holding(&self, share: f64) -> f64 {
        let mut missing = share * self.energies.iter().sum::<f64>();
        let mut taken = 0.0;
        for (count, energy) in self.largest_first() {
            if energy >= missing {
                return taken + count * missing / energy;
            }
            missing -= energy;
            taken += count;
        }
        taken
    }

    fn largest_first(&self) -> impl Iterator<Item = (f64, f64)> {
        let classes = self.counts.iter().zip(&self.energies).rev();
        classes
            .filter(|(count, _)| **count > 0)
            .map(|(&count, &energy)| (count as f64, energy))
    }
}

/// Figure 2.
pub fn sparsity(
    name: &str,
    known: &impl Known,
    executor: &impl Executor,
    progress: Progress,
) -> Result<Section, StudyError> {
    progress(&format!("{name}: structure of the transport"));
    let geometry = known.geometry();
    let rows = executor.map(geometry.camera.height as usize, |y| {
        survey_row(known, y as u32)
    });
    let mut whole = SparsityProfile::default();
    let mut overview = vec![0.0f32; (PICTURE * PICTURE) as usize];
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
    let mut one = SparsityProfile::default();
    tau.as_flattened().iter().for_each(|&t| one.add(t));

    let mut section = Section::new(&format!("Figure 2: structure of the transport, {name}"));
    let side = geometry.window.side();
    section.paragraph(&format!(
        "Camera {}, light {}, window {side}x{side}: {} of the matrix's {:.1e} elements lie in the \
         band ({:.2} %).",
        geometry.camera,
        geometry.light,
        geometry.camera.area() * geometry.window.area(),
        geometry.camera.area() as f64 * geometry.light.area() as f64,
        100.0 * geometry.window.area() as f64 / geometry.light.area() as f64,
    ));
    profile_chart(name, geometry, &whole, &one, &mut section)?;
    let sheet = Sheet {
        columns: vec![String::new(); 3],
        rows: vec![(
            String::new(),
            vec![
                Captioned {
                    panel: grey(extent(PICTURE, PICTURE), &overview),
                    caption: vec![
                        "T, whole: pixels across, light elements".to_owned(),
                        "down, brightest element of each cell".to_owned(),
                    ],
                },
                zoom(known),
                Captioned {
                    panel: function_panel(side, &tau),
                    caption: vec![
                        format!(
                            "Light transport function of pixel {}, {}:",
                            pixel.x, pixel.y
                        ),
                        format!("{side} x {side} light elements"),
                    ],
                },
            ],
        )],
        side: 300,
    };
    section.picture(
        &format!("{name}-figure2-band"),
        &format!(
            "The band of the transport of {name}, a zoom into it, and one light transport function"
        ),
        sheet.svg()?,
    );
    Ok(section)
}

/// What one row of camera pixels adds to the survey.
struct Row {
    profile: SparsityProfile,
    /// Cells of the overview and their brightest elements.
    overview: Vec<(usize, f32)>,
    energies: Vec<f32>,
}

fn survey_row(known: &impl Known, y: u32) -> Row {
    let geometry = known.geometry();
    let mut row = Row {
        profile: SparsityProfile::default(),
        overview: Vec::new(),
        energies: Vec::new(),
    };
    let mut tau = vec![[0.0; CHANNELS]; geometry.window.area()];
    let scale = |i: usize, of: usize| i * PICTURE as usize / of;
    let mut cells = std::collections::BTreeMap::new();
    for x in 0..geometry.camera.width {
        let pixel = CameraPx { x, y };
        known.transport_function(pixel, &mut tau);
        let origin = known.origin(pixel);
        let column = scale(geometry.camera.index(pixel), geometry.camera.area());
        let mut energy = 0.0;
        for (s, tau) in tau.iter().enumerate() {
            tau.iter().for_each(|&t| row.profile.add(t));
            energy += tau.iter().map(|t| t * t).sum::<f32>();
            if let Some(m) = geometry.window.element(origin, s).index_in(geometry.light) {
                let cell = scale(m, geometry.light.area()) * PICTURE as usize + column;
                let brightest = cells.entry(cell).or_insert(0.0f32);
                *brightest = brightest.max(mean(*tau));
            }
        }
        row.energies.push(energy);
    }
    row.overview = cells.into_iter().collect();
    row
}

fn profile_chart(
    name: &str,
    geometry: &Geometry,
    whole: &SparsityProfile,
    one: &SparsityProfile,
    section: &mut Section,
) -> Result<(), StudyError> {
    let functions = (geometry.camera.area() * CHANNELS) as f64;
    let area = geometry.window.area() as f64;
    let curve = |profile: &SparsityProfile, functions: f64| -> Vec<(f64, f64)> {
        let least: f64 = 0.1;
        (0..=POINTS)
            .map(|i| least * (area / least).powf(i as f64 / POINTS as f64))
            .map(|k| (k, 100.0 * profile.share_of_largest(k * functions)))
            .collect()
    };
    let series = [
        ("all of T", whole, functions),
        ("the one function below", one, CHANNELS as f64),
    ]
    .map(|(name, profile, functions)| Series {
        name: name.to_owned(),
        points: curve(profile, functions),
        marked: false,
    });
    let mut data = Table::new(&[
        "largest_elements_per_function",
        "energy_percent_whole",
        "energy_percent_one",
    ]);
    for (whole, one) in series[0].points.iter().zip(&series[1].points) {
        data.row([
            format!("{:.4}", whole.0),
            format!("{:.3}", whole.1),
            format!("{:.3}", one.1),
        ]);
    }
    let mut table = Table::new(&[
        "energy",
        "elements a function, all of T",
        "the one function",
    ]);
    for share in SHARES {
        table.row([
            format!("{} %", 100.0 * share),
            format!("{:.1}", whole.largest_holding(share) / functions),
            format!("{:.1}", one.largest_holding(share) / CHANNELS as f64),
        ]);
    }
    let chart = Chart {
        title: &format!("Sparsity profile of T, {name}"),
        x_label: "largest elements kept, per light transport function and channel",
        y_label: "energy held (%)",
        x_ticks: [0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0]
            .into_iter()
            .filter(|tick| *tick <= area)
            .collect(),
        top: None,
        y: 0.0..100.0,
        level: None,
        series: series.into(),
    };
    section.picture(
        &format!("{name}-figure2-profile"),
        &format!("Share of the energy of {name} held by its largest elements"),
        chart.svg()?,
    );
    section.data(&format!("{name}-figure2"), &data)?;
    section.paragraph(&table.markdown());
    Ok(())
}

/// A small square of T: consecutive pixels of the middle row, and consecutive elements of the
/// display row behind them.
fn zoom(known: &impl Known) -> Captioned {
    let geometry = known.geometry();
    let half = (geometry.window.side() / 2) as i32;
    let width = geometry.camera.width.min(ZOOM);
    let height = geometry.light.width.min(ZOOM);
    let (left, y) = (
        (geometry.camera.width - width) / 2,
        geometry.camera.height / 2,
    );
    let middle = known.origin(CameraPx {
        x: left + width / 2,
        y,
    });
    let row = middle.v + half;
    let last_first = (geometry.light.width - height) as i32;
    let first = (middle.u + half - height as i32 / 2).clamp(0, last_first);
    let mut values = vec![0.0f32; (width * height) as usize];
    let mut tau = vec![[0.0; CHANNELS]; geometry.window.area()];
    for i in 0..width {
        let pixel = CameraPx { x: left + i, y };
        let origin = known.origin(pixel);
        known.transport_function(pixel, &mut tau);
        for (s, tau) in tau.iter().enumerate() {
            let element = geometry.window.element(origin, s);
            let down = element.u - first;
            if element.v == row && (0..height as i32).contains(&down) {
                values[(down as u32 * width + i) as usize] = mean(*tau);
            }
        }
    }
    Captioned {
        panel: grey(extent(width, height), &values),
        caption: vec![
            format!("Zoom: {width} pixels of row {y} across,"),
            format!("{height} elements of row {row} down"),
        ],
    }
}

/// The pixel whose function has the median energy, of those in the middle of the picture, whose
/// windows no border cuts.
fn median_pixel(camera: Extent, energies: &[f32]) -> CameraPx {
    let middle = |side: u32| side / 4..(3 * side).div_ceil(4);
    let mut pixels: Vec<CameraPx> = middle(camera.height)
        .flat_map(|y| middle(camera.width).map(move |x| CameraPx { x, y }))
        .collect();
    let energy = |pixel: &CameraPx| energies[camera.index(*pixel)];
    pixels.sort_by(|a, b| energy(a).total_cmp(&energy(b)));
    pixels[pixels.len() / 2]
}

/// One function in colour, its brightest value white.
fn function_panel(side: u32, tau: &[[f32; CHANNELS]]) -> Panel {
    let peak = tau.as_flattened().iter().fold(0.0f32, |a, &b| a.max(b));
    let scale = if peak > 0.0 {
        1.0 / f64::from(peak)
    } else {
        0.0
    };
    let linear = tau.iter().map(|t| t.map(|t| f64::from(t) * scale));
    Panel {
        data: true,
        ..Panel::photograph(extent(side, side), linear)
    }
}

/// Elements in grey on black, over three decades of brightness.
fn grey(extent: Extent, values: &[f32]) -> Panel {
    let peak = values.iter().fold(0.0f32, |a, &b| a.max(b));
    let code = |v: f32| {
        let decades = (v / peak.max(f32::MIN_POSITIVE)).log10();
        (255.0 * (1.0 + decades / 3.0).clamp(0.0, 1.0)) as u8
    };
    Panel {
        extent,
        rgb: values.iter().flat_map(|&v| [code(v); 3]).collect(),
        data: true,
    }
}

fn extent(width: u32, height: u32) -> Extent {
    Extent { width, height }
}

fn mean(tau: [f32; CHANNELS]) -> f32 {
    tau.iter().sum::<f32>() / CHANNELS as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_elements_hold_what_they_hold() {
        let mut profile = SparsityProfile::default();
        // Energies 16, 4, 1, 1 and nothing.
        for element in [2.0, -4.0, 1.0, 0.0, 1.0] {
            profile.add(element);
        }
        assert_eq!(profile.len(), 5);
        for (k, energy) in [
            (0.0, 0.0),
            (1.0, 16.0),
            (1.5, 18.0),
            (2.0, 20.0),
            (3.0, 21.0),
        ] {
            assert!((profile.share_of_largest(k) - energy / 22.0).abs() < 1e-12);
            if energy > 0.0 {
                assert!((profile.largest_holding(energy / 22.0) - k).abs() < 1e-9);
            }
        }
        assert_eq!(profile.share_of_largest(4.0), 1.0);
        assert_eq!(profile.share_of_largest(99.0), 1.0);
    }

    #[test]
    fn profiles_join() {
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
