//! Errors of closed meshes.

use thiserror::Error;

/// Most faces of a mesh.
pub const MOST_FACES: usize = 1_000_000;
/// Greatest coordinate of a mesh [m].
pub const LARGEST_COORDINATE: f64 = 1e6;

/// A mesh cannot displace water. Faces and vertices are counted from zero, in the order that they were given.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum MeshError {
    /// No faces, or none with three different corners.
    #[error("the mesh has no faces, expected a closed surface; export it again as triangles")]
    Empty,
    /// More faces than can be afforded.
    #[error("the mesh has {faces} faces, at most {MOST_FACES}; decimate it")]
    TooLarge { faces: usize },
    /// A coordinate that is infinite or not a number.
    #[error("vertex {vertex} is {found:?}, expected finite numbers; export the mesh again")]
    NotFinite { vertex: usize, found: [f64; 3] },
    /// A coordinate beyond any hull.
    #[error(
        "vertex {vertex} is {found:?} [m], expected coordinates of at most {LARGEST_COORDINATE:e} m; \
         scale the mesh to metres"
    )]
    TooFar { vertex: usize, found: [f64; 3] },
    /// A face that names a vertex which is not there.
    #[error(
        "face {face} names vertex {found}, but the mesh has {vertices} vertices, from 0; export it again"
    )]
    UnknownVertex {
        face: usize,
        found: u32,
        vertices: usize,
    },
    /// Edges that bound a hole.
    #[error(
        "{edges} edges have a face on one side only, the first from vertex {} to vertex {}; expected a closed \
         surface; fill its holes and merge vertices that nearly meet",
        first[0], first[1]
    )]
    Open { edges: usize, first: [u32; 2] },
    /// Neighbours that face opposite sides.
    #[error(
        "the faces at {edges} edges turn opposite ways, the first from vertex {} to vertex {}; expected all corners \
         counterclockwise from outside; make the normals consistent",
        first[0], first[1]
    )]
    Winding { edges: usize, first: [u32; 2] },
    /// No volume.
    #[error("the mesh encloses {volume:e} m^3, expected a solid; give it thickness")]
    Flat { volume: f64 },
    /// A shell whose faces look inwards, and that is no cavity of another.
    #[error(
        "the shell of face {face} faces inwards (its volume is {volume:e} m^3), expected corners counterclockwise from \
         outside; flip its normals"
    )]
    InsideOut { face: usize, volume: f64 },
    /// Two faces that cut each other.
    #[error(
        "faces {} and {} cut each other, expected a surface that does not; unite the parts of the mesh (boolean union)",
        faces[0], faces[1]
    )]
    SelfCrossing { faces: [usize; 2] },
    /// A shell in another.
    #[error(
        "the space under face {face} is enclosed {times} times, expected once; delete the inner shell, or unite the \
         parts of the mesh (boolean union)"
    )]
    Nested { face: usize, times: i32 },
}
