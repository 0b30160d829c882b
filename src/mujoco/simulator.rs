//! Owned models and simulations: what `hydro simulate` and the tests step.
//!
//! A [`Model`] is compiled once and shared; each [`Data`] is one simulation of it. Names are looked up
//! once, into plain numbers and ranges of the slices that [`Data`] gives.

use std::{
    ffi::{CString, c_char},
    fs,
    ops::Range,
    path::{Path, PathBuf},
    ptr::NonNull,
    sync::Arc,
};

use thiserror::Error;

use super::{
    api::{Api, ApiError},
    bindings::{
        mjData, mjINT_EULER, mjINT_RK4, mjModel, mjOBJ_ACTUATOR, mjOBJ_BODY, mjOBJ_JOINT,
        mjOBJ_SENSOR,
    },
    describe, load,
    views::{DataView, ModelView},
};
#[cfg(mujoco_plugins)]
use crate::plugin::native_fluid::EllipsoidCoefficients;
use crate::plugin::{Body, Joint, JointKind};

pub(super) fn c_path(path: &Path) -> Result<CString, SimulatorError> {
    CString::new(path.as_os_str().as_encoded_bytes()).map_err(|_| SimulatorError::Model {
        path: path.to_owned(),
        reason: "the path holds a zero byte".to_owned(),
    })
}

/// MuJoCo's reason and the plugin's.
pub(super) fn refused(path: &Path, error: &[u8]) -> SimulatorError {
    let end = error
        .iter()
        .position(|byte| *byte == 0)
        .unwrap_or(error.len());
    let text = String::from_utf8_lossy(&error[..end]).trim().to_owned();
    SimulatorError::Model {
        path: path.to_owned(),
        reason: [Some(text), take_refusal()]
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
            .join(": "),
    }
}

/// Room for MuJoCo's error text.
pub(super) const ERROR_LEN: usize = 4096;

/// Why a model or a lookup failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SimulatorError {
    /// No MuJoCo to call.
    #[error(transparent)]
    Api(#[from] ApiError),
    /// MuJoCo refused the model.
    #[error("{}: {reason}", .path.display())]
    Model {
        /// The MJCF; empty for one that was given as text.
        path: PathBuf,
        /// MuJoCo's reason, and the plugin's.
        reason: String,
    },
    /// No object of that name.
    #[error("the model has no {kind} `{name}`; it has: {}", .exists.join(", "))]
    NoSuch {
        /// `joint`, `body`, `sensor` or `actuator`.
        kind: &'static str,
        /// The name looked for.
        name: String,
        /// The names there are.
        exists: Vec<String>,
    },
    /// A state of another length.
    #[error("a state of {found} numbers for a model whose states have {expected}")]
    StateLength {
        /// Of the model.
        expected: usize,
        /// Given.
        found: usize,
    },
    /// A robot that does not float.
    #[error("the model's first joint is not free; joints: {}. A swimming robot has a <freejoint/> on its base, first of all joints", .joints.join(", "))]
    NotFloating {
        /// Joints of the model.
        joints: Vec<String>,
    },
    /// A density cannot be changed in proportion to none.
    #[error(
        "the scene's option density is {found} kg/m^3; expected more than zero, as in the truth and its rivals"
    )]
    NoDensity {
        /// The scene's.
        found: f64,
    },
}

/// How a step is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// Semi-implicit Euler.
    Euler,
    /// Runge-Kutta of fourth order.
    Rk4,
    /// Implicit in velocity without Coriolis terms.
    #[cfg(mujoco_plugins)]
    ImplicitFast,
}

impl Integrator {
    fn code(self) -> i32 {
        match self {
            Self::Euler => mjINT_EULER as i32,
            Self::Rk4 => mjINT_RK4 as i32,
            #[cfg(mujoco_plugins)]
            Self::ImplicitFast => super::bindings::mjINT_IMPLICITFAST as i32,
        }
    }
}

/// A compiled model.
#[derive(Debug)]
pub struct Model {
    model: NonNull<mjModel>,
    api: &'static Api,
}

// SAFETY: MuJoCo's models are plain memory; simulations of one model on several threads only read it,
// and `&mut self` is needed to write.
unsafe impl Send for Model {}
// SAFETY: as above.
unsafe impl Sync for Model {}

/// Shape and inertia of one body, as compiled.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyInertia {
    /// Mass [kg].
    pub mass: f64,
    /// Centre of mass in the body frame [m].
    pub centre: [f64; 3],
    /// Principal moments of inertia [kg m^2].
    pub moments: [f64; 3],
    /// `body_from_principal` [w x y z].
    pub orientation: [f64; 4],
}

/// One joint, as compiled.
#[derive(Clone, Debug, PartialEq)]
pub struct JointGeometry {
    /// The body that it moves.
    pub body: String,
    /// Axis in the body frame.
    pub axis: [f64; 3],
    /// Anchor in the body frame [m].
    pub position: [f64; 3],
    /// Limits [rad or m].
    pub range: [f64; 2],
}

impl Model {
    /// Compiles an MJCF or URDF file; `hydro.wrench` and `hydro.load_cell` are known to it.
    pub fn load(path: &Path) -> Result<Self, SimulatorError> {
        load::register()?;
        let api = Api::running_or_opened()?;
        let name = c_path(path)?;
        let mut error = [0_u8; ERROR_LEN];
        forget_refusal();
        // SAFETY: a C string, no virtual files, and a buffer of the length given.
        let model = unsafe {
            let buffer = error.as_mut_ptr().cast::<c_char>();
            (api.functions.mj_loadXML)(name.as_ptr(), std::ptr::null(), buffer, ERROR_LEN as i32)
        };
        let Some(model) = NonNull::new(model) else {
            return Err(refused(path, &error));
        };
        Ok(Self { model, api })
    }

    /// A model of its own, to be changed.
    #[cfg(mujoco_plugins)]
    pub(super) fn try_clone(&self) -> Result<Self, SimulatorError> {
        // SAFETY: a live model; null asks for a new one.
        let copy =
            unsafe { (self.api.functions.mj_copyModel)(std::ptr::null_mut(), self.model.as_ptr()) };
        let model = NonNull::new(copy).ok_or_else(|| SimulatorError::Model {
            path: PathBuf::new(),
            reason: "no memory for a copy of the model".to_owned(),
        })?;
        Ok(Self {
            model,
            api: self.api,
        })
    }

    /// Brings along what depends on masses and frames.
    #[cfg(mujoco_plugins)]
    pub(super) fn set_constants(&mut self) -> Result<(), SimulatorError> {
        let functions = &self.api.functions;
        // SAFETY: a live model, held alone, and a data of it that is freed at once.
        unsafe {
            let data = (functions.mj_makeData)(self.model.as_ptr());
            if data.is_null() {
                return Err(refused(Path::new(""), b"no memory for a simulation"));
            }
            (functions.mj_setConst)(self.model.as_ptr(), data);
            (functions.mj_deleteData)(data);
        }
        Ok(())
    }

    /// Adds to the velocity of MuJoCo's own fluid [m/s].
    #[cfg(mujoco_plugins)]
    pub(super) fn add_wind(&mut self, more: [f64; 3]) {
        for (wind, more) in self.raw_mut().opt.wind.iter_mut().zip(more) {
            *wind += more;
        }
    }

    /// Sets half the ranges of joints [rad or m].
    #[cfg(mujoco_plugins)]
    pub(super) fn set_ranges(&mut self, halves: &[(usize, f64)]) {
        let raw = self.raw_mut();
        // SAFETY: two numbers a joint, and the model is held alone.
        let ranges = unsafe { super::views::view_mut(raw.jnt_range, raw.njnt * 2) };
        for (joint, half) in halves {
            ranges[2 * joint..2 * joint + 2].copy_from_slice(&[-half, *half]);
        }
    }

    /// Length of a state of this kind (bits of `mjtState`).
    #[cfg(mujoco_plugins)]
    pub(super) fn state_len(&self, kind: i32) -> usize {
        // SAFETY: a live model.
        let len = unsafe { (self.api.functions.mj_stateSize)(self.model.as_ptr(), kind) };
        usize::try_from(len).unwrap_or(0)
    }

    #[cfg(mujoco_plugins)]
    pub(super) fn api(&self) -> &'static Api {
        self.api
    }

    /// Of a model that MuJoCo has made, and that nothing else owns.
    #[cfg(mujoco_plugins)]
    pub(super) fn owned(model: NonNull<mjModel>, api: &'static Api) -> Self {
        Self { model, api }
    }

    /// Compiles an MJCF text. Files that it names are looked for in a folder of its own.
    pub fn from_xml(text: &str) -> Result<Self, SimulatorError> {
        let unwritable = |fault: std::io::Error| SimulatorError::Model {
            path: PathBuf::new(),
            reason: format!("cannot be written to a temporary file: {fault}"),
        };
        let folder = tempfile::tempdir().map_err(unwritable)?;
        let path = folder.path().join("model.xml");
        fs::write(&path, text).map_err(unwritable)?;
        Self::load(&path)
    }

    pub(super) fn view(&self) -> ModelView<'_> {
        ModelView::of(self.raw(), self.api)
    }

    pub(super) fn raw(&self) -> &mjModel {
        // SAFETY: owned and not null; freed only on drop.
        unsafe { self.model.as_ref() }
    }

    pub(super) fn raw_mut(&mut self) -> &mut mjModel {
        // SAFETY: as above, held alone.
        unsafe { self.model.as_mut() }
    }

    /// Length of the step [s].
    pub fn timestep(&self) -> f64 {
        self.raw().opt.timestep
    }

    /// Sets the length of the step [s].
    pub fn set_timestep(&mut self, seconds: f64) {
        self.raw_mut().opt.timestep = seconds;
    }

    /// Sets how a step is taken.
    pub fn set_integrator(&mut self, integrator: Integrator) {
        self.raw_mut().opt.integrator = integrator.code();
    }

    /// Acceleration of gravity in the world [m/s^2].
    pub fn gravity(&self) -> [f64; 3] {
        self.raw().opt.gravity
    }

    /// Sets density [kg/m^3] and viscosity [Pa s] of MuJoCo's own fluid.
    pub fn set_fluid(&mut self, density: f64, viscosity: f64) {
        let option = &mut self.raw_mut().opt;
        option.density = density;
        option.viscosity = viscosity;
    }

    /// Density of MuJoCo's own fluid [kg/m^3].
    pub fn density(&self) -> f64 {
        self.raw().opt.density
    }

    /// Changes the density [kg/m^3] of a scene that has buoyancy as gravity compensation: MuJoCo's own
    /// fluid and every body's `gravcomp` change in proportion.
    ///
    /// # Errors
    /// Where the scene has no density to be in proportion to.
    #[cfg(mujoco_plugins)]
    pub fn set_density(&mut self, density: f64) -> Result<(), SimulatorError> {
        let before = self.density();
        if before <= 0.0 {
            return Err(SimulatorError::NoDensity { found: before });
        }
        let raw = self.raw_mut();
        raw.opt.density = density;
        let bodies = usize::try_from(raw.nbody).unwrap_or(0);
        // SAFETY: MuJoCo allocates one number a body, and the model is held alone.
        let compensation = unsafe { std::slice::from_raw_parts_mut(raw.body_gravcomp, bodies) };
        for value in compensation {
            *value *= density / before;
        }
        Ok(())
    }

    /// Length of `qpos`.
    pub fn nq(&self) -> usize {
        self.raw().nq as usize
    }

    /// Length of `qvel`.
    pub fn nv(&self) -> usize {
        self.raw().nv as usize
    }

    /// Length of `ctrl`.
    pub fn nu(&self) -> usize {
        self.raw().nu as usize
    }

    /// All joints, in order.
    pub fn joints(&self) -> Vec<Joint> {
        describe::joints(self.view())
    }

    /// The joint of that name.
    pub fn joint(&self, name: &str) -> Result<Joint, SimulatorError> {
        let id = self.id("joint", mjOBJ_JOINT as i32, name)?;
        Ok(self.joints().swap_remove(id))
    }

    /// Axis, anchor and limits of a joint.
    pub fn joint_geometry(&self, name: &str) -> Result<JointGeometry, SimulatorError> {
        let id = self.id("joint", mjOBJ_JOINT as i32, name)?;
        let model = self.view();
        let range = &model.jnt_range()[2 * id..2 * id + 2];
        Ok(JointGeometry {
            body: model.name(mjOBJ_BODY as i32, model.jnt_bodyid()[id] as usize),
            axis: ModelView::triple(model.jnt_axis(), id),
            position: ModelView::triple(model.jnt_pos(), id),
            range: [range[0], range[1]],
        })
    }

    /// Number of a body, for the rows of the body-wise slices.
    pub fn body(&self, name: &str) -> Result<usize, SimulatorError> {
        self.id("body", mjOBJ_BODY as i32, name)
    }

    /// Names of all bodies, the world first.
    pub fn body_names(&self) -> Vec<String> {
        let model = self.view();
        (0..model.bodies())
            .map(|id| model.name(mjOBJ_BODY as i32, id))
            .collect()
    }

    /// Parent of a body.
    pub fn parent(&self, body: usize) -> usize {
        self.view().body_parentid()[body] as usize
    }

    /// Position of a body frame in its parent's [m].
    pub fn body_position(&self, body: usize) -> [f64; 3] {
        ModelView::triple(self.view().body_pos(), body)
    }

    /// Mass and inertia of a body.
    pub fn inertia(&self, body: usize) -> BodyInertia {
        let model = self.view();
        BodyInertia {
            mass: model.body_mass()[body],
            centre: ModelView::triple(model.body_ipos(), body),
            moments: ModelView::triple(model.body_inertia(), body),
            orientation: ModelView::quadruple(model.body_iquat(), body),
        }
    }

    /// A body as a card sees it: how it is held, and the model's joints.
    pub fn describe(&self, body: usize) -> Body {
        describe::body(self.view(), body)
    }

    /// Fluid coefficients of a geom, in MuJoCo's order.
    #[cfg(mujoco_plugins)]
    pub fn geom_fluid(&self, geom: usize) -> [f64; EllipsoidCoefficients::LEN] {
        let (rows, _) = self.view().geom_fluid().as_chunks();
        rows[geom]
    }

    /// True where the first joint is free, so that the base leads `qpos` and `qvel`.
    pub fn describes_floating_robot(&self) -> bool {
        self.joints()
            .first()
            .is_some_and(|joint| joint.kind == JointKind::Free)
    }

    /// The first body with a free joint.
    pub fn floating_base(&self) -> Option<usize> {
        let model = self.view();
        let joint = self
            .joints()
            .iter()
            .position(|joint| joint.kind == JointKind::Free)?;
        Some(model.jnt_bodyid()[joint] as usize)
    }

    /// Where a sensor's numbers stand in `sensordata`.
    pub fn sensor(&self, name: &str) -> Result<Range<usize>, SimulatorError> {
        let id = self.id("sensor", mjOBJ_SENSOR as i32, name)?;
        let start = self.view().sensor_adr()[id] as usize;
        Ok(start..start + self.view().sensor_dim()[id] as usize)
    }

    /// Where an actuator's control stands in `ctrl`.
    pub fn actuator(&self, name: &str) -> Result<usize, SimulatorError> {
        self.id("actuator", mjOBJ_ACTUATOR as i32, name)
    }

    /// Limits of every control [nu].
    pub fn control_ranges(&self) -> Vec<[f64; 2]> {
        let ranges = self.view().actuator_ctrlrange();
        ranges
            .chunks_exact(2)
            .map(|pair| [pair[0], pair[1]])
            .collect()
    }

    fn id(&self, kind: &'static str, code: i32, name: &str) -> Result<usize, SimulatorError> {
        let model = self.view();
        model.id(code, name).ok_or_else(|| {
            let raw = self.raw();
            let count = match kind {
                "joint" => raw.njnt as usize,
                "body" => raw.nbody as usize,
                "sensor" => raw.nsensor as usize,
                _ => raw.nu as usize,
            };
            let exists = (0..count)
                .map(|id| model.name(code, id))
                .filter(|name| !name.is_empty())
                .collect();
            SimulatorError::NoSuch {
                kind,
                name: name.to_owned(),
                exists,
            }
        })
    }
}

impl Drop for Model {
    fn drop(&mut self) {
        // SAFETY: owned, and every `Data` holds an `Arc` of this model.
        unsafe { (self.api.functions.mj_deleteModel)(self.model.as_ptr()) };
    }
}

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
        forget_refusal();
        // SAFETY: a live model.
        let data = unsafe { (model.api.functions.mj_makeData)(model.model.as_ptr()) };
        match NonNull::new(data) {
            Some(data) => Ok(Self {
                data,
                model: Arc::clone(model),
            }),
            None => {
                let reason =
                    take_refusal().unwrap_or_else(|| "no memory for a simulation".to_owned());
                Err(SimulatorError::Model {
                    path: PathBuf::new(),
                    reason,
                })
            }
        }
    }

    pub(super) fn view(&self) -> DataView<'_> {
        DataView::of(self.data, self.model.view())
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

    /// Internal and external forces on every body, which sensors are made of.
    pub fn post_constraint(&mut self) {
        // SAFETY: a live model and a data of it, held alone.
        unsafe {
            (self.model.api.functions.mj_rnePostConstraint)(
                self.model.model.as_ptr(),
                self.data.as_ptr(),
            )
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
        let mut state = vec![0.0; self.state_len()];
        // SAFETY: a live model and data, and room for the state of this kind.
        unsafe {
            let (model, data) = (self.model.model.as_ptr(), self.data.as_ptr());
            (self.model.api.functions.mj_getState)(model, data, state.as_mut_ptr(), STATE);
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
    pub(super) fn set_part(&mut self, kind: i32, state: &[f64]) -> Result<(), SimulatorError> {
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
    pub(super) fn integrate_position(&mut self, tangent: &[f64]) {
        assert_eq!(tangent.len(), self.model.nv(), "a tangent of another model");
        let qpos = self.qpos_mut().as_mut_ptr();
        // SAFETY: positions and a tangent of this model's lengths.
        unsafe {
            let (model, way) = (self.model.model.as_ptr(), tangent.as_ptr());
            (self.model.api.functions.mj_integratePos)(model, qpos, way, 1.0);
        }
    }

    /// How often MuJoCo gave a warning of this kind since the last reset.
    #[cfg(mujoco_plugins)]
    pub(super) fn warnings(&self, kind: u32) -> i32 {
        // SAFETY: a live data.
        unsafe { (*self.data.as_ptr()).warning[kind as usize].number }
    }

    /// Forgets warnings.
    #[cfg(mujoco_plugins)]
    pub(super) fn reset_warnings(&mut self) {
        // SAFETY: a live data, held alone.
        for warning in unsafe { &mut (*self.data.as_ptr()).warning } {
            warning.number = 0;
        }
    }

    #[cfg(mujoco_plugins)]
    fn state_len(&self) -> usize {
        self.model.state_len(STATE)
    }
}

#[cfg(mujoco_plugins)]
const STATE: i32 = super::bindings::mjSTATE_INTEGRATION as i32;

impl Drop for Data {
    fn drop(&mut self) {
        // SAFETY: owned.
        unsafe { (self.model.api.functions.mj_deleteData)(self.data.as_ptr()) };
    }
}

#[cfg(mujoco_plugins)]
fn take_refusal() -> Option<String> {
    super::wrench::take_refusal()
}

#[cfg(not(mujoco_plugins))]
fn take_refusal() -> Option<String> {
    None
}

pub(super) fn forget_refusal() {
    drop(take_refusal());
}
