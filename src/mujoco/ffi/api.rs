//! Which MuJoCo to call: the one that is already in this process.
//!
//! A Python wheel loads its libmujoco with local visibility, so an undefined symbol would not resolve,
//! and a library named at link time would be a second copy. So nothing is linked. One table of function
//! pointers is filled, once, from the first of
//!
//! 1. the global scope (a C program linked to MuJoCo, or `LD_PRELOAD`),
//! 2. a libmujoco that is mapped into the process,
//! 3. for `hydro` and the tests, which have none: the library that `HYDRO_MUJOCO_LIBRARY` names, that of the `mujoco`
//!    package beside the package that holds the program, or the one that `build.rs` found.
//!
//! The layout of MuJoCo's structs changes between releases, so a MuJoCo of another version than the
//! headers is refused, unless both are in [`EQUAL`]; a probe of a small model guards that table ([`super::layout`]).

use std::{
    env,
    ffi::{c_char, c_int},
    fs,
    path::{Path, PathBuf},
    sync::OnceLock,
};

use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use thiserror::Error;

use super::bindings::{self, Functions};
#[cfg(mujoco_plugins)]
use super::layout::{self, Mismatch};

/// The library that `build.rs` found.
const LIBRARY: &str = env!("HYDRO_MUJOCO_LIB");

/// The folder of headers that `build.rs` found.
pub const INCLUDE: &str = env!("HYDRO_MUJOCO_INCLUDE");

/// The version of these headers, readable.
pub const VERSION: &str = env!("HYDRO_MUJOCO_VERSION");

/// Environment variable of `hydro`: the libmujoco to open.
const NAMED_LIBRARY: &str = "HYDRO_MUJOCO_LIBRARY";

/// Releases in which every struct and function of the bindings is the same, by their headers. In 4.0.1 `mujoco.h` has a
/// longer comment and `mjs_getInStringVec`, and `mjrfilament.h` other settings of a renderer; neither is called here.
const EQUAL: [&[i64]; 1] = [&[4_000_000, 4_000_001]];

/// `RTLD_NOLOAD` of glibc and musl: a handle to what is loaded, or none.
const RTLD_NOLOAD: c_int = 4;

/// Why no MuJoCo can be called.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ApiError {
    /// No MuJoCo in this process.
    #[error(
        "no MuJoCo is loaded in this process; load this library from a program that uses MuJoCo {VERSION}"
    )]
    NotLoaded,
    /// Not the version of the headers.
    #[error(
        "this build of hydro is for MuJoCo {}, and the running MuJoCo is {running}: nothing is registered. \
         Take the wheel mujoco=={VERSION}, or build hydro with MUJOCO_DIR naming MuJoCo {running}",
        accepted().join(" and ")
    )]
    Version {
        /// The running one, readable.
        running: String,
    },
    /// A version of the table whose structs are laid out otherwise.
    #[cfg(mujoco_plugins)]
    #[error(
        "MuJoCo {running} lays out its structs otherwise than the headers of {VERSION} ({mismatch}): nothing is registered. \
         Take the wheel mujoco=={VERSION}, and tell the authors of hydro"
    )]
    Layout {
        /// The running one, readable.
        running: String,
        /// The first field that differs.
        mismatch: Mismatch,
    },
    /// There is no such file.
    #[error(
        "no MuJoCo at {}: pip install 'mujoco=={VERSION}' beside this program, or name another by {NAMED_LIBRARY}",
        .0.display()
    )]
    Missing(PathBuf),
    /// The library does not open, or lacks a function.
    #[error("{}: {reason}", .path.display())]
    Library {
        /// Which library.
        path: PathBuf,
        /// Message of the loader.
        reason: String,
    },
}

/// The functions of the running MuJoCo, of the very version of the headers.
pub(crate) struct Api {
    pub(crate) functions: Functions,
    library: Library,
}

static API: OnceLock<Api> = OnceLock::new();

/// Called with the table once it is filled.
static ON_LOAD: OnceLock<fn(&Api)> = OnceLock::new();

impl Api {
    /// The table, where it was filled before.
    pub(crate) fn get() -> Option<&'static Self> {
        API.get()
    }

    /// The MuJoCo that is already in this process.
    pub(crate) fn running() -> Result<&'static Self, ApiError> {
        if let Some(api) = API.get() {
            return Ok(api);
        }
        let (library, path) = already_loaded().ok_or(ApiError::NotLoaded)?;
        Self::fill(library, path)
    }

    /// The MuJoCo that is already in this process, else the one of [`library`].
    pub(crate) fn running_or_opened() -> Result<&'static Self, ApiError> {
        if let Some(api) = API.get() {
            return Ok(api);
        }
        if let Some((library, path)) = already_loaded() {
            return Self::fill(library, path);
        }
        let path = library();
        if !path.is_file() {
            return Err(ApiError::Missing(path));
        }
        // SAFETY: MuJoCo's initialisers have no preconditions.
        let library = unsafe { Library::open(Some(&path), RTLD_NOW | RTLD_LOCAL) };
        let library = library.map_err(|fault| ApiError::Library {
            path: path.clone(),
            reason: fault.to_string(),
        })?;
        Self::fill(library, path)
    }

    fn fill(library: Library, path: PathBuf) -> Result<&'static Self, ApiError> {
        let fault = |reason: libloading::Error| ApiError::Library {
            path: path.clone(),
            reason: reason.to_string(),
        };
        // SAFETY: `mj_version` has had this signature in every release.
        let version = unsafe {
            library
                .get::<unsafe extern "C" fn() -> c_int>(b"mj_version\0")
                .map_err(&fault)?()
        };
        if !fits(version.into(), bindings::mjVERSION_HEADER.into()) {
            return Err(ApiError::Version {
                running: readable(version.into()),
            });
        }
        // One handle for the table, one for variables; both keep the library in memory.
        // SAFETY: as above; the signatures are those of this version's headers.
        let functions = unsafe { Functions::from_library(same_again(&path).map_err(&fault)?) }
            .map_err(&fault)?;
        #[cfg(mujoco_plugins)]
        layout::probe(&functions).map_err(|mismatch| ApiError::Layout {
            running: readable(version.into()),
            mismatch,
        })?;
        let api = API.get_or_init(|| Self { functions, library });
        if let Some(then) = ON_LOAD.get() {
            then(api);
        }
        Ok(api)
    }

    /// Calls `then` with the table: now where it is filled, else once it is.
    pub(super) fn on_load(then: fn(&Self)) {
        ON_LOAD.get_or_init(|| then);
        if let Some(api) = Self::get() {
            then(api);
        }
    }

    /// Address of a variable of MuJoCo's.
    ///
    /// # Safety
    /// `T` is the variable's type.
    pub(crate) unsafe fn variable<T>(&self, name: &[u8]) -> Option<*mut T> {
        // SAFETY: the caller vouches for the type; a symbol's value is the variable's address.
        let symbol = unsafe { self.library.get::<*mut T>(name) };
        symbol.ok().map(|symbol| *symbol)
    }
}

impl std::fmt::Debug for Api {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Api").finish_non_exhaustive()
    }
}

/// A handle to what was found, and its path (empty: the global scope).
fn already_loaded() -> Option<(Library, PathBuf)> {
    let global = Library::this();
    // SAFETY: only looked up, not called.
    if unsafe { global.get::<unsafe extern "C" fn() -> c_int>(b"mj_version\0") }.is_ok() {
        return Some((global, PathBuf::new()));
    }
    let mut mapped: Vec<PathBuf> = mapped_files()
        .into_iter()
        .map(|(_, path)| path)
        .filter(|path| is_mujoco(path))
        .collect();
    mapped.dedup();
    mapped
        .into_iter()
        .find_map(|path| same_again(&path).ok().map(|library| (library, path)))
}

/// Another handle to a library that is loaded; loads nothing.
fn same_again(path: &Path) -> Result<Library, libloading::Error> {
    if path.as_os_str().is_empty() {
        return Ok(Library::this());
    }
    // SAFETY: the library is loaded already, so no initialiser runs.
    unsafe { Library::open(Some(path), RTLD_NOW | RTLD_NOLOAD) }
}

fn is_mujoco(path: &Path) -> bool {
    path.file_name()
        .is_some_and(|name| name.to_string_lossy().starts_with("libmujoco.so"))
}

/// Files mapped into this process, with the addresses they cover.
fn mapped_files() -> Vec<(std::ops::Range<usize>, PathBuf)> {
    let maps = fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let line = |line: &str| {
        let path = line.find('/').map(|at| PathBuf::from(&line[at..]))?;
        let (from, to) = line.split_whitespace().next()?.split_once('-')?;
        let address = |text| usize::from_str_radix(text, 16).ok();
        Some((address(from)?..address(to)?, path))
    };
    maps.lines().filter_map(line).collect()
}

/// The libmujoco that is opened where none is in the process.
pub fn library() -> PathBuf {
    if let Some(named) = env::var_os(NAMED_LIBRARY).filter(|name| !name.is_empty()) {
        return PathBuf::from(named);
    }
    let Some(package) = python_package() else {
        return PathBuf::from(LIBRARY);
    };
    let mujoco = package.with_file_name("mujoco");
    let files = fs::read_dir(&mujoco).into_iter().flatten().flatten();
    let found = files
        .map(|entry| entry.path())
        .filter(|path| is_mujoco(path));
    found.max().unwrap_or_else(|| mujoco.join("libmujoco.so"))
}

/// The Python package `hydro_mujoco` that this program is part of: the program is its `bin/hydro`.
pub fn python_package() -> Option<PathBuf> {
    let package = own_folder()?.parent()?.to_owned();
    (package.file_name()? == "hydro_mujoco").then_some(package)
}

/// The file that holds this code: the shared library, or the program.
pub(crate) fn own_file() -> Option<PathBuf> {
    let here = own_file as *const () as usize;
    mapped_files()
        .into_iter()
        .find(|(addresses, _)| addresses.contains(&here))
        .map(|(_, path)| path)
}

/// The folder of [`own_file`].
pub(crate) fn own_folder() -> Option<PathBuf> {
    own_file()?.parent().map(Path::to_owned)
}

/// Another copy of the plugin library in this process.
pub(crate) fn other_copy() -> Option<PathBuf> {
    let own = own_file()?;
    let name = own.file_name()?;
    mapped_files()
        .into_iter()
        .map(|(_, path)| path)
        .find(|path| *path != own && path.file_name() == Some(name))
}

/// The releases that this build runs in, readable.
pub fn accepted() -> Vec<String> {
    let headers = i64::from(bindings::mjVERSION_HEADER);
    let equal = EQUAL.into_iter().find(|group| group.contains(&headers));
    let all = equal.map_or_else(|| vec![headers], <[i64]>::to_vec);
    all.into_iter().map(readable).collect()
}

/// Whether bindings of the version `headers` may call a MuJoCo of the version `running`.
fn fits(running: i64, headers: i64) -> bool {
    let both = |group: &&[i64]| group.contains(&running) && group.contains(&headers);
    running == headers || EQUAL.iter().any(both)
}

/// 222 -> 2.2.2; 4000000 -> 4.0.0. The encoding changed when a minor number reached ten.
fn readable(version: i64) -> String {
    if version >= 1_000_000 {
        format!(
            "{}.{}.{}",
            version / 1_000_000,
            version / 1000 % 1000,
            version % 1000
        )
    } else {
        format!("{}.{}.{}", version / 100, version / 10 % 10, version % 10)
    }
}

/// Warns through the running MuJoCo even where its version is not the headers', in its own way:
/// `mju_warning` is variadic since 2.3.
pub(crate) fn warn_whatever_version(text: &str) {
    let Some((library, _)) = already_loaded() else {
        return;
    };
    let Ok(text) = std::ffi::CString::new(text) else {
        return;
    };
    // SAFETY: the signatures are those of the running version.
    unsafe {
        let Ok(version) = library.get::<unsafe extern "C" fn() -> c_int>(b"mj_version\0") else {
            return;
        };
        if version() < FIRST_WITH_PLUGINS {
            if let Ok(warning) =
                library.get::<unsafe extern "C" fn(*const c_char)>(b"mju_warning\0")
            {
                warning(text.as_ptr());
            }
        } else if let Ok(warning) =
            library.get::<unsafe extern "C" fn(*const c_char, ...)>(b"mju_warning\0")
        {
            warning(c"%s".as_ptr(), text.as_ptr());
        }
    }
}

/// 2.3.0, whose warnings became variadic and which brought engine plugins.
const FIRST_WITH_PLUGINS: c_int = 230;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_read_as_people_write_them() {
        assert_eq!(readable(222), "2.2.2");
        assert_eq!(readable(316), "3.1.6");
        assert_eq!(readable(3_017_000), "3.17.0");
        assert_eq!(readable(4_000_000), "4.0.0");
    }

    #[test]
    fn a_release_fits_its_equals_alone() {
        assert!(fits(4_000_001, 4_000_000) && fits(4_000_000, 4_000_001));
        assert!(fits(3_017_000, 3_017_000) && fits(222, 222));
        assert!(!fits(3_017_000, 4_000_000) && !fits(4_000_002, 4_000_000));
        assert!(!fits(4_001_000, 4_000_000) && !fits(222, 4_000_000));
        assert!(accepted().contains(&VERSION.to_owned()));
    }

    #[test]
    fn this_program_finds_its_own_folder() {
        assert_eq!(
            own_folder(),
            std::env::current_exe()
                .ok()
                .and_then(|exe| exe.parent().map(Path::to_owned))
        );
    }
}
