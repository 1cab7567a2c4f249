//! The output transform of a page's pictures.

use wasm_bindgen::prelude::wasm_bindgen;

use crate::relight::{Gamut, OutputTransform, ToneCurve};
use crate::transport::CHANNELS;
use crate::web::CodedError;

/// Colour matrix, exposure, white balance, tone curve and gamut, with dither.
#[wasm_bindgen(js_name = OutputTransform)]
#[derive(Clone, Copy, Debug)]
pub struct WebOutputTransform(pub(in crate::web) OutputTransform);

#[wasm_bindgen(js_class = OutputTransform)]
impl WebOutputTransform {
    /// `matrix` has 9 factors: from the photograph's linear RGB to linear sRGB, row by row, times exposure and white
    /// balance. `gamut` is that of the canvas.
    ///
    /// # Errors
    /// Code `light-value` for factors that single precision cannot hold and for unknown names.
    #[wasm_bindgen(constructor)]
    pub fn new(
        matrix: &[f32],
        #[wasm_bindgen(unchecked_param_type = "\"clip\" | \"filmic\"")] curve: &str,
        #[wasm_bindgen(unchecked_param_type = "\"srgb\" | \"display-p3\"")] gamut: &str,
    ) -> Result<WebOutputTransform, CodedError> {
        let error = |message: String| CodedError::new("light-value", message);
        let (rows, rest) = matrix.as_chunks::<CHANNELS>();
        let valid = matrix.iter().all(|factor| factor.is_finite()) && rest.is_empty();
        let matrix = rows.try_into().ok().filter(|_| valid).ok_or_else(|| {
            let message =
                "a colour matrix with exposure and white balance has 9 factors of at most 3.4e38";
            error(message.into())
        })?;
        let curve = match curve {
            "clip" => ToneCurve::Clip,
            "filmic" => ToneCurve::Filmic,
            name => {
                return Err(error(format!(
                    "unknown tone curve '{name}'; use clip or filmic"
                )));
            }
        };
        Ok(Self(OutputTransform {
            matrix,
            curve,
            gamut: parse_gamut(gamut)?,
            dither: true,
        }))
    }
}

/// The gamut of that CSS name.
///
/// # Errors
/// Code `light-value` for other names.
pub(in crate::web) fn parse_gamut(name: &str) -> Result<Gamut, CodedError> {
    let known = [Gamut::Srgb, Gamut::DisplayP3];
    let found = known.into_iter().find(|gamut| gamut.color_space() == name);
    found.ok_or_else(|| {
        let message = format!("unknown gamut '{name}'; use srgb or display-p3");
        CodedError::new("light-value", message)
    })
}
