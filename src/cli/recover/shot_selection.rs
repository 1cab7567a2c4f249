//! The shots to recover from, and messages about them.

use anyhow::{Result, anyhow, bail};

use crate::capture::{CaptureFolder, Measurements, Shot, group_ids};
use crate::transport::CHANNELS;

/// Of every so many patterns, one is held out of the recovery for `evaluate`.
const HOLD_OUT_INTERVAL: usize = 10;
/// Maximum number of shots or fields that a message names.
const MAX_NAMED_ITEMS: usize = 4;
/// Percentage of saturated samples above which an error in the manifest is likelier than highlights.
const MAX_SATURATED_PERCENT: f64 = 2.0;

/// Indices of the shots to recover from: the first `count`, or all but those held out.
pub fn choose_shots(shots: &[Shot], count: Option<u32>) -> Result<Vec<usize>> {
    let available = shots.len();
    match count.map(|k| k as usize) {
        Some(k) if k > available => {
            bail!("--patterns is {k}, but the capture has {available} shots")
        }
        Some(k) => Ok((0..k).collect()),
        None => {
            // Shots of one pattern at several exposures are held out together.
            let patterns = group_ids(shots.iter().map(|shot| &shot.pattern));
            let is_used = |i: &usize| patterns[*i] % HOLD_OUT_INTERVAL != HOLD_OUT_INTERVAL - 1;
            Ok((0..available).filter(is_used).collect())
        }
    }
}

pub fn warn_of_unknown_fields(folder: &CaptureFolder) {
    let unknown = &folder.manifest().unknown;
    if !unknown.is_empty() {
        eprintln!(
            "note: {}: unknown fields are ignored: {}",
            folder.manifest_path().display(),
            join_first(unknown.iter().cloned())
        );
    }
}

/// Notes saturated samples, and warns if there are too many.
pub fn warn_of_saturation(saturated: usize, measurements: &Measurements) {
    if saturated == 0 {
        return;
    }
    let samples = measurements.photos.len() * measurements.camera.area() * CHANNELS;
    let percent = 100.0 * saturated as f64 / samples as f64;
    eprintln!("note: {saturated} saturated samples ({percent:.1} %) are left out");
    // Of several exposures the longest are meant to saturate.
    let full_scale = &measurements.full_scale;
    let has_one_exposure = full_scale.iter().all(|value| *value == full_scale[0]);
    if has_one_exposure && percent > MAX_SATURATED_PERCENT {
        eprintln!(
            "warning: that is a large share; check \"camera.white\" in capture.json, or photograph \
             with less exposure"
        );
    }
}

/// The error for `shots` whose photographs do not match their patterns.
pub fn mismatched_shots(
    folder: &CaptureFolder,
    shots: impl ExactSizeIterator<Item = usize>,
) -> anyhow::Error {
    let listed = &folder.manifest().shots;
    let name = |i: usize| format!("shots[{i}] ({}, {})", listed[i].photo, listed[i].pattern);
    anyhow!(
        "{}: some photographs do not match the patterns they are listed with, while the others do: {}; \
         correct these shots or take them out; if there are many, check whether the correspondence is \
         mirrored",
        folder.manifest_path().display(),
        join_first(shots.map(name))
    )
}

/// The first items, and how many more there are.
fn join_first(items: impl ExactSizeIterator<Item = String>) -> String {
    let more = items.len().saturating_sub(MAX_NAMED_ITEMS);
    let mut first: Vec<String> = items.take(MAX_NAMED_ITEMS).collect();
    if more > 0 {
        first.push(format!("and {more} more"));
    }
    first.join(", ")
}
