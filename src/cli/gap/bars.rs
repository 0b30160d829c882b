//! Progress of the stages: a bar for each piece of work that the library reports.

use std::sync::Mutex;

use crate::cli::progress::Progress;

/// Shows the progress that the library reports from any thread.
#[derive(Default)]
pub(super) struct Bars {
    now: Mutex<Option<Bar>>,
}

struct Bar {
    what: String,
    total: usize,
    done: usize,
    progress: Progress,
}

impl Bars {
    /// Shows that `done` of `total` parts of a piece of work are done.
    pub(super) fn tell(&self, what: &str, done: usize, total: usize) {
        let Ok(mut now) = self.now.lock() else { return };
        let same = now
            .as_ref()
            .is_some_and(|bar| bar.what == what && bar.total == total && bar.done <= bar.total);
        if !same {
            if let Some(bar) = now.take() {
                bar.progress.finish();
            }
            *now = Some(Bar {
                what: what.to_owned(),
                total,
                done: 0,
                progress: Progress::new(what, total as u64),
            });
        }
        if let Some(bar) = now.as_mut() {
            // Threads tell out of order; a new round of the same work starts at one.
            bar.done = if done == 1 { 1 } else { bar.done.max(done) };
            bar.progress.at(bar.done as u64, "");
        }
    }

    /// Clears the last bar.
    pub(super) fn finish(&self) {
        if let Ok(mut now) = self.now.lock()
            && let Some(bar) = now.take()
        {
            bar.progress.finish();
        }
    }
}
