//! Ctrl-C and the signals of a shutdown.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use anyhow::Context as _;

/// A flag that Ctrl-C and the signals of a shutdown set; a second signal ends the program at once.
pub(super) fn cancel_on_signal() -> anyhow::Result<Arc<AtomicBool>> {
    let cancel = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&cancel);
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .context("watching for Ctrl-C")?;
    Ok(cancel)
}
