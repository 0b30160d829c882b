//! Thrust loss with inflow: `T = T_nominal max(1 - slope u_a, 0)`, u_a the speed of advance [m/s].

use crate::{
    ActuatorPart, Card, Effect, Id, Medium, Parameter, Part, Physical, Placement, Target,
    TargetKind,
};

/// Steepest loss: a thruster that stops at a tenth of a millimetre a second is off [s/m].
const STEEPEST: f64 = 1e4;

/// Parameter `slope` [s/m].
#[derive(Debug)]
pub struct InflowThrustLoss;

static CARD: Card = Card {
    id: Id::InflowThrustLoss,
    phrase: "a thrust loss with inflow",
    target: TargetKind::Actuator,
    summary: "thrust that falls as the thruster advances into its inflow",
    equation: "T = T_nominal max(1 - slope max(u_a, 0), 0); u_a: speed of advance through the water along \
               the thrust that is being given",
    source: "T. I. Fossen, Handbook of marine craft hydrodynamics and motion control, Wiley, 2011, on \
             thrusters (T = T_nn n|n| - T_nu |n| u_a); R. Bachmayer, L. L. Whitcomb, M. A. Grosenbaugh, An \
             accurate four-quadrant nonlinear dynamical model for marine thrusters, IEEE Journal of Oceanic \
             Engineering 25(1), 2000",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for InflowThrustLoss {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Actuator(actuator) = target else {
            return Vec::new();
        };
        // At the typical inflow a third of the thrust, one in three times more.
        let inflow = if actuator.inflow > 0.0 {
            actuator.inflow
        } else {
            0.5
        };
        vec![
            Parameter::about("slope", "s/m", 0.0, 0.3 / inflow)
                .within(0.0, STEEPEST)
                .physically(Physical::NotNegative),
        ]
    }

    fn applies_to(&self, target: &Target) -> bool {
        matches!(target, Target::Actuator(actuator) if actuator.thrusts)
    }

    fn medium(&self) -> Medium {
        Medium::Air
    }

    fn part(&self) -> Part<'_> {
        Part::Actuator(self)
    }
}

impl ActuatorPart for InflowThrustLoss {
    /// Never below zero: a thruster that is overrun gives no thrust, and does not pull.
    fn force_factor(&self, p: &[f64], inflow: f64) -> f64 {
        (1.0 - p[0] * inflow.max(0.0)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_only_takes_thrust_away(slope in 0.0..5.0, inflow in -3.0..3.0) {
            let factor = InflowThrustLoss.force_factor(&[slope], inflow);
            prop_assert!((0.0..=1.0).contains(&factor));
            prop_assert!(InflowThrustLoss.force_factor(&[slope], inflow + 0.1) <= factor);
        }

        #[test]
        fn its_derivative_by_the_slope_is_the_inflow(slope in 0.1..0.3, inflow in 0.0..2.0) {
            let h = 1e-6;
            let by = (InflowThrustLoss.force_factor(&[slope + h], inflow) - InflowThrustLoss.force_factor(&[slope - h], inflow))
                / (2.0 * h);
            prop_assert!((by + inflow).abs() < 1e-8);
        }
    }

    #[test]
    fn none_and_still_water_change_nothing() {
        assert_eq!(InflowThrustLoss.force_factor(&[0.0], 2.0), 1.0);
        assert_eq!(InflowThrustLoss.force_factor(&[0.4], -1.0), 1.0);
    }
}
