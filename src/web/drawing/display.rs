//! How pictures are shown.

use wasm_bindgen::prelude::wasm_bindgen;

use crate::relight::{self, Gamut, ToneCurve};
use crate::transport::CHANNELS;
use crate::web::CodedError;

/// Brightness, white balance, gamut and tone curve; dithered.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug)]
pub struct Display(relight::Display);

impl Display {
    pub(in crate::web) fn inner(&self) -> relight::Display {
        self.0
    }
}

#[wasm_bindgen]
impl Display {
    /// `exposure` and `balance`, which is red, green and blue, are factors from 0 on; `gamut` is what
    /// the canvas is of, as drawing tells.
    #[wasm_bindgen(constructor)]
    pub fn new(
        exposure: f64,
        balance: &[f64],
        #[wasm_bindgen(unchecked_param_type = "\"clip\" | \"filmic\"")] curve: &str,
        #[wasm_bindgen(unchecked_param_type = "\"srgb\" | \"display-p3\"")] gamut: &str,
    ) -> Result<Display, CodedError> {
        let error = |what: String| CodedError::new("light-value", what);
        let balance: [f64; CHANNELS] = balance.try_into().map_err(|_| {
            error(format!(
                "a white balance has 3 factors, not {}",
                balance.len()
            ))
        })?;
        let mut gains = [0.0; CHANNELS];
        for (gain, factor) in gains.iter_mut().zip(balance) {
            let value = exposure * factor;
            // Neither has to be negative: two make a positive.
            let fits = exposure >= 0.0 && factor >= 0.0 && value <= f64::from(f32::MAX);
            if !fits {
                return Err(error(
                    "exposure and white balance must be numbers from 0 on, with products of 3.4e38 \
                     at most"
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
                    "there is no tone curve '{name}'; there are clip and filmic"
                )));
            }
        };
        Ok(Self(relight::Display {
            gains,
            curve,
            gamut: parse_gamut(gamut)?,
            dither: true,
        }))
    }
}

/// A gamut by the name that CSS has for it.
pub(in crate::web) fn parse_gamut(name: &str) -> Result<Gamut, CodedError> {
    let known = [Gamut::Srgb, Gamut::DisplayP3];
    let found = known.into_iter().find(|gamut| gamut.color_space() == name);
    found.ok_or_else(|| {
        let message = format!("there is no gamut '{name}'; there are srgb and display-p3");
        CodedError::new("light-value", message)
    })
}
