//! A compiled model.

use std::{
    ffi::c_char,
    fs,
    ops::Range,
    path::{Path, PathBuf},
    ptr::NonNull,
};

#[cfg(mujoco_plugins)]
use hydro_effects::hydrostatics::Hull;

use super::error::{ERROR_LEN, SimulatorError, c_path, refused};
#[cfg(mujoco_plugins)]
use crate::{mujoco::effects::sizes, plugin::native_fluid::EllipsoidCoefficients};
use crate::{
    mujoco::{
        bodies::base_body,
        ffi::{
            Api, ModelView,
            bindings::{
                mjINT_EULER, mjINT_RK4, mjModel, mjOBJ_ACTUATOR, mjOBJ_BODY, mjOBJ_JOINT,
                mjOBJ_SENSOR,
            },
            last_refusal, scene_folder,
        },
        registration,
    },
    plugin::{Body, Joint, JointKind},
};

/// The time integrator.
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
            Self::ImplicitFast => crate::mujoco::ffi::bindings::mjINT_IMPLICITFAST as i32,
        }
    }
}

/// A compiled model.
#[derive(Debug)]
pub struct Model {
    pub(super) model: NonNull<mjModel>,
    pub(super) api: &'static Api,
    /// The folder of the MJCF, where it was a file.
    pub(super) folder: Option<PathBuf>,
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

/// Hull of a body, in its frame.
#[cfg(mujoco_plugins)]
#[derive(Clone, Debug)]
pub struct BodyShape {
    /// Its closed shapes; the ellipsoid of the body's inertia where it has no geoms.
    pub hull: Hull,
    /// Middle of the box about its geoms [m].
    pub middle: [f64; 3],
    /// Extents of that box [m].
    pub extent: [f64; 3],
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
        registration::register()?;
        let api = Api::running_or_opened()?;
        let name = c_path(path)?;
        let mut error = [0_u8; ERROR_LEN];
        last_refusal::forget();
        let folder = scene_folder::folder(path);
        // SAFETY: a C string, no virtual files, and a buffer of the length given.
        let model = scene_folder::known(folder.as_deref(), || unsafe {
            let buffer = error.as_mut_ptr().cast::<c_char>();
            (api.functions.mj_loadXML)(name.as_ptr(), std::ptr::null(), buffer, ERROR_LEN as i32)
        });
        let Some(model) = NonNull::new(model) else {
            return Err(refused(path, &error));
        };
        Ok(Self { model, api, folder })
    }

    /// A model of its own, to be changed.
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn try_clone(&self) -> Result<Self, SimulatorError> {
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
            folder: self.folder.clone(),
        })
    }

    /// Brings along what depends on masses and frames.
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn set_constants(&mut self) -> Result<(), SimulatorError> {
        let functions = &self.api.functions;
        let folder = self.folder.as_deref();
        // SAFETY: a live model, held alone, and a data of it that is freed at once.
        unsafe {
            let data = scene_folder::known(folder, || (functions.mj_makeData)(self.model.as_ptr()));
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
    pub(in crate::mujoco) fn add_wind(&mut self, more: [f64; 3]) {
        for (wind, more) in self.raw_mut().opt.wind.iter_mut().zip(more) {
            *wind += more;
        }
    }

    /// Sets half the ranges of joints [rad or m].
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn set_ranges(&mut self, halves: &[(usize, f64)]) {
        let raw = self.raw_mut();
        // SAFETY: two numbers a joint, and the model is held alone.
        let ranges = unsafe { crate::mujoco::ffi::views::view_mut(raw.jnt_range, raw.njnt * 2) };
        for (joint, half) in halves {
            ranges[2 * joint..2 * joint + 2].copy_from_slice(&[-half, *half]);
        }
    }

    /// Length of a state of this kind (bits of `mjtState`).
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn state_len(&self, kind: i32) -> usize {
        // SAFETY: a live model.
        let len = unsafe { (self.api.functions.mj_stateSize)(self.model.as_ptr(), kind) };
        usize::try_from(len).unwrap_or(0)
    }

    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn api(&self) -> &'static Api {
        self.api
    }

    /// Takes over a model that MuJoCo has made and that nothing else owns.
    #[cfg(mujoco_plugins)]
    pub(in crate::mujoco) fn owned(
        model: NonNull<mjModel>,
        api: &'static Api,
        folder: Option<PathBuf>,
    ) -> Self {
        Self { model, api, folder }
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

    pub(in crate::mujoco) fn view(&self) -> ModelView<'_> {
        ModelView::live(self.raw(), self.api)
    }

    pub(in crate::mujoco) fn raw(&self) -> &mjModel {
        // SAFETY: owned and not null; freed only on drop.
        unsafe { self.model.as_ref() }
    }

    pub(in crate::mujoco) fn raw_mut(&mut self) -> &mut mjModel {
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

    /// Sets the time integrator.
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
    /// If the scene's density is zero.
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
        base_body::joints(self.view())
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

    /// Hull of a body and what is welded to it: that of the plugin where no attribute says otherwise.
    #[cfg(mujoco_plugins)]
    pub fn body_shape(&self, name: &str) -> Result<BodyShape, SimulatorError> {
        let body = self.body(name)?;
        let model = self.view();
        let (middle, extent) = sizes::bounding_box(model, body, None);
        Ok(BodyShape {
            hull: sizes::body_hull(model, body, None),
            middle,
            extent,
        })
    }

    /// A body as a card sees it: how it is held, and the model's joints.
    pub fn describe(&self, body: usize) -> Body {
        base_body::body(self.view(), body)
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

    /// Range of a sensor's numbers in `sensordata`.
    pub fn sensor(&self, name: &str) -> Result<Range<usize>, SimulatorError> {
        let id = self.id("sensor", mjOBJ_SENSOR as i32, name)?;
        let start = self.view().sensor_adr()[id] as usize;
        Ok(start..start + self.view().sensor_dim()[id] as usize)
    }

    /// Index of an actuator's control in `ctrl`.
    pub fn actuator(&self, name: &str) -> Result<usize, SimulatorError> {
        self.id("actuator", mjOBJ_ACTUATOR as i32, name)
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
