//! Errors, warnings and notes of a recovery, in terms of the command line.

use anyhow::{Error, anyhow};

use crate::capture::{CaptureFolder, Measurements};
use crate::cli::value_parsers::ByteCount;
use crate::export::{
    MIN_PLAUSIBLE_SNR, PreparedExport, TooFewShots, TooLittleMemory, has_implausible_saturation,
    saturated_percent,
};
use crate::recover::TailEstimate;

/// Maximum number of shots or fields that a message names.
const MAX_NAMED_ITEMS: usize = 4;

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

/// Notes fields of the manifest that are unknown.
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
    let percent = saturated_percent(saturated, measurements);
    eprintln!("note: {saturated} saturated samples ({percent:.1} %) are left out");
    if has_implausible_saturation(saturated, measurements) {
        eprintln!(
            "warning: that is a large share; check \"camera.white\" in capture.json, or photograph \
             with less exposure"
        );
    }
}

/// Warns if the width of the band, or the SNR on held-out patterns, is doubtful.
pub fn warn_of_preparation(prepared: &PreparedExport) {
    let side = prepared.recovery.geometry().window.side();
    match prepared.band {
        None | Some(TailEstimate::Bounded { .. }) => {}
        Some(TailEstimate::Unbounded) => eprintln!(
            "warning: the band is at least as wide as the largest window tried, {side}x{side} light \
             elements; a larger one can be given by --window"
        ),
        Some(TailEstimate::Undetermined) => eprintln!(
            "warning: the photographs do not show how wide the band is; a window of {side}x{side} \
             light elements is used, another can be given by --window"
        ),
    }
    let snr = prepared.expected_snr();
    if let Some(snr) = snr.filter(|snr| *snr < MIN_PLAUSIBLE_SNR) {
        eprintln!(
            "warning: the SNR on held-out patterns is only {snr}; check that the photographs are \
             linear, that the light was steady and that the correspondence is right. With few \
             patterns, or another method than learned, it may not get better"
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
