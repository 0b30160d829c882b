//! One simulation of a model.

use std::{path::PathBuf, ptr::NonNull, sync::Arc};

use super::{error::SimulatorError, model::Model};
use crate::mujoco::ffi::{DataView, bindings::mjData, last_refusal, scene_folder};

/// One simulation.
pub struct Data {
    data: NonNull<mjData>,
    model: Arc<Model>,
}

// SAFETY: MuJoCo ties no data to a thread.
unsafe impl Send for Data {}

impl std::fmt::Debug for Data {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Data")
            .field("time", &self.time())
            .finish_non_exhaustive()
    }
}

/// Accessors that go through a view made for the call.
macro_rules! read {
    ($($(#[$doc:meta])* $name:ident;)*) => {
        $($(#[$doc])*
        pub fn $name(&self) -> &[f64] {
            // SAFETY: the view's pointers are those of this data, which lives as long as `self`.
            unsafe { &*(self.view().$name() as *const [f64]) }
        })*
    };
}

macro_rules! write {
    ($($(#[$doc:meta])* $name:ident;)*) => {
        $($(#[$doc])*
        pub fn $name(&mut self) -> &mut [f64] {
            // SAFETY: as for the slices that are read; `&mut self` keeps others away.
            unsafe { &mut *(self.view().$name() as *mut [f64]) }
        })*
    };
}

impl Data {
    /// A simulation at the model's initial state.
    pub fn new(model: &Arc<Model>) -> Result<Self, SimulatorError> {
        last_refusal::forget();
        // SAFETY: a live model.
        let data = scene_folder::known(model.folder.as_deref(), || unsafe {
            (model.api.functions.mj_makeData)(model.model.as_ptr())
        });
        match NonNull::new(data) {
            Some(data) => Ok(Self {
                data,
                model: Arc::clone(model),
            }),
            None => {
                let reason =
                    last_refusal::take().unwrap_or_else(|| "no memory for a simulation".to_owned());
                Err(SimulatorError::Model {
                    path: PathBuf::new(),
                    reason,
                })
            }
        }
    }

    pub(in crate::mujoco) fn view(&self) -> DataView<'_> {
        DataView::live(self.data, self.model.view())
    }

    /// The model.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// One step.
    pub fn step(&mut self) {
        // SAFETY: a live model and a data of it, held alone.
        unsafe { (self.model.api.functions.mj_step)(self.model.model.as_ptr(), self.data.as_ptr()) }
    }

    /// Everything that follows from the state, without a step.
    pub fn forward(&mut self) {
        // SAFETY: a live model and a data of it, held alone.
        unsafe {
            (self.model.api.functions.mj_forward)(self.model.model.as_ptr(), self.data.as_ptr())
        }
    }

    /// Inverse dynamics.
    pub fn inverse(&mut self) {
        // SAFETY: a live model and a data of it, held alone.
        unsafe {
            (self.model.api.functions.mj_inverse)(self.model.model.as_ptr(), self.data.as_ptr())
        }
    }

    /// Back to the model's initial state; plugins forget everything.
    pub fn reset(&mut self) {
        // SAFETY: a live model and a data of it, held alone.
        unsafe {
            (self.model.api.functions.mj_resetData)(self.model.model.as_ptr(), self.data.as_ptr())
        }
    }

    /// A simulation in the same state.
    pub fn try_clone(&self) -> Result<Self, SimulatorError> {
        let mut copy = Self::new(&self.model)?;
        copy.copy_from(self);
        Ok(copy)
    }

    /// Takes over the state and all results of a simulation of the same model.
    pub fn copy_from(&mut self, other: &Self) {
        assert!(
            Arc::ptr_eq(&self.model, &other.model),
            "a simulation of another model"
        );
        // SAFETY: two data of one live model; `self` is held alone.
        unsafe {
            let model = self.model.model.as_ptr();
            (self.model.api.functions.mj_copyData)(self.data.as_ptr(), model, other.data.as_ptr());
        }
    }

    /// Simulation time [s].
    pub fn time(&self) -> f64 {
        self.view().time()
    }

    /// Sets the simulation time [s].
    pub fn set_time(&mut self, seconds: f64) {
        self.view().set_time(seconds);
    }

    read! {
        /// Positions [nq].
        qpos;
        /// Velocities [nv].
        qvel;
        /// Accelerations [nv].
        qacc;
        /// Controls [nu].
        ctrl;
        /// Generalised forces of the user [nv].
        qfrc_applied;
        /// Passive generalised forces [nv].
        qfrc_passive;
        /// Generalised forces of the actuators [nv].
        qfrc_actuator;
        /// World force, torque on every body [nbody * 6].
        xfrc_applied;
        /// Readings of all sensors; see [`Model::sensor`].
        sensordata;
        /// Numbers of the user [nuserdata].
        userdata;
        /// World positions of the bodies [nbody * 3].
        xpos;
        /// Attitudes of the bodies, w x y z [nbody * 4].
        xquat;
        /// Motion of each degree of freedom in the world: rotation, velocity at its tree's centre of mass [nv * 6].
        cdof;
    }

    #[cfg(mujoco_plugins)]
    read! {
        /// Generalised forces of MuJoCo's own fluid [nv].
        qfrc_fluid;
        /// Memory of all plugins.
        plugin_state;
    }

    write! {
        /// Positions, to write [nq].
        qpos_mut;
        /// Velocities, to write [nv].
        qvel_mut;
        /// Controls, to write [nu].
        ctrl_mut;
        /// Generalised forces of the user, to write [nv].
        qfrc_applied_mut;
        /// World force, torque on every body, to write [nbody * 6].
        xfrc_applied_mut;
    }

    /// The whole state of the integration: time, physics, plugins, controls and applied forces.
    #[cfg(mujoco_plugins)]
    pub fn state(&self) -> Vec<f64> {
        self.part(STATE)
    }

    /// A part of the state (bits of `mjtState`).
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn part(&self, kind: i32) -> Vec<f64> {
        let mut state = vec![0.0; self.model.state_len(kind)];
        // SAFETY: a live model and data, and room for the state of this kind.
        unsafe {
            let (model, data) = (self.model.model.as_ptr(), self.data.as_ptr());
            (self.model.api.functions.mj_getState)(model, data, state.as_mut_ptr(), kind);
        }
        state
    }

    /// Goes back to a state that [`Data::state`] gave for this model.
    #[cfg(mujoco_plugins)]
    pub fn set_state(&mut self, state: &[f64]) -> Result<(), SimulatorError> {
        self.set_part(STATE, state)
    }

    /// Sets a part of the state (bits of `mjtState`).
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn set_part(
        &mut self,
        kind: i32,
        state: &[f64],
    ) -> Result<(), SimulatorError> {
        let expected = self.model.state_len(kind);
        if state.len() != expected {
            return Err(SimulatorError::StateLength {
                expected,
                found: state.len(),
            });
        }
        // SAFETY: a live model and data, and a state of the length that MuJoCo reads.
        unsafe {
            let (model, data) = (self.model.model.as_ptr(), self.data.as_ptr());
            (self.model.api.functions.mj_setState)(model, data, state.as_ptr(), kind);
        }
        Ok(())
    }

    /// Moves the position along a tangent [nv]: rotations as rotation vectors in the body's frame.
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn integrate_position(&mut self, tangent: &[f64]) {
        assert_eq!(tangent.len(), self.model.nv(), "a tangent of another model");
        let qpos = self.qpos_mut().as_mut_ptr();
        // SAFETY: positions and a tangent of this model's lengths.
        unsafe {
            let (model, way) = (self.model.model.as_ptr(), tangent.as_ptr());
            (self.model.api.functions.mj_integratePos)(model, qpos, way, 1.0);
        }
    }

    /// Tangent [nv] that leads from a position to another: rotations as rotation vectors in the body's frame.
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn differentiate_position(
        &self,
        from: &[f64],
        to: &[f64],
        tangent: &mut [f64],
    ) {
        let (nq, nv) = (self.model.nq(), self.model.nv());
        assert_eq!([from.len(), to.len(), tangent.len()], [nq, nq, nv]);
        // SAFETY: positions and a tangent of this model's lengths.
        unsafe {
            (self.model.api.functions.mj_differentiatePos)(
                self.model.model.as_ptr(),
                tangent.as_mut_ptr(),
                1.0,
                from.as_ptr(),
                to.as_ptr(),
            );
        }
    }

    /// Velocity of a body's origin and its rate, in the world, by degree of freedom, each [3 nv] by rows: at the present
    /// positions, which all that follows from is brought up to date.
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn body_jacobian(&mut self, body: usize) -> [Vec<f64>; 2] {
        let (count, nv) = (self.model.view().raw().nbody as usize, self.model.nv());
        assert!(body < count, "a body of another model");
        let mut jacobians = [vec![0.0; 3 * nv], vec![0.0; 3 * nv]];
        let [linear, angular] = &mut jacobians;
        let functions = &self.model.api.functions;
        let (model, data) = (self.model.model.as_ptr(), self.data.as_ptr());
        // SAFETY: a live model and a data of it, held alone; a body of the model, and room for three rows of its freedom each.
        unsafe {
            (functions.mj_kinematics)(model, data);
            (functions.mj_comPos)(model, data);
            let (linear, angular) = (linear.as_mut_ptr(), angular.as_mut_ptr());
            (functions.mj_jacBody)(model, data, linear, angular, body as i32);
        }
        jacobians
    }

    /// Brings the positions and velocities of all bodies up to date, and nothing else.
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn derive_motion(&mut self) {
        let functions = &self.model.api.functions;
        let (model, data) = (self.model.model.as_ptr(), self.data.as_ptr());
        // SAFETY: a live model and a data of it, held alone.
        unsafe {
            (functions.mj_kinematics)(model, data);
            (functions.mj_comPos)(model, data);
            (functions.mj_comVel)(model, data);
        }
    }

    /// Number of MuJoCo's warnings of this kind since the last reset.
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn warnings(&self, kind: u32) -> i32 {
        // SAFETY: a live data.
        unsafe { (*self.data.as_ptr()).warning[kind as usize].number }
    }

    /// Forgets warnings.
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn reset_warnings(&mut self) {
        // SAFETY: a live data, held alone.
        for warning in unsafe { &mut (*self.data.as_ptr()).warning } {
            warning.number = 0;
        }
    }
}

#[cfg(mujoco_plugins)]
const STATE: i32 = crate::mujoco::ffi::bindings::mjSTATE_INTEGRATION as i32;

impl Drop for Data {
    fn drop(&mut self) {
        // SAFETY: owned.
        unsafe { (self.model.api.functions.mj_deleteData)(self.data.as_ptr()) };
    }
}
