//! A progress bar for what takes longer than a second.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// How long nothing is shown: what is done by then needs no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// Progress on standard error, if that is a terminal.
pub(crate) struct Progress {
    doing: &'static str,
    total: Option<u64>,
    start: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Begins something with this many parts, if that is known.
    pub(crate) fn start(doing: &'static str, total: Option<usize>) -> Self {
        let total = total.map(|total| total as u64);
        Self { doing, total, start: Instant::now(), bar: None }
    }

    /// So many parts are done.
    pub(crate) fn set(&mut self, done: usize) {
        if self.bar.is_none() && self.start.elapsed() < PATIENCE {
            return;
        }
        self.bar.get_or_insert_with(|| bar(self.doing, self.total)).set_position(done as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn bar(doing: &'static str, total: Option<u64>) -> ProgressBar {
    let (bar, template) = match total {
        Some(total) => (ProgressBar::new(total), "{msg} {wide_bar} {pos}/{len}, {eta} left"),
        None => (ProgressBar::no_length(), "{msg} {pos}"),
    };
    // The bar that indicatif has by itself, should it not like the template.
    let style = ProgressStyle::with_template(template).unwrap_or(ProgressStyle::default_bar());
    bar.with_style(style).with_message(doing)
}
