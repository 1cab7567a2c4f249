//! The camera's colours in a session: from its photographs of the display's primaries, or from its raw files.

use std::path::Path;

use anyhow::{Context, Result};

use super::photograph_list::is_raw;
use super::session::Session;
use crate::acquisition::{PictureRole, Primary};
use crate::calibrate::{
    Matrix3, color_matrix, primaries_from_matrix, primaries_from_photographs, white_of,
};
use crate::cli::advice::error_with_remedy;
use crate::photo_file::RawConverter;
use crate::transport::{CHANNELS, ColorMatrix};

/// A matrix whose factors differ by less from those of the identity is left out.
const MIN_DIFFERENCE: f64 = 0.005;

/// The matrix from the session's linear RGB to linear sRGB; `None` if they are the same, or if nothing is known.
pub fn session_color_matrix(session: &Session) -> Option<ColorMatrix> {
    let flood = session.photos_of(|role| *role == PictureRole::Flood);
    let raw = flood
        .first()
        .and_then(|flood| raw_primaries(&session.paths[*flood], &session.developed));
    // Without raw files, photographs have a white balance already.
    let white = raw.as_ref().map_or([1.0; CHANNELS], white_of);
    let photographed = match photographed_lights(session) {
        Ok(lights) => lights.map(|lights| primaries_from_photographs(&lights, white)),
        Err(error) => {
            eprintln!("warning: {}", error_with_remedy(&error));
            None
        }
    };
    if photographed == Some(None) {
        eprintln!(
            "note: the photographs of red, green and blue light say nothing of the camera's colours: too little light of one comes through \
             the object, they are exchanged, or the camera has no colours"
        );
    }
    let matrix = color_matrix(&photographed.flatten().or(raw)?)?;
    let is_identity = (0..CHANNELS).all(|i| {
        (0..CHANNELS).all(|j| (matrix[i][j] - f64::from(u8::from(i == j))).abs() < MIN_DIFFERENCE)
    });
    (!is_identity).then_some(matrix)
}

/// The matrix from the linear RGB of the raw file at `path` to linear sRGB; `None` of other files.
pub fn raw_color_matrix(path: &Path, scratch: &Path) -> Option<ColorMatrix> {
    color_matrix(&raw_primaries(path, scratch)?)
}

/// The camera's colours of the primaries of sRGB by the raw file at `path`; `None` of other files.
fn raw_primaries(path: &Path, scratch: &Path) -> Option<Matrix3> {
    if !is_raw(path) {
        return None;
    }
    match RawConverter::default().camera_to_srgb(path, scratch) {
        Ok(Some(matrix)) => return primaries_from_matrix(&matrix),
        Ok(None) => eprintln!(
            "note: the colours of the camera that took {} are not known; \"camera\": {{\"color_matrix\"}} in capture.json can say them",
            path.display()
        ),
        Err(error) => eprintln!("note: {}: its colours are unknown: {error}", path.display()),
    }
    None
}

/// The camera's RGB of each primary, less that of the dark photograph; `None` if the session has no such photographs.
fn photographed_lights(session: &Session) -> Result<Option<[[f64; CHANNELS]; CHANNELS]>> {
    let photo = |role: PictureRole| session.photos_of(|other| *other == role).first().copied();
    let dark = photo(PictureRole::Dark);
    let primaries = Primary::ALL.map(|primary| photo(PictureRole::Primary { primary }));
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
    let path = session
        .developed
        .join(&session.sequence.pictures[photo].photo);
    let picture = image::open(&path).with_context(|| path.display().to_string())?;
    let picture = picture.into_rgb16();
    let mut sums = [0.0; CHANNELS];
    for pixel in picture.pixels() {
        for (sum, code) in sums.iter_mut().zip(pixel.0) {
            *sum += f64::from(code);
        }
    }
    let count = picture.pixels().len() as f64;
    Ok(sums.map(|sum| sum / count))
}
