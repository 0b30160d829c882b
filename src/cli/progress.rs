//! Progress of long work: a bar on a terminal, plain lines in a log.

use std::{
    io::IsTerminal,
    sync::Mutex,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};

/// Time between lines in a log.
const LOG_PERIOD: Duration = Duration::from_secs(10);

/// Environment variable: seconds between lines, for a program that reads them.
const LOG_SECONDS: &str = "HYDRO_LOG_SECONDS";

/// The period that the environment gives, else [`LOG_PERIOD`].
fn log_period() -> Duration {
    std::env::var(LOG_SECONDS)
        .ok()
        .and_then(|text| text.parse().ok())
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .unwrap_or(LOG_PERIOD)
}

/// Counts finished parts of a long work on standard error.
pub(super) struct Progress {
    bar: Option<ProgressBar>,
    what: String,
    total: u64,
    log: Mutex<Log>,
    period: Duration,
}

struct Log {
    done: u64,
    started: Instant,
    printed: Option<Instant>,
}

impl Progress {
    /// A bar with `total` parts, or plain lines where standard error is no terminal.
    pub(super) fn new(what: &str, total: u64) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(total);
            let style = ProgressStyle::with_template(
                "{prefix:>12} [{bar:32}] {pos}/{len} {elapsed} left {eta}  {wide_msg}",
            );
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.set_prefix(what.to_owned());
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        });
        Self {
            bar,
            what: what.to_owned(),
            total,
            log: Mutex::new(Log {
                done: 0,
                started: Instant::now(),
                printed: None,
            }),
            period: log_period(),
        }
    }

    /// A line of its own, above the bar.
    pub(super) fn say(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.println(line),
            None => eprintln!("{line}"),
        }
    }

    /// Sets how many parts are done, with a few words.
    pub(super) fn at(&self, done: u64, words: &str) {
        if let Some(bar) = &self.bar {
            bar.set_position(done);
            bar.set_message(words.to_owned());
            return;
        }
        let Ok(mut log) = self.log.lock() else { return };
        log.done = done;
        let due = log.printed.is_none_or(|at| at.elapsed() >= self.period);
        if due || done == self.total {
            log.printed = Some(Instant::now());
            let elapsed = log.started.elapsed().as_secs_f64();
            // Before the first part is done nobody knows how long the others will take.
            let left = match done {
                0 => String::new(),
                _ => {
                    let pace = elapsed / done as f64;
                    format!(
                        ", {:.0} s left",
                        pace * self.total.saturating_sub(done) as f64
                    )
                }
            };
            eprintln!(
                "{}: {done}/{} in {elapsed:.0} s{left}  {words}",
                self.what, self.total
            );
        }
    }

    /// One more part is done.
    #[cfg(mujoco_plugins)]
    pub(super) fn tick(&self, words: &str) {
        let done = match &self.bar {
            Some(bar) => bar.position() + 1,
            None => self.log.lock().map_or(0, |log| log.done + 1),
        };
        self.at(done, words);
    }

    /// Clears the bar.
    pub(super) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
