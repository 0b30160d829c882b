//! Hydrostatics: the weight of the displaced water, at the centre of the part of the hull that is under water.

use super::axes;
use crate::{
    Card, Effect, Id, Medium, NearBoundary, Parameter, Part, Physical, Placement, Target,
    TargetKind,
    dual::Scalar,
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw},
};

/// Bound of a fit, in volumes of the hull's geoms: a frame of thin parts holds foam that no geom shows.
const GREATEST: f64 = 10.0;

/// Parameter `volume` [m^3]: what the whole hull displaces; a file that leaves it out means the geoms' own.
///
/// The submerged part is that of the hull's geoms at the present attitude, [`crate::Motion::upthrust`]; `volume` scales it.
/// Waterplane stiffness, metacentric height and righting arm follow from the geoms and need no parameters.
#[derive(Debug)]
pub struct Hydrostatics;

static CARD: Card = Card {
    id: Id::Hydrostatics,
    phrase: "hydrostatics",
    target: TargetKind::Body,
    summary: "buoyancy of the part of the hull that is under water: floats, rights itself, surfaces",
    equation: "F = rho volume / V integral over the submerged part of the hull (a_w - g) dV, V the hull's whole volume, a_w the \
               acceleration of the attribute `waves`; at the centre of that part",
    source: "T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, \
             section 4.2 (hydrostatics of surface vessels); J. N. Newman, Marine Hydrodynamics, MIT Press 1977, \
             sections 6.16 and 6.21",
    idealised: false,
    placement: Placement::Plugin,
};

impl Effect for Hydrostatics {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            let volume = scale.typical_hull_volume();
            vec![
                Parameter::about("volume", "m^3", 0.0, volume)
                    .within(0.0, GREATEST * volume)
                    .physically(Physical::NotNegative)
                    .left_out_as(volume),
            ]
        })
    }

    fn is_additive(&self) -> bool {
        true
    }

    fn is_of_every_fluid(&self) -> bool {
        true
    }

    fn boundary(&self) -> Option<NearBoundary> {
        Some(NearBoundary::FreeSurface)
    }

    fn needs_waterline(&self) -> bool {
        true
    }

    fn medium(&self) -> Medium {
        Medium::Water
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

impl WrenchLaw for Hydrostatics {
    const DEPENDS_ON_VELOCITY: bool = false;

    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let upthrust = flow.upthrust();
        axes::SIX.map(|axis| p[0] * (flow.density() * upthrust[axis]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    #[test]
    fn it_weighs_as_much_as_the_water_that_the_hull_displaces() {
        let mut motion = fixture::still();
        // Half under water, its centre 5 cm below the origin.
        motion.upthrust = [0.0, 0.0, 0.5 * 9.81, 0.05 * 0.5 * 9.81, 0.0, 0.0];
        let wrench = Hydrostatics.wrench(&[0.02], &motion, &[]);
        assert!((wrench[2] - 0.5 * 0.02 * 1000.0 * 9.81).abs() < 1e-12);
        assert!((wrench[3] - 0.05 * wrench[2]).abs() < 1e-12);
        motion.upthrust = [0.0; 6];
        assert_eq!(Hydrostatics.wrench(&[0.02], &motion, &[]), [0.0; 6]);
    }

    #[test]
    fn a_file_may_leave_the_volume_to_the_hull() {
        let known = Hydrostatics.parameters(&fixture::target(TargetKind::Body));
        assert_eq!(known[0].left_out, Some(fixture::still().volume));
    }
}
