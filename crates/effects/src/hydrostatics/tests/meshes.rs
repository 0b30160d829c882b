//! Which meshes are refused, and what the others displace.

use super::*;
use crate::hydrostatics::{LARGEST_COORDINATE, MOST_FACES, MeshError};

type Triangles = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// A box of 12 triangles.
fn cuboid(low: [f64; 3], high: [f64; 3]) -> Triangles {
    let vertices = (0..8)
        .map(|corner| {
            [0, 1, 2].map(|k| {
                if corner >> k & 1 == 1 {
                    high[k]
                } else {
                    low[k]
                }
            })
        })
        .collect();
    let faces = vec![
        [1, 3, 7],
        [1, 7, 5],
        [0, 4, 6],
        [0, 6, 2],
        [2, 6, 7],
        [2, 7, 3],
        [0, 1, 5],
        [0, 5, 4],
        [4, 5, 7],
        [4, 7, 6],
        [0, 2, 3],
        [0, 3, 1],
    ];
    (vertices, faces)
}

fn both(one: Triangles, other: Triangles) -> Triangles {
    let (mut vertices, mut faces) = one;
    let first = vertices.len() as u32;
    vertices.extend(other.0);
    faces.extend(other.1.iter().map(|face| face.map(|corner| corner + first)));
    (vertices, faces)
}

fn inside_out((vertices, faces): Triangles) -> Triangles {
    (
        vertices,
        faces.into_iter().map(|[a, b, c]| [a, c, b]).collect(),
    )
}

fn mesh((vertices, faces): Triangles) -> Result<Mesh, MeshError> {
    Mesh::new(&vertices, &faces)
}

fn refused(triangles: Triangles) -> MeshError {
    mesh(triangles).unwrap_err()
}

fn unit_box() -> Triangles {
    cuboid([0.0; 3], [1.0; 3])
}

#[test]
fn nothing_is_refused() {
    assert_eq!(refused((vec![], vec![])), MeshError::Empty);
    assert_eq!(
        refused((vec![[0.0; 3]; 3], vec![[0, 1, 2]])),
        MeshError::Empty
    );
}

#[test]
fn numbers_that_are_none_are_refused() {
    let (mut vertices, faces) = unit_box();
    vertices[3][1] = f64::NAN;
    let MeshError::NotFinite { vertex: 3, found } = refused((vertices.clone(), faces.clone()))
    else {
        panic!("not refused");
    };
    assert!(found[1].is_nan());
    vertices[3][1] = 2.0 * LARGEST_COORDINATE;
    let error = refused((vertices, faces));
    assert!(
        matches!(error, MeshError::TooFar { vertex: 3, .. }),
        "{error}"
    );
    assert!(error.to_string().contains("scale the mesh to metres"));
}

#[test]
fn a_face_of_a_vertex_that_is_not_there_is_refused() {
    let (vertices, mut faces) = unit_box();
    faces[5][2] = 8;
    let expected = MeshError::UnknownVertex {
        face: 5,
        found: 8,
        vertices: 8,
    };
    assert_eq!(refused((vertices, faces)), expected);
}

#[test]
fn too_many_faces_are_refused() {
    let faces = vec![[0, 1, 2]; MOST_FACES + 1];
    let expected = MeshError::TooLarge {
        faces: MOST_FACES + 1,
    };
    assert_eq!(refused((vec![[0.0; 3]; 3], faces)), expected);
}

#[test]
fn a_hole_is_refused() {
    let (vertices, mut faces) = unit_box();
    faces.pop();
    let expected = MeshError::Open {
        edges: 3,
        first: [0, 1],
    };
    let error = refused((vertices, faces));
    assert_eq!(error, expected);
    assert!(error.to_string().contains("fill its holes"), "{error}");
    // A face too many leaves its edges with three.
    let (vertices, mut faces) = unit_box();
    faces.push(faces[11]);
    assert_eq!(refused((vertices, faces)), expected);
}

#[test]
fn faces_that_turn_opposite_ways_are_refused() {
    let (vertices, mut faces) = unit_box();
    faces[4].swap(0, 1);
    let error = refused((vertices, faces));
    assert!(
        matches!(error, MeshError::Winding { edges: 3, .. }),
        "{error}"
    );
}

#[test]
fn a_flat_mesh_is_refused() {
    let square = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let faces = vec![[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]];
    let error = refused((square, faces));
    assert!(matches!(error, MeshError::Flat { .. }), "{error}");
    // A millimetre of a metre is a solid.
    assert!(mesh(cuboid([0.0; 3], [1.0, 1.0, 1e-3])).is_ok());
    assert!(mesh(cuboid([0.0; 3], [1.0, 1.0, 1e-7])).is_ok());
}

#[test]
fn inside_out_is_refused() {
    let expected = MeshError::InsideOut {
        face: 0,
        volume: -1.0,
    };
    let MeshError::InsideOut { face: 0, volume } = refused(inside_out(unit_box())) else {
        panic!("{expected}");
    };
    assert!((volume + 1.0).abs() < 1e-15);
    // One of two shells.
    let pair = both(cuboid([3.0; 3], [5.0; 3]), inside_out(unit_box()));
    let error = refused(pair);
    assert!(
        matches!(error, MeshError::InsideOut { face: 12, .. }),
        "{error}"
    );
}

#[test]
fn shells_that_cut_each_other_are_refused() {
    let shifts = [
        [0.5, 0.5, 0.5],
        [0.4, 0.3, 0.2],
        [0.5, 0.0, 0.0],
        [0.5, 0.5, 0.0],
        [0.0; 3],
    ];
    for shift in shifts {
        let other = cuboid(shift, shift.map(|x| x + 1.0));
        let error = refused(both(unit_box(), other));
        assert!(
            matches!(
                error,
                MeshError::SelfCrossing { .. } | MeshError::Nested { .. }
            ),
            "{shift:?}: {error}"
        );
    }
    let through = cuboid([0.2, 0.3, -1.0], [0.7, 0.8, 2.0]);
    let error = refused(both(unit_box(), through));
    let MeshError::SelfCrossing {
        faces: [one, other],
    } = error
    else {
        panic!("{error}");
    };
    assert!(one < 12 && other >= 12);
    // Fine and round.
    let ball = |at: f64| {
        let surface = Surface::new(&Shape::Sphere { radius: 1.0 }, 0.05);
        let vertices = surface.vertices.iter().map(|v| [v.x + at, v.y, v.z]);
        (vertices.collect(), surface.faces)
    };
    assert!(mesh(both(ball(0.0), ball(2.1))).is_ok());
    for at in [1.95, 1.0, 0.1] {
        let error = refused(both(ball(0.0), ball(at)));
        assert!(
            matches!(error, MeshError::SelfCrossing { .. }),
            "{at}: {error}"
        );
    }
}

#[test]
fn a_surface_that_folds_through_itself_is_refused() {
    // A rod of six rings whose last ring is pushed through its first end and out of its side.
    let surface = Surface::new(
        &Shape::Cylinder {
            radius: 0.1,
            half_length: 0.5,
        },
        0.1,
    );
    let mut vertices: Vec<[f64; 3]> = surface.vertices.iter().map(|v| (*v).into()).collect();
    assert!(Mesh::new(&vertices, &surface.faces).is_ok());
    for vertex in &mut vertices {
        if vertex[2] > 0.45 {
            vertex[0] += 0.25;
            vertex[2] -= 0.8;
        } else if vertex[2] > 0.35 {
            vertex[0] += 0.25;
        }
        if vertex[2] < -0.35 {
            vertex[0] += 0.2;
        }
    }
    let error = refused((vertices, surface.faces));
    assert!(matches!(error, MeshError::SelfCrossing { .. }), "{error}");
}

#[test]
fn a_shell_in_a_shell_is_refused_and_a_cavity_is_not() {
    let (outer, inner) = (cuboid([-1.0; 3], [2.0; 3]), unit_box());
    let error = refused(both(outer.clone(), inner.clone()));
    assert_eq!(error, MeshError::Nested { face: 12, times: 2 });
    let hollow = mesh(both(outer, inside_out(inner))).unwrap();
    assert!((hollow.volume() - 26.0).abs() < 1e-13);
    let hollow = Shape::Mesh(Arc::new(hollow));
    assert!(hollow.contains(&Vector3::new(1.5, 0.1, 0.2)));
    assert!(!hollow.contains(&Vector3::new(0.5, 0.4, 0.3)));
}

#[test]
fn shells_may_touch() {
    let beside = both(unit_box(), cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]));
    let lower = both(unit_box(), cuboid([1.0, 0.2, 0.0], [2.0, 0.7, 0.6]));
    let rounded = both(unit_box(), cuboid([1.0 - 1e-7, 0.0, 0.0], [2.0, 1.0, 1.3]));
    // Half a right angle turned about y, one of its faces on the unit box's upper rim.
    let (leaning, faces) = cuboid([0.0, 0.2, -0.5], [1.0, 0.7, 0.5]);
    let root = std::f64::consts::FRAC_1_SQRT_2;
    let leaning = leaning
        .iter()
        .map(|[x, y, z]| [1.0 + root * (x - z), *y, 1.0 + root * (x + z)]);
    let leaning = both(unit_box(), (leaning.collect(), faces));
    for (pair, volume) in [(beside, 2.0), (lower, 1.3), (rounded, 2.3), (leaning, 1.5)] {
        let found = mesh(pair).unwrap().volume();
        assert!((found - volume).abs() < 1e-6, "{found}");
    }
}

#[test]
fn a_mesh_without_shared_vertices_is_welded() {
    let (vertices, faces) = unit_box();
    let mut loose: Vec<[f64; 3]> = faces
        .iter()
        .flatten()
        .map(|corner| vertices[*corner as usize])
        .collect();
    loose[0][1] = -0.0;
    let mut numbers: Vec<[u32; 3]> = (0..12)
        .map(|face| [3 * face, 3 * face + 1, 3 * face + 2])
        .collect();
    // A face between two places.
    numbers.push([0, 1, 0]);
    let welded = mesh((loose, numbers)).unwrap();
    assert_eq!((welded.vertices().len(), welded.faces().len()), (8, 12));
    assert!((welded.volume() - 1.0).abs() < 1e-15);
    assert!((welded.whole().centre().unwrap() - Vector3::from_element(0.5)).norm() < 1e-15);
}

#[test]
fn an_angle_is_two_boxes() {
    let mesh = Shape::Mesh(Arc::new(angle()));
    let boxes = [
        ([0.5, 0.5, 0.15], [0.6, 0.3, -0.25]),
        ([0.15, 0.5, 0.35], [0.25, 0.3, 0.25]),
    ];
    let hull = crate::hydrostatics::Hull::new(
        boxes
            .iter()
            .map(|(half, at)| crate::hydrostatics::Solid {
                shape: Shape::Box { half: *half },
                place: Isometry3::from(Vector3::from(*at)),
            })
            .collect(),
    );
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    for _ in 0..500 {
        use proptest::strategy::ValueTree;
        let (up, share) = (unit(), -1.0..1.0).new_tree(&mut runner).unwrap().current();
        let level = level_at(&mesh, &up, share);
        assert_close(
            &mesh.below(&up, level),
            &hull.below(&up, level),
            0.51,
            1.0,
            1e-14,
        );
    }
}

#[test]
fn far_from_its_origin_a_mesh_keeps_its_digits() {
    let at = Vector3::new(1024.0, -2048.0, 512.0);
    let near = angle();
    let vertices: Vec<[f64; 3]> = near.vertices().map(|v| (v + at).into()).collect();
    let faces: Vec<_> = near.faces().collect();
    let far = Mesh::new(&vertices, &faces).unwrap();
    let (near, far) = (Shape::Mesh(Arc::new(near)), Shape::Mesh(Arc::new(far)));
    let up = Vector3::new(0.28, -0.6, 0.75).normalize();
    for level in [-0.4, -0.1, 0.3] {
        let expected = near.below(&up, level).shifted(&at);
        let found = far.below(&up, level + up.dot(&at));
        // What the level has lost: 2e-13 of 2000.
        assert!((found.volume - expected.volume).abs() < 1e-12);
        assert!((found.moment - expected.moment).norm() < 3e-9);
    }
}
