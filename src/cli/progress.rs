//! Progress on standard error, shown on a terminal only. Dropping a bar or a spinner clears it.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// A spinner for work of unknown length.
pub fn spinner(task: &'static str) -> ProgressBar {
    let template = "{msg:12} {spinner} {elapsed}";
    let bar = styled(ProgressBar::new_spinner(), task, template);
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// A bar of `steps` steps with rate and remaining time.
pub fn bar(task: &'static str, steps: usize) -> ProgressBar {
    let template = "{msg:12} {wide_bar} {pos}/{len}, {per_sec}, {eta} left";
    styled(ProgressBar::new(steps as u64), task, template)
}

fn styled(bar: ProgressBar, task: &'static str, template: &str) -> ProgressBar {
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.with_message(task)
}
