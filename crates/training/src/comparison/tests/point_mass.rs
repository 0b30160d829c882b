//! A simulator in closed form.

use hydro_frames::Wrench;

use crate::simulator::Simulator;

/// A point mass in still water without joints: `m v' = F`, exact for a constant force.
#[derive(Clone, Debug)]
pub(crate) struct PointMass {
    mass: f64,
    timestep: f64,
    push: [f64; 3],
    wrench: Wrench,
    qpos: [f64; 7],
    qvel: [f64; 6],
    time: f64,
    /// When the simulation pretends to blow up and to be reset, as MuJoCo does [s].
    breaks_at: f64,
}

impl PointMass {
    /// At rest at the origin.
    pub(crate) fn new(mass: f64, timestep: f64) -> Self {
        Self {
            mass,
            timestep,
            push: [0.0; 3],
            wrench: Wrench::default(),
            qpos: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            qvel: [0.0; 6],
            time: 0.0,
            breaks_at: f64::INFINITY,
        }
    }

    /// Blows up at a time [s], and stands still at the origin from then on.
    pub(crate) fn break_at(&mut self, time: f64) {
        self.breaks_at = time;
    }
}

impl Simulator for PointMass {
    fn timestep(&self) -> f64 {
        self.timestep
    }

    fn restart(&mut self, qpos: &[f64], qvel: &[f64]) {
        self.qpos.copy_from_slice(qpos);
        self.qvel.copy_from_slice(qvel);
        self.push = [0.0; 3];
        self.wrench = Wrench::default();
        self.time = 0.0;
    }

    fn set_control(&mut self, _control: &[f64]) {}

    fn set_push(&mut self, push: &[f64]) {
        self.push.copy_from_slice(&push[..3]);
    }

    fn set_base_wrench(&mut self, wrench: Wrench) {
        self.wrench = wrench;
    }

    fn set_generalised_force(&mut self, force: &[f64]) {
        // It does not turn: base and world are one.
        self.wrench.force.copy_from_slice(&force[..3]);
    }

    fn step(&mut self) {
        let h = self.timestep;
        self.time += h;
        if self.diverged() {
            self.qpos = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
            self.qvel = [0.0; 6];
            return;
        }
        for axis in 0..3 {
            let acceleration = (self.push[axis] + self.wrench.force[axis]) / self.mass;
            self.qpos[axis] += h * self.qvel[axis] + 0.5 * h * h * acceleration;
            self.qvel[axis] += h * acceleration;
        }
    }

    fn qpos(&self) -> &[f64] {
        &self.qpos
    }

    fn qvel(&self) -> &[f64] {
        &self.qvel
    }

    fn diverged(&self) -> bool {
        self.time >= self.breaks_at
    }

    fn water_wrench(&self) -> Wrench {
        self.wrench
    }
}
