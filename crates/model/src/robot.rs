//! A robot as described by its URDF: links, moving joints in file order, masses, inertias, limits, displaced volumes.
//!
//! Meshes (a mesh displaces no volume here), transmissions, sensors and materials are not read.

use std::{
    collections::HashMap,
    f64::consts::PI,
    path::{Path, PathBuf},
};

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use thiserror::Error;

/// Reason for refusing a robot description.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RobotError {
    /// The file is missing or not a URDF.
    #[error("{path}: cannot read this as a URDF: {reason}", path = path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Message of the parser.
        reason: String,
    },
    /// A joint names a link that is not in the file.
    #[error("{path}: joint `{joint}` names the link `{link}`, which is not in the file; links: {known}", path = path.display())]
    UnknownLink {
        /// The file.
        path: PathBuf,
        /// The joint.
        joint: String,
        /// The link it names.
        link: String,
        /// The links that exist.
        known: String,
    },
    /// A mass or an inertia that is physically impossible.
    #[error("{path}: link `{link}`: {what}", path = path.display())]
    Unphysical {
        /// The file.
        path: PathBuf,
        /// The link.
        link: String,
        /// The offending quantity and its value.
        what: String,
    },
}

/// Mass [kg], centre of mass [m] and rotational inertia about it [kg m^2], in the link's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// Mass [kg].
    pub mass: f64,
    /// Centre of mass in the link's frame [m].
    pub centre: Vector3<f64>,
    /// Inertia tensor about the centre of mass, axes of the link's frame [kg m^2].
    pub tensor: Matrix3<f64>,
}

impl Inertia {
    /// A link without mass.
    pub const NONE: Self = Self {
        mass: 0.0,
        centre: Vector3::new(0.0, 0.0, 0.0),
        tensor: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// The same inertia in a frame in which the link's pose is `pose`.
    pub fn seen_from(&self, pose: &Isometry3<f64>) -> Self {
        let rotation = pose.rotation.to_rotation_matrix();
        Self {
            mass: self.mass,
            centre: (pose * nalgebra::Point3::from(self.centre)).coords,
            tensor: rotation * self.tensor * rotation.transpose(),
        }
    }

    /// Inertia of two rigidly joined bodies (parallel-axis theorem).
    pub fn fused_with(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if mass <= 0.0 {
            return Self::NONE;
        }
        let centre = (self.centre * self.mass + other.centre * other.mass) / mass;
        let about_centre = |part: &Self| {
            let d = part.centre - centre;
            part.tensor + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * part.mass
        };
        Self {
            mass,
            centre,
            tensor: about_centre(self) + about_centre(other),
        }
    }
}

/// A link with its inertia and its displaced volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Name in the URDF.
    pub name: String,
    /// Its rigid-body inertia.
    pub inertia: Inertia,
    /// Volume of its primitive collision shapes [m^3]; overlaps are counted twice.
    pub displaced_volume: f64,
}

/// Motion of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Rotation between limits [rad].
    Revolute,
    /// Rotation without limits [rad].
    Continuous,
    /// Translation between limits [m].
    Prismatic,
}

/// A joint that moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name in the URDF.
    pub name: String,
    /// Its motion.
    pub kind: JointKind,
    /// Its parent link.
    pub parent: String,
    /// Its child link.
    pub child: String,
    /// Pose of the child's frame in the parent's at joint position zero.
    pub parent_from_child: Isometry3<f64>,
    /// Unit axis in the child's frame.
    pub axis: Vector3<f64>,
    /// Lower and upper position limit [rad or m].
    pub range: [f64; 2],
    /// Greatest torque [N m] or force [N].
    pub effort: f64,
    /// Greatest velocity [rad/s or m/s].
    pub velocity: f64,
}

/// A robot: links as in the file, moving joints in file order, and the bodies left after fixed joints are fused.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// Name in the URDF.
    pub name: String,
    /// Every link of the file.
    pub links: Vec<Link>,
    /// Every moving joint, in file order, which is the order of the features.
    pub joints: Vec<Joint>,
    /// Links after each child of a fixed joint is fused into its parent, as MuJoCo compiles them.
    pub bodies: Vec<Link>,
}

impl Robot {
    /// Reads a URDF.
    ///
    /// # Errors
    /// If the file is no URDF, a joint names an unknown link, or a mass or inertia is unphysical.
    pub fn from_urdf(path: &Path) -> Result<Self, RobotError> {
        let urdf = urdf_rs::read_file(path).map_err(|error| RobotError::Unreadable {
            path: path.to_owned(),
            reason: error.to_string(),
        })?;
        let links = urdf
            .links
            .iter()
            .map(|link| read_link(link, path))
            .collect::<Result<Vec<_>, _>>()?;
        check_links_exist(&urdf.joints, &links, path)?;
        let joints = urdf.joints.iter().filter_map(read_moving_joint).collect();
        let bodies = fuse_fixed(&urdf.joints, &links);
        Ok(Self {
            name: urdf.name,
            links,
            joints,
            bodies,
        })
    }

    /// Sum of all link masses [kg].
    pub fn mass(&self) -> f64 {
        self.links.iter().map(|link| link.inertia.mass).sum()
    }

    /// Sum of all displaced volumes [m^3].
    pub fn displaced_volume(&self) -> f64 {
        self.links.iter().map(|link| link.displaced_volume).sum()
    }

    /// Names of the moving joints, in file order.
    pub fn joint_names(&self) -> Vec<String> {
        self.joints.iter().map(|joint| joint.name.clone()).collect()
    }
}

fn isometry(pose: &urdf_rs::Pose) -> Isometry3<f64> {
    let [x, y, z] = pose.xyz.0;
    let [roll, pitch, yaw] = pose.rpy.0;
    Isometry3::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}

fn read_link(link: &urdf_rs::Link, path: &Path) -> Result<Link, RobotError> {
    let unphysical = |what: String| RobotError::Unphysical {
        path: path.to_owned(),
        link: link.name.clone(),
        what,
    };
    let given = &link.inertial;
    let mass = given.mass.value;
    if !(mass.is_finite() && mass >= 0.0) {
        return Err(unphysical(format!("mass {mass} kg; expected zero or more")));
    }
    let i = &given.inertia;
    let tensor = Matrix3::new(
        i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz,
    );
    let smallest = tensor.symmetric_eigenvalues().min();
    if mass > 0.0 && !(smallest.is_finite() && smallest >= -1e-12) {
        return Err(unphysical(format!(
            "inertia with a principal moment of {smallest:.3e} kg m^2; expected zero or more"
        )));
    }
    let about_centre = Inertia {
        mass,
        centre: Vector3::zeros(),
        tensor,
    };
    Ok(Link {
        name: link.name.clone(),
        inertia: about_centre.seen_from(&isometry(&given.origin)),
        displaced_volume: link.collision.iter().map(|c| volume(&c.geometry)).sum(),
    })
}

/// Volume of a primitive shape [m^3]; 0 for a mesh, whose file is not read.
fn volume(geometry: &urdf_rs::Geometry) -> f64 {
    match geometry {
        urdf_rs::Geometry::Box { size } => size.0.iter().product(),
        urdf_rs::Geometry::Cylinder { radius, length } => PI * radius * radius * length,
        urdf_rs::Geometry::Capsule { radius, length } => {
            PI * radius * radius * (length + 4.0 / 3.0 * radius)
        }
        urdf_rs::Geometry::Sphere { radius } => 4.0 / 3.0 * PI * radius.powi(3),
        urdf_rs::Geometry::Mesh { .. } => 0.0,
    }
}

fn check_links_exist(
    joints: &[urdf_rs::Joint],
    links: &[Link],
    path: &Path,
) -> Result<(), RobotError> {
    for joint in joints {
        for link in [&joint.parent.link, &joint.child.link] {
            if !links.iter().any(|known| known.name == *link) {
                let known: Vec<&str> = links.iter().map(|link| link.name.as_str()).collect();
                return Err(RobotError::UnknownLink {
                    path: path.to_owned(),
                    joint: joint.name.clone(),
                    link: link.clone(),
                    known: known.join(", "),
                });
            }
        }
    }
    Ok(())
}

fn read_moving_joint(joint: &urdf_rs::Joint) -> Option<Joint> {
    let kind = match joint.joint_type {
        urdf_rs::JointType::Revolute => JointKind::Revolute,
        urdf_rs::JointType::Continuous => JointKind::Continuous,
        urdf_rs::JointType::Prismatic => JointKind::Prismatic,
        _ => return None,
    };
    let range = match kind {
        JointKind::Continuous => [f64::NEG_INFINITY, f64::INFINITY],
        _ => [joint.limit.lower, joint.limit.upper],
    };
    Some(Joint {
        name: joint.name.clone(),
        kind,
        parent: joint.parent.link.clone(),
        child: joint.child.link.clone(),
        parent_from_child: isometry(&joint.origin),
        axis: Vector3::from(joint.axis.xyz.0).normalize(),
        range,
        effort: joint.limit.effort,
        velocity: joint.limit.velocity,
    })
}

/// Fuses every child of a fixed joint into its parent.
fn fuse_fixed(joints: &[urdf_rs::Joint], links: &[Link]) -> Vec<Link> {
    let parent_of: HashMap<&str, (&str, Isometry3<f64>)> = joints
        .iter()
        .filter(|joint| joint.joint_type == urdf_rs::JointType::Fixed)
        .map(|joint| {
            let to_parent = (joint.parent.link.as_str(), isometry(&joint.origin));
            (joint.child.link.as_str(), to_parent)
        })
        .collect();
    let mut bodies: Vec<Link> = Vec::new();
    for link in links {
        // A massless root (ROS: `base`) that only carries a fixed joint becomes the first real body.
        let (mut name, mut pose) = (link.name.as_str(), Isometry3::identity());
        while let Some((parent, parent_from_child)) = parent_of.get(name) {
            (name, pose) = (parent, parent_from_child * pose);
        }
        let inertia = link.inertia.seen_from(&pose);
        match bodies.iter_mut().find(|body| body.name == name) {
            Some(body) => {
                body.inertia = body.inertia.fused_with(&inertia);
                body.displaced_volume += link.displaced_volume;
            }
            None => bodies.push(Link {
                name: name.to_owned(),
                inertia,
                displaced_volume: link.displaced_volume,
            }),
        }
    }
    bodies
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const ARM: &str = r#"<robot name="arm">
      <link name="root"/>
      <link name="base"><inertial><origin xyz="0 0 1"/><mass value="2"/>
        <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
        <collision><geometry><box size="1 2 3"/></geometry></collision></link>
      <link name="tip"><inertial><mass value="2"/>
        <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>
        <collision><geometry><sphere radius="0.5"/></geometry></collision></link>
      <link name="rod"><inertial><mass value="1"/>
        <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.3"/></inertial></link>
      <joint name="ground" type="fixed"><parent link="root"/><child link="base"/></joint>
      <joint name="weld" type="fixed"><origin xyz="0 0 -1"/><parent link="base"/><child link="tip"/></joint>
      <joint name="swing" type="revolute"><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><axis xyz="0 2 0"/>
        <parent link="base"/><child link="rod"/><limit lower="-1" upper="2" effort="3" velocity="4"/></joint>
    </robot>"#;

    fn read(text: &str) -> Result<Robot, RobotError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        Robot::from_urdf(file.path())
    }

    #[test]
    fn fixed_links_are_fused_by_the_parallel_axis_theorem() {
        let robot = read(ARM).unwrap();
        let names: Vec<&str> = robot.bodies.iter().map(|body| body.name.as_str()).collect();
        assert_eq!(names, ["root", "rod"]);
        let base = robot.bodies[0].inertia;
        // Two masses of 2 kg at z = +1 and z = -1: centre at 0, ixx = 1 + 2 * 2 * 1^2.
        assert_eq!(base.mass, 4.0);
        assert!(base.centre.norm() < 1e-12);
        assert!((base.tensor[(0, 0)] - 5.0).abs() < 1e-12);
        assert!((base.tensor[(2, 2)] - 1.0).abs() < 1e-12);
        assert!((robot.displaced_volume() - (6.0 + PI / 6.0)).abs() < 1e-12);
        assert_eq!(robot.mass(), 5.0);
    }

    #[test]
    fn a_joint_keeps_its_axis_limits_and_pose() {
        let robot = read(ARM).unwrap();
        let joint = &robot.joints[0];
        assert_eq!(robot.joint_names(), ["swing"]);
        assert_eq!(joint.axis, Vector3::new(0.0, 1.0, 0.0));
        assert_eq!(
            (joint.range, joint.effort, joint.velocity),
            ([-1.0, 2.0], 3.0, 4.0)
        );
        let x_of_child = joint.parent_from_child * Vector3::x();
        assert!((x_of_child - Vector3::y()).norm() < 1e-12);
    }

    #[test]
    fn refusals_say_what_was_found() {
        let heavy = read(&ARM.replace(r#"<mass value="1"/>"#, r#"<mass value="-1"/>"#));
        assert!(
            heavy
                .unwrap_err()
                .to_string()
                .contains("link `rod`: mass -1 kg")
        );
        let adrift = read(&ARM.replace(r#"<child link="rod"/>"#, r#"<child link="rot"/>"#));
        let message = adrift.unwrap_err().to_string();
        assert!(
            message.contains("joint `swing`") && message.contains("links: root, base"),
            "{message}"
        );
        let missing = Robot::from_urdf(Path::new("no/such.urdf")).unwrap_err();
        assert!(missing.to_string().starts_with("no/such.urdf"));
    }
}
