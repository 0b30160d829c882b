//! The parts of a model that a card is tied to: the body that carries the plugin, how it moves, and all joints.

use thiserror::Error;

use hydro_frames as frames;

/// Kind of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Six degrees of freedom.
    Free,
    /// Three rotations.
    Ball,
    /// One translation [m].
    Slide,
    /// One rotation [rad].
    Hinge,
}

/// One joint of the model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Joint {
    /// Its name; empty where the model gives none.
    pub name: String,
    /// Its kind.
    pub kind: JointKind,
    /// Index of its position in `qpos`.
    pub qpos: usize,
    /// Index of its velocity in `qvel`.
    pub dof: usize,
}

/// Connection of the base body to the world.
#[derive(Clone, Debug, PartialEq)]
pub enum Base {
    /// A free joint: position and quaternion at `qpos`, velocities at `dof`.
    Free {
        /// Index in `qpos` of x y z, then w x y z.
        qpos: usize,
        /// Index in `qvel` of the linear velocity (world), then the angular one (base).
        dof: usize,
    },
    /// Slides only between world and base, as under a towing carriage: the attitude never changes.
    Gantry {
        /// The attitude, w x y z.
        world_from_base: [f64; 4],
        /// Index in `qvel` and unit axis in the world of each slide.
        slides: Vec<(usize, [f64; 3])>,
    },
    /// Neither: `reason` says what is there instead.
    Other {
        /// The joint or body between the world and the base.
        reason: String,
    },
}

impl Base {
    /// Attitude `world_from_base` [w x y z], normalised; the identity where the base has none.
    pub fn world_from_base(&self, qpos: &[f64]) -> [f64; 4] {
        match self {
            Self::Free { qpos: at, .. } => {
                let q = frames::world_from_base([
                    qpos[at + 3],
                    qpos[at + 4],
                    qpos[at + 5],
                    qpos[at + 6],
                ]);
                // `UnitQuaternion` keeps the sign that the state has.
                [q.w, q.i, q.j, q.k]
            }
            Self::Gantry {
                world_from_base, ..
            } => *world_from_base,
            Self::Other { .. } => [1.0, 0.0, 0.0, 0.0],
        }
    }

    /// Velocity of the base origin in the world [m/s], and its angular velocity in the base [rad/s].
    pub fn velocity(&self, qvel: &[f64]) -> ([f64; 3], [f64; 3]) {
        match self {
            Self::Free { dof, .. } => (
                [qvel[*dof], qvel[dof + 1], qvel[dof + 2]],
                [qvel[dof + 3], qvel[dof + 4], qvel[dof + 5]],
            ),
            Self::Gantry { slides, .. } => {
                let mut linear = [0.0; 3];
                for (dof, axis) in slides {
                    for (sum, component) in linear.iter_mut().zip(axis) {
                        *sum += component * qvel[*dof];
                    }
                }
                (linear, [0.0; 3])
            }
            Self::Other { .. } => ([0.0; 3], [0.0; 3]),
        }
    }
}

/// The body that carries the plugin, and all joints of its model.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Its name.
    pub name: String,
    /// Its connection to the world.
    pub base: Base,
    /// All joints of the model, in order.
    pub joints: Vec<Joint>,
}

/// Why a card does not fit a body.
#[derive(Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BodyError {
    /// A joint that the card names is not in the model.
    #[error(
        "the card's joint `{card}` is looked for as `{wanted}`, which this model does not have; its joints \
         are: {}. Where they have other names, list them in attribute `joints`, in the card's order",
        .exists.join(", ")
    )]
    NoJoint {
        /// Its name in the card.
        card: String,
        /// The name looked for.
        wanted: String,
        /// The model's named joints.
        exists: Vec<String>,
    },
    /// A joint that is no single number.
    #[error("joint `{name}` is a {kind:?} joint; the card's `{asker}` needs a hinge or a slide")]
    NotScalar {
        /// Its name.
        name: String,
        /// Its kind.
        kind: JointKind,
        /// The feature that reads it, or the output that acts on it.
        asker: String,
    },
    /// Attribute `joints` has another length than the card's list.
    #[error(
        "attribute `joints` lists {found} names; the card has {} joints: {}",
        .card.len(),
        .card.join(", ")
    )]
    JointCount {
        /// Number given.
        found: usize,
        /// The card's joints.
        card: Vec<String>,
    },
    /// The base moves in a way that the features cannot be read from.
    #[error(
        "the card's feature `{feature}` needs a free joint on body `{body}` (or slides alone between it and \
         the world, as under a towing carriage); {reason}. Add <freejoint/> to that body, or put the plugin \
         on the body that has it"
    )]
    NoFreeJoint {
        /// The feature that reads it.
        feature: String,
        /// The body that carries the plugin.
        body: String,
        /// The joint or body found instead.
        reason: String,
    },
    /// The card predicts something that is no part of a wrench.
    #[error(
        "the card's output `{found}` is unknown; expected one of force.x force.y force.z torque.x torque.y torque.z \
         joint_torque.JOINT, each once"
    )]
    Output {
        /// The name found.
        found: String,
    },
    /// Torques of joints are asked for, and the card has none.
    #[error(
        "attribute `outputs` is `generalised`, but the checkpoint gives the wrench on the base alone ({}); train one with \
         `hydro train --outputs generalised`, or set it to `wrench`",
        .outputs.join(", ")
    )]
    NoJointTorques {
        /// The card's outputs.
        outputs: Vec<String>,
    },
    /// `initial_force` has another length than the card's outputs.
    #[error(
        "attribute `initial_force` has {found} numbers; the card has {} outputs: {}",
        .outputs.len(),
        .outputs.join(", ")
    )]
    InitialForce {
        /// Number given.
        found: usize,
        /// The card's outputs.
        outputs: Vec<String>,
    },
}
