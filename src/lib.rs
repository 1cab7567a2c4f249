//! Photographs under every light.
//!
//! A photograph is one picture under one light. The *light transport matrix* `T` of an object is
//! its picture under every light: `y = pT`. For nearly planar objects `T` is a band, which can be
//! recovered from about 80 photographs, kept in a small file and relit at video rate.
//!
//! Data flows one way, through one module after the other:
//!
//! | module | from | to |
//! |---|---|---|
//! | [`simulate`] (native) | a built-in scene | a capture folder with known transport |
//! | [`capture`] | a capture folder | linear measurements |
//! | [`calibrate`] | photographs of Gray code | the correspondence |
//! | [`recover`] | measurements | light transport functions |
//! | [`transport`] | – | what the rooms around it share: windows, tiles, the band |
//! | [`format`] | a transport | an `.ltm` file, and back |
//! | [`relight`] | a transport and a light | a picture |
//! | [`study`] (native) | known transport | how well all of this does: figures and tables |
//!
//! `cli` (native) and `web` (wasm32) are thin faces on them.

pub mod calibrate;
pub mod capture;
#[cfg(not(target_arch = "wasm32"))]
pub mod cli;
pub mod executor;
pub mod format;
mod linalg;
pub mod recover;
pub mod relight;
#[cfg(not(target_arch = "wasm32"))]
pub mod simulate;
#[cfg(not(target_arch = "wasm32"))]
pub mod study;
pub mod transport;
#[cfg(target_arch = "wasm32")]
pub mod web;

// Unit tests of wasm32 run where the kernels and canvases are: in a browser.
#[cfg(all(test, target_arch = "wasm32"))]
wasm_bindgen_test::wasm_bindgen_test_configure!(run_in_browser);
