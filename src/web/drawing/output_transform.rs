//! The output transform of a page's pictures.

use wasm_bindgen::prelude::wasm_bindgen;

use crate::relight::{Gamut, OutputTransform, ToneCurve};
use crate::transport::CHANNELS;
use crate::web::CodedError;

/// Exposure, white balance, tone curve and gamut, with dither.
#[wasm_bindgen(js_name = OutputTransform)]
#[derive(Clone, Copy, Debug)]
pub struct WebOutputTransform(pub(in crate::web) OutputTransform);

#[wasm_bindgen(js_class = OutputTransform)]
impl WebOutputTransform {
    /// `exposure` is a factor on all channels, `balance` one on each of red, green and blue; `gamut` is that of the
    /// canvas.
    ///
    /// # Errors
    /// Code `light-value` for factors that are negative or too large and for unknown names.
    #[wasm_bindgen(constructor)]
    pub fn new(
        exposure: f64,
        balance: &[f64],
        #[wasm_bindgen(unchecked_param_type = "\"clip\" | \"filmic\"")] curve: &str,
        #[wasm_bindgen(unchecked_param_type = "\"srgb\" | \"display-p3\"")] gamut: &str,
    ) -> Result<WebOutputTransform, CodedError> {
        let error = |message: String| CodedError::new("light-value", message);
        let balance: [f64; CHANNELS] = balance.try_into().map_err(|_| {
            error(format!(
                "the white balance has {} factors; it needs 3",
                balance.len()
            ))
        })?;
        let mut gains = [0.0; CHANNELS];
        for (gain, factor) in gains.iter_mut().zip(balance) {
            let value = exposure * factor;
            // Each must be checked: two negative factors have a positive product.
            let is_valid = exposure >= 0.0 && factor >= 0.0 && value <= f64::from(f32::MAX);
            if !is_valid {
                return Err(error(
                    "exposure and white balance must be 0 or more, and their products at most 3.4e38"
                        .into(),
                ));
            }
            *gain = value as f32;
        }
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
            gains,
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
