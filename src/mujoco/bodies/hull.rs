//! The hull of a body or robot: which geoms it is made of, their closed shapes, and how much of them is under water.

use std::{
    collections::HashMap,
    hash::{DefaultHasher, Hasher},
    sync::Arc,
};

use parking_lot::Mutex;

use hydro_effects::hydrostatics::{Hull, Mesh, MeshError, Shape, Solid};
use nalgebra::Isometry3;

use super::joint_space::{pose, rotation, vector};
use crate::{
    mujoco::ffi::{
        DataView, ModelView,
        bindings::{
            mjGEOM_BOX, mjGEOM_CAPSULE, mjGEOM_CYLINDER, mjGEOM_ELLIPSOID, mjGEOM_MESH,
            mjGEOM_SPHERE, mjOBJ_GEOM,
        },
    },
    plugin::{BodyHull, native_fluid::EllipsoidCoefficients, sea::Sea},
};

/// Certainty that a geom is part of the hull, rather than of the looks laid over it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum PartOfHull {
    /// Nothing says so.
    Perhaps,
    /// It is in group 3, where MuJoCo's models keep what is not for the eye.
    ByGroup,
    /// MuJoCo's ellipsoid fluid acts on it.
    ByFluid,
    /// The attribute `hull` names it.
    Named,
}

fn part_of_hull(model: ModelView<'_>, geom: usize, named: Option<&[String]>) -> Option<PartOfHull> {
    if let Some(named) = named {
        let name = model.name(mjOBJ_GEOM as i32, geom);
        return named.contains(&name).then_some(PartOfHull::Named);
    }
    Some(match model.geom_group()[geom] {
        _ if model.geom_fluid()[EllipsoidCoefficients::LEN * geom] > 0.0 => PartOfHull::ByFluid,
        3 => PartOfHull::ByGroup,
        _ => PartOfHull::Perhaps,
    })
}

/// The geoms that show where the water is, with their bodies: those of these names; else those that MuJoCo's ellipsoid
/// fluid acts on, else group 3, else all. Only the most certain count: looks lie over the hull, and would be counted twice.
pub(crate) fn geoms(
    model: ModelView<'_>,
    bodies: impl Iterator<Item = usize>,
    named: Option<&[String]>,
) -> Vec<(usize, usize)> {
    let known: Vec<(PartOfHull, usize, usize)> = bodies
        .flat_map(|body| model.geoms(body).map(move |geom| (body, geom)))
        .filter_map(|(body, geom)| Some((part_of_hull(model, geom, named)?, body, geom)))
        .collect();
    let surest = known.iter().map(|(part, ..)| *part).max();
    known
        .into_iter()
        .filter(|(part, ..)| Some(*part) == surest)
        .map(|(_, body, geom)| (body, geom))
        .collect()
}

/// The closed shape of a geom; `None` for one that encloses nothing (a plane, a height field).
///
/// # Errors
/// A mesh that does not enclose a volume.
pub(crate) fn shape(model: ModelView<'_>, geom: usize) -> Result<Option<Shape>, MeshError> {
    let [a, b, c] = ModelView::triple(model.geom_size(), geom);
    let kind = model.geom_type()[geom] as u32;
    Ok(Some(match kind {
        _ if kind == mjGEOM_SPHERE => Shape::Sphere { radius: a },
        _ if kind == mjGEOM_ELLIPSOID => Shape::Ellipsoid {
            semi_axes: [a, b, c],
        },
        _ if kind == mjGEOM_BOX => Shape::Box { half: [a, b, c] },
        _ if kind == mjGEOM_CYLINDER => Shape::Cylinder {
            radius: a,
            half_length: b,
        },
        _ if kind == mjGEOM_CAPSULE => Shape::Capsule {
            radius: a,
            half_length: b,
        },
        _ if kind == mjGEOM_MESH => Shape::Mesh(mesh(model, geom)?),
        _ => return Ok(None),
    }))
}

/// The closed shape of a geom, or the ellipsoid that fits a mesh that encloses no volume.
pub(crate) fn shape_or_ellipsoid(model: ModelView<'_>, geom: usize) -> Option<Shape> {
    shape(model, geom).unwrap_or_else(|_| {
        // A mesh geom's sizes are the half sizes of its box.
        Some(Shape::Ellipsoid {
            semi_axes: ModelView::triple(model.geom_size(), geom),
        })
    })
}

/// Vertices [m], three numbers each, and triangles, three vertices each, of a mesh; empty where there is none.
fn numbers<'a>(model: ModelView<'a>, mesh: i32) -> (&'a [f32], &'a [i32]) {
    let Ok(mesh) = usize::try_from(mesh) else {
        return (&[], &[]);
    };
    let part = |start: &[i32], count: &[i32]| {
        let start = 3 * start[mesh].max(0) as usize;
        start..start + 3 * count[mesh].max(0) as usize
    };
    let vertices = part(model.mesh_vertadr(), model.mesh_vertnum());
    let faces = part(model.mesh_faceadr(), model.mesh_facenum());
    (&model.mesh_vert()[vertices], &model.mesh_face()[faces])
}

/// Meshes kept; more are read anew.
const MOST_MESHES: usize = 256;

type Checked = Result<Arc<Mesh>, MeshError>;

/// The mesh of a geom. A mesh is checked once in this process, however many models have it.
fn mesh(model: ModelView<'_>, geom: usize) -> Checked {
    static KNOWN: Mutex<Option<HashMap<u64, Checked>>> = Mutex::new(None);
    let (vertices, faces) = numbers(model, model.geom_dataid()[geom]);
    let mut hasher = DefaultHasher::new();
    for number in vertices {
        hasher.write_u32(number.to_bits());
    }
    for index in faces {
        hasher.write_i32(*index);
    }
    let key = hasher.finish();
    if let Some(mesh) = KNOWN.lock().as_ref().and_then(|known| known.get(&key)) {
        return mesh.clone();
    }
    let vertices: Vec<[f64; 3]> = vertices
        .as_chunks::<3>()
        .0
        .iter()
        .map(|vertex| vertex.map(f64::from))
        .collect();
    let faces: Vec<[u32; 3]> = faces
        .as_chunks::<3>()
        .0
        .iter()
        .map(|face| face.map(|corner| corner as u32))
        .collect();
    let made = Mesh::new(&vertices, &faces).map(Arc::new);
    let mut known = KNOWN.lock();
    let known = known.get_or_insert_default();
    if known.len() >= MOST_MESHES {
        known.clear();
    }
    known.insert(key, made.clone());
    made
}

/// Pose of a geom in its body.
pub(crate) fn place(model: ModelView<'_>, geom: usize) -> Isometry3<f64> {
    pose(
        ModelView::triple(model.geom_pos(), geom),
        ModelView::quadruple(model.geom_quat(), geom),
    )
}

/// The hull of some geoms in the frame of a body, from the poses of the geoms' bodies in it.
pub(crate) fn hull(
    model: ModelView<'_>,
    geoms: &[(usize, usize)],
    pose: impl Fn(usize) -> Isometry3<f64>,
) -> Hull {
    let solids = geoms.iter().filter_map(|(body, geom)| {
        Some(Solid {
            shape: shape_or_ellipsoid(model, *geom)?,
            place: pose(*body) * place(model, *geom),
        })
    });
    united(solids.collect())
}

/// Hulls kept; more are united anew.
const MOST_HULLS: usize = 256;

/// The union of solids. It is made once in this process, however many bodies have it: points are counted for it.
fn united(solids: Vec<Solid>) -> Hull {
    static KNOWN: Mutex<Option<HashMap<Vec<u64>, Hull>>> = Mutex::new(None);
    if solids.len() < 2 {
        return Hull::new(solids);
    }
    let key: Vec<u64> = solids.iter().flat_map(numbers_of).collect();
    let known = || KNOWN.lock();
    if let Some(hull) = known().as_ref().and_then(|known| known.get(&key)) {
        return hull.clone();
    }
    let made = Hull::united(solids);
    let mut known = known();
    let known = known.get_or_insert_default();
    if known.len() >= MOST_HULLS {
        known.clear();
    }
    known.insert(key, made.clone());
    made
}

/// Numbers that tell a solid from others. A mesh is told by its address: whoever keeps the numbers keeps the solid.
fn numbers_of(solid: &Solid) -> impl Iterator<Item = u64> + use<> {
    let (kind, sizes) = match &solid.shape {
        Shape::Sphere { radius } => (0, [*radius, 0.0, 0.0]),
        Shape::Ellipsoid { semi_axes } => (1, *semi_axes),
        Shape::Box { half } => (2, *half),
        Shape::Cylinder {
            radius,
            half_length,
        } => (3, [*radius, *half_length, 0.0]),
        Shape::Capsule {
            radius,
            half_length,
        } => (4, [*radius, *half_length, 0.0]),
        Shape::Mesh(mesh) => (Arc::as_ptr(mesh) as u64, [0.0; 3]),
    };
    let place = solid.place.to_matrix();
    let numbers: Vec<f64> = sizes.into_iter().chain(place.iter().copied()).collect();
    std::iter::once(kind).chain(numbers.into_iter().map(f64::to_bits))
}

/// The hulls of a robot's bodies, from `root` on, each in its body's frame.
pub(crate) fn hulls(model: ModelView<'_>, root: usize, named: Option<&[String]>) -> Vec<BodyHull> {
    let links = (root..model.bodies()).filter(|link| model.hangs_below(*link, root));
    let geoms = geoms(model, links, named);
    let mut hulls: Vec<BodyHull> = Vec::new();
    for group in geoms.chunk_by(|one, other| one.0 == other.0) {
        let body = group[0].0;
        hulls.push(BodyHull {
            body,
            hull: hull(model, group, |_| Isometry3::identity()),
        });
    }
    hulls
}

/// Part (0..=1) of a fully submerged robot's force that is left: that of its volume below the surface, if there is one.
pub(crate) fn submerged_part(data: &DataView<'_>, hulls: &[BodyHull], sea: &Sea) -> f64 {
    match sea.waterline {
        Some(_) => submerged_fraction(data, hulls, sea),
        None => 1.0,
    }
}

/// Submerged part (0..=1) of hulls; 1 where they have no volume.
fn submerged_fraction(data: &DataView<'_>, hulls: &[BodyHull], sea: &Sea) -> f64 {
    let (mut wet, mut all) = (0.0, 0.0);
    for BodyHull { body, hull } in hulls {
        let frame = rotation(data.xmat(), *body);
        let origin = vector(data.xpos(), *body);
        let Some(surface) = sea.surface(origin + frame * hull.centre(), data.time()) else {
            return 1.0;
        };
        let (up, level) = surface.in_frame(&frame, &origin);
        wet += hull.below(&up, level).volume;
        all += hull.volume();
    }
    if all > 0.0 { wet / all } else { 1.0 }
}
