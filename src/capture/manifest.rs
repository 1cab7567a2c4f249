//! `capture.json`: what was photographed, with what, under which light.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::CaptureError;
use crate::transport::{Correspondence, Extent};

/// The manifest's file name.
pub const MANIFEST_NAME: &str = "capture.json";

/// The manifest, version 1. Paths are relative to its folder. Unknown fields are ignored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Always 1.
    pub version: u32,
    /// What the photographs show; goes into the file, as do the next two.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// Who made them.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub creator: String,
    /// Who may do what with them.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub rights: String,
    /// The display or projector.
    pub light: LightSpec,
    /// The camera.
    pub camera: CameraSpec,
    /// Photograph with every light element dark.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dark: Option<String>,
    /// Photograph with every light element at full brightness.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flood: Option<String>,
    /// The patterns and their photographs.
    pub shots: Vec<Shot>,
    /// Photographs of Gray code, most significant bit first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub graycode: Vec<GrayCodeShot>,
    /// Camera pixels to light elements.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correspondence: Option<AffineSpec>,
    /// Fields that are none of these, as paths into the JSON: of a later program, or misspelt.
    #[serde(skip)]
    pub unknown: Vec<String>,
}

/// The light plane and how its codes turn into light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightSpec {
    /// Elements along a row.
    pub width: u32,
    /// Elements down a column.
    pub height: u32,
    /// Emitted light is `(code / 255)^gamma`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gamma: Option<f64>,
    /// Or measured pairs `[code, emitted]` in rising order, interpolated linearly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub response: Option<Vec<[f64; 2]>>,
}

/// The camera grid and its linear code range.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraSpec {
    /// Pixels along a row.
    pub width: u32,
    /// Pixels down a column.
    pub height: u32,
    /// Code without light.
    pub black: f64,
    /// Code at full scale, where the measurement is 1.
    pub white: f64,
}

/// One pattern and its photograph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shot {
    /// 8-bit grey or RGB PNG of the light's extent.
    pub pattern: String,
    /// 16-bit linear RGB PNG of the camera's extent.
    pub photo: String,
    /// Exposure relative to a shot without this field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure: Option<f64>,
}

/// One photograph of a Gray code bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GrayCodeShot {
    /// 16-bit linear RGB PNG.
    pub photo: String,
    /// `x` or `y`.
    pub axis: String,
    /// Bit number, 0 the least significant.
    pub bit: u32,
    /// Whether the pattern was shown inverted.
    pub inverted: bool,
}

/// The correspondence as the manifest gives it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AffineSpec {
    /// `(x+½, y+½, 1)` on the camera to `(u, v)` on the light.
    pub affine: [[f64; 3]; 2],
}

impl LightSpec {
    /// Light plane extent.
    pub fn extent(&self) -> Extent {
        Extent {
            width: self.width,
            height: self.height,
        }
    }

    /// Light emitted for each of the 256 codes, 1 at full brightness.
    pub fn emission(&self) -> [f64; 256] {
        let full = self
            .response
            .as_ref()
            .map_or(1.0, |table| interpolate(table, 255.0));
        std::array::from_fn(|code| match (&self.response, self.gamma) {
            (Some(table), _) => interpolate(table, code as f64) / full,
            (None, gamma) => (code as f64 / 255.0).powf(gamma.unwrap_or(1.0)),
        })
    }
}

impl CameraSpec {
    /// Camera grid.
    pub fn extent(&self) -> Extent {
        Extent {
            width: self.width,
            height: self.height,
        }
    }

    /// `(code − black) / (white − black)` at unit exposure. The dark frame holds light, which grows
    /// with exposure, so it is subtracted after this, not from the code.
    pub fn linear(&self, code: u16, exposure: f64) -> f32 {
        ((f64::from(code) - self.black) / (self.white - self.black) / exposure) as f32
    }
}

impl From<&AffineSpec> for Correspondence {
    fn from(spec: &AffineSpec) -> Self {
        Self {
            affine: spec.affine,
        }
    }
}

impl Manifest {
    /// Parses and checks `json`, the contents of the file at `path`.
    pub fn parse(json: &str, path: &Path) -> Result<Self, CaptureError> {
        let json_error = |source| CaptureError::Json {
            path: path.to_owned(),
            source,
        };
        // The version first: a later version may differ in any other field.
        #[derive(Deserialize)]
        struct Versioned {
            version: u64,
        }
        let Versioned { version } = serde_json::from_str(json).map_err(json_error)?;
        if version != 1 {
            return Err(CaptureError::Version {
                path: path.to_owned(),
                version,
            });
        }
        let mut source = serde_json::Deserializer::from_str(json);
        let mut unknown = Vec::new();
        let mut note = |field: serde_ignored::Path| unknown.push(field.to_string());
        let noting = serde_ignored::Deserializer::new(&mut source, &mut note);
        let manifest: Self =
            serde_path_to_error::deserialize(noting).map_err(|error| match error.path() {
                at if at.iter().next().is_none() => json_error(error.into_inner()),
                at => CaptureError::Form {
                    path: path.to_owned(),
                    field: at.to_string(),
                    source: error.into_inner(),
                },
            })?;
        source.end().map_err(json_error)?;
        let manifest = Self {
            unknown,
            ..manifest
        };
        match manifest.problem() {
            None => Ok(manifest),
            Some((field, problem)) => Err(CaptureError::Field {
                path: path.to_owned(),
                field,
                problem,
            }),
        }
    }

    /// The first field whose value cannot be, and why.
    fn problem(&self) -> Option<(String, String)> {
        let bad = |field: &str, problem: String| Some((field.to_owned(), problem));
        let sides = [
            ("light.width", self.light.width),
            ("light.height", self.light.height),
            ("camera.width", self.camera.width),
            ("camera.height", self.camera.height),
        ];
        for (name, value) in sides {
            if !(1..=crate::transport::MAX_SIDE).contains(&value) {
                return bad(
                    name,
                    format!(
                        "is {value}; it must lie between 1 and {}",
                        crate::transport::MAX_SIDE
                    ),
                );
            }
        }
        let (black, white) = (self.camera.black, self.camera.white);
        if !(0.0..65535.0).contains(&black) {
            return bad(
                "camera.black",
                format!("is {black}; it must be a 16-bit code"),
            );
        }
        if !(white > black && white <= 65535.0) {
            return bad(
                "camera.white",
                format!("is {white}; it must be a 16-bit code above black, {black}"),
            );
        }
        match (&self.light.response, self.light.gamma) {
            (Some(table), _) => {
                let rising = table
                    .windows(2)
                    .all(|w| w[0][0] < w[1][0] && w[0][1] <= w[1][1]);
                let sane = table.iter().flatten().all(|x| x.is_finite() && *x >= 0.0);
                if self.light.gamma.is_some() {
                    return bad(
                        "light.response",
                        "is there beside \"gamma\", which it stands instead of: leave one of them"
                            .to_owned(),
                    );
                }
                let last = table.last().map_or([0.0; 2], |pair| *pair);
                if table.len() < 2
                    || !rising
                    || !sane
                    || last[0] < 255.0
                    || interpolate(table, 255.0) <= 0.0
                {
                    return bad(
                        "light.response",
                        "must be two or more [code, emitted] pairs, both rising, up to code 255"
                            .to_owned(),
                    );
                }
            }
            (None, Some(gamma)) if !(0.1..=10.0).contains(&gamma) => {
                return bad(
                    "light.gamma",
                    format!("is {gamma}; displays have about 2.2"),
                );
            }
            (None, None) => {
                return bad(
                    "light.gamma",
                    "is missing; give the display's gamma, or its response as a table".to_owned(),
                );
            }
            _ => {}
        }
        if self.shots.is_empty() {
            return bad("shots", "is empty; recovery needs photographs".to_owned());
        }
        for (i, shot) in self.shots.iter().enumerate() {
            if let Some(exposure) = shot.exposure
                && !(exposure.is_finite() && exposure > 0.0)
            {
                return bad(
                    &format!("shots[{i}].exposure"),
                    format!("is {exposure}; it must be above 0"),
                );
            }
        }
        for (i, shot) in self.graycode.iter().enumerate() {
            if !["x", "y"].contains(&shot.axis.as_str()) {
                let problem = format!("is {:?}; it must be \"x\" or \"y\"", shot.axis);
                return bad(&format!("graycode[{i}].axis"), problem);
            }
            if shot.bit > 15 {
                let problem = format!("is {}; bits are numbered 0 to 15", shot.bit);
                return bad(&format!("graycode[{i}].bit"), problem);
            }
        }
        if let Some(spec) = &self.correspondence {
            let [[a, b, _], [c, d, _]] = spec.affine;
            let finite = spec.affine.iter().flatten().all(|x| x.is_finite());
            if !finite || a * d - b * c == 0.0 {
                return bad(
                    "correspondence.affine",
                    "is not an invertible map of finite numbers".to_owned(),
                );
            }
        }
        None
    }
}

/// Piecewise linear through `table`, constant beyond its ends.
fn interpolate(table: &[[f64; 2]], x: f64) -> f64 {
    let after = table.partition_point(|p| p[0] <= x);
    let point = |i: usize| table.get(i).copied();
    match (after.checked_sub(1).and_then(point), point(after)) {
        (Some([x0, y0]), Some([x1, y1])) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
        (Some([_, y]), None) | (None, Some([_, y])) => y,
        (None, None) => 0.0,
    }
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
    fn a_bad_field_is_named_with_its_file() {
        assert_eq!(manifest(|_| {}).unwrap().unknown, ["someday"]);
        type Edit = fn(&mut serde_json::Value);
        let cases: [(Edit, &str); 12] = [
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
                "beside \"gamma\"",
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
        let CaptureError::Form { source, field, .. } = missing.unwrap_err() else {
            panic!("another error")
        };
        assert_eq!(field, "camera");
        assert!(
            source.to_string().contains("missing field `height`"),
            "{source}"
        );
    }

    #[test]
    fn response_table_is_interpolated_and_gamma_is_a_power() {
        // In candelas a square metre as well as in shares of the most.
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
