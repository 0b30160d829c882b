//! One run.

use super::table::Table;

/// One run: `N + 1` samples, `N` intervals.
#[derive(Clone, Debug)]
pub struct Rollout {
    /// File name without its ending.
    pub name: String,
    /// Water density [kg/m^3].
    pub density: f64,
    /// Sample times [s], `N + 1`.
    pub time: Vec<f64>,
    /// Positions, `[N + 1, nq]`.
    pub qpos: Table,
    /// Velocities, `[N + 1, nv]`.
    pub qvel: Table,
    /// Controls, `[N, nu]`, each held over an interval.
    pub ctrl: Table,
    /// World force [N] and torque [N m] pushed on the base, `[N, 6]`, each held over an interval.
    pub push: Table,
    /// Features, `[N + 1, n]`.
    pub x: Table,
    /// True fluid wrench on the base, base frame, `[N + 1, 6]`, as MuJoCo's passive forces hold it: where the added mass is in
    /// the inertia, without what is in proportion to the acceleration.
    pub wrench: Table,
    /// The buoyancy part of `wrench`, `[N + 1, 6]`.
    pub hydrostatic: Table,
    /// The water's generalised force as a data set of the same water has it, `[N + 1, nv]`, where it was recorded.
    pub generalised: Option<Table>,
    /// The water's whole generalised force in each physics step of an interval, added mass included, `[N, steps * nv]`, where
    /// it was recorded.
    pub step_force: Option<Table>,
}

impl Rollout {
    /// Keeps the first `samples` samples, two at least.
    pub fn truncate(&mut self, samples: usize) {
        let samples = samples.max(2);
        self.time.truncate(samples);
        let steps = self.step_force.as_mut();
        for table in [&mut self.ctrl, &mut self.push].into_iter().chain(steps) {
            table.truncate(samples - 1);
        }
        for table in [
            &mut self.qpos,
            &mut self.qvel,
            &mut self.x,
            &mut self.wrench,
            &mut self.hydrostatic,
        ]
        .into_iter()
        .chain(self.generalised.as_mut())
        {
            table.truncate(samples);
        }
    }
}
