//! The camera: a command that takes a photograph, or a folder that a tethering program writes photographs into.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use thiserror::Error;

use crate::cli::assemble::is_photograph;

/// Cameras that can be named instead of a command. Raw files where the program has them.
const PRESETS: [(&str, &str); 3] = [
    (
        "gphoto2",
        "gphoto2 --capture-image-and-download --force-overwrite --filename {stem}.%C",
    ),
    (
        "libcamera",
        "rpicam-still --nopreview --immediate --raw --shutter {microseconds} --gain 1 --awbgains 1,1 --output {stem}.jpg",
    ),
    // A webcam's first pictures are not exposed yet.
    (
        "v4l2",
        r"ffmpeg -loglevel error -y -f v4l2 -i /dev/video0 -vf 'select=gte(n\,15)' -frames:v 1 {stem}.png",
    ),
];
/// The camera is a folder.
const WATCH: &str = "watch:";
/// Words that a command may have in braces.
const PLACEHOLDERS: [&str; 7] = [
    "file",
    "stem",
    "number",
    "photograph",
    "picture",
    "exposure",
    "microseconds",
];
/// Time between two looks.
const POLL_INTERVAL: Duration = Duration::from_millis(25);
/// A file that does not grow for this long is complete.
const SETTLED: Duration = Duration::from_millis(1000);
/// File of what a command prints.
const MESSAGES: &str = "messages";
/// Length of a command's messages that is printed.
const MAX_MESSAGE_BYTES: u64 = 4096;
const MAX_MESSAGE_CHARACTERS: usize = 300;

/// Why `--camera` cannot be used.
#[derive(Debug, Error)]
pub enum CameraArgError {
    /// Quotes are not closed.
    #[error("the quotes are not closed")]
    Quotes,
    /// It is neither a preset nor a command.
    #[error(
        "it is neither a preset (gphoto2, libcamera, v4l2, watch:FOLDER) nor a command with {{file}} or {{stem}}"
    )]
    NoFile,
    /// Nothing is replaced by this.
    #[error(
        "{{{0}}} is not known; a command can have {{file}}, {{stem}}, {{number}}, {{photograph}}, {{picture}}, {{exposure}} and {{microseconds}}"
    )]
    Placeholder(String),
    /// There is no such program.
    #[error("the program {0} is not installed, or not on PATH")]
    NoProgram(String),
    /// There is no such folder.
    #[error("{0}: is no folder")]
    NoFolder(PathBuf),
}

/// Why there is no photograph.
#[derive(Debug, Error)]
pub enum CameraError {
    /// The program is not installed, for instance.
    #[error("the camera's command {command} cannot be started: {error}")]
    NotStarted {
        /// The program.
        command: String,
        /// The reason.
        error: io::Error,
    },
    /// Its exit status is not 0.
    #[error("the camera's command failed ({status}){messages}")]
    Failed {
        /// How it ended.
        status: ExitStatus,
        /// Its messages.
        messages: String,
    },
    /// It wrote nothing.
    #[error("the camera's command wrote no photograph to {file}{others}{messages}")]
    NoPhotograph {
        /// Where it should be.
        file: PathBuf,
        /// The files that it wrote instead.
        others: String,
        /// Its messages.
        messages: String,
    },
    /// Which is that of the picture?
    #[error("{0} photographs came instead of one: {1}")]
    SeveralPhotographs(usize, String),
    /// It took too long.
    #[error("no photograph came within {0} seconds")]
    TimedOut(u64),
    /// The file cannot be read or moved.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The user has interrupted the session.
    #[error("interrupted")]
    Cancelled,
}

/// A camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CameraSource {
    /// A program with its arguments.
    Command(Vec<String>),
    /// A folder that photographs are written into.
    Folder(PathBuf),
}

/// One photograph.
#[derive(Clone, Copy, Debug)]
pub struct PhotographRequest<'a> {
    /// Number of the picture in the sequence, from 0.
    pub number: usize,
    /// Number of the photograph, which differs from those of all others of a session.
    pub photograph: u64,
    /// File of the picture that is shown.
    pub picture: &'a Path,
    /// Exposure time in seconds, as the camera names it.
    pub exposure: Option<&'a Exposure>,
    /// Empty folder that the command writes into.
    pub incoming: &'a Path,
    /// Extension of `{file}`.
    pub extension: &'a str,
    /// How long to wait.
    pub timeout: Duration,
}

/// Files in a watched folder before a picture is shown.
#[derive(Debug)]
pub struct FilesBefore(BTreeSet<OsString>);

/// An exposure time.
#[derive(Clone, Debug, PartialEq)]
pub struct Exposure {
    /// As the camera names it, for instance 1/60.
    pub name: String,
    /// In seconds.
    pub seconds: f64,
}

impl Exposure {
    /// Parses seconds, or a fraction of them.
    pub fn parse(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse::<f64>().ok();
        let seconds = match text.split_once('/') {
            Some((above, below)) => number(above).zip(number(below)).map(|(a, b)| a / b),
            None => number(text),
        };
        let seconds = seconds.filter(|seconds| (1e-6..=3600.0).contains(seconds));
        let seconds =
            seconds.ok_or("give seconds or a fraction of them, for instance 1/60,1/30,0.5")?;
        Ok(Self {
            name: text.trim().to_owned(),
            seconds,
        })
    }
}

impl CameraSource {
    /// Parses `--camera`: a preset, `watch:FOLDER`, or a command with placeholders.
    ///
    /// # Errors
    /// If it is none of them.
    pub fn parse(text: &str) -> Result<Self, CameraArgError> {
        if let Some(folder) = text.strip_prefix(WATCH) {
            let folder = PathBuf::from(folder);
            return match folder.is_dir() {
                true => Ok(Self::Folder(folder)),
                false => Err(CameraArgError::NoFolder(folder)),
            };
        }
        let preset = PRESETS.iter().find(|(name, _)| *name == text);
        let command = preset.map_or(text, |(_, command)| command);
        // Elsewhere a backslash quotes the character after it.
        let command = match cfg!(windows) {
            true => command.replace('\\', "/"),
            false => command.to_owned(),
        };
        let words = shlex::split(&command).ok_or(CameraArgError::Quotes)?;
        for word in &words {
            if let Some(unknown) = placeholders(word).find(|name| !PLACEHOLDERS.contains(name)) {
                return Err(CameraArgError::Placeholder(unknown.to_owned()));
            }
        }
        let source = Self::Command(words);
        if !source.uses("file") && !source.uses("stem") {
            return Err(CameraArgError::NoFile);
        }
        match &source {
            Self::Command(words) if !is_installed(&words[0]) => {
                Err(CameraArgError::NoProgram(words[0].clone()))
            }
            _ => Ok(source),
        }
    }

    /// Whether the command has the placeholder `name`.
    pub fn uses(&self, name: &str) -> bool {
        match self {
            Self::Command(words) => words
                .iter()
                .any(|word| placeholders(word).any(|other| other == name)),
            Self::Folder(_) => false,
        }
    }

    /// Whether the command sets the exposure time.
    pub fn sets_exposure(&self) -> bool {
        self.uses("exposure") || self.uses("microseconds")
    }

    /// What there is before the next picture is shown: files that come later are photographs of it.
    ///
    /// # Errors
    /// If the watched folder cannot be read.
    pub fn files_before(&self) -> Result<FilesBefore, CameraError> {
        Ok(FilesBefore(match self {
            Self::Command(_) => BTreeSet::new(),
            Self::Folder(folder) => photographs(folder)?.into_keys().collect(),
        }))
    }

    /// Takes a photograph, with what [`files_before`](Self::files_before) said before the picture was shown. Returns its file,
    /// which is complete: in `request.incoming`, or in the watched folder.
    ///
    /// # Errors
    /// If there is none.
    pub fn photograph(
        &self,
        request: &PhotographRequest,
        before: &FilesBefore,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<PathBuf, CameraError> {
        let deadline = Deadline::new(request.timeout);
        match self {
            Self::Command(words) => run(words, request, &deadline, is_cancelled),
            Self::Folder(folder) => wait_for_new(folder, before, &deadline, is_cancelled),
        }
    }
}

/// Whether a program can be found. On Windows, where its extension is left out, that shows when it is started.
fn is_installed(program: &str) -> bool {
    if cfg!(windows) || program.contains('/') {
        return cfg!(windows) || Path::new(program).is_file();
    }
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(program).is_file())
}

/// Names in braces.
fn placeholders(word: &str) -> impl Iterator<Item = &str> {
    let starts = word.match_indices('{');
    starts.filter_map(|(at, _)| {
        let name = word[at + 1..].split_once('}')?.0;
        let is_name = !name.is_empty() && name.chars().all(|c| c.is_ascii_lowercase());
        is_name.then_some(name)
    })
}

struct Deadline {
    end: Instant,
    timeout: Duration,
}

impl Deadline {
    fn new(timeout: Duration) -> Self {
        Self {
            end: Instant::now() + timeout,
            timeout,
        }
    }

    /// Waits for the next look.
    fn wait(&self, is_cancelled: &dyn Fn() -> bool) -> Result<(), CameraError> {
        if is_cancelled() {
            return Err(CameraError::Cancelled);
        }
        if Instant::now() >= self.end {
            return Err(CameraError::TimedOut(self.timeout.as_secs()));
        }
        thread::sleep(POLL_INTERVAL);
        Ok(())
    }
}

fn run(
    words: &[String],
    request: &PhotographRequest,
    deadline: &Deadline,
    is_cancelled: &dyn Fn() -> bool,
) -> Result<PathBuf, CameraError> {
    let stem = request.incoming.join("photograph");
    let file = stem.with_extension(request.extension);
    let exposure = request.exposure;
    let values = BTreeMap::from([
        ("file", file.display().to_string()),
        ("stem", stem.display().to_string()),
        ("number", request.number.to_string()),
        ("photograph", request.photograph.to_string()),
        ("picture", request.picture.display().to_string()),
        (
            "exposure",
            exposure.map_or(String::new(), |exposure| exposure.name.clone()),
        ),
        (
            "microseconds",
            exposure.map_or(String::new(), |exposure| {
                format!("{:.0}", 1e6 * exposure.seconds)
            }),
        ),
    ]);
    let words: Vec<String> = words.iter().map(|word| filled(word, &values)).collect();
    let printed = request.incoming.join(MESSAGES);
    let output = File::create(&printed)?;
    let mut command = Command::new(&words[0]);
    command
        .args(&words[1..])
        .stdin(Stdio::null())
        .stdout(output.try_clone()?)
        .stderr(output);
    // A group of its own, so that what the command starts ends with it.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let child = command.spawn().map_err(|error| CameraError::NotStarted {
        command: words[0].clone(),
        error,
    })?;
    let status = Process(child).wait(deadline, is_cancelled)?;
    let messages = first_messages(&printed);
    if !status.success() {
        return Err(CameraError::Failed { status, messages });
    }
    let written = photographs(request.incoming)?;
    match written.keys().next() {
        Some(name) if written.len() == 1 => Ok(request.incoming.join(name)),
        Some(_) => Err(several(&written)),
        None => Err(CameraError::NoPhotograph {
            file,
            others: unreadable(request.incoming)?,
            messages,
        }),
    }
}

fn several(written: &BTreeMap<OsString, u64>) -> CameraError {
    let names: Vec<String> = written
        .keys()
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    CameraError::SeveralPhotographs(names.len(), names.join(", "))
}

/// Names files of other types, such as a camera's JPEG.
fn unreadable(incoming: &Path) -> io::Result<String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(incoming)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if name != MESSAGES {
            names.push(name);
        }
    }
    Ok(match names.is_empty() {
        true => String::new(),
        false => format!(
            ", but {}, which is not read; set the camera to raw",
            names.join(", ")
        ),
    })
}

/// `word` with its placeholders replaced.
fn filled(word: &str, values: &BTreeMap<&str, String>) -> String {
    let mut filled = String::new();
    let mut rest = word;
    while let Some((before, after)) = rest.split_once('{') {
        filled += before;
        let value = after
            .split_once('}')
            .and_then(|(name, after)| values.get(name).map(|value| (value, after)));
        match value {
            Some((value, after)) => {
                filled += value;
                rest = after;
            }
            None => {
                filled.push('{');
                rest = after;
            }
        }
    }
    filled + rest
}

/// A process that does not outlive this program's interest in it.
struct Process(Child);

impl Process {
    fn wait(
        mut self,
        deadline: &Deadline,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<ExitStatus, CameraError> {
        loop {
            if let Some(status) = self.0.try_wait()? {
                return Ok(status);
            }
            deadline.wait(is_cancelled)?;
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if !matches!(self.0.try_wait(), Ok(Some(_))) {
            #[cfg(unix)]
            {
                use nix::sys::signal::{Signal, killpg};
                use nix::unistd::Pid;
                let _ = killpg(Pid::from_raw(self.0.id() as i32), Signal::SIGKILL);
            }
            let _ = self.0.kill();
            let _ = self.0.wait();
        }
    }
}

/// The beginning of what a command printed, with a separator before it.
fn first_messages(path: &Path) -> String {
    let read = || -> io::Result<String> {
        let mut bytes = Vec::new();
        File::open(path)?
            .take(MAX_MESSAGE_BYTES)
            .read_to_end(&mut bytes)?;
        let text = String::from_utf8_lossy(&bytes);
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
        Ok(lines.collect::<Vec<_>>().join("; "))
    };
    let text = read().unwrap_or_default();
    match text.char_indices().nth(MAX_MESSAGE_CHARACTERS) {
        _ if text.is_empty() => text,
        None => format!(": {text}"),
        Some((end, _)) => format!(": {}…", &text[..end]),
    }
}

/// Lengths of the photographs in a folder, by their names.
fn photographs(folder: &Path) -> io::Result<BTreeMap<OsString, u64>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if is_photograph(&entry.path()) {
            // A file may be renamed meanwhile.
            if let Ok(metadata) = entry.metadata()
                && metadata.is_file()
            {
                found.insert(entry.file_name(), metadata.len());
            }
        }
    }
    Ok(found)
}

/// The photograph that is new in `folder`, once it is complete.
fn wait_for_new(
    folder: &Path,
    before: &FilesBefore,
    deadline: &Deadline,
    is_cancelled: &dyn Fn() -> bool,
) -> Result<PathBuf, CameraError> {
    let mut last = (BTreeMap::new(), Instant::now());
    loop {
        deadline.wait(is_cancelled)?;
        let mut new = photographs(folder)?;
        new.retain(|name, _| !before.0.contains(name));
        if new != last.0 {
            last = (new, Instant::now());
            continue;
        }
        let is_complete = last.0.values().all(|length| *length > 0);
        if is_complete && last.1.elapsed() >= SETTLED {
            match last.0.keys().next() {
                Some(name) if last.0.len() == 1 => return Ok(folder.join(name)),
                Some(_) => return Err(several(&last.0)),
                None => {}
            }
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use tempfile::TempDir;

    fn request(incoming: &Path) -> PhotographRequest<'_> {
        PhotographRequest {
            number: 7,
            photograph: 11,
            picture: Path::new("display/0007.png"),
            exposure: None,
            incoming,
            extension: "png",
            timeout: Duration::from_secs(20),
        }
    }

    fn photograph(command: &str, request: &PhotographRequest) -> Result<PathBuf, CameraError> {
        match CameraSource::parse(command) {
            Ok(source) => source.photograph(request, &FilesBefore(BTreeSet::new()), &|| false),
            Err(error) => panic!("{command}: {error}"),
        }
    }

    #[test]
    fn a_command_is_given_its_file_and_the_exposure() {
        let folder = TempDir::new().unwrap();
        let exposure = Exposure::parse("1/8").unwrap();
        let request = PhotographRequest {
            exposure: Some(&exposure),
            ..request(folder.path())
        };
        let command = "sh -c 'echo {number} {photograph} {exposure} {microseconds} {picture} > \"{stem}.CR2\"'";
        let file = photograph(command, &request).unwrap();
        assert_eq!(file, folder.path().join("photograph.CR2"));
        let text = fs::read_to_string(file).unwrap();
        assert_eq!(text.trim(), "7 11 1/8 125000 display/0007.png");
    }

    #[test]
    fn what_a_command_says_of_its_failure_is_told() {
        let folder = TempDir::new().unwrap();
        let request = request(folder.path());
        let error = |command: &str| photograph(command, &request).unwrap_err().to_string();
        assert!(error("sh -c 'echo no battery; exit 3' {file}").contains("no battery"));
        assert!(error("sh -c 'echo {file}'").contains("wrote no photograph"));
        let jpeg = error("sh -c 'echo a > {stem}.JPG'");
        assert!(jpeg.contains("photograph.JPG, which is not read"), "{jpeg}");
        let request = PhotographRequest {
            timeout: Duration::from_millis(100),
            ..request
        };
        let started = Instant::now();
        let hanging = photograph("sh -c 'sleep 600' {file}", &request).unwrap_err();
        assert!(matches!(hanging, CameraError::TimedOut(_)), "{hanging}");
        assert!(started.elapsed() < Duration::from_secs(300));
        let source = CameraSource::parse("sh -c 'sleep 600' {file}").unwrap();
        let nothing = FilesBefore(BTreeSet::new());
        let cancelled = source.photograph(&request, &nothing, &|| true);
        assert!(matches!(cancelled, Err(CameraError::Cancelled)));
    }

    #[test]
    fn a_new_file_in_a_watched_folder_is_taken_when_it_is_complete() {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("IMG_1.CR3"), "old").unwrap();
        let source = CameraSource::parse(&format!("watch:{}", folder.path().display())).unwrap();
        let before = source.files_before().unwrap();
        let file = folder.path().join("IMG_2.CR3");
        thread::scope(|scope| {
            scope.spawn(|| {
                for text in ["", "be", "begun and ended"] {
                    fs::write(&file, text).unwrap();
                    fs::write(folder.path().join("IMG_2.JPG"), text).unwrap();
                    thread::sleep(Duration::from_millis(150));
                }
            });
            let found = source.photograph(&request(folder.path()), &before, &|| false);
            assert_eq!(found.unwrap(), file);
        });
        assert_eq!(fs::read_to_string(&file).unwrap(), "begun and ended");
        // With an old one that is changed, the new one is still the photograph; of two new ones, none is.
        fs::write(folder.path().join("IMG_1.CR3"), "changed").unwrap();
        let again = source.photograph(&request(folder.path()), &before, &|| false);
        assert_eq!(again.unwrap(), file);
        fs::write(folder.path().join("IMG_3.CR3"), "late").unwrap();
        let two = source.photograph(&request(folder.path()), &before, &|| false);
        assert!(
            two.unwrap_err()
                .to_string()
                .contains("IMG_2.CR3, IMG_3.CR3")
        );
    }

    #[test]
    fn wrong_commands_are_refused_with_what_is_possible() {
        let error = |text: &str| CameraSource::parse(text).unwrap_err().to_string();
        assert!(error("gphoto").contains("neither a preset"));
        assert!(error("no-such-camera {file}").contains("no-such-camera is not installed"));
        assert!(error("sh {fiel}").contains("{fiel} is not known"));
        assert!(error("sh '{file}").contains("quotes"));
        assert!(error("watch:/no/such/folder").contains("is no folder"));
        assert!(
            CameraSource::parse("sh -c 'cp a {stem}.png'")
                .unwrap()
                .uses("stem")
        );
        // Braces that are no placeholder are the command's own.
        assert!(CameraSource::parse("sh -c 'f() { cp a {file}; }; f'").is_ok());
        for text in ["0", "-1", "1/0", "fast"] {
            assert!(Exposure::parse(text).is_err(), "{text}");
        }
    }
}
