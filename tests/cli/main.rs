//! The command line, run as its users run it. One program, as linking each would take longer than most of the tests.
#![cfg(not(target_arch = "wasm32"))]
#![allow(clippy::unwrap_used)] // a panic fails the test

#[path = "../common/mod.rs"]
mod common;

mod acquisition;
mod check;
mod commands;
mod enlargement;
mod import;
mod ingest;
mod levels;
mod photo_files;
mod photographs;
mod reference;
mod report;
mod session;
mod simulate;
mod stage;
#[cfg(unix)]
mod streaming;
mod study;
mod tiles;
