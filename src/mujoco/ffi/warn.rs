//! MuJoCo's warning channel: under Python the text of a refusal becomes that of the `ValueError`.

use std::ffi::CString;

use super::api::Api;

/// Longest text that MuJoCo's buffers take whole.
const LONGEST: usize = 900;

/// Warns through MuJoCo. Call it with no lock and no borrowed workspace held.
pub(crate) fn warn(api: &Api, text: &str) {
    let mut text = format!("hydro: {}", text.replace('\0', " "));
    if text.len() > LONGEST {
        let mut end = LONGEST;
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        text.truncate(end);
        text.push_str(" ...");
    }
    let Ok(text) = CString::new(text) else { return };
    // SAFETY: a valid C string; the version's own calling convention.
    #[cfg(mujoco_plugins)]
    unsafe {
        (api.functions.mju_warning)(c"%s".as_ptr(), text.as_ptr());
    }
    // SAFETY: as above.
    #[cfg(not(mujoco_plugins))]
    unsafe {
        (api.functions.mju_warning)(text.as_ptr());
    }
}
