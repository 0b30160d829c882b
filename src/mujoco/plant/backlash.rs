//! Backlash of a joint as simulated: a second joint behind it, free within the backlash.

use std::{
    ffi::CString,
    ptr::{NonNull, null},
};

use crate::mujoco::ffi::{
    Api,
    bindings::{mjLIMITED_FALSE, mjLIMITED_TRUE, mjOBJ_JOINT, mjSpec},
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

    /// Puts the extra joint, of the same axis, behind the joint in a spec that is not compiled yet.
    ///
    /// # Errors
    /// A joint that does not exist, or that MuJoCo refuses.
    pub(super) fn add_to(&self, spec: NonNull<mjSpec>, api: &Api) -> Result<(), String> {
        let fault = || format!("joint `{}` cannot be given backlash", self.joint);
        let (name, own) = (
            CString::new(self.joint.as_str()).map_err(|_| fault())?,
            CString::new(self.name()).map_err(|_| fault())?,
        );
        let functions = &api.functions;
        // SAFETY: C strings and elements of a live spec, each checked before it is used.
        unsafe {
            let element = (functions.mjs_findElement)(spec.as_ptr(), mjOBJ_JOINT, name.as_ptr());
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
            joint.solref_limit = [self.stop, 1.0];
            joint.solimp_limit[..3].copy_from_slice(&[0.99, 0.999, 0.001]);
            joint.armature = self.armature;
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
