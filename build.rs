//! Finds MuJoCo and writes the bindings of `src/mujoco/ffi/bindings.rs`.
//!
//! Looked for in this order; the first that has both headers and library is taken:
//!
//! 1. `MUJOCO_DIR`: an absolute path, a MuJoCo release, a `mujoco` wheel's package folder, or `/usr`;
//! 2. the `mujoco` wheel of the project's `.venv`, then of the active `python3`;
//! 3. Debian's `libmujoco-dev`.
//!
//! Nothing is linked: the bindings are a table of function pointers that is filled at run time from
//! the MuJoCo that is already there (`src/mujoco/ffi/api.rs`). A build without the `mujoco` feature looks
//! for nothing.

#![allow(
    clippy::print_stderr,
    clippy::exit,
    reason = "how a build script says that it failed"
)]

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    #[cfg(feature = "mujoco")]
    mujoco::generate();
}

#[cfg(feature = "mujoco")]
mod mujoco {
    use std::{
        env, fs,
        path::{Path, PathBuf},
        process::{self, Command},
    };

    /// Folders for the library, below the one that also holds `include/mujoco`.
    const LIBRARY_FOLDERS: [&str; 5] = [
        "",
        "lib",
        "lib/x86_64-linux-gnu",
        "lib/aarch64-linux-gnu",
        "lib64",
    ];

    /// Engine plugins came with 2.3; their header says so.
    const PLUGIN_HEADER: &str = "mjplugin.h";

    /// Functions of a MuJoCo older than engine plugins: Debian 12's.
    const FUNCTIONS: &[&str] = &[
        "mj_version",
        "mj_loadXML",
        "mj_deleteModel",
        "mj_makeData",
        "mj_copyData",
        "mj_resetData",
        "mj_deleteData",
        "mj_step",
        "mj_forward",
        "mj_inverse",
        "mj_rnePostConstraint",
        "mj_name2id",
        "mj_id2name",
        "mju_warning",
    ];

    /// Further functions, for engine plugins.
    const PLUGIN_FUNCTIONS: &[&str] = &[
        "mj_stateSize",
        "mj_getState",
        "mj_setState",
        "mj_getPluginConfig",
        "mj_loadPluginLibrary",
        "mj_makeM",
        "mj_factorM",
        "mj_projectConstraint",
        "mj_copyModel",
        "mj_setConst",
        "mj_differentiatePos",
        "mj_kinematics",
        "mj_comPos",
        "mj_comVel",
        "mj_jacBody",
        "mj_integratePos",
        "mj_parseXML",
        "mj_parseXMLString",
        "mj_compile",
        "mj_deleteSpec",
        "mjs_getError",
        "mjs_firstElement",
        "mjs_nextElement",
        "mjs_asBody",
        "mjs_addBody",
        "mjs_getId",
        "mjs_findElement",
        "mjs_getParent",
        "mjs_asJoint",
        "mjs_addJoint",
        "mjs_setName",
        "mjp_defaultPlugin",
        "mjp_registerPlugin",
        "mjp_getPlugin",
        "mjv_initGeom",
        "mjv_connector",
    ];

    const TYPES: &[&str] = &[
        "mjModel",
        "mjData",
        "mjtObj",
        "mjtJoint",
        "mjtGeom",
        "mjtIntegrator",
        "mjtDisableBit",
        "mjtStage",
    ];

    const PLUGIN_TYPES: &[&str] = &[
        "mjpPlugin",
        "mjvScene",
        "mjvOption",
        "mjtPluginCapabilityBit",
        "mjtState",
        "mjtVisFlag",
        "mjtSensor",
        "mjtTrn",
        "mjtDyn",
        "mjtGain",
        "mjtBias",
        "mjtSolver",
        "mjtSameFrame",
        "mjtLimited",
        "mjtWarning",
    ];

    /// Headers and library of one MuJoCo.
    struct Found {
        /// The folder that holds `mujoco/mujoco.h`.
        include: PathBuf,
        library: PathBuf,
        /// `mjVERSION_HEADER`: 222 for 2.2.2, 4000000 for 4.0.0.
        version: u32,
        engine_plugins: bool,
    }

    pub(crate) fn generate() {
        println!("cargo:rerun-if-env-changed=MUJOCO_DIR");
        println!("cargo:rerun-if-env-changed=VIRTUAL_ENV");
        println!("cargo:rerun-if-changed=.venv/pyvenv.cfg");
        let found = find().unwrap_or_else(|fault| {
            eprintln!("{fault}");
            process::exit(1);
        });
        println!(
            "cargo:rerun-if-changed={}",
            found.include.join("mujoco/mujoco.h").display()
        );
        println!(
            "cargo:rustc-env=HYDRO_MUJOCO_LIB={}",
            found.library.display()
        );
        println!(
            "cargo:rustc-env=HYDRO_MUJOCO_INCLUDE={}",
            found.include.display()
        );
        println!(
            "cargo:rustc-env=HYDRO_MUJOCO_VERSION={}",
            readable(found.version)
        );
        println!(
            "cargo:warning=MuJoCo {} found: {} (MUJOCO_DIR chooses another)",
            readable(found.version),
            found.library.display()
        );
        if found.engine_plugins {
            println!("cargo:rustc-cfg=mujoco_plugins");
        }
        // From 4.0 an actuator may have several controls and outputs, which are counted apart.
        if found.version >= 4_000_000 {
            println!("cargo:rustc-cfg=mujoco_outputs");
        }
        // Only the shared library registers when it is loaded; tests and `hydro` must not.
        println!("cargo:rustc-link-arg-cdylib=-Wl,-init,hydro_plugin_load");
        write_bindings(&found);
    }

    /// The table of functions and the layouts of the structs, into `OUT_DIR/bindings.rs`.
    fn write_bindings(found: &Found) {
        let mut builder = bindgen::Builder::default()
            .header_contents("hydro.h", "#include <mujoco/mujoco.h>\n")
            .clang_arg(format!("-I{}", found.include.display()))
            .prepend_enum_name(false)
            .derive_debug(false)
            .generate_comments(false)
            .dynamic_library_name("Functions")
            .dynamic_link_require_all(true)
            .layout_tests(true)
            .allowlist_var("mjVERSION_HEADER|mjNFLUID|mjMINVAL|mjMAXVAL|mjNPOLY|mjNGAIN|mjNBIAS");
        let (functions, types): (&[&[&str]], &[&[&str]]) = if found.engine_plugins {
            (&[FUNCTIONS, PLUGIN_FUNCTIONS], &[TYPES, PLUGIN_TYPES])
        } else {
            (&[FUNCTIONS], &[TYPES])
        };
        for name in functions.iter().copied().flatten() {
            builder = builder.allowlist_function(name);
        }
        for name in types.iter().copied().flatten() {
            builder = builder.allowlist_type(name);
        }
        let bindings = builder.generate().unwrap_or_else(|fault| {
            eprintln!(
                "bindgen could not read {}: {fault}. It needs libclang (Debian: apt-get install libclang-dev).",
                found.include.join("mujoco/mujoco.h").display()
            );
            process::exit(1);
        });
        let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default()).join("bindings.rs");
        bindings.write_to_file(&out).unwrap_or_else(|fault| {
            eprintln!("{}: {fault}", out.display());
            process::exit(1);
        });
    }

    fn find() -> Result<Found, String> {
        if let Some(folder) = env::var_os("MUJOCO_DIR").filter(|folder| !folder.is_empty()) {
            let folder = PathBuf::from(folder);
            if !folder.is_absolute() {
                return Err(format!(
                    "MUJOCO_DIR is `{}`; it must be an absolute path",
                    folder.display()
                ));
            }
            return look_in(&folder)
                .map_err(|fault| format!("MUJOCO_DIR is `{}`, but {fault}", folder.display()));
        }
        let mut tried = Vec::new();
        for folder in wheel_folders()
            .into_iter()
            .chain([PathBuf::from("/usr"), PathBuf::from("/usr/local")])
        {
            match look_in(&folder) {
                Ok(found) => return Ok(found),
                Err(fault) => tried.push(format!("  {fault}")),
            }
        }
        Err(format!(
            "No MuJoCo found. Looked in:\n{}\nGet one of:\n  \
             python3 -m venv .venv && .venv/bin/pip install mujoco==4.0.0\n  \
             apt-get install libmujoco-dev          (Debian 12: MuJoCo 2.2.2)\n  \
             a release archive of MuJoCo, unpacked, and MUJOCO_DIR=/its/folder\n\
             or build without it: --no-default-features --features cli",
            tried.join("\n")
        ))
    }

    /// Package folders of `mujoco` wheels: the project's `.venv`, then the active Python's.
    fn wheel_folders() -> Vec<PathBuf> {
        let manifest = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
        let mut folders = Vec::new();
        for base in ["lib", "lib64"] {
            let Ok(versions) = fs::read_dir(manifest.join(".venv").join(base)) else {
                continue;
            };
            for version in versions.flatten() {
                folders.push(version.path().join("site-packages/mujoco"));
            }
        }
        // Ask where the package is without importing it: an import would load its library.
        let question = "import importlib.util as u; s = u.find_spec('mujoco'); \
                        print(s.submodule_search_locations[0] if s else '')";
        if let Ok(answer) = Command::new("python3").args(["-c", question]).output() {
            let answer = String::from_utf8_lossy(&answer.stdout).trim().to_owned();
            if !answer.is_empty() {
                folders.push(PathBuf::from(answer));
            }
        }
        folders
    }

    fn look_in(folder: &Path) -> Result<Found, String> {
        let include = folder.join("include");
        let header = include.join("mujoco/mujoco.h");
        let text = fs::read_to_string(&header)
            .map_err(|fault| format!("{}: {fault}", header.display()))?;
        let version = text
            .lines()
            .find_map(|line| line.strip_prefix("#define mjVERSION_HEADER"))
            .and_then(|rest| rest.trim().parse().ok())
            .ok_or_else(|| format!("{} defines no mjVERSION_HEADER", header.display()))?;
        let library = LIBRARY_FOLDERS
            .iter()
            .find_map(|below| library_in(&folder.join(below)))
            .ok_or_else(|| {
                format!(
                    "{} has no libmujoco.so* in ., lib or lib/<triplet>",
                    folder.display()
                )
            })?;
        let engine_plugins = include.join("mujoco").join(PLUGIN_HEADER).exists();
        Ok(Found {
            include,
            library,
            version,
            engine_plugins,
        })
    }

    /// The real file behind `libmujoco.so`, with its version in the name.
    fn library_in(folder: &Path) -> Option<PathBuf> {
        let mut files: Vec<PathBuf> = fs::read_dir(folder)
            .ok()?
            .flatten()
            .map(|entry| entry.path())
            .filter(|path| {
                path.file_name()
                    .is_some_and(|name| name.to_string_lossy().starts_with("libmujoco.so"))
            })
            .collect();
        files.sort();
        files.last().and_then(|path| path.canonicalize().ok())
    }

    /// 222 -> 2.2.2; 4000000 -> 4.0.0. The encoding changed when a minor number reached ten.
    fn readable(version: u32) -> String {
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
}
