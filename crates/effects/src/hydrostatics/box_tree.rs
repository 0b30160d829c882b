//! Tree of bounding boxes over triangles: which pairs may touch, which triangles a ray may meet, and which a plane.

use std::ops::{Add, ControlFlow, Range};

use nalgebra::Vector3;

/// Triangles of a leaf.
const LEAF: usize = 4;

/// Axis-aligned box.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: Vector3<f64>,
    high: Vector3<f64>,
}

impl Bounds {
    fn around(points: &[Vector3<f64>; 3]) -> Self {
        let [a, b, c] = points;
        Self {
            low: a.inf(b).inf(c),
            high: a.sup(b).sup(c),
        }
    }

    fn joined(&self, other: &Self) -> Self {
        Self {
            low: self.low.inf(&other.low),
            high: self.high.sup(&other.high),
        }
    }

    fn meets(&self, other: &Self) -> bool {
        (0..3).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }

    /// Least and greatest height of the box above a plane.
    fn heights(&self, up: &Vector3<f64>, level: f64) -> [f64; 2] {
        let centre = 0.5 * up.dot(&(self.low + self.high)) - level;
        let half = 0.5 * up.abs().dot(&(self.high - self.low));
        [centre - half, centre + half]
    }

    /// Whether a ray meets the box; `inverse` is one over the ray's direction.
    fn meets_ray(&self, origin: &Vector3<f64>, inverse: &Vector3<f64>) -> bool {
        let (mut first, mut last) = (0.0_f64, f64::INFINITY);
        for k in 0..3 {
            let near = (self.low[k] - origin[k]) * inverse[k];
            let far = (self.high[k] - origin[k]) * inverse[k];
            first = first.max(near.min(far));
            last = last.min(near.max(far));
        }
        first <= last
    }
}

/// A piece of a tree that is not above a plane.
pub(super) enum Wet {
    /// All triangles of a node.
    Subtree(usize),
    /// A triangle that the plane may cut.
    Triangle(usize),
}

/// A node; its left child stands next to it.
#[derive(Clone, Debug)]
struct Node {
    bounds: Bounds,
    /// Places in `order`.
    start: u32,
    end: u32,
    /// Right child; zero for a leaf.
    right: u32,
}

impl Node {
    fn places(&self) -> Range<usize> {
        self.start as usize..self.end as usize
    }

    fn is_leaf(&self) -> bool {
        self.right == 0
    }

    /// Left and right child of this node, which is number `at`.
    fn children(&self, at: usize) -> (usize, usize) {
        (at + 1, self.right as usize)
    }
}

/// A binary tree over triangles.
#[derive(Clone, Debug)]
pub(super) struct BoxTree {
    nodes: Vec<Node>,
    order: Vec<u32>,
    /// Box of each place in `order`.
    bounds: Vec<Bounds>,
}

impl BoxTree {
    /// A tree over triangles given by their corners.
    pub(super) fn new(triangles: impl Iterator<Item = [Vector3<f64>; 3]>) -> Self {
        let mut items: Vec<(u32, Bounds)> = (0..)
            .zip(triangles.map(|corners| Bounds::around(&corners)))
            .collect();
        let mut nodes = Vec::with_capacity(items.len());
        if !items.is_empty() {
            split(&mut nodes, &mut items, 0);
        }
        let (order, bounds) = items.into_iter().unzip();
        Self {
            nodes,
            order,
            bounds,
        }
    }

    /// Visits every pair of triangles whose boxes meet, until the visitor breaks.
    pub(super) fn pairs<B>(
        &self,
        mut visit: impl FnMut(usize, usize) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let mut stack = Vec::new();
        if !self.nodes.is_empty() {
            stack.push((0, 0));
        }
        while let Some((a, b)) = stack.pop() {
            let (one, other) = (&self.nodes[a], &self.nodes[b]);
            if a == b && !one.is_leaf() {
                let (left, right) = one.children(a);
                stack.extend([(left, left), (right, right), (left, right)]);
            } else if !one.bounds.meets(&other.bounds) {
                continue;
            } else if one.is_leaf() && other.is_leaf() {
                for i in one.places() {
                    let others = if a == b {
                        i + 1..other.places().end
                    } else {
                        other.places()
                    };
                    for j in others {
                        if self.bounds[i].meets(&self.bounds[j]) {
                            visit(self.order[i] as usize, self.order[j] as usize)?;
                        }
                    }
                }
            } else if other.is_leaf()
                || !one.is_leaf() && one.places().len() >= other.places().len()
            {
                let (left, right) = one.children(a);
                stack.extend([(left, b), (right, b)]);
            } else {
                let (left, right) = other.children(b);
                stack.extend([(a, left), (a, right)]);
            }
        }
        ControlFlow::Continue(())
    }

    /// A sum over the triangles of every node.
    pub(super) fn sums<S: Copy + Add<Output = S>>(&self, of: impl Fn(usize) -> S) -> Vec<S> {
        let mut sums: Vec<Option<S>> = vec![None; self.nodes.len()];
        // Children stand behind their parents. Every leaf has a triangle, so every node a sum.
        for (at, node) in self.nodes.iter().enumerate().rev() {
            sums[at] = match node.is_leaf() {
                true => {
                    let triangles = self.order[node.places()].iter();
                    triangles
                        .map(|of_node| of(*of_node as usize))
                        .reduce(S::add)
                }
                false => {
                    let (left, right) = node.children(at);
                    sums[left]
                        .zip(sums[right])
                        .map(|(left, right)| left + right)
                }
            };
        }
        sums.into_iter().flatten().collect()
    }

    /// Visits what is not above a plane: points with `up.x <= level` are below it.
    pub(super) fn below(&self, up: &Vector3<f64>, level: f64, mut visit: impl FnMut(Wet)) {
        if !self.nodes.is_empty() {
            self.below_in(0, up, level, &mut visit);
        }
    }

    fn below_in(&self, at: usize, up: &Vector3<f64>, level: f64, visit: &mut impl FnMut(Wet)) {
        let node = &self.nodes[at];
        let [lowest, highest] = node.bounds.heights(up, level);
        if lowest > 0.0 {
            return;
        }
        if highest <= 0.0 {
            visit(Wet::Subtree(at));
        } else if node.is_leaf() {
            for place in node.places() {
                visit(Wet::Triangle(self.order[place] as usize));
            }
        } else {
            let (left, right) = node.children(at);
            self.below_in(left, up, level, visit);
            self.below_in(right, up, level, visit);
        }
    }

    /// Visits every triangle whose box a ray meets.
    pub(super) fn ray(
        &self,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        mut visit: impl FnMut(usize),
    ) {
        let inverse = direction.map(|d| 1.0 / d);
        let mut stack = Vec::new();
        if !self.nodes.is_empty() {
            stack.push(0);
        }
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at];
            if !node.bounds.meets_ray(origin, &inverse) {
                continue;
            }
            if node.is_leaf() {
                for place in node.places() {
                    if self.bounds[place].meets_ray(origin, &inverse) {
                        visit(self.order[place] as usize);
                    }
                }
            } else {
                let (left, right) = node.children(at);
                stack.extend([left, right]);
            }
        }
    }
}

/// Appends the tree over `items`, which stand from place `start` on, and sorts them into its order.
fn split(nodes: &mut Vec<Node>, items: &mut [(u32, Bounds)], start: u32) {
    let Some(bounds) = items
        .iter()
        .map(|(_, bounds)| *bounds)
        .reduce(|all, one| all.joined(&one))
    else {
        return;
    };
    let at = nodes.len();
    nodes.push(Node {
        bounds,
        start,
        end: start + items.len() as u32,
        right: 0,
    });
    if items.len() <= LEAF {
        return;
    }
    let axis = (bounds.high - bounds.low).imax();
    let middle = items.len() / 2;
    let centre = |bounds: &Bounds| bounds.low[axis] + bounds.high[axis];
    items.select_nth_unstable_by(middle, |(_, a), (_, b)| centre(a).total_cmp(&centre(b)));
    let (left, right) = items.split_at_mut(middle);
    split(nodes, left, start);
    nodes[at].right = nodes.len() as u32;
    split(nodes, right, start + middle as u32);
}
