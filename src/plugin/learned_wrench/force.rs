//! A checkpoint's force, and where the outputs of a card act in a model.

use hydro_frames::Wrench;
use hydro_model::{Output, Outputs};

use crate::plugin::{
    body::{Body, BodyError},
    feature_map::scalar_joint,
};

/// A wrench on the carrying body, and torques on joints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LearnedForce {
    /// Body frame, about the body's origin [N, N m].
    pub wrench: Wrench,
    /// Degree of freedom and torque on it [N m; N of a slide].
    pub joints: Vec<(usize, f64)>,
}

impl LearnedForce {
    /// The force whose outputs are `value(output)`; components of the wrench are multiplied by `scale`.
    pub(super) fn of(places: &[Place], scale: &[f64; 6], value: impl Fn(usize) -> f64) -> Self {
        let mut wrench = [0.0; 6];
        let mut joints = Vec::new();
        for (output, place) in places.iter().enumerate() {
            match *place {
                Place::Component(at) => wrench[at] = scale[at] * value(output),
                Place::Dof(at) => joints.push((at, value(output))),
                Place::Unused => {}
            }
        }
        Self {
            wrench: Wrench::from_array(wrench),
            joints,
        }
    }

    /// `part` times as much.
    #[must_use]
    pub fn scaled(mut self, part: f64) -> Self {
        let wrench = &mut self.wrench;
        let joints = self.joints.iter_mut().map(|(_, torque)| torque);
        let components = wrench.force.iter_mut().chain(&mut wrench.torque);
        components.chain(joints).for_each(|value| *value *= part);
        self
    }
}

/// Where an output acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Component of the wrench on the carrying body.
    Component(usize),
    /// Degree of freedom of a joint.
    Dof(usize),
    /// Nowhere: attribute `outputs` leaves it out.
    Unused,
}

/// The places of a card's outputs in a model. `asked`: attribute `outputs`; `names`: the card's joints, and what they are
/// called in this model.
pub(super) fn output_places(
    outputs: &[String],
    asked: Option<Outputs>,
    names: (&[String], Option<&[String]>),
    body: &Body,
) -> Result<Vec<Place>, BodyError> {
    if asked == Some(Outputs::Generalised) && Outputs::of(outputs) != Outputs::Generalised {
        return Err(BodyError::NoJointTorques {
            outputs: outputs.to_vec(),
        });
    }
    let mut places: Vec<Place> = Vec::with_capacity(outputs.len());
    for name in outputs {
        let unknown = || BodyError::Output {
            found: name.clone(),
        };
        let place = match name.parse().map_err(|()| unknown())? {
            Output::Component(at) => Place::Component(at),
            Output::Joint(joint) => Place::Dof(scalar_joint(&joint, names, body, name)?.dof),
        };
        if places.contains(&place) {
            return Err(unknown());
        }
        places.push(place);
    }
    if asked == Some(Outputs::Wrench) {
        let joints = places
            .iter_mut()
            .filter(|place| matches!(place, Place::Dof(_)));
        joints.for_each(|place| *place = Place::Unused);
    }
    Ok(places)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::plugin::body::{Base, Joint, JointKind};

    fn robot() -> Body {
        let joint = |name: &str, kind, qpos, dof| Joint {
            name: name.to_owned(),
            kind,
            qpos,
            dof,
        };
        Body {
            name: "trunk".to_owned(),
            base: Base::Free { qpos: 0, dof: 0 },
            joints: vec![
                joint("root", JointKind::Free, 0, 0),
                joint("knee", JointKind::Hinge, 7, 6),
                joint("fin", JointKind::Slide, 8, 7),
            ],
        }
    }

    fn words(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    fn places(
        outputs: &[&str],
        asked: Option<Outputs>,
        called: Option<&[String]>,
    ) -> Result<Vec<Place>, BodyError> {
        let card = words(&["knee", "fin"]);
        output_places(&words(outputs), asked, (&card, called), &robot())
    }

    const ALL: [&str; 4] = [
        "force.x",
        "torque.z",
        "joint_torque.knee",
        "joint_torque.fin",
    ];

    #[test]
    fn outputs_act_on_the_body_and_on_the_joints_by_name() {
        let found = places(&ALL, None, None).unwrap();
        let [x, yaw] = [Place::Component(0), Place::Component(5)];
        assert_eq!(found, [x, yaw, Place::Dof(6), Place::Dof(7)]);
        // The joints go by other names in this model.
        let swapped = words(&["fin", "knee"]);
        let found = places(&ALL, Some(Outputs::Generalised), Some(&swapped)).unwrap();
        assert_eq!(found, [x, yaw, Place::Dof(7), Place::Dof(6)]);
        let found = places(&ALL, Some(Outputs::Wrench), None).unwrap();
        assert_eq!(found, [x, yaw, Place::Unused, Place::Unused]);

        let values = [1.0, 2.0, 3.0, 4.0];
        let scale = [10.0, 1.0, 1.0, 1.0, 1.0, 0.5];
        let force = LearnedForce::of(&places(&ALL, None, None).unwrap(), &scale, |at| values[at]);
        assert_eq!(force.wrench.to_array(), [10.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(force.joints, [(6, 3.0), (7, 4.0)]);
        let half = force.scaled(0.5);
        assert_eq!((half.wrench.force[0], half.wrench.torque[2]), (5.0, 0.5));
        assert_eq!(half.joints, [(6, 1.5), (7, 2.0)]);
    }

    #[test]
    fn refusals_name_the_joint_or_the_output() {
        let text = |outputs: &[&str], asked, called: Option<&[String]>| {
            places(outputs, asked, called).unwrap_err().to_string()
        };
        let missing = text(&ALL, None, Some(&words(&["elbow", "fin"])));
        assert!(
            missing.contains("`elbow`") && missing.contains("root, knee, fin"),
            "{missing}"
        );
        let free = text(&ALL, None, Some(&words(&["root", "fin"])));
        assert!(
            free.contains("Free joint") && free.contains("joint_torque.knee"),
            "{free}"
        );
        let twice = text(&["joint_torque.knee", "joint_torque.knee"], None, None);
        assert!(
            twice.contains("`joint_torque.knee`") && twice.contains("each once"),
            "{twice}"
        );
        let unknown = text(&["lift"], None, None);
        assert!(unknown.contains("`lift`"), "{unknown}");
        let base = text(&["force.x"], Some(Outputs::Generalised), None);
        assert!(base.contains("on the base alone (force.x)"), "{base}");
        assert!(base.contains("--outputs generalised"), "{base}");
    }
}
