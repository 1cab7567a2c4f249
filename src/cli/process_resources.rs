//! The process: its cores, its memory, and the signals that interrupt it.

use std::io::ErrorKind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Error, Result};
use rayon::prelude::*;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::format::FormatError;
use crate::job_executor::{Cancelled, Executor};

/// Runs jobs on all cores of rayon's current pool.
#[derive(Clone, Copy, Debug)]
pub struct AllCoresExecutor;

impl Executor for AllCoresExecutor {
    fn map<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..count).into_par_iter().map(work).collect()
    }
}

/// Peak resident memory of this process in bytes; `None` where the system does not report it.
pub fn peak_rss_bytes() -> Option<u64> {
    // Linux's `getrusage` counts what the process that started this one had in memory.
    #[cfg(target_os = "linux")]
    if let Some(peak) =
        peak_of_status(&std::fs::read_to_string("/proc/self/status").unwrap_or_default())
    {
        return Some(peak);
    }
    #[cfg(unix)]
    {
        use nix::sys::resource::{UsageWho, getrusage};
        let usage = getrusage(UsageWho::RUSAGE_SELF).ok()?;
        // Linux and the BSDs report kibibytes, macOS bytes.
        let unit = if cfg!(target_os = "macos") { 1 } else { 1024 };
        Some(u64::try_from(usage.max_rss()).ok()? * unit)
    }
    #[cfg(not(unix))]
    None
}

/// The peak resident memory of `/proc/PID/status` in bytes.
#[cfg(target_os = "linux")]
fn peak_of_status(status: &str) -> Option<u64> {
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kibibytes * 1024)
}

/// Exit status after an interruption, as shells report Ctrl-C.
pub const INTERRUPTED_STATUS: u8 = 130;

/// The command was interrupted before its end; the text says what remains of its work.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Interrupted(pub String);

/// [`Cancelled`], where that is why encoding failed; other errors stay.
pub fn cancelled_or(error: Error) -> Error {
    match error.downcast_ref() {
        Some(FormatError::Source(e)) if e.kind() == ErrorKind::Interrupted => Cancelled.into(),
        _ => error,
    }
}

/// A pool of so many threads.
pub fn thread_pool(threads: usize) -> Result<rayon::ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.context("threads cannot be started")
}

/// Runs jobs on all cores until Ctrl-C or SIGTERM asks the process to stop. The second signal ends it at once. The default
/// has no signal handlers: the first signal ends the process.
#[derive(Debug, Default)]
pub struct InterruptibleCores {
    requested: Arc<AtomicBool>,
    /// Whether the user was told that the request arrived.
    acknowledged: AtomicBool,
}

impl InterruptibleCores {
    /// Installs the signal handlers; once a process.
    pub fn listen() -> Result<Self> {
        let cores = Self::default();
        // Not SIGHUP, which `nohup` ignores for the process; without `nohup` the tiles are kept anyway.
        for signal in [SIGINT, SIGTERM] {
            // In this order: at the second signal the first handler sees the flag of the second.
            let status = INTERRUPTED_STATUS.into();
            flag::register_conditional_shutdown(signal, status, Arc::clone(&cores.requested))
                .and_then(|_| flag::register(signal, Arc::clone(&cores.requested)))
                .context("cannot listen for Ctrl-C")?;
        }
        Ok(cores)
    }
}

impl Executor for InterruptibleCores {
    fn map<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        AllCoresExecutor.map(count, work)
    }

    /// The first time it is cancelled, tells the user so.
    fn is_cancelled(&self) -> bool {
        let requested = self.requested.load(Ordering::Relaxed);
        if requested && !self.acknowledged.swap(true, Ordering::Relaxed) {
            eprintln!("stopping after the current work; press Ctrl-C again to stop at once");
        }
        requested
    }
}
