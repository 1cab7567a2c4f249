//! Errors, warnings and notes of a recovery, in terms of the command line.

use std::ops::Range;

use anyhow::{Error, anyhow};

use crate::capture::{CaptureFolder, DefectivePixels, Measurements};
use crate::cli::field_suggestion::similar_fields;
use crate::cli::finding::Finding;
use crate::cli::measurement_reader::ReadSample;
use crate::cli::value_parsers::ByteCount;
use crate::export::{
    MIN_PLAUSIBLE_SNR, PreparedExport, TooFewShots, TooLittleMemory, implausibly_saturated,
    saturated_percent,
};
use crate::recover::{
    CaptureFault, Flicker, MIN_PATTERNS, MOVED_CODE, PhotographCorrection, PhotographFault,
    PreparedRecovery, TailEstimate,
};
use crate::transport::Decibels;

/// Least standard deviation of exposures, and least stray light, that is worth a note.
const MIN_NOTED_DEVIATION: f64 = 1e-3;
/// Standard errors above which a drift of the exposures is none by chance.
const MIN_DRIFT_ERRORS: f64 = 5.0;
/// Least deviation of a single exposure from the others that is named.
const MIN_NAMED_DEVIATION: f64 = 0.1;
/// Contrast of the finest stripes of the Gray code in the sharpest pixels that shows a sharp display. Without any scattering,
/// a blur of 0.5 light elements (standard deviation) leaves 0.79, and one of 0.57 leaves 0.7.
const MIN_FINEST_CONTRAST: f32 = 0.7;
/// Contrast of the finest stripes below which, and of stripes of twice their width above which, the display is blurred: an
/// object that lowers the former by scattering lowers the latter, too.
const MAX_BLURRED_CONTRAST: f32 = 0.9;
const MIN_SHARP_CONTRAST: f32 = 0.97;
/// Maximum number of shots or fields that a message names.
const MAX_NAMED_ITEMS: usize = 4;

/// Warnings fail the command, by `--strict`.
#[derive(Clone, Debug, thiserror::Error)]
#[error("nothing is written, as --strict allows no warning")]
pub struct StrictError;

/// The light transport would be wrong.
#[derive(Clone, Debug, thiserror::Error)]
#[error(
    "the SNR on held-out patterns is only {0}: the photographs do not follow from their patterns, and nothing is \
     written; --force writes the file nevertheless"
)]
pub struct UnusableError(pub Decibels);

/// The photographs do not show what the capture says.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{0}")]
pub struct FaultyPhotographsError(pub String);

/// The error for a `--patterns` above the number of shots.
pub fn too_few_shots(TooFewShots { wanted, available }: TooFewShots) -> Error {
    anyhow!("--patterns is {wanted}, but the capture has {available} shots")
}

/// The error for a `--memory` that is too low.
pub fn too_little_memory(TooLittleMemory { limit, min }: TooLittleMemory) -> Error {
    let megabytes = min.div_ceil(1 << 20);
    anyhow!(
        "--memory {} is too little for this capture; it takes at least --memory {megabytes}M",
        ByteCount(limit),
    )
}

/// Warns of fields of the manifest that are unknown.
pub fn unknown_fields(folder: &CaptureFolder) -> Option<Finding> {
    // What the laboratory notes for itself.
    let is_note = |path: &&String| *path == "notes" || path.starts_with("notes.");
    let unknown = folder.manifest().unknown.iter();
    let unknown: Vec<&String> = unknown.filter(|path| !is_note(path)).collect();
    let named = |path: &String| match &similar_fields(path)[..] {
        [] => path.clone(),
        similar => format!("{path} (is it \"{}\"?)", similar.join("\" or \"")),
    };
    let message = || {
        format!(
            "{}: unknown fields are ignored: {}. Correct or remove them",
            folder.manifest_path().display(),
            join_first(unknown.iter().map(|path| named(path)))
        )
    };
    (!unknown.is_empty()).then(|| Finding::warning("unknown-fields", message()))
}

/// Warns of codes of 8 bits, in all photographs or in some of `shots`, those that were read.
pub fn eight_bits(folder: &CaptureFolder, shots: &[usize], read: &ReadSample) -> Option<Finding> {
    let coarse = shots.iter().zip(&read.codes_by_shot);
    let coarse = coarse.filter(|(_, codes)| codes.step() > 1);
    let coarse: Vec<usize> = coarse.map(|(shot, _)| *shot).collect();
    let photographs = match (read.codes.step() > 1, coarse.is_empty()) {
        (true, _) => "the photographs have".to_owned(),
        (false, false) => format!("{} have", name_shots(folder, &coarse)),
        (false, true) => return None,
    };
    let message = format!(
        "{photographs} codes of 8 bits in files of 16: dark parts are inaccurate. Export 16 bits, linear, from the camera's \
         raw files"
    );
    Some(Finding::warning("photographs-8-bit", message).of_shots(coarse))
}

/// Warns of a display that is blurred, or that may be; the contrasts are those of bits 0 and 1 of the Gray code.
pub fn display_sharpness([finest, next]: [f32; 2]) -> Option<Finding> {
    let percent = 100.0 * finest;
    let reason = if finest < MAX_BLURRED_CONTRAST && next > MIN_SHARP_CONTRAST {
        // Light that an object scatters reaches further.
        format!(
            "with {percent:.0} % contrast and wider stripes nearly fully: the display is blurred by part of an element"
        )
    } else if finest < MIN_FINEST_CONTRAST {
        format!(
            "with at most {percent:.0} % contrast: the object scatters light over several elements everywhere, camera \
             pixels are larger than elements, or the display is blurred"
        )
    } else {
        return None;
    };
    Some(Finding::warning(
        "display-sharpness",
        format!(
            "99 % of the bright camera pixels show the finest stripes of the Gray code {reason}. A blur of the display would \
             be part of the light transport, and held-out photographs cannot reveal it. Show patterns without smooth \
             scaling, and photograph a bare part of the display"
        ),
    ))
}

/// Warns of a light that flickers.
pub fn flicker(
    Flicker {
        amplitude,
        is_along_rows,
    }: Flicker,
) -> Finding {
    let lines = if is_along_rows { "columns" } else { "rows" };
    Finding::warning(
        "light-flickers",
        format!(
            "the exposure of {lines} varies by about {:.1} %, in every photograph differently: the light flickers. Expose for a \
             multiple of the mains' half period (10 ms at 50 Hz, 8.33 ms at 60 Hz), or use a lamp that does not flicker",
            100.0 * amplitude
        ),
    )
}

/// Why the flood photograph is dark: by dimming, or by compressed highlights.
pub fn flood_shortfall_reason(dimming: Option<f64>) -> String {
    let cause = match dimming {
        Some(dimming) => format!(
            "the display dims bright pictures, by {:.1} % when all elements are lit, unless the flood photograph has less \
             exposure",
            100.0 * dimming
        ),
        None => "bright pixels fall short by a larger share than dim ones, as the photographs have compressed \
             highlights"
            .to_owned(),
    };
    format!("the flood photograph is darker than the patterns predict: {cause}")
}

/// Notes pixels that are filled from their neighbours.
pub fn defective_pixels(defects: DefectivePixels) -> Vec<Finding> {
    let kinds = [
        (defects.hot, "hot", "hot-pixels"),
        (defects.dead, "dead", "dead-pixels"),
    ];
    let found = kinds.into_iter().filter(|(count, ..)| *count > 0);
    let note = |(count, kind, code)| {
        let text = match count {
            1 => format!("1 {kind} pixel is filled from its neighbours"),
            _ => format!("{count} {kind} pixels are filled from their neighbours"),
        };
        Finding::note(code, text)
    };
    found.map(note).collect()
}

/// Notes saturated samples of `shots`, those that were read, and warns if there are too many.
pub fn saturation(
    folder: &CaptureFolder,
    shots: &[usize],
    read: &ReadSample,
    measurements: &Measurements,
) -> Vec<Finding> {
    let saturated = read.codes.saturated;
    if saturated == 0 {
        return Vec::new();
    }
    let percent = saturated_percent(saturated, measurements);
    let note = format!("{saturated} saturated samples ({percent:.1} %) are not used");
    let mut findings = vec![Finding::note("saturated-samples", note)];
    let by_shot: Vec<usize> = read.codes_by_shot.iter().map(|own| own.saturated).collect();
    let mut worst = implausibly_saturated(&by_shot, measurements);
    worst.sort_by_key(|l| std::cmp::Reverse(by_shot[*l]));
    if let Some(first) = worst.first() {
        let most = saturated_percent(by_shot[*first] * by_shot.len(), measurements);
        let worst = worst.iter().map(|l| shots[*l]).collect();
        findings.push(saturated_shots(folder, worst, most));
    }
    findings
}

/// Warns of `shots` that saturate too many samples, up to `most` per cent.
pub fn saturated_shots(folder: &CaptureFolder, shots: Vec<usize>, most: f64) -> Finding {
    let message = format!(
        "large shares of samples are saturated, up to {most:.1} %, in {}: check \"camera.white\" in capture.json, or photograph \
         with less exposure",
        name_shots(folder, &shots),
    );
    Finding::warning("saturation", message).of_shots(shots)
}

/// Warns if the width of the band, or the SNR on held-out patterns, is doubtful.
pub fn preparation(prepared: &PreparedExport) -> Vec<Finding> {
    let side = prepared.recovery.geometry().window.side();
    let mut warnings = Vec::new();
    match prepared.band {
        None | Some(TailEstimate::Bounded { .. }) => {}
        Some(TailEstimate::Unbounded) => warnings.push(Finding::warning(
            "band-unbounded",
            format!(
                "the band is at least as wide as the largest window tried, {side}x{side} light \
                 elements; a larger one can be given by --window"
            ),
        )),
        Some(TailEstimate::Undetermined) => warnings.push(Finding::warning(
            "band-undetermined",
            format!(
                "the photographs do not show how wide the band is; a window of {side}x{side} light \
                 elements is used, another can be given by --window"
            ),
        )),
    }
    let snr = prepared.expected_snr();
    if let Some(snr) = snr.filter(|snr| *snr < MIN_PLAUSIBLE_SNR) {
        warnings.push(Finding::warning(
            "low-snr",
            format!(
                "the SNR on held-out patterns is only {snr}; check that the photographs are linear, that \
                 the light was steady and that the correspondence is right. With few patterns, or another \
                 method than learned, it may not get better"
            ),
        ));
    }
    warnings
}

/// Warns of pixels that are saturated in nearly all photographs.
pub fn overexposure(pixels: usize) -> Option<Finding> {
    let message = format!(
        "{pixels} pixels are saturated in nearly all photographs and will be white under any light; \
         photograph with less exposure"
    );
    (pixels > 0).then(|| Finding::warning("overexposed", message))
}

/// Warns of tiles of the file whose values are clipped; there are `all` tiles.
pub fn clipped_tiles(tiles: usize, all: usize) -> Option<Finding> {
    let message = format!(
        "{tiles} of {all} tiles of the file have values far above those of the sample that it is planned from. They are \
         clipped, so that parts of these tiles are wrong under some lights. A recovery with --max-bytes plans its file from \
         all tiles"
    );
    (tiles > 0).then(|| Finding::warning("clipped", message))
}

/// Notes how photographs are corrected, and warns of those that are left out; `shots` are those of the measurements.
pub fn photographs(
    folder: &CaptureFolder,
    shots: &[usize],
    recovery: &PreparedRecovery,
) -> Vec<Finding> {
    let listed = &folder.manifest().shots;
    let mut findings = corrections(recovery, &|l| &listed[shots[l]].photo);
    let warning = |&(l, fault): &(usize, PhotographFault)| {
        let shot = |l: usize| &listed[shots[l]];
        let (index, own) = (shots[l], shot(l));
        let reason = match fault {
            PhotographFault::PatternOf { other } => {
                format!(
                    "it shows the pattern {} of shots[{}]. List it with that pattern, or photograph again",
                    shot(other).pattern,
                    shots[other]
                )
            }
            PhotographFault::Blend { other, share } => format!(
                "it shows a blend of its pattern and {:.0} % of {}: was it taken while the screen changed? Photograph \
                 again, and wait longer after each change",
                100.0 * share,
                shot(other).pattern
            ),
            PhotographFault::UnknownPattern => format!(
                "it shows neither {} nor any other pattern of this capture. List it with its own pattern, or photograph \
                 again",
                own.pattern
            ),
            PhotographFault::OtherObject => {
                "it shows another object, or this one from another place. Photograph again".to_owned()
            }
            PhotographFault::Moved { shift: [x, y] } => format!(
                "the camera or the object had moved, by about {x:.1} pixels to the right and {y:.1} down. Fasten both, \
                 and photograph again"
            ),
            PhotographFault::Distorted => {
                "it differs from its prediction: is it blurred, or did something cover the object? Photograph again"
                    .to_owned()
            }
        };
        let message = format!("shots[{index}] ({}) is left out: {reason}", own.photo);
        Finding::warning(fault.code(), message).of_shots([index])
    };
    let (moved, others): (Vec<_>, Vec<_>) = recovery
        .faults()
        .iter()
        .partition(|(_, fault)| fault.is_moved());
    findings.extend(others.iter().map(warning));
    // Many photographs, and one cause.
    if let Some((first, more)) = moved.split_first() {
        let mut summary = warning(first);
        if !more.is_empty() {
            let names = moved.iter().map(|(l, _)| listed[shots[*l]].photo.clone());
            summary.message = format!(
                "{} photographs are left out, as the camera or the object had moved by more than a third of a \
                 pixel: {}. Fasten both, and photograph again",
                moved.len(),
                join_first(names)
            );
            summary.shots = moved.iter().map(|(l, _)| shots[*l]).collect();
        }
        findings.push(summary);
    }
    findings.extend(trembling(recovery));
    findings
}

/// Warns of a camera that moved between the photographs that are used.
fn trembling(recovery: &PreparedRecovery) -> Option<Finding> {
    let shift = recovery.trembling()?;
    Some(Finding::warning(
        "camera-trembled",
        format!(
            "the camera moved between photographs: pictures are shifted by {shift:.2} pixels (root mean square). This is \
             corrected, but costs accuracy; fasten the camera, or wait before each photograph"
        ),
    ))
}

/// Notes exposures and stray light that are corrected.
fn corrections<'a>(
    recovery: &PreparedRecovery,
    name: &dyn Fn(usize) -> &'a String,
) -> Vec<Finding> {
    let is_used = |l: usize| recovery.faults().iter().all(|fault| fault.0 != l);
    let corrections = recovery.corrections().iter().enumerate();
    let corrections: Vec<(usize, &PhotographCorrection)> =
        corrections.filter(|(l, _)| is_used(*l)).collect();
    let mut notes = Vec::new();
    if corrections.is_empty() {
        return notes;
    }
    let gains = corrections
        .iter()
        .map(|(l, correction)| (*l, correction.gain() - 1.0));
    let count = corrections.len() as f64;
    let squares = gains.clone().map(|(_, gain)| gain * gain);
    let deviation = (squares.sum::<f64>() / count).sqrt();
    if deviation > MIN_NOTED_DEVIATION {
        let drift = match drift(&gains.clone().collect::<Vec<_>>()) {
            Some(drift) => format!(
                ", with a drift of {:+.1} % from the first photograph to the last",
                100.0 * drift
            ),
            None => String::new(),
        };
        let text = format!(
            "exposures differ from those declared by {:.1} % (standard deviation){drift}; this is corrected",
            100.0 * deviation
        );
        notes.push(Finding::note("exposures-differ", text));
    }
    let far = gains.filter(|(_, gain)| gain.abs() > MIN_NAMED_DEVIATION);
    let far: Vec<String> = far
        .map(|(l, gain)| format!("{} ({:.2} times)", name(l), 1.0 + gain))
        .collect();
    if !far.is_empty() {
        let text = format!(
            "exposed differently from the others: {}",
            join_first(far.into_iter())
        );
        notes.push(Finding::note("exposure-outliers", text));
    }
    let stray = corrections
        .iter()
        .map(|(_, correction)| correction.stray_light());
    let [least, most] = [
        stray.clone().fold(f64::INFINITY, f64::min),
        stray.fold(0.0, f64::max),
    ];
    if most > MIN_NOTED_DEVIATION {
        let text = format!(
            "stray light of {:.1} % to {:.1} % of white is subtracted; is there light that the dark \
             photograph lacks?",
            100.0 * least.max(0.0),
            100.0 * most
        );
        notes.push(Finding::note("stray-light", text));
    }
    notes
}

/// Change of the exposures, given as deviations from 1 with the numbers of their photographs, along the line that fits them
/// best. `None` if it may be chance.
fn drift(gains: &[(usize, f64)]) -> Option<f64> {
    let count = gains.len() as f64;
    let mean = |value: &dyn Fn(&(usize, f64)) -> f64| gains.iter().map(value).sum::<f64>() / count;
    let time = |&(l, _): &(usize, f64)| l as f64;
    let (centre, level) = (mean(&time), mean(&|pair| pair.1));
    let spread = mean(&|pair| (time(pair) - centre).powi(2));
    let slope = mean(&|pair| (time(pair) - centre) * (pair.1 - level)) / spread;
    let residual = mean(&|pair| (pair.1 - level - slope * (time(pair) - centre)).powi(2));
    let error = (residual / (spread * count)).sqrt();
    let drift = slope * (gains.last()?.0 - gains.first()?.0) as f64;
    let is_significant = slope.abs() > MIN_DRIFT_ERRORS * error;
    (is_significant && drift.abs() > MIN_NOTED_DEVIATION).then_some(drift)
}

/// The fault of a capture as a whole; `shots` are those of the measurements.
pub fn capture_fault(
    folder: &CaptureFolder,
    shots: &[usize],
    measurements: &Measurements,
    fault: CaptureFault,
) -> Finding {
    let listed = &folder.manifest().shots;
    let shot = |l: usize| format!("shots[{}] ({})", shots[l], listed[shots[l]].photo);
    // Held-out shots may lie between.
    let before = |first: usize| match first >= MIN_PATTERNS {
        true => format!(
            ", or recover from the shots before with --patterns {}",
            shots[first - 1] + 1
        ),
        false => String::new(),
    };
    let text = match fault {
        CaptureFault::Slipped { first, by } => {
            let (direction, question) = match by > 0 {
                true => ("after", "is a photograph missing before it"),
                false => ("before", "was a photograph taken twice"),
            };
            let other = match by.abs() {
                1 => format!("the shot {direction} its own"),
                distance => format!("the shot {distance} {direction} its own"),
            };
            format!(
                "from {} on, each photograph shows the pattern of {other}: {question}? List each photograph with its \
                 pattern{}",
                shot(first),
                before(first),
            )
        }
        CaptureFault::Correspondence(symmetry) => {
            let kind = match symmetry.is_mirrored != symmetry.is_flipped {
                false if !symmetry.is_transposed => "turned by 180 degrees",
                true if symmetry.is_transposed => "turned by 90 degrees",
                _ => "mirrored",
            };
            let right =
                symmetry.of_correspondence(measurements.light, &measurements.correspondence);
            // Without negative zeros.
            let [u, v] = right.affine.map(|row| row.map(|value| value + 0.0));
            match right.displacement {
                None => format!(
                    "the correspondence is {kind}: the photographs follow from their patterns with \
                     \"correspondence\": {{\"affine\": [{u:?}, {v:?}]}}"
                ),
                Some(_) => format!(
                    "the correspondence is {kind}; check the axes of \"graycode\", and give `ltm-export calibrate --force`"
                ),
            }
        }
        CaptureFault::Moved { first, shift } => format!(
            "{}: remove the shots before the move, or those after it{}",
            moved_before(&shot(first), shift),
            before(first),
        ),
    };
    let message = format!("{}: {text}", folder.manifest_path().display());
    let first = match fault {
        CaptureFault::Slipped { first, .. } | CaptureFault::Moved { first, .. } => Some(first),
        CaptureFault::Correspondence(_) => None,
    };
    let from = first.map_or(&[][..], |first| &shots[first..]);
    Finding::warning("capture-fault", message).of_shots(from.iter().copied())
}

/// The warning of a camera that moved once, before photograph `first`, if only the photographs `still` are used. `shift` is
/// the move in camera pixels, `None` for a fraction of a pixel.
pub fn moved_once(
    folder: &CaptureFolder,
    shots: &[usize],
    (first, shift): (usize, Option<[i32; 2]>),
    still: &Range<usize>,
) -> Finding {
    let shot = shots[first];
    let name = format!("shots[{shot}] ({})", folder.manifest().shots[shot].photo);
    let moved = shots.len() - still.len();
    let side = if still.start == 0 {
        "from then on"
    } else {
        "before"
    };
    let move_text = match shift {
        Some(shift) => moved_before(&name, shift),
        None => format!("the camera or the object moved before {name}, by a fraction of a pixel"),
    };
    let message = format!(
        "{}: {move_text}: the {moved} photographs {side} are left out",
        folder.manifest_path().display(),
    );
    let left_out = shots[..still.start].iter().chain(&shots[still.end..]);
    Finding::warning(MOVED_CODE, message).of_shots(left_out.copied())
}

/// That the camera moved before a shot.
fn moved_before(shot: &str, [x, y]: [i32; 2]) -> String {
    let along = |distance: i32, [forward, backward]: [&str; 2]| {
        let direction = if distance > 0 { forward } else { backward };
        let plural = if distance.abs() == 1 { "" } else { "s" };
        (distance != 0).then(|| format!("{} pixel{plural} {direction}", distance.abs()))
    };
    let distances = [
        along(x, ["to the right", "to the left"]),
        along(y, ["down", "up"]),
    ];
    let distances: Vec<String> = distances.into_iter().flatten().collect();
    format!(
        "the camera or the object moved before {shot}, by about {}",
        distances.join(" and ")
    )
}

/// The error for `shots` whose photographs do not match their patterns.
pub fn mismatched_shots(
    folder: &CaptureFolder,
    shots: impl ExactSizeIterator<Item = usize>,
) -> anyhow::Error {
    let listed = &folder.manifest().shots;
    let name = |i: usize| format!("shots[{i}] ({}, {})", listed[i].photo, listed[i].pattern);
    let message = format!(
        "{}: some photographs do not match the patterns they are listed with, while the others do: {}; \
         correct these shots or take them out; if there are many, check whether the correspondence is \
         mirrored",
        folder.manifest_path().display(),
        join_first(shots.map(name))
    );
    FaultyPhotographsError(message).into()
}

/// The first of some shots with their photographs, and how many more there are.
pub fn name_shots(folder: &CaptureFolder, shots: &[usize]) -> String {
    let listed = &folder.manifest().shots;
    let name = |&shot: &usize| format!("shots[{shot}] ({})", listed[shot].photo);
    join_first(shots.iter().map(name))
}

/// The first items, and how many more there are.
pub fn join_first(items: impl ExactSizeIterator<Item = String>) -> String {
    let more = items.len().saturating_sub(MAX_NAMED_ITEMS);
    let mut first: Vec<String> = items.take(MAX_NAMED_ITEMS).collect();
    if more > 0 {
        first.push(format!("and {more} more"));
    }
    first.join(", ")
}
