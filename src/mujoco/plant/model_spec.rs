//! The model of a plant as it is compiled: with room for added inertia, and with backlash in joints.

use std::{
    ffi::c_char,
    path::Path,
    ptr::{NonNull, null},
};

use super::backlash::Backlash;
use crate::mujoco::{
    ffi::{
        Api,
        bindings::{mjModel, mjOBJ_BODY, mjSpec},
        last_refusal, scene_folder,
        views::string,
    },
    simulator::{ERROR_LEN, Model, SimulatorError, c_path, refused},
};

/// A model before it is compiled.
struct Spec {
    spec: NonNull<mjSpec>,
    api: &'static Api,
}

impl Drop for Spec {
    fn drop(&mut self) {
        // SAFETY: owned.
        unsafe { (self.api.functions.mj_deleteSpec)(self.spec.as_ptr()) }
    }
}

/// As [`Model::load`], with backlash in these joints, and with an empty child on every body that MuJoCo calls simple. It stores
/// only the diagonal of the inertia matrix for these; the child makes it store the full block and has no other effect.
pub(crate) fn load(path: &Path, backlashes: &[Backlash]) -> Result<Model, SimulatorError> {
    let model = Model::load(path)?;
    let simple: Vec<i32> = (1..model.view().bodies())
        .filter(|body| model.view().body_simple()[*body] != 0)
        .map(|body| body as i32)
        .collect();
    if simple.is_empty() && backlashes.is_empty() {
        return Ok(model);
    }
    let spec = Spec::parse(path, model.api())?;
    // Numbers of bodies are known once a spec was compiled.
    drop(spec.compile(path)?);
    spec.add_children(&simple);
    for backlash in backlashes {
        backlash
            .add_to(spec.spec, spec.api)
            .map_err(|reason| refused(path, reason.as_bytes()))?;
    }
    spec.compile(path)
}

impl Spec {
    fn parse(path: &Path, api: &'static Api) -> Result<Self, SimulatorError> {
        let name = c_path(path)?;
        let mut error = [0_u8; ERROR_LEN];
        last_refusal::forget();
        // SAFETY: a C string, no virtual files, and a buffer of the length given.
        let spec = unsafe {
            let buffer = error.as_mut_ptr().cast::<c_char>();
            (api.functions.mj_parseXML)(name.as_ptr(), null(), buffer, ERROR_LEN as i32)
        };
        let spec = NonNull::new(spec).ok_or_else(|| refused(path, &error))?;
        Ok(Self { spec, api })
    }

    fn compile(&self, path: &Path) -> Result<Model, SimulatorError> {
        let functions = &self.api.functions;
        let folder = scene_folder::folder(path);
        let model: *mut mjModel = scene_folder::known(folder.as_deref(), || {
            // SAFETY: a live spec, no virtual files.
            unsafe { (functions.mj_compile)(self.spec.as_ptr(), null()) }
        });
        match NonNull::new(model) {
            Some(model) => Ok(Model::owned(model, self.api, folder)),
            None => {
                // SAFETY: the error is a C string of the live spec.
                let text = unsafe { string((functions.mjs_getError)(self.spec.as_ptr())) };
                Err(refused(path, text.as_bytes()))
            }
        }
    }

    /// Gives each of these bodies an empty child.
    fn add_children(&self, bodies: &[i32]) {
        let functions = &self.api.functions;
        // SAFETY: elements of a live spec; nothing is added before the last was seen.
        unsafe {
            let mut found = Vec::new();
            let mut element = (functions.mjs_firstElement)(self.spec.as_ptr(), mjOBJ_BODY);
            while !element.is_null() {
                if bodies.contains(&(functions.mjs_getId)(element)) {
                    found.push((functions.mjs_asBody)(element));
                }
                element = (functions.mjs_nextElement)(self.spec.as_ptr(), element);
            }
            for body in found {
                (functions.mjs_addBody)(body, null());
            }
        }
    }
}
