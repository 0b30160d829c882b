//! Motion of a body and its surroundings at one instant: all that an effect on a body may depend on.

use nalgebra::{UnitQuaternion, Vector3};

/// Motion of a body's frame, its sizes and its surroundings.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// Simulation time [s].
    pub time: f64,
    /// Origin of the body's frame in the world [m].
    pub position: [f64; 3],
    /// Attitude.
    pub world_from_base: UnitQuaternion<f64>,
    /// Velocity of the origin relative to the water, in the body's frame [m/s].
    pub linear: [f64; 3],
    /// Angular velocity, in the body's frame [rad/s].
    pub angular: [f64; 3],
    /// Acceleration of the water at the origin, in the world [m/s^2]: the sum of [`crate::WaterPart::acceleration`] over
    /// Velocity of the water at the origin, in the world [m/s].
    pub water_velocity: [f64; 3],
    /// the effects on the water. Zero in still or steadily flowing water.
    pub water_acceleration: [f64; 3],
    /// Gravity in the world [m/s^2].
    pub gravity: [f64; 3],
    /// Density of the water [kg/m^3].
    pub density: f64,
    /// Centre of mass of the body (of its whole tree, where it is the root), in its frame [m].
    pub centre: [f64; 3],
    /// Middle of the box that [`Motion::extent`] measures, in the body's frame [m]: forces of the water act there. A link
    /// whose frame stands in its joint is dragged at its middle.
    pub middle: [f64; 3],
    /// Extents along the body's axes [m].
    pub extent: [f64; 3],
    /// Displaced volume [m^3].
    pub volume: f64,
    /// Pressure of the water on the hull, per density of the water and per volume of the hull: force [m/s^2] and torque
    /// [m^2/s^2] about the body's origin, in its frame. Of a hull at rest under water: -gravity, at its centre. Zero above
    /// the surface.
    pub upthrust: [f64; 6],
    /// Depth of the origin below the surface [m]; `None` where the surface is far.
    pub depth: Option<f64>,
    /// Distance [m] of the origin to the nearest wall and its unit normal in the world, towards the body.
    pub wall: Option<(f64, [f64; 3])>,
    /// Commands of the actuators of [`crate::Effect::commands`], in that order.
    pub commands: Vec<f64>,
}

impl Motion {
    /// Froude-Krylov force: the pressure that accelerates the water, rho V a_w at the middle, as force [N] and torque [N m]
    /// about the origin, in the body's frame. Together with the added mass it is Morison's inertia force. The caller that
    /// sums the effects applies it once to each wet body.
    ///
    /// J. N. Newman, Marine Hydrodynamics, MIT Press 1977, section 6.21; J. R. Morison et al., Petroleum
    /// Transactions AIME 189, 1950.
    pub fn froude_krylov(&self) -> [f64; 6] {
        let acceleration = self
            .world_from_base
            .inverse_transform_vector(&Vector3::from(self.water_acceleration));
        let force = acceleration * (self.density * self.volume);
        let torque = Vector3::from(self.middle).cross(&force);
        [force.x, force.y, force.z, torque.x, torque.y, torque.z]
    }
}
