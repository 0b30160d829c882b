//! Vertices welded and faces matched at their edges: whether a mesh is closed and wound one way.

use std::collections::HashMap;

use super::mesh_error::MeshError;

/// Number of each vertex's first equal, bit for bit but for the sign of zero.
pub(super) fn weld(vertices: &[[f64; 3]]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(vertices.len());
    (0..)
        .zip(vertices)
        .map(|(index, vertex)| {
            // -0 + 0 is +0.
            let bits = vertex.map(|x| (x + 0.0).to_bits());
            *first.entry(bits).or_insert(index)
        })
        .collect()
}

/// An edge of a face, from its lesser to its greater vertex.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct HalfEdge {
    vertices: [u32; 2],
    /// Against the face's turn.
    reversed: bool,
    face: u32,
    side: u8,
}

/// Neighbours of every face, at its edges from corner 0, 1, 2. Every edge must be run as often one way as the other; at an
/// edge of four or more faces any two that do so count as neighbours.
pub(super) fn neighbours(faces: &[[u32; 3]]) -> Result<Vec<[u32; 3]>, MeshError> {
    let mut edges: Vec<HalfEdge> = (0..)
        .zip(faces)
        .flat_map(|(face, corners)| {
            (0..3_u8).map(move |side| {
                let from = corners[usize::from(side)];
                let to = corners[usize::from(side + 1) % 3];
                HalfEdge {
                    vertices: [from.min(to), from.max(to)],
                    reversed: from > to,
                    face,
                    side,
                }
            })
        })
        .collect();
    edges.sort_unstable();

    let mut neighbours = vec![[0; 3]; faces.len()];
    let (mut open, mut turned) = (Vec::new(), Vec::new());
    for edge in edges.chunk_by(|a, b| a.vertices == b.vertices) {
        let (forward, backward) = edge.split_at(edge.partition_point(|half| !half.reversed));
        if edge.len() % 2 == 1 {
            open.push(edge[0]);
        } else if forward.len() != backward.len() {
            turned.push(edge[0]);
        }
        for (a, b) in forward.iter().zip(backward) {
            neighbours[a.face as usize][usize::from(a.side)] = b.face;
            neighbours[b.face as usize][usize::from(b.side)] = a.face;
        }
    }
    if let Some(edge) = open.first() {
        return Err(MeshError::Open {
            edges: open.len(),
            first: edge.vertices,
        });
    }
    if let Some(edge) = turned.first() {
        return Err(MeshError::Winding {
            edges: turned.len(),
            first: edge.vertices,
        });
    }
    Ok(neighbours)
}

/// Shell of every face, the faces that are connected over edges; shells count from zero by their first face.
pub(super) fn shells(neighbours: &[[u32; 3]]) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let mut shell_of = vec![NONE; neighbours.len()];
    let (mut shells, mut stack) = (0, Vec::new());
    for first in 0..neighbours.len() {
        if shell_of[first] != NONE {
            continue;
        }
        stack.push(first);
        while let Some(face) = stack.pop() {
            if shell_of[face] == NONE {
                shell_of[face] = shells;
                stack.extend(neighbours[face].map(|next| next as usize));
            }
        }
        shells += 1;
    }
    shell_of
}
