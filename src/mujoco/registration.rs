//! Registration: at load of the shared library, or asked for by a program that has MuJoCo itself.

use super::ffi::{
    Api,
    api::{ApiError, warn_whatever_version},
    guard,
};

/// Run by the loader when `libhydro_plugin.so` is loaded, and only then (`-init` in `build.rs`).
///
/// Where the running MuJoCo is of another version, one warning names both and nothing is registered;
/// where there is none, nothing happens.
#[unsafe(no_mangle)]
#[expect(unreachable_pub, reason = "the loader calls it by name")]
pub extern "C" fn hydro_plugin_load() {
    guard("load", (), || match Api::running() {
        Ok(api) => register_in(api),
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

#[cfg(mujoco_plugins)]
fn register_in(api: &'static Api) {
    super::wrench::plugin::register(api);
    super::load_cell::plugin::register(api);
}

#[cfg(not(mujoco_plugins))]
fn register_in(api: &'static Api) {
    super::wrench::passive_callback::install(api);
}
