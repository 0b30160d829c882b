//! A floating robot in a MuJoCo scene, as comparisons drive it.

use std::sync::Arc;

use hydro_frames::{Wrench, base_from_world, to_world};
use hydro_training::simulator::Simulator;

use super::{Data, Model, SimulatorError};

/// Speed [m/s, rad/s] beyond which a simulation has blown up; it is not stepped any further.
const RUNAWAY: f64 = 1e3;

/// A robot whose first joint is free.
#[derive(Debug)]
pub struct Swimmer {
    data: Data,
    /// Index in `xfrc_applied` of the base's force and torque in the world.
    push: usize,
    diverged: bool,
}

impl Swimmer {
    /// At the model's initial state.
    ///
    /// # Errors
    /// If the model has no floating base, or its free joint is not the first.
    pub fn new(model: Model) -> Result<Self, SimulatorError> {
        let first_is_free = model.describes_floating_robot();
        let base = model.floating_base().filter(|_| first_is_free);
        let base = base.ok_or_else(|| SimulatorError::NotFloating {
            joints: model.joints().into_iter().map(|joint| joint.name).collect(),
        })?;
        Ok(Self {
            data: Data::new(&Arc::new(model))?,
            push: 6 * base,
            diverged: false,
        })
    }

    /// The simulation itself.
    pub fn data(&mut self) -> &mut Data {
        &mut self.data
    }

    fn attitude(&self) -> [f64; 4] {
        let q = self.data.qpos();
        [q[3], q[4], q[5], q[6]]
    }

    /// Passive wrench on the base at a state, without a step: positions, then velocities.
    pub fn passive_wrench_at(&mut self, qpos: &[f64], qvel: &[f64]) -> Wrench {
        self.data.qpos_mut().copy_from_slice(qpos);
        self.data.qvel_mut().copy_from_slice(qvel);
        self.data.forward();
        self.water_wrench()
    }
}

impl Simulator for Swimmer {
    fn timestep(&self) -> f64 {
        self.data.model().timestep()
    }

    fn restart(&mut self, qpos: &[f64], qvel: &[f64]) {
        self.data.reset();
        self.diverged = false;
        self.data.qpos_mut().copy_from_slice(qpos);
        self.data.qvel_mut().copy_from_slice(qvel);
    }

    fn set_control(&mut self, control: &[f64]) {
        self.data.ctrl_mut().copy_from_slice(control);
    }

    fn set_push(&mut self, push: &[f64]) {
        let at = self.push;
        self.data.xfrc_applied_mut()[at..at + 6].copy_from_slice(push);
    }

    fn set_base_wrench(&mut self, wrench: Wrench) {
        let force = to_world(self.attitude(), wrench.force);
        let applied = &mut self.data.qfrc_applied_mut()[..6];
        applied[..3].copy_from_slice(&force);
        applied[3..].copy_from_slice(&wrench.torque);
    }

    fn set_generalised_force(&mut self, force: &[f64]) {
        self.data.qfrc_applied_mut()[..force.len()].copy_from_slice(force);
    }

    fn step(&mut self) {
        if self.diverged {
            return;
        }
        let before = self.data.time();
        self.data.step();
        // MuJoCo answers a state that is no number with a reset, which sets the clock back.
        let runaway = self.data.qvel().iter().any(|v| v.abs() > RUNAWAY);
        self.diverged = runaway || self.data.time() <= before;
    }

    fn qpos(&self) -> &[f64] {
        self.data.qpos()
    }

    fn qvel(&self) -> &[f64] {
        self.data.qvel()
    }

    fn diverged(&self) -> bool {
        self.diverged
    }

    /// All passive forces on the free joint, which has neither spring nor damper: fluid, buoyancy, plugin.
    fn water_wrench(&self) -> Wrench {
        let passive = self.data.qfrc_passive();
        let force = base_from_world(self.attitude(), [passive[0], passive[1], passive[2]]);
        Wrench {
            force,
            torque: [passive[3], passive[4], passive[5]],
        }
    }
}
