//! Relightable photographs: light transport recovery, a file format and real-time relighting.
//!
//! An ordinary photograph shows an object under one light. Its *light transport matrix* `T` gives the picture `y = pT`
//! under any light `p`. For a nearly planar object `T` is a band, which can be recovered from about 80 photographs,
//! stored in a compact file and multiplied by a light at video rate (Thanikachalam et al. 2014).
//!
//! Data flows in one direction through these modules:
//!
//! | module | from | to | feature |
//! |---|---|---|---|
//! | [`acquisition`] | a display and an object | what to show, and which photograph shows what | `simulate` |
//! | [`simulate`] | a built-in scene | photographs with known transport | `simulate` |
//! | [`photo_file`] | a raw file or a picture | samples | `photo_file` |
//! | [`capture`] | a capture folder | linear measurements | `capture` for files |
//! | [`calibrate`] | photographs of Gray code | the correspondence | |
//! | [`recover`] | measurements | light transport functions | |
//! | [`transport`] | – | the matrix in memory, shared by the others | |
//! | [`format`] | a transport | an `.ltm` file, and back | |
//! | [`export`] | a capture | an `.ltm` file, by the modules above | |
//! | `pyramid` | an `.ltm` file | one of several levels | |
//! | [`relight`] | a transport and a light | a picture | |
//! | [`study`] | known transport | accuracy figures and tables | `study` |
//!
//! `cli` (feature `cli`) and `web` (wasm32) call these modules and add no algorithms.

#[cfg(feature = "simulate")]
pub mod acquisition;
mod bisect;
pub mod calibrate;
pub mod capture;
#[cfg(all(feature = "cli", not(target_arch = "wasm32")))]
pub mod cli;
pub mod export;
pub mod format;
pub mod job_executor;
mod linalg;
#[cfg(all(feature = "photo_file", not(target_arch = "wasm32")))]
pub mod photo_file;
#[cfg(not(target_arch = "wasm32"))]
pub mod pyramid;
pub mod recover;
pub mod relight;
#[cfg(feature = "simulate")]
pub mod simulate;
#[cfg(all(feature = "study", not(target_arch = "wasm32")))]
pub mod study;
#[cfg(all(
    any(feature = "capture", feature = "photo_file"),
    not(target_arch = "wasm32")
))]
mod tiff_signature;
pub mod transport;
#[cfg(target_arch = "wasm32")]
pub mod web;

// Browsers have the vector instructions and canvases that unit tests of wasm32 need.
#[cfg(all(test, target_arch = "wasm32"))]
wasm_bindgen_test::wasm_bindgen_test_configure!(run_in_browser);
