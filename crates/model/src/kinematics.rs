//! Forward kinematics: poses and velocities of a robot's links from joint positions and velocities.
//!
//! The tree of links below the base is data, like the feature list: a data set's `manifest.json` has it as `kinematics`,
//! and so has the card of a model that reads the motion of the links.

use serde::{Deserialize, Serialize};

use crate::features::{Feature, FeatureLayout};

/// Greatest number of links in a tree; their poses are held on the stack.
pub const MOST_LINKS: usize = 64;

/// A tree of links, parents before children.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kinematics {
    /// The links; the base is among them if water acts on it.
    pub links: Vec<Link>,
}

// Every number is finite ([`Kinematics::fault`]), so equality is an equivalence.
impl Eq for Kinematics {}

/// One link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Link {
    /// Its name.
    pub name: String,
    /// Index of the parent link; `None` for the base frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parent: Option<usize>,
    /// Its origin in the parent's frame [m].
    pub origin: [f64; 3],
    /// Unit quaternion `parent_from_link` (w x y z) at joint position zero.
    pub rotation: [f64; 4],
    /// The joint to the parent, through the link's origin; `None` for a fixed link.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<Joint>,
    /// Point at which the water's force acts, in the link's frame [m].
    pub centre: [f64; 3],
    /// Long axis of the link in its frame, a unit vector.
    pub along: [f64; 3],
}

/// A joint of one degree of freedom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Joint {
    /// Its name, as in the features `position.<name>` and `velocity.<name>`.
    pub name: String,
    /// Hinge or slide.
    pub kind: JointKind,
    /// Its axis in the link's frame, a unit vector.
    pub axis: [f64; 3],
}

/// Motion of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointKind {
    /// Rotation about the axis [rad].
    Hinge,
    /// Translation along the axis [m].
    Slide,
}

impl Kinematics {
    /// Reason why the tree is invalid or these features lack one of its joints, if there is one.
    pub fn fault(&self, layout: &FeatureLayout) -> Option<String> {
        if self.links.is_empty() || self.links.len() > MOST_LINKS {
            let found = self.links.len();
            return Some(format!(
                "kinematics: {found} links, expected 1 to {MOST_LINKS}"
            ));
        }
        self.links.iter().enumerate().find_map(|(index, link)| {
            let fault = link.fault(index, layout)?;
            Some(format!("kinematics: link `{}`: {fault}", link.name))
        })
    }

    /// The tree with the indices of its joints among the features; a position or velocity that they lack is zero.
    pub fn bound(&self, layout: &FeatureLayout) -> BoundKinematics {
        let links = self.links.iter().map(|link| BoundLink {
            parent: link.parent,
            origin: link.origin,
            rotation: matrix(link.rotation),
            joint: link.joint.as_ref().map(|joint| BoundJoint {
                position: layout.index_of(&Feature::JointPosition(joint.name.clone())),
                velocity: layout.index_of(&Feature::JointVelocity(joint.name.clone())),
                kind: joint.kind,
                axis: joint.axis,
            }),
            centre: link.centre,
            along: link.along,
        });
        let three = |feature: fn(usize) -> Feature| [0, 1, 2].map(|i| layout.index_of(&feature(i)));
        BoundKinematics {
            links: links.collect(),
            linear: three(Feature::LinearVelocity),
            angular: three(Feature::AngularVelocity),
        }
    }
}

impl Link {
    fn fault(&self, index: usize, layout: &FeatureLayout) -> Option<String> {
        let unit = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-6;
        if self.parent.is_some_and(|parent| parent >= index) {
            return Some(
                "has a parent that comes later in the list; expected parents first".to_owned(),
            );
        }
        if !self
            .origin
            .iter()
            .chain(&self.centre)
            .all(|x| x.is_finite())
        {
            return Some("origin or centre is not finite".to_owned());
        }
        if !unit(&self.rotation) || !unit(&self.along) {
            return Some("rotation or along is not of length 1".to_owned());
        }
        let joint = self.joint.as_ref()?;
        if !unit(&joint.axis) {
            return Some(format!(
                "the axis of joint `{}` is not of length 1",
                joint.name
            ));
        }
        let known = layout.index_of(&Feature::JointPosition(joint.name.clone()));
        known
            .is_none()
            .then(|| format!("the features hold no `position.{}`", joint.name))
    }
}

/// A tree of links tied to a feature layout by [`Kinematics::bound`].
#[derive(Clone, Debug, PartialEq)]
pub struct BoundKinematics {
    links: Vec<BoundLink>,
    linear: [Option<usize>; 3],
    angular: [Option<usize>; 3],
}

// For the same reason as the tree.
impl Eq for BoundKinematics {}

#[derive(Clone, Debug, PartialEq)]
struct BoundLink {
    parent: Option<usize>,
    origin: [f64; 3],
    rotation: Matrix,
    joint: Option<BoundJoint>,
    centre: [f64; 3],
    along: [f64; 3],
}

#[derive(Clone, Debug, PartialEq)]
struct BoundJoint {
    position: Option<usize>,
    velocity: Option<usize>,
    kind: JointKind,
    axis: [f64; 3],
}

/// Pose and velocity of a link, in the axes of the base frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkMotion {
    /// Point at which the water's force acts, from the base's origin [m].
    pub centre: [f64; 3],
    /// Velocity of that point relative to the water [m/s].
    pub velocity: [f64; 3],
    /// Long axis of the link, a unit vector.
    pub along: [f64; 3],
}

/// Pose and velocity of a link's frame, in the axes of the base frame.
#[derive(Clone, Copy, Default)]
struct Frame {
    rotation: Matrix,
    origin: [f64; 3],
    linear: [f64; 3],
    angular: [f64; 3],
}

impl BoundKinematics {
    /// Number of links.
    #[expect(clippy::len_without_is_empty, reason = "a tree is never empty")]
    pub fn len(&self) -> usize {
        self.links.len()
    }

    /// Calls `visit` for every link, in order; `x(i)` is feature i of the sample (SI).
    pub fn motions(&self, x: impl Fn(usize) -> f64, mut visit: impl FnMut(LinkMotion)) {
        let three = |at: [Option<usize>; 3]| at.map(|at| at.map_or(0.0, &x));
        let base = Frame {
            rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            origin: [0.0; 3],
            linear: three(self.linear),
            angular: three(self.angular),
        };
        let mut frames = [Frame::default(); MOST_LINKS];
        for (index, link) in self.links.iter().enumerate() {
            let parent = link.parent.map_or(base, |parent| frames[parent]);
            let frame = link.frame(&parent, &x);
            let arm = turned(&frame.rotation, link.centre);
            visit(LinkMotion {
                centre: sum(frame.origin, arm),
                velocity: sum(frame.linear, cross(frame.angular, arm)),
                along: turned(&frame.rotation, link.along),
            });
            frames[index] = frame;
        }
    }
}

impl BoundLink {
    fn frame(&self, parent: &Frame, x: impl Fn(usize) -> f64) -> Frame {
        let arm = turned(&parent.rotation, self.origin);
        let mut frame = Frame {
            rotation: product(&parent.rotation, &self.rotation),
            origin: sum(parent.origin, arm),
            linear: sum(parent.linear, cross(parent.angular, arm)),
            angular: parent.angular,
        };
        let Some(joint) = &self.joint else {
            return frame;
        };
        let (q, rate) = (
            joint.position.map_or(0.0, &x),
            joint.velocity.map_or(0.0, &x),
        );
        let axis = turned(&frame.rotation, joint.axis);
        match joint.kind {
            JointKind::Hinge => {
                frame.rotation = product(&frame.rotation, &about(joint.axis, q));
                frame.angular = sum(frame.angular, scaled(axis, rate));
            }
            JointKind::Slide => {
                let way = scaled(axis, q);
                frame.origin = sum(frame.origin, way);
                let carried = sum(cross(frame.angular, way), scaled(axis, rate));
                frame.linear = sum(frame.linear, carried);
            }
        }
        frame
    }
}

/// Rotation matrix, by rows.
type Matrix = [[f64; 3]; 3];

/// a x b.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// s a.
pub fn scaled(a: [f64; 3], s: f64) -> [f64; 3] {
    a.map(|x| s * x)
}

/// R a.
fn turned(r: &Matrix, a: [f64; 3]) -> [f64; 3] {
    r.map(|row| row[0] * a[0] + row[1] * a[1] + row[2] * a[2])
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let column = |j: usize| turned(a, [b[0][j], b[1][j], b[2][j]]);
    let (x, y, z) = (column(0), column(1), column(2));
    [0, 1, 2].map(|i| [x[i], y[i], z[i]])
}

/// Rotation matrix of a unit quaternion.
fn matrix([w, x, y, z]: [f64; 4]) -> Matrix {
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
        ],
        [
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
        ],
        [
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}

/// Rotation matrix of an angle [rad] about a unit axis.
fn about(axis: [f64; 3], angle: f64) -> Matrix {
    let (sin, cos) = (0.5 * angle).sin_cos();
    matrix([cos, sin * axis[0], sin * axis[1], sin * axis[2]])
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

    use super::*;

    /// A hinge on the base, tilted, a slide on it, and a hinge on that.
    fn tree() -> Kinematics {
        let turn = UnitQuaternion::from_euler_angles(0.3, -0.4, 0.9);
        let half = 0.5f64.sqrt();
        let link = |name: &str, parent, joint: Option<(&str, JointKind, [f64; 3])>| Link {
            name: name.to_owned(),
            parent,
            origin: [0.3, -0.1, 0.2],
            rotation: [turn.w, turn.i, turn.j, turn.k],
            joint: joint.map(|(name, kind, axis)| Joint {
                name: name.to_owned(),
                kind,
                axis,
            }),
            centre: [0.05, 0.02, -0.15],
            along: [0.0, 0.0, 1.0],
        };
        Kinematics {
            links: vec![
                link("base", None, None),
                link(
                    "hip",
                    None,
                    Some(("a", JointKind::Hinge, [half, half, 0.0])),
                ),
                link(
                    "rail",
                    Some(1),
                    Some(("b", JointKind::Slide, [0.0, 0.6, 0.8])),
                ),
                link(
                    "foot",
                    Some(2),
                    Some(("c", JointKind::Hinge, [0.0, 1.0, 0.0])),
                ),
            ],
        }
    }

    fn layout() -> FeatureLayout {
        FeatureLayout::floating_base(&["a", "b", "c"].map(str::to_owned)).expect("a layout")
    }

    /// Positions 0.7, 0.2, -1.1; velocities; quaternion; angular and linear velocity; density.
    const X: [f64; 17] = [
        0.7, 0.2, -1.1, 1.3, -0.4, 2.1, 1.0, 0.0, 0.0, 0.0, 0.2, -0.5, 0.9, 0.6, 0.1, -0.3, 1000.0,
    ];

    fn motions(x: &[f64]) -> Vec<LinkMotion> {
        let mut found = Vec::new();
        tree()
            .bound(&layout())
            .motions(|at| x[at], |motion| found.push(motion));
        found
    }

    /// The same by nalgebra's isometries.
    #[test]
    fn links_are_where_isometries_put_them() {
        let mut poses: Vec<Isometry3<f64>> = Vec::new();
        for (link, found) in tree().links.iter().zip(motions(&X)) {
            let [w, x, y, z] = link.rotation;
            let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
            let parent = link.parent.map_or(Isometry3::identity(), |at| poses[at]);
            let mut pose = parent * Isometry3::from_parts(Translation3::from(link.origin), turn);
            if let Some(joint) = &link.joint {
                let q = X[["a", "b", "c"]
                    .iter()
                    .position(|name| *name == joint.name)
                    .expect("known")];
                let axis = Vector3::from(joint.axis);
                pose *= match joint.kind {
                    JointKind::Hinge => Isometry3::from_parts(
                        Translation3::identity(),
                        UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), q),
                    ),
                    JointKind::Slide => Isometry3::from(axis * q),
                };
            }
            let centre = pose * nalgebra::Point3::from(link.centre);
            let along = pose * Vector3::from(link.along);
            for i in 0..3 {
                assert!((found.centre[i] - centre[i]).abs() < 1e-12, "{}", link.name);
                assert!((found.along[i] - along[i]).abs() < 1e-12, "{}", link.name);
            }
            poses.push(pose);
        }
    }

    /// The base moves on for a moment by its twist, the joints by their velocities.
    #[test]
    fn velocities_are_differences_of_places() {
        let after = |step: f64| -> Vec<Vector3<f64>> {
            let mut x = X;
            for joint in 0..3 {
                x[joint] += step * X[3 + joint];
            }
            let spin = Vector3::new(X[10], X[11], X[12]) * step;
            let shift = Vector3::new(X[13], X[14], X[15]) * step;
            let base = Isometry3::new(shift, spin);
            let placed = motions(&x).into_iter();
            placed
                .map(|motion| (base * nalgebra::Point3::from(motion.centre)).coords)
                .collect()
        };
        let (before, behind) = (after(-1e-5), after(1e-5));
        for ((found, a), b) in motions(&X).iter().zip(before).zip(behind) {
            let slope = (b - a) / 2e-5;
            for i in 0..3 {
                assert!(
                    (found.velocity[i] - slope[i]).abs() < 1e-8,
                    "{found:?} {slope}"
                );
            }
        }
    }

    #[test]
    fn every_fault_is_named() {
        type Change = fn(&mut Kinematics);
        let cases: [(Change, &str); 7] = [
            (|t| t.links.clear(), "0 links, expected 1 to 64"),
            (
                |t| t.links[2].parent = Some(2),
                "link `rail`: has a parent that comes later in the list",
            ),
            (
                |t| t.links[0].centre[1] = f64::NAN,
                "link `base`: origin or centre is not finite",
            ),
            (
                |t| t.links[3].rotation = [1.0, 1.0, 0.0, 0.0],
                "link `foot`: rotation or along",
            ),
            (
                |t| t.links[1].along = [0.0; 3],
                "link `hip`: rotation or along",
            ),
            (
                |t| {
                    if let Some(joint) = &mut t.links[1].joint {
                        joint.axis = [2.0, 0.0, 0.0];
                    }
                },
                "the axis of joint `a` is not of length 1",
            ),
            (
                |t| {
                    if let Some(joint) = &mut t.links[1].joint {
                        joint.name = "knee".to_owned();
                    }
                },
                "link `hip`: the features hold no `position.knee`",
            ),
        ];
        assert_eq!(tree().fault(&layout()), None);
        for (change, words) in cases {
            let mut broken = tree();
            change(&mut broken);
            let fault = broken.fault(&layout()).expect("a fault");
            assert!(fault.contains(words), "{fault}");
        }
    }

    #[test]
    fn a_tree_survives_json() {
        let text = serde_json::to_string(&tree()).expect("serialises");
        assert_eq!(
            serde_json::from_str::<Kinematics>(&text).expect("parses"),
            tree()
        );
        assert!(serde_json::from_str::<Kinematics>("{\"links\": [], \"x\": 1}").is_err());
    }
}
