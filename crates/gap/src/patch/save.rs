//! A patched model on disk.

use std::{io::Write as _, path::Path};

use super::error::PatchError;

/// Writes a patched model to a file that does not exist, or holds the same already; whole or not at all.
///
/// # Errors
/// A file that holds something else, a folder that cannot be written to.
pub fn save(xml: &str, path: &Path) -> Result<(), PatchError> {
    let fault = |source| PatchError::Write {
        path: path.to_owned(),
        source,
    };
    let overwrites = || PatchError::Overwrites {
        path: path.to_owned(),
    };
    match hydro_files::read(path, hydro_files::TEXT) {
        Ok(found) if found == xml.as_bytes() => return Ok(()),
        Ok(_) => return Err(overwrites()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
        Err(error) => return Err(fault(error)),
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(fault)?;
    file.write_all(xml.as_bytes()).map_err(fault)?;
    file.as_file().sync_all().map_err(fault)?;
    file.persist_noclobber(path).map_err(|error| {
        if error.error.kind() == std::io::ErrorKind::AlreadyExists {
            overwrites()
        } else {
            fault(error.error)
        }
    })?;
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::fs;

    #[test]
    fn nothing_is_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("patched.xml");
        save("<mujoco/>", &path).unwrap();
        save("<mujoco/>", &path).unwrap();
        let text = save("<mujoco model=\"b\"/>", &path)
            .unwrap_err()
            .to_string();
        assert!(
            text.contains("patched.xml") && text.contains("nothing was written"),
            "{text}"
        );
        assert_eq!(fs::read_to_string(&path).unwrap(), "<mujoco/>");
        let text = save("<mujoco/>", &folder.path().join("none/patched.xml"))
            .unwrap_err()
            .to_string();
        assert!(text.contains("none"), "{text}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
