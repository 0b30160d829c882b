//! Motion of a body through the water, bounded and over dual numbers: the argument of every wrench law.

use hydro_frames::STANDARD_GRAVITY;
use nalgebra::Vector3;

use crate::{
    Motion, Physical,
    dual::{Scalar, constant, cross, dot, sum},
};

/// Greatest speed [m/s] and rate [rad/s]: far beyond any vehicle, and small enough that no product overflows.
const FASTEST: f64 = 1e4;
/// Velocities of the water that are not held back [m/s].
pub(crate) const SPEEDS: Physical = Physical::Between(-FASTEST, FASTEST);
/// Greatest length [m] and acceleration [m/s^2].
const LARGEST: f64 = 1e4;
/// Greatest density [kg/m^3] and volume [m^3].
const DENSEST: f64 = 1e5;
/// Gravity below this [m/s^2] counts as zero.
const WEIGHTLESS: f64 = 1e-6;

/// The velocities may carry derivatives; everything else is a plain number.
#[derive(Debug)]
pub(crate) struct Flow<D> {
    /// Velocity of the body's origin relative to the water, body frame [m/s].
    pub(crate) linear: [D; 3],
    /// Angular velocity, body frame [rad/s].
    pub(crate) angular: [D; 3],
    /// The motion that it was made from, bounded.
    motion: Motion,
}

fn within(values: [f64; 3], bound: f64) -> [f64; 3] {
    values.map(|value| value.clamp(-bound, bound))
}

/// A point of the body [m], held within the greatest length.
pub(crate) fn within_reach(point: [f64; 3]) -> [f64; 3] {
    within(point, LARGEST)
}

/// Coordinates of points [m] that are not held back.
pub(crate) const REACH: Physical = Physical::Between(-LARGEST, LARGEST);

impl<D: Scalar> Flow<D> {
    /// The motion, every number clamped.
    pub(crate) fn bounded(motion: &Motion) -> Self {
        let motion = Motion {
            linear: within(motion.linear, FASTEST),
            angular: within(motion.angular, FASTEST),
            gravity: within(motion.gravity, LARGEST),
            centre: within(motion.centre, LARGEST),
            middle: within(motion.middle, LARGEST),
            water_velocity: within(motion.water_velocity, FASTEST),
            water_acceleration: within(motion.water_acceleration, LARGEST),
            extent: motion.extent.map(|extent| extent.clamp(0.0, LARGEST)),
            density: motion.density.clamp(0.0, DENSEST),
            volume: motion.volume.clamp(0.0, DENSEST),
            upthrust: motion
                .upthrust
                .map(|part| part.clamp(-LARGEST * LARGEST, LARGEST * LARGEST)),
            ..motion.clone()
        };
        Self {
            linear: constant(motion.linear),
            angular: constant(motion.angular),
            motion,
        }
    }

    /// Simulation time [s].
    pub(crate) fn time(&self) -> f64 {
        self.motion.time
    }

    /// Density of the water [kg/m^3].
    pub(crate) fn density(&self) -> f64 {
        self.motion.density
    }

    /// Displaced volume [m^3].
    pub(crate) fn volume(&self) -> f64 {
        self.motion.volume
    }

    /// Extents along the body's axes [m].
    pub(crate) fn extent(&self) -> [f64; 3] {
        self.motion.extent
    }

    /// Centre of mass, body frame [m].
    pub(crate) fn centre(&self) -> [f64; 3] {
        self.motion.centre
    }

    /// Middle of the body, body frame [m].
    pub(crate) fn middle(&self) -> [f64; 3] {
        self.motion.middle
    }

    /// Pressure of the water per density and volume of the hull, [`Motion::upthrust`].
    pub(crate) fn upthrust(&self) -> [f64; 6] {
        self.motion.upthrust
    }

    /// Depth of the origin [m].
    pub(crate) fn depth(&self) -> Option<f64> {
        self.motion.depth
    }

    /// Distance [m] of the nearest wall and its normal in the world.
    pub(crate) fn wall(&self) -> Option<(f64, [f64; 3])> {
        self.motion.wall
    }

    /// Velocity of the body's origin over the ground, body frame [m/s].
    pub(crate) fn over_ground(&self) -> [D; 3] {
        sum(
            self.linear,
            constant(self.in_body(self.motion.water_velocity)),
        )
    }

    /// A world vector, which may carry derivatives, in the body's frame.
    pub(crate) fn dual_in_body(&self, in_world: [D; 3]) -> [D; 3] {
        let rotation = self.motion.world_from_base.to_rotation_matrix();
        [0, 1, 2].map(|axis| {
            let column = rotation.matrix().column(axis);
            dot(in_world, constant([column[0], column[1], column[2]]))
        })
    }

    /// A world vector in the body's frame.
    pub(crate) fn in_body(&self, in_world: [f64; 3]) -> [f64; 3] {
        self.motion
            .world_from_base
            .inverse_transform_vector(&Vector3::from(in_world))
            .into()
    }

    /// Acceleration of the water, body frame [m/s^2].
    pub(crate) fn water_acceleration(&self) -> [f64; 3] {
        self.in_body(self.motion.water_acceleration)
    }

    /// Gravity, body frame [m/s^2].
    pub(crate) fn gravity(&self) -> [f64; 3] {
        self.in_body(self.motion.gravity)
    }

    /// The upward unit vector in the body's frame, and the magnitude of gravity [m/s^2]. A scene without gravity leaves
    /// out weight and buoyancy because they cancel: up is then the world's z, and gravity the standard one.
    pub(crate) fn up(&self) -> ([f64; 3], f64) {
        let gravity = Vector3::from(self.motion.gravity);
        let magnitude = gravity.norm();
        if magnitude < WEIGHTLESS {
            (self.in_body([0.0, 0.0, 1.0]), STANDARD_GRAVITY)
        } else {
            (self.in_body((-gravity / magnitude).into()), magnitude)
        }
    }

    /// Velocity of the middle relative to the water, body frame [m/s].
    pub(crate) fn linear_at_middle(&self) -> [D; 3] {
        sum(
            self.linear,
            cross(self.angular, constant(self.motion.middle)),
        )
    }
}
