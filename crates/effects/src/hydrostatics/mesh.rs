//! A closed triangle mesh.

use std::{
    fmt,
    hash::{DefaultHasher, Hasher},
};

use nalgebra::Vector3;

use super::{
    box_tree::BoxTree,
    crossing::FacetGraph,
    edges,
    mesh_error::{LARGEST_COORDINATE, MOST_FACES, MeshError},
    part::Part,
    polyhedron::{self, Facet, Sums},
    shells,
};

/// Faces nearer than this [extents] touch and do not cut: twenty times the rounding of single precision.
const TOUCH: f64 = 1e-6;
/// Volume [extents^3] that counts as none.
const FLAT: f64 = 1e-12;

/// A closed triangle mesh that encloses every point once or not at all: convex or not, in one or several shells, with or
/// without cavities (which displace nothing). Its own frame [m].
#[derive(Clone)]
pub struct Mesh {
    /// Middle of the bounding box.
    middle: Vector3<f64>,
    /// Vertices relative to the middle, each place once.
    vertices: Vec<Vector3<f64>>,
    facets: Vec<Facet>,
    tree: BoxTree,
    /// Sums over the facets of each node of the tree.
    sums: Vec<Sums>,
    /// Whole, in the mesh's frame.
    whole: Part,
    /// Radius of a ball about the middle, and of one about the origin.
    ball: f64,
    bounding_radius: f64,
}

/// Counts and a hash of its numbers, in place of thousands of lines.
impl fmt::Debug for Mesh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut hasher = DefaultHasher::new();
        for number in self.middle.iter().chain(self.vertices.iter().flatten()) {
            hasher.write_u64(number.to_bits());
        }
        for corner in self.faces().flatten() {
            hasher.write_u32(corner);
        }
        f.debug_struct("Mesh")
            .field("vertices", &self.vertices.len())
            .field("faces", &self.facets.len())
            .field("hash", &hasher.finish())
            .finish_non_exhaustive()
    }
}

impl Mesh {
    /// A mesh from vertices [m] and faces, corners counterclockwise from outside. Vertices at the same place count as one,
    /// faces with two equal corners as none.
    ///
    /// Faces may touch but not cut each other: cuts deeper than 1e-6 of the mesh's extent are found, except between faces
    /// that share a vertex. Takes about 15 ms for 20 000 faces.
    pub fn new(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> Result<Self, MeshError> {
        if faces.len() > MOST_FACES {
            return Err(MeshError::TooLarge { faces: faces.len() });
        }
        check_numbers(vertices, faces)?;
        let (faces, given) = merged(vertices, faces);
        if faces.is_empty() {
            return Err(MeshError::Empty);
        }
        let neighbours = edges::neighbours(&faces)?;

        let (vertices, faces) = compact(vertices, &faces);
        let bound = |of: fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>| {
            let corners = vertices.iter().copied();
            corners
                .reduce(|all, one| of(&all, &one))
                .unwrap_or_default()
        };
        let (low, high) = (bound(Vector3::inf), bound(Vector3::sup));
        let (middle, extent) = (0.5 * (low + high), (high - low).norm());
        let bounding_radius = vertices.iter().map(Vector3::norm).fold(0.0, f64::max);
        let vertices: Vec<_> = vertices.iter().map(|vertex| vertex - middle).collect();
        let facets: Vec<_> = faces
            .iter()
            .map(|corners| Facet::new(*corners, &vertices))
            .collect();

        let whole = polyhedron::whole(&vertices, &facets);
        if whole.volume.abs() <= FLAT * extent.powi(3) {
            return Err(MeshError::Flat {
                volume: whole.volume,
            });
        }
        let tree = BoxTree::new(facets.iter().map(|facet| facet.places(&vertices)));
        let mesh = Self {
            middle,
            sums: tree.sums(|facet| Sums::of(&facets[facet], &vertices)),
            tree,
            whole: whole.shifted(&middle),
            ball: vertices.iter().map(Vector3::norm).fold(0.0, f64::max),
            bounding_radius,
            vertices,
            facets,
        };
        mesh.check(&neighbours, TOUCH * extent)
            .map_err(|error| in_given_order(error, &given))?;
        Ok(mesh)
    }

    /// Check that no faces cut each other and no space is enclosed but once.
    fn check(&self, neighbours: &[[u32; 3]], touch: f64) -> Result<(), MeshError> {
        let graph = FacetGraph {
            vertices: &self.vertices,
            facets: &self.facets,
            neighbours,
            touch,
        };
        if let Some(faces) = graph.crossing(&self.tree) {
            return Err(MeshError::SelfCrossing { faces });
        }
        let shell_of = edges::shells(neighbours);
        shells::check(&shell_of, &self.vertices, &self.facets, &self.tree, touch)?;
        if self.whole.volume < 0.0 {
            return Err(MeshError::InsideOut {
                face: 0,
                volume: self.whole.volume,
            });
        }
        Ok(())
    }

    /// The whole mesh.
    pub fn whole(&self) -> Part {
        self.whole
    }

    /// Volume [m^3].
    pub fn volume(&self) -> f64 {
        self.whole.volume
    }

    /// Vertices [m], each place once.
    pub fn vertices(&self) -> impl ExactSizeIterator<Item = Vector3<f64>> {
        self.vertices.iter().map(|vertex| vertex + self.middle)
    }

    /// Corners of the faces that have three different ones, numbers of [`Mesh::vertices`].
    pub fn faces(&self) -> impl ExactSizeIterator<Item = [u32; 3]> {
        self.facets.iter().map(|facet| facet.corners)
    }

    /// The part below a plane, as [`super::Shape::below`].
    pub(super) fn below(&self, up: &Vector3<f64>, level: f64) -> Part {
        let level = level - up.dot(&self.middle);
        let tree = (&self.tree, &self.sums[..]);
        polyhedron::below(&self.vertices, &self.facets, tree, up, level).shifted(&self.middle)
    }

    /// Least and greatest coordinate along a unit vector [m].
    pub(super) fn reach(&self, direction: &Vector3<f64>) -> (f64, f64) {
        let middle = direction.dot(&self.middle);
        let heights = self.vertices.iter().map(|vertex| direction.dot(vertex));
        let (low, high) = heights
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), height| {
                (low.min(height), high.max(height))
            });
        (middle + low, middle + high)
    }

    /// Bounds of the reach, those of a ball [m].
    pub(super) fn ball_reach(&self, direction: &Vector3<f64>) -> (f64, f64) {
        let middle = direction.dot(&self.middle);
        (middle - self.ball, middle + self.ball)
    }

    /// Radius of a ball about the origin that holds the mesh [m].
    pub(super) fn bounding_radius(&self) -> f64 {
        self.bounding_radius
    }

    /// Whether a point of the mesh's frame is in the mesh.
    pub(super) fn contains(&self, point: &Vector3<f64>) -> bool {
        let point = point - self.middle;
        let z = Vector3::z();
        shells::times_enclosed(&point, &z, 0.0, &self.vertices, &self.facets, &self.tree) > 0
    }
}

fn check_numbers(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> Result<(), MeshError> {
    for (vertex, &found) in vertices.iter().enumerate() {
        if !found.iter().all(|x| x.is_finite()) {
            return Err(MeshError::NotFinite { vertex, found });
        }
        if found.iter().any(|x| x.abs() > LARGEST_COORDINATE) {
            return Err(MeshError::TooFar { vertex, found });
        }
    }
    for (face, corners) in faces.iter().enumerate() {
        for &found in corners {
            if found as usize >= vertices.len() {
                return Err(MeshError::UnknownVertex {
                    face,
                    found,
                    vertices: vertices.len(),
                });
            }
        }
    }
    Ok(())
}

/// Faces that have three different corners, each corner the first vertex at its place, and the number of each as given.
fn merged(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> (Vec<[u32; 3]>, Vec<usize>) {
    let first = edges::weld(vertices);
    faces
        .iter()
        .map(|corners| corners.map(|corner| first[corner as usize]))
        .enumerate()
        .filter(|(_, [a, b, c])| a != b && b != c && c != a)
        .map(|(face, corners)| (corners, face))
        .unzip()
}

/// The vertices that faces have, and the faces in their numbers.
fn compact(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    const NONE: u32 = u32::MAX;
    let mut number = vec![NONE; vertices.len()];
    let mut kept = Vec::new();
    let faces = faces
        .iter()
        .map(|corners| {
            corners.map(|corner| {
                let number = &mut number[corner as usize];
                if *number == NONE {
                    *number = kept.len() as u32;
                    kept.push(Vector3::from(vertices[corner as usize]));
                }
                *number
            })
        })
        .collect();
    (kept, faces)
}

/// The error with faces in the numbers that they were given.
fn in_given_order(error: MeshError, given: &[usize]) -> MeshError {
    match error {
        MeshError::InsideOut { face, volume } => MeshError::InsideOut {
            face: given[face],
            volume,
        },
        MeshError::SelfCrossing { faces } => MeshError::SelfCrossing {
            faces: faces.map(|face| given[face]),
        },
        MeshError::Nested { face, times } => MeshError::Nested {
            face: given[face],
            times,
        },
        other => other,
    }
}
