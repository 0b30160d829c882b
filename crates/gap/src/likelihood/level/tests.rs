//! Errors of form on every trial, and the moments of simulated likelihoods.
#![allow(clippy::unwrap_used)]

use rand::SeedableRng;

use super::*;
use crate::likelihood::truncated_evidence::Truncated;

/// The likelihood with an error of form of another size is the same whether the trials are added up with values of their own
/// or without: where the deviations are all but none.
#[test]
fn an_error_of_form_of_another_size_reaches_every_trial() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let columns = Beside {
        numbers: 1,
        forms: vec![(None, 1..1), (Some(0), 1..2)],
    };
    let mut filtered = |trial: usize| {
        let of = DMatrix::from_fn(7, 4, |_, _| standard_normal(&mut rng));
        let filtered = Filtered {
            trial,
            gram: of.tr_mul(&of),
            half_log_determinant: 0.3,
            deviations: Deviations::default(),
        };
        filtered.with_own(&[vec![(0, 0.5)]]).unwrap()
    };
    let trials = vec![filtered(0), filtered(1)];
    let sizes = Sizes {
        force: 0.1,
        drift: 0.0,
        slow_drift: 0.0,
    };
    let level = Level::new(0, sizes, true, trials, &columns).unwrap();
    let before = level.given(&[0]).unwrap().empty;
    let scaled = level.with_form(0, 0, 3.0);
    let whole = scaled.given(&[0]).unwrap();
    let by_trial = scaled.given_own(&[0], &vec![(0, 1e-9)], &[0]).unwrap();
    assert!((whole.empty - before).abs() > 1e-2, "{before}");
    assert!((whole.empty - by_trial.empty).abs() < 1e-9);
    assert!((&whole.quadratic.a - &by_trial.quadratic.a).amax() < 1e-9);
    // What a trial's own number is expected to be does not change with the units of a known error of form.
    let known = DVector::from_vec(vec![0.4, 0.6, -0.2]);
    let in_units = DVector::from_vec(vec![0.4, 0.2, -0.2]);
    for (a, b) in level.trials.iter().zip(&scaled.trials) {
        let (a, b) = (a.deviations.own(&known), b.deviations.own(&in_units));
        assert!((a[0] - b[0]).abs() < 1e-12, "{a} {b}");
    }
}

/// Slopes of simulated trials have the curvature as covariance about what the values bring, and these the posterior's.
#[test]
fn simulated_likelihoods_have_the_moments_of_their_set() {
    let a = DMatrix::from_row_slice(2, 2, &[5.0, 1.0, 1.0, 3.0]);
    let mut gram = DMatrix::zeros(3, 3);
    gram.view_mut((1, 1), (2, 2)).copy_from(&a);
    let sizes = Sizes {
        force: 0.1,
        drift: 0.0,
        slow_drift: 0.0,
    };
    let level = Level::of((0, sizes, true), &gram, 0.0, Beside::default());
    let found = Found {
        set: vec![0],
        level: 0,
        members: vec![(0, 0, 0, None)],
        columns: vec![0],
        own: Vec::new(),
        held: Held::new(),
        mixtures: vec![0.0],
        posterior: Truncated {
            log_evidence: 0.0,
            mean: DVector::from_vec(vec![2.0]),
            covariance: DMatrix::from_element(1, 1, 0.25),
        },
        log_likelihood: 0.0,
        log_posterior: 0.0,
    };
    let simulator = level.simulator(&found).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let draws: Vec<DVector<f64>> = (0..20_000)
        .map(|_| simulator.draw(&mut rng).whole.b.clone())
        .collect();
    let count = draws.len() as f64;
    let mean: DVector<f64> = draws.iter().sum::<DVector<f64>>() / count;
    let covariance: DMatrix<f64> = draws
        .iter()
        .map(|b| (b - &mean) * (b - &mean).transpose())
        .sum::<DMatrix<f64>>()
        / count;
    let column = a.column(0);
    assert!((&mean - 2.0 * column).amax() < 0.1, "{mean}");
    let expected = &a + 0.25 * column * column.transpose();
    assert!(
        (&covariance - &expected).amax() < 0.3,
        "{covariance} {expected}"
    );
}
