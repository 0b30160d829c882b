//! Lift of the body: a force across it, in proportion to speed along it times sideslip.

use crate::{
    Card, Effect, Id, Medium, Parameter, Part, Placement, Target, TargetKind,
    dual::{Scalar, constant, real},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, about_origin},
};

/// Lift slope of a wing of aspect ratio one, pi/2, is typical [1].
const TYPICAL: f64 = 1.0;
/// Twice a thin wing's 2 pi [1].
const GREATEST: f64 = 12.0;

/// Parameters `sway`, `heave` [1]: lift slopes, for the planform areas of the extents.
#[derive(Debug)]
pub struct Lift;

static CARD: Card = Card {
    id: Id::Lift,
    phrase: "lift",
    target: TargetKind::Body,
    summary: "force across the body in proportion to speed along it times sideslip",
    equation: "F = (0, -1/2 rho A_y C_sway |u| v, -1/2 rho A_z C_heave |u| w), A_y and A_z the products of the \
               extents in the plane; at the middle of the body; against the sideslip astern too",
    source: "T. Prestero, Verification of a Six-Degree of Freedom Simulation Model for the REMUS AUV, MIT \
             2001, section 4.4 (body lift); S. F. Hoerner, Fluid-Dynamic Lift, 1975, chapter 19",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for Lift {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |_| {
            ["sway", "heave"]
                .into_iter()
                .map(|name| Parameter::about(name, "1", 0.0, TYPICAL).within(-GREATEST, GREATEST))
                .collect()
        })
    }

    fn is_additive(&self) -> bool {
        true
    }

    fn presupposes(&self) -> &'static [Id] {
        Id::DRAGS
    }

    fn medium(&self) -> Medium {
        Medium::Air
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

impl WrenchLaw for Lift {
    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let [u, v, w] = flow.linear_at_middle();
        let [x, y, z] = flow.extent();
        let pressure = -0.5 * flow.density();
        let zero = D::from(0.0);
        let speed = if real(u) < 0.0 { -u } else { u };
        let force = [
            zero,
            p[0] * speed * v * (pressure * x * z),
            p[1] * speed * w * (pressure * x * y),
        ];
        about_origin(force, [zero; 3], constant(flow.middle()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    #[test]
    fn it_is_half_rho_a_c_u_squared_alpha_at_small_angles() {
        let mut motion = fixture::still();
        motion.extent = [0.8, 0.3, 0.2];
        let (speed, alpha) = (1.1, 1e-4);
        motion.linear = [speed, 0.0, speed * alpha];
        let wrench = Lift.wrench(&[0.0, 1.5], &motion, &[]);
        let expected = -0.5 * 1000.0 * 0.24 * 1.5 * speed * speed * alpha;
        assert!((wrench[2] - expected).abs() < 1e-9 * expected.abs());
        motion.linear = [speed, 0.2, 0.0];
        let wrench = Lift.wrench(&[2.0, 1.5], &motion, &[]);
        assert!((wrench[1] + 0.5 * 1000.0 * 0.16 * 2.0 * speed * 0.2).abs() < 1e-9);
        assert_eq!(wrench[2], 0.0);
        motion.linear[0] = -speed;
        assert_eq!(Lift.wrench(&[2.0, 1.5], &motion, &[]), wrench);
    }
}
