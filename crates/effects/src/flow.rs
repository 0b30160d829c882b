//! The motion of a body through the water as the laws see it: bounded, and over dual numbers.

use hydro_frames::STANDARD_GRAVITY;
use nalgebra::Vector3;

use super::{
    law::{Scalar, constant, cross, sum},
    motion::Motion,
};

/// Greatest speed [m/s] and rate [rad/s] that a law is asked about: far beyond any vehicle, and small
/// enough that no product overflows.
const FASTEST: f64 = 1e4;
/// Greatest length [m] and acceleration [m/s^2].
const LARGEST: f64 = 1e4;
/// Greatest density [kg/m^3] and volume [m^3].
const DENSEST: f64 = 1e5;
/// Gravity below this [m/s^2] is none.
const WEIGHTLESS: f64 = 1e-6;

/// Velocities may carry derivatives; everything else is a number.
#[derive(Debug)]
pub(super) struct Flow<D> {
    /// Velocity of the body's origin relative to the water, body frame [m/s].
    pub(super) linear: [D; 3],
    /// Angular velocity, body frame [rad/s].
    pub(super) angular: [D; 3],
    /// The rest, bounded.
    motion: Motion,
}

fn within(values: [f64; 3], bound: f64) -> [f64; 3] {
    values.map(|value| value.clamp(-bound, bound))
}

impl<D: Scalar> Flow<D> {
    pub(super) fn of(motion: &Motion) -> Self {
        let motion = Motion {
            linear: within(motion.linear, FASTEST),
            angular: within(motion.angular, FASTEST),
            gravity: within(motion.gravity, LARGEST),
            centre: within(motion.centre, LARGEST),
            middle: within(motion.middle, LARGEST),
            water_acceleration: within(motion.water_acceleration, LARGEST),
            extent: motion.extent.map(|extent| extent.clamp(0.0, LARGEST)),
            density: motion.density.clamp(0.0, DENSEST),
            volume: motion.volume.clamp(0.0, DENSEST),
            ..motion.clone()
        };
        Self {
            linear: constant(motion.linear),
            angular: constant(motion.angular),
            motion,
        }
    }

    /// Simulation time [s].
    pub(super) fn time(&self) -> f64 {
        self.motion.time
    }

    /// Density of the water [kg/m^3].
    pub(super) fn density(&self) -> f64 {
        self.motion.density
    }

    /// Displaced volume [m^3].
    pub(super) fn volume(&self) -> f64 {
        self.motion.volume
    }

    /// Extents along the body's axes [m].
    pub(super) fn extent(&self) -> [f64; 3] {
        self.motion.extent
    }

    /// Centre of mass, body frame [m].
    pub(super) fn centre(&self) -> [f64; 3] {
        self.motion.centre
    }

    /// Middle of the body, body frame [m].
    pub(super) fn middle(&self) -> [f64; 3] {
        self.motion.middle
    }

    /// Depth of the origin [m].
    pub(super) fn depth(&self) -> Option<f64> {
        self.motion.depth
    }

    /// Distance [m] of the nearest wall and its normal in the world.
    pub(super) fn wall(&self) -> Option<(f64, [f64; 3])> {
        self.motion.wall
    }

    /// A world vector in the body's frame.
    pub(super) fn in_body(&self, in_world: [f64; 3]) -> [f64; 3] {
        self.motion
            .world_from_base
            .inverse_transform_vector(&Vector3::from(in_world))
            .into()
    }

    /// Acceleration of the water, body frame [m/s^2].
    pub(super) fn water_acceleration(&self) -> [f64; 3] {
        self.in_body(self.motion.water_acceleration)
    }

    /// Gravity, body frame [m/s^2].
    pub(super) fn gravity(&self) -> [f64; 3] {
        self.in_body(self.motion.gravity)
    }

    /// The upward unit vector in the body's frame, and the magnitude of gravity [m/s^2]. A scene without
    /// gravity is one in which weight and buoyancy were left out because they cancel: up is then the
    /// world's z, and gravity the standard one.
    pub(super) fn up(&self) -> ([f64; 3], f64) {
        let gravity = Vector3::from(self.motion.gravity);
        let magnitude = gravity.norm();
        if magnitude < WEIGHTLESS {
            (self.in_body([0.0, 0.0, 1.0]), STANDARD_GRAVITY)
        } else {
            (self.in_body((-gravity / magnitude).into()), magnitude)
        }
    }

    /// Velocity of the middle relative to the water, body frame [m/s].
    pub(super) fn linear_at_middle(&self) -> [D; 3] {
        sum(
            self.linear,
            cross(self.angular, constant(self.motion.middle)),
        )
    }
}
