//! Built-in scenes with known light transport, and a camera that photographs them.
//!
//! A [`SimulatedScene`] computes the light transport function τ, `[S]` in units of the measurement, of any
//! camera pixel: a procedural picture in resolution-independent coordinates ([`coordinates`]) and the physics
//! of light in it. The lengths that determine the band (scattering widths, refraction, parallax) are in
//! light elements, so that one window holds the band at every resolution.
//!
//! [`EmissionMatrix`] computes y = pT under many lights, [`Camera`] adds noise; [`SimulatedCapture`] does both in
//! memory. This module uses no threads, files or clock; callers compute [`SimulatedScene::tile`] in parallel.

mod camera;
mod camera_view;
mod cookies;
mod emission_matrix;
mod gradient_noise;
mod pattern_image;
mod scene_kind;
mod separable_filter;
mod session_fault;
mod signed_distance;
mod simulated_capture;
mod simulated_scene;
mod stained_glass;
mod truth_lights;
mod vec2;

pub use camera::{Camera, RandomStreamId};
pub use camera_view::CameraView;
pub use emission_matrix::EmissionMatrix;
pub use pattern_image::{GrayCodePattern, MONITOR_GAMMA, PatternEnsemble, PatternImage, emission};
pub use scene_kind::SceneKind;
pub use session_fault::{SessionFault, SessionFaultKind};
pub use simulated_capture::{SimulatedCapture, emitted_pattern, first_shots};
pub use simulated_scene::{SimulatedScene, WINDOW_SIDE};
pub use truth_lights::truth_lights;
