//! Effects tied to one model: names become numbers, once.

use std::{fmt, ops::Range, sync::Arc};

use hydro_effects::{
    ActuatorPart, BodyPart, Effect, Id, JointPart, Part, WaterPart,
    hydrostatics::{Hull, Panels},
    potential_flow::{PotentialFlow, Stepping},
};

use super::sea::Sea;

/// One effect with its values.
#[derive(Clone, Debug)]
pub struct Acting {
    /// The effect.
    pub effect: &'static dyn Effect,
    /// Values in the order of [`Effect::parameters`], or a whole matrix.
    pub parameters: Vec<f64>,
    /// Range of its memory in that of all.
    pub memory: Range<usize>,
    /// Indices in `ctrl` of the commands that it depends on ([`Effect::commands`]).
    pub commands: Vec<usize>,
}

impl Acting {
    /// The effect as a wrench on a body.
    pub fn body(&self) -> Option<&'static dyn BodyPart> {
        self.effect.body_part(&self.parameters)
    }

    /// The effect as motion of the water.
    pub fn water(&self) -> Option<&'static dyn WaterPart> {
        match self.effect.part() {
            Part::Water(part) => Some(part),
            _ => None,
        }
    }

    /// The effect as a force on a joint.
    pub fn joint(&self) -> Option<&'static dyn JointPart> {
        match self.effect.part() {
            Part::Joint(part) => Some(part),
            _ => None,
        }
    }

    /// The effect as a change of an actuator.
    pub fn actuator(&self) -> Option<&'static dyn ActuatorPart> {
        match self.effect.part() {
            Part::Actuator(part) => Some(part),
            _ => None,
        }
    }
}

/// A body with the effects on it.
#[derive(Clone, Debug)]
pub struct WetBody {
    /// Its number.
    pub body: usize,
    /// True where it is the first of its tree: then its centre is that of the tree.
    pub root: bool,
    /// The degrees of freedom that move it, first to last.
    pub dofs: Vec<usize>,
    /// True where MuJoCo's sparse inertia matrix has room for all products of them.
    pub full_rows: bool,
    /// Extents along the body's axes [m].
    pub extent: [f64; 3],
    /// Middle of the box of these extents, in the body's frame [m].
    pub middle: [f64; 3],
    /// Displaced volume [m^3].
    pub volume: f64,
    /// Its closed shapes, in its frame: under water or above.
    pub hull: Hull,
    /// Its surface in triangles, where waves are too short to be planes over it.
    pub panels: Option<Panels>,
    /// True where it floats in the instance's waves: their pressure acts with that of the still water.
    pub in_waves: bool,
    /// Centre of buoyancy in the body's frame [m], where it is given and not the hull's.
    pub centre_of_buoyancy: Option<[f64; 3]>,
    /// Effects on it.
    pub acting: Vec<Acting>,
    /// Potential flow about it.
    pub potential_flow: Option<Radiating>,
}

/// Potential flow about a body.
#[derive(Clone)]
pub struct Radiating {
    /// The flow.
    pub flow: Arc<PotentialFlow>,
    /// How its memory goes over a step of the model.
    pub stepping: Option<Stepping>,
    /// Range of its memory in that of all.
    pub memory: Range<usize>,
}

impl fmt::Debug for Radiating {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Radiating")
            .field("flow", &self.flow)
            .field("memory", &self.memory)
            .finish_non_exhaustive()
    }
}

impl WetBody {
    /// True where waves push it by the excitation of its potential flow.
    pub fn is_excited(&self) -> bool {
        let radiating = self.potential_flow.as_ref();
        radiating.is_some_and(|radiating| radiating.flow.is_excited())
    }

    /// True where an effect acts on it.
    pub fn has(&self, id: Id) -> bool {
        let mut acting = self.acting.iter();
        acting.any(|acting| acting.effect.card().id == id)
    }

    /// True where hydrostatics acts on it.
    pub fn floats(&self) -> bool {
        self.has(Id::Hydrostatics)
    }

    /// Volume that its hydrostatics counts [m^3].
    pub fn displaced(&self) -> Option<f64> {
        let mut acting = self.acting.iter();
        let hydrostatics = acting.find(|acting| acting.effect.card().id == Id::Hydrostatics)?;
        hydrostatics.parameters.first().copied()
    }

    /// Its longest extent [m].
    pub fn length(&self) -> f64 {
        self.extent.into_iter().fold(0.0, f64::max)
    }
}

/// The hull of a body, in its frame.
#[derive(Clone, Debug)]
pub struct BodyHull {
    /// Its number.
    pub body: usize,
    /// Its closed shapes.
    pub hull: Hull,
}

/// Surface and hulls that fade a checkpoint's wrench.
#[derive(Clone, Debug, Default)]
pub struct Afloat {
    /// Surface and waves.
    pub sea: Sea,
    /// The robot's hulls; none without a surface.
    pub hulls: Vec<BodyHull>,
}

/// A hinge or slide with an effect on it.
#[derive(Clone, Debug)]
pub struct MovedJoint {
    /// Index of its position in `qpos`.
    pub qpos: usize,
    /// Index of its velocity in `qvel`.
    pub dof: usize,
    /// Effects on it.
    pub acting: Acting,
}

/// An actuator with the effects on it.
#[derive(Clone, Debug)]
pub struct ChangedActuator {
    /// Its number.
    pub actuator: usize,
    /// Index of its control in `ctrl`.
    pub control: usize,
    /// Index of its force among the outputs.
    pub output: usize,
    /// The site that it pushes at, and the direction there, where it does.
    pub thrust: Option<(usize, [f64; 3])>,
    /// Effects on it, in the order from command to force.
    pub acting: Vec<Acting>,
}

/// A body that displaces water.
#[derive(Clone, Debug)]
pub struct Displacing {
    /// Its number.
    pub body: usize,
    /// Mass of the water that it alone displaces [kg].
    pub mass: f64,
    /// Middle of its box, in its frame [m].
    pub middle: [f64; 3],
    /// Centre of buoyancy in its frame [m], where it is given and not the hull's.
    pub centre: Option<[f64; 3]>,
    /// Its closed shapes, in its frame.
    pub hull: Hull,
}

/// Shape of a wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WallShape {
    /// A plane with its z axis as the normal.
    Plane,
    /// A box.
    Box,
}

/// A wall that stands still: the number of its geom, and its shape.
pub type Wall = (usize, WallShape);

/// All effects of one instance, or of one simulation.
#[derive(Clone, Debug, Default)]
pub struct Bound {
    /// On bodies.
    pub bodies: Vec<WetBody>,
    /// On the water.
    pub water: Vec<Acting>,
    /// On joints.
    pub joints: Vec<MovedJoint>,
    /// On actuators.
    pub actuators: Vec<ChangedActuator>,
    /// All that displaces water, where [`Bound::water`] moves it.
    pub displacing: Vec<Displacing>,
    /// Bodies of the carrying robot that displace water in the waves of [`Bound::sea`] and do not float by hydrostatics.
    pub in_waves: Vec<Displacing>,
    /// Walls that stand still.
    pub walls: Vec<Wall>,
    /// Density of the water [kg/m^3].
    pub density: f64,
    /// Surface, waves and current.
    pub sea: Sea,
    /// Velocity of the water in the world beside [`Bound::water`] [m/s].
    pub current: [f64; 3],
    /// Notes for the user: a centre outside its hull, two buoyancies, waves beyond the theory.
    pub notes: Vec<String>,
    /// Numbers of memory of all, that of [`Bound::sea`] last.
    pub memory_len: usize,
}

impl Bound {
    /// True where no effect acts.
    pub fn is_empty(&self) -> bool {
        self.bodies.is_empty()
            && self.water.is_empty()
            && self.joints.is_empty()
            && self.actuators.is_empty()
    }
}
