//! A robot as described by its URDF: links, moving joints in file order, masses, inertias, limits, displaced volumes.
//!
//! Meshes (a mesh displaces no volume here), transmissions, sensors and materials are not read.

use std::{
    collections::{HashMap, HashSet},
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
    /// If the file is no URDF, its links are no tree, a joint names an unknown link, or a mass or inertia is unphysical.
    pub fn from_urdf(path: &Path) -> Result<Self, RobotError> {
        let unreadable = |reason: String| RobotError::Unreadable {
            path: path.to_owned(),
            reason,
        };
        let text = hydro_files::read_text(path, hydro_files::TEXT)
            .map_err(|error| unreadable(error.to_string()))?;
        if let Some(line) = too_deep(&text) {
            return Err(unreadable(format!(
                "line {line}: more than {DEEPEST} elements inside each other"
            )));
        }
        let urdf = urdf_rs::read_from_string(&text)
            .map_err(|error| unreadable(hydro_files::short(error)))?;
        let links = urdf
            .links
            .iter()
            .map(|link| read_link(link, path))
            .collect::<Result<Vec<_>, _>>()?;
        if let Some(reason) = tree_fault(&urdf.joints, &links) {
            return Err(unreadable(reason));
        }
        check_links_exist(&urdf.joints, &links, path)?;
        if let Some(reason) = urdf.joints.iter().find_map(joint_fault) {
            return Err(unreadable(reason));
        }
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
    let origin = given.origin.xyz.0.iter().chain(&given.origin.rpy.0);
    if let Some(value) = origin.chain(tensor.iter()).find(|value| !value.is_finite()) {
        return Err(unphysical(format!(
            "{value} in its inertial; expected finite numbers"
        )));
    }
    let displaced: f64 = link.collision.iter().map(|c| volume(&c.geometry)).sum();
    if !(displaced.is_finite() && displaced >= 0.0) {
        return Err(unphysical(format!(
            "collision shapes of {displaced} m^3; expected sizes of zero or more"
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
        displaced_volume: displaced,
    })
}

/// Elements inside each other at most: a URDF has five. The reader behind this recurses into them.
const DEEPEST: usize = 64;

/// The line where elements are too deep inside each other. Comments are taken for what they are.
fn too_deep(text: &str) -> Option<usize> {
    let mut depth = 0usize;
    let mut at = 0;
    while let Some(found) = text[at..].find('<') {
        let start = at + found;
        let rest = &text[start..];
        let (end, step) = match rest {
            _ if rest.starts_with("<!--") => ("-->", 0),
            _ if rest.starts_with("<![CDATA[") => ("]]>", 0),
            _ if rest.starts_with("<!") || rest.starts_with("<?") => (">", 0),
            _ if rest.starts_with("</") => (">", -1),
            _ => (">", 1),
        };
        let length = rest.find(end).map_or(rest.len(), |place| place + end.len());
        let closed = rest[..length].ends_with("/>");
        depth = match step {
            1 if !closed => depth + 1,
            -1 => depth.saturating_sub(1),
            _ => depth,
        };
        if depth > DEEPEST {
            return Some(1 + text[..start].matches('\n').count());
        }
        at = start + length;
    }
    None
}

/// Reason why joints and links make no tree: a name twice, a child of two joints, a loop.
fn tree_fault(joints: &[urdf_rs::Joint], links: &[Link]) -> Option<String> {
    let mut seen = HashSet::new();
    if let Some(link) = links.iter().find(|link| !seen.insert(link.name.as_str())) {
        return Some(format!("two links are called `{}`", link.name));
    }
    let mut seen = HashSet::new();
    if let Some(joint) = joints.iter().find(|joint| !seen.insert(&joint.name)) {
        return Some(format!("two joints are called `{}`", joint.name));
    }
    let mut joint_above = HashMap::new();
    for joint in joints {
        let child = joint.child.link.as_str();
        if joint_above.insert(child, joint).is_some() {
            return Some(format!(
                "link `{child}` is the child of two joints; expected a tree"
            ));
        }
    }
    // Links whose way up is known to end.
    let mut rooted = HashSet::new();
    for link in links {
        let (mut way, mut name) = (Vec::new(), link.name.as_str());
        while let Some(joint) = joint_above.get(name).filter(|_| !rooted.contains(name)) {
            if way.len() > links.len() {
                return Some(format!(
                    "link `{name}` stands above itself by joint `{}`; expected a tree",
                    joint.name
                ));
            }
            way.push(name);
            name = joint.parent.link.as_str();
        }
        rooted.extend(way);
    }
    None
}

/// Reason why a joint cannot be used.
fn joint_fault(joint: &urdf_rs::Joint) -> Option<String> {
    let name = &joint.name;
    let pose = joint.origin.xyz.0.iter().chain(&joint.origin.rpy.0);
    if let Some(value) = pose
        .chain(&joint.axis.xyz.0)
        .find(|value| !value.is_finite())
    {
        return Some(format!(
            "joint `{name}`: {value} in its origin or axis; expected finite numbers"
        ));
    }
    let moving = read_moving_joint(joint)?;
    let axis = joint.axis.xyz.0;
    if axis.iter().all(|value| *value == 0.0) || !moving.axis.iter().all(|v| v.is_finite()) {
        return Some(format!(
            "joint `{name}`: axis {axis:?}; expected a direction"
        ));
    }
    let limits = [
        joint.limit.lower,
        joint.limit.upper,
        joint.limit.effort,
        joint.limit.velocity,
    ];
    if limits.iter().any(|value| value.is_nan()) {
        return Some(format!(
            "joint `{name}`: a limit is no number; expected lower, upper, effort and velocity"
        ));
    }
    None
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
                    known: hydro_files::one_line(known.join(", "), 1000),
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
    fn what_is_no_tree_of_finite_numbers_is_refused() {
        let message = |text: &str| read(text).unwrap_err().to_string();
        let ring = ARM.replace(
            "</robot>",
            "<joint name=\"back\" type=\"fixed\"><parent link=\"tip\"/><child link=\"root\"/></joint></robot>",
        );
        let text = message(&ring);
        assert!(text.contains("stands above itself by joint"), "{text}");
        let twice = message(&ARM.replace("name=\"tip\"", "name=\"base\""));
        assert!(twice.contains("two links are called `base`"), "{twice}");
        let two = ARM.replace(
            "</robot>",
            "<joint name=\"more\" type=\"fixed\"><parent link=\"base\"/><child link=\"tip\"/></joint></robot>",
        );
        assert!(message(&two).contains("`tip` is the child of two joints"));
        for (sound, odd, expected) in [
            (
                "radius=\"0.5\"",
                "radius=\"nan\"",
                "collision shapes of NaN m^3",
            ),
            ("radius=\"0.5\"", "radius=\"-1\"", "collision shapes of -"),
            ("xyz=\"0 0 1\"", "xyz=\"0 0 inf\"", "inf in its inertial"),
            ("xyz=\"1 0 0\"", "xyz=\"nan 0 0\"", "joint `swing`: NaN"),
            (
                "<axis xyz=\"0 2 0\"/>",
                "<axis xyz=\"0 0 0\"/>",
                "expected a direction",
            ),
        ] {
            let text = message(&ARM.replace(sound, odd));
            assert!(text.contains(expected), "{text}");
        }
    }

    #[test]
    fn a_deep_file_does_not_reach_the_reader_that_recurses() {
        let deep = format!("<robot name=\"r\">\n{}", "<link>".repeat(100_000));
        let text = read(&deep).unwrap_err().to_string();
        assert!(text.contains("line 2: more than 64 elements"), "{text}");
        let chain: String = (0..3000)
            .map(|i| {
                format!(
                    "<link name=\"l{i}\"/><joint name=\"j{i}\" type=\"fixed\"><parent link=\"l{i}\"/><child link=\"l{}\"/></joint>",
                    i + 1
                )
            })
            .collect();
        read(&format!(
            "<robot name=\"r\"><!-- {} -->{chain}<link name=\"l3000\"/></robot>",
            "<a>".repeat(100)
        ))
        .unwrap();
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
