//! Drag and added mass that grow near a wall.

use nalgebra::Matrix6;

use super::{
    Card, Effect, Id, Parameter, Part, Placement, Target, TargetKind,
    body_scale::body,
    flow::Flow,
    law::{Law, Parameters, Scalar},
    proximity::{self, Boundary},
};

/// The effect. Parameters `linear_drag` [m/s], `quadratic_drag` [1], `added_mass` [1], `length` [m]:
/// at the wall, how much drag and added mass grow by, and the distance over which that falls to 1/e.
#[derive(Debug)]
pub struct WallProximity;

/// The one in the catalogue.
pub static EFFECT: WallProximity = WallProximity;

static CARD: Card = Card {
    id: Id::WallProximity,
    target: TargetKind::Body,
    summary: "drag and added mass that grow near a wall, which draws the body to itself",
    equation: "exp(-distance/length) times: drag 1/2 rho A (linear_drag + quadratic_drag |v|) v of strips of \
               the extents, and added_mass times the ellipsoid's added mass with its Lagrangian force",
    source: "H. Lamb, Hydrodynamics, 6th ed. 1932, articles 98, 99 and 137 (sphere near a wall); J. Happel and \
             H. Brenner, Low Reynolds Number Hydrodynamics, 1965, chapter 7",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for WallProximity {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        body(target).map_or_else(Vec::new, proximity::parameters)
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

fn wall<D: Scalar>(flow: &Flow<D>) -> Option<Boundary> {
    flow.wall().map(|(distance, normal)| Boundary {
        distance,
        away: flow.in_body(normal),
    })
}

impl Law for WallProximity {
    const INERT: bool = true;

    fn law<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        wall(flow).map_or([D::from(0.0); 6], |wall| proximity::wrench(p, &wall, flow))
    }

    fn added_inertia(&self, p: &Parameters<f64>, flow: &Flow<f64>) -> Option<Matrix6<f64>> {
        wall(flow).map(|wall| proximity::inertia(p, &wall, flow))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyPart;
    use crate::fixture;

    #[test]
    fn moving_along_a_wall_the_body_is_drawn_to_it() {
        let mut motion = fixture::still();
        motion.wall = Some((0.2, [0.0, 1.0, 0.0]));
        motion.linear = [0.5, 0.0, 0.0];
        let (factor, length) = (0.8, 0.4);
        let wrench = EFFECT.wrench(&[0.0, 0.0, factor, length], &motion, &[]);
        let mass = EFFECT
            .inertia(&[0.0, 0.0, factor, length], &motion)
            .expect("there is a wall")[(0, 0)];
        assert!(mass > 0.0);
        assert!((wrench[1] + 0.5 * mass * 0.25 / length).abs() < 1e-9);
    }
}
