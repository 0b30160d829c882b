//! The water around effects, as the attributes of their instance give it.

use std::sync::Arc;

use hydro_effects::potential_flow::PotentialFlow;

use crate::plugin::sea::Sea;

/// The water around the effects.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surroundings {
    /// Density of the water [kg/m^3], where the instance says one.
    pub(crate) density: Option<f64>,
    /// Its surface, waves and current.
    pub(crate) sea: Sea,
    /// Velocity of the water beside them [m/s].
    pub(crate) current: [f64; 3],
    /// Potential flow about the carrying body.
    pub(crate) potential_flow: Option<Arc<PotentialFlow>>,
    /// Names of the geoms that displace water.
    pub(crate) hull: Option<Vec<String>>,
    /// Notes for the user on the sea.
    pub(crate) notes: Vec<String>,
    /// The carrying body, where there is an instance.
    pub(crate) carrier: Option<Carrier>,
    /// True for a hypothesis of `hydro gap`: commands are changed before the step, and not by a difference of force; the waves are
    /// the nominal's.
    pub(crate) is_hypothesis: bool,
}

/// The body that carries the instance, and its displacement where the attributes give it in place of its hull's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Carrier {
    pub(crate) body: usize,
    /// Volume [m^3].
    pub(crate) volume: Option<f64>,
    /// Centre of buoyancy, body frame [m].
    pub(crate) centre: Option<[f64; 3]>,
}

impl Surroundings {
    /// True where waves of its own push what displaces water; a hypothesis of `hydro gap` moves in its nominal's.
    pub(super) fn moves_in_waves(&self) -> bool {
        self.sea.waves.is_some() && !self.is_hypothesis
    }

    /// Volume of the hull of a body [m^3], where it is given.
    pub(super) fn given_volume(&self, body: usize) -> Option<f64> {
        let given = self.carrier.filter(|given| given.body == body)?;
        given.volume
    }

    /// Centre of buoyancy of a body, in its frame [m], where it is given.
    pub(super) fn given_centre(&self, body: usize) -> Option<[f64; 3]> {
        let given = self.carrier.filter(|given| given.body == body)?;
        given.centre
    }
}

impl Carrier {
    /// True where the attributes give some of it.
    pub(super) fn is_something(&self) -> bool {
        self.volume.is_some() || self.centre.is_some()
    }
}
