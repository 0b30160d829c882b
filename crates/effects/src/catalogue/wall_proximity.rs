//! Drag and added mass that grow towards a wall as `exp(-distance / length)`.

use nalgebra::Matrix6;

use super::proximity::{self, Boundary};
use crate::{
    Card, Effect, Id, Medium, NearBoundary, Parameter, Part, Placement, Target, TargetKind,
    dual::Scalar,
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw},
};

/// Parameters `linear_drag` [m/s], `quadratic_drag` [1], `added_mass` [1]: growth at the wall; `length` [m]: distance over
/// which it falls to 1/e.
#[derive(Debug)]
pub struct WallProximity;

static CARD: Card = Card {
    id: Id::WallProximity,
    phrase: "a wall effect",
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
        target.body().map_or_else(Vec::new, proximity::parameters)
    }

    fn boundary(&self) -> Option<NearBoundary> {
        Some(NearBoundary::Wall)
    }

    fn medium(&self) -> Medium {
        Medium::Water
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

impl WrenchLaw for WallProximity {
    const HAS_INERTIA: bool = true;

    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
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
    use crate::tests::fixture;

    #[test]
    fn moving_along_a_wall_the_body_is_drawn_to_it() {
        let mut motion = fixture::still();
        motion.wall = Some((0.2, [0.0, 1.0, 0.0]));
        motion.linear = [0.5, 0.0, 0.0];
        let (factor, length) = (0.8, 0.4);
        let wrench = WallProximity.wrench(&[0.0, 0.0, factor, length], &motion, &[]);
        let mass = WallProximity
            .inertia(&[0.0, 0.0, factor, length], &motion)
            .expect("there is a wall")[(0, 0)];
        assert!(mass > 0.0);
        assert!((wrench[1] + 0.5 * mass * 0.25 / length).abs() < 1e-9);
    }
}
