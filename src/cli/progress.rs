//! Progress on standard error, shown on a terminal only.

use std::fmt::Write;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

/// A spinner for work of unknown length.
pub fn spinner(task: &'static str) -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message(task);
    if let Ok(style) = ProgressStyle::with_template("{msg:12} {spinner} {elapsed}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// A bar of `steps` steps with rate and remaining time.
pub fn bar(task: &'static str, steps: usize) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64).with_message(task);
    let template = "{msg:12} {wide_bar} {pos}/{len}, {rate}, {eta} left";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(
            style.with_key("rate", |state: &ProgressState, out: &mut dyn Write| {
                // A closed terminal is no reason to stop.
                let _ = write!(out, "{:.1}/s", state.per_sec());
            }),
        );
    }
    bar
}
