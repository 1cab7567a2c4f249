//! The exit status of a command that fails. A program that runs many commands decides by it whether to run one again.

use std::io;

use anyhow::Error as AnyError;
use image::ImageError;
use png::EncodingError;

use super::check::NotReadyError;
use super::ltm_file::LtmFileError;
use super::output_file::InputError;
use super::process_resources::{INTERRUPTED_STATUS, Interrupted};
use super::recover::{CheckpointInUseError, FaultyPhotographsError, StrictError, UnusableError};
use super::stage::{IngestNameError, StageFileError};
use super::value_parsers::UsageError;
use crate::calibrate::CalibrationError;
use crate::capture::{CaptureError, CaptureErrorKind};
use crate::format::FormatError;
use crate::photo_file::PhotoFileError;
use crate::recover::RecoverError;

const FAILURE: u8 = 1;
/// As of clap.
const USAGE: u8 = 2;
/// `EX_DATAERR` of sysexits: the same files fail again.
const DATA_ERROR: u8 = 65;
/// `EX_TEMPFAIL` of sysexits: the same command may succeed later.
const TEMPORARY: u8 = 75;

/// The status for an error: 2 for wrong usage, 65 where a capture or file is at fault, 75 where the disk, the network or
/// another process is and the same command may succeed later, 130 after an interruption, 1 otherwise.
pub fn exit_status(error: &AnyError) -> u8 {
    let causes = causes(error);
    let is_any = |test: fn(Cause<'_>) -> bool| causes.iter().any(|cause| test(*cause));
    if is_any(|cause| cause.is::<Interrupted>()) {
        INTERRUPTED_STATUS
    } else if is_any(|cause| cause.is::<UsageError>()) {
        USAGE
    } else if is_any(is_temporary) {
        // Before errors of files: a failure of the disk may be reported as one.
        TEMPORARY
    } else if is_any(is_of_data) {
        DATA_ERROR
    } else {
        FAILURE
    }
}

type Cause<'a> = &'a (dyn std::error::Error + 'static);

/// The error and its causes, with those that errors of inputs and of the system have inside.
fn causes(error: &AnyError) -> Vec<Cause<'_>> {
    let mut causes: Vec<Cause<'_>> = error.chain().collect();
    let mut next = 0;
    while let Some(cause) = causes.get(next) {
        next += 1;
        let inner = io_error(*cause).and_then(io::Error::get_ref);
        let of_input = cause.downcast_ref().map(|InputError(error)| error);
        causes.extend(inner.map(|error| error as Cause<'_>));
        causes.extend(of_input.into_iter().flat_map(AnyError::chain));
    }
    causes
}

/// The error of the system that is the cause, also where it is only part of the text.
fn io_error(cause: Cause<'_>) -> Option<&io::Error> {
    use FormatError::{Source, Spool, Write};
    if let Some(error) = cause.downcast_ref() {
        return Some(error);
    }
    if let Some(CaptureError { problem, .. }) = cause.downcast_ref() {
        return match problem {
            CaptureErrorKind::Io(error) => Some(error),
            _ => None,
        };
    }
    if let Some(LtmFileError::Open(error)) = cause.downcast_ref() {
        return Some(error);
    }
    if let Some(ImageError::IoError(error)) = cause.downcast_ref() {
        return Some(error);
    }
    if let Some(EncodingError::IoError(error)) = cause.downcast_ref() {
        return Some(error);
    }
    match (cause.downcast_ref(), cause.downcast_ref()) {
        (Some(PhotoFileError::Io(error)), _) => Some(error),
        (_, Some(Write(error) | Source(error) | Spool(error))) => Some(error),
        _ => None,
    }
}

/// Whether the system may answer otherwise later.
fn may_pass(error: &io::Error) -> bool {
    use io::ErrorKind::{
        ConnectionAborted, ConnectionReset, Deadlock, HostUnreachable, NetworkDown,
        NetworkUnreachable, NotConnected, OutOfMemory, QuotaExceeded, ResourceBusy,
        StaleNetworkFileHandle, StorageFull, TimedOut, WouldBlock,
    };
    let passes = matches!(
        error.kind(),
        ConnectionAborted
            | ConnectionReset
            | Deadlock
            | HostUnreachable
            | NetworkDown
            | NetworkUnreachable
            | NotConnected
            | OutOfMemory
            | QuotaExceeded
            | ResourceBusy
            | StaleNetworkFileHandle
            | StorageFull
            | TimedOut
            | WouldBlock
    );
    passes || has_passing_code(error)
}

/// An input or output error of a device, and too many open files, which have no kind.
#[cfg(unix)]
fn has_passing_code(error: &io::Error) -> bool {
    use nix::errno::Errno;
    let code = error.raw_os_error().map(Errno::from_raw);
    matches!(code, Some(Errno::EIO | Errno::EMFILE | Errno::ENFILE))
}

#[cfg(not(unix))]
fn has_passing_code(_: &io::Error) -> bool {
    false
}

fn is_temporary(cause: Cause<'_>) -> bool {
    io_error(cause).is_some_and(may_pass)
        || cause.is::<CheckpointInUseError>()
        || cause.downcast_ref().is_some_and(StageFileError::may_pass)
        || matches!(cause.downcast_ref(), Some(FormatError::Memory(_)))
}

fn is_of_data(cause: Cause<'_>) -> bool {
    cause.is::<NotReadyError>()
        || cause.is::<StrictError>()
        || cause.is::<UnusableError>()
        || cause.is::<FaultyPhotographsError>()
        || cause.is::<CaptureError>()
        || cause.is::<CalibrationError>()
        || cause.is::<LtmFileError>()
        || cause.is::<StageFileError>()
        || cause.is::<IngestNameError>()
        || cause.is::<PhotoFileError>()
        || cause.downcast_ref().is_some_and(is_of_photographs)
        || cause.downcast_ref().is_some_and(is_of_file)
}

/// Whether photographs are at fault, and not options as well.
fn is_of_photographs(error: &RecoverError) -> bool {
    !matches!(
        error,
        RecoverError::Cancelled(_) | RecoverError::Geometry(_)
    )
}

/// Whether a file that was read is at fault. Files that are written have other errors.
fn is_of_file(error: &FormatError) -> bool {
    use FormatError::{Compress, Source, Spool, TooLarge, Write};
    !matches!(
        error,
        Compress(_) | Source(_) | Spool(_) | TooLarge { .. } | Write(_)
    )
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use anyhow::{Context, anyhow};

    use super::*;
    use crate::cli::stage::stage_folder::StageFileProblem;

    fn full() -> io::Error {
        io::ErrorKind::StorageFull.into()
    }

    #[test]
    fn statuses_tell_whether_to_try_again() {
        let damaged = || io::Error::other(FormatError::TrailingBytes(9));
        let missing = || io::Error::from(io::ErrorKind::NotFound);
        let stage = |problem: StageFileProblem| problem.of(Path::new("plan.json")).into();
        let cases = [
            (anyhow!("anything else"), FAILURE),
            (UsageError("no such option").into(), USAGE),
            (Interrupted("stopped".into()).into(), INTERRUPTED_STATUS),
            (RecoverError::NoSignal.into(), DATA_ERROR),
            (StrictError.into(), DATA_ERROR),
            (FormatError::UnknownMagic(vec![]).into(), DATA_ERROR),
            (PhotoFileError::UnknownFormat.into(), DATA_ERROR),
            (PhotoFileError::Io(missing()).into(), DATA_ERROR),
            (PhotoFileError::Io(full()).into(), TEMPORARY),
            (FormatError::Write(full()).into(), TEMPORARY),
            (FormatError::Spool(missing()).into(), FAILURE),
            (FormatError::Memory(9).into(), TEMPORARY),
            (CheckpointInUseError.into(), TEMPORARY),
            (stage(StageFileProblem::Missing(String::new())), TEMPORARY),
            (stage(StageFileProblem::Replaced), TEMPORARY),
            (stage(StageFileProblem::Damaged(String::new())), DATA_ERROR),
            (full().into(), TEMPORARY),
            (ImageError::IoError(full()).into(), TEMPORARY),
            (EncodingError::IoError(full()).into(), TEMPORARY),
            (io::Error::from_raw_os_error(5).into(), TEMPORARY),
            (missing().into(), FAILURE),
            (InputError(RecoverError::NoSignal.into()).into(), DATA_ERROR),
            (InputError(full().into()).into(), TEMPORARY),
            (LtmFileError::Open(missing()).into(), DATA_ERROR),
            (FormatError::Source(damaged()).into(), DATA_ERROR),
            (
                FormatError::Source(io::Error::other(InputError(full().into()))).into(),
                TEMPORARY,
            ),
        ];
        for (error, status) in cases {
            assert_eq!(exit_status(&error), status, "{error:?}");
            // A context does not change it.
            let told = format!("{error:?}");
            let named = Err::<(), _>(error).context("photo.ltm").unwrap_err();
            assert_eq!(exit_status(&named), status, "{told}");
        }
    }
}
