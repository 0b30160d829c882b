//! One simulation of a plant.

use std::sync::Arc;

use hydro_frames as frames;
use hydro_frames::Wrench;
use hydro_gap::plant::{Simulation, prescribed::PrescribedMotion};
use nalgebra::{DMatrix, Vector3};

use super::prescribed::Imposed;
use crate::{
    mujoco::{
        bodies::joint_space::{rotation, vector},
        effects::{
            active_effects::{self, ActiveEffects},
            actuation, forces,
        },
        ffi::{
            ModelView,
            bindings::{
                mjOBJ_BODY, mjOBJ_SITE, mjSENS_FORCE, mjSENS_TORQUE, mjSTATE_FULLPHYSICS,
                mjSTATE_WARMSTART, mjWARN_BADQACC, mjWARN_BADQPOS, mjWARN_BADQVEL,
            },
        },
        simulator::Data,
        wrench::instance_effects,
    },
    plugin::bound::Acting,
};

/// Speeds [m/s, rad/s] and accelerations beyond which a simulation has blown up; it is not stepped any
/// further.
const RUNAWAY: f64 = 1e7;

/// Warnings of MuJoCo's after which a simulation is reset.
const FATAL: [u32; 3] = [mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC];

/// A force or torque sensor of MuJoCo's, which does not feel what is added.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoadSensor {
    /// Index of its three numbers in the readings.
    start: usize,
    site: usize,
    force: bool,
    /// Largest reading; zero: none.
    cutoff: f64,
}

impl LoadSensor {
    /// All of a model.
    pub(crate) fn all(model: ModelView<'_>) -> Vec<Self> {
        (0..model.sensor_type().len())
            .filter_map(|id| {
                let force = is_dry(model, id)?;
                (model.sensor_objtype()[id] as u32 == mjOBJ_SITE).then(|| Self {
                    start: model.sensor_adr()[id] as usize,
                    site: model.sensor_objid()[id] as usize,
                    force,
                    cutoff: model.sensor_cutoff()[id],
                })
            })
            .collect()
    }
}

/// True for the sensors that MuJoCo itself leaves dry.
fn is_dry(model: ModelView<'_>, sensor: usize) -> Option<bool> {
    match model.sensor_type()[sensor] as u32 {
        code if code == mjSENS_FORCE => Some(true),
        code if code == mjSENS_TORQUE => Some(false),
        _ => None,
    }
}

/// A simulation with effects.
#[derive(Debug)]
pub(crate) struct MujocoSimulation {
    data: Data,
    active: ActiveEffects,
    /// Commands as logged.
    control: Vec<f64>,
    /// Commands of the step before; none before the first.
    earlier: Option<Vec<f64>>,
    readings: Vec<f64>,
    /// Velocities at the start of the latest step, which the readings belong to.
    velocities: Vec<f64>,
    /// Time of that step's start [s].
    began: f64,
    /// The force and torque sensors that effects change.
    loads: Vec<LoadSensor>,
    /// Index of the free base in `qpos` and `qvel`, if there is one.
    base: Option<(usize, usize)>,
    /// Wrench on the base, in its frame.
    wrench: Option<Wrench>,
    /// Generalised forces beside it; empty where none were set.
    force: Vec<f64>,
    /// Motion that is imposed.
    imposed: Option<Imposed>,
    diverged: bool,
}

impl MujocoSimulation {
    pub(crate) fn new(
        data: Data,
        active: ActiveEffects,
        loads: &[LoadSensor],
        base: Option<(usize, usize)>,
    ) -> Self {
        let acts = !(active.bound.bodies.is_empty() && active.bound.water.is_empty());
        Self {
            control: vec![0.0; data.ctrl().len()],
            earlier: None,
            readings: data.sensordata().to_vec(),
            velocities: data.qvel().to_vec(),
            began: data.time(),
            loads: if acts { loads.to_vec() } else { Vec::new() },
            data,
            active,
            base,
            wrench: None,
            force: Vec::new(),
            imposed: None,
            diverged: false,
        }
    }

    fn cold(&mut self) {
        self.active.memory.fill(0.0);
        self.earlier = None;
        self.diverged = false;
    }

    /// Readings from here on belong to the present state.
    fn begin(&mut self) {
        self.velocities.copy_from_slice(self.data.qvel());
        self.began = self.data.time();
    }

    /// Takes the readings of the step that was made, with what was added.
    fn read(&mut self) {
        self.readings.copy_from_slice(self.data.sensordata());
        if self.loads.is_empty() || self.data.model().view().passive_is_off() {
            return;
        }
        // All that is derived from the state is still that of the step's start, but the state is not.
        let now = self.data.time();
        self.data.set_time(self.began);
        self.data.qvel_mut().swap_with_slice(&mut self.velocities);
        let (data, readings, loads) = (&mut self.data, &mut self.readings, &self.loads);
        active_effects::with_active(&self.active, || {
            let mut view = data.view();
            let instances = instance_effects::with_effects(&mut view);
            instance_effects::with_sources(&view, &instances, |view, sources| {
                for load in loads {
                    let point = vector(view.site_xpos(), load.site);
                    let body = view.model().site_bodyid()[load.site] as usize;
                    let mut added = Vector3::zeros();
                    let ours = sources.len() - 1;
                    forces::on_subtree(view, sources, body, ours, |at, force, torque| {
                        added += if load.force {
                            force
                        } else {
                            torque + (at - point).cross(&force)
                        };
                    });
                    let added = rotation(view.site_xmat(), load.site).tr_mul(&added);
                    for (value, added) in readings[load.start..].iter_mut().zip(added.iter()) {
                        *value -= added;
                        if load.cutoff > 0.0 {
                            *value = value.clamp(-load.cutoff, load.cutoff);
                        }
                    }
                }
            });
        });
        self.data.qvel_mut().swap_with_slice(&mut self.velocities);
        self.data.set_time(now);
    }

    /// Commands that arrive, from those that were logged.
    fn command(&mut self) {
        let lead = self.active.command_lead;
        let ahead = self.earlier.as_ref().filter(|_| lead != 0.0);
        for (at, command) in self.data.ctrl_mut().iter_mut().enumerate() {
            let now = self.control[at];
            // Commands are linear between rows.
            *command = now + ahead.map_or(0.0, |earlier| lead * (now - earlier[at]));
        }
        self.earlier
            .get_or_insert_default()
            .clone_from(&self.control);
        let step = self.data.model().timestep();
        for changed in &self.active.bound.actuators {
            let given = self.data.ctrl()[changed.control];
            let arrived = actuation::arriving(changed, given, step, &mut self.active.memory);
            self.data.ctrl_mut()[changed.control] = arrived;
        }
    }

    /// Applies the generalised forces and the base wrench that were asked for, which turns with the base. A free joint's
    /// velocities are linear in the world and angular in the body's frame.
    fn push(&mut self) {
        if !self.force.is_empty() {
            self.data.qfrc_applied_mut().copy_from_slice(&self.force);
        }
        let (Some((qpos, dof)), Some(wrench)) = (self.base, self.wrench) else {
            return;
        };
        let attitude = &self.data.qpos()[qpos + 3..qpos + 7];
        let attitude = [attitude[0], attitude[1], attitude[2], attitude[3]];
        let pushed = [frames::to_world(attitude, wrench.force), wrench.torque].concat();
        let own = self.force.get(dof..dof + 6);
        let applied = &mut self.data.qfrc_applied_mut()[dof..dof + 6];
        for (axis, value) in applied.iter_mut().enumerate() {
            *value = pushed[axis] + own.map_or(0.0, |own| own[axis]);
        }
    }

    /// Sets the imposed state of the present time; what stands still stays at `held`.
    fn impose(&mut self, held: Option<&[f64]>) {
        if let Some(imposed) = &self.imposed {
            imposed.set(&mut self.data, held);
        }
    }

    /// Applies the forces that the imposed motion takes.
    fn drive(&mut self) {
        let (active, data) = (&self.active, &mut self.data);
        let forward = |data: &mut Data| active_effects::with_active(active, || data.forward());
        if let Some(imposed) = &self.imposed {
            imposed.drive(data, &self.force, &forward);
        }
    }

    /// Brings everything that follows from the present state up to date, and takes the readings.
    fn show(&mut self) {
        self.begin();
        let data = &mut self.data;
        active_effects::with_active(&self.active, || data.forward());
        self.read();
    }

    fn advance_memory(&mut self) {
        if self.active.bound.memory_len == 0 {
            return;
        }
        let mut memory = std::mem::take(&mut self.active.memory);
        // Sources read the memory of the step's start; the effects of ours alone are brought on.
        self.active.memory.clone_from(&memory);
        let data = &mut self.data;
        active_effects::with_active(&self.active, || {
            let mut view = data.view();
            let instances = instance_effects::with_effects(&mut view);
            instance_effects::with_sources(&view, &instances, |view, sources| {
                forces::advance_memory(view, sources, sources.len() - 1, &mut memory);
            });
        });
        self.active.memory = memory;
    }

    fn has_blown_up(&self) -> bool {
        let wild = |values: &[f64]| {
            values
                .iter()
                .any(|value| value.is_nan() || value.abs() >= RUNAWAY)
        };
        wild(self.data.qvel())
            || wild(self.data.qpos())
            || FATAL.iter().any(|kind| self.data.warnings(*kind) > 0)
    }
}

impl Simulation for MujocoSimulation {
    fn reset(&mut self) {
        self.data.reset();
        self.control.fill(0.0);
        self.cold();
        self.readings.copy_from_slice(self.data.sensordata());
    }

    fn time(&self) -> f64 {
        self.data.time()
    }

    fn restart(&mut self, state: &[f64]) {
        self.cold();
        self.data.reset();
        self.rejoin(state);
    }

    fn rejoin(&mut self, state: &[f64]) {
        // A whole reset clears far more memory than a step touches.
        self.data.reset_warnings();
        let cold = vec![0.0; self.data.qvel().len()];
        let _ = self.data.set_part(mjSTATE_WARMSTART as i32, &cold);
        let set = self.data.set_part(mjSTATE_FULLPHYSICS as i32, state);
        // A state of another model's length is no state: nothing that follows from it counts.
        self.diverged = set.is_err() || state.iter().any(|value| !value.is_finite());
    }

    fn set_motion(&mut self, time: f64, qpos: &[f64], qvel: &[f64]) {
        self.data.set_time(time);
        self.data.qpos_mut().copy_from_slice(qpos);
        self.data.qvel_mut().copy_from_slice(qvel);
        self.impose(None);
        self.diverged = self.has_blown_up();
    }

    fn qpos(&self) -> &[f64] {
        self.data.qpos()
    }

    fn qvel(&self) -> &[f64] {
        self.data.qvel()
    }

    fn retract(&mut self, tangent: &[f64]) {
        let nv = self.data.qvel().len();
        self.data.integrate_position(&tangent[..nv]);
        for (value, more) in self.data.qvel_mut().iter_mut().zip(&tangent[nv..]) {
            *value += more;
        }
    }

    fn differentiate(&self, from: &[f64], to: &[f64], tangent: &mut [f64]) {
        self.data.differentiate_position(from, to, tangent);
    }

    fn full_state(&self) -> Vec<f64> {
        self.data.part(mjSTATE_FULLPHYSICS as i32)
    }

    fn commands_before(&self) -> f64 {
        self.active.commands_before
    }

    fn memory(&self) -> Vec<f64> {
        self.active.memory.clone()
    }

    fn set_memory(&mut self, memory: &[f64]) {
        if memory.len() == self.active.memory.len() {
            self.active.memory.copy_from_slice(memory);
        }
    }

    fn save(&self) -> Vec<f64> {
        let mut saved = self.data.state();
        saved.extend(&self.control);
        saved.extend(&self.active.memory);
        saved.push(f64::from(u8::from(self.diverged)));
        saved
    }

    fn load(&mut self, saved: &[f64]) {
        let (controls, memory) = (self.control.len(), self.active.memory.len());
        let Some(state) = saved.len().checked_sub(controls + memory + 1) else {
            self.diverged = true;
            return;
        };
        self.data.reset_warnings();
        let set = self.data.set_state(&saved[..state]);
        self.control
            .copy_from_slice(&saved[state..state + controls]);
        self.active
            .memory
            .copy_from_slice(&saved[state + controls..saved.len() - 1]);
        self.diverged = set.is_err() || saved[saved.len() - 1] != 0.0;
    }

    fn set_control(&mut self, control: &[f64]) {
        self.control.copy_from_slice(control);
    }

    fn body_jacobian(&mut self, body: &str) -> DMatrix<f64> {
        let nv = self.data.model().nv();
        let mut jacobian = DMatrix::zeros(6, nv);
        let id = self.data.model().view().id(mjOBJ_BODY as i32, body);
        if let Some(id) = id {
            let rows = self.data.body_jacobian(id);
            let q = ModelView::quadruple(self.data.xquat(), id);
            let attitude = frames::world_from_base(q).to_rotation_matrix();
            for (first, rows) in [0, 3].into_iter().zip(rows) {
                let in_world = DMatrix::from_row_slice(3, nv, &rows);
                let own = attitude.matrix().transpose() * in_world;
                jacobian.rows_mut(first, 3).copy_from(&own);
            }
        }
        jacobian
    }

    fn set_base_wrench(&mut self, wrench: Wrench) {
        self.wrench = Some(wrench);
    }

    fn set_earlier_control(&mut self, control: &[f64]) {
        let earlier = self.earlier.get_or_insert_default();
        earlier.clear();
        earlier.extend_from_slice(control);
    }

    fn set_force(&mut self, force: &[f64]) {
        self.force.clear();
        self.force.extend_from_slice(force);
    }

    fn prescribe(&mut self, motion: Option<Arc<PrescribedMotion>>) {
        if self.imposed.is_some() {
            self.data.qfrc_applied_mut().fill(0.0);
            self.data.xfrc_applied_mut().fill(0.0);
        }
        self.imposed = motion.map(|motion| Imposed::new(self.data.model(), motion));
    }

    fn step(&mut self) {
        if self.diverged {
            return;
        }
        self.command();
        self.push();
        self.impose(None);
        self.drive();
        let held = self.imposed.as_ref().map(|_| self.data.qpos().to_vec());
        // Runge-Kutta leaves its last stage behind; readings belong to the first.
        let before = self.data.model().view().runge_kutta() && !self.loads.is_empty();
        if before {
            self.show();
        } else {
            self.begin();
        }
        let data = &mut self.data;
        active_effects::with_active(&self.active, || data.step());
        if !before {
            self.read();
        }
        self.advance_memory();
        self.impose(held.as_deref());
        self.diverged = self.has_blown_up();
    }

    fn remember(&mut self, next: &[f64]) {
        self.command();
        let bound = &self.active.bound;
        let remembers = |acting: &Acting| !acting.memory.is_empty();
        let of_bodies = bound.bodies.iter().flat_map(|of| &of.acting).any(remembers);
        if !of_bodies && !bound.joints.iter().any(|of| remembers(&of.acting)) {
            return;
        }
        self.data.derive_motion();
        let set = self.data.set_part(mjSTATE_FULLPHYSICS as i32, next);
        self.diverged |= set.is_err();
        self.advance_memory();
    }

    fn look(&mut self) {
        if self.diverged {
            return;
        }
        self.impose(None);
        self.drive();
        self.show();
    }

    fn reading_lead(&self) -> f64 {
        self.active.reading_lead
    }

    fn sensors(&self) -> &[f64] {
        &self.readings
    }

    fn diverged(&self) -> bool {
        self.diverged
    }
}
