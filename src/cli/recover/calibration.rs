//! Fields of the manifest that the photographs contradict: what they say instead.

use serde::Serialize;
use serde_json::{Value, json};

use super::messages::Warning;
use crate::capture::{CameraResponse, CodeStatistics, Manifest};
use crate::recover::ResponseHypothesis;
use crate::transport::{CHANNELS, Decibels};

/// Exponents are given to so many parts of one.
const EXPONENT_PRECISION: f64 = 100.0;
/// Logarithm of the exponent of a camera whose codes are proportional to light.
const MAX_LINEAR_LOG_EXPONENT: f64 = 0.05;
/// Exponent that is closest to the transfer function of sRGB.
const SRGB_EXPONENT: f64 = 2.2;

/// A field of the manifest that is estimated from the photographs, in `recover --json`.
#[derive(Clone, Debug, Serialize)]
pub struct EstimatedField {
    /// The field, for instance `light.gamma`.
    pub field: &'static str,
    /// Its value in the manifest; null if left out.
    pub declared: Value,
    /// The value that explains the photographs.
    pub estimated: Value,
    /// Whether the file was recovered with the estimated value.
    pub is_used: bool,
}

impl EstimatedField {
    fn new(field: &'static str, declared: impl Serialize, estimated: impl Serialize) -> Self {
        Self {
            field,
            declared: json!(declared),
            estimated: json!(estimated),
            is_used: false,
        }
    }

    /// The manifest's member, for instance `"light": {"gamma": 2.2}`.
    fn member(&self) -> String {
        match self.field.split_once('.') {
            Some((object, member)) => {
                format!("\"{object}\": {{\"{member}\": {}}}", self.estimated)
            }
            None => format!("\"{}\": {}", self.field, self.estimated),
        }
    }

    /// The warning that the photographs contradict the manifest at `path`.
    pub fn warning(&self, path: &str, reason: &str) -> Warning {
        let (code, remedy) = match self.field {
            "light.dimming" => (
                "display-dims",
                "Switch off power saving and dynamic contrast of the display, and photograph again",
            ),
            "camera.response" => (
                "camera-response",
                "Export the photographs without a tone curve",
            ),
            _ => ("display-response", "Measure the display's response"),
        };
        let ending = match self.is_used {
            true => "the estimated value is used, as --trust estimated says".to_owned(),
            false => format!(
                "{remedy}, or declare {} or give --trust estimated",
                self.member()
            ),
        };
        Warning {
            code,
            message: format!("{path}: {reason}. {ending}"),
        }
    }
}

/// The manifest with the saturation that the codes show though it is not declared.
pub fn with_saturation(
    manifest: &Manifest,
    codes: &[CodeStatistics],
) -> Option<(Manifest, EstimatedField)> {
    let camera = &manifest.camera;
    let mut saturation = camera.saturation.unwrap_or([camera.white; CHANNELS]);
    let declared = saturation;
    for codes in codes {
        for (own, found) in saturation.iter_mut().zip(codes.undeclared_saturation()) {
            *own = found.map_or(*own, |code| own.min(f64::from(code)));
        }
    }
    (saturation != declared).then(|| {
        let mut amended = manifest.clone();
        amended.camera.saturation = Some(saturation);
        let mut field = EstimatedField::new("camera.saturation", camera.saturation, saturation);
        field.is_used = true;
        (amended, field)
    })
}

/// The warning that codes are saturated though this is not declared.
pub fn saturation_warning(field: &EstimatedField, path: &str) -> Warning {
    Warning {
        code: "saturation-undeclared",
        message: format!(
            "{path}: many samples have one code, and hardly any the codes just below: they are saturated, and left out. \
             Declare {}, or expose less",
            field.member()
        ),
    }
}

/// The manifest with another response.
pub fn with_response(manifest: &Manifest, hypothesis: ResponseHypothesis) -> Manifest {
    let mut amended = manifest.clone();
    let light = &mut amended.light;
    match hypothesis {
        ResponseHypothesis::Display { exponent } => match &mut light.gamma {
            Some(gamma) => *gamma = rounded(*gamma * exponent),
            None => light.response = Some(powers(&manifest.light.emission(), exponent)),
        },
        ResponseHypothesis::Camera(response) => {
            amended.camera.response = composed(amended.camera.response, response);
        }
    }
    amended
}

/// The responses in which two manifests differ.
pub fn changed_responses(declared: &Manifest, estimated: &Manifest) -> Vec<EstimatedField> {
    let (light, camera) = (&declared.light, &declared.camera);
    let all = [
        EstimatedField::new("light.gamma", light.gamma, estimated.light.gamma),
        EstimatedField::new("light.response", &light.response, &estimated.light.response),
        EstimatedField::new(
            "camera.response",
            camera.response,
            estimated.camera.response,
        ),
    ];
    let is_changed = |field: &EstimatedField| field.declared != field.estimated;
    all.into_iter().filter(is_changed).collect()
}

/// The manifest with a display that dims.
pub fn with_dimming(manifest: &Manifest, dimming: f64) -> (Manifest, EstimatedField) {
    let mut amended = manifest.clone();
    let declared = amended.light.dimming;
    // What is declared already dims the patterns.
    let dimming = rounded_share(1.0 - (1.0 - dimming) * (1.0 - declared.unwrap_or(0.0)));
    amended.light.dimming = Some(dimming);
    (
        amended,
        EstimatedField::new("light.dimming", declared, dimming),
    )
}

/// Why the photographs contradict a response, by the SNR on held-out patterns with the declared one and the estimated one.
pub fn response_reason(
    field: &EstimatedField,
    declared: Option<Decibels>,
    estimated: Decibels,
) -> String {
    let what = match field.field {
        "camera.response" => "the photographs are not linear",
        _ => "the display's response is another",
    };
    let rise = match declared {
        Some(declared) => {
            format!("the SNR on held-out patterns rises from {declared} to {estimated}")
        }
        None => format!(
            "only then do the photographs follow from their patterns, with an SNR of {estimated}"
        ),
    };
    format!("{what}: with {}, {rise}", field.member())
}

/// Codes and emission to the power of `exponent`.
fn powers(emission: &[f64], exponent: f64) -> Vec<[f64; 2]> {
    let pairs = emission.iter().enumerate();
    pairs
        .map(|(code, e)| [code as f64, e.powf(exponent)])
        .collect()
}

/// The response of a camera whose photographs, linearised by `declared`, are linear after `then`.
fn composed(declared: CameraResponse, then: CameraResponse) -> CameraResponse {
    let exponent = match declared {
        CameraResponse::Linear => 1.0,
        CameraResponse::Gamma(exponent) => exponent,
        CameraResponse::Srgb => SRGB_EXPONENT,
    };
    match then {
        CameraResponse::Gamma(then)
            if (exponent * then).ln().abs() < MAX_LINEAR_LOG_EXPONENT && exponent != 1.0 =>
        {
            CameraResponse::Linear
        }
        CameraResponse::Gamma(then) => CameraResponse::Gamma(rounded(exponent * then)),
        other => other,
    }
}

fn rounded(exponent: f64) -> f64 {
    (exponent * EXPONENT_PRECISION).round() / EXPONENT_PRECISION
}

/// To a tenth of a percent.
fn rounded_share(share: f64) -> f64 {
    (share * 1000.0).round() / 1000.0
}
