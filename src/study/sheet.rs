//! Sheets of labelled pictures as SVG.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::StudyError;
use crate::relight::tone;
use crate::transport::{CHANNELS, Extent};

const JPEG_QUALITY: u8 = 85;
/// Room for a line of text, in pixels.
const LINE: u32 = 22;
const GAP: u32 = 8;

/// An 8-bit sRGB picture.
pub(super) struct Panel {
    pub extent: Extent,
    pub rgb: Vec<u8>,
    /// Whether its pixels are data, to be shown as squares, or a photograph.
    pub data: bool,
}

impl Panel {
    /// A photograph from linear light, encoded as sRGB.
    pub fn photograph(extent: Extent, linear: impl Iterator<Item = [f64; CHANNELS]>) -> Self {
        Self {
            extent,
            rgb: linear.flat_map(|rgb| rgb.map(tone::srgb8)).collect(),
            data: false,
        }
    }

    /// PNG.
    pub fn png(&self) -> Result<Vec<u8>, StudyError> {
        let mut bytes = Vec::new();
        PngEncoder::new(&mut bytes).write_image(
            &self.rgb,
            self.extent.width,
            self.extent.height,
            ExtendedColorType::Rgb8,
        )?;
        Ok(bytes)
    }

    /// For SVG: exact where pixels are data, small where they are a photograph's.
    fn data_url(&self) -> Result<String, StudyError> {
        let (kind, bytes) = match self.data {
            true => ("png", self.png()?),
            false => {
                let mut bytes = Vec::new();
                JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY).write_image(
                    &self.rgb,
                    self.extent.width,
                    self.extent.height,
                    ExtendedColorType::Rgb8,
                )?;
                ("jpeg", bytes)
            }
        };
        Ok(format!(
            "data:image/{kind};base64,{}",
            STANDARD.encode(bytes)
        ))
    }
}

/// A picture and the lines under it.
pub(super) struct Captioned {
    pub panel: Panel,
    pub caption: Vec<String>,
}

/// Rows of pictures, each row named at its left, each column at its top; either name may be empty.
pub(super) struct Sheet {
    pub columns: Vec<String>,
    pub rows: Vec<(String, Vec<Captioned>)>,
    /// Width and height at which every picture is shown; taller ones are fitted in.
    pub side: u32,
}

impl Sheet {
    /// Draws it.
    pub fn svg(&self) -> Result<String, StudyError> {
        let rows_named = self.rows.iter().any(|(name, _)| !name.is_empty());
        let columns_named = self.columns.iter().any(|name| !name.is_empty());
        let (left, top) = (
            u32::from(rows_named) * LINE,
            u32::from(columns_named) * LINE,
        );
        let lines = |row: &[Captioned]| {
            let lines = row.iter().map(|p| p.caption.len() as u32).max();
            lines.unwrap_or(0)
        };
        let heights: Vec<u32> = self
            .rows
            .iter()
            .map(|(_, row)| self.side + lines(row) * LINE + GAP)
            .collect();
        let width = left + GAP + self.columns.len() as u32 * (self.side + GAP);
        let height = top + GAP + heights.iter().sum::<u32>();
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"Helvetica, Arial, sans-serif\" \
             font-size=\"14\" fill=\"#1e1e1e\" text-anchor=\"middle\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        let column_x = |i: usize| left + GAP + i as u32 * (self.side + GAP);
        for (i, name) in self.columns.iter().enumerate() {
            // Without names there is no line above for them.
            if !name.is_empty() {
                text(&mut svg, column_x(i) + self.side / 2, top - 4, name);
            }
        }
        let mut y = top + GAP / 2;
        for ((name, row), height) in self.rows.iter().zip(&heights) {
            if !name.is_empty() {
                let (x, middle) = (LINE - 6, y + self.side / 2);
                let turn = format!("<g transform=\"rotate(-90 {x} {middle})\">");
                svg += &turn;
                text(&mut svg, x, middle, name);
                svg += "</g>\n";
            }
            for (i, Captioned { panel, caption }) in row.iter().enumerate() {
                let x = column_x(i);
                let style = if panel.data { "pixelated" } else { "auto" };
                let _ = writeln!(
                    svg,
                    "<image x=\"{x}\" y=\"{y}\" width=\"{0}\" height=\"{0}\" \
                     style=\"image-rendering:{style}\" href=\"{1}\"/>",
                    self.side,
                    panel.data_url()?
                );
                let _ = writeln!(
                    svg,
                    "<rect x=\"{x}\" y=\"{y}\" width=\"{0}\" height=\"{0}\" fill=\"none\" \
                     stroke=\"#c8c8c8\"/>",
                    self.side
                );
                for (i, line) in caption.iter().enumerate() {
                    let below = y + self.side + LINE * (i as u32 + 1) - 5;
                    text(&mut svg, x + self.side / 2, below, line);
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
    // Writing to a string does not fail.
    let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\">{escaped}</text>");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_holds_every_picture_and_every_word() {
        let panel = |data| Panel {
            extent: Extent {
                width: 2,
                height: 2,
            },
            rgb: vec![200; 12],
            data,
        };
        let sheet = Sheet {
            columns: vec!["flood".to_owned(), "a < b".to_owned()],
            rows: vec![(
                "true".to_owned(),
                [true, false]
                    .map(|data| Captioned {
                        panel: panel(data),
                        caption: vec!["50 dB".to_owned()],
                    })
                    .into(),
            )],
            side: 100,
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
