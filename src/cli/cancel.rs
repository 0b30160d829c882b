//! Ctrl-C and the signals of a shutdown.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use anyhow::Context as _;

/// Time that a command has to come to an orderly end. Files are whole at every moment, so that a later end costs no more than the
/// work since the last of them.
const PATIENCE: Duration = Duration::from_millis(800);

/// Advice of commands that go on by themselves.
pub(super) const GOES_ON: &str = "the same command goes on from what was saved";

/// A flag that Ctrl-C and the signals of a shutdown set. Where it is not heeded within [`PATIENCE`] the program ends all the same,
/// with advice how to go on.
pub(super) fn cancel_on_signal(advice: &'static str) -> anyhow::Result<Arc<AtomicBool>> {
    let cancel = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&cancel);
    ctrlc::set_handler(move || {
        flag.store(true, Ordering::Relaxed);
        std::thread::sleep(PATIENCE);
        eprintln!("hydro: interrupted; {advice}");
        std::process::exit(130);
    })
    .context("watching for Ctrl-C")?;
    Ok(cancel)
}
