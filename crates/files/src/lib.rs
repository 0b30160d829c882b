//! Files and folders that a user names: any of them may be a pipe, a device, a link, or larger than the memory.
//!
//! - [`open`], [`read`], [`read_text`]: a file's kind and size come before its content.
//! - [`write_whole`], [`write_whole_with`]: a reader sees the old file or the new one, and nothing is written through a link.
//! - [`remove_abandoned`]: what a killed process had not finished is removed.
//! - [`FolderLock`]: one process works in a folder; a second one is told of the first.
//! - [`Archive`]: arrays of an `.npz` whose headers are not believed.
//! - [`short`], [`one_line`], [`number`], [`rounded`]: texts and numbers of any length in a message.
//!
//! ```
//! let folder = std::env::temp_dir();
//! let error = hydro_files::read(&folder, hydro_files::TEXT).expect_err("no file");
//! assert_eq!(error.to_string(), "is a folder; expected a file");
//! ```

mod lock;
mod message;
mod npz;
mod reading;
mod writing;

pub use self::{
    lock::{Busy, FolderLock},
    message::{number, one_line, rounded, short},
    npz::{Archive, Array, NpzError},
    reading::{TEXT, open, read, read_text},
    writing::{remove_abandoned, write_whole, write_whole_with},
};
