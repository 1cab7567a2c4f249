//! The Gray code of a scanned capture: the correspondence, and its faults.

use std::cell::RefCell;

use anyhow::Error;

use super::scanned_capture::ScannedCapture;
use crate::calibrate::{BitPair, GrayCodePhotos, GrayCodeQuality, LightPlaneAxis};
use crate::capture::{CaptureFolder, LinearPhoto, PhotographRole};
use crate::cli::advice::error_with_remedy;
use crate::cli::finding::{Finding, Severity};
use crate::cli::recover::messages::join_first;

/// Share of the camera pixels with clear Gray code below which the picture hardly shows the light plane.
const MIN_DECODED_SHARE: f64 = 0.05;
/// Median distance of the correspondence from the code that pixels show, in light elements, above which it is wrong: a relief
/// shifts them by about one.
const MAX_RESIDUAL: f64 = 2.0;

/// Decodes the Gray code of `folder` for `scanned`. Returns how well it can be read and agrees with the correspondence, and
/// what is wrong.
pub fn examine(
    folder: &CaptureFolder,
    scanned: &mut ScannedCapture<'_>,
) -> (Option<[GrayCodeQuality; 2]>, Vec<Finding>) {
    let manifest = folder.manifest();
    let is_declared = manifest.correspondence.is_some();
    // Nothing else needs the Gray code where the correspondence is declared.
    let severity = match is_declared {
        true => Severity::Warning,
        false => Severity::Error,
    };
    let finding = |code, message: String| Finding {
        severity,
        ..Finding::error(code, message)
    };
    if manifest.graycode.is_empty() {
        let path = folder.manifest_path();
        let message = format!(
            "{}: neither \"correspondence\" nor \"graycode\" is given; photograph the Gray code, or give \"correspondence\"",
            path.display()
        );
        let findings = (!is_declared).then(|| finding("gray-code-incomplete", message));
        return (None, findings.into_iter().collect());
    }
    let (photos, missing) = collect(folder, scanned);
    if !missing.is_empty() {
        let message = format!(
            "{}: \"graycode\" has no photographs of {}; add them, or give \"correspondence\"",
            folder.manifest_path().display(),
            join_first(missing.into_iter())
        );
        return (None, vec![finding("gray-code-incomplete", message)]);
    }
    let Some(photos) = photos else {
        return (None, Vec::new()); // The files that cannot be read are findings.
    };
    scanned.contrasts = finest_contrasts(&photos);
    let extent = manifest.camera.extent();
    let decoded = match photos.fit(extent) {
        Ok(fit) => fit.correspondence,
        Err(error) => {
            let error = Error::new(error).context(folder.manifest_path().display().to_string());
            let finding = finding("gray-code-unclear", error_with_remedy(&error));
            return (None, vec![finding]);
        }
    };
    let used = manifest.correspondence.as_ref().unwrap_or(&decoded);
    let quality = photos.quality(extent, used);
    let findings = quality_findings(folder, quality, is_declared);
    if !is_declared {
        scanned.correspondence = Some(decoded);
    }
    (Some(quality), findings)
}

/// The photographs of all bits, `None` if one cannot be read, and names of those that are not listed.
fn collect(
    folder: &CaptureFolder,
    scanned: &ScannedCapture<'_>,
) -> (Option<GrayCodePhotos>, Vec<String>) {
    let manifest = folder.manifest();
    let dark = scanned.dark_of(PhotographRole::GrayCode(0), &manifest.camera);
    let missing = RefCell::new(Vec::new());
    let is_whole = RefCell::new(true);
    let photo = |axis: LightPlaneAxis, bit: u32, inverted: bool| -> LinearPhoto {
        let Some(i) = manifest.gray_code_index(axis, bit, inverted) else {
            let kind = if inverted { "inverted" } else { "plain" };
            (missing.borrow_mut()).push(format!("axis {axis}, bit {bit}, {kind}"));
            return LinearPhoto::new();
        };
        match scanned.scan(PhotographRole::GrayCode(i)) {
            Some(scan) => manifest.camera.measure(&scan.pixels, 1.0, &dark).collect(),
            None => {
                *is_whole.borrow_mut() = false;
                LinearPhoto::new()
            }
        }
    };
    let rows = scanned.gray_code_rows().iter().collect();
    let photos = GrayCodePhotos::collect(manifest.light.extent(), rows, |axis, bit, inverted| {
        Ok::<_, Error>(photo(axis, bit, inverted))
    });
    let photos = photos.ok().filter(|_| *is_whole.borrow());
    (photos, missing.into_inner())
}

/// The contrasts of bits 0 and 1 in the sharpest camera pixels, each along the axis where it is lower.
fn finest_contrasts(photos: &GrayCodePhotos) -> Option<[f32; 2]> {
    // Bits are listed from the most significant one on.
    let contrast = |bits: &[BitPair], bit: usize| bits.iter().rev().nth(bit)?.best_contrast();
    let lower = |bit| Some(contrast(&photos.x, bit)?.min(contrast(&photos.y, bit)?));
    Some([lower(0)?, lower(1)?])
}

fn quality_findings(
    folder: &CaptureFolder,
    quality: [GrayCodeQuality; 2],
    is_declared: bool,
) -> Vec<Finding> {
    let path = folder.manifest_path();
    let mut findings = Vec::new();
    let share = quality[0].decoded_share.min(quality[1].decoded_share);
    if share < MIN_DECODED_SHARE {
        let message = format!(
            "only {:.1} % of the camera pixels show clear Gray code; photograph it again with more light, or crop the \
             photographs to the object",
            100.0 * share
        );
        findings.push(Finding::warning("gray-code-unclear", message));
    }
    let residual = quality[0].residual.max(quality[1].residual);
    if residual > MAX_RESIDUAL {
        let (what, remedy) = match is_declared {
            true => (
                "\"correspondence\" does not agree with the Gray code",
                "remove it, and the Gray code is decoded instead, or correct it",
            ),
            false => (
                "the Gray code does not agree with a smooth correspondence",
                "the object may not be nearly flat: photograph it from further away, or a part of it",
            ),
        };
        let message = format!(
            "{}: {what}: on half of the camera pixels it is more than {residual:.1} light elements off; {remedy}",
            path.display()
        );
        findings.push(Finding::warning("correspondence-residual", message));
    }
    findings
}
