//! Encoding of a sample: from its features to the numbers that a network reads.

use serde::{Deserialize, Serialize};

use crate::{
    features::{Feature, FeatureLayout},
    kinematics::{BoundKinematics, Kinematics, cross, scaled},
};

/// Encoding of a sample.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// The features as they are, the quaternion included, as in the paper.
    Raw,
    /// The world's up direction in the base frame (3 numbers) in place of the quaternion (4): the water's wrench in the
    /// base frame depends on neither the heading nor the quaternion's sign, and hydrostatics are then nearly linear.
    #[default]
    Up,
    /// [`Encoding::Up`], followed by closed forms of the water's force, whose coefficients a linear part learns. With rho
    /// the density, v and w the linear and angular velocity of the base, q' the joint velocities:
    ///
    /// - buoyancy: rho up;
    /// - quadratic drag: rho |v| v, rho |v_i| v_i, rho |w| w, rho |q'_i| q'_i;
    /// - constant added mass: rho v_i w_j (Coriolis forces), rho v_i v_j (Munk moments), rho w_i w_j (gyroscopic moments).
    ///
    /// A form whose features the layout lacks is left out; without a density rho is 1.
    Hydrodynamic,
    /// [`Encoding::Hydrodynamic`], followed by closed forms of every link, as wrenches on the base about its origin. With
    /// u the velocity of the link's centre r and a its long axis: rho |u| u and rho |u| (u . a) a with their moments (drag
    /// of a strip across and along the link), and the moment of rho up (buoyancy).
    Links(Kinematics),
}

impl Encoding {
    /// Reason why samples of this layout cannot be encoded, if there is one.
    pub fn fault(&self, layout: &FeatureLayout) -> Option<String> {
        match self {
            Self::Links(kinematics) => kinematics.fault(layout),
            Self::Raw | Self::Up | Self::Hydrodynamic => None,
        }
    }

    /// True if closed forms of the water's force are among the encoded numbers.
    pub fn has_closed_forms(&self) -> bool {
        match self {
            Self::Raw | Self::Up => false,
            Self::Hydrodynamic | Self::Links(_) => true,
        }
    }

    /// True if the attitude enters as the up direction, which does not depend on the quaternion's sign.
    pub fn replaces_quaternion(&self) -> bool {
        *self != Self::Raw
    }
}

/// An encoding tied to a feature layout: a sample of n features becomes [`Encoder::len`] numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Encoder {
    inputs: usize,
    /// Index of the quaternion among the features, if it is replaced.
    quaternion: Option<usize>,
    /// Closed forms that follow the features.
    forms: Option<Forms>,
}

/// Features are clamped to this, so that no product of three leaves the range of f64.
const FORM_LIMIT: f64 = 1e60;

/// [`FORM_LIMIT`] for the closed forms of links, where the position of a slide joint is multiplied by a rate, squared and
/// multiplied by the position again.
const LINK_FORM_LIMIT: f64 = 1e30;

/// Indices of the features that the closed forms are made of.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Forms {
    quaternion: Option<usize>,
    density: Option<usize>,
    linear: Vec<usize>,
    angular: Vec<usize>,
    joints: Vec<usize>,
    links: Option<BoundKinematics>,
}

/// Numbers that each link adds.
const PER_LINK: usize = 15;

impl Forms {
    fn new(layout: &FeatureLayout, links: Option<&Kinematics>) -> Self {
        let all = |wanted: fn(&Feature) -> bool| {
            let features = layout.features().iter().enumerate();
            features
                .filter(|(_, feature)| wanted(feature))
                .map(|(at, _)| at)
                .collect()
        };
        Self {
            quaternion: layout.quaternion(),
            density: layout.density(),
            linear: all(|feature| matches!(feature, Feature::LinearVelocity(_))),
            angular: all(|feature| matches!(feature, Feature::AngularVelocity(_))),
            joints: all(|feature| matches!(feature, Feature::JointVelocity(_))),
            links: links.map(|links| links.bound(layout)),
        }
    }

    fn len(&self) -> usize {
        let (v, w) = (self.linear.len(), self.angular.len());
        let pairs = |n: usize| n * n.saturating_sub(1) / 2;
        3 * usize::from(self.quaternion.is_some())
            + 2 * v
            + v * w
            + pairs(v)
            + w
            + pairs(w)
            + self.joints.len()
            + PER_LINK * self.links.as_ref().map_or(0, BoundKinematics::len)
    }

    /// Calls `put(index, value)` for each closed form of the sample `x` (SI).
    fn evaluate(&self, x: &[f64], mut put: impl FnMut(usize, f64)) {
        let x = |at: usize| x[at].clamp(-FORM_LIMIT, FORM_LIMIT);
        let density = self.density.map_or(1.0, x);
        let norm = |at: &[usize]| at.iter().map(|i| x(*i) * x(*i)).sum::<f64>().sqrt();
        let (speed, rate) = (norm(&self.linear), norm(&self.angular));
        let mut index = 0;
        let mut next = |value: f64| {
            put(index, density * value);
            index += 1;
        };
        let mut up = [0.0, 0.0, 1.0];
        if let Some(at) = self.quaternion {
            up = up_in_base([x(at), x(at + 1), x(at + 2), x(at + 3)]);
            up.into_iter().for_each(&mut next);
        }
        for (i, v) in self.linear.iter().map(|at| x(*at)).enumerate() {
            next(speed * v);
            next(v.abs() * v);
            self.angular.iter().for_each(|at| next(v * x(*at)));
            self.linear[i + 1..].iter().for_each(|at| next(v * x(*at)));
        }
        for (i, w) in self.angular.iter().map(|at| x(*at)).enumerate() {
            next(rate * w);
            self.angular[i + 1..].iter().for_each(|at| next(w * x(*at)));
        }
        let joints = self.joints.iter().map(|at| x(*at));
        joints.for_each(|velocity| next(velocity.abs() * velocity));
        let Some(links) = &self.links else { return };
        let x = |at: usize| x(at).clamp(-LINK_FORM_LIMIT, LINK_FORM_LIMIT);
        links.motions(x, |link| {
            let [u, a] = [link.velocity, link.along];
            let speed = u.iter().map(|u| u * u).sum::<f64>().sqrt();
            let across = scaled(u, speed);
            let along = scaled(a, speed * (u[0] * a[0] + u[1] * a[1] + u[2] * a[2]));
            for force in [across, along] {
                force.into_iter().for_each(&mut next);
                cross(link.centre, force).into_iter().for_each(&mut next);
            }
            cross(link.centre, up).into_iter().for_each(&mut next);
        });
    }
}

impl Encoder {
    /// Ties an encoding to a layout; without a quaternion [`Encoding::Up`] equals [`Encoding::Raw`].
    pub fn new(encoding: &Encoding, layout: &FeatureLayout) -> Self {
        Self {
            inputs: layout.len(),
            quaternion: layout
                .quaternion()
                .filter(|_| encoding.replaces_quaternion()),
            forms: match encoding {
                Encoding::Raw | Encoding::Up => None,
                Encoding::Hydrodynamic => Some(Forms::new(layout, None)),
                Encoding::Links(links) => Some(Forms::new(layout, Some(links))),
            },
        }
    }

    /// Features of a sample, n.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Numbers in an encoded sample.
    #[expect(clippy::len_without_is_empty, reason = "a layout is never empty")]
    pub fn len(&self) -> usize {
        self.plain_len() + self.forms.as_ref().map_or(0, Forms::len)
    }

    /// Numbers in an encoded sample without the closed forms.
    fn plain_len(&self) -> usize {
        self.inputs - usize::from(self.quaternion.is_some())
    }

    /// Index in an encoded sample of the feature at index `raw`; `None` for a component of a replaced quaternion.
    pub fn index_of(&self, raw: usize) -> Option<usize> {
        match self.quaternion {
            Some(at) if (at..at + 4).contains(&raw) => None,
            Some(at) if raw >= at + 4 => Some(raw - 1),
            _ => Some(raw),
        }
    }

    /// Calls `put(index, value)` for each number of the encoded sample `x` (SI, length n).
    #[inline]
    pub fn encode(&self, x: &[f64], mut put: impl FnMut(usize, f64)) {
        if let Some(forms) = &self.forms {
            let behind = self.plain_len();
            forms.evaluate(x, |index, value| put(behind + index, value));
        }
        let Some(at) = self.quaternion else {
            for (index, value) in x.iter().enumerate() {
                put(index, *value);
            }
            return;
        };
        for (index, value) in x[..at].iter().enumerate() {
            put(index, *value);
        }
        for (index, value) in up_in_base([x[at], x[at + 1], x[at + 2], x[at + 3]])
            .into_iter()
            .enumerate()
        {
            put(at + index, value);
        }
        for (index, value) in x[at + 4..].iter().enumerate() {
            put(at + 3 + index, *value);
        }
    }
}

/// The world's z axis in the base frame: the last row of `world_from_base`. A zero quaternion is the identity.
fn up_in_base([w, x, y, z]: [f64; 4]) -> [f64; 3] {
    let square = w * w + x * x + y * y + z * z;
    if square < f64::MIN_POSITIVE {
        return [0.0, 0.0, 1.0];
    }
    let scale = 2.0 / square;
    [
        scale * (x * z - w * y),
        scale * (y * z + w * x),
        1.0 - scale * (x * x + y * y),
    ]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use hydro_frames::base_from_world;

    fn encoded(encoding: Encoding, x: &[f64]) -> Vec<f64> {
        let layout = FeatureLayout::floating_base(&["a".into()]).expect("valid");
        let encoder = Encoder::new(&encoding, &layout);
        let mut out = vec![f64::NAN; encoder.len()];
        encoder.encode(x, |index, value| out[index] = value);
        out
    }

    #[test]
    fn raw_is_the_identity_and_up_keeps_its_neighbours() {
        let x: Vec<f64> = (0..13).map(f64::from).collect();
        assert_eq!(encoded(Encoding::Raw, &x), x);
        let up = encoded(Encoding::Up, &x);
        assert_eq!(up.len(), 12);
        assert_eq!((&up[..2], &up[5..]), (&x[..2], &x[6..]));
        let layout = FeatureLayout::floating_base(&["a".into()]).expect("valid");
        let encoder = Encoder::new(&Encoding::Up, &layout);
        for (raw, value) in x.iter().enumerate() {
            let kept = !(2..6).contains(&raw);
            assert_eq!(
                encoder.index_of(raw).map(|at| up[at]),
                kept.then_some(*value)
            );
        }
    }

    #[test]
    fn a_zero_quaternion_is_upright() {
        assert_eq!(encoded(Encoding::Up, &[0.0; 13])[2..5], [0.0, 0.0, 1.0]);
    }

    /// The numbers after the features against the definition, written out by hand.
    #[test]
    fn the_closed_forms_are_those_of_the_definition() {
        // Position, velocity, quaternion (upside down), angular and linear velocity, density.
        let x = [
            0.5, -2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 3.0, -1.0, 2.0, 2.0, 10.0,
        ];
        let plain = encoded(Encoding::Up, &x);
        let found = encoded(Encoding::Hydrodynamic, &x);
        assert_eq!(found[..plain.len()], plain);
        let buoyancy = [0.0, 0.0, -10.0];
        // |v| v, |v_i| v_i, v_i w, v_i v_j, axis by axis, at |v| = 3.
        let linear = [-30.0, -10.0, 0.0, 0.0, -30.0, -20.0, -20.0]
            .into_iter()
            .chain([60.0, 40.0, 0.0, 0.0, 60.0, 40.0])
            .chain([60.0, 40.0, 0.0, 0.0, 60.0]);
        // |w| w and w_i w_j, then the joint.
        let rest = [0.0, 0.0, 0.0, 0.0, 0.0, 90.0, -40.0];
        let expected: Vec<f64> = buoyancy.into_iter().chain(linear).chain(rest).collect();
        assert_eq!(found[plain.len()..], expected);
        // A towed leg: two velocities and nothing else.
        let names = [
            "position.thigh",
            "position.calf",
            "linear_velocity.x",
            "linear_velocity.y",
        ];
        let features = names.map(|name| name.parse().expect("known")).to_vec();
        let layout = FeatureLayout::new(features).expect("valid");
        let encoder = Encoder::new(&Encoding::Hydrodynamic, &layout);
        let mut out = vec![f64::NAN; encoder.len()];
        encoder.encode(&[0.1, 0.2, 3.0, -4.0], |index, value| out[index] = value);
        assert_eq!(out, [0.1, 0.2, 3.0, -4.0, 15.0, 9.0, -12.0, -20.0, -16.0]);
        assert_eq!(encoder.index_of(3), Some(3));
    }

    /// A link fixed to the base, 1 m ahead of it, its long axis along y; expected numbers by hand.
    #[test]
    fn a_links_forms_are_wrenches_about_the_base() {
        let link = serde_json::json!({"links": [{"name": "head", "origin": [1.0, 0.0, 0.0], "rotation": [1.0, 0.0, 0.0, 0.0],
            "centre": [0.0, 0.0, 0.0], "along": [0.0, 1.0, 0.0]}]});
        let links = Encoding::Links(serde_json::from_value(link).expect("a tree"));
        // Upright, turning about z at 2, moving ahead at 1.5, in water of 10.
        let x = [
            0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 1.5, 0.0, 0.0, 10.0,
        ];
        let before = encoded(Encoding::Hydrodynamic, &x);
        let found = encoded(links.clone(), &x);
        assert_eq!(found[..before.len()], before);
        // The head moves at (1.5, 2, 0), speed 2.5.
        let across = [37.5, 50.0, 0.0, 0.0, 0.0, 50.0];
        let along = [0.0, 50.0, 0.0, 0.0, 0.0, 50.0];
        let buoyancy = [0.0, -10.0, 0.0];
        let expected = [&across[..], &along, &buoyancy].concat();
        assert_eq!(found[before.len()..], expected);
        let layout = FeatureLayout::floating_base(&["a".into()]).expect("valid");
        assert_eq!(links.fault(&layout), None);
        assert!(links.replaces_quaternion() && !Encoding::Raw.replaces_quaternion());
    }

    proptest! {
        #[test]
        fn up_is_the_world_axis_in_the_base_frame_whatever_the_sign(q in prop::array::uniform4(-1.0f64..1.0)) {
            prop_assume!(q.iter().map(|c| c * c).sum::<f64>() > 1e-3);
            let expected = base_from_world(q, [0.0, 0.0, 1.0]);
            for quaternion in [q, q.map(|c| -c)] {
                for (got, want) in up_in_base(quaternion).iter().zip(expected) {
                    prop_assert!((got - want).abs() < 1e-12);
                }
            }
        }
    }
}
