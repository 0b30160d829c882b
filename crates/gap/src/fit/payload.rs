//! The payload effect in a fit: its forces depend on the product of mass and place.

use hydro_effects::effect;

use crate::{
    fit::{hypothesis::Point, truncated_normal::HALF_WIDTH},
    problem::candidates::Candidate,
};

/// A point with all its payloads on the other side of their bodies' origins; none where it has none.
///
/// Mirrored payloads have equal inertia, and an uncertain centre of mass can hide their opposite moments. That makes two
/// optima, of which a descent finds one. A payload at the origin is its own mirror image; it is fitted again because places
/// have sensitivities only once there is mass.
pub(crate) fn mirrored(candidates: &[Candidate], point: &Point) -> Option<Point> {
    let is_payload = |candidate: &usize| effect(candidates[*candidate].effect).is_point_mass();
    let mut mirrored = point.clone();
    for (candidate, values) in point.candidates.iter().zip(&mut mirrored.values) {
        if is_payload(candidate) {
            values[1..].iter_mut().for_each(|place| *place = -*place);
        }
    }
    point.candidates.iter().any(is_payload).then_some(mirrored)
}

/// A point that a straight step has led to, with the place of its payloads where their moments (mass times place) are
/// what the step makes of them to first order.
///
/// Weight is linear in mass and moment; a step that is straight in mass and place changes the moment by their product
/// too, which the next would have to undo.
pub(crate) fn at_their_moments(candidates: &[Candidate], from: &Point, mut to: Point) -> Point {
    for (row, candidate) in from.candidates.iter().enumerate() {
        let of = &candidates[*candidate];
        let (before, after) = (&from.values[row], &mut to.values[row]);
        if !effect(of.effect).is_point_mass() || before[0] <= 0.0 || after[0] <= 0.0 {
            continue;
        }
        let part = before[0] / after[0];
        for (at, p) in of.parameters.iter().enumerate().skip(1) {
            let place = before[at] + part * (after[at] - before[at]);
            after[at] = place.clamp(p.lower, p.upper);
        }
    }
    to
}

/// The 95 % interval of a coordinate of the place, where the posterior is normal in mass and moment: that of a ratio,
/// within the prior's.
///
/// `mass`, `place`: in standard deviations of their priors; `variances`: of the mass, of both, of the place, about these.
/// Source: E. C. Fieller, J. R. Stat. Soc. B 16, 1954.
pub(crate) fn place_interval(mass: f64, place: f64, variances: [f64; 3]) -> [f64; 2] {
    let [of_mass, of_both, of_place] = variances.map(|variance| HALF_WIDTH * HALF_WIDTH * variance);
    // Of d = q - place: d^2 (m^2 - V_mm) + 2 d m V_mx <= m^2 V_xx.
    let certain = mass * mass - of_mass;
    let (from, to) = if certain > 0.0 {
        let middle = -mass * of_both / certain;
        let half = (middle * middle + mass * mass * of_place / certain).sqrt();
        (place + middle - half, place + middle + half)
    } else {
        (f64::NEG_INFINITY, f64::INFINITY)
    };
    // A place that little is known of is where the prior has it.
    [
        from.max(place.min(-HALF_WIDTH)),
        to.min(place.max(HALF_WIDTH)),
    ]
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;
    use crate::{plant::Plant, tests::fake::RigidBody};
    use hydro_effects::{Id, Parameter};
    use hydro_effects::{Target, catalogue};

    /// A payload, and a drag that has no place.
    fn candidates() -> Vec<Candidate> {
        let body = Target::Body(RigidBody::new().description().bodies[0].scale.clone());
        let of = |effect: Id| Candidate {
            effect,
            targets: vec!["hull".to_owned()],
            parameters: catalogue::effect(effect).parameters(&body),
            left_out: Vec::new(),
        };
        vec![of(Id::QuadraticDrag), of(Id::Payload)]
    }

    fn point(candidates: &[Candidate], payload: [f64; 4]) -> Point {
        let drag = candidates[0].parameters.iter().map(|_| 3.0).collect();
        Point {
            candidates: vec![0, 1],
            values: vec![drag, payload.to_vec()],
            nuisances: DVector::zeros(2),
            starts: Vec::new(),
        }
    }

    fn moment(point: &Point) -> [f64; 3] {
        let [mass, place @ ..] = &point.values[1][..] else {
            unreachable!("a payload has a mass")
        };
        [0, 1, 2].map(|axis| mass * place[axis])
    }

    #[test]
    fn a_step_leads_to_the_moment_that_it_promised() {
        let all = candidates();
        let from = point(&all, [0.3, -0.15, 0.05, 0.0]);
        let straight = point(&all, [1.2, -0.4, 0.06, -0.02]);
        let to = at_their_moments(&all, &from, straight.clone());
        for axis in 0..3 {
            let (m, r) = (from.values[1][0], from.values[1][1 + axis]);
            let (dm, dr) = (straight.values[1][0] - m, straight.values[1][1 + axis] - r);
            assert!((moment(&to)[axis] - (m * r + dm * r + m * dr)).abs() < 1e-12);
        }
        assert_eq!(to.values[1][0], 1.2);
        assert_eq!(to.values[0], straight.values[0]);
    }

    #[test]
    fn a_mass_that_vanishes_stays_where_the_step_has_put_it_and_bounds_hold() {
        let all = candidates();
        let from = point(&all, [0.3, -0.15, 0.05, 0.0]);
        let vanished = point(&all, [0.0, -0.1, 0.0, 0.0]);
        assert_eq!(at_their_moments(&all, &from, vanished.clone()), vanished);
        let tiny = at_their_moments(&all, &from, point(&all, [1e-9, 0.2, 0.0, 0.0]));
        let within = |(p, value): (&Parameter, &f64)| (p.lower..=p.upper).contains(value);
        assert!(all[1].parameters.iter().zip(&tiny.values[1]).all(within));
    }

    /// Against quadrature over mass and moment.
    #[test]
    fn the_interval_of_a_place_is_that_of_a_ratio() {
        let (mass, place) = (1.2, -0.11);
        // Normal in mass and moment, correlated by 0.4.
        let (of_mass, of_moment, both) = (0.2_f64, 0.01_f64, 0.4 * 0.2 * 0.01);
        // x = M / m, so m dx = dM - x dm.
        let of_both = (both - place * of_mass.powi(2)) / mass;
        let of_place =
            (of_moment.powi(2) - 2.0 * place * both + (place * of_mass).powi(2)) / (mass * mass);
        let variances = [of_mass.powi(2), of_both, of_place];
        let [low, high] = place_interval(mass, place, variances);
        let (mut below, mut above, mut whole) = (0.0, 0.0, 0.0);
        let steps = || (-400..=400).map(|at| f64::from(at) * 0.015);
        for a in steps() {
            for b in steps() {
                let weight = (-0.5 * (a * a + b * b)).exp();
                let drawn = mass + of_mass * a;
                let moment = mass * place + of_moment * (0.4 * a + 0.84_f64.sqrt() * b);
                whole += weight;
                below += if moment / drawn < low { weight } else { 0.0 };
                above += if moment / drawn > high { weight } else { 0.0 };
            }
        }
        assert!((below / whole - 0.025).abs() < 1e-3, "{}", below / whole);
        assert!((above / whole - 0.025).abs() < 1e-3, "{}", above / whole);
    }

    /// The less is known of the mass, the less of its place, and no less than before anything was measured.
    #[test]
    fn a_place_is_no_less_certain_than_its_prior() {
        let at = |sd: f64| place_interval(1.0, 0.5, [sd * sd, -0.18 * sd, 0.36]);
        let mut before = 0.0;
        for sd in [0.1, 0.3, 0.45, 0.49, 0.5, 0.51, 0.52, 1.0] {
            let [from, to] = at(sd);
            assert!(
                to - from >= before && -HALF_WIDTH <= from && to <= HALF_WIDTH,
                "{sd}: {from} {to}"
            );
            before = to - from;
        }
        assert_eq!(at(1.0), [-HALF_WIDTH, HALF_WIDTH]);
        assert_eq!(place_interval(0.0, 3.0, [0.0; 3]), [-HALF_WIDTH, 3.0]);
    }

    #[test]
    fn a_mirrored_payload_has_the_opposite_moment() {
        let all = candidates();
        let here = point(&all, [0.3, -0.15, 0.05, 0.02]);
        let there = mirrored(&all, &here).expect("there is a payload");
        assert_eq!(moment(&there), moment(&here).map(|moment| -moment));
        assert_eq!(there.values[0], here.values[0]);
        let mut alone = here.clone();
        alone.candidates.pop();
        alone.values.pop();
        assert!(mirrored(&all, &alone).is_none());
    }
}
