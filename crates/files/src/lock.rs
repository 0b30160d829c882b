//! A folder that one process works in.

use std::{
    fmt,
    fs::{self, File, OpenOptions, TryLockError},
    io::{Error, ErrorKind, Read as _, Result, Write as _},
    os::unix::fs::{MetadataExt as _, OpenOptionsExt as _},
    path::{Path, PathBuf},
};

use rustix::fs::OFlags;

use crate::message::short;

/// Times that a lock is tried for whose file goes away each time.
const ATTEMPTS: usize = 100;

/// Another process holds the lock.
#[derive(Debug)]
pub struct Busy {
    /// Its number and command, as it wrote them.
    holder: String,
}

impl fmt::Display for Busy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.holder.as_str() {
            "" => f.write_str("another process is at work there"),
            holder => write!(f, "process {holder} is at work there"),
        }
    }
}

impl std::error::Error for Busy {}

/// A lock, as long as this lives; the system lets go of that of a process that died.
#[derive(Debug)]
pub struct FolderLock {
    path: PathBuf,
    /// `None` where the file system knows no locks.
    file: Option<File>,
}

impl FolderLock {
    /// Takes the lock whose file is `path`, and writes `command` into it for others to read.
    ///
    /// # Errors
    /// [`Busy`] as the inner error where another process holds it; a file that cannot be made.
    pub fn take(path: &Path, command: &str) -> Result<Self> {
        for _ in 0..ATTEMPTS {
            // A link that stands there is not followed, nor is a pipe waited for.
            let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK;
            let mut file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .custom_flags(flags.bits().cast_signed())
                .open(path)?;
            if !file.metadata()?.is_file() {
                return Err(Error::other("the lock is no file"));
            }
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let mut holder = String::new();
                    // What cannot be read is left out of the message.
                    let _ = (&mut file).take(4096).read_to_string(&mut holder);
                    let holder = short(holder);
                    return Err(Error::new(ErrorKind::WouldBlock, Busy { holder }));
                }
                Err(TryLockError::Error(_)) => {
                    return Ok(Self {
                        path: path.to_owned(),
                        file: None,
                    });
                }
            }
            // The holder before may have removed the file between the opening and the locking.
            let there = fs::symlink_metadata(path).map(|about| about.ino());
            if there.ok() != Some(file.metadata()?.ino()) {
                continue;
            }
            file.set_len(0)?;
            write!(file, "{} ({command})", std::process::id())?;
            return Ok(Self {
                path: path.to_owned(),
                file: Some(file),
            });
        }
        let holder = String::new();
        Err(Error::new(ErrorKind::WouldBlock, Busy { holder }))
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        if self.file.is_some() {
            // A file that stays is taken over by the next process.
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_second_one_is_told_of_the_first() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(".lock");
        let first = FolderLock::take(&path, "hydro gap run").unwrap();
        let message = FolderLock::take(&path, "other").unwrap_err().to_string();
        let expected = format!(
            "process {} (hydro gap run) is at work there",
            std::process::id()
        );
        assert_eq!(message, expected);
        drop(first);
        assert!(!path.exists());
        FolderLock::take(&path, "other").unwrap();
    }

    #[test]
    fn the_lock_of_a_dead_process_is_taken_over_and_no_link_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (path, victim) = (folder.path().join(".lock"), folder.path().join("victim"));
        fs::write(&path, "1 (long dead)").unwrap();
        drop(FolderLock::take(&path, "x").unwrap());
        fs::write(&victim, "precious").unwrap();
        std::os::unix::fs::symlink(&victim, &path).unwrap();
        FolderLock::take(&path, "x").unwrap_err();
        assert_eq!(fs::read_to_string(&victim).unwrap(), "precious");
    }
}
