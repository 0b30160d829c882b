//! Why a plugin refused the latest model: the text for the error of a load that this process asked for.
//!
//! MuJoCo's own error says only that a plugin refused.

use parking_lot::Mutex;

static LAST_REFUSAL: Mutex<Option<String>> = Mutex::new(None);

/// Keeps the reason of a refusal.
#[cfg(mujoco_plugins)]
pub(crate) fn remember(reason: &str) {
    LAST_REFUSAL.lock().replace(reason.to_owned());
}

/// Takes the reason of the latest refusal.
pub(crate) fn take() -> Option<String> {
    LAST_REFUSAL.lock().take()
}

/// Forgets a refusal of an earlier model.
pub(crate) fn forget() {
    drop(take());
}
