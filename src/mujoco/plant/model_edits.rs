//! Changes of a model before it is compiled: room for added inertia, and backlash in joints.

use std::{
    ffi::{CString, c_char},
    path::Path,
    ptr::{NonNull, null},
};

use crate::mujoco::{
    ffi::{
        Api,
        bindings::{mjLIMITED_FALSE, mjLIMITED_TRUE, mjModel, mjOBJ_BODY, mjOBJ_JOINT, mjSpec},
        last_refusal, scene_folder,
        views::string,
    },
    simulator::{ERROR_LEN, Model, SimulatorError, c_path, refused},
};

/// Backlash of a joint: a second joint behind it, free within the backlash. The range is set in the compiled model.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Backlash {
    /// The joint before it.
    pub(crate) joint: String,
    /// Inertia of the joint itself [kg m^2 or kg].
    pub(crate) armature: f64,
    /// Time constant of its stops [s].
    pub(crate) stop: f64,
}

impl Backlash {
    /// Name of the extra joint.
    pub(crate) fn name(&self) -> String {
        format!("{}_play", self.joint)
    }
}

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

/// As [`Model::load`], with backlash in these joints, and such that every body has room in the inertia matrix for products of
/// its degrees of freedom: MuJoCo keeps a diagonal alone for a body whose inertia is that simple, and an
/// empty child takes the simplicity away and changes nothing else.
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
        spec.add_backlash(backlash)
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
        // SAFETY: a live spec, no virtual files; the error is a C string of the spec.
        let folder = scene_folder::folder(path);
        let model: *mut mjModel = scene_folder::known(folder.as_deref(), || unsafe {
            (functions.mj_compile)(self.spec.as_ptr(), null())
        });
        match NonNull::new(model) {
            Some(model) => Ok(Model::owned(model, self.api, folder)),
            None => {
                // SAFETY: as above.
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

    /// Puts a joint of the same axis behind another.
    fn add_backlash(&self, backlash: &Backlash) -> Result<(), String> {
        let fault = || format!("joint `{}` cannot be given backlash", backlash.joint);
        let (name, own) = (
            CString::new(backlash.joint.as_str()).map_err(|_| fault())?,
            CString::new(backlash.name()).map_err(|_| fault())?,
        );
        let functions = &self.api.functions;
        // SAFETY: C strings and elements of a live spec, each checked before it is used.
        unsafe {
            let element =
                (functions.mjs_findElement)(self.spec.as_ptr(), mjOBJ_JOINT, name.as_ptr());
            let before = NonNull::new(element).ok_or_else(fault)?;
            let body = (functions.mjs_getParent)(before.as_ptr());
            let before = (functions.mjs_asJoint)(before.as_ptr()).as_ref();
            let (before, body) = before.zip(NonNull::new(body)).ok_or_else(fault)?;
            let joint = (functions.mjs_addJoint)(body.as_ptr(), null());
            let joint = joint.as_mut().ok_or_else(fault)?;
            joint.type_ = before.type_;
            joint.pos = before.pos;
            joint.axis = before.axis;
            joint.limited = mjLIMITED_TRUE;
            joint.range = [-1.0, 1.0];
            joint.solref_limit = [backlash.stop, 1.0];
            joint.solimp_limit[..3].copy_from_slice(&[0.99, 0.999, 0.001]);
            joint.armature = backlash.armature;
            // What a class gives belongs to the joint before it.
            joint.ref_ = 0.0;
            joint.margin = 0.0;
            joint.frictionloss = 0.0;
            joint.springref = 0.0;
            joint.springdamper = [0.0; 2];
            joint.stiffness = Default::default();
            joint.damping = Default::default();
            joint.actfrclimited = mjLIMITED_FALSE;
            if (functions.mjs_setName)(joint.element, own.as_ptr()) != 0 {
                return Err(fault());
            }
        }
        Ok(())
    }
}
