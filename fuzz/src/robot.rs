//! The model that effects, patches and trials belong to: a hull with a fin on a hinge and a mast on a slide.

use hydro_effects::{
    Medium, Motion, Target, TargetKind, Targets,
    card::{ActuatorScale, BodyScale, JointScale, SensorScale},
};
use hydro_gap::{
    plant::{
        Inertial, Nuisance, NuisanceClass, PlantActuator, PlantBody, PlantDescription, PlantJoint,
        Quantity,
    },
    trial::{SensorQuantity, SensorSignature, Signature},
};

pub(super) const BODIES: [&str; 2] = ["hull", "fin"];
pub(super) const JOINTS: [&str; 2] = ["hinge", "mast"];
pub(super) const ACTUATOR: &str = "servo";
pub(super) const SENSOR: &str = "gyro";
/// Step [s].
pub(super) const TIMESTEP: f64 = 0.002;

/// The parts of the model by name.
#[derive(Debug)]
pub(super) struct Robot;

impl Targets for Robot {
    fn find(&self, kind: TargetKind, name: &str) -> Option<Target> {
        let known = self.names(kind).iter().any(|known| known == name);
        known.then(|| target(kind, name))
    }

    fn names(&self, kind: TargetKind) -> Vec<String> {
        let names: &[&str] = match kind {
            TargetKind::Body => &BODIES,
            TargetKind::Joint => &JOINTS,
            TargetKind::Actuator => &[ACTUATOR],
            TargetKind::Sensor => &[SENSOR],
        };
        names.iter().map(|name| (*name).to_owned()).collect()
    }
}

/// Sizes of a part.
pub(super) fn target(kind: TargetKind, name: &str) -> Target {
    match kind {
        TargetKind::Body => Target::Body(body()),
        TargetKind::Joint => Target::Joint(joint(name == JOINTS[1])),
        TargetKind::Actuator => Target::Actuator(ActuatorScale {
            command: 10.0,
            inflow: 0.5,
            step: TIMESTEP,
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

fn body() -> BodyScale {
    BodyScale {
        mass: 12.5,
        inertia: [0.2, 0.4, 0.4],
        extent: [0.5, 0.3, 0.2],
        volume: 0.0125,
        hull_volume: 0.0125,
        buoyancy_left_out: 0.0,
        density: 1000.0,
        gravity: 9.81,
        speed: 0.5,
        rate: 1.0,
    }
}

fn joint(slides: bool) -> JointScale {
    JointScale {
        inertia: 0.1,
        armature: 0.0,
        damping: 0.0,
        torque: 2.0,
        speed: 1.0,
        travel: 0.5,
        middle: 0.0,
        slides,
        driven: !slides,
    }
}

/// A body at rest, and one that tumbles through moving water beside a wall.
pub(super) fn motions() -> [Motion; 2] {
    let still = Motion {
        gravity: [0.0, 0.0, -9.81],
        density: 1000.0,
        extent: [0.5, 0.3, 0.2],
        volume: 0.0125,
        upthrust: [0.0, 0.0, 9.81, 0.0, 0.0, 0.0],
        ..Motion::default()
    };
    let tumbling = Motion {
        time: 3.0,
        linear: [1.5, -0.7, 0.3],
        angular: [2.0, -3.0, 1.0],
        water_velocity: [0.3, 0.1, -0.2],
        water_acceleration: [0.5, -0.5, 1.0],
        centre: [0.02, 0.0, -0.01],
        middle: [0.1, -0.1, 0.05],
        depth: Some(0.2),
        wall: Some((0.3, [0.0, 1.0, 0.0])),
        ..still.clone()
    };
    [still, tumbling]
}

/// The columns of a trial.
pub(super) fn signature() -> Signature {
    let sensor = |name: &str, dim, kind| SensorSignature {
        name: name.to_owned(),
        dim,
        kind,
    };
    Signature {
        actuators: vec![ACTUATOR.to_owned()],
        sensors: vec![
            sensor(SENSOR, 3, SensorQuantity::Other),
            sensor("attitude", 4, SensorQuantity::Quaternion),
            sensor("angle", 1, SensorQuantity::Angle),
        ],
        joints: JOINTS.map(str::to_owned).to_vec(),
        state_len: 18,
        timestep: TIMESTEP,
    }
}

/// Uncertain numbers of the model.
pub(super) fn nuisances() -> Vec<Nuisance> {
    let nuisance = |name: &str, element: &str, class, quantity| Nuisance {
        name: name.to_owned(),
        element: element.to_owned(),
        class,
        quantity,
    };
    vec![
        nuisance("hull.mass", "hull", NuisanceClass::Mass, Quantity::Mass),
        nuisance("servo.gain", "servo", NuisanceClass::Gain, Quantity::Gain),
        nuisance(
            "hinge.damping",
            "hinge",
            NuisanceClass::Damping,
            Quantity::Damping,
        ),
        nuisance(
            "fin.com.x",
            "fin",
            NuisanceClass::CentreOfMass,
            Quantity::CentreOfMass(0),
        ),
    ]
}

/// The model as compiled.
pub(super) fn description() -> PlantDescription {
    PlantDescription {
        timestep: TIMESTEP,
        nq: 9,
        nv: 8,
        state_len: 18,
        bodies: BODIES.map(plant_body).to_vec(),
        base: None,
        joints: [plant_joint(0), plant_joint(1)].to_vec(),
        actuators: vec![PlantActuator {
            name: ACTUATOR.to_owned(),
            range: None,
            thrusts: false,
            speed_bias: 0.0,
        }],
        sensors: Vec::new(),
        nuisances: nuisances(),
        wrench_bodies: Vec::new(),
        waterline: 0.0,
        has_surface: false,
        walls: Vec::new(),
        medium: Medium::Water,
        has_fluid: true,
    }
}

fn plant_body(name: &str) -> PlantBody {
    let root = name == BODIES[0];
    let scale = body();
    PlantBody {
        name: name.to_owned(),
        root,
        moves: true,
        only_dof: None,
        end: !root,
        wet: true,
        floats: false,
        bulk: 0.01,
        inertial: Inertial {
            mass: scale.mass,
            attitude: [1.0, 0.0, 0.0, 0.0],
            moments: scale.inertia,
            ..Inertial::default()
        },
        scale,
    }
}

fn plant_joint(at: usize) -> PlantJoint {
    PlantJoint {
        name: JOINTS[at].to_owned(),
        qpos: 7 + at,
        dof: 6 + at,
        start: 0.0,
        scale: joint(at == 1),
        pushes: Vec::new(),
        stiffness: 3.0,
        damping: 0.1,
        is_coordinate: false,
        is_level: false,
    }
}
