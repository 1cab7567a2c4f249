//! Takes the photographs of a session, one after the other, and those again that are wrong.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{Result, bail};
use indicatif::ProgressBar;
use tempfile::TempDir;

use super::camera::{CameraError, CameraSource, Exposure, PhotographRequest};
use super::photograph_check::{GrayCodeError, PhotographCheck, Verdict};
use super::player_server::{PlayerServer, PlayerState, ShownPicture};
use super::session_store::{PhotographRecord, SessionSettings, SessionStore};
use crate::acquisition::{PhotographStatistics, PictureRole};
use crate::cli::assemble::{
    DevelopSettings, DevelopedPhotograph, PhotographLevels, check_cancelled, develop,
};
use crate::cli::process_resources::InterruptibleCores;
use crate::job_executor::Executor;

/// Photographs between two lines that say how many there are, where no bar is shown.
const PROGRESS_INTERVAL: usize = 10;
/// Time between two looks at what the page has said.
const POLL_INTERVAL: Duration = Duration::from_millis(10);
/// Without the picture on the display for this long, the user is told what to do.
const REMINDER: Duration = Duration::from_secs(5);

/// How photographs are taken.
pub struct ShootingSettings {
    pub camera: CameraSource,
    /// Extension of `{file}`.
    pub extension: String,
    /// Between a picture and its photograph, at least.
    pub settle: Duration,
    /// For one photograph.
    pub timeout: Duration,
    /// Photographs of a picture, at most.
    pub attempts: u32,
    /// Keep a photograph that still has faults then.
    pub force: bool,
    pub develop: DevelopSettings,
}

/// A photograph that was just taken.
pub(super) struct Taken {
    path: PathBuf,
    /// What the camera wrote into, removed in the end.
    _incoming: TempDir,
    at: SystemTime,
    pub(super) developed: DevelopedPhotograph,
    pub(super) statistics: PhotographStatistics,
}

/// Photographs of a picture so far.
#[derive(Clone, Debug, Default)]
struct PictureProgress {
    attempts: u32,
    remarks: Vec<String>,
}

/// Whether the Gray code is decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum GrayCodeDecoding {
    /// Not yet.
    Due,
    /// It could not be, so that its photographs were taken again.
    Repeated,
    /// It is, or is not needed.
    Done,
}

/// A photograph that may succeed the next time.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct FailedAttempt(String);

pub struct Photographer<'a> {
    pub settings: &'a ShootingSettings,
    pub server: &'a PlayerServer,
    pub cores: &'a InterruptibleCores,
    pub folder: PathBuf,
    pub bar: ProgressBar,
    /// The camera's exposure time.
    pub exposure: Option<Exposure>,
    /// Between a picture and its photograph.
    pub settle: Duration,
    /// Photographs so far.
    pub photographs: u64,
}

impl Photographer<'_> {
    /// Takes all photographs that `store` lacks.
    ///
    /// # Errors
    /// If a photograph is still wrong after all attempts, or the session is interrupted; it goes on from there later.
    pub fn run(&mut self, store: &mut SessionStore, settings: &SessionSettings) -> Result<()> {
        let mut check = PhotographCheck::new(store, &self.folder)?;
        let count = store.sequence.pictures.len();
        let mut progress = vec![PictureProgress::default(); count];
        let mut queue = VecDeque::from(store.missing());
        let mut decoding = GrayCodeDecoding::Due;
        self.bar.set_position((count - queue.len()) as u64);
        while let Some(i) = queue.pop_front() {
            if is_pattern(store, i) && decoding != GrayCodeDecoding::Done {
                let failed = self.decode(&mut check, store, &mut decoding)?;
                if failed {
                    queue.push_front(i);
                    forget_gray_code(store)?;
                    let missing = store.missing().into_iter();
                    let again = missing.filter(|picture| !queue.contains(picture));
                    let again: Vec<usize> = again.collect();
                    again
                        .into_iter()
                        .rev()
                        .for_each(|picture| queue.push_front(picture));
                    continue;
                }
            }
            let own = &mut progress[i];
            own.attempts += 1;
            let attempts = own.attempts;
            let (taken, verdict) = self.take_and_check(&check, store, settings, i, attempts)?;
            for remark in &verdict.remarks {
                self.say(&format!("note: {remark}"));
            }
            own.remarks.extend(verdict.remarks);
            let is_last = attempts >= self.settings.attempts;
            let texts: Vec<&str> = verdict.faults.iter().map(|fault| &fault.text[..]).collect();
            let text = texts.join("; ");
            if let Some(taken) = taken
                && (text.is_empty() || (is_last && self.settings.force))
            {
                if !text.is_empty() {
                    self.say(&format!("warning: {text}; kept"));
                    own.remarks.push(text);
                }
                let record = record(&taken, attempts, std::mem::take(&mut own.remarks));
                store.add(i, &taken.path, &taken.developed, record)?;
                self.bar.inc(1);
                let taken = count - queue.len();
                if self.bar.is_hidden() && taken.is_multiple_of(PROGRESS_INTERVAL) {
                    eprintln!("{taken} of {count} photographs");
                }
                continue;
            }
            own.remarks.push(text.clone());
            queue.push_front(i);
            // The other one may be wrong, if this one is so again.
            let suspects = verdict.faults.iter().filter_map(|fault| fault.suspect);
            let suspects = suspects.filter(|_| is_last || attempts > 1);
            for suspect in suspects
                .filter(|suspect| store.records()[*suspect].is_some())
                .collect::<Vec<_>>()
            {
                store.remove(suspect)?;
                self.bar.set_position(self.bar.position().saturating_sub(1));
                queue.push_front(suspect);
                progress[suspect] = PictureProgress::default();
            }
            let name = &store.sequence.pictures[i].picture;
            if is_last {
                bail!(
                    "{name}: {text} (photographed {attempts} times). When this is mended, run the same command again: it goes on with this \
                     picture"
                );
            }
            self.say(&format!("{name}: {text}; photographed again"));
        }
        Ok(())
    }

    /// Photographs picture `i`, and checks the photograph. There is none if the attempt failed.
    fn take_and_check(
        &mut self,
        check: &PhotographCheck,
        store: &SessionStore,
        settings: &SessionSettings,
        i: usize,
        attempt: u32,
    ) -> Result<(Option<Taken>, Verdict)> {
        match self.take(store, i, attempt) {
            Ok(taken) => {
                let name = &store.sequence.pictures[i].picture;
                let (photo, statistics) = (&taken.developed, &taken.statistics);
                let verdict = check.examine(store, settings, i, name, photo, statistics)?;
                Ok((Some(taken), verdict))
            }
            Err(error) => match error.downcast::<FailedAttempt>() {
                Ok(FailedAttempt(text)) => Ok((None, Verdict::of_fault(text))),
                Err(error) => Err(error),
            },
        }
    }

    /// Decodes the Gray code before the first pattern. Returns whether its photographs are to be taken again.
    fn decode(
        &self,
        check: &mut PhotographCheck,
        store: &SessionStore,
        decoding: &mut GrayCodeDecoding,
    ) -> Result<bool> {
        let error = match check.decode_gray_code(store) {
            Ok(is_conclusive) => {
                if !is_conclusive {
                    self.say(
                        "note: the object is small in the picture, so that it is not checked whether photographs show their patterns; \
                         `ltm-export check` does so",
                    );
                }
                *decoding = GrayCodeDecoding::Done;
                return Ok(false);
            }
            Err(error) if error.is::<GrayCodeError>() => error,
            Err(error) => return Err(error),
        };
        if self.settings.force {
            self.say(&format!(
                "warning: {error}; patterns are photographed without it"
            ));
            *decoding = GrayCodeDecoding::Done;
            return Ok(false);
        }
        match decoding {
            GrayCodeDecoding::Due => {
                self.say(&format!("{error}; its photographs are taken again"));
                *decoding = GrayCodeDecoding::Repeated;
                Ok(true)
            }
            _ => bail!(
                "{error}. Its photographs were taken twice. Run the same command again when this is mended, with --force to go on without"
            ),
        }
    }

    /// Shows picture `i`, photographs it, and develops the photograph.
    pub(super) fn take(&mut self, store: &SessionStore, i: usize, attempt: u32) -> Result<Taken> {
        let picture = &store.sequence.pictures[i];
        let (path, incoming, at) = loop {
            let before = self.settings.camera.files_before();
            let before = before.map_err(|error| FailedAttempt(error.to_string()))?;
            let shown = self.show(i, &picture.picture)?;
            // A display that was late may be so again.
            self.wait(self.settle * attempt)?;
            let incoming = store.incoming()?;
            let request = PhotographRequest {
                number: i,
                photograph: self.photographs,
                picture: &self.folder.join(&picture.picture),
                exposure: self.exposure.as_ref(),
                incoming: incoming.path(),
                extension: &self.settings.extension,
                timeout: self.settings.timeout,
            };
            if matches!(self.settings.camera, CameraSource::Folder(_)) {
                self.say(&format!(
                    "the display shows {}: release the shutter",
                    picture.picture
                ));
            }
            let is_cancelled = || self.cores.is_cancelled();
            let at = SystemTime::now();
            let path = match self
                .settings
                .camera
                .photograph(&request, &before, &is_cancelled)
            {
                Ok(path) => path,
                Err(CameraError::Cancelled) => {
                    check_cancelled(self.cores)?;
                    bail!("interrupted");
                }
                Err(error) => bail!(FailedAttempt(error.to_string())),
            };
            // Nor was it taken away and shown again.
            if self.server.player() == shown {
                break (path, incoming, at);
            }
            self.say(&format!(
                "{}: the player was closed during the photograph; photographed again",
                picture.picture
            ));
        };
        let developed = develop(&path, &self.settings.develop, &store.work());
        // An interruption ends the converter of raw files as well.
        check_cancelled(self.cores)?;
        let developed = developed.map_err(|error| FailedAttempt(format!("{error:#}")))?;
        let camera = &developed.camera;
        let statistics = PhotographStatistics::new(
            camera.extent(),
            &developed.codes,
            camera.black,
            camera.white,
        );
        self.server.update(|state| {
            state.histogram = statistics
                .histogram
                .iter()
                .map(|bins| bins.to_vec())
                .collect();
        });
        Ok(Taken {
            path,
            _incoming: incoming,
            at,
            developed,
            statistics,
        })
    }

    /// Waits until the display shows picture `i`. Returns what the page says then.
    fn show(&mut self, i: usize, name: &str) -> Result<PlayerState> {
        self.photographs += 1;
        let wanted = ShownPicture {
            picture: i,
            photograph: self.photographs,
        };
        self.server.update(|state| {
            state.show = Some(wanted);
            state.message = format!("Photographing {name}");
        });
        let since = Instant::now();
        let mut is_reminded = false;
        loop {
            let player = self.server.player();
            if player.shown == Some(wanted) {
                return Ok(player);
            }
            check_cancelled(self.cores)?;
            if since.elapsed() > REMINDER && !is_reminded {
                is_reminded = true;
                self.say(&match self.server.has_page() {
                    true => format!(
                        "waiting for the player: choose on its page, {}, to show the pictures",
                        self.server.url
                    ),
                    false => format!("waiting for the player: open {}", self.server.url),
                });
            }
            thread::sleep(POLL_INTERVAL);
        }
    }

    /// Asks on the page, and returns whether to photograph again.
    pub(super) fn ask(&self, question: &str) -> Result<bool> {
        let answered = self.server.player().answer.0;
        self.server
            .update(|state| state.question = Some(question.to_owned()));
        let again = loop {
            check_cancelled(self.cores)?;
            match self.server.player().answer {
                (count, again) if count > answered => break again,
                _ => thread::sleep(POLL_INTERVAL),
            }
        };
        self.server.update(|state| state.question = None);
        Ok(again)
    }

    fn wait(&self, time: Duration) -> Result<()> {
        let end = Instant::now() + time;
        while Instant::now() < end {
            check_cancelled(self.cores)?;
            thread::sleep(POLL_INTERVAL.min(end.saturating_duration_since(Instant::now())));
        }
        Ok(())
    }

    /// Tells the user and the operator at the page.
    pub(super) fn say(&self, text: &str) {
        self.bar.suspend(|| eprintln!("{text}"));
        self.server.update(|state| state.message = text.to_owned());
    }
}

fn record(taken: &Taken, attempts: u32, remarks: Vec<String>) -> PhotographRecord {
    PhotographRecord {
        original: String::new(),
        camera: taken.developed.camera.clone(),
        kind: taken.developed.kind,
        levels: PhotographLevels::of(&taken.developed),
        thumbnail: taken.developed.thumbnail.clone(),
        sharpness: taken.statistics.sharpness,
        taken: humantime::format_rfc3339_seconds(taken.at).to_string(),
        attempts,
        remarks,
    }
}

fn is_pattern(store: &SessionStore, i: usize) -> bool {
    matches!(store.sequence.pictures[i].role, PictureRole::Pattern { .. })
}

/// Its photographs are taken again.
fn forget_gray_code(store: &mut SessionStore) -> Result<()> {
    for i in 0..store.sequence.pictures.len() {
        if matches!(store.sequence.pictures[i].role, PictureRole::GrayCode(_)) {
            store.remove(i)?;
        }
    }
    Ok(())
}
