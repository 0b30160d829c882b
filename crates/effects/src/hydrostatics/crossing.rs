//! Whether triangles of a mesh cut each other.

use std::ops::ControlFlow;

use nalgebra::Vector3;

use super::{box_tree::BoxTree, polyhedron::Facet};

/// Facets of a closed surface, which are neighbours, and the distance [m] that counts as touching.
pub(super) struct FacetGraph<'a> {
    pub(super) vertices: &'a [Vector3<f64>],
    pub(super) facets: &'a [Facet],
    /// Neighbours of every facet at its edges.
    pub(super) neighbours: &'a [[u32; 3]],
    pub(super) touch: f64,
}

impl FacetGraph<'_> {
    /// The first two facets found to cut each other. Facets that share a vertex are not compared, and faces that touch,
    /// or dip into each other by no more than `touch`, do not cut.
    pub(super) fn crossing(&self, tree: &BoxTree) -> Option<[usize; 2]> {
        let found = tree.pairs(|one, other| {
            let (a, b) = (&self.facets[one].corners, &self.facets[other].corners);
            if a.iter().all(|corner| !b.contains(corner))
                && (self.edges_pierce(one, other) || self.edges_pierce(other, one))
            {
                ControlFlow::Break([one.min(other), one.max(other)])
            } else {
                ControlFlow::Continue(())
            }
        });
        found.break_value()
    }

    fn edges_pierce(&self, one: usize, other: usize) -> bool {
        let corners = self.corners(one);
        (0..3).any(|side| self.pierces(&corners[side], &corners[(side + 1) % 3], other))
    }

    fn corners(&self, facet: usize) -> [Vector3<f64>; 3] {
        self.facets[facet].places(self.vertices)
    }

    /// Distances [m] of two points from a facet's plane where they lie on opposite sides of it, neither touching.
    fn sides(&self, p: &Vector3<f64>, q: &Vector3<f64>, facet: usize) -> Option<(f64, f64)> {
        let facet = &self.facets[facet];
        let length = facet.normal.norm();
        let distance = |x: &Vector3<f64>| (facet.normal.dot(x) - facet.offset) / length;
        let (above, below) = (distance(p), distance(q));
        // False for a facet without area.
        let apart = above.abs().min(below.abs()) > self.touch && above * below < 0.0;
        apart.then_some((above, below))
    }

    /// Whether an edge goes through a facet. On the facet's rim it must go through the neighbour there as well: it then
    /// passes the surface, and does not merely touch it.
    fn pierces(&self, p: &Vector3<f64>, q: &Vector3<f64>, facet: usize) -> bool {
        let Some((above, below)) = self.sides(p, q, facet) else {
            return false;
        };
        let at = p + (q - p) * (above / (above - below));
        let corners = self.corners(facet);
        let normal = self.facets[facet].normal.normalize();
        (0..3).all(|side| {
            let edge = corners[(side + 1) % 3] - corners[side];
            let length = edge.norm();
            let inwards = normal.cross(&edge).dot(&(at - corners[side])) / length;
            if length == 0.0 || inwards < -self.touch {
                return false;
            }
            inwards > self.touch || {
                let neighbour = self.neighbours[facet][side] as usize;
                self.sides(p, q, neighbour)
                    .is_some_and(|(there, _)| there * above > 0.0)
            }
        })
    }
}
