//! Fitted values and 95 % intervals of effect parameters and nuisance parameters.

use hydro_effects::{Id, Parameter, catalogue};

use crate::{
    fit::{hypothesis::Fit, linearized_problem::LinearizedProblem, payload},
    output::verdict::FittedParameter,
};

/// Relative error of a parameter by the error of the effect's form; zero where the effect idealises nothing.
fn form_error(effect: Id, parameter: &Parameter, relative: f64) -> f64 {
    let idealised = catalogue::effect(effect).card().idealised;
    if idealised && !parameter.shapes {
        relative
    } else {
        0.0
    }
}

/// Values and intervals of one candidate in a fit: Laplace's, and the error of the effect's form.
pub(crate) fn parameters(
    linearized: &LinearizedProblem<'_>,
    fit: &Fit,
    candidate: usize,
    inflation: f64,
) -> Vec<FittedParameter> {
    let Some(row) = fit.point.candidates.iter().position(|of| *of == candidate) else {
        return Vec::new();
    };
    let quadratic = fit.quadratic().inflated(inflation);
    let best = quadratic.best(&fit.bounds);
    let of = &linearized.problem.candidates[candidate];
    let first = linearized.problem.nuisances.len()
        + fit.point.values[..row].iter().map(Vec::len).sum::<usize>();
    let relative = linearized.problem.options.discrepancy.form_error;
    let interval = |parameter: usize, z: f64| {
        let best = best.as_ref()?;
        let at = first + parameter;
        let covariance = |a: usize, b: usize| best.covariance[(a, b)];
        let both_free = covariance(first, first) > 0.0 && covariance(at, at) > 0.0;
        if catalogue::effect(of.effect).is_point_mass() && parameter > 0 && both_free {
            let variances = [(first, first), (first, at), (at, at)];
            let mass = fit.point.values[row][0] / of.parameters[0].prior_sd;
            return Some(payload::place_interval(
                mass,
                z,
                variances.map(|(a, b)| covariance(a, b)),
            ));
        }
        let form = form_error(of.effect, &of.parameters[parameter], relative) * z.abs();
        Some(quadratic.interval(best, &fit.bounds, at, z, form))
    };
    let fitted = |(parameter, p): (usize, &Parameter)| {
        let value = fit.point.values[row][parameter];
        let known = interval(parameter, (value - p.null) / p.prior_sd);
        FittedParameter {
            name: p.name.clone(),
            value,
            unit: p.unit.to_owned(),
            ci95: known.map_or([p.lower, p.upper], |interval| {
                interval.map(|z| (p.null + p.prior_sd * z).clamp(p.lower, p.upper))
            }),
        }
    };
    of.parameters.iter().enumerate().map(fitted).collect()
}

/// Name, value and standard deviation of every nuisance parameter, in the nuisance parameter's unit.
pub(crate) fn nuisances(
    linearized: &LinearizedProblem<'_>,
    fit: &Fit,
    inflation: f64,
) -> Vec<(String, f64, f64)> {
    let Some((_, optimum)) = fit.evidence(inflation) else {
        return Vec::new();
    };
    linearized
        .problem
        .nuisances
        .iter()
        .enumerate()
        .map(|(at, (nuisance, sd))| {
            let spread = optimum.covariance[(at, at)].max(0.0).sqrt();
            let name = linearized.problem.model.nuisances[*nuisance].name.clone();
            (name, fit.point.nuisances[at] * sd, spread * sd)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        plant::Plant,
        tests::{fake::RigidBody, on_hull, on_linearized, trial},
    };
    use hydro_effects::Target;
    use hydro_effects::card::JointScale;

    #[test]
    fn what_idealises_is_uncertain_by_its_form_but_not_its_shape() {
        let hull = Target::Body(RigidBody::new().description().bodies[0].scale.clone());
        let of = |effect: Id, name: &str| {
            let parameters = catalogue::effect(effect).parameters(&hull);
            let named = parameters.iter().find(|p| p.name.starts_with(name));
            form_error(effect, named.expect("the effect has it"), 0.15)
        };
        assert_eq!(of(Id::QuadraticDrag, "surge"), 0.15);
        assert_eq!(of(Id::Waves, "x"), 0.15);
        assert_eq!(of(Id::Waves, "frequency"), 0.0);
        assert_eq!(of(Id::NetBuoyancy, "force"), 0.0);
        let joint = Target::Joint(JointScale {
            inertia: 1.0,
            torque: 1.0,
            speed: 0.5,
            travel: 0.5,
            slides: false,
        });
        let of = |effect: Id| {
            let parameters = catalogue::effect(effect).parameters(&joint);
            parameters
                .iter()
                .map(|p| form_error(effect, p, 0.15))
                .collect::<Vec<_>>()
        };
        assert_eq!(of(Id::JointFriction), [0.15, 0.15, 0.0]);
        assert_eq!(of(Id::JointStiffness), [0.15, 0.0]);
    }

    #[test]
    fn a_payload_s_place_has_the_interval_of_a_ratio() {
        let load = [on_hull(Id::Payload, vec![1.5, 0.25, -0.1, 0.05])];
        let trials = (0..2).map(|seed| trial("loaded", &load, &[0.0, 0.0], seed, 1.0));
        on_linearized(&RigidBody::new(), trials.collect(), |linearized, watch| {
            let mut point = linearized.origin();
            let of = |effect: Id| {
                linearized
                    .problem
                    .candidates
                    .iter()
                    .position(|of| of.effect == effect)
            };
            let (lift, load) = (
                of(Id::Lift).expect("tried"),
                of(Id::Payload).expect("tried"),
            );
            point.candidates.extend([lift, load]);
            point
                .values
                .push(linearized.problem.candidates[lift].null());
            point.values.push(vec![1.5, 0.25, -0.1, 0.05]);
            let fit = linearized.fit(point, watch).expect("fits").expect("stands");
            let best = fit.quadratic().best(&fit.bounds).expect("positive");
            // After nuisance parameters and the lift's own.
            let first = linearized.problem.nuisances.len()
                + linearized.problem.candidates[lift].parameters.len();
            let scale: Vec<f64> = (linearized.problem.candidates[load].parameters.iter())
                .map(|p| p.prior_sd)
                .collect();
            let found = parameters(linearized, &fit, load, 1.0);
            for axis in 1..4 {
                let (at, value) = (first + axis, found[axis].value / scale[axis]);
                let variances =
                    [(first, first), (first, at), (at, at)].map(|(a, b)| best.covariance[(a, b)]);
                let expected = payload::place_interval(found[0].value / scale[0], value, variances);
                for (end, expected) in found[axis].ci95.iter().zip(expected) {
                    assert!(
                        (end / scale[axis] - expected).abs() < 1e-9,
                        "{:?}",
                        found[axis]
                    );
                }
                assert!(found[axis].ci95[0] < value * scale[axis]);
            }
        });
    }

    /// Much is known of a strong drag, but not what nature's differs by.
    #[test]
    fn the_interval_of_a_strong_effect_is_that_of_its_form() {
        let drag = [on_hull(
            Id::QuadraticDrag,
            vec![60.0, 90.0, 90.0, 1.0, 1.0, 1.0],
        )];
        let trials = (0..2).map(|seed| trial("dragged", &drag, &[0.0, 0.0], seed, 1.0));
        on_linearized(&RigidBody::new(), trials.collect(), |linearized, watch| {
            let mut point = linearized.origin();
            let is_drag =
                |at: &usize| linearized.problem.candidates[*at].effect == Id::QuadraticDrag;
            let drag = (0..linearized.problem.candidates.len())
                .find(is_drag)
                .expect("a candidate");
            point.candidates.push(drag);
            point.values.push(vec![60.0, 90.0, 90.0, 1.0, 1.0, 1.0]);
            let fit = linearized.fit(point, watch).expect("fits").expect("stands");
            let surge = &parameters(linearized, &fit, drag, 1.0)[0];
            let half = 0.5 * (surge.ci95[1] - surge.ci95[0]);
            let form = 1.96 * 0.15 * surge.value;
            assert!(half > form && half < 1.2 * form, "{surge:?}");
        });
    }
}
