//! Writing a file whole or not at all.

use std::{
    fs::{self, File, Permissions},
    io::{Result, Write as _},
    os::unix::fs::PermissionsExt as _,
    path::Path,
};

/// Start and end of the names of files that are being written.
const BEING_WRITTEN: (&str, &str) = (".hydro-", ".part");

/// Writes `bytes` to a file, as [`write_whole_with`] does.
///
/// # Errors
/// A folder that cannot be written to, a full disk; the old file then stays.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    write_whole_with(path, |file| file.write_all(bytes))
}

/// Lets `fill` write a new file of a random name beside `path`, flushes it to the disk and renames it. A link that stands at
/// `path` is replaced, not followed.
///
/// # Errors
/// As [`write_whole`]; what `fill` gives.
pub fn write_whole_with(path: &Path, fill: impl FnOnce(&mut File) -> Result<()>) -> Result<()> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let mut file = tempfile::Builder::new()
        .prefix(BEING_WRITTEN.0)
        .suffix(BEING_WRITTEN.1)
        // The usual permissions less what the user withholds; a temporary file has fewer.
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(folder.unwrap_or(Path::new(".")))?;
    fill(file.as_file_mut())?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// Removes the files of [`write_whole`] that a killed process left in a folder. Only for who holds the folder's lock: another
/// process would lose what it writes. What cannot be removed stays.
pub fn remove_abandoned(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_file && name.starts_with(BEING_WRITTEN.0) && name.ends_with(BEING_WRITTEN.1) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn nothing_is_written_through_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let (victim, path) = (folder.path().join("victim"), folder.path().join("out"));
        fs::write(&victim, "precious").unwrap();
        symlink(&victim, &path).unwrap();
        write_whole(&path, b"new").unwrap();
        assert_eq!(fs::read_to_string(&victim).unwrap(), "precious");
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert!(!path.is_symlink());
        let names = fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(names, 2, "nothing else is left behind");
    }

    #[test]
    fn what_a_killed_process_left_is_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at(".hydro-aB3xYz.part"), "half").unwrap();
        fs::create_dir(at(".hydro-folder.part")).unwrap();
        symlink(at("card.json"), at(".hydro-link.part")).unwrap();
        for name in ["card.json", "mine.part", ".hydro-notes"] {
            fs::write(at(name), "precious").unwrap();
        }
        remove_abandoned(folder.path());
        assert!(!at(".hydro-aB3xYz.part").exists());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 5);
        remove_abandoned(&at("not there"));
    }

    #[test]
    fn a_write_that_fails_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("full");
        fs::create_dir(&path).unwrap();
        write_whole(&path, b"new").unwrap_err();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
