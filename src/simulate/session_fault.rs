//! Faults of a session of photographs: what rigs do to the pictures that a simulation computes.

use std::f64::consts::TAU;
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};

use super::camera::Camera;
use super::separable_filter::{blurred, shifted};
use crate::capture::{LinearPhoto, Manifest};
use crate::transport::{CHANNELS, Extent};

/// The kind of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SessionFaultKind {
    /// One photograph has this share of its exposure.
    Underexposed,
    /// One photograph is of another object: of this one, turned by 180 degrees.
    Object,
    /// One photograph is of a pattern from another session.
    Pattern,
    /// One photograph has this share of its light from the pattern before.
    Blend,
    /// Two photographs are swapped.
    Swap,
    /// From a third of the session on, each photograph is of the next pattern.
    Slip,
    /// Exposures vary by this standard deviation.
    Jitter,
    /// The lamp's brightness changes by this share over the session.
    Drift,
    /// Half the photographs have this much more exposure than is declared.
    Exposure,
    /// Room light of this share of white that the dark frame lacks.
    Room,
    /// Room light that grows to this share of white.
    GrowingRoom,
    /// The camera stands elsewhere in every photograph, by this standard deviation in pixels along each axis.
    Tremble,
    /// The camera moves once, in the middle, by so many pixels to the right and 0.6 times as many down.
    Move,
    /// The map is declared mirrored.
    Mirror,
    /// The display's gamma is declared as this.
    Gamma,
    /// The display dims bright pictures: by this share when all elements are lit.
    Dimming,
    /// Photographs have the curve of sRGB.
    Srgb,
    /// Photographs have compressed highlights: codes rise so many times as fast at black as in proportion to light.
    Compression,
    /// Samples above this share of white are saturated, which is not declared.
    Clip,
    /// This share of the pixels is hot, and as many are dead.
    Defects,
    /// Photographs are stored in 8 bits.
    EightBit,
    /// The operating system enlarges pictures smoothly: a blur of this standard deviation in light elements.
    Smooth,
    /// The mains modulate the light by this amplitude, of which a rolling shutter shows three periods from the top to the
    /// bottom.
    Flicker,
}

use SessionFaultKind as Kind;

impl SessionFaultKind {
    /// Range of the sizes.
    fn sizes(self) -> RangeInclusive<f64> {
        match self {
            Self::Gamma | Self::Compression => 0.1..=10.0,
            _ => 0.0..=16.0,
        }
    }
}

/// Periods of flickering light in the time that a rolling shutter takes from the first row to the last.
const FLICKER_PERIODS: f64 = 3.0;

/// Kinds, their names, and the sizes that they have where none is given.
const KINDS: [(&str, Kind, Option<f64>); 23] = [
    ("underexposed", Kind::Underexposed, Some(0.5)),
    ("object", Kind::Object, None),
    ("pattern", Kind::Pattern, None),
    ("blend", Kind::Blend, Some(0.5)),
    ("swap", Kind::Swap, None),
    ("slip", Kind::Slip, None),
    ("jitter", Kind::Jitter, Some(0.02)),
    ("drift", Kind::Drift, Some(0.05)),
    ("exposure", Kind::Exposure, Some(0.05)),
    ("room", Kind::Room, Some(0.01)),
    ("growing-room", Kind::GrowingRoom, Some(0.02)),
    ("tremble", Kind::Tremble, Some(0.2)),
    ("move", Kind::Move, Some(0.5)),
    ("mirror", Kind::Mirror, None),
    ("gamma", Kind::Gamma, Some(1.8)),
    ("dimming", Kind::Dimming, Some(0.15)),
    ("srgb", Kind::Srgb, None),
    ("compression", Kind::Compression, Some(1.5)),
    ("clip", Kind::Clip, Some(0.4)),
    ("defects", Kind::Defects, Some(0.001)),
    ("8-bit", Kind::EightBit, None),
    ("smooth", Kind::Smooth, Some(0.5)),
    ("flicker", Kind::Flicker, Some(0.01)),
];

/// A fault and its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SessionFault {
    /// Its kind.
    pub kind: SessionFaultKind,
    /// How much; see [`SessionFaultKind`]. Not used by kinds without a size.
    pub size: f64,
}

impl SessionFault {
    /// All kinds, at their own sizes.
    pub fn all() -> impl Iterator<Item = Self> {
        let fault = |(_, kind, size): (&str, Kind, Option<f64>)| Self {
            kind,
            size: size.unwrap_or(0.0),
        };
        KINDS.into_iter().map(fault)
    }

    /// Changes the emissions `[M]` of the patterns on the `light` plane, and of other lights, which are `others`.
    pub fn change_emissions(
        self,
        light: Extent,
        patterns: &mut [Vec<f32>],
        others: &mut [Vec<f32>],
        random: &mut ChaCha8Rng,
    ) {
        let middle = patterns.len() / 2;
        match self.kind {
            Kind::Pattern => {
                // The emissions of the pattern in another order.
                let pattern = &mut patterns[middle];
                for m in (1..pattern.len()).rev() {
                    let share: f64 = StandardUniform.sample(random);
                    pattern.swap(m, (share * (m + 1) as f64) as usize);
                }
            }
            Kind::Dimming => {
                for emissions in patterns.iter_mut().chain(others) {
                    let mean = emissions.iter().sum::<f32>() / emissions.len() as f32;
                    let factor = 1.0 - self.size as f32 * mean;
                    emissions
                        .iter_mut()
                        .for_each(|emission| *emission *= factor);
                }
            }
            Kind::Smooth => {
                for emissions in patterns.iter_mut().chain(others) {
                    *emissions = blurred(emissions, light, self.size);
                }
            }
            _ => {}
        }
    }

    /// Changes the pictures of the patterns, in units of the measurement.
    pub fn change_pictures(
        self,
        camera: Extent,
        pictures: &mut [LinearPhoto],
        random: &mut ChaCha8Rng,
    ) {
        let count = pictures.len();
        let middle = count / 2;
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let size = self.size;
        // Between 0 and 1 over the session.
        let time = |l: usize| l as f64 / (count - 1).max(1) as f64;
        match self.kind {
            Kind::Underexposed => scale(&mut pictures[middle], size),
            Kind::Object => pictures[middle].reverse(),
            Kind::Blend if middle > 0 => {
                let before = pictures[middle - 1].clone();
                for (y, before) in pictures[middle].iter_mut().zip(before) {
                    for c in 0..CHANNELS {
                        y[c] += size as f32 * (before[c] - y[c]);
                    }
                }
            }
            Kind::Swap if middle + 1 < count => pictures.swap(middle, middle + 1),
            Kind::Slip => pictures[count / 3..].rotate_left(1),
            Kind::Jitter => {
                for picture in pictures {
                    scale(picture, 1.0 + size * normal());
                }
            }
            Kind::Drift => {
                for (l, picture) in pictures.iter_mut().enumerate() {
                    scale(picture, 1.0 + size * (time(l) - 0.5));
                }
            }
            Kind::Exposure => {
                for picture in pictures.iter_mut().skip(1).step_by(2) {
                    scale(picture, 1.0 + size);
                }
            }
            Kind::Room | Kind::GrowingRoom => {
                let grows = self.kind == Kind::GrowingRoom;
                for (l, picture) in pictures.iter_mut().enumerate() {
                    let light = if grows { size * time(l) } else { size };
                    let samples = picture.as_flattened_mut();
                    samples.iter_mut().for_each(|y| *y += light as f32);
                }
            }
            Kind::Tremble => {
                for picture in pictures {
                    let shift = [size * normal(), size * normal()];
                    *picture = shifted(picture, camera, shift);
                }
            }
            Kind::Move => {
                for picture in &mut pictures[middle..] {
                    *picture = shifted(picture, camera, [size, 0.6 * size]);
                }
            }
            Kind::Flicker => {
                for picture in pictures {
                    let phase: f64 = StandardUniform.sample(random);
                    let rows = picture.chunks_exact_mut(camera.width as usize);
                    for (y, row) in rows.enumerate() {
                        let periods = FLICKER_PERIODS * y as f64 / f64::from(camera.height);
                        scale(row, 1.0 + size * (TAU * (periods + phase)).sin());
                    }
                }
            }
            _ => {}
        }
    }

    /// Changes the codes `[N]` of any photograph.
    pub fn change_codes(self, codes: &mut [[u16; CHANNELS]]) {
        let samples = codes.as_flattened_mut();
        let range = Camera::WHITE - Camera::BLACK;
        match self.kind {
            Kind::Srgb => {
                for code in samples {
                    let y = ((f64::from(*code) - Camera::BLACK) / range).max(0.0);
                    let curve = match y {
                        y if y <= 0.003_130_8 => 12.92 * y,
                        y => 1.055 * y.powf(1.0 / 2.4) - 0.055,
                    };
                    *code = (Camera::BLACK + range * curve).round() as u16;
                }
            }
            Kind::Compression => {
                for code in samples {
                    let y = (f64::from(*code) - Camera::BLACK) / range;
                    let curve = self.size * y / (1.0 + (self.size - 1.0) * y);
                    *code = (Camera::BLACK + range * curve).round() as u16;
                }
            }
            Kind::Clip => {
                let white = (Camera::BLACK + range * self.size) as u16;
                samples
                    .iter_mut()
                    .for_each(|code| *code = (*code).min(white));
            }
            Kind::Defects => {
                let count = codes.len();
                let defects = (self.size * count as f64).round() as usize;
                // The golden ratio spreads them over the picture.
                let pixel = |i: usize| ((i as f64 + 0.5) * 0.618_033_988_75).fract() * count as f64;
                for i in 0..2 * defects {
                    let code = if i % 2 == 0 {
                        u16::MAX
                    } else {
                        Camera::BLACK as u16
                    };
                    codes[pixel(i) as usize] = [code; CHANNELS];
                }
            }
            Kind::EightBit => samples
                .iter_mut()
                .for_each(|code| *code = (f64::from(*code) / 257.0).round() as u16 * 257),
            _ => {}
        }
    }

    /// Whether the fault is in the correspondence that is declared.
    pub fn is_of_correspondence(self) -> bool {
        self.kind == Kind::Mirror
    }

    /// Whether the manifest has the fault, and not the photographs.
    pub fn is_declared(self) -> bool {
        matches!(self.kind, Kind::Mirror | Kind::Gamma)
    }

    /// Whether it is one of several photographs, or of what is declared of them.
    pub fn is_of_session(self) -> bool {
        let is_of_several = matches!(
            self.kind,
            Kind::Blend | Kind::Swap | Kind::Slip | Kind::Exposure
        );
        is_of_several || self.is_declared()
    }

    /// Changes the manifest.
    pub fn change_manifest(self, manifest: &mut Manifest) {
        match self.kind {
            Kind::Mirror => {
                if let Some(correspondence) = &mut manifest.correspondence {
                    let [a, b, c] = correspondence.affine[0];
                    correspondence.affine[0] = [-a, -b, f64::from(manifest.light.width) - c];
                }
            }
            Kind::Gamma => {
                (manifest.light.gamma, manifest.light.response) = (Some(self.size), None);
            }
            _ => {}
        }
    }
}

impl fmt::Display for SessionFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = KINDS.iter().find(|(_, kind, _)| *kind == self.kind);
        match named {
            Some((name, _, Some(_))) => write!(f, "{name}={}", self.size),
            Some((name, ..)) => f.write_str(name),
            None => Ok(()),
        }
    }
}

impl FromStr for SessionFault {
    type Err = String;

    /// Parses `NAME` or `NAME=SIZE`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, size) = match text.split_once('=') {
            Some((name, size)) => (name, Some(size)),
            None => (text, None),
        };
        let Some((_, kind, default)) = KINDS.into_iter().find(|(other, ..)| *other == name) else {
            let names: Vec<String> = Self::all().map(|fault| fault.to_string()).collect();
            return Err(format!(
                "{name:?} is no fault; the faults are {}",
                names.join(", ")
            ));
        };
        let size = match (size, default) {
            (None, default) => default.unwrap_or(0.0),
            (Some(_), None) => return Err(format!("{name} has no size; give {name} alone")),
            (Some(size), Some(_)) => match size.parse::<f64>() {
                Ok(size) if kind.sizes().contains(&size) => size,
                _ => {
                    let (least, largest) = kind.sizes().into_inner();
                    return Err(format!(
                        "the size of {name} must be a number from {least} to {largest}"
                    ));
                }
            },
        };
        Ok(Self { kind, size })
    }
}

fn scale(picture: &mut [[f32; CHANNELS]], factor: f64) {
    let samples = picture.as_flattened_mut();
    samples.iter_mut().for_each(|y| *y *= factor as f32);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::RandomStreamId;

    #[test]
    fn faults_are_written_as_they_are_read() {
        for fault in SessionFault::all() {
            assert_eq!(fault.to_string().parse(), Ok(fault));
        }
        assert_eq!(
            "jitter=0.01"
                .parse::<SessionFault>()
                .map(|fault| fault.size),
            Ok(0.01)
        );
        for (text, part) in [
            ("jiter", "the faults are"),
            ("swap=1", "no size"),
            ("move=x", "0 to 16"),
            ("gamma=0", "0.1 to 10"),
        ] {
            let error = text.parse::<SessionFault>().unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn faults_change_what_they_name() {
        let camera = Extent::new(8, 8);
        let clean: Vec<LinearPhoto> = (0..6)
            .map(|l| {
                (0..64)
                    .map(|n| [(l * 64 + n) as f32 / 1000.0; CHANNELS])
                    .collect()
            })
            .collect();
        let changed = |text: &str| -> Vec<usize> {
            let fault: SessionFault = text.parse().unwrap();
            let mut pictures = clean.clone();
            fault.change_pictures(camera, &mut pictures, &mut RandomStreamId::Fault.start(1));
            (0..6).filter(|&l| pictures[l] != clean[l]).collect()
        };
        assert_eq!(changed("underexposed"), [3]);
        assert_eq!(changed("object"), [3]);
        assert_eq!(changed("blend"), [3]);
        assert_eq!(changed("swap"), [3, 4]);
        assert_eq!(changed("slip"), [2, 3, 4, 5]);
        assert_eq!(changed("move"), [3, 4, 5]);
        assert_eq!(changed("exposure"), [1, 3, 5]);
        assert_eq!(changed("growing-room"), [1, 2, 3, 4, 5]);
        for text in ["jitter", "room", "tremble", "flicker"] {
            assert_eq!(changed(text).len(), 6, "{text}");
        }
        assert_eq!(changed("clip"), [0; 0]);
        let mut pictures = clean.clone();
        let flicker: SessionFault = "flicker=0.1".parse().unwrap();
        flicker.change_pictures(camera, &mut pictures, &mut RandomStreamId::Fault.start(1));
        for (picture, clean) in pictures.iter().zip(&clean) {
            let factors: Vec<f32> = (1..64).map(|n| picture[n][0] / clean[n][0]).collect();
            assert!(factors.iter().all(|factor| (0.9..=1.1).contains(factor)));
            // Rows are exposed one after the other, each as a whole.
            assert!((factors[8] - factors[14]).abs() < 1e-4);
            assert!((factors[8] - factors[16]).abs() > 1e-3);
        }
        let codes = |text: &str| {
            let mut codes: Vec<[u16; CHANNELS]> =
                (0..1000).map(|i| [600 + 50 * i; CHANNELS]).collect();
            text.parse::<SessionFault>()
                .unwrap()
                .change_codes(&mut codes);
            codes
        };
        assert!(
            codes("8-bit")
                .as_flattened()
                .iter()
                .all(|code| code % 257 == 0)
        );
        let count =
            |text: &str, code: u16| codes(text).iter().filter(|codes| codes[0] == code).count();
        assert_eq!(
            (count("defects=0.01", u16::MAX), count("defects=0.01", 512)),
            (10, 10)
        );
        // 33.4 % of white becomes 50.1 %.
        assert_eq!(codes("compression=2")[396][0], 30_322);
        assert!(count("clip=0.5", (512.0f64 + 0.5 * 59_488.0) as u16) > 300);
    }

    #[test]
    fn smooth_enlargement_blurs_patterns_and_other_lights() {
        let light = Extent::new(9, 5);
        let mut spot = vec![0.0; 45];
        spot[2 * 9 + 4] = 1.0;
        let (mut patterns, mut others) = (vec![spot.clone()], vec![spot, vec![1.0; 45]]);
        let smooth: SessionFault = "smooth".parse().unwrap();
        let mut random = RandomStreamId::Fault.start(1);
        smooth.change_emissions(light, &mut patterns, &mut others, &mut random);
        assert_eq!(patterns[0], others[0]);
        assert!(patterns[0][2 * 9 + 4] < 0.7 && patterns[0][3 * 9 + 4] > 0.08);
        assert!(
            others[1]
                .iter()
                .all(|emission| (emission - 1.0).abs() < 1e-6)
        );
    }
}
