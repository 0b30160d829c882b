//! The panic boundary round every function that MuJoCo calls.
//!
//! A panic that unwound into C would kill the process, Python and all. Here it becomes one warning and
//! the value that the caller names: a refused load, or a force of zero.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::atomic::{AtomicBool, Ordering},
};

use super::{api::Api, warn::warn};

/// Runs the body of a callback; `fallback` is returned where it panics.
pub(crate) fn guard<T>(callback: &'static str, fallback: T, body: impl FnOnce() -> T) -> T {
    static WARNED: AtomicBool = AtomicBool::new(false);
    // Unwind safety: state is either MuJoCo's, written last, or behind locks that survive poisoning.
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(value) => value,
        Err(payload) => {
            let text = format!(
                "internal fault in {callback}: {}",
                message(payload.as_ref())
            );
            drop(payload);
            if let Some(api) = Api::get()
                && !WARNED.swap(true, Ordering::Relaxed)
            {
                warn(api, &text);
            }
            fallback
        }
    }
}

fn message(payload: &(dyn Any + Send)) -> &str {
    payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_the_fallback() {
        assert_eq!(guard("test", -1, || 7), 7);
        assert_eq!(guard("test", -1, || panic!("on purpose")), -1);
    }

    #[test]
    fn the_message_is_kept() {
        assert_eq!(message(&"plain"), "plain");
        assert_eq!(message(&String::from("formatted")), "formatted");
        assert_eq!(message(&3), "no message");
    }
}
