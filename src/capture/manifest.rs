//! `capture.json`: patterns, photographs, and the calibration of camera and light plane.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::{CaptureError, CaptureErrorKind};
use super::measurements::Pattern;
use crate::calibrate::LightPlaneAxis;
use crate::transport::{
    CHANNELS, ColorMatrix, Correspondence, Extent, MAX_AREA, MAX_COLOR_FACTOR, MAX_SIDE,
};

/// Largest 16-bit code.
const MAX_CODE: f64 = 65535.0;
/// Largest share by which a display may dim.
const MAX_DIMMING: f64 = 0.9;
/// Bits 0 to 19 number the elements of the largest light plane.
const MAX_GRAY_CODE_BIT: u32 = MAX_SIDE.ilog2() - 1;

/// The manifest, version 1. Paths are relative to its folder. Unknown fields are ignored.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Always 1.
    pub version: u32,
    /// Title of the object, copied into the `.ltm` file, as are the next two.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// Author of the photographs.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub creator: String,
    /// Licence or other terms of use.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub rights: String,
    /// The light plane: a monitor or projector.
    pub light: ManifestLight,
    /// The camera.
    pub camera: ManifestCamera,
    /// Photograph under no light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dark: Option<String>,
    /// Photograph under full light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flood: Option<String>,
    /// The patterns and their photographs.
    pub shots: Vec<Shot>,
    /// Photographs of the Gray code patterns.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub graycode: Vec<GrayCodeShot>,
    /// The correspondence; decoded from the Gray code if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correspondence: Option<Correspondence>,
    /// Paths of unknown fields: misspelt, or of a later version.
    #[serde(skip)]
    pub unknown: Vec<String>,
}

/// The light plane, and the emission of each code.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ManifestLight {
    /// Elements along a row.
    pub width: u32,
    /// Elements down a column.
    pub height: u32,
    /// Emission is `(code / 255)^gamma`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gamma: Option<f64>,
    /// Instead of gamma: measured pairs `[code, emitted]` in rising order, interpolated linearly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub response: Option<Vec<[f64; 2]>>,
    /// Share by which the display dims a picture with all elements lit; others in proportion to their mean emission.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dimming: Option<f64>,
}

/// The camera grid and its range of codes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ManifestCamera {
    /// Pixels along a row.
    pub width: u32,
    /// Pixels down a column.
    pub height: u32,
    /// Code without light.
    pub black: f64,
    /// Code at full scale: measurement 1.
    pub white: f64,
    /// The tone curve of the photographs.
    #[serde(default, skip_serializing_if = "CameraResponse::is_linear")]
    pub response: CameraResponse,
    /// Code from which on each channel is saturated; white if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub saturation: Option<[f64; CHANNELS]>,
    /// From linear RGB of the photographs to linear sRGB, copied into the `.ltm` file; the identity if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color_matrix: Option<ColorMatrix>,
}

/// How codes follow from light: the inverse of the camera's response function.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CameraResponse {
    /// In proportion to it.
    #[default]
    Linear,
    /// By the transfer function of sRGB (IEC 61966-2-1).
    Srgb,
    /// Light is the code, as a share of white, to this power.
    Gamma(f64),
    /// With compressed highlights: light is `c / (s − (s − 1) c)` at the code `c`, as a share of white. The code rises `s`
    /// times as fast as without compression at black, and `1 / s` times as fast at white.
    Compression(f64),
}

impl CameraResponse {
    /// Light from a code, both as shares of white. Noise puts some codes below black.
    pub fn linearise(self, code: f64) -> f64 {
        // One function fewer in a WebAssembly module than by `libm::pow`.
        let power = |x: f64, gamma: f64| libm::exp(gamma * libm::log(x));
        match self {
            Self::Linear => code,
            Self::Srgb if code <= 0.04045 => code / 12.92,
            Self::Srgb => power((code + 0.055) / 1.055, 2.4),
            Self::Gamma(_) if code <= 0.0 => 0.0,
            Self::Gamma(gamma) => power(code, gamma),
            Self::Compression(slope) => code / (slope - (slope - 1.0) * code.max(0.0)),
        }
    }

    fn is_linear(&self) -> bool {
        *self == Self::Linear
    }
}

/// A pattern and its photograph.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Shot {
    /// 8-bit grey or RGB PNG of the light plane's size.
    pub pattern: String,
    /// Linear RGB PNG or TIFF of the camera's size, with 16-bit integers or, in a TIFF, floating-point numbers.
    pub photo: String,
    /// Exposure relative to a shot without this field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure: Option<f64>,
}

/// A photograph of one bit of the Gray code.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GrayCodeShot {
    /// Linear RGB PNG or TIFF, with integers or floating-point numbers as above.
    pub photo: String,
    /// `x` or `y`.
    pub axis: LightPlaneAxis,
    /// Bit number, 0 the least significant.
    pub bit: u32,
    /// Whether the pattern was shown inverted.
    pub inverted: bool,
}

impl ManifestLight {
    /// Size of the light plane.
    pub fn extent(&self) -> Extent {
        Extent::new(self.width, self.height)
    }

    /// A light plane of this gamma, without a size.
    pub fn of_gamma(gamma: f64) -> Self {
        Self {
            gamma: Some(gamma),
            ..Self::default()
        }
    }

    /// Exactly one of gamma and response must be given, and be usable. `unknown` are paths of the manifest's unknown fields.
    fn problems(&self, unknown: &[String]) -> Vec<CaptureErrorKind> {
        let dimming = self.dimming.unwrap_or(0.0);
        let dimming = check_range(
            (0.0..=MAX_DIMMING).contains(&dimming),
            "light.dimming",
            dimming,
            "between 0 and 0.9",
        );
        let response = match (&self.response, self.gamma) {
            (Some(_), Some(_)) => Err(CaptureErrorKind::ConflictingResponse),
            (Some(table), None) if !is_valid_response(table) => {
                Err(CaptureErrorKind::InvalidResponse)
            }
            (Some(_), None) => Ok(()),
            (None, Some(gamma)) => check_exponent("light.gamma", gamma),
            (None, None) => Err(CaptureErrorKind::MissingResponse {
                unknown: unknown.to_vec(),
            }),
        };
        [dimming, response]
            .into_iter()
            .filter_map(Result::err)
            .collect()
    }

    /// Dims a pattern as the display does.
    pub fn dim(&self, pattern: &mut Pattern) {
        let Some(dimming) = self.dimming else {
            return;
        };
        let planes = match pattern {
            Pattern::Grey(plane) => std::slice::from_mut(plane),
            Pattern::Rgb(planes) => &mut planes[..],
        };
        let mean = |plane: &Vec<f32>| plane.iter().sum::<f32>() / plane.len() as f32;
        let mean = planes.iter().map(mean).sum::<f32>() / planes.len() as f32;
        let factor = 1.0 - dimming as f32 * mean;
        planes
            .iter_mut()
            .flatten()
            .for_each(|emission| *emission *= factor);
    }

    /// Emission at each of the 256 codes, 1 at full brightness.
    pub fn emission(&self) -> [f64; 256] {
        let Some(table) = &self.response else {
            let gamma = self.gamma.unwrap_or(1.0);
            // One function fewer in a WebAssembly module than by `libm::pow`.
            let power = |x: f64| libm::exp(gamma * libm::log(x));
            return std::array::from_fn(|code| power(code as f64 / 255.0));
        };
        let full = interpolate(table, 255.0);
        std::array::from_fn(|code| interpolate(table, code as f64) / full)
    }
}

impl ManifestCamera {
    /// Size of the camera grid.
    pub fn extent(&self) -> Extent {
        Extent::new(self.width, self.height)
    }

    /// `(code − black) / (white − black)`, linearised, by exposure. The dark frame shows light, which scales with
    /// exposure, and is therefore subtracted from this value, not from the code.
    pub fn linear(&self, code: u16, exposure: f64) -> f32 {
        let share = (f64::from(code) - self.black) / (self.white - self.black);
        (self.response.linearise(share) / exposure) as f32
    }

    /// Whether a code of channel `c` is saturated.
    pub fn is_saturated(&self, code: u16, c: usize) -> bool {
        u32::from(code) >= self.saturated_from()[c]
    }

    /// The lowest code of each channel that is saturated.
    pub fn saturated_from(&self) -> [u32; CHANNELS] {
        let codes = self.saturation.unwrap_or([self.white; CHANNELS]);
        codes.map(|code| code.ceil() as u32)
    }

    /// The measurements of the `codes` of pixels at `exposure`, less those of the `dark` frame; NaN where saturated.
    pub fn measure(
        &self,
        codes: &[[u16; CHANNELS]],
        exposure: f64,
        dark: &[[f32; CHANNELS]],
    ) -> impl Iterator<Item = [f32; CHANNELS]> {
        let saturated_from = self.saturated_from();
        codes.iter().zip(dark).map(move |(codes, dark)| {
            std::array::from_fn(|c| match u32::from(codes[c]) >= saturated_from[c] {
                true => f32::NAN,
                false => self.linear(codes[c], exposure) - dark[c],
            })
        })
    }
}

impl Manifest {
    /// Parses and checks `json`, the contents of the file at `path`.
    ///
    /// # Errors
    /// Those of [`parse_unchecked`](Self::parse_unchecked), and the first of the [`problems`](Self::problems).
    pub fn parse(json: &str, path: &Path) -> Result<Self, CaptureError> {
        let manifest = Self::parse_unchecked(json, path)?;
        match manifest.problems().into_iter().next() {
            Some(problem) => Err(CaptureError::new(path, problem)),
            None => Ok(manifest),
        }
    }

    /// Parses `json`, the contents of the file at `path`, without a look at its [values](Self::problems).
    ///
    /// # Errors
    /// If it is not JSON, has an unknown version, lacks a field, or a field has the wrong type. The error names `path` and
    /// the field.
    pub fn parse_unchecked(json: &str, path: &Path) -> Result<Self, CaptureError> {
        let error = |problem| CaptureError::new(path, problem);
        let json_error = |reason| error(CaptureErrorKind::NotAManifest(reason));
        // The version first: another version may differ in any other field.
        #[derive(Deserialize)]
        struct VersionOnly {
            version: u64,
        }
        let VersionOnly { version } = serde_json::from_str(json).map_err(json_error)?;
        if version != 1 {
            return Err(error(CaptureErrorKind::UnknownVersion(version)));
        }
        let mut source = serde_json::Deserializer::from_str(json);
        let mut unknown = Vec::new();
        let mut add_unknown = |field: serde_ignored::Path| unknown.push(field.to_string());
        let deserializer = serde_ignored::Deserializer::new(&mut source, &mut add_unknown);
        let parsed: Result<Self, _> = serde_path_to_error::deserialize(deserializer);
        let manifest = match parsed {
            Ok(manifest) => manifest,
            Err(e) => {
                let at = Some(e.path().to_string()).filter(|_| e.path().iter().next().is_some());
                let reason = e.into_inner();
                return Err(match (missing_field(&reason), at) {
                    (Some(name), at) => {
                        let field = at.map_or(name.clone(), |at| format!("{at}.{name}"));
                        error(CaptureErrorKind::MissingField { field, unknown })
                    }
                    (None, Some(at)) => error(CaptureErrorKind::FieldType(at, reason)),
                    (None, None) => json_error(reason),
                });
            }
        };
        source.end().map_err(json_error)?;
        Ok(Self {
            unknown,
            ..manifest
        })
    }

    /// The problems of all fields with invalid values.
    pub fn problems(&self) -> Vec<CaptureErrorKind> {
        let mut problems = Vec::new();
        let mut check = |result: Result<(), CaptureErrorKind>| problems.extend(result.err());
        let (light, camera) = (&self.light, &self.camera);
        for (field, side) in [
            ("light.width", light.width),
            ("light.height", light.height),
            ("camera.width", camera.width),
            ("camera.height", camera.height),
        ] {
            let allowed = format!("between 1 and {MAX_SIDE}");
            let valid = (1..=MAX_SIDE).contains(&side);
            check(check_range(valid, field, side, &allowed));
        }
        for (field, grid) in [("light", light.extent()), ("camera", camera.extent())] {
            let allowed = format!("of at most {MAX_AREA} cells");
            check(check_range(!grid.is_too_large(), field, grid, &allowed));
        }
        let (black, white) = (camera.black, camera.white);
        let valid = (0.0..MAX_CODE).contains(&black);
        check(check_range(valid, "camera.black", black, "a 16-bit code"));
        let allowed = format!("a 16-bit code above \"camera.black\", {black}, by at least 1");
        let valid = white - black >= 1.0 && white <= MAX_CODE;
        check(check_range(valid, "camera.white", white, &allowed));
        for (c, saturation) in camera.saturation.iter().flatten().enumerate() {
            let valid = *saturation > black && *saturation <= white;
            let allowed =
                format!("above \"camera.black\", {black}, and at most \"camera.white\", {white}");
            let field = format!("camera.saturation[{c}]");
            check(check_range(valid, &field, saturation, &allowed));
        }
        for factor in camera.color_matrix.iter().flatten().flatten() {
            let valid = factor.abs() <= MAX_COLOR_FACTOR;
            let allowed = "between -1000 and 1000";
            check(check_range(valid, "camera.color_matrix", factor, allowed));
        }
        check(match camera.response {
            CameraResponse::Linear | CameraResponse::Srgb => Ok(()),
            CameraResponse::Gamma(gamma) => check_exponent("camera.response.gamma", gamma),
            CameraResponse::Compression(slope) => {
                check_exponent("camera.response.compression", slope)
            }
        });
        for problem in light.problems(&self.unknown) {
            check(Err(problem));
        }
        if self.shots.is_empty() {
            check(Err(CaptureErrorKind::NoShots));
        }
        for (i, shot) in self.shots.iter().enumerate() {
            let exposure = shot.exposure.unwrap_or(1.0);
            let valid = exposure.is_finite() && exposure > 0.0;
            let field = format!("shots[{i}].exposure");
            check(check_range(valid, &field, exposure, "above 0"));
        }
        for (i, GrayCodeShot { bit, .. }) in self.graycode.iter().enumerate() {
            let field = format!("graycode[{i}].bit");
            let allowed = format!("between 0 and {MAX_GRAY_CODE_BIT}");
            check(check_range(
                *bit <= MAX_GRAY_CODE_BIT,
                &field,
                bit,
                &allowed,
            ));
        }
        if let Some(Correspondence {
            affine,
            displacement,
            ..
        }) = &self.correspondence
        {
            let [[a, b, _], [c, d, _]] = affine;
            let finite = affine.iter().flatten().all(|x| x.is_finite());
            if !finite || a * d - b * c == 0.0 {
                check(Err(CaptureErrorKind::NotInvertible));
            }
            let camera = self.camera.extent();
            if displacement.as_ref().is_some_and(|grid| !grid.fits(camera)) {
                check(Err(CaptureErrorKind::DisplacementOfOtherPicture));
            }
        }
        problems
    }
}

impl Manifest {
    /// Index in `graycode` of the photograph of a bit.
    pub fn gray_code_index(&self, axis: LightPlaneAxis, bit: u32, inverted: bool) -> Option<usize> {
        let bit_of = |shot: &GrayCodeShot| (shot.axis, shot.bit, shot.inverted);
        let mut shots = self.graycode.iter();
        shots.position(|shot| bit_of(shot) == (axis, bit, inverted))
    }

    /// All photographs that the manifest names.
    pub fn photographs(&self) -> Vec<ListedPhotograph<'_>> {
        use PhotographRole::{Dark, Flood, GrayCode, Shot};
        let dark = self.dark.iter().map(|name| (Dark, name));
        let flood = self.flood.iter().map(|name| (Flood, name));
        let shots = self.shots.iter().enumerate();
        let shots = shots.map(|(i, shot)| (Shot(i), &shot.photo));
        let gray_code = self.graycode.iter().enumerate();
        let gray_code = gray_code.map(|(i, shot)| (GrayCode(i), &shot.photo));
        let all = dark.chain(flood).chain(shots).chain(gray_code);
        all.map(|(role, name)| ListedPhotograph { role, name })
            .collect()
    }
}

/// What a photograph is in its capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotographRole {
    /// Under no light.
    Dark,
    /// Under all light.
    Flood,
    /// That of a shot, by its index.
    Shot(usize),
    /// Of a bit of the Gray code, by its index in `graycode`.
    GrayCode(usize),
}

impl PhotographRole {
    /// The field that names the photograph.
    pub fn field(self) -> String {
        match self {
            Self::Dark => "dark".to_owned(),
            Self::Flood => "flood".to_owned(),
            Self::Shot(i) => format!("shots[{i}].photo"),
            Self::GrayCode(i) => format!("graycode[{i}].photo"),
        }
    }
}

/// A photograph that a manifest names.
#[derive(Clone, Copy, Debug)]
pub struct ListedPhotograph<'a> {
    /// Its role.
    pub role: PhotographRole,
    /// Its file.
    pub name: &'a str,
}

/// An exponent, or a ratio of slopes.
fn check_exponent(field: &str, value: f64) -> Result<(), CaptureErrorKind> {
    check_range(
        (0.1..=10.0).contains(&value),
        field,
        value,
        "between 0.1 and 10",
    )
}

fn check_range(
    is_valid: bool,
    field: &str,
    value: impl ToString,
    allowed: &str,
) -> Result<(), CaptureErrorKind> {
    match is_valid {
        true => Ok(()),
        false => Err(CaptureErrorKind::OutOfRange {
            field: field.to_owned(),
            value: value.to_string(),
            allowed: allowed.to_owned(),
        }),
    }
}

/// Whether codes and emission rise, and reach code 255 with light.
fn is_valid_response(table: &[[f64; 2]]) -> bool {
    let is_rising = |w: &[[f64; 2]]| w[0][0] < w[1][0] && w[0][1] <= w[1][1];
    table.len() >= 2
        && table.windows(2).all(is_rising)
        && table.iter().flatten().all(|x| x.is_finite() && *x >= 0.0)
        && table.last().is_some_and(|last| last[0] >= 255.0)
        && interpolate(table, 255.0) > 0.0
}

/// The piecewise linear function through `table` at `x`, constant beyond its ends.
fn interpolate(table: &[[f64; 2]], x: f64) -> f64 {
    let after = table.partition_point(|p| p[0] <= x);
    let point = |i: usize| table.get(i).copied();
    match (after.checked_sub(1).and_then(point), point(after)) {
        (Some([x0, y0]), Some([x1, y1])) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
        (Some([_, y]), None) | (None, Some([_, y])) => y,
        (None, None) => 0.0,
    }
}

/// The name of the field that serde says is missing.
fn missing_field(error: &serde_json::Error) -> Option<String> {
    let text = error.to_string();
    let (name, _) = text.strip_prefix("missing field `")?.split_once('`')?;
    Some(name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest(edit: impl Fn(&mut serde_json::Value)) -> Result<Manifest, CaptureError> {
        let mut json = serde_json::json!({
            "version": 1,
            "light": {"width": 4, "height": 4, "gamma": 2.0},
            "camera": {"width": 8, "height": 8, "black": 512, "white": 60000},
            "shots": [{"pattern": "a.png", "photo": "b.png"}],
            "someday": {"a": "field from the future"},
        });
        edit(&mut json);
        Manifest::parse(&json.to_string(), Path::new("x/capture.json"))
    }

    #[test]
    fn errors_name_the_file_and_the_field() {
        assert_eq!(manifest(|_| {}).unwrap().unknown, ["someday"]);
        type ManifestEdit = fn(&mut serde_json::Value);
        let cases: [(ManifestEdit, &str); 12] = [
            (
                |j| {
                    j["graycode"] = serde_json::json!([{"photo": "g", "axis": "z", "bit": 0, "inverted": false}])
                },
                "\"graycode[0].axis\"",
            ),
            (
                |j| j["graycode"] = serde_json::json!([{"photo": "g", "axis": "x", "bit": 4_000_000_000u32, "inverted": false}]),
                "\"graycode[0].bit\"",
            ),
            (|j| j["version"] = 2.into(), "\"version\" is 2"),
            (|j| j["light"]["width"] = 0.into(), "\"light.width\""),
            (|j| j["camera"]["white"] = 512.into(), "\"camera.white\""),
            (|j| j["camera"]["black"] = (-1).into(), "\"camera.black\""),
            (
                |j| j["light"]["gamma"] = serde_json::Value::Null,
                "\"light.gamma\"",
            ),
            (
                |j| j["light"]["response"] = serde_json::json!([[0, 0], [255, 1]]),
                "\"light.response\" and \"light.gamma\"",
            ),
            (
                |j| {
                    j["light"] =
                        serde_json::json!({"width": 4, "height": 4, "response": [[0, 0], [128, 1]]})
                },
                "up to code 255",
            ),
            (|j| j["shots"] = serde_json::json!([]), "\"shots\""),
            (
                |j| j["shots"][0]["exposure"] = 0.into(),
                "\"shots[0].exposure\"",
            ),
            (
                |j| j["correspondence"] = serde_json::json!({"affine": [[1, 0, 0], [2, 0, 0]]}),
                "\"correspondence.affine\"",
            ),
        ];
        for (edit, name) in cases {
            let message = manifest(edit).unwrap_err().to_string();
            assert!(message.contains(name), "{message}");
            assert!(message.contains("x/capture.json"), "{message}");
        }
        let missing = manifest(|j| j["camera"] = serde_json::json!({"width": 8}));
        let error = missing.unwrap_err().to_string();
        assert!(error.ends_with("\"camera.height\" is missing"), "{error}");
        let misspelt = manifest(|j| {
            j["shots"][0] = serde_json::json!({"pattern": "a.png", "photot": "b.png"});
        });
        let CaptureErrorKind::MissingField { field, unknown } = misspelt.unwrap_err().problem
        else {
            panic!("a different error")
        };
        assert_eq!(field, "shots[0].photo");
        assert_eq!(unknown, ["shots.0.photot"]);
        let missing = manifest(|j| drop(j.as_object_mut().unwrap().remove("light")));
        let error = missing.unwrap_err().to_string();
        assert!(error.ends_with("\"light\" is missing"), "{error}");
    }

    #[test]
    fn camera_responses_are_read_and_undone() {
        let camera = |response: serde_json::Value| {
            manifest(|j| j["camera"]["response"] = response.clone()).map(|m| m.camera)
        };
        let linear = manifest(|_| {}).unwrap().camera;
        let srgb = camera("srgb".into()).unwrap();
        let gamma = camera(serde_json::json!({"gamma": 2.0})).unwrap();
        assert_eq!(srgb.response, CameraResponse::Srgb);
        let code = (512.0 + 0.5 * 59_488.0) as u16;
        for (camera, expected) in [(&linear, 0.5), (&srgb, 0.214_04), (&gamma, 0.25)] {
            assert!(
                (camera.linear(code, 1.0) - expected).abs() < 1e-4,
                "{camera:?}"
            );
            assert!((camera.linear(60_000, 2.0) - 0.5).abs() < 1e-6);
            assert!(camera.linear(0, 1.0) <= 0.0);
        }
        assert!(
            serde_json::to_string(&srgb)
                .unwrap()
                .contains(r#""response":"srgb""#)
        );
        assert!(!serde_json::to_string(&linear).unwrap().contains("response"));
        let error = camera(serde_json::json!({"gamma": 0})).unwrap_err();
        assert!(
            error.to_string().contains("\"camera.response.gamma\""),
            "{error}"
        );
    }

    #[test]
    fn saturation_and_dimming_are_checked_and_applied() {
        let camera =
            manifest(|j| j["camera"]["saturation"] = serde_json::json!([9000, 8000, 60_000]));
        let camera = camera.unwrap().camera;
        assert!(camera.is_saturated(9000, 0) && !camera.is_saturated(8999, 0));
        assert!(camera.is_saturated(8000, 1) && !camera.is_saturated(59_999, 2));
        for (object, field, value, name) in [
            (
                "camera",
                "saturation",
                serde_json::json!([512, 600, 600]),
                "\"camera.saturation[0]\"",
            ),
            (
                "light",
                "dimming",
                serde_json::json!(0.95),
                "\"light.dimming\"",
            ),
        ] {
            let error = manifest(|j| j[object][field] = value.clone()).unwrap_err();
            assert!(error.to_string().contains(name), "{error}");
        }
        let light = manifest(|j| j["light"]["dimming"] = 0.2.into())
            .unwrap()
            .light;
        let mut grey = Pattern::Grey(vec![1.0, 0.0]);
        light.dim(&mut grey);
        assert_eq!(grey, Pattern::Grey(vec![0.9, 0.0]));
        // The mean is that of all channels.
        let mut red = Pattern::Rgb([vec![1.0, 1.0], vec![0.5, 0.0], vec![0.0, 0.5]]);
        light.dim(&mut red);
        assert_eq!(red.plane(0), [0.9, 0.9]);
    }

    #[test]
    fn response_table_is_interpolated_and_gamma_is_a_power() {
        // In cd/m² or relative to the maximum.
        for full in [1.0, 350.0] {
            let table = manifest(|j| {
                j["light"] = serde_json::json!({"width": 4, "height": 4,
                    "response": [[10, 0.0], [110, 0.5 * full], [255, full]]});
            });
            let emission = table.unwrap().light.emission();
            assert_eq!(emission[0], 0.0);
            assert!((emission[60] - 0.25).abs() < 1e-12);
            assert_eq!(emission[255], 1.0);
        }
        let gamma = manifest(|_| {}).unwrap().light.emission();
        assert!((gamma[51] - 0.04).abs() < 1e-12);
    }
}
