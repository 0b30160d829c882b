//! The folder of the MJCF that this thread compiles or makes a simulation of.
//!
//! MuJoCo does not tell a plugin where the MJCF lies; a program that loads it itself knows.

use std::{
    cell::RefCell,
    path::{Path, PathBuf},
};

thread_local! {
    static FOLDER: RefCell<Option<PathBuf>> = const { RefCell::new(None) };
}

/// Runs `call` with the folder known to the plugins.
pub(crate) fn known<T>(folder: Option<&Path>, call: impl FnOnce() -> T) -> T {
    struct Restore(Option<PathBuf>);
    impl Drop for Restore {
        fn drop(&mut self) {
            FOLDER.set(self.0.take());
        }
    }
    let _restore = Restore(FOLDER.replace(folder.map(Path::to_owned)));
    call()
}

/// The folder, where it is known.
pub(crate) fn current() -> Option<PathBuf> {
    FOLDER.with_borrow(Clone::clone)
}

/// The absolute folder of an MJCF.
pub(crate) fn folder(mjcf: &Path) -> Option<PathBuf> {
    let path = std::path::absolute(mjcf).ok()?;
    path.parent().map(Path::to_owned)
}
