//! The simulator that a closed loop drives.

use hydro_frames::Wrench;

/// A simulated robot with a floating base, driven by controls, pushes and a base wrench.
pub trait Simulator {
    /// Length of a step [s].
    fn timestep(&self) -> f64;
    /// Starts anew at time zero from a state; whatever the model remembers is forgotten.
    fn restart(&mut self, qpos: &[f64], qvel: &[f64]);
    /// Controls held until they are set again.
    fn set_control(&mut self, control: &[f64]);
    /// World force [N] and torque [N m] on the base body, held until set again.
    fn set_push(&mut self, push: &[f64]);
    /// Wrench on the base beyond the model's own, held until set again.
    fn set_base_wrench(&mut self, wrench: Wrench);
    /// Force on the first degrees of freedom beyond the model's own, as MuJoCo has it (the base's: force in the world, torque
    /// in the base), held until set again.
    fn set_generalised_force(&mut self, force: &[f64]);
    /// One step.
    fn step(&mut self);
    /// Positions; the floating base's position and quaternion `w x y z` come first.
    fn qpos(&self) -> &[f64];
    /// Velocities; the floating base's come first: linear in the world, angular in the base frame.
    fn qvel(&self) -> &[f64];
    /// True where the simulation has blown up since the last restart, whatever its state says now.
    fn diverged(&self) -> bool;
    /// The wrench that the model's own water put on the base in the last step, base frame.
    fn water_wrench(&self) -> Wrench;
}
