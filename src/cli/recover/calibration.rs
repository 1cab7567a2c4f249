//! Fields of the manifest that the photographs contradict, with their estimates.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::capture::{CameraResponse, CodeStatistics, Manifest};
use crate::cli::finding::Finding;
use crate::recover::ResponseHypothesis;
use crate::transport::{CHANNELS, Decibels};

/// Exponents and ratios of slopes are rounded to hundredths.
const EXPONENT_PRECISION: f64 = 100.0;
/// Logarithm of the exponent, or ratio of slopes, of a camera whose codes are proportional to light.
const MAX_LINEAR_LOG_PARAMETER: f64 = 0.05;
/// Exponent that is closest to the transfer function of sRGB.
const SRGB_EXPONENT: f64 = 2.2;

/// A field of the manifest that is estimated from the photographs, in `recover --json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EstimatedField {
    /// The field, for instance `light.gamma`.
    pub field: Cow<'static, str>,
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
            field: Cow::Borrowed(field),
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

    /// The finding that the photographs contradict the manifest at `path`: a warning unless the estimate is used.
    pub fn finding(&self, path: &str, reason: &str) -> Finding {
        let (code, remedy) = match &*self.field {
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
        match self.is_used {
            true => Finding::note(
                code,
                format!("{path}: {reason}. The estimated value is used, as --trust estimated says"),
            ),
            false => Finding::warning(
                code,
                format!(
                    "{path}: {reason}. {remedy}, or declare {} or give --trust estimated",
                    self.member()
                ),
            ),
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
            // A channel without light has all samples at black.
            let found = found.map(f64::from).filter(|code| *code > camera.black);
            *own = found.map_or(*own, |code| own.min(code));
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
pub fn saturation_warning(field: &EstimatedField, path: &str) -> Finding {
    let member = field.member();
    Finding::warning(
        "saturation-undeclared",
        format!(
            "{path}: many samples have one code, and hardly any the codes just below: they are saturated, and left out. \
             Declare {member}, or expose less"
        ),
    )
}

/// The manifest with another response.
pub fn with_response(manifest: &Manifest, hypothesis: ResponseHypothesis) -> Manifest {
    let mut amended = manifest.clone();
    let light = &mut amended.light;
    match hypothesis {
        ResponseHypothesis::Display { exponent } => match &mut light.gamma {
            Some(gamma) => *gamma = rounded(*gamma * exponent),
            None => {
                for pair in light.response.iter_mut().flatten() {
                    pair[1] = pair[1].powf(exponent);
                }
            }
        },
        ResponseHypothesis::Camera(response) => {
            let declared = amended.camera.response;
            amended.camera.response = composed(declared, response).unwrap_or(declared);
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

/// The manifest with compressed highlights. `None` if that has no name after the declared response.
pub fn with_compression(manifest: &Manifest, slope: f64) -> Option<(Manifest, EstimatedField)> {
    let response = ResponseHypothesis::Camera(CameraResponse::Compression(slope));
    let amended = with_response(manifest, response);
    let field = changed_responses(manifest, &amended).pop()?;
    Some((amended, field))
}

/// The manifest with a display that dims.
pub fn with_dimming(manifest: &Manifest, dimming: f64) -> (Manifest, EstimatedField) {
    let mut amended = manifest.clone();
    let declared = amended.light.dimming;
    // The patterns are dimmed as declared.
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
    let what = match &*field.field {
        "camera.response" => "the photographs are not linear",
        _ => "the display does not emit what is declared",
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

/// The response of a camera whose photographs, linearised by `declared`, are linear after `then`, if it has a name.
fn composed(declared: CameraResponse, then: CameraResponse) -> Option<CameraResponse> {
    use CameraResponse::{Compression, Gamma, Linear, Srgb};
    let exponent = |response| match response {
        Linear => Some(1.0),
        Gamma(exponent) => Some(exponent),
        Srgb => Some(SRGB_EXPONENT),
        Compression(_) => None,
    };
    let composed = match (declared, then) {
        (Linear, Srgb) => return Some(Srgb),
        (Linear, Compression(then)) => Compression(then),
        (Compression(declared), Compression(then)) => Compression(declared * then),
        (declared, then) => Gamma(exponent(declared)? * exponent(then)?),
    };
    Some(match composed {
        Gamma(parameter) | Compression(parameter) if is_nearly_one(parameter) => Linear,
        Gamma(exponent) => Gamma(rounded(exponent)),
        Compression(slope) => Compression(rounded(slope)),
        other => other,
    })
}

/// Whether an exponent, or ratio of slopes, is that of a linear response.
fn is_nearly_one(parameter: f64) -> bool {
    parameter.ln().abs() < MAX_LINEAR_LOG_PARAMETER
}

/// To the precision of an estimate, within the range that a manifest allows.
fn rounded(exponent: f64) -> f64 {
    let rounded = (exponent * EXPONENT_PRECISION).round() / EXPONENT_PRECISION;
    rounded.clamp(0.1, 10.0)
}

/// To a tenth of a percent.
fn rounded_share(share: f64) -> f64 {
    (share * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::ManifestLight;

    #[test]
    fn responses_of_the_camera_are_composed() {
        use CameraResponse::{Compression, Gamma, Linear, Srgb};
        for (declared, then, expected) in [
            (Linear, Srgb, Srgb),
            (Linear, Gamma(1.504), Gamma(1.5)),
            (Gamma(1.5), Gamma(1.2), Gamma(1.8)),
            (Gamma(2.0), Gamma(0.5), Linear),
            (Gamma(0.5), Srgb, Gamma(1.1)),
            (Srgb, Gamma(0.45), Linear),
            (Linear, Compression(1.304), Compression(1.3)),
            (Compression(1.5), Compression(1.2), Compression(1.8)),
            (Compression(1.5), Compression(0.66), Linear),
        ] {
            assert_eq!(
                composed(declared, then),
                Some(expected),
                "{declared:?} {then:?}"
            );
        }
        assert_eq!(composed(Gamma(2.0), Compression(1.5)), None);
    }

    #[test]
    fn fields_are_named_as_in_the_manifest() {
        let declared = Manifest {
            light: ManifestLight::of_gamma(1.8),
            ..Manifest::default()
        };
        let estimated = with_response(&declared, ResponseHypothesis::Display { exponent: 1.2222 });
        let fields = changed_responses(&declared, &estimated);
        assert_eq!(fields.len(), 1);
        assert_eq!(fields[0].member(), r#""light": {"gamma": 2.2}"#);
        let mut table = declared;
        table.light = ManifestLight {
            response: Some(vec![[0.0, 0.0], [128.0, 0.25], [255.0, 1.0]]),
            ..ManifestLight::default()
        };
        let estimated = with_response(&table, ResponseHypothesis::Display { exponent: 2.0 });
        let response = estimated.light.response.unwrap_or_default();
        assert_eq!(response, [[0.0, 0.0], [128.0, 0.0625], [255.0, 1.0]]);
        let (dimming, field) = with_dimming(&table, 0.1504);
        assert_eq!(dimming.light.dimming, Some(0.15));
        assert_eq!(field.member(), r#""light": {"dimming": 0.15}"#);
    }
}
