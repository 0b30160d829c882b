//! Steady current: constant velocity of the water.

use super::axes;
use crate::{
    Card, Effect, Id, Medium, Parameter, Part, Placement, Target, TargetKind, WaterPart,
    flow::SPEEDS,
};

/// No tank and hardly a sea is faster [m/s].
const FASTEST: f64 = 5.0;

/// Parameters `x`, `y`, `z` [m/s]: velocity of the water in the world.
#[derive(Debug)]
pub struct Current;

static CARD: Card = Card {
    id: Id::Current,
    phrase: "a water current",
    target: TargetKind::Body,
    summary: "constant velocity of the water",
    equation: "nu_r = nu - (R^T v_c, 0), v_c constant in the world",
    source: "T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, \
             section 10.3 (irrotational ocean current)",
    idealised: false,
    placement: Placement::Plugin,
};

impl Effect for Current {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            axes::vector("m/s", [scale.typical_speed(); 3], [FASTEST; 3])
                .map(|component| component.physically(SPEEDS))
                .collect()
        })
    }

    fn medium(&self) -> Medium {
        Medium::Air
    }

    fn differs_by_trial(&self) -> bool {
        true
    }

    fn part(&self) -> Part<'_> {
        Part::Water(self)
    }
}

impl WaterPart for Current {
    fn velocity(&self, p: &[f64], _position: [f64; 3], _time: f64) -> [f64; 3] {
        [0, 1, 2].map(|axis| p.get(axis).copied().unwrap_or(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_same_everywhere_and_always() {
        let p = [0.1, -0.2, 0.3];
        assert_eq!(Current.velocity(&p, [0.0; 3], 0.0), p);
        assert_eq!(Current.velocity(&p, [5.0, 1.0, -2.0], 7.0), p);
        assert_eq!(Current.acceleration(&p, [0.0; 3], 1.0), [0.0; 3]);
    }
}
