//! What an effect on a body may look at, at one instant.

use nalgebra::UnitQuaternion;

/// Motion of a body's frame, and what is around it.
#[derive(Clone, Debug)]
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
    /// Gravity in the world [m/s^2].
    pub gravity: [f64; 3],
    /// Density of the water [kg/m^3].
    pub density: f64,
    /// Centre of mass of the body (of its whole tree, where it is the root), in its frame [m].
    pub centre: [f64; 3],
    /// Extents along the body's axes [m].
    pub extent: [f64; 3],
    /// Displaced volume [m^3].
    pub volume: f64,
    /// Depth of the origin below the surface [m]; none where the surface is far.
    pub depth: Option<f64>,
    /// Distance [m] of the origin to the nearest wall and its unit normal in the world, towards the body.
    pub wall: Option<(f64, [f64; 3])>,
}
