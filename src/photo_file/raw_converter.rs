//! Raw files, by `dcraw_emu` and `raw-identify`, programs of LibRaw: as processes of their own, which crash and hang alone, and
//! whose licence (LGPL or CDDL) does not concern this program.
//!
//! They see the raw file in an empty folder that is removed afterwards, so that they write nothing beside the user's files. In old
//! versions the exit status of `dcraw_emu` is 0 whatever happens: success is a picture, and no message of damaged data.

use std::fs::{self, File};
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use tempfile::TempDir;
use thiserror::Error;

use super::decode::decode_photo;
use super::error::PhotoFileError;
use super::samples::{PhotoSamples, SampleValues};
use crate::transport::CHANNELS;

/// Extensions of raw files, in lower case.
pub const RAW_EXTENSIONS: [&str; 29] = [
    "3fr", "arw", "cr2", "cr3", "crw", "dcr", "dng", "erf", "fff", "gpr", "iiq", "k25", "kdc",
    "mef", "mos", "mrw", "nef", "nrw", "orf", "pef", "raf", "raw", "rw2", "rwl", "sr2", "srf",
    "srw", "x3f", "cap",
];

/// Numbers in proportion to the light on the sensor, of one scale for all photographs of a camera.
const OPTIONS: [&str; 16] = [
    // 16 bits, without a gamma and without automatic brightness.
    "-4", //
    // TIFF.
    "-T", //
    // The camera's own primaries. In those of sRGB, saturated colours are negative and would be clipped.
    "-o", "0", //
    // Black and white of the file's metadata. By default the brightest pixel of each photograph can become its white.
    "-c", "0", //
    // Each channel is clipped at its own white.
    "-H", "0", //
    // No white balance: a factor above 1 would clip unsaturated samples.
    "-r", "1", "1", "1", "1", //
    // One pixel for each 2 x 2 of the sensor, with the mean of its two greens. Interpolation of missing colours follows edges:
    // it is not linear. Light elements span several pixels, so no detail is lost that could be recovered.
    "-h", //
    // As the sensor has it: the camera's orientation can change within a session if the camera looks down.
    "-t", "0", //
];

/// A raw file takes seconds.
const TIMEOUT: Duration = Duration::from_secs(300);
/// Longest wait between two looks at the process.
const MAX_POLL_INTERVAL: Duration = Duration::from_millis(50);
/// File of what the program writes to standard error.
const MESSAGES: &str = "messages";
/// File of what `raw-identify` writes.
const DESCRIPTION: &str = "description";
/// The heading of the matrix in it, and the beginning of the line of factors.
const CAMERA_TO_SRGB: &str = "camRGB -> sRGB Matrix:";
const DAYLIGHT_FACTORS: &str = "Derived D65 multipliers:";
/// Bytes of the messages that are read: the last ones.
const MAX_MESSAGE_BYTES: u64 = 4096;
/// Parts of LibRaw's messages about damaged data, of which it still writes a picture.
const DAMAGE: [&str; 2] = ["data corrupted", "Unexpected end of file"];

/// Why a raw file cannot be converted.
#[derive(Debug, Error)]
pub enum RawConversionError {
    /// There is no such program on the path.
    #[error(
        "is a raw file, which the program {program} reads, and that is not installed. Install LibRaw's programs (Debian and Ubuntu: \
         apt-get install libraw-bin; macOS: brew install libraw), or convert raw files to 16-bit linear TIFF"
    )]
    ProgramMissing {
        /// Name of the program.
        program: String,
    },
    /// The program does not start.
    #[error("{program} cannot be started: {error}")]
    NotStarted {
        /// Name of the program.
        program: String,
        /// The reason.
        error: io::Error,
    },
    /// The program writes no picture, or says that data is damaged.
    #[error("{program} cannot convert it: {reason}")]
    Failed {
        /// Name of the program.
        program: String,
        /// The last line of its messages.
        reason: String,
    },
    /// The program does not end.
    #[error("{program} did not convert it within {} seconds", timeout.as_secs_f64())]
    TimedOut {
        /// Name of the program.
        program: String,
        /// The limit.
        timeout: Duration,
    },
    /// The picture that the program wrote cannot be read.
    #[error("the picture that {program} makes of it {error}")]
    Picture {
        /// Name of the program.
        program: String,
        /// The reason.
        error: PhotoFileError,
    },
    /// The sensor has more than three colours.
    #[error("has {0} colours; convert it to three in another program, to 16-bit linear TIFF")]
    ColorCount(usize),
    /// The file or the temporary folder cannot be used.
    #[error("cannot be converted: {0}")]
    Io(#[from] io::Error),
}

/// Reads raw files: linear samples of 16 bits, of which 0 is the sensor's black and 65535 its white, and the camera's colours.
#[derive(Clone, Debug)]
pub struct RawConverter {
    program: PathBuf,
    /// The program that says what a raw file is.
    identifier: PathBuf,
    timeout: Duration,
}

impl Default for RawConverter {
    /// `dcraw_emu` and `raw-identify` on the path.
    fn default() -> Self {
        Self {
            program: PathBuf::from("dcraw_emu"),
            identifier: PathBuf::from("raw-identify"),
            timeout: TIMEOUT,
        }
    }
}

impl RawConverter {
    /// Converts the raw file at `path`. Temporary files go to a new folder in `scratch`, and are removed; the samples take
    /// `max_bytes` of memory at most.
    ///
    /// # Errors
    /// If the program is missing, fails, takes too long, or makes a picture that is not one of 16 bits and three channels.
    pub fn convert(
        &self,
        path: &Path,
        scratch: &Path,
        max_bytes: u64,
    ) -> Result<PhotoSamples, RawConversionError> {
        let folder = TempDir::with_prefix_in("raw-", scratch)?;
        let name = format!("photo.{}", extension(path));
        link(&path.canonicalize()?, &folder.path().join(&name))?;
        let command = Command::new(&self.program);
        let status = self.run(command, &OPTIONS, folder.path(), &name, Stdio::null())?;
        let messages = last_messages(&folder.path().join(MESSAGES)).unwrap_or_default();
        let is_damaged = DAMAGE.iter().any(|damage| messages.contains(damage));
        let picture = picture(folder.path())?.filter(|_| status.success() && !is_damaged);
        let Some(picture) = picture else {
            return Err(RawConversionError::Failed {
                program: self.name(),
                reason: reason(&messages, &name, status),
            });
        };
        let error = |error| RawConversionError::Picture {
            program: self.name(),
            error,
        };
        let samples = decode_photo(BufReader::new(File::open(picture)?), max_bytes);
        let samples = samples.map_err(error)?;
        if samples.channels() > CHANNELS {
            return Err(RawConversionError::ColorCount(samples.channels()));
        }
        match samples.values() {
            SampleValues::U16(_) => Ok(samples),
            _ => {
                let found = "another type than 16-bit integers".to_owned();
                Err(error(PhotoFileError::SampleType(found)))
            }
        }
    }

    /// The matrix from the RGB of the raw file at `path` to linear sRGB, row by row, with the white balance of daylight, D65; `None` if
    /// neither the file nor LibRaw knows it. Temporary files go to a new folder in `scratch`, and are removed.
    ///
    /// # Errors
    /// If the program is missing or takes too long.
    pub fn camera_to_srgb(
        &self,
        path: &Path,
        scratch: &Path,
    ) -> Result<Option<[[f64; CHANNELS]; CHANNELS]>, RawConversionError> {
        let folder = TempDir::with_prefix_in("raw-", scratch)?;
        let name = format!("photo.{}", extension(path));
        link(&path.canonicalize()?, &folder.path().join(&name))?;
        let description = folder.path().join(DESCRIPTION);
        let output = File::create(&description)?.into();
        let command = Command::new(&self.identifier);
        self.run(command, &["-v"], folder.path(), &name, output)?;
        let description = fs::read(description)?;
        Ok(parse_camera_to_srgb(&String::from_utf8_lossy(&description)))
    }

    fn name(&self) -> String {
        self.program.display().to_string()
    }

    /// Runs a program with `options` on the file `name` in `folder` until it ends, or has run for too long.
    fn run(
        &self,
        mut command: Command,
        options: &[&str],
        folder: &Path,
        name: &str,
        output: Stdio,
    ) -> Result<ExitStatus, RawConversionError> {
        let messages = File::create(folder.join(MESSAGES))?;
        command
            .args(options)
            .arg(name)
            .current_dir(folder)
            // Several files are converted at once.
            .env("OMP_NUM_THREADS", "1")
            .stdin(Stdio::null())
            .stdout(output)
            .stderr(messages);
        let program = command.get_program().to_string_lossy().into_owned();
        let mut process = command.spawn().map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => RawConversionError::ProgramMissing {
                program: program.clone(),
            },
            _ => RawConversionError::NotStarted {
                program: program.clone(),
                error,
            },
        })?;
        let started = Instant::now();
        let mut interval = Duration::from_millis(1);
        loop {
            if let Some(status) = process.try_wait()? {
                return Ok(status);
            }
            if started.elapsed() >= self.timeout {
                process.kill()?;
                process.wait()?;
                return Err(RawConversionError::TimedOut {
                    program,
                    timeout: self.timeout,
                });
            }
            thread::sleep(interval);
            interval = (2 * interval).min(MAX_POLL_INTERVAL);
        }
    }
}

/// The matrix in what `raw-identify -v` says: a heading and a row of numbers for each channel, for a camera with white balance; and
/// the factors of that.
fn parse_camera_to_srgb(description: &str) -> Option<[[f64; CHANNELS]; CHANNELS]> {
    let numbers = |text: &str| -> Option<[f64; CHANNELS]> {
        let numbers = text.split_whitespace().map(|text| text.parse().ok());
        numbers.collect::<Option<Vec<f64>>>()?.try_into().ok()
    };
    let mut lines = description.lines();
    lines.find(|line| line.trim() == CAMERA_TO_SRGB)?;
    let mut matrix = [[0.0; CHANNELS]; CHANNELS];
    for row in &mut matrix {
        *row = numbers(lines.next()?)?;
    }
    let factors = lines.find_map(|line| line.strip_prefix(DAYLIGHT_FACTORS))?;
    let factors = numbers(factors)?;
    // Of a camera that is not known, LibRaw has the identity.
    let is_known = (0..CHANNELS).any(|i| (0..CHANNELS).any(|j| i != j && matrix[i][j] != 0.0));
    is_known.then(|| matrix.map(|row| std::array::from_fn(|c| row[c] * factors[c])))
}

/// The extension of a raw file; a few formats are told by it.
fn extension(path: &Path) -> String {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    match extension.len() <= 4 && extension.chars().all(|c| c.is_ascii_alphanumeric()) {
        true => extension.into_owned(),
        false => "raw".to_owned(),
    }
}

/// Makes `file` appear at `place`, without a copy where the system can.
fn link(file: &Path, place: &Path) -> io::Result<()> {
    #[cfg(unix)]
    let linked = std::os::unix::fs::symlink(file, place);
    #[cfg(not(unix))]
    let linked = fs::hard_link(file, place);
    linked.or_else(|_| fs::copy(file, place).map(|_| ()))
}

/// The picture that the program wrote into its folder, whatever its name: versions differ.
fn picture(folder: &Path) -> io::Result<Option<PathBuf>> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let is_tiff = path
            .extension()
            .is_some_and(|extension| extension == "tiff" || extension == "tif");
        if is_tiff {
            return Ok(Some(path));
        }
    }
    Ok(None)
}

fn last_messages(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(MAX_MESSAGE_BYTES)))?;
    let mut bytes = Vec::new();
    file.take(MAX_MESSAGE_BYTES).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The last line of the messages, without the temporary name of the file.
fn reason(messages: &str, name: &str, status: ExitStatus) -> String {
    let mut lines = messages.lines().map(str::trim);
    match lines.rfind(|line| !line.is_empty()) {
        Some(line) => line
            .replace(&format!(" {name}"), "")
            .trim_start_matches(&format!("{name}: "))
            .to_owned(),
        None => format!("it says nothing, and ends with {status}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_are_the_last_line_without_the_temporary_name() {
        let status = ExitStatus::default();
        for (messages, expected) in [
            (
                "first\nCannot open photo.cr2: not RAW file\n\n",
                "Cannot open: not RAW file",
            ),
            (
                "photo.cr2: Unexpected end of file",
                "Unexpected end of file",
            ),
            ("", "it says nothing, and ends with exit status: 0"),
        ] {
            assert_eq!(reason(messages, "photo.cr2", status), expected);
        }
    }

    #[test]
    fn the_matrix_of_a_camera_is_three_rows_of_three_numbers_and_three_factors() {
        let heading = "Raw colors: 3\n\ncamRGB -> sRGB Matrix:\n";
        let rows = "1.5\t-0.5\t0\n-0.25\t1.5\t-0.25\n0\t-0.5\t1.5\n";
        let factors = "\nother\n\nDerived D65 multipliers: 2 1 1.5\n";
        let expected = [[3.0, -0.5, 0.0], [-0.5, 1.5, -0.375], [0.0, -0.5, 2.25]];
        let known = [heading, rows, factors].concat();
        assert_eq!(parse_camera_to_srgb(&known), Some(expected));
        let unknown_camera = "1\t0\t0\n0\t1\t0\n0\t0\t1\n";
        for other in [
            String::new(),
            [heading, rows].concat(),
            [heading, "1\t2\n1\t2\n1\t2\n", factors].concat(),
            [heading, unknown_camera, factors].concat(),
        ] {
            assert_eq!(parse_camera_to_srgb(&other), None, "{other}");
        }
    }

    #[test]
    fn a_program_that_is_missing_is_named_with_its_package() {
        let folder = TempDir::new().unwrap();
        let file = folder.path().join("a.CR2");
        fs::write(&file, "").unwrap();
        let converter = RawConverter {
            program: PathBuf::from("no-such-raw-converter"),
            ..RawConverter::default()
        };
        let error = converter.convert(&file, folder.path(), 1 << 20);
        let message = error.unwrap_err().to_string();
        assert!(
            message.contains("no-such-raw-converter") && message.contains("libraw-bin"),
            "{message}"
        );
        // Nothing temporary remains.
        assert_eq!(folder.path().read_dir().unwrap().count(), 1);
    }

    /// `dcraw_emu` waits for somebody to write to a pipe.
    #[cfg(unix)]
    #[test]
    fn a_program_that_does_not_end_is_stopped() {
        let folder = TempDir::new().unwrap();
        let pipe = folder.path().join("a.dng");
        assert!(
            Command::new("mkfifo")
                .arg(&pipe)
                .status()
                .unwrap()
                .success()
        );
        let converter = RawConverter {
            timeout: Duration::from_millis(200),
            ..RawConverter::default()
        };
        let started = Instant::now();
        let error = converter.convert(&pipe, folder.path(), 1 << 20);
        let message = error.unwrap_err().to_string();
        assert!(message.contains("within 0.2 seconds"), "{message}");
        assert!(started.elapsed() < Duration::from_secs(60));
    }
}
