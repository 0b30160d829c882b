//! A robot as described by its URDF: links, moving joints in file order, masses, inertias, limits, displaced volumes.
//!
//! Meshes (a mesh displaces no volume here), transmissions, sensors and materials are not read.

use std::{
    collections::{HashMap, HashSet},
    f64::consts::PI,
    path::{Path, PathBuf},
};

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};
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

impl Link {
    /// False where a number overflowed.
    fn is_finite(&self) -> bool {
        let Inertia {
            mass,
            centre,
            tensor,
        } = &self.inertia;
        let mut numbers = centre.iter().chain(tensor.iter());
        mass.is_finite()
            && self.displaced_volume.is_finite()
            && numbers.all(|number| number.is_finite())
    }
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
        let text = plain(&text).map_err(unreadable)?;
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
        if let Some(body) = bodies.iter().find(|body| !body.is_finite()) {
            return Err(RobotError::Unphysical {
                path: path.to_owned(),
                link: body.name.clone(),
                what: "with what is fixed to it, an inertia or a volume beyond all numbers"
                    .to_owned(),
            });
        }
        let robot = Self {
            name: urdf.name,
            links,
            joints,
            bodies,
        };
        if !(robot.mass().is_finite() && robot.displaced_volume().is_finite()) {
            return Err(unreadable(
                "the links together have a mass or a volume beyond all numbers".to_owned(),
            ));
        }
        Ok(robot)
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
    let sizes = link.collision.iter().flat_map(|c| sizes(&c.geometry));
    if let Some(size) = sizes.into_iter().find(|size| size.is_nan() || *size < 0.0) {
        return Err(unphysical(format!(
            "a collision shape with a size of {size} m; expected zero or more"
        )));
    }
    let displaced: f64 = link.collision.iter().map(|c| volume(&c.geometry)).sum();
    if !displaced.is_finite() {
        return Err(unphysical(format!(
            "collision shapes of {displaced} m^3; expected a finite volume"
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

/// Elements inside each other at most: a URDF has five. The readers behind this recurse into them.
const DEEPEST: usize = 64;

/// The elements of a file and their attributes alone, written anew; a file that is no XML, has a `<!DOCTYPE>` or too many
/// elements inside each other is refused. The readers behind this take what is malformed, or an instruction with a `?`
/// inside, for other elements than stand there: by these a deep file passes for a flat one.
fn plain(text: &str) -> Result<String, String> {
    let document = Document::parse(text).map_err(hydro_files::short)?;
    let deep = |node: &Node<'_, '_>| node.ancestors().nth(DEEPEST + 1).is_some();
    if let Some(node) = document.descendants().find(deep) {
        let line = document.text_pos_at(node.range().start).row;
        return Err(format!(
            "line {line}: more than {DEEPEST} elements inside each other"
        ));
    }
    let mut plain = String::with_capacity(text.len());
    write_plain(document.root_element(), &mut plain);
    Ok(plain)
}

/// Writes an element and those inside it.
fn write_plain(element: Node<'_, '_>, out: &mut String) {
    let name = element.tag_name().name();
    out.push('<');
    out.push_str(name);
    for attribute in element.attributes() {
        out.push(' ');
        out.push_str(attribute.name());
        out.push_str("=\"");
        for c in attribute.value().chars() {
            match c {
                '&' => out.push_str("&amp;"),
                '<' => out.push_str("&lt;"),
                '"' => out.push_str("&quot;"),
                c => out.push(c),
            }
        }
        out.push('"');
    }
    out.push('>');
    for inside in element.children().filter(Node::is_element) {
        write_plain(inside, out);
    }
    out.push_str("</");
    out.push_str(name);
    out.push('>');
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
    // The square of a number beyond 1e154 is infinite, that of one below 1e-162 zero.
    let is_direction = (moving.axis.norm() - 1.0).abs() < 1e-6;
    if !is_direction {
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

/// Sizes of a primitive shape [m].
fn sizes(geometry: &urdf_rs::Geometry) -> Vec<f64> {
    match geometry {
        urdf_rs::Geometry::Box { size } => size.0.to_vec(),
        urdf_rs::Geometry::Cylinder { radius, length }
        | urdf_rs::Geometry::Capsule { radius, length } => vec![*radius, *length],
        urdf_rs::Geometry::Sphere { radius } => vec![*radius],
        urdf_rs::Geometry::Mesh { .. } => Vec::new(),
    }
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
    let names: HashSet<&str> = links.iter().map(|link| link.name.as_str()).collect();
    for joint in joints {
        for link in [&joint.parent.link, &joint.child.link] {
            if !names.contains(link.as_str()) {
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
    let mut places: HashMap<&str, usize> = HashMap::new();
    // The body that a link is part of, and the link's pose in it.
    let mut known: HashMap<&str, (&str, Isometry3<f64>)> = HashMap::new();
    for link in links {
        // A massless root (ROS: `base`) that only carries a fixed joint becomes the first real body.
        let (mut way, mut name) = (Vec::new(), link.name.as_str());
        while let Some((parent, _)) = parent_of.get(name).filter(|_| !known.contains_key(name)) {
            way.push(name);
            name = parent;
        }
        let (body, mut pose) = known
            .get(name)
            .copied()
            .unwrap_or((name, Isometry3::identity()));
        for below in way.into_iter().rev() {
            pose *= parent_of[below].1;
            known.insert(below, (body, pose));
        }
        let inertia = link.inertia.seen_from(&pose);
        match places.get(body) {
            Some(place) => {
                let body = &mut bodies[*place];
                body.inertia = body.inertia.fused_with(&inertia);
                body.displaced_volume += link.displaced_volume;
            }
            None => {
                places.insert(body, bodies.len());
                bodies.push(Link {
                    name: body.to_owned(),
                    inertia,
                    displaced_volume: link.displaced_volume,
                });
            }
        }
    }
    bodies
}

#[cfg(test)]
mod tests;
