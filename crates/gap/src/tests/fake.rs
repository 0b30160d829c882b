//! A rigid body in water without MuJoCo: what the workflow is tested on where nothing else is at hand.

use std::sync::Arc;

use hydro_effects as effects;
use hydro_effects::{Entry, Motion, Part, card::BodyScale};
use hydro_frames::Wrench;
use nalgebra::{DMatrix, Matrix6, Quaternion, UnitQuaternion, Vector3, Vector6};

use crate::problem::channels::rotation_between;

use crate::plant::{
    FreeBase, Inertial, Nuisance, NuisanceClass, Plant, PlantActuator, PlantBody, PlantDescription,
    PlantError, PlantSensor, Quantity, SensorKind, Simulation, factor,
    prescribed::PrescribedMotion,
};

/// Step [s].
const STEP: f64 = 0.005;
/// Force of a full command [N], torque [N m].
const GAIN: [f64; 4] = [20.0, 20.0, 20.0, 4.0];
const MASS: f64 = 20.0;
const INERTIA: [f64; 3] = [0.5, 0.8, 0.9];
/// Linear drag of the nominal [N s/m, N m s/rad].
const DRAG: [f64; 6] = [12.0, 18.0, 20.0, 2.0, 2.0, 2.0];

/// The system.
pub(crate) struct RigidBody {
    description: PlantDescription,
    drag: [f64; 6],
}

impl RigidBody {
    pub(crate) fn new() -> Self {
        let scale = BodyScale {
            mass: MASS,
            inertia: INERTIA,
            extent: [0.6, 0.4, 0.3],
            volume: 0.02,
            hull_volume: 0.02,
            buoyancy_left_out: 0.0,
            density: 1000.0,
            gravity: 9.81,
            speed: 0.0,
            rate: 0.0,
        };
        let sensor = |name: &str, kind, start, len, noise, unit| PlantSensor {
            name: name.to_owned(),
            kind,
            start,
            len,
            noise,
            unit,
            frame_of: Some("hull".to_owned()),
            joint: None,
        };
        let nuisance = |name: &str, class, quantity| Nuisance {
            name: format!("hull.{name}"),
            element: "hull".to_owned(),
            class,
            quantity,
        };
        Self {
            description: PlantDescription {
                timestep: STEP,
                nq: 7,
                nv: 6,
                state_len: 14,
                bodies: vec![PlantBody {
                    name: "hull".to_owned(),
                    root: true,
                    moves: true,
                    only_dof: None,
                    end: true,
                    wet: true,
                    floats: false,
                    bulk: 0.01,
                    scale,
                    inertial: Inertial::default(),
                }],
                base: Some(FreeBase {
                    body: "hull".to_owned(),
                    qpos: 0,
                    dof: 0,
                    joints: Vec::new(),
                    density: 1000.0,
                    water: [0.0; 3],
                    water_moves: false,
                    learned: false,
                }),
                joints: Vec::new(),
                actuators: ["ahead", "aside", "up", "turn"]
                    .map(|name| PlantActuator {
                        name: name.to_owned(),
                        range: Some([-1.0, 1.0]),
                        thrusts: false,
                        speed_bias: 0.0,
                    })
                    .to_vec(),
                sensors: vec![
                    sensor("position", SensorKind::Position, 0, 3, 0.01, "m"),
                    sensor("attitude", SensorKind::Quaternion, 3, 4, 0.005, "rad"),
                    sensor("dvl", SensorKind::LinearVelocity, 7, 3, 0.01, "m/s"),
                    sensor("gyro", SensorKind::AngularVelocity, 10, 3, 0.01, "rad/s"),
                ],
                nuisances: vec![
                    nuisance("mass", NuisanceClass::Mass, Quantity::Mass),
                    nuisance("drag", NuisanceClass::Fluid, Quantity::FluidCoefficient(0)),
                ],
                wrench_bodies: Vec::new(),
                waterline: 0.0,
                has_surface: false,
                walls: Vec::new(),
                medium: hydro_effects::Medium::Water,
                has_fluid: true,
            },
            drag: DRAG,
        }
    }

    /// One whose nominal does not know the gains of its actuators exactly.
    pub(crate) fn with_gains() -> Self {
        let mut body = Self::new();
        let actuators = body.description.actuators.iter();
        let gains: Vec<Nuisance> = actuators
            .map(|of| Nuisance {
                name: format!("{}.gain", of.name),
                element: of.name.clone(),
                class: NuisanceClass::Gain,
                quantity: Quantity::Gain,
            })
            .collect();
        body.description.nuisances.extend(gains);
        body
    }

    /// One whose actuators did what no log tells before it began.
    pub(crate) fn with_a_start() -> Self {
        let mut body = Self::with_gains();
        body.description.nuisances.push(Nuisance {
            name: "commands.before".to_owned(),
            element: "commands.before".to_owned(),
            class: NuisanceClass::Start,
            quantity: Quantity::CommandsBefore,
        });
        body
    }

    /// One in no fluid that its nominal knows of.
    pub(crate) fn without_fluid() -> Self {
        let mut body = Self::new();
        body.description.has_fluid = false;
        body
    }

    /// One whose nominal tells of a medium.
    pub(crate) fn within(medium: hydro_effects::Medium) -> Self {
        let mut body = Self::new();
        body.description.medium = medium;
        body
    }

    /// One whose drag pushes.
    pub(crate) fn unstable() -> Self {
        Self {
            drag: DRAG.map(|drag| -3000.0 * drag),
            ..Self::new()
        }
    }

    /// One that does not say how noisy a sensor is.
    pub(crate) fn without_noise(sensor: &str) -> Self {
        let mut body = Self::new();
        let mut sensors = body.description.sensors.iter_mut();
        if let Some(of) = sensors.find(|of| of.name == sensor) {
            of.noise = 0.0;
        }
        body
    }
}

impl Plant for RigidBody {
    fn description(&self) -> &PlantDescription {
        &self.description
    }

    fn simulation(
        &self,
        nuisances: &[f64],
        effects: &[Entry],
    ) -> Result<Box<dyn Simulation>, PlantError> {
        let memory = effects
            .iter()
            .map(|entry| match effects::effect(entry.effect).part() {
                Part::Body(part) => vec![0.0; part.memory_len()],
                Part::Actuator(part) => vec![0.0; part.memory_len(&entry.parameters, STEP)],
                _ => Vec::new(),
            })
            .collect();
        Ok(Box::new(Swim {
            mass: MASS * factor(nuisances[0]),
            drag: self.drag.map(|d| d * factor(nuisances[1])),
            gain: std::array::from_fn(|at| {
                GAIN[at] * factor(nuisances.get(2 + at).copied().unwrap_or(0.0))
            }),
            effects: effects.to_vec(),
            memory,
            time: 0.0,
            qpos: vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            qvel: vec![0.0; 6],
            control: vec![0.0; 4],
            before: 1.0 + (self.description.commands_before()).map_or(0.0, |at| nuisances[at]),
            wrench: Wrench::default(),
            force: vec![0.0; 6],
            sensors: vec![0.0; 13],
        }))
    }
}

struct Swim {
    mass: f64,
    drag: [f64; 6],
    gain: [f64; 4],
    effects: Vec<Entry>,
    memory: Vec<Vec<f64>>,
    time: f64,
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    control: Vec<f64>,
    before: f64,
    wrench: Wrench,
    /// World force, torque in the base frame.
    force: Vec<f64>,
    sensors: Vec<f64>,
}

impl Swim {
    fn attitude(&self) -> UnitQuaternion<f64> {
        let q = &self.qpos[3..7];
        UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]))
    }
}

impl Simulation for Swim {
    fn reset(&mut self) {
        self.time = 0.0;
        self.qpos = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        self.qvel.fill(0.0);
        self.memory.iter_mut().for_each(|memory| memory.fill(0.0));
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn restart(&mut self, state: &[f64]) {
        self.reset();
        self.set_motion(state[0], &state[1..8], &state[8..14]);
    }

    fn rejoin(&mut self, state: &[f64]) {
        self.set_motion(state[0], &state[1..8], &state[8..14]);
    }

    fn set_motion(&mut self, time: f64, qpos: &[f64], qvel: &[f64]) {
        self.time = time;
        self.qpos.copy_from_slice(qpos);
        self.qvel.copy_from_slice(qvel);
    }

    fn qpos(&self) -> &[f64] {
        &self.qpos
    }

    fn qvel(&self) -> &[f64] {
        &self.qvel
    }

    fn retract(&mut self, tangent: &[f64]) {
        for (value, change) in self.qpos.iter_mut().zip(&tangent[..3]) {
            *value += change;
        }
        let turned = self.attitude()
            * UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(&tangent[3..6]));
        self.qpos[3..7].copy_from_slice(&[turned.w, turned.i, turned.j, turned.k]);
        for (value, change) in self.qvel.iter_mut().zip(&tangent[6..12]) {
            *value += change;
        }
    }

    fn differentiate(&self, from: &[f64], to: &[f64], tangent: &mut [f64]) {
        for axis in 0..3 {
            tangent[axis] = to[axis] - from[axis];
        }
        tangent[3..6].copy_from_slice(&rotation_between(&from[3..7], &to[3..7]));
    }

    fn full_state(&self) -> Vec<f64> {
        let mut state = vec![self.time];
        state.extend(self.qpos.iter().chain(&self.qvel));
        state
    }

    fn commands_before(&self) -> f64 {
        self.before
    }

    fn memory(&self) -> Vec<f64> {
        self.memory.concat()
    }

    fn set_memory(&mut self, memory: &[f64]) {
        for (value, set) in self.memory.iter_mut().flatten().zip(memory) {
            *value = *set;
        }
    }

    fn save(&self) -> Vec<f64> {
        let mut saved = vec![self.time];
        saved.extend(self.qpos.iter().chain(&self.qvel));
        saved.extend(self.memory.iter().flatten());
        saved
    }

    fn load(&mut self, saved: &[f64]) {
        self.set_motion(saved[0], &saved[1..8], &saved[8..14]);
        let mut rest = saved[14..].iter();
        for (value, saved) in self.memory.iter_mut().flatten().zip(&mut rest) {
            *value = *saved;
        }
    }

    fn body_jacobian(&mut self, _body: &str) -> DMatrix<f64> {
        let mut jacobian = DMatrix::identity(6, 6);
        let inverse = self.attitude().inverse().to_rotation_matrix();
        jacobian
            .view_mut((0, 0), (3, 3))
            .copy_from(inverse.matrix());
        jacobian
    }

    fn set_control(&mut self, control: &[f64]) {
        self.control.copy_from_slice(control);
    }

    fn set_base_wrench(&mut self, wrench: Wrench) {
        self.wrench = wrench;
    }

    fn set_earlier_control(&mut self, _control: &[f64]) {}

    /// Its free joint is never prescribed.
    fn prescribe(&mut self, _: Option<Arc<PrescribedMotion>>) {}

    fn set_force(&mut self, force: &[f64]) {
        self.force.copy_from_slice(force);
    }

    fn step(&mut self) {
        let attitude = self.attitude();
        let linear = attitude.inverse() * Vector3::from_column_slice(&self.qvel[..3]);
        let angular = Vector3::from_column_slice(&self.qvel[3..6]);
        self.look();
        let mut motion = Motion {
            time: self.time,
            position: [self.qpos[0], self.qpos[1], self.qpos[2]],
            world_from_base: attitude,
            linear: linear.into(),
            angular: angular.into(),
            gravity: [0.0, 0.0, -9.81],
            density: 1000.0,
            extent: [0.6, 0.4, 0.3],
            volume: 0.02,
            ..Motion::default()
        };
        let mut water = Vector3::zeros();
        for entry in &self.effects {
            if let Part::Water(part) = effects::effect(entry.effect).part() {
                water +=
                    Vector3::from(part.velocity(&entry.parameters, motion.position, self.time));
            }
        }
        motion.linear = (linear - attitude.inverse() * water).into();
        let mut command: Vec<f64> = self.control.clone();
        let mut force = Vector6::from(self.wrench.to_array());
        let pushed = attitude.inverse() * Vector3::from_column_slice(&self.force[..3]);
        for axis in 0..3 {
            force[axis] += pushed[axis];
            force[axis + 3] += self.force[axis + 3];
        }
        let mut inertia = Matrix6::zeros();
        for axis in 0..3 {
            inertia[(axis, axis)] = self.mass;
            inertia[(axis + 3, axis + 3)] = INERTIA[axis];
            force[axis] -= self.drag[axis] * motion.linear[axis];
            force[axis + 3] -= self.drag[axis + 3] * angular[axis];
        }
        // Roll and pitch come back upright.
        let up = attitude.inverse() * Vector3::z();
        force[3] -= 4.0 * up.y.atan2(up.z);
        force[4] += 4.0 * up.x.atan2(up.z);
        for (entry, memory) in self.effects.iter().zip(&mut self.memory) {
            let p = &entry.parameters;
            match effects::effect(entry.effect).part() {
                Part::Body(part) => {
                    force += Vector6::from(part.wrench(p, &motion, memory));
                    inertia += part.inertia(p, &motion).unwrap_or_default();
                    part.advance(p, &motion, STEP, memory);
                }
                Part::Actuator(part) => {
                    let names = ["ahead", "aside", "up", "turn"];
                    let at = names.iter().position(|name| *name == entry.target);
                    if let Some(at) = at {
                        command[at] = part.command(p, command[at], STEP, memory);
                        command[at] *= part.force_factor(p, 0.0);
                    }
                }
                _ => {}
            }
        }
        for (axis, (gain, command)) in self.gain.iter().zip(&command).enumerate() {
            force[if axis == 3 { 5 } else { axis }] += gain * command;
        }
        let Some(inverse) = inertia.try_inverse() else {
            return;
        };
        // The acceleration of the origin as seen from the world, in base-frame directions.
        let acceleration = inverse * force;
        let world = attitude * Vector3::new(acceleration[0], acceleration[1], acceleration[2]);
        for axis in 0..3 {
            self.qvel[axis] += STEP * world[axis];
            self.qvel[axis + 3] += STEP * acceleration[axis + 3];
        }
        let velocity = self.qvel.clone();
        let mut tangent = vec![0.0; 12];
        for axis in 0..6 {
            tangent[axis] = STEP * velocity[axis];
        }
        self.retract(&tangent);
        self.time += STEP;
    }

    fn look(&mut self) {
        let linear = self.attitude().inverse() * Vector3::from_column_slice(&self.qvel[..3]);
        self.sensors[..7].copy_from_slice(&self.qpos);
        self.sensors[7..10].copy_from_slice(linear.as_slice());
        self.sensors[10..13].copy_from_slice(&self.qvel[3..6]);
    }

    fn reading_lead(&self) -> f64 {
        0.0
    }

    fn sensors(&self) -> &[f64] {
        &self.sensors
    }

    fn diverged(&self) -> bool {
        !self
            .qvel
            .iter()
            .all(|value| value.is_finite() && value.abs() < 1e6)
    }
}
