//! The solids of a body.

use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};

use super::{
    overlap::{share_space, shared_volume},
    part::Part,
    shared::Shared,
    solid::Solid,
};

/// The solids that displace water for a body; body frame throughout. What overlapping solids have in common counts twice,
/// unless they are [`Hull::united`].
#[derive(Clone, Debug, Default)]
pub struct Hull {
    solids: Vec<Solid>,
    shared: Option<Arc<Shared>>,
    whole: Part,
}

impl Hull {
    /// A hull of solids that do not overlap.
    pub fn new(solids: Vec<Solid>) -> Self {
        let whole = solids.iter().map(Solid::whole).sum();
        Self {
            solids,
            shared: None,
            whole,
        }
    }

    /// A hull that displaces what is in any of the solids, once.
    ///
    /// The solids stay exact; what two of them share, where it is more than about a hundredth of the smaller one, is known
    /// in cells, to about a hundredth of itself. It counts 4096 points in the box about the smaller of two solids: a share
    /// above 0.01 is found, one below 0.005 is let be.
    pub fn united(solids: Vec<Solid>) -> Self {
        let pairs: Vec<_> = (0..solids.len())
            .flat_map(|second| (0..second).map(move |first| (first, second)))
            .filter(|&(first, second)| share_space(&solids[first], &solids[second]))
            .collect();
        let mut hull = Self::new(solids);
        hull.shared = Shared::of(&hull.solids, &pairs).map(Arc::new);
        if let Some(shared) = &hull.shared {
            hull.whole = hull.whole - shared.whole();
        }
        hull
    }

    /// True where solids share space that counts once.
    pub fn overlaps(&self) -> bool {
        self.shared.is_some()
    }

    /// Volume [m^3] that is in both hulls, to a hundredth of the smaller; `place` takes the other's points to this frame.
    pub fn shares(&self, other: &Self, place: &Isometry3<f64>) -> f64 {
        let moved = other.solids.iter().map(|solid| Solid {
            shape: solid.shape.clone(),
            place: place * solid.place,
        });
        let other = Self::new(moved.collect());
        let box_ = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| {
            let (one, other) = (self.reach(&axis), other.reach(&axis));
            (one.0.max(other.0), one.1.min(other.1))
        });
        if box_.iter().all(|(low, high)| low < high) {
            shared_volume(&self.solids, &other.solids, box_)
        } else {
            0.0
        }
    }

    /// The solids, in the order that they were given.
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// The whole hull.
    pub fn whole(&self) -> Part {
        self.whole
    }

    /// Volume [m^3].
    pub fn volume(&self) -> f64 {
        self.whole.volume
    }

    /// Centre of volume [m]; the origin for a hull without volume.
    pub fn centre(&self) -> Vector3<f64> {
        self.whole.centre().unwrap_or_default()
    }

    /// The part of the hull below a plane: `up` is the plane's unit normal towards the air, and points with
    /// `up.x <= level` [m] are wet.
    pub fn below(&self, up: &Vector3<f64>, level: f64) -> Part {
        let sum: Part = self.solids.iter().map(|solid| solid.below(up, level)).sum();
        match &self.shared {
            Some(shared) => sum - shared.below(up, level),
            None => sum,
        }
    }

    /// Least and greatest coordinate [m] of the hull along a unit vector: their difference is its length there. Zero for a
    /// hull without solids.
    pub fn reach(&self, direction: &Vector3<f64>) -> (f64, f64) {
        let reaches = self.solids.iter().map(|solid| solid.reach(direction));
        reaches
            .reduce(|all, one| (all.0.min(one.0), all.1.max(one.1)))
            .unwrap_or_default()
    }
}
