//! Developed photographs of a sequence: whether they show their pictures, what they say of exposure and display, and the
//! capture folder that they make.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use super::color_matrix::session_color_matrix;
use super::develop_all::develop_all;
use super::fit_gray_code;
use super::level_warnings::{PhotographLevels, warn_of_clipping};
use super::line_sharpness::note_line_sharpness;
use super::photograph_file::DevelopSettings;
use crate::acquisition::{PairingFault, PatternSequence, PictureRole, SequenceBrightness};
use crate::capture::{MANIFEST_NAME, Manifest, ManifestCamera};
use crate::cli::advice::error_with_remedy;
use crate::cli::process_resources::InterruptibleCores;
use crate::transport::CHANNELS;

/// Folders that photographs are written into.
pub const FOLDERS: [&str; 2] = ["photos", "graycode"];
/// Most faults that are listed.
const MAX_LISTED: usize = 5;
/// Brightness of the brightest part of the flood photograph, relative to white, below which noise is needlessly high.
const MIN_FLOOD: f64 = 0.3;
/// Change of the reference photographs' brightness that is worth a note.
const MIN_DRIFT: f64 = 0.005;
/// Brightness relative to the flood's, at most, of parts of the picture that do not count for the display's response.
const MIN_RAMP_BRIGHTNESS: f64 = 0.2;

/// Developed photographs.
pub struct Session {
    pub sequence: PatternSequence,
    /// The photographs as the camera wrote them, one for each picture unless they do not fit.
    pub paths: Vec<PathBuf>,
    /// Size and levels of the developed photographs.
    pub camera: ManifestCamera,
    /// Folder of the developed photographs, on the file system of the capture folder.
    pub developed: PathBuf,
    pub brightness: SequenceBrightness,
    /// One for each photograph.
    pub levels: Vec<PhotographLevels>,
}

impl Session {
    /// Develops photographs into the empty folder `developed`.
    pub fn develop(
        developed: &Path,
        sequence: PatternSequence,
        paths: Vec<PathBuf>,
        settings: &DevelopSettings,
    ) -> Result<Self> {
        for folder in FOLDERS {
            std::fs::create_dir(developed.join(folder)).context(folder)?;
        }
        let cores = InterruptibleCores::listen()?;
        let name = |i: usize| {
            // A photograph too many has no name.
            let picture = sequence.pictures.get(i)?;
            Some(picture.photo.clone())
        };
        let photos = develop_all(&paths, settings, developed, name, &cores)?;
        Ok(Self {
            sequence,
            paths,
            camera: photos.camera,
            developed: developed.to_owned(),
            levels: photos.levels,
            brightness: SequenceBrightness {
                thumbnails: photos.thumbnails,
            },
        })
    }

    /// Makes `folder` a capture folder, with warnings and notes of all photographs together.
    pub fn complete(&self, folder: &Path) -> Result<()> {
        self.note_exposure();
        let paths = self.paths.iter().map(PathBuf::as_path);
        warn_of_clipping(self.levels.iter().zip(paths));
        note_line_sharpness(self);
        let response = self.display_response();
        let camera = ManifestCamera {
            color_matrix: session_color_matrix(self),
            ..self.camera.clone()
        };
        let manifest = self.sequence.manifest(camera, response);
        self.move_into_place(folder, &manifest)?;
        let summary = format!(
            "{}: {} shots of {} pixels",
            folder.display(),
            manifest.shots.len(),
            self.camera.extent()
        );
        match fit_gray_code(folder) {
            Ok(_) => eprintln!("{summary}; `ltm-export recover` takes this folder"),
            Err(error) => {
                eprintln!("warning: {}", error_with_remedy(&error));
                eprintln!(
                    "{summary}; it cannot be recovered without \"correspondence\". Are --black, --white, --bin, --crop and --undistort right?"
                );
            }
        }
        Ok(())
    }

    /// The faults that `force` allows.
    ///
    /// # Errors
    /// If the number of photographs is not that of the pictures, and of faults without `force`.
    pub fn check_pairing(&self, force: bool) -> Result<Vec<String>> {
        let (photos, pictures) = (self.paths.len(), self.sequence.pictures.len());
        if photos != pictures {
            bail!(wrong_count(photos, pictures, &self.gap_text()));
        }
        let faults = self.brightness.faults(&self.sequence);
        let texts: Vec<String> = faults
            .iter()
            .map(|&(i, fault)| self.fault_text(i, fault))
            .collect();
        if texts.is_empty() || force {
            return Ok(texts);
        }
        let mut message = texts[..texts.len().min(MAX_LISTED)].join("; ");
        if texts.len() > MAX_LISTED {
            message += &format!("; and {} more", texts.len() - MAX_LISTED);
        }
        bail!(
            "{message}. Are the photographs linear (see --response), neither too dark nor saturated, and in the order of the \
             pictures? A camera that counts from 9999 to 0001 needs its photographs listed in order. --force writes the capture \
             nevertheless"
        )
    }

    /// Where a photograph is missing, or which may be too many.
    fn gap_text(&self) -> String {
        let Some(gap) = self.brightness.gap(&self.sequence) else {
            return String::new();
        };
        let (first, last) = (*gap.start(), *gap.end());
        if self.paths.len() > self.sequence.pictures.len() {
            return format!(
                ": one is too many, {}",
                range(&self.path(first), &self.path(last))
            );
        }
        let pictures = range(&self.picture(first), &self.picture(last));
        let before = first
            .checked_sub(1)
            .map(|i| format!("after {}", self.path(i)));
        let after = (last < self.paths.len()).then(|| format!("before {}", self.path(last)));
        let place: Vec<String> = before.into_iter().chain(after).collect();
        format!(": one is missing, of {pictures}, {}", place.join(" and "))
    }

    fn fault_text(&self, i: usize, fault: PairingFault) -> String {
        fault_text(&self.path(i), &self.picture(i), fault)
    }

    fn path(&self, photo: usize) -> String {
        self.paths[photo].display().to_string()
    }

    fn picture(&self, i: usize) -> String {
        self.sequence.pictures[i].picture.clone()
    }

    /// The first photograph of a role, by its number.
    pub fn photo_of(&self, role: &PictureRole) -> Option<usize> {
        self.sequence.position(role)
    }

    /// The last photograph of a role, by its number.
    pub fn last_photo_of(&self, role: &PictureRole) -> Option<usize> {
        let mut pictures = self.sequence.pictures.iter();
        pictures.rposition(|picture| picture.role == *role)
    }

    /// The codes of a developed photograph, `[N]`.
    pub fn developed_codes(&self, photo: usize) -> Result<Vec<[u16; CHANNELS]>> {
        let path = self.developed.join(&self.sequence.pictures[photo].photo);
        let picture = image::open(&path).with_context(|| path.display().to_string())?;
        Ok(picture.into_rgb16().pixels().map(|pixel| pixel.0).collect())
    }

    /// Photographs of a role, by their numbers.
    fn photos_of(&self, is_of_role: impl Fn(&PictureRole) -> bool) -> Vec<usize> {
        let pictures = self.sequence.pictures.iter().enumerate();
        let found = pictures.filter(|(_, picture)| is_of_role(&picture.role));
        found.map(|(i, _)| i).collect()
    }

    /// Notes exposures that cost accuracy, and a lamp that drifts.
    fn note_exposure(&self) {
        let thumbnail = |i: &usize| &self.brightness.thumbnails[*i];
        let mean = |i: &usize| thumbnail(i).iter().sum::<f64>() / thumbnail(i).len() as f64;
        let floods = self.photos_of(|role| *role == PictureRole::Flood);
        let dark: f64 = self
            .photos_of(|role| *role == PictureRole::Dark)
            .iter()
            .map(mean)
            .sum();
        for flood in &floods {
            let brightest = thumbnail(flood).iter().copied().fold(0.0, f64::max);
            let levels = &self.levels[*flood];
            levels.warn_of_flood(&self.paths[*flood]);
            if !levels.is_saturated() && brightest < MIN_FLOOD {
                eprintln!(
                    "note: the brightest part of {} is at {:.0} % of white; more exposure would lower the noise",
                    self.path(*flood),
                    100.0 * brightest
                );
            }
            let references = self.photos_of(|role| *role == PictureRole::Reference);
            let white = mean(flood) - dark;
            let changes = references.iter().map(|i| (mean(i) - dark) / white - 1.0);
            let drift = changes.fold(0.0, |most: f64, change| {
                if change.abs() > most.abs() {
                    change
                } else {
                    most
                }
            });
            if drift.abs() > MIN_DRIFT {
                eprintln!(
                    "note: the flood's brightness changed by {:+.1} % in the session; `recover` corrects the exposures",
                    100.0 * drift
                );
            }
        }
    }

    /// Pairs of code and emission that the ramp shows; `None` if they do not rise.
    pub fn display_response(&self) -> Option<Vec<[f64; 2]>> {
        let thumbnail = |i: usize| &self.brightness.thumbnails[i];
        let [dark, flood] =
            [PictureRole::Dark, PictureRole::Flood].map(|role| self.photo_of(&role));
        let (dark, flood) = (thumbnail(dark?), thumbnail(flood?));
        let brightest = flood.iter().copied().fold(0.0, f64::max);
        let parts = (0..flood.len()).filter(|&n| flood[n] > MIN_RAMP_BRIGHTNESS * brightest);
        let light = |thumbnail: &[f64]| parts.clone().map(|n| thumbnail[n] - dark[n]).sum::<f64>();
        let white = light(flood);
        let mut response = vec![[0.0, 0.0]];
        for (i, picture) in self.sequence.pictures.iter().enumerate() {
            if let PictureRole::Ramp { code } = picture.role {
                let emission = (light(thumbnail(i)) / white * 1e5).round() / 1e5;
                response.push([f64::from(code), emission.max(0.0)]);
            }
        }
        response.push([f64::from(u8::MAX), 1.0]);
        let is_rising = response
            .windows(2)
            .all(|pair| pair[0][0] < pair[1][0] && pair[0][1] <= pair[1][1]);
        (is_rising && response.len() > 2).then_some(response)
    }

    /// Moves the photographs into `folder`, and then `manifest`, without which it is no capture folder.
    fn move_into_place(&self, folder: &Path, manifest: &Manifest) -> Result<()> {
        let json = serde_json::to_string_pretty(manifest)?;
        let developed = &self.developed;
        std::fs::write(developed.join(MANIFEST_NAME), json + "\n").context(MANIFEST_NAME)?;
        for name in FOLDERS.into_iter().chain([MANIFEST_NAME]) {
            let target = folder.join(name);
            if target.is_dir() {
                std::fs::remove_dir(&target).with_context(|| target.display().to_string())?; // it is empty
            }
            let moved = std::fs::rename(developed.join(name), &target);
            moved.with_context(|| target.display().to_string())?;
        }
        Ok(())
    }
}

/// Says that the photograph at `path` does not show `picture`.
pub fn fault_text(path: &str, picture: &str, fault: PairingFault) -> String {
    match fault {
        PairingFault::NotDark => format!("{path} is not dark, as {picture} is"),
        PairingFault::NotLit(relative) => format!(
            "{path} is {relative:.2} times as bright as the flood photograph, and should be equally bright, as {picture} is"
        ),
        PairingFault::TooBright(relative) => format!(
            "{path} is {relative:.2} times as bright as the flood photograph, and should be darker, as {picture} is"
        ),
        PairingFault::NotRising => {
            format!("{path} is not between its neighbours in brightness, as {picture} is")
        }
        PairingFault::NotInverse(deviation) => format!(
            "{path} is not the inverse of the photograph before, as {picture} is: their sum differs from the flood \
                 photograph by {:.0} %",
            (100.0 * deviation).min(999.0)
        ),
    }
}

/// The message of a wrong number of photographs, with the `place` where one is missing or too many.
pub fn wrong_count(photos: usize, pictures: usize, place: &str) -> String {
    format!(
        "there are {photos} photographs of {pictures} pictures{place}. Give one photograph for each picture of display/, in order"
    )
}

/// For instance "a", or "a to b".
fn range(first: &str, last: &str) -> String {
    match first == last {
        true => first.to_owned(),
        false => format!("{first} to {last}"),
    }
}
