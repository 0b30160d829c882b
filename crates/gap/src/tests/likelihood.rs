//! The marginal likelihood on a simulated rigid body.

use std::sync::atomic::AtomicBool;

use hydro_effects::Id;
use nalgebra::DVector;

use super::{fake::RigidBody, on_hull, settings, trial};
use crate::{
    fit::hypothesis::Point,
    likelihood::{
        columns,
        explain::{Explained, explain},
        track::Track,
    },
    problem::problem::Problem,
    progress::Watch,
    trial::Trial,
};

fn on_prepared(trials: Vec<Trial>, test: impl FnOnce(&Problem<'_>, &Watch<'_>)) {
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    let body = RigidBody::new();
    test(
        &Problem::prepare(&body, trials, settings(), &watch).unwrap(),
        &watch,
    );
}

/// The quadratic about one point is the misfit at another, for what is linear exactly, else to first order.
#[test]
fn columns_are_the_changes_of_rollouts() {
    let trials = vec![trial("one", &[], &[0.02, -0.03], 3, 1.0)];
    on_prepared(trials, |problem, _| {
        let problem = problem.segmented(Vec::new());
        let drag = (0..problem.candidates.len())
            .find(|at| problem.candidates[*at].effect == Id::QuadraticDrag)
            .unwrap();
        let track = Track::new(
            0,
            &problem.trials[0],
            &problem.motions[0],
            [1.0, 0.5, 1.0],
            problem.model.timestep,
        );
        let point = |surge: f64, mass: f64| {
            let mut nuisances = DVector::zeros(problem.nuisances.len());
            nuisances[0] = mass;
            let mut values = problem.candidates[drag].null();
            values[0] = surge;
            values[1] = 4.0;
            Point {
                candidates: vec![drag],
                values: vec![values],
                nuisances,
                starts: Vec::new(),
            }
        };
        let scale = DVector::from_element(problem.model.nv, 1.0);
        let noise = vec![1.0; problem.channels.len()];
        let swept = |point: &Point| {
            let links = columns::sweep(&problem, &track, point, Some(&[]), 2, 0.02, &scale, &noise);
            links.unwrap().unwrap().remove(0)
        };
        let misfit = |point: &Point| swept(point).squares.iter().map(|of| of.0).sum::<f64>();
        let about = swept(&point(5.0, 0.5));
        let forms = crate::likelihood::form_error::forms(&problem, &point(5.0, 0.5));
        let predicted = |point: &Point| {
            let known = problem.normalised(point);
            let nuisances = problem.nuisances.len();
            let mut z = DVector::zeros(1 + known.len() + forms);
            z[0] = 1.0;
            for at in 0..nuisances {
                z[1 + at] = -known[at];
            }
            for at in nuisances..known.len() {
                z[1 + forms + at] = -known[at];
            }
            let own = about.gram.view((0, 0), (z.len(), z.len()));
            (own * &z).dot(&z)
        };
        for other in [
            point(5.0, 0.5),
            point(9.0, 0.5),
            point(5.0, 0.6),
            point(8.0, 0.4),
        ] {
            let (expected, found) = (misfit(&other), predicted(&other));
            assert!(
                (found - expected).abs()
                    < 0.02 * (expected - misfit(&point(5.0, 0.5))).abs() + 1e-6,
                "{expected} {found}"
            );
        }
    });
}

fn explained(effects: &[hydro_effects::Entry]) -> Vec<Explained> {
    let mut found = Vec::new();
    let trials = (0..3)
        .map(|seed| trial(&format!("{seed}"), effects, &[0.02, -0.03], seed, 1.0))
        .collect();
    on_prepared(trials, |problem, watch| {
        found = explain(&problem.segmented(Vec::new()), 12.0, watch).unwrap();
    });
    found
}

/// Probability of the sets of these effects, whatever the unmodelled forces.
fn probability(found: &[Explained], effects: &[Id]) -> f64 {
    let is_it = |of: &&Explained| of.effects.iter().map(|of| of.0).eq(effects.iter().copied());
    found.iter().filter(is_it).map(|of| of.probability).sum()
}

#[test]
fn a_missing_drag_is_the_likeliest_set_with_its_values() {
    let drag = on_hull(Id::QuadraticDrag, vec![20.0, 30.0, 40.0, 1.0, 1.0, 1.0]);
    let found = explained(&[drag]);
    assert!(
        probability(&found, &[Id::QuadraticDrag]) > 0.5,
        "{:?}",
        &found[..3]
    );
    let (_, values) = &found[0].values[0];
    for (value, expected) in values.iter().zip([20.0, 30.0, 40.0]) {
        assert!((value / expected - 1.0).abs() < 0.15, "{values:?}");
    }
}

#[test]
fn where_nothing_is_missing_the_empty_set_is_likeliest() {
    let found = explained(&[]);
    assert!(probability(&found, &[]) > 0.8, "{:?}", &found[..3]);
}
