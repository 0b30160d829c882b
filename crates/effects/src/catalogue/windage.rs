//! Wind on the part of a hull that is out of the water.

use super::axes;
use crate::{
    Card, Effect, Id, Medium, Parameter, Part, Physical, Placement, Target, TargetKind,
    dual::{Scalar, cross, dot, real, sum},
    flow::{Flow, SPEEDS},
    wrench_law::{Parameters, WrenchLaw, about_origin},
};

/// Density of air at 15 degrees and sea level [kg/m^3].
const AIR: f64 = 1.225;
/// Below this squared speed [m^2/s^2] there is no wind.
const STILL: f64 = 1e-24;
/// Typical wind [m/s].
const BREEZE: f64 = 5.0;

/// Parameters `x`, `y`, `z`: velocity of the wind in the world [m/s]; `surge`, `sway`, `heave`: drag coefficient times area
/// for wind along the body's axes [m^2]; `height`: z of the point that it acts at, body frame [m]; `density` of the air
/// [kg/m^3].
#[derive(Debug)]
pub struct Windage;

static CARD: Card = Card {
    id: Id::Windage,
    phrase: "windage",
    target: TargetKind::Body,
    summary: "wind on the part of the hull that is out of the water; it needs a waterline",
    equation: "F = -1/2 density (C A) |v_a| v_a axis by axis times the share of the hull's volume that is dry, at (0, 0, height); v_a: \
               velocity of that point relative to the wind",
    source: "T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, section 10.1 (wind \
             forces); W. Blendermann, Journal of Wind Engineering and Industrial Aerodynamics 51, 1994 (coefficients)",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for Windage {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            let wind = ["x", "y", "z"].map(|name| {
                Parameter::about(name, "m/s", 0.0, BREEZE)
                    .within(-100.0, 100.0)
                    .physically(SPEEDS)
            });
            let [x, y, z] = scale.extent;
            let area = |axis: usize, area: f64| {
                let area = if area > 0.0 { area } else { 1.0 };
                Parameter::about(axes::NAMES[axis], "m^2", 0.0, area)
                    .within(0.0, 10.0 * area)
                    .physically(Physical::NotNegative)
            };
            let height = if z > 0.0 { z } else { 1.0 };
            wind.into_iter()
                .chain([area(0, y * z), area(1, x * z), area(2, x * y)])
                .chain([
                    Parameter::about("height", "m", 0.0, height).left_out_as(0.0),
                    Parameter::about("density", "kg/m^3", AIR, 0.05)
                        .within(0.0, 10.0)
                        .physically(Physical::NotNegative)
                        .left_out_as(AIR),
                ])
                .collect()
        })
    }

    fn is_hypothesis(&self) -> bool {
        false
    }

    fn medium(&self) -> Medium {
        Medium::None
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

impl WrenchLaw for Windage {
    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let zero = D::from(0.0);
        let [x, y, z, surge, sway, heave, height, density] = *p;
        let at = [zero, zero, height];
        let wind = flow.dual_in_body([x, y, z]);
        let over_ground = flow.over_ground();
        let moving = sum(over_ground, cross(flow.angular, at));
        let through = [0, 1, 2].map(|axis| moving[axis] - wind[axis]);
        let squared = dot(through, through);
        if real(squared) < STILL {
            return [zero; 6];
        }
        let pressure = squared.sqrt() * density * -0.5;
        let areas = [surge, sway, heave];
        let force = [0, 1, 2].map(|axis| pressure * areas[axis] * through[axis]);
        about_origin(force, [zero; 3], at)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    #[test]
    fn it_pushes_across_with_half_rho_c_a_v_squared_at_its_height() {
        let p = [0.0, 8.0, 0.0, 0.5, 2.0, 1.0, 1.5, 1.2];
        let wrench = Windage.wrench(&p, &fixture::still(), &[]);
        let force = 0.5 * 1.2 * 2.0 * 64.0;
        assert!((wrench[1] - force).abs() < 1e-12);
        assert!((wrench[3] + 1.5 * force).abs() < 1e-12);
        assert_eq!((wrench[0], wrench[2]), (0.0, 0.0));
    }

    /// The wind is the world's, whatever the heading and however the water flows.
    #[test]
    fn the_wind_is_relative_to_the_ground() {
        let p = [5.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 1.2];
        let mut motion = fixture::still();
        motion.world_from_base = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.7);
        // Carried along by a current at rest relative to the water: over the ground it moves with it.
        motion.water_velocity = [2.0, 0.0, 0.0];
        let wrench = Windage.wrench(&p, &motion, &[]);
        let force = motion
            .world_from_base
            .transform_vector(&nalgebra::Vector3::new(wrench[0], wrench[1], wrench[2]));
        assert!((force.x - 0.5 * 1.2 * 9.0).abs() < 1e-12 && force.y.abs() < 1e-12);
    }
}
