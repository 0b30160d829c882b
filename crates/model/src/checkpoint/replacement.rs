//! One folder in place of another, whole at every moment.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use rustix::fs::{CWD, RenameFlags, renameat_with};

use crate::document::names_in;

/// Moves `new` to `folder`. What stood there, if anything, ends up at `new` or at `old`.
pub(super) fn replace(new: &Path, folder: &Path, old: &Path) -> io::Result<()> {
    if !folder.exists() {
        return fs::rename(new, folder);
    }
    // A folder cannot be renamed over a full one, but the two can change places in one step, so that a
    // process killed at any moment leaves one of them there. Some file systems do not know how.
    exchange(new, folder).or_else(|_| step_aside(new, folder, old))
}

/// Lets two paths change places at once.
pub(super) fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    Ok(renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE)?)
}

/// Moves `folder` to `old` and `new` to `folder`; `old` returns if the latter fails.
pub(super) fn step_aside(new: &Path, folder: &Path, old: &Path) -> io::Result<()> {
    fs::rename(folder, old)?;
    fs::rename(new, folder).inspect_err(|_| {
        // Nothing more can be done if this fails too; the first error is the one to report.
        let _ = fs::rename(old, folder);
    })
}

/// The folder in which a save is prepared, removed with what is left in it, whole or not.
pub(super) struct Partial {
    pub(super) folder: PathBuf,
    /// Locked as long as the save runs; the system lets go of the lock of a process that died.
    _lock: Option<fs::File>,
}

impl Partial {
    /// A new folder in `parent` for a save of `name`. What stands under its name already, a link too, is left alone.
    pub(super) fn new(parent: &Path, name: &str) -> io::Result<Self> {
        let mut number = std::process::id();
        let folder = loop {
            let folder = parent.join(format!(".{name}.{number}.partial"));
            match fs::create_dir(&folder) {
                Ok(()) => break folder,
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
                Err(_) => number = number.wrapping_add(0x1_0001),
            }
        };
        // Where the file system knows no locks the folder passes for abandoned once another save ends.
        let lock = fs::File::open(&folder).ok();
        let lock = lock.filter(|lock| lock.try_lock().is_ok());
        Ok(Self {
            folder,
            _lock: lock,
        })
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        // What cannot be removed is hidden by its name; the outcome of the save is already known.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Removes what saves of `name` left in `parent` when they were killed.
pub(super) fn remove_abandoned(parent: &Path, name: &str) {
    for found in names_in(parent) {
        let process = found
            .strip_prefix(&format!(".{name}."))
            .and_then(|rest| rest.strip_suffix(".partial"));
        if process.is_none_or(|process| process.parse::<u32>().is_err()) {
            continue;
        }
        let folder = parent.join(found);
        let abandoned = fs::File::open(&folder)
            .is_ok_and(|file| !matches!(file.try_lock(), Err(fs::TryLockError::WouldBlock)));
        if abandoned {
            // As in `Partial`: the save itself has succeeded.
            let _ = fs::remove_dir_all(&folder);
        }
    }
}
