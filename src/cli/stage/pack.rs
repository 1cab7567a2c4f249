//! A complete pack, from which items are read.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Error, Result};

use super::pack_file::{ItemPlace, PackContent, PackFault, PackKey};
use super::stage_folder::StageFileProblem;
use crate::cli::output_file::InputError;
use crate::cli::records::read_content;
use crate::cli::recover::tile_recovery::TileCounts;
use crate::format::EncodedTileHead;

/// A complete pack.
pub struct Pack {
    path: PathBuf,
    first: u32,
    /// `[item]`.
    places: Vec<ItemPlace>,
    /// `[item]`, of encoded tiles.
    heads: Vec<EncodedTileHead>,
    counts: TileCounts,
    file: Mutex<File>,
}

impl Pack {
    /// Opens the pack at `path`, which must have this key; `remedy` is the command that writes it.
    ///
    /// # Errors
    /// [`StageFileError`](super::StageFileError) if it is missing, incomplete or of something else.
    pub fn open(path: &Path, key: &PackKey, remedy: &str) -> Result<Self> {
        let remedy = remedy.to_owned();
        let file = match File::open(path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => {
                return Err(StageFileProblem::Missing(remedy).of(path).into());
            }
            file => file.with_context(|| path.display().to_string())?,
        };
        let content = PackContent::read(&file, key).with_context(|| path.display().to_string())?;
        let problem = match content {
            Ok(PackContent {
                places,
                heads,
                counts: Some(counts),
            }) => {
                return Ok(Self {
                    path: path.to_owned(),
                    first: key.items.start,
                    places: places.into_iter().flatten().collect(),
                    heads,
                    counts,
                    file: Mutex::new(file),
                });
            }
            Ok(_) | Err(PackFault::Damaged) => StageFileProblem::Damaged(remedy),
            Err(PackFault::Foreign) => StageFileProblem::Foreign {
                made_from: "learned.bin and shard",
                remedy,
            },
        };
        Err(problem.of(path).into())
    }

    /// The bytes of the item with this number, if it is in the pack.
    pub fn item(&self, number: usize) -> Option<io::Result<Vec<u8>>> {
        let item = self.index(number)?;
        Some(self.read(&self.places[item]))
    }

    /// The head of the encoded tile with this number, and where its chunks begin.
    pub fn chunks(&self, number: usize) -> Option<(&EncodedTileHead, u64)> {
        let item = self.index(number)?;
        Some((self.heads.get(item)?, self.places[item].start))
    }

    /// Index in the pack of the item with this number.
    fn index(&self, number: usize) -> Option<usize> {
        let item = number.checked_sub(self.first as usize)?;
        (item < self.places.len()).then_some(item)
    }

    /// The counts of its tiles.
    pub fn counts(&self) -> TileCounts {
        self.counts
    }

    /// The heads of its encoded tiles.
    pub fn heads(&self) -> &[EncodedTileHead] {
        &self.heads
    }

    /// The number of its first item.
    pub fn first(&self) -> usize {
        self.first as usize
    }

    /// The bytes at a place.
    pub fn read(&self, place: &ItemPlace) -> io::Result<Vec<u8>> {
        let file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        read_content(&file, place).map_err(|error| self.input_error(error))
    }

    /// The error of a file that cannot be read, with its path.
    pub fn input_error(&self, error: io::Error) -> io::Error {
        let error = Error::new(error).context(self.path.display().to_string());
        io::Error::other(InputError(error))
    }
}
