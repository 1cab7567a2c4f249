//! The dark frame: the light that is on the camera without the light plane.

use crate::capture::measurements::LinearPhoto;
use crate::capture::noise_model::NoiseModel;

/// The photograph under no light, which is subtracted from all others.
#[derive(Clone, Debug)]
pub struct DarkFrame {
    /// `[N]`, in units of the measurement.
    pub(super) light: LinearPhoto,
    /// The noise floor estimated from it.
    pub(super) noise: NoiseModel,
}
