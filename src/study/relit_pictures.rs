//! Relit pictures beside true ones (paper, figures 4 and 5).

use std::sync::atomic::{AtomicUsize, Ordering};

use super::error::StudyError;
use super::known_transport::{known_picture, relight_pixel};
use super::method_sample_sizes::{self, DEFAULT_METHOD};
use super::picture_sheet::{CaptionedPanel, PanelImage, PictureSheet};
use super::section::{MarkdownTable, ProgressLog, ReportSection, snr_cell};
use crate::capture::Measurements;
use crate::job_executor::Executor;
use crate::recover::{PreparedRecovery, RecoverySettings};
use crate::relight::{BuiltinLight, Light, area_resample};
use crate::transport::{CHANNELS, Decibels, Extent, KnownTransport, Tile};

/// Largest width and height of a picture on the sheet.
const MAX_PANEL_SIDE_PX: u32 = 200;
/// Factor on errors, to make them visible.
const ERROR_GAIN: f64 = 10.0;
/// Share of the flood-lit samples that may be overexposed.
const OVEREXPOSED_SHARE: f64 = 0.01;

/// A light and, if there is one, the true picture under it.
pub struct EvaluationLight {
    /// The name of the light.
    pub name: String,
    /// The emissions.
    pub light: Light,
    /// The true picture, `[N]`, in units of the measurement; `None` to compute it from the known transport.
    pub photographed: Option<Vec<[f64; CHANNELS]>>,
}

/// The five built-in lights that correspond to the paper's.
pub fn built_in_lights(light: Extent) -> Vec<EvaluationLight> {
    let lights = BuiltinLight::BY_NAME.into_iter();
    let of_paper = lights.filter(|(_, builtin)| *builtin != BuiltinLight::Torch);
    let relit = of_paper.map(|(name, builtin)| EvaluationLight {
        name: name.to_owned(),
        light: builtin.render(light),
        photographed: None,
    });
    relit.collect()
}

/// The section of figures 4 and 5: recovers the transport by the default method and relights it.
///
/// # Errors
/// Those of [`PreparedRecovery::prepare`], and [`StudyError`] if a picture or a table cannot be written.
pub fn relit_pictures(
    name: &str,
    known: &impl KnownTransport,
    measurements: &Measurements,
    lights: Vec<EvaluationLight>,
    executor: &impl Executor,
    progress: ProgressLog,
) -> Result<ReportSection, StudyError> {
    let patterns = measurements.patterns.len();
    progress(&format!(
        "{name}: relighting, recovered by {} from {patterns} patterns",
        method_sample_sizes::name(DEFAULT_METHOD)
    ));
    let report_tenths = |tenths: usize| progress(&format!("{name}: relighting, {tenths}0 %"));
    let (truth, relit) = pictures(known, measurements, &lights, executor, &report_tenths)?;
    let camera = measurements.camera;
    let flood: Vec<f64> = truth
        .iter()
        .max_by(|a, b| total(a).total_cmp(&total(b)))
        .map_or(Vec::new(), |brightest| brightest.as_flattened().to_vec());
    let exposure = exposure_for(flood);

    let mut section = ReportSection::new(&format!("Figures 4 and 5: relit pictures, {name}"));
    section.add_paragraph(&format!(
        "Recovered by `{}` from {patterns} patterns. PSNR is against the true pictures, peak 1 in \
         units of the measurement, over all pixels and channels.",
        method_sample_sizes::name(DEFAULT_METHOD)
    ));
    let mut table = MarkdownTable::new("light | psnr_db | true_mean | method | patterns");
    let mut psnr_table = MarkdownTable::new("light | PSNR (dB)");
    let error_name = format!("error × {ERROR_GAIN}");
    let mut rows =
        ["light", "true", "relit", &error_name].map(|name| (name.to_owned(), Vec::new()));
    for (i, light) in lights.iter().enumerate() {
        let psnr = psnr(&truth[i], &relit[i]);
        let mean = total(&truth[i]) / (camera.area() * CHANNELS) as f64;
        table.add_row([
            light.name.clone(),
            snr_cell(psnr),
            format!("{mean:.4}"),
            method_sample_sizes::name(DEFAULT_METHOD).to_owned(),
            patterns.to_string(),
        ]);
        psnr_table.add_row([light.name.clone(), snr_cell(psnr)]);
        let emitted = light.light.elements().iter();
        let emitted = emitted.map(|e| [0, 1, 2].map(|c| f64::from(e[c])));
        let photograph = |extent, picture: &[[f64; CHANNELS]]| {
            PanelImage::photograph(extent, picture.iter().map(|y| y.map(|y| y * exposure)))
        };
        let error: Vec<[f64; CHANNELS]> = truth[i]
            .iter()
            .zip(&relit[i])
            .map(|(t, r)| std::array::from_fn(|c| ERROR_GAIN * (t[c] - r[c]).abs()))
            .collect();
        for (kind, picture) in [("true", &truth[i]), ("relit", &relit[i])] {
            let path = format!("pictures/{name}-{kind}-{}.png", light.name);
            let png = photograph(camera, picture).png()?;
            section.files.push((path, png));
        }
        let small = |picture: &[[f64; CHANNELS]]| {
            let (extent, picture) = downsample(camera, picture);
            photograph(extent, &picture)
        };
        let light_panel = PanelImage {
            // Light elements of a small light plane are visible squares.
            is_data: light.light.extent().width <= MAX_PANEL_SIDE_PX / 2,
            ..PanelImage::photograph(light.light.extent(), emitted)
        };
        let panels = [
            (light_panel, String::new()),
            (small(&truth[i]), String::new()),
            (small(&relit[i]), format!("PSNR {} dB", snr_cell(psnr))),
            (small(&error), String::new()),
        ];
        for ((_, row), (panel, caption)) in rows.iter_mut().zip(panels) {
            row.push(CaptionedPanel { panel, caption });
        }
    }
    let sheet = PictureSheet {
        columns: lights.iter().map(|light| light.name.clone()).collect(),
        rows: rows.into(),
        side_px: MAX_PANEL_SIDE_PX,
    };
    section.add_picture(
        &format!("{name}-figure4"),
        &format!("{name} under five lights: the light, the true picture, the relit one, the error"),
        sheet.svg()?,
    );
    section.add_paragraph(&psnr_table.markdown());
    section.add_csv(&format!("{name}-figure4"), &table)?;
    Ok(section)
}

/// One picture for each light, `[light][pixel]`.
type PicturesByLight = Vec<Vec<[f64; CHANNELS]>>;

/// The true pictures, and those from the recovered transport.
fn pictures(
    known: &impl KnownTransport,
    measurements: &Measurements,
    lights: &[EvaluationLight],
    executor: &impl Executor,
    report_tenths: &(impl Fn(usize) + Sync),
) -> Result<(PicturesByLight, PicturesByLight), StudyError> {
    let settings = RecoverySettings {
        method: DEFAULT_METHOD,
        window: known.geometry().window,
        is_registered: true,
    };
    let preparation = PreparedRecovery::prepare(measurements, settings, executor);
    let recovery = pollster::block_on(preparation)?;
    let geometry = recovery.geometry();
    let basis = recovery.basis().cloned().unwrap_or_default();
    let area = geometry.window.area();
    let rects: Vec<_> = geometry.tiles().collect();
    let done = AtomicUsize::new(0);
    let tiles = executor.map(rects.len(), |i| {
        let tile = recovery.tile(measurements, rects[i]);
        // Quantised as in a file.
        let functions = Tile::quantise(&tile, basis.rank()).functions(geometry, &basis);
        let pictures = lights.iter().map(|light| {
            let truth = match &light.photographed {
                Some(picture) => {
                    let pixels = rects[i].pixels().map(|p| geometry.camera.index(p));
                    pixels.map(|n| picture[n]).collect()
                }
                None => known_picture(known, rects[i], &light.light),
            };
            let relit = functions.tau.chunks_exact(area).zip(rects[i].pixels());
            let relit = relit.map(|(tau, pixel)| {
                relight_pixel(geometry, geometry.window_origin(pixel), tau, &light.light)
            });
            (truth, relit.collect())
        });
        let pictures: Vec<(Vec<_>, Vec<_>)> = pictures.collect();
        let before = done.fetch_add(1, Ordering::Relaxed);
        let tenths = |tiles: usize| 10 * tiles / rects.len();
        if tenths(before + 1) > tenths(before) {
            report_tenths(tenths(before + 1));
        }
        pictures
    });
    let black = vec![vec![[0.0; CHANNELS]; geometry.camera.area()]; lights.len()];
    let (mut truth, mut relit) = (black.clone(), black);
    for (rect, pictures) in rects.iter().zip(tiles) {
        for (i, (tile_truth, tile_relit)) in pictures.into_iter().enumerate() {
            for (p, pixel) in rect.pixels().enumerate() {
                let n = geometry.camera.index(pixel);
                (truth[i][n], relit[i][n]) = (tile_truth[p], tile_relit[p]);
            }
        }
    }
    Ok((truth, relit))
}

fn total(picture: &[[f64; CHANNELS]]) -> f64 {
    picture.as_flattened().iter().sum()
}

/// PSNR of a relit picture with a peak of 1: 10 log10(1 / mean squared error); `None` if the error is zero.
pub fn psnr(truth: &[[f64; CHANNELS]], relit: &[[f64; CHANNELS]]) -> Option<Decibels> {
    let pairs = truth.as_flattened().iter().zip(relit.as_flattened());
    let squares: f64 = pairs.map(|(t, r)| (t - r).powi(2)).sum();
    let mse = squares / (truth.len() * CHANNELS) as f64;
    (mse > 0.0).then(|| Decibels(-10.0 * mse.log10()))
}

/// The exposure at which all but a small share of `samples` are at most 1.
fn exposure_for(mut samples: Vec<f64>) -> f64 {
    samples.sort_by(f64::total_cmp);
    let last = (samples.len() as f64 * (1.0 - OVEREXPOSED_SHARE)) as usize;
    match samples.get(last.min(samples.len().saturating_sub(1))) {
        Some(&white) if white > 0.0 => 1.0 / white,
        _ => 1.0,
    }
}

/// Downsamples a picture to the size of a panel.
fn downsample(extent: Extent, picture: &[[f64; CHANNELS]]) -> (Extent, Vec<[f64; CHANNELS]>) {
    let longer = extent.width.max(extent.height);
    if longer <= MAX_PANEL_SIDE_PX {
        return (extent, picture.to_vec());
    }
    let to = Extent::new(
        (extent.width * MAX_PANEL_SIDE_PX / longer).max(1),
        (extent.height * MAX_PANEL_SIDE_PX / longer).max(1),
    );
    let values: Vec<f32> = picture.as_flattened().iter().map(|&v| v as f32).collect();
    let small = area_resample(&values, extent, to);
    let rgb = small.as_chunks::<CHANNELS>().0.iter();
    (to, rgb.map(|p| p.map(f64::from)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn psnr_follows_from_the_mean_squared_error() {
        let truth = vec![[0.5; 3]; 4];
        let off = vec![[0.51; 3]; 4];
        assert!((psnr(&truth, &off).unwrap().0 - 40.0).abs() < 1e-9);
        assert_eq!(psnr(&truth, &truth), None);
    }

    #[test]
    fn exposure_ignores_few_highlights() {
        let samples: Vec<f64> = (0..1000).map(f64::from).collect();
        assert_eq!(exposure_for(samples), 1.0 / 990.0);
        assert_eq!(exposure_for(vec![0.0; 9]), 1.0);
        assert_eq!(exposure_for(Vec::new()), 1.0);
    }
}
