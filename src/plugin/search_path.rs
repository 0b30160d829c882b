//! The folders in which a relative path of an attribute is looked for.

use std::{
    env,
    path::{Component, Path, PathBuf},
};

/// The folder of checkpoints in a checkout or an installed package.
const MODELS: &str = "models";
/// Folders between a project and its library (`target/NAME/release`) or scene (`mjcf/gap`), at most.
const LEVELS: usize = 3;

/// The folders, in order: those of `HYDRO_PATH`, the working directory, the folder of the library, that of the MJCF
/// where it is known, and the project above each of the last two: the nearest folder that holds `models`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SearchPath {
    folders: Vec<PathBuf>,
    /// Folders of checkpoints, where a bare name is looked for last.
    models: Vec<PathBuf>,
}

impl SearchPath {
    /// The documented order; the folders of the shared library and of the MJCF, where they are known.
    pub fn from_environment(library: Option<PathBuf>, mjcf: Option<PathBuf>) -> Self {
        let named = env::var_os("HYDRO_PATH");
        let mut folders: Vec<PathBuf> = named
            .iter()
            .flat_map(env::split_paths)
            .filter(|folder| !folder.as_os_str().is_empty())
            .collect();
        folders.extend(env::current_dir().ok());
        let known: Vec<PathBuf> = library.into_iter().chain(mjcf).collect();
        let mut projects: Vec<PathBuf> = known.iter().filter_map(|from| project(from)).collect();
        projects.dedup();
        let models = projects.iter().map(|root| root.join(MODELS)).collect();
        for folder in known.into_iter().chain(projects) {
            if !folders.contains(&folder) {
                folders.push(folder);
            }
        }
        Self { folders, models }
    }

    /// Exactly these folders.
    pub fn new(folders: Vec<PathBuf>) -> Self {
        Self {
            folders,
            models: Vec::new(),
        }
    }

    /// The first of the places where `wanted` exists, or all the places that were tried.
    pub fn find(&self, wanted: &Path) -> Result<PathBuf, Vec<PathBuf>> {
        let mut parts = wanted.components();
        let bare = matches!(
            (parts.next(), parts.next()),
            (Some(Component::Normal(_)), None)
        );
        let models = self.models.iter().filter(|_| bare);
        let places: Vec<PathBuf> = if wanted.is_absolute() {
            vec![wanted.to_owned()]
        } else {
            let folders = self.folders.iter().chain(models);
            folders.map(|folder| folder.join(wanted)).collect()
        };
        match places.iter().find(|place| place.exists()) {
            Some(found) => Ok(found.clone()),
            None => Err(places),
        }
    }
}

/// The nearest folder that holds `models`, from here at most [`LEVELS`] upwards.
fn project(from: &Path) -> Option<PathBuf> {
    let mut above = from.ancestors().take(LEVELS + 1);
    above
        .find(|folder| folder.join(MODELS).is_dir())
        .map(Path::to_owned)
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

    /// A library in the build folder of a checkout, called from any directory.
    #[test]
    fn a_checkpoint_of_the_project_is_found_from_its_library_and_its_scenes() {
        let root = tempfile::tempdir().unwrap();
        let (library, scenes) = (root.path().join("target/release"), root.path().join("mjcf"));
        let checkpoint = root.path().join("models/only-here");
        for folder in [&library, &scenes, &checkpoint] {
            std::fs::create_dir_all(folder).unwrap();
        }
        for known in [
            (Some(library.clone()), None),
            (None, Some(scenes.clone())),
            (Some(library.clone()), Some(scenes.clone())),
        ] {
            let path = SearchPath::from_environment(known.0, known.1);
            let found = path.find(Path::new("models/only-here"));
            assert_eq!(found.as_ref(), Ok(&checkpoint));
            assert_eq!(path.find(Path::new("only-here")), Ok(checkpoint.clone()));
            let tried = path.find(Path::new("models/none")).unwrap_err();
            assert!(tried.contains(&root.path().join("models/none")));
        }
        // Beside the library comes before the project.
        let beside = library.join("models/only-here");
        std::fs::create_dir_all(&beside).unwrap();
        let path = SearchPath::from_environment(Some(library), Some(scenes));
        assert_eq!(path.find(Path::new("models/only-here")), Ok(beside));
    }
}
