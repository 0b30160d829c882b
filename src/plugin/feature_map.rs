//! The card's features, read from `qpos` and `qvel` of a model alone.
//!
//! Derived fields of `mjData` would be those of the step's start when the plugin advances; `qpos` and
//! `qvel` are right wherever the plugin is called.

use hydro_frames as frames;
use hydro_model::features::{Feature, FeatureLayout};

use super::body::{Base, Body, BodyError, Joint, JointKind};

/// Source of one feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    Position(usize),
    Velocity(usize),
    Quaternion(usize),
    Angular(usize),
    Linear(usize),
    Density,
}

/// A card's features, tied to the addresses of one model.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureMap {
    sources: Vec<Source>,
    quaternion: Option<usize>,
    base: Base,
    density: f64,
    current: [f64; 3],
}

impl FeatureMap {
    /// Ties `layout` to `body`. `card_joints` are the card's, `names` what they are called in this
    /// model; `density` [kg/m^3] and `current` [m/s, world] are those of the water.
    pub fn new(
        layout: &FeatureLayout,
        card_joints: &[String],
        names: Option<&[String]>,
        body: &Body,
        density: f64,
        current: [f64; 3],
    ) -> Result<Self, BodyError> {
        if let Some(names) = names
            && names.len() != card_joints.len()
        {
            return Err(BodyError::JointCount {
                found: names.len(),
                card: card_joints.to_vec(),
            });
        }
        let sources = layout
            .features()
            .iter()
            .map(|feature| source(feature, card_joints, names, body))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            sources,
            quaternion: layout.quaternion(),
            base: body.base.clone(),
            density,
            current,
        })
    }

    /// Length of a sample.
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// Never true: a layout is never empty.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Connection of the base to the world.
    pub fn base(&self) -> &Base {
        &self.base
    }

    /// Writes the sample [n] of a state. The quaternion's sign continues that of `previous` [n], or is
    /// canonical (w >= 0) where nothing came before. `water` is the velocity of the water in the world
    /// beside the current [m/s].
    pub fn sample(
        &self,
        qpos: &[f64],
        qvel: &[f64],
        water: [f64; 3],
        previous: Option<&[f64]>,
        sample: &mut [f64],
    ) {
        let attitude = self.base.world_from_base(qpos);
        let (linear_in_world, angular) = self.base.velocity(qvel);
        let relative =
            [0, 1, 2].map(|axis| linear_in_world[axis] - self.current[axis] - water[axis]);
        let linear = frames::base_from_world(attitude, relative);
        let before = previous
            .zip(self.quaternion)
            .map(|(sample, at)| [sample[at], sample[at + 1], sample[at + 2], sample[at + 3]]);
        let quaternion = frames::continuous_quaternion(attitude, before);
        for (value, source) in sample.iter_mut().zip(&self.sources) {
            *value = match *source {
                Source::Position(at) => qpos[at],
                Source::Velocity(at) => qvel[at],
                Source::Quaternion(component) => quaternion[component],
                Source::Angular(axis) => angular[axis],
                Source::Linear(axis) => linear[axis],
                Source::Density => self.density,
            };
        }
    }

    /// The sample a `fraction` of the way from `from` to `to` [n], with a quaternion of unit length.
    pub fn between(&self, from: &[f64], to: &[f64], fraction: f64, sample: &mut [f64]) {
        for ((value, from), to) in sample.iter_mut().zip(from).zip(to) {
            *value = from + fraction * (to - from);
        }
        if let Some(at) = self.quaternion {
            let quaternion = &mut sample[at..at + 4];
            let norm = quaternion.iter().map(|c| c * c).sum::<f64>().sqrt();
            if norm > f64::MIN_POSITIVE {
                quaternion
                    .iter_mut()
                    .for_each(|component| *component /= norm);
            }
        }
    }
}

/// The hinge or slide of a card's joint. `names`: the card's joints, and what they are called in this model; `asker`: the
/// feature or output of the card that wants it.
pub(super) fn scalar_joint<'a>(
    card: &str,
    (card_joints, names): (&[String], Option<&[String]>),
    body: &'a Body,
    asker: &str,
) -> Result<&'a Joint, BodyError> {
    let wanted = match (names, card_joints.iter().position(|known| known == card)) {
        (Some(names), Some(at)) => names[at].as_str(),
        _ => card,
    };
    let joints = || body.joints.iter();
    let found = joints().find(|joint| joint.name == wanted).ok_or_else(|| {
        let exists = joints().map(|joint| joint.name.clone());
        BodyError::NoJoint {
            card: card.to_owned(),
            wanted: wanted.to_owned(),
            exists: exists.filter(|name| !name.is_empty()).collect(),
        }
    })?;
    match found.kind {
        JointKind::Hinge | JointKind::Slide => Ok(found),
        kind => Err(BodyError::NotScalar {
            name: wanted.to_owned(),
            kind,
            asker: asker.to_owned(),
        }),
    }
}

fn source(
    feature: &Feature,
    card_joints: &[String],
    names: Option<&[String]>,
    body: &Body,
) -> Result<Source, BodyError> {
    let joint =
        |card: &String| scalar_joint(card, (card_joints, names), body, &feature.to_string());
    // A body that never moves has no velocity to read, and an attitude that a moving parent changes
    // is not in qpos.
    let moving_base = || match &body.base {
        Base::Free { .. } => Ok(()),
        Base::Gantry { slides, .. } if !slides.is_empty() => Ok(()),
        Base::Gantry { .. } => Err("no joint lies between it and the world".to_owned()),
        Base::Other { reason } => Err(reason.clone()),
    };
    if feature.needs_free_joint() {
        moving_base().map_err(|reason| BodyError::NoFreeJoint {
            feature: feature.to_string(),
            body: body.name.clone(),
            reason,
        })?;
    }
    Ok(match feature {
        Feature::JointPosition(card) => Source::Position(joint(card)?.qpos),
        Feature::JointVelocity(card) => Source::Velocity(joint(card)?.dof),
        Feature::Quaternion(component) => Source::Quaternion(*component),
        Feature::AngularVelocity(axis) => Source::Angular(*axis),
        Feature::LinearVelocity(axis) => Source::Linear(*axis),
        Feature::Density => Source::Density,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn swimmer() -> Body {
        Body {
            name: "trunk".into(),
            base: Base::Free { qpos: 0, dof: 0 },
            joints: vec![
                Joint {
                    name: "root".into(),
                    kind: JointKind::Free,
                    qpos: 0,
                    dof: 0,
                },
                Joint {
                    name: "knee".into(),
                    kind: JointKind::Hinge,
                    qpos: 7,
                    dof: 6,
                },
            ],
        }
    }

    fn map(body: &Body, names: Option<&[String]>) -> Result<FeatureMap, BodyError> {
        let joints = vec!["knee".to_owned()];
        let layout = FeatureLayout::floating_base(&joints).unwrap();
        FeatureMap::new(&layout, &joints, names, body, 1025.0, [0.5, 0.0, 0.0])
    }

    #[test]
    fn a_yawed_robot_that_drifts_with_the_current_sees_still_water() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let qpos = [1.0, 2.0, 3.0, half, 0.0, 0.0, half, 0.3];
        let qvel = [0.5, 0.2, 0.0, 0.1, 0.2, 0.3, -0.7];
        let mut sample = [0.0; 13];
        map(&swimmer(), None)
            .unwrap()
            .sample(&qpos, &qvel, [0.0; 3], None, &mut sample);
        // Yawed by 90 degrees, the world's +y is the base's +x.
        let want = [
            0.3, -0.7, half, 0.0, 0.0, half, 0.1, 0.2, 0.3, 0.2, 0.0, 0.0, 1025.0,
        ];
        for (got, want) in sample.iter().zip(want) {
            assert!((got - want).abs() < 1e-12, "{sample:?}");
        }
    }

    #[test]
    fn the_quaternion_continues_the_previous_sample() {
        let features = map(&swimmer(), None).unwrap();
        let qpos = [0.0, 0.0, 0.0, -0.1, 0.9, 0.3, 0.3, 0.0];
        let (mut first, mut second) = ([0.0; 13], [0.0; 13]);
        features.sample(&qpos, &[0.0; 7], [0.0; 3], None, &mut first);
        assert!(first[2] > 0.0);
        let turned = [0.0, 0.0, 0.0, 0.05, 0.9, 0.3, 0.3, 0.0];
        features.sample(&turned, &[0.0; 7], [0.0; 3], Some(&first), &mut second);
        assert!(second[2] < 0.0 && second[3] < 0.0, "{second:?}");
    }

    #[test]
    fn refusals_list_what_exists() {
        let names = vec!["elbow".to_owned()];
        let text = map(&swimmer(), Some(&names)).unwrap_err().to_string();
        assert!(
            text.contains("`elbow`") && text.contains("root, knee"),
            "{text}"
        );
        let names = vec!["root".to_owned()];
        let text = map(&swimmer(), Some(&names)).unwrap_err().to_string();
        assert!(text.contains("Free joint"), "{text}");
        let names = vec!["a".to_owned(), "b".to_owned()];
        let text = map(&swimmer(), Some(&names)).unwrap_err().to_string();
        assert!(
            text.contains("lists 2 names") && text.contains("1 joints: knee"),
            "{text}"
        );
        let fixed = Body {
            base: Base::Gantry {
                world_from_base: [1.0, 0.0, 0.0, 0.0],
                slides: vec![],
            },
            ..swimmer()
        };
        let text = map(&fixed, None).unwrap_err().to_string();
        assert!(
            text.contains("free joint on body `trunk`") && text.contains("quaternion.w"),
            "{text}"
        );
    }

    #[test]
    fn a_carriage_gives_velocity_along_its_rails() {
        let body = Body {
            base: Base::Gantry {
                world_from_base: [1.0, 0.0, 0.0, 0.0],
                slides: vec![(0, [1.0, 0.0, 0.0]), (1, [0.0, 1.0, 0.0])],
            },
            joints: vec![Joint {
                name: "knee".into(),
                kind: JointKind::Hinge,
                qpos: 2,
                dof: 2,
            }],
            ..swimmer()
        };
        let layout = FeatureLayout::new(vec![
            Feature::JointPosition("knee".into()),
            Feature::LinearVelocity(0),
            Feature::LinearVelocity(1),
        ])
        .unwrap();
        let features =
            FeatureMap::new(&layout, &["knee".into()], None, &body, 1000.0, [0.0; 3]).unwrap();
        let mut sample = [0.0; 3];
        features.sample(
            &[9.0, 9.0, 0.4],
            &[0.3, -0.1, 5.0],
            [0.0; 3],
            None,
            &mut sample,
        );
        assert_eq!(sample, [0.4, 0.3, -0.1]);
    }
}
