//! Bodies, motions and a model for the tests.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use crate::{
    Motion, Target, TargetKind, Targets,
    card::{ActuatorScale, BodyScale, JointScale, SensorScale},
};

/// A body at rest in still water, its frame level and at its middle.
pub(crate) fn still() -> Motion {
    Motion {
        time: 0.0,
        position: [0.0; 3],
        world_from_base: UnitQuaternion::identity(),
        linear: [0.0; 3],
        angular: [0.0; 3],
        water_velocity: [0.0; 3],
        water_acceleration: [0.0; 3],
        gravity: [0.0, 0.0, -9.81],
        density: 1000.0,
        centre: [0.0; 3],
        middle: [0.0; 3],
        extent: [0.5, 0.3, 0.2],
        volume: 0.0125,
        upthrust: [0.0, 0.0, 9.81, 0.0, 0.0, 0.0],
        depth: None,
        wall: None,
        commands: Vec::new(),
    }
}

/// Sizes of the same body.
pub(crate) fn body_scale(motion: &Motion) -> BodyScale {
    let mass = motion.density * motion.volume;
    let [x, y, z] = motion.extent;
    BodyScale {
        mass,
        inertia: [
            mass * (y * y + z * z) / 20.0,
            mass * (x * x + z * z) / 20.0,
            mass * (x * x + y * y) / 20.0,
        ],
        extent: motion.extent,
        volume: motion.volume,
        hull_volume: motion.volume,
        buoyancy_left_out: 0.0,
        density: motion.density,
        gravity: 9.81,
        speed: 0.5,
        rate: 1.0,
    }
}

/// A vector with components up to a size.
pub(crate) fn vector(size: f64) -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-size..size)
}

/// A body of any attitude, velocity and place of its middle, below a surface and beside a wall.
pub(crate) fn any_motion() -> impl Strategy<Value = Motion> {
    let around = (0.01..1.0, vector(1.0), 0.05..2.0, vector(2.0));
    let moving = (vector(1.5), vector(3.0), vector(3.0), vector(1.0));
    let shape = (vector(0.2), vector(0.2), prop::array::uniform3(0.05..1.0));
    (around, moving, shape).prop_map(|(around, moving, shape)| {
        let (depth, normal, distance, water_acceleration) = around;
        let (linear, angular, rotation, water_velocity) = moving;
        let (centre, middle, extent) = shape;
        let normal = Vector3::from(normal)
            .try_normalize(1e-6)
            .unwrap_or_else(Vector3::x);
        Motion {
            time: 3.0,
            world_from_base: UnitQuaternion::from_scaled_axis(Vector3::from(rotation)),
            linear,
            angular,
            water_velocity,
            water_acceleration,
            centre,
            middle,
            extent,
            volume: 0.5 * extent.into_iter().product::<f64>(),
            depth: Some(depth),
            wall: Some((distance, normal.into())),
            ..still()
        }
    })
}

/// A model with one target of each kind.
#[derive(Debug)]
pub(crate) struct Model;

impl Targets for Model {
    fn find(&self, kind: TargetKind, name: &str) -> Option<Target> {
        (self.names(kind)[0] == name).then(|| target(kind))
    }

    fn names(&self, kind: TargetKind) -> Vec<String> {
        let name = match kind {
            TargetKind::Body => "hull",
            TargetKind::Joint => "knee",
            TargetKind::Actuator => "thruster_1",
            TargetKind::Sensor => "imu_gyro",
        };
        vec![name.to_owned()]
    }
}

/// A target of a kind.
pub(crate) fn target(kind: TargetKind) -> Target {
    match kind {
        TargetKind::Body => Target::Body(body_scale(&still())),
        TargetKind::Joint => Target::Joint(JointScale {
            inertia: 0.1,
            armature: 0.0,
            damping: 0.0,
            torque: 2.0,
            speed: 1.0,
            travel: 0.5,
            middle: 0.0,
            slides: false,
            driven: true,
        }),
        TargetKind::Actuator => Target::Actuator(ActuatorScale {
            command: 10.0,
            inflow: 0.5,
            step: 0.002,
            thrusts: true,
        }),
        TargetKind::Sensor => Target::Sensor(SensorScale {
            dimension: 3,
            noise: 0.01,
            signal: 0.5,
            unit: "rad/s",
            period: 0.02,
            attitude: false,
        }),
    }
}
