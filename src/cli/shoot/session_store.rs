//! What a session has so far, on disk, so that it goes on after any interruption.
//!
//! `originals/` has the photographs as the camera wrote them. A folder for work has the developed ones and one record for each,
//! which is written last: a photograph without its record does not count.

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use image::ExtendedColorType;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use tempfile::TempDir;

use crate::acquisition::{PatternSequence, PictureRole, SequenceBrightness};
use crate::capture::{MANIFEST_NAME, ManifestCamera};
use crate::cli::assemble::{
    DevelopSettings, DevelopedPhotograph, FOLDERS, PhotographLevels, SampleKind, Session,
    ensure_new,
};
use crate::cli::capture_writer::write_png;
use crate::cli::file_hash::sha256;

/// Folder of the photographs as the camera wrote them.
const ORIGINALS: &str = "originals";
/// Folder for work, removed in the end.
const WORK: &str = ".shoot";
/// Its settings.
const SETTINGS: &str = "settings.json";
/// The times of all photographs, which stay.
pub const LOG_NAME: &str = "shooting.json";

/// What all photographs of a session have in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SessionSettings {
    /// How photographs become linear.
    pub develop: DevelopSettings,
    /// SHA-256 of the sequence.
    pub sequence_sha256: String,
    /// The camera's name of the exposure time, where it can be set.
    pub exposure: Option<String>,
    /// Brightness of the brightest part of the flood, as a share of white, when the exposure was chosen.
    pub flood_brightness: f64,
    /// Whether the operator has accepted that the flood is saturated.
    pub is_saturation_accepted: bool,
    /// Time between a picture and its photograph that was found.
    #[serde(default)]
    pub settle_seconds: f32,
}

/// A photograph that was accepted.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PhotographRecord {
    /// The photograph as the camera wrote it, relative to the session's folder.
    pub original: String,
    /// Size and levels of the developed photograph.
    pub camera: ManifestCamera,
    /// The samples of the file.
    pub kind: SampleKind,
    pub levels: PhotographLevels,
    /// Mean measurement of each part of the picture.
    pub thumbnail: Vec<f64>,
    pub sharpness: f64,
    /// When it was taken: RFC 3339, UTC.
    pub taken: String,
    /// Photographs until it was accepted.
    pub attempts: u32,
    /// Faults of the others, or remarks on this one.
    pub remarks: Vec<String>,
}

/// A session on disk.
pub struct SessionStore {
    folder: PathBuf,
    pub sequence: PatternSequence,
    records: Vec<Option<PhotographRecord>>,
    /// Of this process alone.
    _lock: SessionLock,
}

/// One photograph in the log of a session.
#[derive(Serialize)]
struct LoggedPhotograph<'a> {
    picture: &'a str,
    photo: &'a str,
    original: &'a str,
    taken: &'a str,
    attempts: u32,
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    remarks: &'a [String],
}

#[derive(Serialize)]
struct SessionLog<'a> {
    version: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    exposure: Option<&'a str>,
    /// Between a picture and its photograph, at least.
    settle_seconds: f32,
    photographs: Vec<LoggedPhotograph<'a>>,
}

impl SessionStore {
    /// Opens or begins the session of `sequence` in `folder`.
    ///
    /// # Errors
    /// If files cannot be read or written.
    pub fn open(folder: &Path, sequence: PatternSequence) -> Result<Self> {
        let work = folder.join(WORK);
        ensure!(
            !folder.join(LOG_NAME).exists() || !folder.join(MANIFEST_NAME).exists(),
            "{}: all photographs of this session are taken: `ltm-export check` and `recover` take this folder. To photograph the object \
             again, write pictures into a new folder; to use some of these photographs, give originals/ to `ltm-export assemble`",
            folder.display()
        );
        create(&work)?;
        let lock = lock(&work)?;
        undo_move(folder, &work)?;
        ensure_new(folder)?;
        for name in FOLDERS.into_iter().chain(["records"]) {
            create(&work.join(name))?;
        }
        create(&folder.join(ORIGINALS))?;
        let mut store = Self {
            folder: folder.to_owned(),
            records: Vec::new(),
            sequence,
            _lock: lock,
        };
        let pictures = 0..store.sequence.pictures.len();
        store.records = pictures.map(|i| store.read(i)).collect::<Result<_>>()?;
        Ok(store)
    }

    /// The record of picture `i`, if its photograph is there as well.
    fn read(&self, i: usize) -> Result<Option<PhotographRecord>> {
        let record: Option<PhotographRecord> = read_json(&self.record_path(i))?;
        let photo = self.work().join(&self.sequence.pictures[i].photo);
        Ok(record.filter(|record| photo.is_file() && self.folder.join(&record.original).is_file()))
    }

    /// SHA-256 of the sequence: photographs are of its pictures.
    ///
    /// # Errors
    /// If it cannot be written as JSON.
    pub fn sequence_sha256(&self) -> Result<String> {
        Ok(sha256(serde_json::to_string(&self.sequence)?.as_bytes()))
    }

    /// Folder for work: a capture folder of what there is, once [`write_manifest`](Self::write_manifest) has written its
    /// manifest.
    pub fn work(&self) -> PathBuf {
        self.folder.join(WORK)
    }

    pub fn settings(&self) -> Result<Option<SessionSettings>> {
        read_json(&self.work().join(SETTINGS))
    }

    pub fn write_settings(&self, settings: &SessionSettings) -> Result<()> {
        write_json(&self.work().join(SETTINGS), settings)
    }

    pub fn records(&self) -> &[Option<PhotographRecord>] {
        &self.records
    }

    /// The first picture with a role, and its photograph, if there is one.
    pub fn taken(&self, role: &PictureRole) -> Option<(usize, &PhotographRecord)> {
        let i = self.sequence.position(role)?;
        Some((i, self.records[i].as_ref()?))
    }

    /// Indices of pictures without a photograph.
    pub fn missing(&self) -> Vec<usize> {
        let is_missing = |i: &usize| self.records[*i].is_none();
        (0..self.records.len()).filter(is_missing).collect()
    }

    /// An empty folder that a camera writes into; removed in the end.
    ///
    /// # Errors
    /// If it cannot be created.
    pub fn incoming(&self) -> Result<TempDir> {
        let work = self.work();
        // Of one photograph alone: a camera's program that was ended may still write.
        TempDir::with_prefix_in("incoming-", &work).with_context(|| work.display().to_string())
    }

    /// Keeps the photograph `developed` of picture `i`, whose original is at `path`: `record` lacks the name of that.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn add(
        &mut self,
        i: usize,
        path: &Path,
        developed: &DevelopedPhotograph,
        mut record: PhotographRecord,
    ) -> Result<()> {
        let picture = Path::new(&self.sequence.pictures[i].picture);
        let stem = picture.file_stem().unwrap_or_default().to_string_lossy();
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        record.original = format!("{ORIGINALS}/{stem}.{extension}");
        let original = self.folder.join(&record.original);
        copy(path, &original).with_context(|| original.display().to_string())?;
        let bytes = bytemuck::cast_slice(&developed.codes);
        let photo = self.work().join(&self.sequence.pictures[i].photo);
        let extent = developed.camera.extent();
        write_png(&photo, extent, bytes, ExtendedColorType::Rgb16)?;
        // On disk before its record, whatever happens to the machine.
        let synced = File::open(&photo).and_then(|file| file.sync_all());
        synced.with_context(|| photo.display().to_string())?;
        write_json(&self.record_path(i), &record)?;
        self.records[i] = Some(record);
        Ok(())
    }

    /// Forgets the photograph of picture `i`, which is taken again.
    pub fn remove(&mut self, i: usize) -> Result<()> {
        let path = self.record_path(i);
        if self.records[i].take().is_some() {
            fs::remove_file(&path).with_context(|| path.display().to_string())?;
        }
        Ok(())
    }

    /// Writes the manifest of the capture folder that photographs make, those still missing included.
    pub fn write_manifest(&self) -> Result<()> {
        let camera = self.records.iter().flatten().next();
        let camera = camera.context("there are no photographs")?.camera.clone();
        let manifest = self.sequence.manifest(camera, None);
        write_json(&self.work().join(MANIFEST_NAME), &manifest)
    }

    /// The complete session; `None` while photographs are missing.
    pub fn session(&self) -> Option<Session> {
        let records: Vec<&PhotographRecord> = self
            .records
            .iter()
            .map(Option::as_ref)
            .collect::<Option<_>>()?;
        let originals = records
            .iter()
            .map(|record| self.folder.join(&record.original));
        Some(Session {
            sequence: self.sequence.clone(),
            paths: originals.collect(),
            camera: records.first()?.camera.clone(),
            developed: self.work(),
            brightness: SequenceBrightness {
                thumbnails: records
                    .iter()
                    .map(|record| record.thumbnail.clone())
                    .collect(),
            },
            levels: records.iter().map(|record| record.levels).collect(),
        })
    }

    /// Writes the times of all photographs.
    pub fn write_log(&self, settings: &SessionSettings) -> Result<()> {
        let pictures = self.sequence.pictures.iter().zip(&self.records);
        let photographs = pictures.filter_map(|(picture, record)| {
            let record = record.as_ref()?;
            Some(LoggedPhotograph {
                picture: &picture.picture,
                photo: &picture.photo,
                original: &record.original,
                taken: &record.taken,
                attempts: record.attempts,
                remarks: &record.remarks,
            })
        });
        let log = SessionLog {
            version: 1,
            exposure: settings.exposure.as_deref(),
            settle_seconds: settings.settle_seconds,
            photographs: photographs.collect(),
        };
        write_json(&self.folder.join(LOG_NAME), &log)
    }

    /// Removes the folder for work.
    pub fn clear(self) -> Result<()> {
        let work = self.work();
        fs::remove_dir_all(&work).with_context(|| work.display().to_string())
    }

    fn record_path(&self, i: usize) -> PathBuf {
        self.work().join(format!("records/{i:04}.json"))
    }
}

/// A locked file. It is unlocked explicitly, as a program that is just being started may still have the file open.
struct SessionLock(File);

impl Drop for SessionLock {
    fn drop(&mut self) {
        // Closing the file unlocks it as well.
        let _ = self.0.unlock();
    }
}

/// Two programs in one folder would take each other's photographs.
fn lock(work: &Path) -> Result<SessionLock> {
    let path = work.join("lock");
    let lock = || -> Result<SessionLock> {
        let file = File::create(&path)?;
        match file.try_lock() {
            Ok(()) => Ok(SessionLock(file)),
            Err(TryLockError::WouldBlock) => {
                bail!("another `ltm-export shoot` photographs this session; end it first")
            }
            Err(TryLockError::Error(error)) => Err(error.into()),
        }
    };
    lock().with_context(|| path.display().to_string())
}

/// Takes photographs back that were moved to their place without the manifest, which comes last.
fn undo_move(folder: &Path, work: &Path) -> Result<()> {
    if folder.join(MANIFEST_NAME).exists() || !work.join("records").is_dir() {
        return Ok(());
    }
    for name in FOLDERS {
        let (moved, own) = (folder.join(name), work.join(name));
        if moved.is_dir() && !own.exists() {
            fs::rename(&moved, &own).with_context(|| moved.display().to_string())?;
        }
    }
    Ok(())
}

/// Copies a file, complete or not at all. Folders may be of different devices.
fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    let temporary = to.with_extension("part");
    fs::copy(from, &temporary)?;
    fs::rename(&temporary, to)
}

fn create(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())
}

/// `None` if there is no such file.
fn read_json<T: DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    let json = match fs::read_to_string(path) {
        Ok(json) => json,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error).with_context(|| path.display().to_string()),
    };
    match serde_json::from_str(&json) {
        Ok(value) => Ok(Some(value)),
        Err(error) => bail!(
            "{}: is damaged ({error}); delete it, and what it describes is done again",
            path.display()
        ),
    }
}

/// Complete or not at all.
fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let write = || -> Result<()> {
        let json = serde_json::to_string_pretty(value)?;
        let temporary = path.with_extension("new");
        fs::write(&temporary, json + "\n")?;
        Ok(fs::rename(&temporary, path)?)
    };
    write().with_context(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acquisition::{DisplayLayout, SequenceSettings};
    use crate::simulate::PatternEnsemble;
    use crate::transport::Extent;

    fn sequence() -> PatternSequence {
        let light = Extent::new(4, 4);
        let settings = SequenceSettings {
            layout: DisplayLayout::new(light, light, None).unwrap(),
            patterns: 1,
            ensemble: PatternEnsemble::Bernoulli,
            seed: 1,
        };
        PatternSequence::draw(&settings).0
    }

    /// Keeps a photograph of picture `i`.
    fn add(store: &mut SessionStore, i: usize) {
        let camera = ManifestCamera {
            width: 2,
            height: 1,
            white: 65_535.0,
            ..ManifestCamera::default()
        };
        let developed = DevelopedPhotograph {
            camera: camera.clone(),
            codes: vec![[1, 2, 3]; 2],
            thumbnail: vec![0.1, 0.2],
            saturated_share: 0.0,
            clipped_share: 0.0,
            pile: None,
            kind: SampleKind::Integer,
        };
        let incoming = store.incoming().unwrap();
        let path = incoming.path().join("photograph.png");
        fs::write(&path, "as the camera wrote it").unwrap();
        let record = PhotographRecord {
            original: String::new(),
            camera,
            kind: SampleKind::Integer,
            levels: PhotographLevels::of(&developed),
            thumbnail: developed.thumbnail.clone(),
            sharpness: 0.5,
            taken: "2026-01-01T00:00:00Z".to_owned(),
            attempts: 1,
            remarks: Vec::new(),
        };
        store.add(i, &path, &developed, record).unwrap();
    }

    #[test]
    fn photographs_count_with_their_records_and_files() {
        let folder = TempDir::new().unwrap();
        let open = || SessionStore::open(folder.path(), sequence()).unwrap();
        let mut store = open();
        add(&mut store, 0);
        add(&mut store, 1);
        let original = folder.path().join("originals/0001-flood.png");
        assert_eq!(
            fs::read_to_string(&original).unwrap(),
            "as the camera wrote it"
        );
        let missing = store.missing().len();
        drop(store);
        let store = open();
        assert_eq!(store.missing().len(), missing);
        assert!(store.session().is_none());
        fs::remove_file(store.work().join("photos/dark.png")).unwrap();
        drop(store);
        fs::remove_file(&original).unwrap();
        let store = open();
        assert_eq!(store.missing()[..2], [0, 1]);
        assert_eq!(store.missing().len(), missing + 2);
    }

    #[test]
    fn one_program_at_a_time_photographs_a_session() {
        let folder = TempDir::new().unwrap();
        let store = SessionStore::open(folder.path(), sequence()).unwrap();
        let second = SessionStore::open(folder.path(), sequence());
        let error = second.err().map(|error| format!("{error:#}")).unwrap();
        assert!(error.contains("another `ltm-export shoot`"), "{error}");
        drop(store);
        SessionStore::open(folder.path(), sequence()).unwrap();
    }

    #[test]
    fn photographs_that_were_moved_without_the_manifest_come_back() {
        let folder = TempDir::new().unwrap();
        let open = || SessionStore::open(folder.path(), sequence());
        let mut store = open().unwrap();
        add(&mut store, 0);
        let moved = folder.path().join("photos");
        fs::rename(store.work().join("photos"), &moved).unwrap();
        drop(store);
        let store = open().unwrap();
        assert!(store.records()[0].is_some() && !moved.exists());
        drop(store);
        // A folder of the user's is another thing.
        fs::create_dir(&moved).unwrap();
        fs::write(moved.join("mine.png"), "").unwrap();
        let error = open().err().map(|error| format!("{error:#}")).unwrap();
        assert!(error.contains("is there already"), "{error}");
    }

    #[test]
    fn damaged_records_are_named() {
        let folder = TempDir::new().unwrap();
        let store = SessionStore::open(folder.path(), sequence()).unwrap();
        fs::write(store.record_path(3), "{").unwrap();
        drop(store);
        let error = SessionStore::open(folder.path(), sequence());
        let error = error.err().map(|error| format!("{error:#}")).unwrap();
        assert!(error.contains("0003.json: is damaged"), "{error}");
    }
}
