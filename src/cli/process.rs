//! What the process itself has used, how it shows that it is still at work, and how it is told to
//! stop.

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use rayon::prelude::*;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::executor::Executor;

/// All of the machine's cores, until told to stop.
#[derive(Clone, Debug)]
pub struct Cores(Interrupt);

impl Executor for Cores {
    fn map<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        AllCores.map(count, work)
    }

    fn is_cancelled(&self) -> bool {
        self.0.told()
    }
}

/// All of the machine's cores.
#[derive(Clone, Copy, Debug)]
pub struct AllCores;

impl Executor for AllCores {
    fn map<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..count).into_par_iter().map(work).collect()
    }
}

/// Most memory this process has held at once, in bytes; `None` where the system does not tell.
pub fn peak_rss_bytes() -> Option<u64> {
    #[cfg(unix)]
    {
        use nix::sys::resource::{UsageWho, getrusage};
        let usage = getrusage(UsageWho::RUSAGE_SELF).ok()?;
        // Linux and the BSDs count kibibytes, macOS bytes.
        let unit = if cfg!(target_os = "macos") { 1 } else { 1024 };
        Some(u64::try_from(usage.max_rss()).ok()? * unit)
    }
    #[cfg(not(unix))]
    None
}

/// Exit status of a command that was told to stop, as shells have it for Ctrl-C.
pub const INTERRUPTED: u8 = 130;

/// What there is to say of work that was told to stop before its end.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Interrupted(pub String);

/// Whether the process has been told to stop, by Ctrl-C or SIGTERM. Told twice, it stops at once.
#[derive(Clone, Debug)]
pub struct Interrupt {
    told: Arc<AtomicBool>,
    /// Whether the user has been told that it was heard.
    said: Arc<AtomicBool>,
}

impl Interrupt {
    /// Listens from now on. Once a process.
    pub fn listen() -> Result<Self> {
        let told = Arc::new(AtomicBool::new(false));
        // Not for SIGHUP, which `nohup` has a process ignore; where it is not ignored, tiles are kept
        // all the same.
        for signal in [SIGINT, SIGTERM] {
            // In this order: the second time, the first action finds what the second has set.
            flag::register_conditional_shutdown(signal, INTERRUPTED.into(), Arc::clone(&told))
                .and_then(|_| flag::register(signal, Arc::clone(&told)))
                .context("cannot listen for Ctrl-C")?;
        }
        Ok(Self {
            told,
            said: Arc::default(),
        })
    }

    /// All cores, to work until it is told.
    pub fn cores(&self) -> Cores {
        Cores(self.clone())
    }

    /// Whether to stop.
    pub fn told(&self) -> bool {
        let told = self.told.load(Ordering::Relaxed);
        if told && !self.said.swap(true, Ordering::Relaxed) {
            eprintln!("stopping once what is begun is done; again to stop at once");
        }
        told
    }
}

/// A sign of life on standard error while something runs whose length nobody knows, shown on a
/// terminal only.
pub fn spinner(what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message(what);
    if let Ok(style) = ProgressStyle::with_template("{msg:12} {spinner} {elapsed}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(std::time::Duration::from_millis(100));
    bar
}

/// A progress bar on standard error with rate and time left, shown on a terminal only.
pub fn progress(what: &'static str, steps: usize) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64).with_message(what);
    let template = "{msg:12} {wide_bar} {pos}/{len}, {rate}, {eta} left";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(
            style.with_key("rate", |state: &ProgressState, out: &mut dyn Write| {
                // A terminal that takes no more is no failure of ours.
                let _ = write!(out, "{:.1}/s", state.per_sec());
            }),
        );
    }
    bar
}
