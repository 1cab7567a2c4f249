//! The pictures that a display shows in a session, in order.

use std::collections::HashSet;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::display_layout::{DisplayLayout, DisplayLayoutError};
use crate::calibrate::LightPlaneAxis;
use crate::capture::{GrayCodeShot, Manifest, ManifestCamera, ManifestLight, Shot};
use crate::simulate::{
    GrayCodePattern, MONITOR_GAMMA, PatternEnsemble, PatternImage, RandomStreamId,
};
use crate::transport::{CHANNELS, Extent, MAX_AREA, MAX_SIDE};

/// File name of a sequence.
pub const SEQUENCE_NAME: &str = "sequence.json";
/// Codes of the grey ramp. Black and white are the dark and the flood photograph.
const RAMP_CODES: [u8; 8] = [16, 32, 64, 96, 128, 160, 192, 224];
/// Columns or rows from one line to the next: light of a line hardly reaches another.
const LINE_SPACING: u32 = 8;
/// Patterns between two reference floods.
const REFERENCE_INTERVAL: u32 = 10;

/// The role of a picture.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "role", rename_all = "kebab-case")]
pub enum PictureRole {
    /// No element is lit: stray light and the sensor's black.
    Dark,
    /// All elements are lit.
    Flood,
    /// All elements have this code: the display's response.
    Ramp {
        /// The code.
        code: u8,
    },
    /// A bit of the Gray code: the correspondence.
    GrayCode(GrayCodePattern),
    /// A random pattern.
    Pattern {
        /// File with a pixel for each light element.
        pattern: String,
    },
    /// All elements are lit once more: how far the lamp has drifted.
    Reference,
    /// Every eighth column or row is lit: how sharply the display shows single elements.
    Lines {
        /// `x` for columns.
        axis: LightPlaneAxis,
    },
    /// All elements are lit by one primary: the camera's colours.
    Primary {
        /// The primary.
        primary: Primary,
    },
}

/// A primary of a display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Primary {
    /// Channel 0.
    Red,
    /// Channel 1.
    Green,
    /// Channel 2.
    Blue,
}

impl Primary {
    /// In the order of the channels.
    pub const ALL: [Self; CHANNELS] = [Self::Red, Self::Green, Self::Blue];

    fn name(self) -> &'static str {
        match self {
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
        }
    }
}

impl PictureRole {
    /// The codes of the light elements, `[M]`; `None` of a random pattern, which has a file.
    pub fn codes(&self, light: Extent) -> Option<PatternImage> {
        let uniform = |code: u8| PatternImage::uniform(light, code);
        Some(match self {
            Self::Dark => uniform(0),
            Self::Flood | Self::Reference => uniform(u8::MAX),
            Self::Ramp { code } => uniform(*code),
            Self::GrayCode(pattern) => pattern.codes(light),
            Self::Lines { axis } => {
                let code = |(u, v): (u32, u32)| {
                    let (n, side) = match axis {
                        LightPlaneAxis::X => (u, light.width),
                        LightPlaneAxis::Y => (v, light.height),
                    };
                    let spacing = LINE_SPACING.min(side);
                    if n % spacing == spacing / 2 {
                        u8::MAX
                    } else {
                        0
                    }
                };
                PatternImage::Grey(light.cells().map(code).collect())
            }
            Self::Primary { primary } => {
                let codes = Primary::ALL.map(|other| if other == *primary { u8::MAX } else { 0 });
                PatternImage::Rgb(vec![codes; light.area()])
            }
            Self::Pattern { .. } => return None,
        })
    }
}

/// A picture of the sequence.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SequencePicture {
    /// File with a pixel for each pixel of the display.
    pub picture: String,
    /// File that its photograph becomes.
    pub photo: String,
    /// Its role.
    #[serde(flatten)]
    pub role: PictureRole,
}

/// What a sequence is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SequenceSettings {
    /// The light plane on the display.
    pub layout: DisplayLayout,
    /// Number of random patterns.
    pub patterns: u32,
    /// Their distribution.
    pub ensemble: PatternEnsemble,
    /// Seed of their random numbers.
    pub seed: u64,
}

/// `sequence.json`, version 1: the pictures in the order in which they are shown. Paths are relative to its folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PatternSequence {
    /// Always 1.
    pub version: u32,
    /// The light plane on the display.
    pub layout: DisplayLayout,
    /// The pictures.
    pub pictures: Vec<SequencePicture>,
}

/// Why a file is no sequence.
#[derive(Debug, Error)]
pub enum SequenceError {
    /// It is not JSON, or lacks a field.
    #[error("is not a pattern sequence: {0}")]
    Json(#[from] serde_json::Error),
    /// It has another version.
    #[error("has version {0}; this program reads version 1")]
    Version(u32),
    /// There are no patterns.
    #[error("\"pictures\" has no random patterns")]
    NoPatterns,
    /// The light plane has no place on the display.
    #[error("\"layout\": {0}")]
    Layout(#[from] DisplayLayoutError),
    /// A side of the display or the light plane is zero or too large.
    #[error("\"layout\" has a side that is not between 1 and {MAX_SIDE}")]
    Side,
    /// The display or the light plane is too large.
    #[error("\"layout\" has more than {MAX_AREA} display pixels or light elements")]
    Area,
    /// A bit of the Gray code is none of the light plane's.
    #[error(
        "pictures[{index}]: \"bit\" is {bit}, but {light} light elements have no such bit of axis {axis}"
    )]
    GrayCodeBit {
        /// Index of the picture.
        index: usize,
        /// The bit.
        bit: u32,
        /// Its axis.
        axis: LightPlaneAxis,
        /// Size of the light plane in elements.
        light: Extent,
    },
    /// A path leads out of the folder that it must be in, or is there twice.
    #[error("pictures[{index}]: {path:?} must be the only PNG of this name in {folder}/")]
    Path {
        /// Index of the picture.
        index: usize,
        /// The path.
        path: String,
        /// Its folder.
        folder: &'static str,
    },
}

impl PatternSequence {
    /// Lists the pictures, and draws them: codes of the light elements, for each picture.
    pub fn draw(settings: &SequenceSettings) -> (Self, Vec<PatternImage>) {
        let light = settings.layout.light;
        let mut sequence = Self {
            version: 1,
            layout: settings.layout,
            pictures: Vec::new(),
        };
        let mut drawn = Vec::new();
        let mut show = |role: PictureRole, codes: Option<PatternImage>| {
            drawn.extend(codes.or_else(|| role.codes(light)));
            sequence.add(role);
        };
        show(PictureRole::Dark, None);
        show(PictureRole::Flood, None);
        for code in RAMP_CODES {
            show(PictureRole::Ramp { code }, None);
        }
        for pattern in GrayCodePattern::all(light) {
            show(PictureRole::GrayCode(pattern), None);
        }
        for i in 0..settings.patterns {
            if i > 0 && i % REFERENCE_INTERVAL == 0 {
                show(PictureRole::Reference, None);
            }
            let mut stream = RandomStreamId::Pattern(i).start(settings.seed);
            let pattern = format!("patterns/{i:04}.png");
            let codes = settings.ensemble.draw(light, &mut stream);
            show(PictureRole::Pattern { pattern }, Some(codes));
        }
        show(PictureRole::Reference, None);
        for axis in [LightPlaneAxis::X, LightPlaneAxis::Y] {
            show(PictureRole::Lines { axis }, None);
        }
        for primary in Primary::ALL {
            show(PictureRole::Primary { primary }, None);
        }
        (sequence, drawn)
    }

    /// Index of the first picture with a role.
    pub fn position(&self, role: &PictureRole) -> Option<usize> {
        self.pictures
            .iter()
            .position(|picture| picture.role == *role)
    }

    fn add(&mut self, role: PictureRole) {
        let of_role = |picture: &&SequencePicture| {
            std::mem::discriminant(&picture.role) == std::mem::discriminant(&role)
        };
        let i = self.pictures.iter().filter(of_role).count();
        let photo = match &role {
            PictureRole::Dark => "photos/dark.png".to_owned(),
            PictureRole::Flood => "photos/flood.png".to_owned(),
            PictureRole::Ramp { code } => format!("photos/ramp-{code:03}.png"),
            PictureRole::Reference => format!("photos/reference-{i:04}.png"),
            PictureRole::Lines { axis } => format!("photos/lines-{axis}.png"),
            PictureRole::Primary { primary } => format!("photos/{}.png", primary.name()),
            PictureRole::Pattern { .. } => format!("photos/{i:04}.png"),
            PictureRole::GrayCode(pattern) => pattern.shot().photo,
        };
        let label = match &role {
            PictureRole::Pattern { .. } => photo.replace("photos/", "pattern-"),
            _ => photo.replace("photos/", "").replace('/', "-"),
        };
        self.pictures.push(SequencePicture {
            picture: format!("display/{:04}-{label}", self.pictures.len()),
            photo,
            role,
        });
    }

    /// Parses `json`.
    ///
    /// # Errors
    /// If it is not a sequence of version 1 with patterns.
    pub fn parse(json: &str) -> Result<Self, SequenceError> {
        #[derive(Deserialize)]
        struct VersionOnly {
            version: u32,
        }
        let VersionOnly { version } = serde_json::from_str(json)?;
        if version != 1 {
            return Err(SequenceError::Version(version));
        }
        let sequence: Self = serde_json::from_str(json)?;
        let is_pattern =
            |picture: &SequencePicture| matches!(picture.role, PictureRole::Pattern { .. });
        if !sequence.pictures.iter().any(is_pattern) {
            return Err(SequenceError::NoPatterns);
        }
        sequence.check_layout()?;
        sequence.check_gray_code()?;
        sequence.check_paths()?;
        Ok(sequence)
    }

    fn check_layout(&self) -> Result<(), SequenceError> {
        let DisplayLayout {
            display,
            light,
            element_side,
        } = self.layout;
        let sides = [display.width, display.height, light.width, light.height];
        if !sides.iter().all(|side| (1..=MAX_SIDE).contains(side)) {
            return Err(SequenceError::Side);
        }
        if display.is_too_large() || light.is_too_large() {
            return Err(SequenceError::Area);
        }
        DisplayLayout::new(display, light, Some(element_side))?;
        Ok(())
    }

    /// The manifest has no other bits either.
    fn check_gray_code(&self) -> Result<(), SequenceError> {
        let light = self.layout.light;
        let bits = GrayCodePattern::all(light);
        for (index, picture) in self.pictures.iter().enumerate() {
            match picture.role {
                PictureRole::GrayCode(pattern) if !bits.contains(&pattern) => {
                    let GrayCodePattern { axis, bit, .. } = pattern;
                    return Err(SequenceError::GrayCodeBit {
                        index,
                        bit,
                        axis,
                        light,
                    });
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Every file is in the folder of its kind, and is there once.
    fn check_paths(&self) -> Result<(), SequenceError> {
        let mut seen = HashSet::new();
        for (index, picture) in self.pictures.iter().enumerate() {
            let photos = match picture.role {
                PictureRole::GrayCode(_) => "graycode",
                _ => "photos",
            };
            let mut paths = vec![("display", &picture.picture), (photos, &picture.photo)];
            if let PictureRole::Pattern { pattern } = &picture.role {
                paths.push(("patterns", pattern));
            }
            for (folder, path) in paths {
                if !is_png_in(folder, path) || !seen.insert(path) {
                    let path = path.clone();
                    return Err(SequenceError::Path {
                        index,
                        path,
                        folder,
                    });
                }
            }
        }
        Ok(())
    }

    /// The manifest of the capture folder that the photographs make; `response` is that of the display, if the ramp shows
    /// it.
    pub fn manifest(&self, camera: ManifestCamera, response: Option<Vec<[f64; 2]>>) -> Manifest {
        let Extent { width, height } = self.layout.light;
        let gamma = match response {
            Some(_) => None,
            None => Some(MONITOR_GAMMA),
        };
        let mut manifest = Manifest {
            version: 1,
            light: ManifestLight {
                width,
                height,
                gamma,
                response,
                ..ManifestLight::default()
            },
            camera,
            ..Manifest::default()
        };
        for SequencePicture { photo, role, .. } in &self.pictures {
            let photo = photo.clone();
            match role {
                PictureRole::Dark => manifest.dark = Some(photo),
                PictureRole::Flood => manifest.flood = Some(photo),
                PictureRole::Ramp { .. }
                | PictureRole::Reference
                | PictureRole::Lines { .. }
                | PictureRole::Primary { .. } => {}
                PictureRole::GrayCode(pattern) => manifest.graycode.push(GrayCodeShot {
                    photo,
                    ..pattern.shot()
                }),
                PictureRole::Pattern { pattern } => manifest.shots.push(Shot {
                    pattern: pattern.clone(),
                    photo,
                    exposure: None,
                }),
            }
        }
        manifest
    }
}

/// Whether `path` is that of a PNG right in `folder`.
fn is_png_in(folder: &str, path: &str) -> bool {
    let name = path
        .strip_prefix(folder)
        .and_then(|rest| rest.strip_prefix('/'));
    name.and_then(|name| name.strip_suffix(".png"))
        .is_some_and(|stem| !stem.is_empty() && !stem.contains(['/', '\\']))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> SequenceSettings {
        let light = Extent::new(12, 8);
        SequenceSettings {
            layout: DisplayLayout::new(Extent::new(120, 90), light, None).unwrap(),
            patterns: 25,
            ensemble: PatternEnsemble::Bernoulli,
            seed: 7,
        }
    }

    #[test]
    fn a_sequence_has_calibration_first_and_a_reference_after_every_ten_patterns() {
        let (sequence, drawn) = PatternSequence::draw(&settings());
        // 4 bits of the columns and 3 of the rows, each with its inverse.
        assert_eq!(sequence.pictures.len(), 2 + 8 + 14 + 25 + 3 + 2 + 3);
        assert_eq!(drawn.len(), sequence.pictures.len());
        assert_eq!(sequence.pictures[0].role, PictureRole::Dark);
        let references = sequence.pictures.iter().enumerate();
        let references = references.filter(|(_, p)| p.role == PictureRole::Reference);
        let places: Vec<usize> = references.map(|(i, _)| i - 24).collect();
        assert_eq!(places, [10, 21, 27]);
        let PatternImage::Grey(pattern) = &drawn[24] else {
            panic!("a random pattern is grey");
        };
        assert_eq!(pattern.iter().filter(|&&c| c == 0 || c == 255).count(), 96);
        let [.., reference, _, lines, red, green, blue] = &sequence.pictures[..] else {
            panic!("too few pictures");
        };
        assert_eq!(reference.picture, "display/0051-reference-0002.png");
        assert_eq!(reference.photo, "photos/reference-0002.png");
        let photos = [red, green, blue].map(|picture| &picture.photo[..]);
        assert_eq!(
            photos,
            ["photos/red.png", "photos/green.png", "photos/blue.png"]
        );
        assert_eq!(drawn[55], PatternImage::Rgb(vec![[0, 255, 0]; 96]));
        assert_eq!(lines.photo, "photos/lines-y.png");
        let row_4 = (0..96).map(|m| if m / 12 == 4 { 255 } else { 0 });
        assert_eq!(drawn[53], PatternImage::Grey(row_4.collect()));
    }

    #[test]
    fn a_sequence_is_read_as_it_is_written() {
        let (sequence, _) = PatternSequence::draw(&settings());
        let json = serde_json::to_string(&sequence).unwrap();
        assert_eq!(PatternSequence::parse(&json).unwrap(), sequence);
        for (json, part) in [
            ("{}", "missing field `version`"),
            (r#"{"version": 2}"#, "version 2"),
            (
                &json.replace("\"pattern\"", "\"flood\""),
                "no random patterns",
            ),
            (
                &json.replacen("\"bit\":3", "\"bit\":4", 1),
                "\"bit\" is 4, but 12x8 light elements",
            ),
        ] {
            let error = PatternSequence::parse(json).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn the_manifest_lists_what_recovery_needs() {
        let (sequence, _) = PatternSequence::draw(&settings());
        let camera = ManifestCamera {
            width: 30,
            height: 20,
            black: 0.0,
            white: 65535.0,
            ..ManifestCamera::default()
        };
        let manifest = sequence.manifest(camera, None);
        let json = serde_json::to_string(&manifest).unwrap();
        let parsed = Manifest::parse(&json, std::path::Path::new("capture.json")).unwrap();
        assert_eq!((parsed.shots.len(), parsed.graycode.len()), (25, 14));
        assert_eq!(parsed.shots[3].pattern, "patterns/0003.png");
        assert_eq!(parsed.flood.as_deref(), Some("photos/flood.png"));
        assert_eq!(parsed.light.gamma, Some(MONITOR_GAMMA));
    }
}
