//! The marginal likelihood on a simulated rigid body.

use hydro_effects::Id;
use nalgebra::{DMatrix, DVector};

use super::{fake::RigidBody, on_hull, on_prepared, trial};
use crate::{
    likelihood::{
        columns::{self, LinkColumns, Sweep},
        explain::explain,
        followed::Followed,
        force_scale::Unmodelled,
        found::likeliest,
        track::Track,
        working_point::{Keep, WorkingPoint},
    },
    problem::point::Point,
};

/// The quadratic about one point is the misfit at another, for what is linear exactly, else to first order.
#[test]
fn columns_are_the_changes_of_rollouts() {
    let trials = vec![trial("one", &[], &[0.02, -0.03], 3, 1.0)];
    on_prepared(&RigidBody::new(), trials, |problem, _| {
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
                by_trial: vec![Default::default()],
                candidates: vec![drag],
                values: vec![values],
                forms: vec![[1.0; 2]],
                nuisances,
            }
        };
        let scale = DVector::from_element(problem.model.nv, 1.0);
        let swept = |point: &Point| {
            let how = Sweep {
                directions: Some(&[]),
                pieces: 2,
                block: 0.02,
                look: 0.02,
                force_scale: &scale,
                drifts: &[0.0],
                keep_readings: false,
                scaled: &[],
                horizon: None,
            };
            let links = columns::sweep(problem, &track, point, how);
            links.unwrap().unwrap().remove(0)
        };
        // Carried back to zero parameters, then on to a point: there exactly the residual of its own sweep.
        let forms = crate::likelihood::form_error::beside(problem, &point(5.0, 0.5)).forms();
        let at = |about: &LinkColumns, point: &Point| {
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
            let own = about.noise[0].gram.view((0, 0), (z.len(), z.len()));
            (own * &z).dot(&z)
        };
        let about = swept(&point(5.0, 0.5));
        let misfit = |point: &Point| at(&swept(point), point);
        let predicted = |point: &Point| at(&about, point);
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

/// Beside accelerations that nobody modelled a column of the mass is the change of rollouts in which these accelerations stay,
/// and their forces grow with the mass.
#[test]
fn unmodelled_accelerations_stay_while_a_mass_changes() {
    let trials = vec![trial("one", &[], &[0.02, -0.03], 3, 1.0)];
    on_prepared(&RigidBody::new(), trials, |problem, _| {
        let (trial, motion) = (&problem.trials[0], &problem.motions[0]);
        let step = problem.model.timestep;
        let mut track = Track::new(0, trial, motion, [1.0, 0.5, 1.0], step);
        for link in &mut track.links {
            link.forces = vec![
                0.6, -0.4, 0.5, 0.3, -0.2, 0.4, 0.5, -0.7, 0.3, -0.3, 0.1, 0.3,
            ];
        }
        let tracks = [track];
        let unmodelled = Unmodelled::new(problem, &tracks).unwrap();
        let point = |mass: f64| {
            let mut point = problem.origin();
            point.nuisances[0] = mass;
            point
        };
        let swept = |point: &Point| {
            let how = Sweep {
                directions: Some(&[]),
                pieces: 2,
                block: 0.005,
                look: 0.005,
                force_scale: &unmodelled.forces(problem, &tracks, point).unwrap(),
                drifts: &[0.0],
                keep_readings: true,
                scaled: &[],
                horizon: None,
            };
            let links = columns::sweep(problem, &tracks[0], point, how);
            links.unwrap().unwrap().remove(0).noise.remove(0).readings
        };
        // Those of the residual hold what the point's mass and the forces do: the mass is carried back, the forces are not wanted.
        let forces = DVector::from_column_slice(&tracks[0].links[0].forces);
        let residual = |readings: &DMatrix<f64>, mass: f64| {
            let first = readings.ncols() - forces.len();
            readings.column(0)
                - mass * readings.column(1)
                - readings.columns(first, forces.len()) * &forces
        };
        let (lighter, heavier) = (swept(&point(-0.5)), swept(&point(0.5)));
        let expected = residual(&lighter, -0.5) - residual(&heavier, 0.5);
        let column = swept(&point(0.0)).column(1).into_owned();
        let off = (&column - &expected).norm() / expected.norm();
        assert!(off < 0.02, "{off}");
    });
}

/// A point counts by what it has reached: first order promises it what settling then gives, and nothing once it has settled.
#[test]
fn a_point_that_settles_reaches_what_was_promised() {
    let drag = on_hull(Id::QuadraticDrag, vec![20.0, 30.0, 40.0, 1.0, 1.0, 1.0]);
    let trials = vec![trial("one", &[drag], &[0.02, -0.03], 3, 1.0)];
    on_prepared(&RigidBody::new(), trials, |problem, watch| {
        let drag = (0..problem.candidates.len())
            .find(|at| problem.candidates[*at].effect == Id::QuadraticDrag)
            .unwrap();
        let followed = Followed::new(problem, watch).unwrap();
        let mut working = followed.working_point(watch);
        working.point.candidates = vec![drag];
        working.point.values = vec![problem.candidates[drag].null()];
        working.point.forms = vec![[1.0; 2]];
        working.point.by_trial = vec![Default::default()];
        let reached = |working: &WorkingPoint<'_, '_>| {
            let swept = working.sweep(Some(&[]), Keep::Likelihood, None).unwrap();
            let levels = swept.unwrap().levels;
            let found = working.own_sets(&levels);
            let best = likeliest(&found).unwrap();
            let promised = levels[best.level].promised(problem, &working.point, best);
            (best.log_posterior - promised, promised)
        };
        let (before, promised) = reached(&working);
        // Where a step went too far, that is what counts.
        let counted = |working: &WorkingPoint<'_, '_>| {
            let swept = working.sweep(Some(&[]), Keep::Likelihood, None).unwrap();
            let found = working.reached(&swept.unwrap().levels);
            likeliest(&found).unwrap().log_posterior
        };
        let trusted = counted(&working);
        assert!(
            (trusted - before - promised).abs() < 1e-6 * promised,
            "{trusted} {before}"
        );
        working.counts_as_reached = true;
        let distrusted = counted(&working);
        assert!(distrusted < trusted - 20.0, "{distrusted} {trusted}");
        working.counts_as_reached = false;
        assert!(promised > 20.0, "{promised}");
        // What is not worth it ends early, and counts as first order has it.
        let mut hopeless = working.clone();
        assert!(hopeless.settle(Some(1e12)).unwrap().is_some());
        assert!(!hopeless.counts_as_reached);
        let settled = working.settled_posterior(None).unwrap().unwrap();
        assert!(!working.counts_as_reached);
        // As another sweep has it.
        let again = working.posterior().unwrap().unwrap();
        assert!((settled - again).abs() < 0.5, "{settled} {again}");
        let (after, left) = reached(&working);
        assert!(left < 1.0, "{left}");
        let gained = after - before;
        assert!(
            (gained - promised).abs() < 0.1 * promised,
            "{gained} {promised}"
        );
    });
}

/// Sets of effects with their probabilities, and the values of the likeliest.
type Explained = (Vec<(Vec<Id>, f64)>, Vec<Vec<f64>>);

fn explained(effects: &[hydro_effects::Entry]) -> Explained {
    let mut found = None;
    let trials = (0..3)
        .map(|seed| trial(&format!("{seed}"), effects, &[0.02, -0.03], seed, 1.0))
        .collect();
    on_prepared(&RigidBody::new(), trials, |problem, watch| {
        let followed = Followed::new(problem, watch).unwrap();
        let explanation = explain(&followed, watch).unwrap();
        let sets = explanation.sets.iter();
        let sets = sets.map(|of| (explanation.effects(&of.set), of.probability));
        found = Some((sets.collect(), explanation.point(0).values));
    });
    found.unwrap()
}

/// Probability of the set of these effects.
fn probability((sets, _): &Explained, effects: &[Id]) -> f64 {
    let is_it = |of: &&(Vec<Id>, f64)| of.0 == effects;
    sets.iter().filter(is_it).map(|of| of.1).sum()
}

#[test]
fn a_missing_drag_is_the_likeliest_set_with_its_values() {
    let drag = on_hull(Id::QuadraticDrag, vec![20.0, 30.0, 40.0, 1.0, 1.0, 1.0]);
    let found = explained(&[drag]);
    assert!(
        probability(&found, &[Id::QuadraticDrag]) > 0.5,
        "{:?}",
        &found.0[..3]
    );
    for (value, expected) in found.1[0].iter().zip([20.0, 30.0, 40.0]) {
        assert!((value / expected - 1.0).abs() < 0.15, "{:?}", found.1);
    }
}

#[test]
fn where_nothing_is_missing_the_empty_set_is_likeliest() {
    let found = explained(&[]);
    assert!(probability(&found, &[]) > 0.8, "{:?}", &found.0[..3]);
}
