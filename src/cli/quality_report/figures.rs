//! Pictures and charts of the report, as elements of HTML.

use std::fmt::Write;

use anyhow::Result;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::predictions::ReportPicture;
use crate::acquisition::HISTOGRAM_BINS;
use crate::relight::{area_resample, srgb};
use crate::transport::{CHANNELS, Extent};

/// Longest side of a picture in pixels.
const MAX_SIDE: u32 = 560;
/// Colours of the error map from small to large: equally different for every kind of colour vision.
const HEAT: [[f32; CHANNELS]; 5] = [
    [68.0, 1.0, 84.0],
    [59.0, 82.0, 139.0],
    [33.0, 145.0, 140.0],
    [94.0, 201.0, 98.0],
    [253.0, 231.0, 37.0],
];
const CHANNEL_COLOURS: [&str; CHANNELS] = ["#c22", "#282", "#25b"];
const CHART: [f64; 2] = [640.0, 160.0];

/// A picture.
///
/// # Errors
/// If it cannot be encoded.
pub fn photograph(picture: &ReportPicture, white: f32) -> Result<String> {
    let codes = picture.values.iter();
    let codes = codes.map(|y| srgb::srgb8(f64::from(y / white))).collect();
    figure(picture.caption, picture.extent, codes)
}

/// A map of `values`, `[N]`, from 0 to `largest`.
pub fn error_map(caption: &str, extent: Extent, values: &[f64], largest: f64) -> Result<String> {
    let values = values.iter().flat_map(|value| [*value as f32; CHANNELS]);
    let (extent, values) = reduced(extent, values.collect());
    let colour = |value: f32| {
        let at = (value / largest as f32).clamp(0.0, 1.0) * (HEAT.len() - 1) as f32;
        let i = (at as usize).min(HEAT.len() - 2);
        let share = at - i as f32;
        let mix = |c: usize| HEAT[i][c] + share * (HEAT[i + 1][c] - HEAT[i][c]);
        [0, 1, 2].map(|c| mix(c).round() as u8)
    };
    let codes = values
        .chunks_exact(CHANNELS)
        .flat_map(|pixel| colour(pixel[0]));
    figure(caption, extent, codes.collect())
}

/// At most [`MAX_SIDE`] pixels along each side.
pub fn reduced(extent: Extent, values: Vec<f32>) -> (Extent, Vec<f32>) {
    let longest = extent.width.max(extent.height);
    if longest <= MAX_SIDE {
        return (extent, values);
    }
    let side = |side: u32| (side * MAX_SIDE / longest).max(1);
    let to = Extent::new(side(extent.width), side(extent.height));
    (to, area_resample(&values, extent, to))
}

fn figure(caption: &str, extent: Extent, rgb: Vec<u8>) -> Result<String> {
    let mut png = Vec::new();
    let Extent { width, height } = extent;
    PngEncoder::new(&mut png).write_image(&rgb, width, height, ExtendedColorType::Rgb8)?;
    let data = STANDARD.encode(png);
    Ok(format!(
        "<figure><img alt=\"{caption}\" width=\"{width}\" height=\"{height}\" src=\"data:image/png;base64,{data}\">\
         <figcaption>{caption}</figcaption></figure>\n"
    ))
}

/// Largest measurement of a picture but for one sample in a thousand.
pub fn white_of(pixels: &[[f32; CHANNELS]]) -> f32 {
    let finite = pixels.as_flattened().iter().filter(|y| y.is_finite());
    let mut samples: Vec<f32> = finite.copied().collect();
    if samples.is_empty() {
        return 1.0;
    }
    let at = samples.len() * 999 / 1000;
    let (_, white, _) = samples.select_nth_unstable_by(at, f32::total_cmp);
    match *white > 0.0 {
        true => *white,
        false => 1.0,
    }
}

/// Samples of each channel from black to white.
pub type Histogram = [[f64; HISTOGRAM_BINS]; CHANNELS];

/// Counts measurements; those that are not finite are saturated.
pub fn histogram(pixels: &[[f32; CHANNELS]]) -> Histogram {
    let mut bins = [[0.0; HISTOGRAM_BINS]; CHANNELS];
    for pixel in pixels {
        for c in 0..CHANNELS {
            let share = if pixel[c].is_finite() { pixel[c] } else { 1.0 };
            let bin = (share * HISTOGRAM_BINS as f32) as usize; // `as` clips below 0
            bins[c][bin.min(HISTOGRAM_BINS - 1)] += 1.0;
        }
    }
    bins
}

/// A histogram on a logarithmic scale.
pub fn histogram_chart(label: &str, histogram: &Histogram) -> String {
    let lines = histogram
        .iter()
        .map(|bins| bins.iter().map(|count| count.ln_1p()).collect());
    let lines: Vec<(&str, Vec<f64>)> = CHANNEL_COLOURS.into_iter().zip(lines).collect();
    let counts = lines.iter().flat_map(|(_, line)| line);
    let largest = counts.copied().fold(1.0, f64::max);
    chart(label, &lines, [0.0, largest], ["black", "white"])
}

/// Values over the photographs of a session, `range` from bottom to top.
pub fn series(label: &str, values: &[f64], range: [f64; 2]) -> String {
    let ends = ["first photograph", "last photograph"];
    chart(label, &[("#25b", values.to_vec())], range, ends)
}

fn chart(
    label: &str,
    lines: &[(&str, Vec<f64>)],
    [low, high]: [f64; 2],
    ends: [&str; 2],
) -> String {
    let [width, height] = CHART;
    let mut svg = format!(
        "<figure><svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{label}\">"
    );
    for (colour, values) in lines {
        let step = width / (values.len() - 1).max(1) as f64;
        let mut points = String::new();
        for (i, value) in values.iter().enumerate() {
            let y = height * (1.0 - (value - low) / (high - low));
            // Writing to a string does not fail.
            let _ = write!(points, "{:.1},{:.1} ", step * i as f64, y);
        }
        let _ = write!(
            svg,
            "<polyline points=\"{}\" stroke=\"{colour}\"/>",
            points.trim_end()
        );
    }
    let [left, right] = ends;
    svg + &format!(
        "</svg><p class=\"ends\"><span>{left}</span><span>{right}</span></p><figcaption>{label}</figcaption></figure>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_pictures_are_reduced_and_keep_their_mean() {
        let extent = Extent::new(1120, 300);
        let pixels = vec![[0.25f32, 0.5, 1.0]; extent.area()];
        let (small, values) = reduced(extent, pixels.as_flattened().to_vec());
        assert_eq!(small, Extent::new(560, 150));
        assert!((values[3] - 0.25).abs() < 1e-5 && (values[4] - 0.5).abs() < 1e-5);
        let picture = ReportPicture {
            caption: "A window",
            extent: small,
            values,
            white: 1.0,
        };
        let html = photograph(&picture, 1.0).unwrap();
        assert!(html.contains("width=\"560\" height=\"150\" src=\"data:image/png;base64,iVBOR"));
    }

    #[test]
    fn the_brightest_samples_are_white_whatever_is_saturated() {
        let mut pixels = vec![[0.5f32; CHANNELS]; 1000];
        pixels[3] = [f32::NAN; CHANNELS];
        assert_eq!(white_of(&pixels), 0.5);
        assert_eq!(white_of(&[[0.0; CHANNELS]]), 1.0);
        let counted = histogram(&pixels);
        assert_eq!(
            (counted[0][32], counted[2][HISTOGRAM_BINS - 1]),
            (999.0, 1.0)
        );
        let chart = histogram_chart("Flood", &counted);
        assert_eq!(chart.matches("<polyline").count(), CHANNELS);
        assert!(series("Gain", &[1.0], [0.9, 1.1]).contains("0.0,80.0"));
    }
}
