//! The input of every stage that prepares a recovery.

use super::error::RecoverError;
use super::holdout_split::HoldoutSplit;
use super::photometry::CalibratedMeasurements;
use crate::capture::Measurements;
use crate::transport::{Geometry, TileRect, Window};

/// What a recovery is prepared from, and the executor that runs the preparation.
pub(super) struct RecoveryPreparationInput<'a, E> {
    pub measurements: &'a CalibratedMeasurements<'a>,
    pub geometry: Geometry,
    pub split: &'a HoldoutSplit,
    pub executor: &'a E,
}

impl<'a, E> RecoveryPreparationInput<'a, E> {
    /// The same with other corrections of the photographs.
    pub fn with<'b>(
        &self,
        measurements: &'b CalibratedMeasurements<'b>,
    ) -> RecoveryPreparationInput<'b, E>
    where
        'a: 'b,
    {
        RecoveryPreparationInput {
            measurements,
            geometry: self.geometry.clone(),
            split: self.split,
            executor: self.executor,
        }
    }
}

/// The geometry of a recovery with this window.
///
/// # Errors
/// If the geometry is out of range, and if no camera pixel's window reaches the light plane.
pub(super) fn geometry(
    measurements: &Measurements,
    window: Window,
) -> Result<Geometry, RecoverError> {
    let geometry = Geometry {
        camera: measurements.camera,
        light: measurements.light,
        window,
        correspondence: measurements.correspondence.clone(),
        tile_side: Geometry::DEFAULT_TILE_SIDE,
    }
    .validate()?;
    let mut windows = geometry
        .tiles()
        .flat_map(TileRect::pixels)
        .map(|pixel| geometry.clip_window(geometry.window_origin(pixel)));
    match windows.any(|window| !window.is_empty()) {
        true => Ok(geometry),
        false => Err(RecoverError::CorrespondenceOffLightPlane),
    }
}
