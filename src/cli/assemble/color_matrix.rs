//! The camera's colours in a session: from its photographs of the display's primaries, or from its raw files.

use std::path::Path;

use anyhow::Result;

use super::photograph_list::is_raw;
use super::session::Session;
use crate::acquisition::{PictureRole, Primary};
use crate::calibrate::{color_matrix, primaries_from_photographs, white_of};
use crate::cli::advice::error_with_remedy;
use crate::photo_file::{RawConversionError, RawConverter};
use crate::transport::{CHANNELS, ColorMatrix, inverse_color_matrix};

/// A matrix whose factors differ by less from those of the identity is left out.
const MIN_DIFFERENCE: f64 = 0.005;

/// The matrix from the session's linear RGB to linear sRGB; `None` if they are the same, or if nothing is known.
pub fn session_color_matrix(session: &Session) -> Option<ColorMatrix> {
    let flood = &session.paths[session.photo_of(&PictureRole::Flood)?];
    let declared = match is_raw(flood) {
        // Without the white balance of raw files, the colours of primaries do not help.
        true => raw_primaries(flood, &session.developed)?,
        // Other photographs have a white balance already.
        false => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    };
    let photographed = match photographed_lights(session) {
        Ok(Some(lights)) => {
            let found = primaries_from_photographs(&lights, white_of(&declared));
            let found = found.filter(|primaries| color_matrix(primaries).is_some());
            if found.is_none() {
                eprintln!(
                    "note: the photographs of red, green and blue light say nothing of the camera's colours: too little light of one comes \
                     through the object, two of them are exchanged, or the camera has no colours"
                );
            }
            found
        }
        Ok(None) => None,
        Err(error) => {
            eprintln!("warning: {}", error_with_remedy(&error));
            None
        }
    };
    let Some(matrix) = color_matrix(&photographed.unwrap_or(declared)) else {
        eprintln!(
            "note: {}: LibRaw's matrix of the camera's colours is implausible, and is not used",
            flood.display()
        );
        return None;
    };
    let is_identity = (0..CHANNELS).all(|i| {
        (0..CHANNELS).all(|j| (matrix[i][j] - f64::from(u8::from(i == j))).abs() < MIN_DIFFERENCE)
    });
    (!is_identity).then_some(matrix)
}

/// The matrix from the linear RGB of the raw file at `path` to linear sRGB; `None` of other files.
pub fn raw_color_matrix(path: &Path, scratch: &Path) -> Option<ColorMatrix> {
    match is_raw(path) {
        true => color_matrix(&raw_primaries(path, scratch)?),
        false => None,
    }
}

/// The camera's colours of the primaries of sRGB by the raw file at `path`; `None` if they are not known.
fn raw_primaries(path: &Path, scratch: &Path) -> Option<ColorMatrix> {
    let reason = match RawConverter::default().camera_to_srgb(path, scratch) {
        Ok(Some(matrix)) => return inverse_color_matrix(&matrix),
        Ok(None) => "LibRaw does not know this camera".to_owned(),
        Err(RawConversionError::ProgramMissing { program }) => {
            format!("LibRaw's program {program}, which knows them, is not installed")
        }
        Err(error) => error.to_string(),
    };
    eprintln!(
        "note: {}: the camera's colours are unknown, and are shown as they are ({reason}). \"color_matrix\" of \"camera\" in capture.json can \
         give them",
        path.display()
    );
    None
}

/// The camera's RGB of each primary, less that of the dark photograph; `None` if the session has no such photographs.
fn photographed_lights(session: &Session) -> Result<Option<[[f64; CHANNELS]; CHANNELS]>> {
    let dark = session.photo_of(&PictureRole::Dark);
    let primaries = Primary::ALL.map(|primary| session.photo_of(&PictureRole::Primary { primary }));
    let (Some(dark), [Some(red), Some(green), Some(blue)]) = (dark, primaries) else {
        return Ok(None);
    };
    let dark = mean(session, dark)?;
    let mut lights = [[0.0; CHANNELS]; CHANNELS];
    for (light, photo) in lights.iter_mut().zip([red, green, blue]) {
        let mean = mean(session, photo)?;
        *light = std::array::from_fn(|c| (mean[c] - dark[c]).max(0.0));
    }
    Ok(Some(lights))
}

/// Mean code of each channel of a developed photograph.
fn mean(session: &Session, photo: usize) -> Result<[f64; CHANNELS]> {
    let codes = session.developed_codes(photo)?;
    let mut sums = [0.0; CHANNELS];
    for code in &codes {
        for c in 0..CHANNELS {
            sums[c] += f64::from(code[c]);
        }
    }
    Ok(sums.map(|sum| sum / codes.len() as f64))
}
