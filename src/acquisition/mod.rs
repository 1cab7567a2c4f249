//! Acquisition of photographs: what a display shows, in order, and which photograph shows what.
//!
//! [`PatternSequence`] lists the pictures of a session: dark, flood, grey ramp, Gray code, and patterns with reference floods
//! in between. [`DisplayLayout`] enlarges light elements to whole pixels of the display. [`SessionPlan`] says what the numbers
//! mean for an object. [`SequenceBrightness`] checks that photographs are in the order of their pictures. [`DisplayedPicture`]
//! recognises what another program showed. While a session is photographed, [`ExposureSearch`] finds the exposure time,
//! [`PhotographStatistics`] says how bright and sharp a photograph is, and [`PatternPrediction`] whether it shows its pattern.

mod display_layout;
mod displayed_picture;
mod exposure_search;
mod pattern_prediction;
mod photograph_statistics;
mod sequence;
mod sequence_brightness;
mod session_plan;

pub use display_layout::{DisplayLayout, DisplayLayoutError};
pub use displayed_picture::{DisplayedPicture, DisplayedRole};
pub use exposure_search::{ExposureSearch, ExposureStep, MAX_FLOOD, MIN_FLOOD};
pub use pattern_prediction::{PatternPrediction, ShownPattern};
pub use photograph_statistics::{HISTOGRAM_BINS, PhotographStatistics, luminance, shift_between};
pub use sequence::{
    PatternSequence, PictureRole, Primary, SEQUENCE_NAME, SequenceError, SequencePicture,
    SequenceSettings,
};
pub use sequence_brightness::{PairingFault, SequenceBrightness};
pub use session_plan::{SessionPlan, SessionSetup};
