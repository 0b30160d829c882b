//! The solids of a body.

use nalgebra::Vector3;

use super::{overlap::share_space, part::Part, solid::Solid};

/// The solids that displace water for a body; body frame throughout. Solids that overlap displace their common part
/// twice: [`Hull::overlap`] finds them.
#[derive(Clone, Debug, Default)]
pub struct Hull {
    solids: Vec<Solid>,
    whole: Part,
}

impl Hull {
    /// A hull of solids that do not overlap.
    pub fn new(solids: Vec<Solid>) -> Self {
        let whole = solids.iter().map(Solid::whole).sum();
        Self { solids, whole }
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
        self.solids.iter().map(|solid| solid.below(up, level)).sum()
    }

    /// Least and greatest coordinate [m] of the hull along a unit vector: their difference is its length there. Zero for a
    /// hull without solids.
    pub fn reach(&self, direction: &Vector3<f64>) -> (f64, f64) {
        let reaches = self.solids.iter().map(|solid| solid.reach(direction));
        reaches
            .reduce(|all, one| (all.0.min(one.0), all.1.max(one.1)))
            .unwrap_or_default()
    }

    /// Indices of the first two solids that share more than about a hundredth of the smaller one's volume.
    ///
    /// It counts 4096 points, spread evenly over the box about the smaller solid: a share above 0.01 is found, one below
    /// 0.005 is let be. Solids that touch or dip into each other a little pass.
    pub fn overlap(&self) -> Option<(usize, usize)> {
        let pairs =
            (0..self.solids.len()).flat_map(|second| (0..second).map(move |first| (first, second)));
        pairs
            .into_iter()
            .find(|&(first, second)| share_space(&self.solids[first], &self.solids[second]))
    }
}
