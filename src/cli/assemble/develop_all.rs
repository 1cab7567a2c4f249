//! Development of all photographs of a session, a few at a time.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use image::ExtendedColorType;
use rayon::prelude::*;

use super::level_warnings::PhotographLevels;
use super::photograph_file::{DevelopSettings, develop};
use crate::capture::ManifestCamera;
use crate::cli::capture_writer::write_png;
use crate::cli::process_resources::{Interrupted, InterruptibleCores, thread_pool};
use crate::cli::progress;
use crate::job_executor::Executor;

/// Photographs that are in memory at once.
const MAX_READERS: usize = 4;

/// The photographs of a session, developed and written.
pub struct DevelopedSession {
    /// Size and levels.
    pub camera: ManifestCamera,
    /// One for each photograph.
    pub levels: Vec<PhotographLevels>,
    /// Mean measurement of each part of the picture, of each photograph.
    pub thumbnails: Vec<Vec<f64>>,
}

/// Ends a command whose user has interrupted it.
pub fn check_cancelled(cores: &InterruptibleCores) -> Result<()> {
    match cores.is_cancelled() {
        true => bail!(Interrupted("interrupted: nothing is written".to_owned())),
        false => Ok(()),
    }
}

/// Develops the photographs at `paths` and writes each to the path below `folder` that `name` gives its number, if any.
/// Temporary files go to `folder`.
pub fn develop_all(
    paths: &[PathBuf],
    settings: &DevelopSettings,
    folder: &Path,
    name: impl Fn(usize) -> Option<String> + Sync,
    cores: &InterruptibleCores,
) -> Result<DevelopedSession> {
    let bar = progress::bar("reading photographs", paths.len());
    let read = |(i, path): (usize, &PathBuf)| {
        check_cancelled(cores)?;
        let developed = develop(path, settings, folder);
        // An interruption ends the converter of raw files as well, which is no fault of the photograph.
        if developed.is_err() {
            check_cancelled(cores)?;
        }
        let photo = developed?;
        if let Some(name) = name(i) {
            let bytes = bytemuck::cast_slice(&photo.codes);
            let extent = photo.camera.extent();
            write_png(&folder.join(name), extent, bytes, ExtendedColorType::Rgb16)?;
        }
        bar.inc(1);
        let levels = PhotographLevels::of(&photo);
        Ok((photo.camera, photo.kind, levels, photo.thumbnail))
    };
    // Each thread holds a whole photograph.
    let threads = rayon::current_num_threads().min(MAX_READERS);
    let photos = paths.par_iter().enumerate().map(read);
    let photos = thread_pool(threads)?.install(|| photos.collect::<Result<Vec<_>>>())?;
    let (camera, kind, ..) = photos.first().context("--photos names no photograph")?;
    let (camera, kind) = (camera.clone(), *kind);
    let extent = camera.extent();
    if let Some(i) = photos.iter().position(|photo| photo.0.extent() != extent) {
        bail!(
            "{}: has {} pixels, but {} has {extent}; photographs of one capture have one size",
            paths[i].display(),
            photos[i].0.extent(),
            paths[0].display()
        );
    }
    if let Some(i) = photos.iter().position(|photo| photo.1 != kind) {
        bail!(
            "{}: has {}, but {} has {kind}; export all photographs alike",
            paths[i].display(),
            photos[i].1,
            paths[0].display()
        );
    }
    let parts = photos
        .into_iter()
        .map(|(_, _, levels, thumbnail)| (levels, thumbnail));
    let (levels, thumbnails) = parts.unzip();
    Ok(DevelopedSession {
        camera,
        levels,
        thumbnails,
    })
}
