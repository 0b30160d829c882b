//! A fin or rudder: lift and drag of a thin foil at any angle of attack, with stall.

use crate::{
    Card, Effect, Id, Medium, Parameter, Part, Physical, Placement, Target, TargetKind,
    dual::{Scalar, cross, real, sum},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, about_origin},
};

/// Coefficient of the normal force of a plate across the flow, side ratio 1 to 5 [1].
const PLATE: f64 = 1.2;
/// Sharpness of the stall [1/rad]: from 12 to 88 % of it within 2.3 degrees.
const SHARPNESS: f64 = 50.0;
/// Below this speed [m/s] there is no angle of attack.
const STILL: f64 = 1e-9;
/// Typical lift slope [1/rad], zero-lift drag and induced drag [1] of a fin of side ratio 2.
const TYPICAL: [f64; 3] = [3.0, 0.01, 0.2];
/// Typical angle of stall: 17 degrees [rad].
const STALL: f64 = 0.3;
/// Greatest values of a fit: twice a thin foil's slope [1/rad]; drags [1].
const GREATEST: [f64; 3] = [12.0, 2.0, 2.0];

/// Parameters `area` [m^2], `lift_slope` [1/rad], `stall` [rad], `drag` and `induced` [1], and the centre of pressure
/// `x`, `y`, `z` [m], body frame.
///
/// The chord lies along the body's x, its leading edge towards +x, the span along y: the foil lifts along z. A fin that
/// turns is a body of its own on a hinge; a fixed one may be an empty child with its pose. Flow along the span is without
/// effect.
#[derive(Debug)]
pub struct Fin;

static CARD: Card = Card {
    id: Id::Fin,
    phrase: "a fin",
    target: TargetKind::Body,
    summary: "lift and drag of a thin foil at its angle of attack, with stall",
    equation: "L = 1/2 rho area V^2 C_L across the flow, D = 1/2 rho area V^2 C_D against it, V^2 = u^2 + w^2 and alpha = atan2(w, \
               u) at (x, y, z); C_L = (1 - s) lift_slope alpha + 1.2 s sin^2 alpha cos alpha sign(alpha), C_D = drag + (1 - s) \
               induced (lift_slope alpha)^2 + 1.2 s |sin alpha|^3, s from 0 to 1 about |alpha| = stall",
    source: "R. W. Beard, T. W. McLain, Small Unmanned Aircraft, Princeton 2012, section 4.2.1 (blend with a flat plate); S. F. \
             Hoerner, Fluid-Dynamic Drag, 1965, chapter 3 (plates); L. F. Whicker, L. F. Fehlner, DTMB Report 933, 1958 (rudders)",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for Fin {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            let [x, y, z] = scale.extent;
            let sides = (x * y).max(x * z).max(y * z);
            let area = if sides > 0.0 { sides } else { 1.0 };
            let length = x.max(y).max(z).max(1e-3);
            let [slope, drag, induced] = TYPICAL;
            let not_negative = |name, unit, sd: f64, upper| {
                Parameter::about(name, unit, 0.0, sd)
                    .within(0.0, upper)
                    .physically(Physical::NotNegative)
            };
            let place = |name| Parameter::about(name, "m", 0.0, length).left_out_as(0.0);
            vec![
                not_negative("area", "m^2", area, 10.0 * area),
                not_negative("lift_slope", "1/rad", slope, GREATEST[0]),
                Parameter::about("stall", "rad", STALL, 0.1)
                    .within(0.05, std::f64::consts::PI)
                    .physically(Physical::Between(0.0, std::f64::consts::PI))
                    .left_out_as(STALL),
                not_negative("drag", "1", drag, GREATEST[1]).left_out_as(drag),
                not_negative("induced", "1", induced, GREATEST[2]).left_out_as(induced),
                place("x"),
                place("y"),
                place("z"),
            ]
        })
    }

    fn is_hypothesis(&self) -> bool {
        false
    }

    fn medium(&self) -> Medium {
        Medium::Air
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

/// Coefficients of lift and drag at an angle of attack [rad].
fn coefficients<D: Scalar>(
    alpha: D,
    sin: D,
    cos: D,
    [slope, stall, drag, induced]: [D; 4],
) -> (D, D) {
    let size = |x: D| if real(x) < 0.0 { -x } else { x };
    let (ahead, behind) = (
        (-(alpha - stall) * SHARPNESS).exp(),
        ((alpha + stall) * SHARPNESS).exp(),
    );
    // Without stall alone: 1 / ((1 + 1/ahead) (1 + 1/behind)); written so that nothing overflows.
    let attached = (D::from(1.0) + ahead.recip()).recip() * (D::from(1.0) + behind.recip()).recip();
    let stalled = D::from(1.0) - attached;
    let thin = slope * alpha;
    let lift = attached * thin + stalled * sin * size(sin) * cos * PLATE;
    let plate = size(sin) * sin * sin * PLATE;
    (
        lift,
        drag + attached * induced * thin * thin + stalled * plate,
    )
}

impl WrenchLaw for Fin {
    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let zero = D::from(0.0);
        let [area, slope, stall, drag, induced, x, y, z] = *p;
        let centre = [x, y, z];
        let [u, _, w] = sum(flow.linear, cross(flow.angular, centre));
        let squared = u * u + w * w;
        if real(squared) < STILL * STILL {
            return [zero; 6];
        }
        let speed = squared.sqrt();
        let (sin, cos) = (w / speed, u / speed);
        let (lift, resistance) = coefficients(w.atan2(u), sin, cos, [slope, stall, drag, induced]);
        let pressure = area * squared * (0.5 * flow.density());
        let force = [
            pressure * (lift * sin - resistance * cos),
            zero,
            -pressure * (lift * cos + resistance * sin),
        ];
        about_origin(force, [zero; 3], centre)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    const FIN: [f64; 8] = [0.02, 3.1, 0.35, 0.012, 0.15, -0.4, 0.0, 0.05];

    /// Force along x and z at an angle of attack [rad], at 1.3 m/s.
    fn force(p: &[f64], alpha: f64) -> [f64; 2] {
        let mut motion = fixture::still();
        motion.linear = [1.3 * alpha.cos(), 0.0, 1.3 * alpha.sin()];
        let wrench = Fin.wrench(p, &motion, &[]);
        [wrench[0], wrench[2]]
    }

    /// Lift and drag [N].
    fn lift_and_drag(alpha: f64) -> (f64, f64) {
        let [x, z] = force(&FIN, alpha);
        let (sin, cos) = alpha.sin_cos();
        (x * sin - z * cos, -x * cos - z * sin)
    }

    const PRESSURE: f64 = 0.5 * 1000.0 * 1.3 * 1.3 * 0.02;

    #[test]
    fn below_stall_it_is_a_thin_foil() {
        let (lift, drag) = lift_and_drag(0.1);
        assert!((lift - PRESSURE * 3.1 * 0.1).abs() < 1e-4 * lift);
        let expected = PRESSURE * (0.012 + 0.15 * (3.1_f64 * 0.1).powi(2));
        assert!((drag - expected).abs() < 1e-3 * drag);
    }

    #[test]
    fn beyond_stall_and_astern_it_is_a_plate() {
        for alpha in [0.7, 1.2, PI / 2.0, 2.5, PI] {
            let (lift, drag) = lift_and_drag(alpha);
            let (sin, cos) = alpha.sin_cos();
            assert!((lift - PRESSURE * 1.2 * sin * sin.abs() * cos).abs() < 1e-5 * PRESSURE);
            assert!((drag - PRESSURE * (0.012 + 1.2 * sin.abs().powi(3))).abs() < 1e-5 * PRESSURE);
        }
    }

    #[test]
    fn the_greatest_lift_is_near_stall_and_it_falls_after_it() {
        let lifts: Vec<f64> = (0..90)
            .map(|degree| lift_and_drag(f64::from(degree).to_radians()).0)
            .collect();
        let (best, _) =
            lifts.iter().enumerate().fold(
                (0, 0.0),
                |best, (at, &lift)| {
                    if lift > best.1 { (at, lift) } else { best }
                },
            );
        assert!((17..=20).contains(&best), "{best} degrees");
        assert!(lifts[25] < 0.6 * lifts[best]);
    }

    #[test]
    fn up_and_down_are_the_same_and_drag_never_pushes() {
        for step in -100..=100 {
            let alpha = f64::from(step) / 100.0 * PI;
            let ([x, z], [mirrored_x, mirrored_z]) = (force(&FIN, alpha), force(&FIN, -alpha));
            assert!((x - mirrored_x).abs() < 1e-12 && (z + mirrored_z).abs() < 1e-12);
            assert!(
                lift_and_drag(alpha).1 >= PRESSURE * 0.012 - 1e-12,
                "{alpha}"
            );
        }
    }

    #[test]
    fn the_moment_is_the_lever_of_the_centre_of_pressure_and_turning_makes_an_angle() {
        let mut motion = fixture::still();
        motion.linear = [1.0, 0.0, 0.0];
        motion.angular = [0.0, 0.5, 0.0];
        let wrench = Fin.wrench(&FIN, &motion, &[]);
        // The fin, behind the origin, moves down its z as the nose goes up: w = 0.4 * 0.5.
        let (u, w) = (1.0 + 0.5 * 0.05, 0.4 * 0.5);
        let speed: f64 = f64::hypot(u, w);
        let q = 0.5 * 1000.0 * speed * speed * 0.02;
        let (lift, drag) = (3.1 * w.atan2(u), 0.012 + 0.15 * (3.1 * w.atan2(u)).powi(2));
        let z = -q * (lift * u / speed + drag * w / speed);
        assert!((wrench[2] - z).abs() < 1e-2 * z.abs());
        assert!((wrench[4] - (0.05 * wrench[0] + 0.4 * wrench[2])).abs() < 1e-12);
    }

    #[test]
    fn still_water_and_no_area_do_nothing() {
        assert_eq!(Fin.wrench(&FIN, &fixture::still(), &[]), [0.0; 6]);
        let mut motion = fixture::still();
        motion.linear = [1.0, 0.3, 0.2];
        let mut none = FIN;
        none[0] = 0.0;
        assert!(Fin.wrench(&none, &motion, &[]).iter().all(|f| *f == 0.0));
    }
}
