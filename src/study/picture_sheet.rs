//! Labelled pictures in rows and columns, as SVG.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageError};

use super::error::StudyError;
use crate::relight::srgb;
use crate::transport::{CHANNELS, Extent};

const JPEG_QUALITY: u8 = 85;
/// Height of a line of text, and the gap between pictures.
const LINE_HEIGHT_PX: u32 = 22;
const GAP_PX: u32 = 8;

/// An 8-bit sRGB picture.
pub(super) struct PanelImage {
    pub extent: Extent,
    pub rgb: Vec<u8>,
    /// Whether its pixels are data, shown as exact squares, or those of a photograph.
    pub is_data: bool,
}

impl PanelImage {
    /// A photograph from linear RGB, encoded as sRGB.
    pub fn photograph(extent: Extent, linear: impl Iterator<Item = [f64; CHANNELS]>) -> Self {
        Self {
            extent,
            rgb: linear.flat_map(|rgb| rgb.map(srgb::srgb8)).collect(),
            is_data: false,
        }
    }

    pub fn png(&self) -> Result<Vec<u8>, StudyError> {
        let mut bytes = Vec::new();
        self.encode(PngEncoder::new(&mut bytes))?;
        Ok(bytes)
    }

    fn encode(&self, encoder: impl ImageEncoder) -> Result<(), ImageError> {
        let Extent { width, height } = self.extent;
        encoder.write_image(&self.rgb, width, height, ExtendedColorType::Rgb8)
    }

    /// A data URL: PNG for data, JPEG for a photograph.
    fn data_url(&self) -> Result<String, StudyError> {
        let mut jpeg = Vec::new();
        let (kind, bytes) = match self.is_data {
            true => ("png", self.png()?),
            false => {
                self.encode(JpegEncoder::new_with_quality(&mut jpeg, JPEG_QUALITY))?;
                ("jpeg", jpeg)
            }
        };
        let bytes = STANDARD.encode(bytes);
        Ok(format!("data:image/{kind};base64,{bytes}"))
    }
}

/// A panel with lines of text below it.
pub(super) struct CaptionedPanel {
    pub panel: PanelImage,
    pub caption: String,
}

/// Rows of panels, with names on the left of rows and above columns; names may be empty.
pub(super) struct PictureSheet {
    pub columns: Vec<String>,
    pub rows: Vec<(String, Vec<CaptionedPanel>)>,
    /// Width and height of every panel; panels that are not square are fitted in.
    pub side_px: u32,
}

impl PictureSheet {
    pub fn svg(&self) -> Result<String, StudyError> {
        let has_row_names = self.rows.iter().any(|(name, _)| !name.is_empty());
        let has_column_names = self.columns.iter().any(|name| !name.is_empty());
        let [left, top] =
            [has_row_names, has_column_names].map(|has| u32::from(has) * LINE_HEIGHT_PX);
        let height = |(_, row): &(_, Vec<CaptionedPanel>)| {
            let lines = row.iter().map(|panel| panel.caption.lines().count());
            self.side_px + lines.max().unwrap_or(0) as u32 * LINE_HEIGHT_PX + GAP_PX
        };
        let heights: Vec<u32> = self.rows.iter().map(height).collect();
        let width = left + GAP_PX + self.columns.len() as u32 * (self.side_px + GAP_PX);
        let height = top + GAP_PX + heights.iter().sum::<u32>();
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"Helvetica, Arial, sans-serif\" \
             font-size=\"14\" fill=\"#1e1e1e\" text-anchor=\"middle\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        let column_x = |i: usize| left + GAP_PX + i as u32 * (self.side_px + GAP_PX);
        for (i, name) in self.columns.iter().enumerate() {
            // Without column names there is no line for them at the top.
            if !name.is_empty() {
                text(&mut svg, column_x(i) + self.side_px / 2, top - 4, name);
            }
        }
        let mut y = top + GAP_PX / 2;
        for ((name, row), height) in self.rows.iter().zip(&heights) {
            if !name.is_empty() {
                let (x, middle) = (LINE_HEIGHT_PX - 6, y + self.side_px / 2);
                svg += &format!("<g transform=\"rotate(-90 {x} {middle})\">");
                text(&mut svg, x, middle, name);
                svg += "</g>\n";
            }
            for (i, CaptionedPanel { panel, caption }) in row.iter().enumerate() {
                let x = column_x(i);
                let style = if panel.is_data { "pixelated" } else { "auto" };
                let (side, url) = (self.side_px, panel.data_url()?);
                let place = format!("x=\"{x}\" y=\"{y}\" width=\"{side}\" height=\"{side}\"");
                svg += &format!(
                    "<image {place} style=\"image-rendering:{style}\" href=\"{url}\"/>\n\
                     <rect {place} fill=\"none\" stroke=\"#c8c8c8\"/>\n"
                );
                for (i, line) in caption.lines().enumerate() {
                    let below = y + self.side_px + LINE_HEIGHT_PX * (i as u32 + 1) - 5;
                    text(&mut svg, x + self.side_px / 2, below, line);
                }
            }
            y += height;
        }
        svg += "</svg>\n";
        Ok(svg)
    }
}

fn text(svg: &mut String, x: u32, y: u32, text: &str) {
    let escaped = text
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;");
    *svg += &format!("<text x=\"{x}\" y=\"{y}\">{escaped}</text>\n");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_contains_panels_names_and_captions() {
        let panel = |is_data| PanelImage {
            extent: Extent::new(2, 2),
            rgb: vec![200; 12],
            is_data,
        };
        let sheet = PictureSheet {
            columns: vec!["flood".to_owned(), "a < b".to_owned()],
            rows: vec![(
                "true".to_owned(),
                [true, false]
                    .map(|is_data| CaptionedPanel {
                        panel: panel(is_data),
                        caption: "50 dB".to_owned(),
                    })
                    .into(),
            )],
            side_px: 100,
        };
        let svg = sheet.svg().unwrap();
        for word in [
            "flood",
            "a &lt; b",
            "true",
            "50 dB",
            "image/png",
            "image/jpeg",
        ] {
            assert!(svg.contains(word), "no {word:?}");
        }
    }
}
