//! How sharply a session's photographs of lines show single light elements.

use anyhow::Result;

use super::session::Session;
use crate::acquisition::{PictureRole, luminance};
use crate::calibrate::LightPlaneAxis;
use crate::cli::advice::error_with_remedy;

/// Brightness of a camera pixel under the flood, relative to the brightest, from which it counts.
const MIN_BRIGHTNESS: f32 = 0.2;
/// One in so many camera pixels is sharper than the one that counts: an object may scatter nearly everywhere.
const SHARPEST_PIXELS: usize = 100;
/// Brightness of lines in the sharpest pixels, relative to the flood, below which light is noted as spread. A blur of 0.35 elements
/// (standard deviation) leaves 0.85 in the middle of a line.
const MIN_LINE_BRIGHTNESS: f32 = 0.85;

/// Notes a display, a lens or an object that spreads the light of single elements.
pub fn note_line_sharpness(session: &Session) {
    match line_brightness(session) {
        Ok(Some(brightness)) if brightness < MIN_LINE_BRIGHTNESS => eprintln!(
            "note: lines of one light element reach {:.0} % of the flood's brightness in the sharpest camera pixels: the object scatters light \
             over an element or more everywhere, or camera pixels are larger than half an element (--bin), or the display is blurred, by smooth \
             scaling for instance, or the picture is out of focus. A blurred display would be part of the light transport: make sure that \
             a bare part of it shows sharp lines",
            100.0 * brightness
        ),
        Ok(_) => {}
        Err(error) => eprintln!("warning: {}", error_with_remedy(&error)),
    }
}

/// Brightness of single lines in the sharpest camera pixels, relative to the flood, along the axis where it is less; `None` if the
/// session has no photographs of lines.
fn line_brightness(session: &Session) -> Result<Option<f32>> {
    let lines = [LightPlaneAxis::X, LightPlaneAxis::Y];
    let lines = lines.map(|axis| session.photo_of(&PictureRole::Lines { axis }));
    let dark = session.photo_of(&PictureRole::Dark);
    // The last flood is of the same time.
    let flood = session.last_photo_of(&PictureRole::Reference);
    let flood = flood.or(session.photo_of(&PictureRole::Flood));
    let (Some(dark), Some(flood), [Some(columns), Some(rows)]) = (dark, flood, lines) else {
        return Ok(None);
    };
    let dark = luminance_of(session, dark)?;
    let mut flood = luminance_of(session, flood)?;
    flood.iter_mut().zip(&dark).for_each(|(y, dark)| *y -= dark);
    let brightest = flood.iter().copied().fold(0.0, f32::max);
    let mut least = f32::INFINITY;
    for photo in [columns, rows] {
        let picture = luminance_of(session, photo)?;
        let pixels = picture.iter().zip(&dark).zip(&flood);
        let mut shares: Vec<f32> = pixels
            .filter(|(_, flood)| **flood > MIN_BRIGHTNESS * brightest)
            .map(|((y, dark), flood)| (y - dark) / flood)
            .collect();
        shares.sort_by(f32::total_cmp);
        let sharp = shares.iter().rev().nth(shares.len() / SHARPEST_PIXELS);
        let Some(sharp) = sharp else {
            return Ok(None);
        };
        least = least.min(*sharp);
    }
    Ok(Some(least))
}

/// Mean measurement of the channels of each pixel of a developed photograph.
fn luminance_of(session: &Session, photo: usize) -> Result<Vec<f32>> {
    let codes = session.developed_codes(photo)?;
    let camera = &session.camera;
    Ok(luminance(&codes, camera.black, camera.white))
}
