//! What the process itself has used, and how it shows that it is still at work.

use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use crate::recover::Workers;

/// All of the machine's cores.
#[derive(Clone, Copy, Debug)]
pub struct AllCores;

impl Workers for AllCores {
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

/// A progress bar on standard error, shown on a terminal only.
pub fn progress(what: &'static str, steps: usize) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64).with_message(what);
    if let Ok(style) = ProgressStyle::with_template("{msg:12} {wide_bar} {pos}/{len} {eta} left") {
        bar.set_style(style);
    }
    bar
}
