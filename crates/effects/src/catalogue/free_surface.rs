//! Drag and added mass that grow towards the free surface as `exp(-depth / length)`.

use nalgebra::Matrix6;

use super::proximity::{self, Boundary};
use crate::{
    Card, Effect, Id, Medium, NearBoundary, Parameter, Part, Placement, Target, TargetKind,
    dual::Scalar,
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw},
};

/// Parameters `linear_drag` [m/s], `quadratic_drag` [1], `added_mass` [1]: growth at the surface; `length` [m]: depth over
/// which it falls to 1/e.
#[derive(Debug)]
pub struct FreeSurface;

static CARD: Card = Card {
    id: Id::FreeSurface,
    phrase: "a free-surface effect",
    target: TargetKind::Body,
    summary: "drag and added mass that grow near the surface",
    equation: "exp(-depth/length) times: drag 1/2 rho A (linear_drag + quadratic_drag |v|) v of strips of the \
               extents, and added_mass times the ellipsoid's added mass with its Lagrangian force",
    source: "J. N. Newman, Marine Hydrodynamics, MIT Press 1977, sections 6.17 and 6.20 (damping and added \
             mass near the surface); H. Lamb, Hydrodynamics, 6th ed. 1932, articles 114, 115 and 136",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for FreeSurface {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, proximity::parameters)
    }

    fn boundary(&self) -> Option<NearBoundary> {
        Some(NearBoundary::FreeSurface)
    }

    fn medium(&self) -> Medium {
        Medium::Water
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

/// Away from the surface is down.
fn surface<D: Scalar>(flow: &Flow<D>) -> Option<Boundary> {
    flow.depth().map(|distance| Boundary {
        distance,
        away: flow.in_body([0.0, 0.0, -1.0]),
    })
}

impl WrenchLaw for FreeSurface {
    const HAS_INERTIA: bool = true;

    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        surface(flow).map_or([D::from(0.0); 6], |surface| {
            proximity::wrench(p, &surface, flow)
        })
    }

    fn added_inertia(&self, p: &Parameters<f64>, flow: &Flow<f64>) -> Option<Matrix6<f64>> {
        surface(flow).map(|surface| proximity::inertia(p, &surface, flow))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    #[test]
    fn it_fades_with_depth_and_is_not_there_in_the_deep() {
        let p = [0.1, 0.5, 0.0, 0.3];
        let mut motion = fixture::still();
        motion.linear = [0.4, 0.0, 0.0];
        let drag = |depth| {
            let mut motion = motion.clone();
            motion.depth = depth;
            FreeSurface.wrench(&p, &motion, &[])[0]
        };
        let area = std::f64::consts::FRAC_PI_4 * motion.extent[1] * motion.extent[2];
        let expected = -0.5 * 1000.0 * area * (0.1 * 0.4 + 0.5 * 0.16);
        assert!((drag(Some(0.0)) - expected).abs() < 1e-9);
        assert!((drag(Some(0.3)) - expected / std::f64::consts::E).abs() < 1e-9);
        assert_eq!(drag(None), 0.0);
    }
}
