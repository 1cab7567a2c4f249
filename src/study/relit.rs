//! Relit pictures next to true ones (paper, figures 4 and 5).

use std::sync::atomic::{AtomicUsize, Ordering};

use super::known::{Known, expose, pixel_under};
use super::methods::{self, DEFAULT};
use super::report::{Section, Table, cell};
use super::sheet::{Captioned, Panel, Sheet};
use super::{Progress, StudyError};
use crate::capture::Measurements;
use crate::executor::Executor;
use crate::recover::{Recovery, Settings};
use crate::relight::{BuiltinLight, Light, area_resample};
use crate::transport::{BandTile, CHANNELS, Decibels, Extent, Tile};

/// Widest picture on a sheet, in pixels.
const SHOWN: u32 = 200;
/// What errors are multiplied by to be seen.
const ERROR_GAIN: f64 = 10.0;
/// Share of the flood-lit samples that are white at most.
const HIGHLIGHTS: f64 = 0.01;

/// A light and the true picture under it.
pub struct RelitLight {
    /// The name it is known by.
    pub name: String,
    /// What the elements emit.
    pub light: Light,
    /// The picture, `[N]`, in units of the measurement, where it is not to be computed from the
    /// known transport.
    pub photographed: Option<Vec<[f64; CHANNELS]>>,
}

/// The paper's five lights, for scenes.
pub fn built_in_lights(light: Extent) -> Vec<RelitLight> {
    [
        BuiltinLight::Flood,
        BuiltinLight::Checkerboard,
        BuiltinLight::Stripes,
        BuiltinLight::Spectrum,
        BuiltinLight::Fire,
    ]
    .map(|builtin| RelitLight {
        name: builtin.name().to_owned(),
        light: builtin.render(light),
        photographed: None,
    })
    .into()
}

/// Figures 4 and 5: recovers the whole transport by the default method and relights it.
pub fn relit_pictures(
    name: &str,
    known: &impl Known,
    measurements: &Measurements,
    lights: Vec<RelitLight>,
    executor: &impl Executor,
    progress: Progress,
) -> Result<Section, StudyError> {
    let patterns = measurements.patterns.len();
    progress(&format!(
        "{name}: relighting, recovered by {} from {patterns} patterns",
        methods::name(DEFAULT)
    ));
    let tenth = |tenths: usize| progress(&format!("{name}: relighting, {tenths}0 %"));
    let (truth, ours) = pictures(known, measurements, &lights, executor, &tenth)?;
    let camera = measurements.camera;
    let flood: Vec<f64> = truth
        .iter()
        .max_by(|a, b| total(a).total_cmp(&total(b)))
        .map_or(Vec::new(), |brightest| brightest.as_flattened().to_vec());
    let exposure = exposure_for(flood);

    let mut section = Section::new(&format!("Figures 4 and 5: relit pictures, {name}"));
    section.paragraph(&format!(
        "Recovered by `{}` from {patterns} patterns. PSNR is against the true pictures, peak 1 in \
         units of the measurement, over all pixels and channels.",
        methods::name(DEFAULT)
    ));
    let mut table = Table::new(&["light", "psnr_db", "true_mean", "method", "patterns"]);
    let mut shown = Table::new(&["light", "PSNR (dB)"]);
    let mut rows = [
        ("light".to_owned(), Vec::new()),
        ("true".to_owned(), Vec::new()),
        ("relit".to_owned(), Vec::new()),
        (format!("error × {ERROR_GAIN}"), Vec::new()),
    ];
    for (i, light) in lights.iter().enumerate() {
        let psnr = psnr(&truth[i], &ours[i]);
        table.row([
            light.name.clone(),
            cell(psnr),
            format!(
                "{:.4}",
                total(&truth[i]) / (camera.area() * CHANNELS) as f64
            ),
            methods::name(DEFAULT).to_owned(),
            patterns.to_string(),
        ]);
        shown.row([light.name.clone(), cell(psnr)]);
        let emitted = light.light.elements().iter();
        let emitted = emitted.map(|e| [0, 1, 2].map(|c| f64::from(e[c])));
        let photograph = |picture: &[[f64; CHANNELS]]| {
            Panel::photograph(camera, picture.iter().map(|y| y.map(|y| y * exposure)))
        };
        let error: Vec<[f64; CHANNELS]> = truth[i]
            .iter()
            .zip(&ours[i])
            .map(|(t, o)| std::array::from_fn(|c| ERROR_GAIN * (t[c] - o[c]).abs()))
            .collect();
        for (kind, picture) in [("true", &truth[i]), ("relit", &ours[i])] {
            let path = format!("pictures/{name}-{kind}-{}.png", light.name);
            section.files.push((path, photograph(picture).png()?));
        }
        let small = |picture: &[[f64; CHANNELS]]| {
            let (extent, picture) = shrink(camera, picture);
            Panel::photograph(extent, picture.into_iter().map(|y| y.map(|y| y * exposure)))
        };
        let panels = [
            Panel {
                // Few elements are squares to be seen as such.
                data: light.light.extent().width <= SHOWN / 2,
                ..Panel::photograph(light.light.extent(), emitted)
            },
            small(&truth[i]),
            small(&ours[i]),
            small(&error),
        ];
        for ((_, row), panel) in rows.iter_mut().zip(panels) {
            row.push(Captioned {
                panel,
                caption: Vec::new(),
            });
        }
        if let Some(relit) = rows[2].1.last_mut() {
            relit.caption.push(format!("PSNR {} dB", cell(psnr)));
        }
    }
    let sheet = Sheet {
        columns: lights.iter().map(|light| light.name.clone()).collect(),
        rows: rows.into(),
        side: 200,
    };
    section.picture(
        &format!("{name}-figure4"),
        &format!("{name} under five lights: the light, the true picture, the relit one, the error"),
        sheet.svg()?,
    );
    section.paragraph(&shown.markdown());
    section.data(&format!("{name}-figure4"), &table)?;
    Ok(section)
}

/// `[light][pixel]`: true pictures, and those from the recovered transport.
type Pictures = Vec<Vec<[f64; CHANNELS]>>;

fn pictures(
    known: &impl Known,
    measurements: &Measurements,
    lights: &[RelitLight],
    executor: &impl Executor,
    tenth: &(impl Fn(usize) + Sync),
) -> Result<(Pictures, Pictures), StudyError> {
    let settings = Settings {
        method: DEFAULT,
        window: known.geometry().window,
    };
    let recovery = Recovery::prepare(measurements, settings, executor)?;
    let geometry = *recovery.geometry();
    let basis = recovery.basis().cloned().unwrap_or_default();
    let area = geometry.window.area();
    let rects: Vec<_> = geometry.tiles().collect();
    let done = AtomicUsize::new(0);
    let tiles = executor.map(rects.len(), |i| {
        let mut tile = BandTile::dark(rects[i]);
        tile.put(recovery.tile(measurements, rects[i]));
        // Rounded to codes, as they are when a file is relit.
        let functions = Tile::quantise(&tile, basis.rank()).functions(&geometry, &basis);
        let seen = lights.iter().map(|light| {
            let truth = match &light.photographed {
                Some(picture) => {
                    let pixels = rects[i].pixels().map(|p| geometry.camera.index(p));
                    pixels.map(|n| picture[n]).collect()
                }
                None => expose(known, rects[i], &light.light),
            };
            let functions = functions.tau.chunks_exact(area).zip(rects[i].pixels());
            let ours: Vec<_> = functions
                .map(|(tau, pixel)| {
                    pixel_under(&geometry, geometry.window_origin(pixel), tau, &light.light)
                })
                .collect();
            (truth, ours)
        });
        let seen: Vec<(Vec<_>, Vec<_>)> = seen.collect();
        let before = done.fetch_add(1, Ordering::Relaxed);
        let tenths = |tiles: usize| 10 * tiles / rects.len();
        if tenths(before + 1) > tenths(before) {
            tenth(tenths(before + 1));
        }
        seen
    });
    let black = vec![vec![[0.0; CHANNELS]; geometry.camera.area()]; lights.len()];
    let (mut truth, mut ours) = (black.clone(), black);
    for (rect, seen) in rects.iter().zip(tiles) {
        for (i, (tile_truth, tile_ours)) in seen.into_iter().enumerate() {
            for (p, pixel) in rect.pixels().enumerate() {
                let n = geometry.camera.index(pixel);
                truth[i][n] = tile_truth[p];
                ours[i][n] = tile_ours[p];
            }
        }
    }
    Ok((truth, ours))
}

fn total(picture: &[[f64; CHANNELS]]) -> f64 {
    picture.as_flattened().iter().sum()
}

/// 10 log10(1 / mean squared error); `None` where there is no error.
fn psnr(truth: &[[f64; CHANNELS]], ours: &[[f64; CHANNELS]]) -> Option<Decibels> {
    let pairs = truth.as_flattened().iter().zip(ours.as_flattened());
    let squares: f64 = pairs.map(|(t, o)| (t - o).powi(2)).sum();
    let mse = squares / (truth.len() * CHANNELS) as f64;
    (mse > 0.0).then(|| Decibels(-10.0 * mse.log10()))
}

/// The factor by which all but a few highlights of `samples` fit into the display's range.
fn exposure_for(mut samples: Vec<f64>) -> f64 {
    samples.sort_by(f64::total_cmp);
    let last = (samples.len() as f64 * (1.0 - HIGHLIGHTS)) as usize;
    match samples.get(last.min(samples.len().saturating_sub(1))) {
        Some(&white) if white > 0.0 => 1.0 / white,
        _ => 1.0,
    }
}

/// No wider or taller than a sheet shows it.
fn shrink(extent: Extent, picture: &[[f64; CHANNELS]]) -> (Extent, Vec<[f64; CHANNELS]>) {
    let longer = extent.width.max(extent.height);
    if longer <= SHOWN {
        return (extent, picture.to_vec());
    }
    let to = Extent {
        width: (extent.width * SHOWN / longer).max(1),
        height: (extent.height * SHOWN / longer).max(1),
    };
    let values: Vec<f32> = picture.as_flattened().iter().map(|&v| v as f32).collect();
    let small = area_resample(&values, extent, to);
    let rgb = small.chunks_exact(CHANNELS);
    (
        to,
        rgb.map(|p| [0, 1, 2].map(|c| f64::from(p[c]))).collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn psnr_is_that_of_the_mean_squared_error() {
        let truth = vec![[0.5; 3]; 4];
        let off = vec![[0.51; 3]; 4];
        assert!((psnr(&truth, &off).unwrap().0 - 40.0).abs() < 1e-9);
        assert_eq!(psnr(&truth, &truth), None);
    }

    #[test]
    fn exposure_lets_few_highlights_burn() {
        let samples: Vec<f64> = (0..1000).map(f64::from).collect();
        assert_eq!(exposure_for(samples), 1.0 / 990.0);
        assert_eq!(exposure_for(vec![0.0; 9]), 1.0);
        assert_eq!(exposure_for(Vec::new()), 1.0);
    }
}
