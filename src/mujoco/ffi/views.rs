//! Checked views: MuJoCo's pointer-and-count pairs as slices.
//!
//! A `ModelView` or `DataView` is made once, at the top of a callback, from the pointers that MuJoCo
//! passed; from then on everything is a slice with a length taken from the model, and an index out of
//! range is a panic that the boundary catches, not a wild read.

use std::{ffi::CStr, ffi::c_char, marker::PhantomData, ptr::NonNull, slice};

use super::{
    api::Api,
    bindings::{mjData, mjINT_RK4, mjModel, mjtNum},
};
use crate::plugin::Moment;

/// A slice of MuJoCo's; empty where the pointer is null or the count is not positive.
///
/// # Safety
/// Otherwise `pointer` holds `count` values that outlive `'a` and that nothing writes meanwhile.
pub(crate) unsafe fn view<'a, T>(pointer: *const T, count: impl TryInto<usize>) -> &'a [T] {
    match count.try_into() {
        // SAFETY: the caller's promise.
        Ok(count) if count > 0 && !pointer.is_null() => unsafe {
            slice::from_raw_parts(pointer, count)
        },
        _ => &[],
    }
}

/// As [`view`], to write.
///
/// # Safety
/// As [`view`], and nothing else reads or writes the values meanwhile.
pub(crate) unsafe fn view_mut<'a, T>(pointer: *mut T, count: impl TryInto<usize>) -> &'a mut [T] {
    match count.try_into() {
        // SAFETY: the caller's promise.
        Ok(count) if count > 0 && !pointer.is_null() => unsafe {
            slice::from_raw_parts_mut(pointer, count)
        },
        _ => &mut [],
    }
}

/// Text of a C string of MuJoCo's; empty where the pointer is null.
///
/// # Safety
/// Otherwise `text` ends with a zero byte.
pub(crate) unsafe fn string(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: the caller's promise.
    unsafe { CStr::from_ptr(text) }
        .to_string_lossy()
        .into_owned()
}

/// Parameters a row of `actuator_gainprm`.
#[cfg(mujoco_plugins)]
pub(crate) const NGAIN: usize = super::bindings::mjNGAIN as usize;

/// Parameters a row of `actuator_biasprm`.
#[cfg(mujoco_plugins)]
pub(crate) const NBIAS: usize = super::bindings::mjNBIAS as usize;

/// Terms of stiffness and damping beyond the linear one.
#[cfg(mujoco_outputs)]
pub(crate) const NPOLY: usize = super::bindings::mjNPOLY as usize;

/// Number of actuators of a model; from 4.0 one may have several controls and outputs.
#[cfg(mujoco_plugins)]
#[allow(
    clippy::unnecessary_cast,
    reason = "counts are 32 or 64 bits by release"
)]
pub(crate) fn actuators(model: &mjModel) -> i64 {
    #[cfg(mujoco_outputs)]
    return model.nactuator as i64;
    #[cfg(not(mujoco_outputs))]
    return model.nu as i64;
}

/// Number of outputs of all actuators.
#[cfg(mujoco_plugins)]
#[allow(
    clippy::unnecessary_cast,
    reason = "counts are 32 or 64 bits by release"
)]
pub(crate) fn outputs(model: &mjModel) -> i64 {
    #[cfg(mujoco_outputs)]
    return model.nout as i64;
    #[cfg(not(mujoco_outputs))]
    return model.nu as i64;
}

/// A compiled model, read only.
#[derive(Clone, Copy)]
pub(crate) struct ModelView<'a> {
    model: &'a mjModel,
    api: &'static Api,
}

/// Slices of the model: `name: type = field, how many`.
macro_rules! model_slices {
    ($($(#[$doc:meta])* $name:ident: $type:ty = $count:expr;)*) => {
        $($(#[$doc])*
        #[allow(non_snake_case)]
        pub(crate) fn $name(&self) -> &'a [$type] {
            let count: fn(&mjModel) -> i64 = $count;
            // SAFETY: MuJoCo allocates `count` values for this field of every model.
            unsafe { view(self.model.$name, count(self.model)) }
        })*
    };
}

#[allow(
    clippy::unnecessary_cast,
    clippy::useless_conversion,
    reason = "counts are 32 or 64 bits by release"
)]
impl<'a> ModelView<'a> {
    /// # Safety
    /// `model` is null or a model of this version of MuJoCo that outlives `'a`.
    pub(crate) unsafe fn new(model: *const mjModel, api: &'static Api) -> Option<Self> {
        // SAFETY: the caller's promise.
        unsafe { model.as_ref() }.map(|model| Self { model, api })
    }

    /// A view of a model that its owner keeps alive.
    pub(crate) fn live(model: &'a mjModel, api: &'static Api) -> Self {
        Self { model, api }
    }

    pub(crate) fn raw(&self) -> &'a mjModel {
        self.model
    }

    pub(crate) fn api(&self) -> &'static Api {
        self.api
    }

    model_slices! {
        body_parentid: i32 = |m| m.nbody as i64;
        body_rootid: i32 = |m| m.nbody as i64;
        body_mocapid: i32 = |m| m.nbody as i64;
        body_jntnum: i32 = |m| m.nbody as i64;
        body_jntadr: i32 = |m| m.nbody as i64;
        body_dofnum: i32 = |m| m.nbody as i64;
        body_dofadr: i32 = |m| m.nbody as i64;
        body_geomnum: i32 = |m| m.nbody as i64;
        body_geomadr: i32 = |m| m.nbody as i64;
        body_mass: f64 = |m| m.nbody as i64;
        body_pos: f64 = |m| m.nbody as i64 * 3;
        body_quat: f64 = |m| m.nbody as i64 * 4;
        body_ipos: f64 = |m| m.nbody as i64 * 3;
        body_iquat: f64 = |m| m.nbody as i64 * 4;
        body_inertia: f64 = |m| m.nbody as i64 * 3;
        jnt_type: i32 = |m| m.njnt as i64;
        jnt_qposadr: i32 = |m| m.njnt as i64;
        jnt_dofadr: i32 = |m| m.njnt as i64;
        jnt_bodyid: i32 = |m| m.njnt as i64;
        jnt_pos: f64 = |m| m.njnt as i64 * 3;
        jnt_axis: f64 = |m| m.njnt as i64 * 3;
        jnt_range: f64 = |m| m.njnt as i64 * 2;
        dof_parentid: i32 = |m| m.nv as i64;
        geom_type: i32 = |m| m.ngeom as i64;
        geom_size: f64 = |m| m.ngeom as i64 * 3;
        geom_group: i32 = |m| m.ngeom as i64;
        geom_fluid: f64 = |m| m.ngeom as i64 * 12;
        geom_pos: f64 = |m| m.ngeom as i64 * 3;
        geom_quat: f64 = |m| m.ngeom as i64 * 4;
        geom_dataid: i32 = |m| m.ngeom as i64;
        mesh_vertadr: i32 = |m| m.nmesh as i64;
        mesh_vertnum: i32 = |m| m.nmesh as i64;
        mesh_faceadr: i32 = |m| m.nmesh as i64;
        mesh_facenum: i32 = |m| m.nmesh as i64;
        mesh_vert: f32 = |m| m.nmeshvert as i64 * 3;
        mesh_face: i32 = |m| m.nmeshface as i64 * 3;
        sensor_adr: i32 = |m| m.nsensor as i64;
        sensor_dim: i32 = |m| m.nsensor as i64;
    }

    #[cfg(mujoco_plugins)]
    model_slices! {
        qpos0: f64 = |m| m.nq as i64;
        body_plugin: i32 = |m| m.nbody as i64;
        body_gravcomp: f64 = |m| m.nbody as i64;
        sensor_plugin: i32 = |m| m.nsensor as i64;
        site_bodyid: i32 = |m| m.nsite as i64;
        plugin: i32 = |m| m.nplugin as i64;
        plugin_stateadr: i32 = |m| m.nplugin as i64;
        plugin_statenum: i32 = |m| m.nplugin as i64;
        body_weldid: i32 = |m| m.nbody as i64;
        body_simple: u8 = |m| m.nbody as i64;
        body_subtreemass: f64 = |m| m.nbody as i64;
        dof_M0: f64 = |m| m.nv as i64;
        dof_damping: f64 = |m| m.nv as i64;
        dof_invweight0: f64 = |m| m.nv as i64;
        jnt_stiffness: f64 = |m| m.njnt as i64;
        dof_armature: f64 = |m| m.nv as i64;
        dof_frictionloss: f64 = |m| m.nv as i64;
        M_rownnz: i32 = |m| m.nv as i64;
        M_rowadr: i32 = |m| m.nv as i64;
        geom_bodyid: i32 = |m| m.ngeom as i64;
        geom_contype: i32 = |m| m.ngeom as i64;
        geom_conaffinity: i32 = |m| m.ngeom as i64;
        geom_aabb: f64 = |m| m.ngeom as i64 * 6;
        geom_rgba: f32 = |m| m.ngeom as i64 * 4;
        sensor_type: i32 = |m| m.nsensor as i64;
        sensor_needstage: i32 = |m| m.nsensor as i64;
        sensor_objtype: i32 = |m| m.nsensor as i64;
        sensor_objid: i32 = |m| m.nsensor as i64;
        sensor_refid: i32 = |m| m.nsensor as i64;
        sensor_cutoff: f64 = |m| m.nsensor as i64;
        sensor_noise: f64 = |m| m.nsensor as i64;
        actuator_trntype: i32 = actuators;
        actuator_trnid: i32 = |m| actuators(m) * 2;
        actuator_gaintype: i32 = actuators;
        actuator_biastype: i32 = actuators;
        actuator_gainprm: f64 = |m| actuators(m) * NGAIN as i64;
        actuator_biasprm: f64 = |m| actuators(m) * NBIAS as i64;
        actuator_actadr: i32 = actuators;
        actuator_actnum: i32 = actuators;
        actuator_group: i32 = actuators;
        actuator_plugin: i32 = actuators;
        actuator_ctrlrange: f64 = |m| m.nu as i64 * 2;
        actuator_forcerange: f64 = |m| actuators(m) * 2;
        actuator_gear: f64 = |m| outputs(m) * 6;
    }

    #[cfg(mujoco_outputs)]
    model_slices! {
        jnt_stiffnesspoly: f64 = |m| m.njnt as i64 * NPOLY as i64;
    }

    #[cfg(not(mujoco_plugins))]
    model_slices! {
        text_adr: i32 = |m| m.ntext as i64;
        text_size: i32 = |m| m.ntext as i64;
    }

    /// Value of a `<custom><text>`; `None` where the model has none of that name.
    #[cfg(not(mujoco_plugins))]
    pub(crate) fn custom_text(&self, name: &str) -> Option<String> {
        let at = self.id(super::bindings::mjOBJ_TEXT as i32, name)?;
        let start = self.text_adr()[at] as usize;
        // The stored size counts the closing zero.
        let end = start + (self.text_size()[at] as usize).saturating_sub(1);
        // SAFETY: MuJoCo allocates `ntextdata` characters.
        let all = unsafe {
            view(
                self.model.text_data.cast::<u8>(),
                self.model.ntextdata as i64,
            )
        };
        Some(String::from_utf8_lossy(&all[start..end]).into_owned())
    }

    /// Three numbers of a row of three.
    pub(crate) fn triple(values: &[f64], row: usize) -> [f64; 3] {
        [values[3 * row], values[3 * row + 1], values[3 * row + 2]]
    }

    /// Four numbers of a row of four.
    pub(crate) fn quadruple(values: &[f64], row: usize) -> [f64; 4] {
        [
            values[4 * row],
            values[4 * row + 1],
            values[4 * row + 2],
            values[4 * row + 3],
        ]
    }

    pub(crate) fn bodies(&self) -> usize {
        self.body_parentid().len()
    }

    /// True where `body` is `root` or hangs below it.
    pub(crate) fn hangs_below(&self, mut body: usize, root: usize) -> bool {
        loop {
            if body == root {
                return true;
            }
            if body == 0 {
                return false;
            }
            body = self.body_parentid()[body] as usize;
        }
    }

    /// Name of an object; empty where it has none.
    pub(crate) fn name(&self, kind: i32, id: usize) -> String {
        // SAFETY: MuJoCo checks kind and id, and returns a C string of the model or null.
        unsafe { string((self.api.functions.mj_id2name)(self.model, kind, id as i32)) }
    }

    /// The object of that name.
    pub(crate) fn id(&self, kind: i32, name: &str) -> Option<usize> {
        let name = std::ffi::CString::new(name).ok()?;
        // SAFETY: a valid C string; MuJoCo checks the kind and returns -1 for an unknown name.
        let id = unsafe { (self.api.functions.mj_name2id)(self.model, kind, name.as_ptr()) };
        usize::try_from(id).ok()
    }

    /// True where MuJoCo's own fluid acts.
    pub(crate) fn has_fluid(&self) -> bool {
        self.model.opt.density > 0.0 || self.model.opt.viscosity > 0.0
    }

    pub(crate) fn runge_kutta(&self) -> bool {
        self.model.opt.integrator as u32 == mjINT_RK4 as u32
    }

    /// True where MuJoCo skips passive forces altogether.
    #[cfg(mujoco_plugins)]
    pub(crate) fn passive_is_off(&self) -> bool {
        use super::bindings::{mjDSBL_DAMPER, mjDSBL_SPRING};
        let both = (mjDSBL_SPRING | mjDSBL_DAMPER) as i32;
        self.model.opt.disableflags & both == both
    }

    /// Name of an object, or `kind_3` where it has none.
    #[cfg(mujoco_plugins)]
    pub(crate) fn label(&self, kind: i32, word: &str, id: usize) -> String {
        match self.name(kind, id) {
            name if name.is_empty() => format!("{word}_{id}"),
            name => name,
        }
    }

    /// The geoms of a body.
    pub(crate) fn geoms(&self, body: usize) -> std::ops::Range<usize> {
        let first = self.body_geomadr()[body].max(0) as usize;
        first..first + self.body_geomnum()[body] as usize
    }

    /// A flag of an actuator or control, whether a byte or a truth value in this release.
    ///
    /// # Safety
    /// `flags` is an array of this model with more than `at` entries.
    #[cfg(mujoco_plugins)]
    pub(crate) unsafe fn flag<T: Copy>(flags: *const T, at: usize) -> bool {
        // SAFETY: the caller's promise; both types are one byte, and zero is false in both.
        !flags.is_null() && unsafe { *flags.cast::<u8>().add(at) } != 0
    }
}

impl std::fmt::Debug for ModelView<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ModelView")
            .field("bodies", &self.bodies())
            .finish_non_exhaustive()
    }
}

/// A simulation, with the model that gives its sizes.
pub(crate) struct DataView<'a> {
    data: NonNull<mjData>,
    model: ModelView<'a>,
    _owned_for: PhantomData<&'a mut mjData>,
}

/// Slices of the data, read through `&self`.
macro_rules! data_slices {
    ($($name:ident: $type:ty = $count:expr;)*) => {
        $(#[allow(non_snake_case)]
        pub(crate) fn $name(&self) -> &[$type] {
            let count: fn(&mjModel) -> i64 = $count;
            // SAFETY: MuJoCo allocates `count` values for this field of every data of this model, and
            // writers need `&mut self`.
            unsafe { view((*self.data.as_ptr()).$name, count(self.model.raw())) }
        })*
    };
}

/// Slices of the data, written through `&mut self`.
macro_rules! data_slices_mut {
    ($($name:ident: $type:ty = $field:ident, $count:expr;)*) => {
        $(#[allow(non_snake_case)]
        pub(crate) fn $name(&mut self) -> &mut [$type] {
            let count: fn(&mjModel) -> i64 = $count;
            // SAFETY: as for the slices that are read; `&mut self` keeps readers away.
            unsafe { view_mut((*self.data.as_ptr()).$field, count(self.model.raw())) }
        })*
    };
}

#[allow(
    clippy::unnecessary_cast,
    reason = "counts are 32 or 64 bits by release"
)]
impl<'a> DataView<'a> {
    /// # Safety
    /// `data` is null or a data of `model` that nothing else uses during `'a`.
    pub(crate) unsafe fn new(data: *mut mjData, model: ModelView<'a>) -> Option<Self> {
        NonNull::new(data).map(|data| Self {
            data,
            model,
            _owned_for: PhantomData,
        })
    }

    /// The data and the model that MuJoCo passed to a callback; `None` where one is null.
    ///
    /// # Safety
    /// The model and the data are null, or live and used by nothing else during `'a`; the data is of that
    /// model.
    #[cfg(mujoco_plugins)]
    pub(crate) unsafe fn from_callback(m: *const mjModel, d: *mut mjData) -> Option<Self> {
        // SAFETY: the caller's promise.
        let model = unsafe { ModelView::new(m, Api::get()?) }?;
        // SAFETY: the caller's promise.
        unsafe { Self::new(d, model) }
    }

    /// A view of a data that its owner keeps alive and to itself.
    pub(crate) fn live(data: NonNull<mjData>, model: ModelView<'a>) -> Self {
        Self {
            data,
            model,
            _owned_for: PhantomData,
        }
    }

    pub(crate) fn model(&self) -> ModelView<'a> {
        self.model
    }

    data_slices! {
        qpos: f64 = |m| m.nq as i64;
        qvel: f64 = |m| m.nv as i64;
        ctrl: f64 = |m| m.nu as i64;
        qacc: f64 = |m| m.nv as i64;
        qfrc_applied: f64 = |m| m.nv as i64;
        qfrc_passive: f64 = |m| m.nv as i64;
        qfrc_actuator: f64 = |m| m.nv as i64;
        xfrc_applied: f64 = |m| m.nbody as i64 * 6;
        userdata: f64 = |m| m.nuserdata as i64;
        sensordata: f64 = |m| m.nsensordata as i64;
        xpos: f64 = |m| m.nbody as i64 * 3;
        xquat: f64 = |m| m.nbody as i64 * 4;
        xmat: f64 = |m| m.nbody as i64 * 9;
        subtree_com: f64 = |m| m.nbody as i64 * 3;
        cdof: f64 = |m| m.nv as i64 * 6;
    }

    data_slices_mut! {
        qpos_mut: f64 = qpos, |m| m.nq as i64;
        qvel_mut: f64 = qvel, |m| m.nv as i64;
        ctrl_mut: f64 = ctrl, |m| m.nu as i64;
        qfrc_applied_mut: f64 = qfrc_applied, |m| m.nv as i64;
        xfrc_applied_mut: f64 = xfrc_applied, |m| m.nbody as i64 * 6;
        qfrc_passive_mut: f64 = qfrc_passive, |m| m.nv as i64;
    }

    #[cfg(mujoco_plugins)]
    data_slices! {
        qfrc_fluid: f64 = |m| m.nv as i64;
        geom_xpos: f64 = |m| m.ngeom as i64 * 3;
        cvel: f64 = |m| m.nbody as i64 * 6;
        geom_xmat: f64 = |m| m.ngeom as i64 * 9;
        ximat: f64 = |m| m.nbody as i64 * 9;
        xipos: f64 = |m| m.nbody as i64 * 3;
        site_xpos: f64 = |m| m.nsite as i64 * 3;
        site_xmat: f64 = |m| m.nsite as i64 * 9;
        cfrc_int: f64 = |m| m.nbody as i64 * 6;
        plugin_state: f64 = |m| m.npluginstate as i64;
        plugin_data: usize = |m| m.nplugin as i64;
        act: f64 = |m| m.na as i64;
        cdof_dot: f64 = |m| m.nv as i64 * 6;
        actuator_length: f64 = outputs;
        actuator_velocity: f64 = outputs;
        moment_rownnz: i32 = outputs;
        moment_rowadr: i32 = outputs;
        moment_colind: i32 = |m| m.nJmom as i64;
        actuator_moment: f64 = |m| m.nJmom as i64;
    }

    #[cfg(mujoco_plugins)]
    data_slices_mut! {
        sensordata_mut: f64 = sensordata, |m| m.nsensordata as i64;
        plugin_data_mut: usize = plugin_data, |m| m.nplugin as i64;
        M_mut: f64 = M, |m| m.nC as i64;
    }

    /// Makes the inertia matrix anew.
    #[cfg(mujoco_plugins)]
    pub(crate) fn make_inertia(&mut self) {
        // SAFETY: a live model and a data of it, held alone.
        unsafe { (self.model.api.functions.mj_makeM)(self.model.raw(), self.data.as_ptr()) }
    }

    /// Factorises the inertia matrix as it stands, and brings what the dual solvers made of it along.
    #[cfg(mujoco_plugins)]
    pub(crate) fn factor_inertia(&mut self) {
        use super::bindings::mjSOL_PGS;
        let option = &self.model.raw().opt;
        let dual = option.solver as u32 == mjSOL_PGS as u32 || option.noslip_iterations > 0;
        let functions = &self.model.api.functions;
        // SAFETY: a live model and a data of it, held alone.
        unsafe {
            (functions.mj_factorM)(self.model.raw(), self.data.as_ptr());
            if dual && (*self.data.as_ptr()).nefc > 0 {
                (functions.mj_projectConstraint)(self.model.raw(), self.data.as_ptr());
            }
        }
    }

    pub(crate) fn time(&self) -> f64 {
        // SAFETY: a live data.
        unsafe { (*self.data.as_ptr()).time }
    }

    pub(crate) fn set_time(&mut self, time: f64) {
        // SAFETY: a live data, held alone.
        unsafe { (*self.data.as_ptr()).time = time }
    }

    /// The time and the state of the model.
    pub(crate) fn moment(&self) -> Moment<'_> {
        Moment {
            time: self.time(),
            timestep: self.model.raw().opt.timestep,
            runge_kutta: self.model.runge_kutta(),
            qpos: self.qpos(),
            qvel: self.qvel(),
            water: [0.0; 3],
        }
    }

    /// A part of the plugin state to write, beside the state of the model.
    #[cfg(mujoco_plugins)]
    pub(crate) fn plugin_state_and_moment(&mut self, instance: usize) -> (&mut [f64], Moment<'_>) {
        let (start, len) = plugin_state_range(self.model, instance);
        // SAFETY: MuJoCo's state of this instance; the moment reads other fields.
        let state = unsafe {
            let all = view_mut(
                (*self.data.as_ptr()).plugin_state,
                self.model.raw().npluginstate as i64,
            );
            &mut all[start..start + len]
        };
        (state, self.moment())
    }

    /// The plugin state of one instance.
    #[cfg(mujoco_plugins)]
    pub(crate) fn instance_state(&self, instance: usize) -> &[f64] {
        let (start, len) = plugin_state_range(self.model, instance);
        &self.plugin_state()[start..start + len]
    }

    /// The first `len` numbers of the user's data to write, beside the state of the model.
    #[cfg(not(mujoco_plugins))]
    pub(crate) fn userdata_and_moment(&mut self, len: usize) -> (&mut [f64], Moment<'_>) {
        // SAFETY: `nuserdata` numbers; the moment reads other fields.
        let state = unsafe {
            let all: &mut [mjtNum] = view_mut(
                (*self.data.as_ptr()).userdata,
                self.model.raw().nuserdata as i64,
            );
            &mut all[..len]
        };
        (state, self.moment())
    }
}

#[cfg(mujoco_plugins)]
fn plugin_state_range(model: ModelView<'_>, instance: usize) -> (usize, usize) {
    let len = model.plugin_statenum()[instance] as usize;
    (model.plugin_stateadr()[instance] as usize, len)
}

const _: () = assert!(
    size_of::<mjtNum>() == size_of::<f64>(),
    "this room is written for MuJoCo in double precision"
);

impl std::fmt::Debug for DataView<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DataView")
            .field("time", &self.time())
            .finish_non_exhaustive()
    }
}
