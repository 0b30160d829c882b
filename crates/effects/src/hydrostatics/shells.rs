//! How often a mesh encloses the space under its faces: once, if no shell is inside out or in another.

use nalgebra::Vector3;

use super::{box_tree::BoxTree, mesh_error::MeshError, polyhedron::Facet};

/// Faces of a shell that are looked under.
const PROBES: usize = 256;

/// Directions to count in, before they are turned to a face: a ray that meets an edge counts it twice or not at all, and
/// two of three do not.
const DIRECTIONS: [[f64; 3]; 3] = [
    [0.013_7, 0.021_9, 1.0],
    [-0.173_1, 0.094_3, 1.0],
    [0.108_9, -0.231_7, 1.0],
];

/// How often the surface encloses the space at `origin`, counted along three rays from a distance `from` [m] on.
pub(super) fn times_enclosed(
    origin: &Vector3<f64>,
    towards: &Vector3<f64>,
    from: f64,
    vertices: &[Vector3<f64>],
    facets: &[Facet],
    tree: &BoxTree,
) -> i32 {
    let basis = towards
        .cross(&Vector3::ith(towards.iamin(), 1.0))
        .normalize();
    let mut counts = DIRECTIONS.map(|[x, y, z]| {
        let ray = x * basis + y * towards.cross(&basis) + z * towards;
        let mut count = 0;
        tree.ray(origin, &ray, |facet| {
            let facet = &facets[facet];
            let speed = ray.dot(&facet.normal);
            let time = (facet.offset - facet.normal.dot(origin)) / speed;
            if time > from && holds(facet, &(origin + time * ray), vertices) {
                count += if speed > 0.0 { 1 } else { -1 };
            }
        });
        count
    });
    counts.sort_unstable();
    counts[1]
}

/// Whether a point of a facet's plane is in the facet.
fn holds(facet: &Facet, point: &Vector3<f64>, vertices: &[Vector3<f64>]) -> bool {
    let corners = facet.places(vertices).map(|corner| corner - point);
    (0..3).all(|side| {
        let area = corners[side].cross(&corners[(side + 1) % 3]);
        area.dot(&facet.normal) >= 0.0
    })
}

/// Looks under up to [`PROBES`] evenly chosen faces of every shell: the space there must be enclosed once. Faces within
/// `touch` [m] of the one that is looked under do not count.
pub(super) fn check(
    shell_of: &[u32],
    vertices: &[Vector3<f64>],
    facets: &[Facet],
    tree: &BoxTree,
    touch: f64,
) -> Result<(), MeshError> {
    let shells = shell_of.iter().max().map_or(0, |last| *last as usize + 1);
    let mut faces_of = vec![Vec::new(); shells];
    for (face, shell) in shell_of.iter().enumerate() {
        faces_of[*shell as usize].push(face);
    }
    for faces in faces_of {
        let shell_volume = || -> f64 {
            let cones = faces.iter().map(|face| {
                let [a, b, c] = facets[*face].places(vertices);
                a.dot(&b.cross(&c)) / 6.0
            });
            cones.sum()
        };
        for &face in faces.iter().step_by(faces.len().div_ceil(PROBES)) {
            let facet = &facets[face];
            let Some(inwards) = (-facet.normal).try_normalize(0.0) else {
                continue;
            };
            let [a, b, c] = facet.places(vertices);
            let middle = (a + b + c) / 3.0;
            let times = times_enclosed(&middle, &inwards, touch, vertices, facets, tree);
            if times > 1 {
                return Err(MeshError::Nested { face, times });
            }
            // Under an outward face, none are counted if the shell is thinner than `touch`.
            if times < 1 && shell_volume() < 0.0 {
                return Err(MeshError::InsideOut {
                    face,
                    volume: shell_volume(),
                });
            }
        }
    }
    Ok(())
}
