//! Registration: at load of the shared library, or asked for by a program that has MuJoCo itself.

use super::ffi::{
    Api,
    api::{ApiError, other_copy, warn_whatever_version},
    guard,
};

/// Run by the loader when `libhydro_plugin.so` is loaded, and only then (`-init` in `build.rs`).
///
/// Registers nothing where the running MuJoCo is one that this build does not fit, and warns once with the names of both;
/// where there is none, nothing happens. Where another copy of the library has registered, that one acts, and one warning
/// names it: MuJoCo ends the process where a second copy registers.
#[unsafe(no_mangle)]
#[expect(unreachable_pub, reason = "the loader calls it by name")]
pub extern "C" fn hydro_plugin_load() {
    guard("load", (), || match Api::running() {
        Ok(api) => {
            if !register_in(api) {
                let first = other_copy()
                    .map_or_else(String::new, |path| format!(", from {}", path.display()));
                warn_whatever_version(&format!(
                    "hydro: the plugin is loaded already{first}: that copy acts, and this one does not"
                ));
            }
        }
        Err(ApiError::NotLoaded) => {}
        Err(fault) => warn_whatever_version(&format!("hydro: {fault}")),
    });
}

/// Makes the plugins known to the MuJoCo of this process, opening the one that this build was made for
/// where there is none.
pub fn register() -> Result<(), ApiError> {
    register_in(Api::running_or_opened()?);
    Ok(())
}

/// False where another copy was there first.
#[cfg(mujoco_plugins)]
fn register_in(api: &'static Api) -> bool {
    super::load_cell::plugin::register(api);
    super::wrench::plugin::register(api)
}

#[cfg(not(mujoco_plugins))]
fn register_in(api: &'static Api) -> bool {
    super::wrench::passive_callback::install(api);
    true
}
