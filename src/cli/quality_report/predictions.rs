//! What a file predicts, beside what the camera saw: pictures, and the error at each pixel.

use anyhow::Result;
use serde::Serialize;

use super::figures::{Histogram, histogram, reduced, white_of};
use crate::capture::{
    CameraPixelSet, CaptureFolder, DarkFrame, LinearPhoto, NoiseModel, PhotographRowReader,
};
use crate::cli::evaluate::SampleMoments;
use crate::cli::finest_level::FinestLevel;
use crate::cli::process_resources::InterruptibleCores;
use crate::job_executor::Executor;
use crate::relight::{BuiltinLight, Light, TorchSpot};
use crate::transport::{
    CHANNELS, ColorMatrix, Decibels, Extent, SnrAccumulator, convert_color, light_color_matrix,
    single_precision,
};

/// Places of the torch, as shares of the picture.
const TORCHES: [(&str, [f64; 2]); 3] = [
    ("Relit: torch at the upper left", [0.25, 0.3]),
    ("Relit: torch in the middle", [0.5, 0.5]),
    ("Relit: torch at the lower right", [0.75, 0.7]),
];

/// A photograph that the recovery did not use, and its prediction.
#[derive(Clone, Debug, Serialize)]
pub struct PredictedPhotograph {
    /// Index in `shots`.
    pub shot: usize,
    pub photo: String,
    /// Exposure relative to the prediction.
    pub gain: f64,
    /// Light that the prediction lacks everywhere, as a share of white.
    pub stray_light: f64,
    /// SNR of the prediction.
    pub snr_db: Option<Decibels>,
    /// The same with this exposure and stray light.
    pub fitted_snr_db: Option<Decibels>,
    #[serde(skip)]
    pub fitted: SnrAccumulator,
    /// Energy that noise alone adds to the error.
    #[serde(skip)]
    pub noise: f64,
}

/// How well photographs are predicted that the recovery did not use.
#[derive(Clone, Debug, Serialize)]
pub struct HeldOutAccuracy {
    pub snr_db: Option<Decibels>,
    /// With an exposure and stray light of each photograph's own.
    pub fitted_snr_db: Option<Decibels>,
    /// Standard error of the latter, in dB, by leaving out one photograph after the other; null with fewer than three.
    pub standard_error_db: Option<f64>,
    /// SNR that noise alone would leave; null if the noise is unknown.
    pub noise_limit_db: Option<Decibels>,
    /// Correlation of the error at each pixel with the contrast of its neighbourhood: high if something has moved.
    pub edge_correlation: Option<f64>,
    /// SNR of the predicted flood photograph, which no recovery uses.
    pub flood_snr_db: Option<Decibels>,
    pub photographs: Vec<PredictedPhotograph>,
}

/// A picture in linear light, at most [`MAX_SIDE`] pixels along each side.
pub struct ReportPicture {
    pub caption: &'static str,
    pub extent: Extent,
    /// `[extent, 3]`.
    pub values: Vec<f32>,
    /// Light that is shown as white.
    pub white: f32,
}

impl ReportPicture {
    /// From a picture of the camera, whose colours become those of sRGB; saturated samples, which are not finite, become white.
    fn new(
        caption: &'static str,
        camera: Extent,
        mut pixels: Vec<[f32; CHANNELS]>,
        color_matrix: Option<&ColorMatrix>,
    ) -> Self {
        if let Some(matrix) = color_matrix {
            let matrix = single_precision(matrix);
            let convert = |pixel: &mut [f32; CHANNELS]| *pixel = convert_color(&matrix, *pixel);
            pixels.iter_mut().for_each(convert);
        }
        let white = white_of(&pixels);
        let values = pixels.as_flattened().iter();
        let values = values.map(|y| if y.is_finite() { *y } else { white });
        let (extent, values) = reduced(camera, values.collect());
        Self {
            caption,
            extent,
            values,
            white,
        }
    }
}

/// Everything that is predicted.
pub struct Predictions {
    pub camera: Extent,
    /// The flood photograph, if there is one, and its histogram.
    pub flood: Option<(ReportPicture, Histogram)>,
    pub relit: Vec<ReportPicture>,
    /// Squared error of the held-out photographs at each pixel, over all channels, and that which noise alone would leave.
    pub errors: Vec<[f32; 2]>,
    edge_correlation: Option<f64>,
    held_out: Vec<PredictedPhotograph>,
    total: SnrAccumulator,
    flood_snr: Option<Decibels>,
    has_noise: bool,
}

impl Predictions {
    /// Of the photographs that are not `used`; `color_matrix` is for pictures.
    ///
    /// # Errors
    /// If a photograph cannot be read, or the command is interrupted.
    pub fn new(
        file: &mut FinestLevel,
        folder: &CaptureFolder,
        used: &[usize],
        noise: Option<NoiseModel>,
        color_matrix: Option<&ColorMatrix>,
        cores: &InterruptibleCores,
    ) -> Result<Self> {
        let geometry = file.geometry.clone();
        let dark = folder.read_dark(&CameraPixelSet::all(geometry.camera))?;
        let mut found = Self {
            camera: geometry.camera,
            flood: None,
            relit: Vec::new(),
            errors: vec![[0.0; 2]; geometry.camera.area()],
            edge_correlation: None,
            held_out: Vec::new(),
            total: SnrAccumulator::default(),
            flood_snr: None,
            has_noise: noise.is_some(),
        };
        for i in (0..folder.manifest().shots.len()).filter(|i| !used.contains(i)) {
            cores.check_cancelled()?;
            let light = Light::from_linear_rgb(geometry.light, &folder.read_pattern(i)?.rgb())?;
            let variance = |c: usize, y: f64| {
                noise.map_or(0.0, |noise| noise.variance(c, y, folder.exposure(i)))
            };
            let (predicted, measured) = predict(file, &light, folder.open_shot(i)?, &dark)?;
            let photo = folder.manifest().shots[i].photo.clone();
            found.compare(i, photo, &predicted, &measured, variance);
        }
        let flood = BuiltinLight::Flood.render(geometry.light);
        if let Some(reader) = folder.open_flood()? {
            let (predicted, measured) = predict(file, &flood, reader, &dark)?;
            let mut snr = SnrAccumulator::default();
            for (predicted, measured) in samples(&predicted, &measured) {
                snr.add(measured, predicted);
            }
            found.flood_snr = snr.snr();
            found.edge_correlation = found.edge_correlation(&measured);
            let histogram = histogram(&measured);
            let picture = ReportPicture::new("Photograph", geometry.camera, measured, color_matrix);
            found.flood = Some((picture, histogram));
        }
        let spot =
            |[x, y]: [f64; 2]| Light::torch(geometry.light, TorchSpot::behind(&geometry, x, y));
        let torches = TORCHES.map(|(caption, at)| (caption, spot(at)));
        let lights = [("Relit: all light elements", flood)]
            .into_iter()
            .chain(torches);
        let light_matrix = color_matrix.and_then(light_color_matrix);
        for (caption, light) in lights {
            let light = match &light_matrix {
                Some(matrix) => light.converted(matrix),
                None => light,
            };
            let pixels = file.picture(&light)?;
            let picture = ReportPicture::new(caption, geometry.camera, pixels, color_matrix);
            found.relit.push(picture);
        }
        Ok(found)
    }

    /// Adds the held-out photograph of shot `shot`.
    fn compare(
        &mut self,
        shot: usize,
        photo: String,
        predicted: &[[f32; CHANNELS]],
        measured: &[[f32; CHANNELS]],
        variance: impl Fn(usize, f64) -> f64,
    ) {
        let mut moments = SampleMoments::default();
        let mut snr = SnrAccumulator::default();
        for (predicted, measured) in samples(predicted, measured) {
            snr.add(measured, predicted);
            moments.add(predicted, measured);
        }
        let (gain, stray_light) = moments.fit_line();
        let mut noise = 0.0;
        for ((predicted, measured), errors) in predicted.iter().zip(measured).zip(&mut self.errors)
        {
            for c in 0..CHANNELS {
                let [y, expected] = [measured[c], predicted[c]].map(f64::from);
                if y.is_finite() {
                    let expected = gain * expected + stray_light;
                    let of_noise = variance(c, expected);
                    errors[0] += (y - expected).powi(2) as f32;
                    errors[1] += of_noise as f32;
                    noise += of_noise;
                }
            }
        }
        let fitted = moments.error_of_line(gain, stray_light);
        self.total.merge(snr);
        self.held_out.push(PredictedPhotograph {
            shot,
            photo,
            gain,
            stray_light,
            snr_db: snr.snr(),
            fitted_snr_db: fitted.snr(),
            fitted,
            noise,
        });
    }

    /// How well held-out photographs are predicted; `None` if there are none.
    pub fn accuracy(&self) -> Option<HeldOutAccuracy> {
        if self.held_out.is_empty() {
            return None;
        }
        let parts: Vec<SnrAccumulator> = self.held_out.iter().map(|photo| photo.fitted).collect();
        let sum: SnrAccumulator = parts.iter().copied().sum();
        let noise: f64 = self.held_out.iter().map(|photo| photo.noise).sum();
        let limit = SnrAccumulator::from_energies(sum.signal, noise).snr();
        Some(HeldOutAccuracy {
            snr_db: self.total.snr(),
            fitted_snr_db: sum.snr(),
            standard_error_db: standard_error(&parts),
            noise_limit_db: limit.filter(|_| self.has_noise),
            edge_correlation: self.edge_correlation,
            flood_snr_db: self.flood_snr,
            photographs: self.held_out.clone(),
        })
    }

    /// Correlation of the errors above noise with the gradient of the flood photograph.
    fn edge_correlation(&self, flood: &[[f32; CHANNELS]]) -> Option<f64> {
        let Extent { width, height } = self.camera;
        let at = |x: u32, y: u32| {
            let pixel = flood[(y * width + x) as usize];
            pixel.iter().map(|y| f64::from(*y)).sum::<f64>()
        };
        let mut moments = SampleMoments::default();
        for (x, y) in self.camera.cells() {
            if x == 0 || y == 0 || x + 1 == width || y + 1 == height {
                continue;
            }
            let (across, down) = (at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1));
            let gradient = across.hypot(down);
            let [error, noise] = self.errors[(y * width + x) as usize];
            if gradient.is_finite() {
                moments.add(gradient, f64::from((error - noise).max(0.0).sqrt()));
            }
        }
        moments.correlation()
    }
}

/// Finite samples of all channels: predicted and measured.
fn samples<'a>(
    predicted: &'a [[f32; CHANNELS]],
    measured: &'a [[f32; CHANNELS]],
) -> impl Iterator<Item = (f64, f64)> + 'a {
    let flat = predicted.as_flattened().iter().zip(measured.as_flattened());
    flat.filter(|(_, y)| y.is_finite())
        .map(|(predicted, measured)| (f64::from(*predicted), f64::from(*measured)))
}

/// The picture predicted under `light`, and the photograph; saturated samples are not finite.
fn predict(
    file: &mut FinestLevel,
    light: &Light,
    reader: PhotographRowReader,
    dark: &DarkFrame,
) -> Result<(Vec<[f32; CHANNELS]>, LinearPhoto)> {
    let (photo, _) = reader.read_all(dark)?;
    Ok((file.picture(light)?, photo))
}

/// Standard error in dB of the SNR over all parts: the jackknife.
fn standard_error(parts: &[SnrAccumulator]) -> Option<f64> {
    if parts.len() < 3 {
        return None;
    }
    let without = |k: usize| -> Option<f64> {
        let others = parts.iter().enumerate().filter(|(i, _)| *i != k);
        let sum: SnrAccumulator = others.map(|(_, part)| *part).sum();
        Some(sum.snr()?.0)
    };
    let values: Vec<f64> = (0..parts.len()).map(without).collect::<Option<_>>()?;
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    Some(((count - 1.0) / count * squares).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standard_error_is_that_of_photographs_that_differ() {
        let part = |error: f64| SnrAccumulator::from_energies(1.0, error);
        assert_eq!(standard_error(&[part(0.01); 2]), None);
        let equal = standard_error(&[part(0.01); 8]).unwrap();
        assert!(equal < 1e-9);
        // Errors with a relative standard deviation of 0.5 over 8 photographs: 4.34 dB times 0.5 / √8.
        let parts: Vec<SnrAccumulator> = (0..8)
            .map(|k| part(0.01 * if k % 2 == 0 { 0.5 } else { 1.5 }))
            .collect();
        let error = standard_error(&parts).unwrap();
        let expected = 10.0 / std::f64::consts::LN_10 * 0.5345 / 8f64.sqrt();
        assert!((error - expected).abs() < 0.1, "{error} {expected}");
    }
}
