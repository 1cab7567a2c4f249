//! Whether a photograph shows its picture as it should, right after it was taken, while it can still be taken again.

use std::path::Path;

use anyhow::{Context, Result, bail};

use super::session_store::{SessionSettings, SessionStore};
use crate::acquisition::{
    PairingFault, PatternPrediction, PhotographStatistics, PictureRole, SequenceBrightness,
    ShownPattern, luminance, shift_between,
};
use crate::calibrate::CalibrationError;
use crate::cli::advice::error_with_remedy;
use crate::cli::assemble::{
    DevelopedPhotograph, PhotographLevels, fault_text, fit_gray_code, thumbnail_part,
};
use crate::cli::calibrate::{IMPLAUSIBLE_FIT, is_implausible};
use crate::simulate::{GrayCodePattern, emission};
use crate::transport::{CHANNELS, Extent};

/// Change of a reference photograph's brightness that is worth a remark.
const MIN_DRIFT: f64 = 0.03;
/// Shift of a reference photograph in pixels from which on it is remarked, and above which the photograph is taken again.
const MIN_SHIFT: f64 = 0.3;
const MAX_SHIFT: f64 = 2.0;
/// Sharpness of a photograph, relative to those of other patterns, or of a reference to the flood, below which it is blurred.
const MIN_SHARPNESS: f64 = 0.6;
/// Brightness of pixels in the flood, relative to the brightest, that tell Gray code from its inverse.
const MIN_FLOOD_SHARE: f32 = 0.1;
/// Side of the squares of pixels that are compared.
const SQUARE_SIDE: u32 = 2;
/// Mean deviation of their sum from the flood: noise leaves a few per cent.
const MAX_INVERSE_DEVIATION: f64 = 0.15;
/// Brightness of the flood, relative to that at which the exposure was chosen.
const SAME_EXPOSURE: std::ops::RangeInclusive<f64> = 0.8..=1.25;
/// Light of a part of the picture, as a share of white, below which nothing is said of it.
const MIN_LIGHT: f64 = 1e-5;
/// Patterns whose sharpness is known before others are compared with it.
const MIN_COMPARED: usize = 3;

/// A fault of a photograph that may go away if it is taken again.
#[derive(Debug, PartialEq)]
pub struct Fault {
    pub text: String,
    /// An earlier picture whose photograph may be the wrong one instead.
    pub suspect: Option<usize>,
}

/// What the check of a photograph found.
#[derive(Debug, Default)]
pub struct Verdict {
    pub faults: Vec<Fault>,
    /// Remarks on it.
    pub remarks: Vec<String>,
}

impl Verdict {
    /// One fault.
    pub fn of_fault(text: String) -> Self {
        let mut verdict = Self::default();
        verdict.fault(text);
        verdict
    }

    fn fault(&mut self, text: impl Into<String>) {
        self.faults.push(Fault {
            text: text.into(),
            suspect: None,
        });
    }
}

/// Checks photographs against what the session has so far.
pub struct PhotographCheck {
    /// Emissions `[M]` of all pictures.
    emissions: Vec<Vec<f32>>,
    /// Indices of the pictures with random patterns.
    patterns: Vec<usize>,
    /// From Gray code and flood, once they are there.
    prediction: Option<PatternPrediction>,
}

impl PhotographCheck {
    /// Reads the patterns of a session.
    ///
    /// # Errors
    /// If one cannot be read, or has another size than the light plane.
    pub fn new(store: &SessionStore, folder: &Path) -> Result<Self> {
        let sequence = &store.sequence;
        let light = sequence.layout.light;
        let emissions = sequence.pictures.iter().map(|picture| {
            let codes = match (&picture.role, picture.role.codes(light)) {
                (PictureRole::Pattern { pattern }, _) => read_codes(&folder.join(pattern), light)?,
                // In the sequences of `patterns`, no pattern follows a picture with colours.
                (_, codes) => codes.map(|codes| codes.plane(0)).unwrap_or_default(),
            };
            Ok(codes
                .into_iter()
                .map(|code| emission(code) as f32)
                .collect())
        });
        let is_pattern =
            |i: &usize| matches!(sequence.pictures[*i].role, PictureRole::Pattern { .. });
        Ok(Self {
            emissions: emissions.collect::<Result<_>>()?,
            patterns: (0..sequence.pictures.len()).filter(is_pattern).collect(),
            prediction: None,
        })
    }

    /// Checks the photograph of picture `i`, called `name` in messages.
    ///
    /// # Errors
    /// If files of the session cannot be read.
    pub fn examine(
        &self,
        store: &SessionStore,
        settings: &SessionSettings,
        i: usize,
        name: &str,
        photo: &DevelopedPhotograph,
        statistics: &PhotographStatistics,
    ) -> Result<Verdict> {
        let mut verdict = Verdict::default();
        if let Some(first) = store.records().iter().flatten().next() {
            let (extent, expected) = (photo.camera.extent(), first.camera.extent());
            if extent != expected {
                verdict.fault(format!(
                    "{name} has {extent} pixels, and earlier photographs {expected}"
                ));
                return Ok(verdict);
            }
            if photo.kind != first.kind {
                let (kind, expected) = (photo.kind, first.kind);
                verdict.fault(format!(
                    "{name} has {kind}, and earlier photographs {expected}"
                ));
                return Ok(verdict);
            }
        }
        let role = &store.sequence.pictures[i].role;
        let is_flood = matches!(role, PictureRole::Flood | PictureRole::Reference);
        let levels = PhotographLevels::of(photo);
        if is_flood && levels.is_saturated() {
            let text = format!(
                "{:.1} % of the samples of {name} are saturated",
                100.0 * levels.saturated_share
            );
            match settings.is_saturation_accepted {
                true => verdict.remarks.push(text),
                false => verdict.fault(text + "; has the exposure changed?"),
            }
        }
        let change = statistics.brightest / settings.flood_brightness;
        if *role == PictureRole::Flood && !levels.is_saturated() && !SAME_EXPOSURE.contains(&change)
        {
            verdict.fault(format!(
                "the brightest part of {name} is {change:.2} times as bright as when the exposure was chosen; has something changed, or \
                 does the photograph show another picture?"
            ));
        }
        self.check_brightness(store, i, photo, &mut verdict);
        if !verdict.faults.is_empty() {
            // What a photograph of another picture says of shifts, for instance, is meaningless.
            return Ok(verdict);
        }
        match role {
            PictureRole::Pattern { .. } => {
                self.check_pattern(store, i, name, photo, &mut verdict)?;
            }
            PictureRole::Reference => check_reference(store, name, photo, &mut verdict)?,
            PictureRole::GrayCode(bit) if bit.inverted => {
                check_inverse(store, i, photo, &mut verdict)?;
            }
            _ => {}
        }
        check_sharpness(store, i, name, statistics, &mut verdict);
        Ok(verdict)
    }

    /// Decodes the Gray code, so that patterns can be recognised. Returns whether they can: the object may be too small in the
    /// picture.
    ///
    /// # Errors
    /// [`GrayCodeError`], or if files of the session cannot be read.
    pub fn decode_gray_code(&mut self, store: &SessionStore) -> Result<bool> {
        let prediction = predict(store)?;
        let is_conclusive = prediction.is_conclusive();
        self.prediction = Some(prediction);
        Ok(is_conclusive)
    }

    /// By dark, flood, ramp and pairs of Gray code.
    fn check_brightness(
        &self,
        store: &SessionStore,
        i: usize,
        photo: &DevelopedPhotograph,
        verdict: &mut Verdict,
    ) {
        let records = store.records().iter();
        let taken = records.map(|record| record.as_ref().map(|record| record.thumbnail.clone()));
        let mut thumbnails: Vec<Option<Vec<f64>>> = taken.collect();
        thumbnails[i] = Some(photo.thumbnail.clone());
        let is_taken: Vec<bool> = thumbnails.iter().map(Option::is_some).collect();
        let brightness = SequenceBrightness {
            thumbnails: thumbnails
                .into_iter()
                .map(Option::unwrap_or_default)
                .collect(),
        };
        for (picture, fault) in brightness.faults_so_far(&store.sequence, |i| is_taken[i]) {
            let pictures = &store.sequence.pictures;
            let (text, suspect) = match fault {
                // The dark photograph comes first, so that nothing could be said of it.
                PairingFault::NotDark if pictures[i].role == PictureRole::Flood => {
                    let text = "the flood is hardly brighter than the dark photograph: does either show another picture, or is there \
                                room light?";
                    (text.to_owned(), Some(picture))
                }
                _ if picture != i => continue,
                PairingFault::NotInverse(_) => (described(store, i, fault), plain_of(store, i)),
                // The flood, or the step before.
                PairingFault::NotRising => (described(store, i, fault), i.checked_sub(1)),
                _ => (described(store, i, fault), None),
            };
            verdict.faults.push(Fault { text, suspect });
        }
    }

    fn check_pattern(
        &self,
        store: &SessionStore,
        i: usize,
        name: &str,
        photo: &DevelopedPhotograph,
        verdict: &mut Verdict,
    ) -> Result<()> {
        let sequence = &store.sequence;
        let thumbnail = |role| store.taken(&role).map(|(_, record)| &record.thumbnail);
        let (Some(dark), Some(flood)) =
            (thumbnail(PictureRole::Dark), thumbnail(PictureRole::Flood))
        else {
            return Ok(());
        };
        let Some(prediction) = &self.prediction else {
            return Ok(());
        };
        let shares = photo.thumbnail.iter().zip(dark).zip(flood);
        let share = |((y, dark), flood): ((&f64, &f64), &f64)| match flood - dark {
            light if light > MIN_LIGHT => (y - dark) / light,
            _ => 0.0,
        };
        let measured: Vec<f64> = shares.map(share).collect();
        let patterns = self.patterns.iter().map(|&i| &self.emissions[i]);
        let patterns: Vec<&Vec<f32>> = patterns.collect();
        let own = self.patterns.iter().position(|&pattern| pattern == i);
        let own = own.context("not a pattern")?;
        let before = i.checked_sub(1).map(|before| &self.emissions[before][..]);
        match prediction.judge(&measured, &patterns, own, before) {
            ShownPattern::Own => {}
            ShownPattern::Other(other) => {
                let other = &sequence.pictures[self.patterns[other]].picture;
                verdict.fault(format!(
                    "the photograph shows {other} instead of {name}: was it taken before the display had changed?"
                ));
            }
            ShownPattern::Unknown(_) => verdict.fault(format!(
                "the photograph does not show {name}: has something moved, or been in the way?"
            )),
            ShownPattern::Exposure(gain) => verdict.fault(format!(
                "the photograph of {name} is {gain:.2} times as bright as expected: has the exposure changed, or a lamp?"
            )),
            ShownPattern::Blend(share) => verdict.fault(format!(
                "{:.0} % of the light in the photograph of {name} is of the picture before: it was taken while the display \
                 changed, or the display is slow (a longer --settle helps)",
                100.0 * share
            )),
        }
        Ok(())
    }
}

/// Says of the photograph of picture `i` what its brightness says.
fn described(store: &SessionStore, i: usize, fault: PairingFault) -> String {
    fault_text("the photograph", &store.sequence.pictures[i].picture, fault)
}

/// The picture whose inverse picture `i` is.
fn plain_of(store: &SessionStore, i: usize) -> Option<usize> {
    let PictureRole::GrayCode(bit) = store.sequence.pictures[i].role else {
        return None;
    };
    let plain = PictureRole::GrayCode(GrayCodePattern {
        inverted: false,
        ..bit
    });
    store.sequence.position(&plain)
}

fn read_codes(path: &Path, light: Extent) -> Result<Vec<u8>> {
    let read = || -> Result<Vec<u8>> {
        let picture = image::open(path)?.into_luma8();
        if picture.dimensions() != (light.width, light.height) {
            bail!("has another size than the light plane, {light}; write the pictures again");
        }
        Ok(picture.into_raw())
    };
    read().with_context(|| path.display().to_string())
}

/// Light of the pixels of a developed photograph.
fn read_luminance(store: &SessionStore, i: usize) -> Result<Vec<f32>> {
    let path = store.work().join(&store.sequence.pictures[i].photo);
    let record = store.records()[i].as_ref();
    let camera = &record.context("the photograph is missing")?.camera;
    let photo = image::open(&path).with_context(|| path.display().to_string())?;
    let codes: Vec<[u16; CHANNELS]> = photo.into_rgb16().pixels().map(|pixel| pixel.0).collect();
    Ok(luminance(&codes, camera.black, camera.white))
}

/// Decodes the Gray code of a session.
fn predict(store: &SessionStore) -> Result<PatternPrediction> {
    store.write_manifest()?;
    let fit = fit_gray_code(&store.work());
    let fit = match fit {
        Ok(fit) if is_implausible(&fit) => bail!(GrayCodeError(IMPLAUSIBLE_FIT.to_owned())),
        Ok(fit) => fit,
        Err(error) if error.is::<CalibrationError>() => {
            bail!(GrayCodeError(error_with_remedy(&error)))
        }
        Err(error) => return Err(error),
    };
    let sequence = &store.sequence;
    let taken = store.taken(&PictureRole::Flood);
    let (flood, record) = taken.context("the flood photograph is missing")?;
    let camera = record.camera.extent();
    let light = read_luminance(store, flood)?;
    let stray = match store.taken(&PictureRole::Dark) {
        Some((dark, _)) => read_luminance(store, dark)?,
        _ => vec![0.0; light.len()],
    };
    let at = |x: u32, y: u32| {
        let n = (y * camera.width + x) as usize;
        f64::from(light[n] - stray[n])
    };
    let part = |x, y| thumbnail_part(camera, x, y);
    let plane = sequence.layout.light;
    Ok(PatternPrediction::new(
        plane,
        &fit.correspondence,
        camera,
        part,
        at,
    ))
}

/// The Gray code says nothing: without it, patterns are not recovered.
#[derive(Debug, thiserror::Error)]
#[error("the Gray code cannot be decoded: {0}")]
pub struct GrayCodeError(String);

/// Pixel by pixel, whether a photograph of Gray code and that of its inverse add up to the flood: parts of the thumbnail are
/// half lit by fine stripes of either.
fn check_inverse(
    store: &SessionStore,
    i: usize,
    photo: &DevelopedPhotograph,
    verdict: &mut Verdict,
) -> Result<()> {
    let plain = plain_of(store, i).filter(|&plain| store.records()[plain].is_some());
    let (Some(plain), Some((flood, _)), Some((_, dark))) = (
        plain,
        store.taken(&PictureRole::Flood),
        store.taken(&PictureRole::Dark),
    ) else {
        return Ok(());
    };
    let dark = dark.thumbnail.iter().sum::<f64>() / dark.thumbnail.len() as f64;
    let camera = &photo.camera;
    let inverse = luminance(&photo.codes, camera.black, camera.white);
    let other = read_luminance(store, plain)?;
    let flood = read_luminance(store, flood)?;
    let brightest = flood.iter().copied().fold(0.0, f32::max);
    // Sums over small squares, in which noise cancels and stripes do not.
    let extent = camera.extent();
    let columns = extent.width.div_ceil(SQUARE_SIDE);
    let squares = (columns * extent.height.div_ceil(SQUARE_SIDE)) as usize;
    let mut sums = vec![[0.0; 2]; squares];
    for (n, (x, y)) in extent.cells().enumerate() {
        if flood[n] > MIN_FLOOD_SHARE * brightest {
            let [inverse, other, flood] = [inverse[n], other[n], flood[n]].map(f64::from);
            let sum = &mut sums[(y / SQUARE_SIDE * columns + x / SQUARE_SIDE) as usize];
            // Each of the three has the stray light once.
            sum[0] += inverse + other - flood - dark;
            sum[1] += flood - dark;
        }
    }
    let total = |k: usize| sums.iter().map(|sum| sum[k].abs()).sum::<f64>();
    let deviation = total(0) / total(1);
    if deviation > MAX_INVERSE_DEVIATION || deviation.is_nan() {
        let fault = PairingFault::NotInverse(deviation);
        verdict.faults.push(Fault {
            text: described(store, i, fault),
            suspect: Some(plain),
        });
    }
    Ok(())
}

/// By brightness and place of the flood.
fn check_reference(
    store: &SessionStore,
    name: &str,
    photo: &DevelopedPhotograph,
    verdict: &mut Verdict,
) -> Result<()> {
    let Some((flood, record)) = store.taken(&PictureRole::Flood) else {
        return Ok(());
    };
    let sum = |thumbnail: &[f64]| thumbnail.iter().sum::<f64>();
    let change = sum(&photo.thumbnail) / sum(&record.thumbnail).max(f64::MIN_POSITIVE) - 1.0;
    if change.abs() > MIN_DRIFT {
        verdict.remarks.push(format!(
            "{name} is {:+.0} % as bright as the flood: let the lamp warm up for longer",
            100.0 * change
        ));
    }
    let camera = &photo.camera;
    let shown = luminance(&photo.codes, camera.black, camera.white);
    let Some([x, y]) = shift_between(camera.extent(), &read_luminance(store, flood)?, &shown)
    else {
        return Ok(());
    };
    let shift = x.hypot(y);
    if shift > MAX_SHIFT {
        verdict.fault(format!(
            "camera or object seem to have moved by {shift:.1} pixels since the flood photograph. If they have, fasten them, delete .shoot \
             in the session's folder, and begin again"
        ));
    } else if shift > MIN_SHIFT {
        verdict.remarks.push(format!(
            "camera or object have moved by {shift:.1} pixels since the flood photograph: fasten them. `recover` corrects some of it"
        ));
    }
    Ok(())
}

/// By the sharpness of photographs of the same kind.
fn check_sharpness(
    store: &SessionStore,
    i: usize,
    name: &str,
    statistics: &PhotographStatistics,
    verdict: &mut Verdict,
) {
    let pictures = store.sequence.pictures.iter().zip(store.records());
    let is_alike = |role: &PictureRole| match &store.sequence.pictures[i].role {
        PictureRole::Pattern { .. } => matches!(role, PictureRole::Pattern { .. }),
        PictureRole::Reference => *role == PictureRole::Flood,
        _ => false,
    };
    let alike = pictures.filter(|(picture, _)| is_alike(&picture.role));
    let mut sharpness: Vec<f64> = alike
        .filter_map(|(_, record)| Some(record.as_ref()?.sharpness))
        .collect();
    let is_pattern = matches!(store.sequence.pictures[i].role, PictureRole::Pattern { .. });
    if sharpness.is_empty() || (is_pattern && sharpness.len() < MIN_COMPARED) {
        return;
    }
    sharpness.sort_by(f64::total_cmp);
    let typical = sharpness[sharpness.len() / 2];
    if statistics.sharpness < MIN_SHARPNESS * typical {
        verdict.fault(format!(
            "the photograph of {name} is blurred, compared with others: did the camera shake, or focus?"
        ));
    }
}
