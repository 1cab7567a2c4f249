//! Whether photographs are in the order of their pictures, by their brightness.
//!
//! The dark photograph is black, flood and references are equally bright, and under a pattern of the Gray code and its
//! inverse every part of the picture is together as bright as under the flood. If a photograph is missing, or one too many,
//! this is wrong from there on.

use std::ops::RangeInclusive;

use super::sequence::{PatternSequence, PictureRole};
use crate::simulate::{GrayCodePattern, MONITOR_GAMMA};

/// Largest brightness of the dark photograph, relative to the flood's. Room light must be less.
const MAX_DARK: f64 = 0.25;
/// Largest deviation of a reference, and of the sum of a Gray code pair, from the flood.
const MAX_DEVIATION: f64 = 0.2;
/// Largest brightness of lines, which cover an eighth of the light plane, relative to the flood's.
const MAX_LINES: f64 = 0.5;
/// Displays emit between these powers of the code, as a share of the largest, give or take the tolerance.
const RAMP_EXPONENTS: [f64; 2] = [3.5, 0.9];
const RAMP_TOLERANCE: f64 = 0.05;
/// Least rise from one step of the ramp to the next, relative to that of a display with an exponent of 2.2, and how much less
/// noise and room light may make it, relative to the flood.
const MIN_RAMP_RISE: f64 = 0.25;
const RISE_TOLERANCE: f64 = 0.005;

/// Brightness of all photographs, in the order in which they were taken.
#[derive(Clone, Debug, PartialEq)]
pub struct SequenceBrightness {
    /// Mean measurement of each part of the picture, one list for each photograph.
    pub thumbnails: Vec<Vec<f64>>,
}

/// Why a photograph does not show the picture at its place of the sequence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PairingFault {
    /// It is not dark.
    NotDark,
    /// It is not as bright as the flood photograph: its brightness relative to that.
    NotLit(f64),
    /// It is brighter than it can be: its brightness relative to the flood photograph.
    TooBright(f64),
    /// It is darker than the photograph of a lower code.
    NotRising,
    /// It and the photograph of the inverse do not add up to the flood photograph: by this mean deviation, relative to that.
    NotInverse(f64),
}

impl SequenceBrightness {
    /// The photographs that do not show the pictures of a sequence in their order, each by its index. The lists have equal
    /// lengths.
    pub fn faults(&self, sequence: &PatternSequence) -> Vec<(usize, PairingFault)> {
        let photos: Vec<Option<usize>> = (0..sequence.pictures.len()).map(Some).collect();
        self.faults_of(sequence, &photos)
    }

    /// Likewise, in the middle of a session: `is_taken` says which pictures have a photograph.
    pub fn faults_so_far(
        &self,
        sequence: &PatternSequence,
        is_taken: impl Fn(usize) -> bool,
    ) -> Vec<(usize, PairingFault)> {
        let photos = (0..sequence.pictures.len()).map(|i| is_taken(i).then_some(i));
        let photos: Vec<Option<usize>> = photos.collect();
        self.faults_of(sequence, &photos)
    }

    /// With one photograph less than pictures, the pictures of which one has no photograph; with one more, the photographs of
    /// which one is too many. `None` if that is not clear.
    pub fn gap(&self, sequence: &PatternSequence) -> Option<RangeInclusive<usize>> {
        let (photos, pictures) = (self.thumbnails.len(), sequence.pictures.len());
        let is_missing = photos + 1 == pictures;
        if !is_missing && photos != pictures + 1 {
            return None;
        }
        let faults = |gap: usize| {
            let photo = |i: usize| match (is_missing, i.cmp(&gap)) {
                (_, std::cmp::Ordering::Less) => Some(i),
                (true, std::cmp::Ordering::Equal) => None,
                (true, _) => Some(i - 1),
                (false, _) => Some(i + 1),
            };
            let photos: Vec<Option<usize>> = (0..pictures).map(photo).collect();
            self.faults_of(sequence, &photos).len()
        };
        let counts: Vec<usize> = (0..pictures.max(photos)).map(faults).collect();
        let least = *counts.iter().min()?;
        let last = *counts.last()?;
        // Random patterns are equally bright, so that neighbouring gaps may fit as well.
        let fits = |count: &usize| *count == least;
        let (first, last_fit) = (
            counts.iter().position(fits)?,
            counts.iter().rposition(fits)?,
        );
        (least == 0 || 2 * least < last).then_some(first..=last_fit)
    }

    /// Faults where the picture `i` has the photograph `photos[i]`.
    fn faults_of(
        &self,
        sequence: &PatternSequence,
        photos: &[Option<usize>],
    ) -> Vec<(usize, PairingFault)> {
        let role_of = |i: usize| &sequence.pictures[i].role;
        let photo_of = |role: &PictureRole| {
            let i = (0..photos.len()).find(|&i| role_of(i) == role);
            i.and_then(|i| photos[i])
        };
        let thumbnail = |photo: usize| &self.thumbnails[photo];
        let mean = |photo: usize| mean(thumbnail(photo));
        let dark = photo_of(&PictureRole::Dark);
        let flood = photo_of(&PictureRole::Flood).or(photo_of(&PictureRole::Reference));
        let Some(flood) = flood else {
            return Vec::new();
        };
        let black = dark.map_or(0.0, mean);
        let white = mean(flood) - black;
        let relative = |photo: usize| (mean(photo) - black) / white;
        let mut faults = Vec::new();
        if let Some(dark) = dark.filter(|_| black > MAX_DARK * (white + black)) {
            faults.push((dark, PairingFault::NotDark));
        }
        let mut last = (0.0, 0.0);
        for (i, photo) in photos.iter().enumerate() {
            let Some(photo) = *photo else {
                continue;
            };
            match role_of(i) {
                PictureRole::Reference if (relative(photo) - 1.0).abs() > MAX_DEVIATION => {
                    faults.push((photo, PairingFault::NotLit(relative(photo))));
                }
                PictureRole::Lines { .. } if relative(photo) > MAX_LINES => {
                    faults.push((photo, PairingFault::TooBright(relative(photo))));
                }
                // It may be nearly dark: there is glass that lets no blue light through.
                PictureRole::Primary { .. } if relative(photo) > 1.0 + MAX_DEVIATION => {
                    faults.push((photo, PairingFault::TooBright(relative(photo))));
                }
                PictureRole::Ramp { code } => {
                    let (code, step) = (f64::from(*code) / 255.0, relative(photo));
                    let [low, high] = RAMP_EXPONENTS.map(|exponent| code.powf(exponent));
                    let is_plausible =
                        (low - RAMP_TOLERANCE..=high + RAMP_TOLERANCE).contains(&step);
                    let (last_code, last_step): (f64, f64) = last;
                    let expected = code.powf(MONITOR_GAMMA) - last_code.powf(MONITOR_GAMMA);
                    let rise = MIN_RAMP_RISE * expected - RISE_TOLERANCE;
                    if !is_plausible || step - last_step < rise {
                        faults.push((photo, PairingFault::NotRising));
                    }
                    last = (code, step);
                }
                PictureRole::GrayCode(pattern) if pattern.inverted => {
                    let plain = GrayCodePattern {
                        inverted: false,
                        ..*pattern
                    };
                    let Some(plain) = photo_of(&PictureRole::GrayCode(plain)) else {
                        continue;
                    };
                    let parts = thumbnail(photo).iter().zip(thumbnail(plain));
                    let deviations = parts.zip(thumbnail(flood)).map(|((a, b), flood)| {
                        // Each of the three has the stray light once.
                        (a + b - flood - black).abs()
                    });
                    let count = thumbnail(flood).len() as f64;
                    let deviation = deviations.sum::<f64>() / (count * white);
                    if deviation > MAX_DEVIATION || deviation.is_nan() {
                        faults.push((photo, PairingFault::NotInverse(deviation)));
                    }
                }
                _ => {}
            }
        }
        faults
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::super::{DisplayLayout, SequenceSettings};
    use super::*;
    use crate::simulate::{PatternEnsemble, PatternImage, emission};
    use crate::transport::{CHANNELS, Extent};

    /// A sequence with its photographs: each part of the picture sees one light element, with stray light and drift.
    fn session() -> (PatternSequence, SequenceBrightness) {
        let light = Extent::new(12, 8);
        let (sequence, drawn) = PatternSequence::draw(&SequenceSettings {
            layout: DisplayLayout::new(light, light, None).unwrap(),
            patterns: 30,
            ensemble: PatternEnsemble::Bernoulli,
            seed: 3,
        });
        let photograph = |(i, codes): (usize, &PatternImage)| -> Vec<f64> {
            let drift = 1.0 + 0.0005 * i as f64;
            let planes: Vec<Vec<u8>> = (0..CHANNELS).map(|c| codes.plane(c)).collect();
            let brightness = |m: usize| {
                let emitted = planes.iter().map(|plane| emission(plane[m]));
                0.4 * drift * emitted.sum::<f64>() / CHANNELS as f64 + 0.02
            };
            (0..light.area()).map(brightness).collect()
        };
        let thumbnails = drawn.iter().enumerate().map(photograph).collect();
        (sequence, SequenceBrightness { thumbnails })
    }

    #[test]
    fn photographs_in_order_have_no_faults() {
        let (sequence, brightness) = session();
        assert_eq!(brightness.faults(&sequence), []);
        assert_eq!(brightness.gap(&sequence), None);
    }

    #[test]
    fn swapped_photographs_are_found() {
        let (sequence, mut brightness) = session();
        brightness.thumbnails.swap(0, 1);
        assert!(
            brightness
                .faults(&sequence)
                .contains(&(0, PairingFault::NotDark))
        );
        brightness.thumbnails.swap(0, 1);
        brightness.thumbnails.swap(12, 14);
        let faults = brightness.faults(&sequence);
        assert_eq!(faults.len(), 2, "{faults:?}");
        assert!(matches!(faults[0], (13, PairingFault::NotInverse(_))));
        brightness.thumbnails.swap(12, 14);
        brightness.thumbnails.swap(4, 6);
        assert_eq!(brightness.faults(&sequence)[0].1, PairingFault::NotRising);
        brightness.thumbnails.swap(4, 6);
        // A display that is one picture late, in the middle of the ramp and at its beginning.
        for late in [2, 5, 9] {
            let own = brightness.thumbnails[late].clone();
            brightness.thumbnails[late] = brightness.thumbnails[late - 1].clone();
            let faults = brightness.faults(&sequence);
            assert_eq!(faults[0], (late, PairingFault::NotRising));
            brightness.thumbnails[late] = own;
        }
    }

    #[test]
    fn a_photograph_that_is_missing_or_too_many_is_found() {
        let (sequence, brightness) = session();
        for gap in [1, 5, 13, 20] {
            let mut missing = brightness.clone();
            missing.thumbnails.remove(gap);
            let found = missing.gap(&sequence).unwrap();
            assert!(found.contains(&gap), "{gap}: {found:?}");
            assert!(found.count() <= 8, "{gap}");
        }
        // Of patterns between two references, any may be missing.
        let mut missing = brightness.clone();
        missing.thumbnails.remove(40);
        let gap = missing.gap(&sequence).unwrap();
        assert!(gap.contains(&40) && gap.count() <= 12);
        let mut doubled = brightness.clone();
        doubled
            .thumbnails
            .insert(14, brightness.thumbnails[13].clone());
        let gap = doubled.gap(&sequence).unwrap();
        assert!(gap.contains(&14) && gap.count() <= 4);
    }
}
