//! Where a relative path of an attribute is looked for.

use std::{
    env,
    path::{Path, PathBuf},
};

/// The folders, in order: those of `HYDRO_PATH`, the working directory, the folder of the library.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SearchPath(Vec<PathBuf>);

impl SearchPath {
    /// From the environment, and the folder of the shared library where it is known.
    pub fn from_environment(library_folder: Option<PathBuf>) -> Self {
        let named = env::var_os("HYDRO_PATH");
        let mut folders: Vec<PathBuf> = named
            .iter()
            .flat_map(env::split_paths)
            .filter(|folder| !folder.as_os_str().is_empty())
            .collect();
        folders.extend(env::current_dir().ok());
        folders.extend(library_folder);
        Self(folders)
    }

    /// Exactly these folders.
    pub fn new(folders: Vec<PathBuf>) -> Self {
        Self(folders)
    }

    /// The first of the places where `wanted` exists, or all the places that were tried.
    pub fn find(&self, wanted: &Path) -> Result<PathBuf, Vec<PathBuf>> {
        let places: Vec<PathBuf> = if wanted.is_absolute() {
            vec![wanted.to_owned()]
        } else {
            self.0.iter().map(|folder| folder.join(wanted)).collect()
        };
        match places.iter().find(|place| place.exists()) {
            Some(found) => Ok(found.clone()),
            None => Err(places),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn the_first_folder_wins_and_a_failure_lists_them_all() {
        let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        std::fs::create_dir(second.path().join("b1")).unwrap();
        let path = SearchPath::new(vec![first.path().to_owned(), second.path().to_owned()]);
        assert_eq!(path.find(Path::new("b1")), Ok(second.path().join("b1")));
        std::fs::create_dir(first.path().join("b1")).unwrap();
        assert_eq!(path.find(Path::new("b1")), Ok(first.path().join("b1")));
        let tried = vec![first.path().join("b2"), second.path().join("b2")];
        assert_eq!(path.find(Path::new("b2")), Err(tried));
        assert_eq!(
            path.find(Path::new("/no/such")),
            Err(vec![PathBuf::from("/no/such")])
        );
    }
}
