//! The time and the state at which a wrench is asked for.

/// A time and the state of the model then.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// Simulation time [s].
    pub time: f64,
    /// Step of the simulation [s].
    pub timestep: f64,
    /// True under MuJoCo's Runge-Kutta integrator, which evaluates forces inside a step.
    pub runge_kutta: bool,
    /// Positions [nq].
    pub qpos: &'a [f64],
    /// Velocities [nv].
    pub qvel: &'a [f64],
    /// Velocity of the water at the base beside attribute `current`, world [m/s].
    pub water: [f64; 3],
}

impl Moment<'_> {
    pub(super) fn is_finite(&self) -> bool {
        finite(self.qpos) && finite(self.qvel)
    }
}

/// True where every number is finite.
pub(super) fn finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| number.is_finite())
}
