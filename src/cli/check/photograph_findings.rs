//! Findings about the light in photographs, each by itself: too much of it, too little, or the same photograph twice.

use rayon::prelude::*;

use super::scanned_capture::ScannedCapture;
use crate::capture::{
    CaptureFolder, ListedPhotograph, ManifestCamera, NoiseModel, PhotographRole, PhotographScan,
    group_ids,
};
use crate::cli::finding::Finding;
use crate::cli::recover::messages::{name_shots, saturated_shots};
use crate::linalg;
use crate::transport::{CHANNELS, Window};

/// Camera pixels whose light is averaged.
const MAX_PIXELS: usize = 20_000;
/// Quantile of the samples that stands for the brightest: hot pixels are brighter.
const BRIGHTEST_QUANTILE: f64 = 0.999;
/// Light of the dark frame, as a share of white, that is too much: on average, and in one in a hundred samples.
const MAX_DARK_MEAN: f64 = 0.02;
const MAX_DARK_PART: f64 = 0.1;
/// Light of the dark frame relative to that of a shot, and as a share of white, that is too much.
const MAX_RELATIVE_DARK: f64 = 0.5;
const MIN_DARK_MEAN: f64 = 0.002;
/// Light of a shot, relative to the median of all, below which it was taken without light.
const MIN_RELATIVE_LIGHT: f64 = 0.05;
/// Share of the samples of a shot that are saturated, and the same relative to the median of all, above which the shot is not
/// looked at together with the others: pixels that it saturates would not be, either.
const MAX_SATURATED_SHARE: f64 = 0.1;
const MAX_RELATIVE_SATURATION: f64 = 4.0;
/// Share of the range of codes that the brightest samples should use at least.
const MIN_USED_RANGE: f64 = 0.125;
/// Standard deviation of a sample at half of white, relative to it, above which photographs are noisy.
const MAX_RELATIVE_NOISE: f64 = 0.05;
/// Unknowns of a pixel for each pattern: with more, little of a light transport function is measured.
const MAX_UNKNOWNS_PER_PATTERN: usize = 10;

/// How bright a photograph is.
#[derive(Clone, Copy, Debug)]
pub struct Brightness {
    /// Mean measurement, at exposure 1 and less the dark frame.
    pub mean: f64,
    /// Share of the range of codes that the brightest samples use.
    pub used_range: f64,
}

/// The brightness of all shots, by their indices; `None` of those that were not read.
pub fn brightness(folder: &CaptureFolder, scanned: &ScannedCapture<'_>) -> Vec<Option<Brightness>> {
    let manifest = folder.manifest();
    let dark = scanned.dark_of(PhotographRole::Flood, &manifest.camera);
    let shots = 0..manifest.shots.len();
    let of_shot = |i: usize| {
        let scan = scanned.scan(PhotographRole::Shot(i))?;
        let samples = samples(&manifest.camera, scan, folder.exposure(i), &dark);
        Some(Brightness {
            mean: mean(&samples),
            used_range: brightest(samples, BRIGHTEST_QUANTILE) * folder.exposure(i),
        })
    };
    shots.into_par_iter().map(of_shot).collect()
}

/// Shots without light.
pub fn shots_without_light(brightness: &[Option<Brightness>]) -> Vec<usize> {
    let typical = median_light(brightness);
    let is_dark =
        |i: &usize| brightness[*i].is_some_and(|own| own.mean < MIN_RELATIVE_LIGHT * typical);
    // Where none has light, that is no matter of single shots.
    let candidates = if typical > 0.0 { brightness.len() } else { 0 };
    (0..candidates).filter(is_dark).collect()
}

/// Shots that saturate far more samples than the others, the worst first.
pub fn oversaturated_shots(folder: &CaptureFolder, scanned: &ScannedCapture<'_>) -> Vec<usize> {
    let manifest = folder.manifest();
    let read = (0..manifest.shots.len()).filter_map(|i| {
        let scan = scanned.scan(PhotographRole::Shot(i))?;
        Some((i, saturated_share(folder, scan)))
    });
    let shares: Vec<(usize, f64)> = read.collect();
    let values: Vec<f64> = shares.iter().map(|(_, share)| *share).collect();
    if values.is_empty() {
        return Vec::new();
    }
    let limit = MAX_SATURATED_SHARE.max(MAX_RELATIVE_SATURATION * linalg::median(&values));
    // Of several exposures the longest are meant to saturate.
    let has_one_exposure = shares
        .iter()
        .all(|(i, _)| folder.exposure(*i) == folder.exposure(shares[0].0));
    let above = shares
        .iter()
        .filter(|(_, share)| has_one_exposure && *share > limit);
    let mut above: Vec<(usize, f64)> = above.copied().collect();
    above.sort_by(|a, b| b.1.total_cmp(&a.1));
    above.into_iter().map(|(i, _)| i).collect()
}

/// Share of a photograph's samples that are saturated.
pub fn saturated_share(folder: &CaptureFolder, scan: &PhotographScan) -> f64 {
    let samples = folder.manifest().camera.extent().area() * CHANNELS;
    scan.codes.saturated as f64 / samples as f64
}

/// The finding that names them.
pub fn oversaturated(
    folder: &CaptureFolder,
    scanned: &ScannedCapture<'_>,
    shots: &[usize],
) -> Option<Finding> {
    let worst = scanned.scan(PhotographRole::Shot(*shots.first()?))?;
    let percent = 100.0 * saturated_share(folder, worst);
    Some(saturated_shots(folder, shots.to_vec(), percent))
}

/// Findings about the exposure of the dark frame, the flood and the shots, of which `dark_shots` are without light.
pub fn exposures(
    folder: &CaptureFolder,
    scanned: &ScannedCapture<'_>,
    brightness: &[Option<Brightness>],
    dark_shots: &[usize],
) -> Vec<Finding> {
    let typical = median_light(brightness);
    let mut findings = Vec::new();
    findings.extend(dark_frame(folder, scanned, typical));
    findings.extend(flood(folder, scanned, typical));
    if !dark_shots.is_empty() {
        let message = format!(
            "no light: {}. Was the display off, or did a picture not appear? Photograph again, or take these shots out",
            name_shots(folder, dark_shots)
        );
        let finding = Finding::warning("photograph-dark", message);
        findings.push(finding.of_shots(dark_shots.iter().copied()));
    }
    let used = brightness.iter().flatten().map(|own| own.used_range);
    let used = used.fold(0.0, f64::max);
    if brightness.iter().any(Option::is_some) && used < MIN_USED_RANGE {
        let message = format!(
            "underexposed: even the brightest samples are at {:.1} % of \"camera.white\", so that noise counts more than it \
             need. Expose about {:.0} times as long, or correct \"camera.white\"",
            100.0 * used,
            (0.7 / used.max(1e-3)).max(2.0),
        );
        findings.push(Finding::warning("underexposed", message));
    }
    findings
}

fn dark_frame(
    folder: &CaptureFolder,
    scanned: &ScannedCapture<'_>,
    typical: f64,
) -> Option<Finding> {
    let manifest = folder.manifest();
    let Some(name) = &manifest.dark else {
        let message = "there is no dark frame: light of the room and of black pictures counts as the object's. Photograph once \
                       without light, and name it as \"dark\"";
        return Some(Finding::note("dark-frame-missing", message));
    };
    scanned.scan(PhotographRole::Dark)?;
    let light = scanned.dark_of(PhotographRole::Flood, &manifest.camera);
    let samples = subset(&light);
    let mean = mean(&samples);
    let part = brightest(samples, 0.99);
    let is_relative = mean > MIN_DARK_MEAN && mean > MAX_RELATIVE_DARK * typical;
    let extent = match (mean > MAX_DARK_MEAN || is_relative, part > MAX_DARK_PART) {
        (true, _) => format!("shows {:.1} % of white on average", 100.0 * mean),
        (false, true) => format!("shows {:.1} % of white in a part", 100.0 * part),
        (false, false) => return None,
    };
    let message = format!(
        "{name} (dark): the dark frame {extent}: light leaked in, the display was not black, or \"camera.black\" is wrong. \
         Photograph it again in the dark, or correct \"camera.black\""
    );
    Some(Finding::warning("dark-frame-bright", message))
}

fn flood(folder: &CaptureFolder, scanned: &ScannedCapture<'_>, typical: f64) -> Option<Finding> {
    let camera = &folder.manifest().camera;
    let name = folder.manifest().flood.as_ref()?;
    let scan = scanned.scan(PhotographRole::Flood)?;
    let dark = scanned.dark_of(PhotographRole::Flood, camera);
    let light = mean(&samples(camera, scan, 1.0, &dark));
    let message = format!(
        "{name} (flood): the flood photograph has less light than a shot has: {:.1} % of white on average, and a shot {:.1} %. \
         Photograph it again with all elements lit, at the exposure of the shots",
        100.0 * light,
        100.0 * typical,
    );
    (light < typical).then(|| Finding::warning("flood-dark", message))
}

/// Photographs that are listed more than once, by name or as copies.
pub fn duplicates(folder: &CaptureFolder, scanned: &ScannedCapture<'_>) -> Vec<Finding> {
    let manifest = folder.manifest();
    let listed = manifest.photographs();
    let read: Vec<(ListedPhotograph<'_>, &PhotographScan)> = listed
        .into_iter()
        .filter_map(|photograph| Some((photograph, scanned.scan(photograph.role)?)))
        .collect();
    let ids = group_ids(read.iter().map(|(_, scan)| (scan.checksum, scan.codes)));
    let mut findings = Vec::new();
    for id in 0..read.len() {
        let group = read.iter().zip(&ids).filter(|(_, own)| **own == id);
        let group: Vec<ListedPhotograph<'_>> =
            group.map(|((photograph, _), _)| *photograph).collect();
        // Gray code may serve as patterns too: a file is listed as a shot and as a bit.
        let is_file_of_both = group.len() == 2
            && group[0].name == group[1].name
            && (group.iter()).any(|other| matches!(other.role, PhotographRole::Shot(_)))
            && (group.iter()).any(|other| matches!(other.role, PhotographRole::GrayCode(_)));
        if group.len() < 2 || is_file_of_both {
            continue;
        }
        // What each should show.
        let subject = |photograph: &ListedPhotograph<'_>| match photograph.role {
            PhotographRole::Shot(i) => Some((&manifest.shots[i].pattern, folder.exposure(i))),
            _ => None,
        };
        let first = subject(&group[0]);
        let is_harmless = first.is_some() && group.iter().all(|other| subject(other) == first);
        let names: Vec<String> = group
            .iter()
            .map(|photograph| format!("{} ({})", photograph.role.field(), photograph.name))
            .collect();
        let names = names.join(", ");
        let finding = match is_harmless {
            true => Finding::warning(
                "photograph-repeated",
                format!(
                    "one shot is listed several times, and counts as often: {names}. Keep one of them"
                ),
            ),
            false => Finding::error(
                "photograph-repeated",
                format!(
                    "these are one and the same photograph, but should show different things: {names}. Name each one's own \
                     photograph, or photograph again"
                ),
            ),
        };
        let shots = group.iter().filter_map(|photograph| match photograph.role {
            PhotographRole::Shot(i) => Some(i),
            _ => None,
        });
        findings.push(finding.of_shots(shots));
    }
    findings
}

/// The finding that there are few patterns for the unknowns of a window.
pub fn few_patterns(patterns: usize, window: Window) -> Option<Finding> {
    let (side, unknowns) = (window.side(), window.area());
    let message = format!(
        "{patterns} patterns are few for a window of {side}x{side} light elements: each camera pixel has {unknowns} unknowns. \
         Photograph more patterns, about 80 for a window of 15, or give a smaller --window"
    );
    (patterns * MAX_UNKNOWNS_PER_PATTERN < unknowns)
        .then(|| Finding::warning("few-patterns", message))
}

/// Standard deviation of a sample at half of white, relative to it; of the noisiest channel.
pub fn relative_noise(noise: &NoiseModel) -> f64 {
    let variances = (0..CHANNELS).map(|c| noise.variance(c, 0.5, 1.0));
    variances.fold(0.0, f64::max).sqrt() / 0.5
}

/// The finding that photographs are noisy.
pub fn noisy(noise: &NoiseModel) -> Option<Finding> {
    let relative = relative_noise(noise);
    let message = format!(
        "noise is {:.1} % of a sample at half of white: expose longer at a lower sensitivity, or average several photographs",
        100.0 * relative
    );
    (relative > MAX_RELATIVE_NOISE).then(|| Finding::warning("noisy", message))
}

/// The median of the shots' light.
fn median_light(brightness: &[Option<Brightness>]) -> f64 {
    let means: Vec<f64> = brightness.iter().flatten().map(|own| own.mean).collect();
    match means.is_empty() {
        true => 0.0,
        false => linalg::median(&means),
    }
}

/// Samples of a photograph that are spread over the pixels that were kept: at exposure 1, less the dark frame, and white where
/// saturated.
fn samples(
    camera: &ManifestCamera,
    scan: &PhotographScan,
    exposure: f64,
    dark: &[[f32; CHANNELS]],
) -> Vec<f64> {
    let pixels = every(&scan.pixels).zip(every(dark));
    let measured = pixels.flat_map(|(codes, dark)| {
        camera.measure(
            std::slice::from_ref(codes),
            exposure,
            std::slice::from_ref(dark),
        )
    });
    let white = exposure.recip();
    let sample = |y: f32| match y.is_nan() {
        true => white,
        false => f64::from(y),
    };
    measured.flatten().map(sample).collect()
}

/// The same selection of samples of measurements.
fn subset(light: &[[f32; CHANNELS]]) -> Vec<f64> {
    every(light).flatten().map(|y| f64::from(*y)).collect()
}

/// At most [`MAX_PIXELS`] pixels at equal distances.
fn every<T>(pixels: &[T]) -> impl Iterator<Item = &T> {
    // An odd distance, as widths are even: the pixels do not lie in columns.
    pixels.iter().step_by(pixels.len().div_ceil(MAX_PIXELS) | 1)
}

fn mean(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len().max(1) as f64
}

/// A high quantile.
fn brightest(mut samples: Vec<f64>, quantile: f64) -> f64 {
    linalg::sort(&mut samples);
    let index = (quantile * samples.len() as f64) as usize;
    samples
        .get(index)
        .or(samples.last())
        .copied()
        .unwrap_or(0.0)
}
