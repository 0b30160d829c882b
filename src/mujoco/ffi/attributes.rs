//! Attributes of a model's plugin instances.

use super::views::{ModelView, string, view};

impl<'a> ModelView<'a> {
    /// Keys and values of an instance as the model holds them; empty where it has none.
    pub(crate) fn plugin_attributes(&self, instance: usize) -> &'a [u8] {
        let all = usize::try_from(self.raw().npluginattr).unwrap_or(0);
        let count = usize::try_from(self.raw().nplugin).unwrap_or(0);
        // SAFETY: MuJoCo's model has as many numbers and characters as it says.
        let (starts, text) = unsafe {
            (
                view(self.raw().plugin_attradr, count),
                view(self.raw().plugin_attr.cast::<u8>(), all),
            )
        };
        let from = |at: usize| {
            starts
                .get(at)
                .and_then(|start| usize::try_from(*start).ok())
        };
        let Some(start) = from(instance) else {
            return &[];
        };
        let end = (instance + 1..count).find_map(from).unwrap_or(all);
        text.get(start..end).unwrap_or_default()
    }

    /// Attribute of a plugin instance; empty where it is not given.
    pub(crate) fn attribute(&self, instance: usize, name: &str) -> Option<String> {
        let name = std::ffi::CString::new(name).ok()?;
        // SAFETY: a valid C string; MuJoCo returns null for an unknown instance or name.
        let value = unsafe {
            (self.api().functions.mj_getPluginConfig)(self.raw(), instance as i32, name.as_ptr())
        };
        // SAFETY: null or a C string of the model.
        (!value.is_null()).then(|| unsafe { string(value) })
    }
}
