//! Coverage of the intervals.

use super::*;

/// Errors of seeds on 40 trajectories, that of seed s scaled by `of[s]`.
fn errors(of: &[f64]) -> Vec<Vec<f64>> {
    let trajectory = |t: usize| 1.0 + 0.5 * ((t * 37 % 40) as f64 / 40.0);
    of.iter()
        .map(|scale| (0..40).map(|t| scale * trajectory(t)).collect())
        .collect()
}

#[test]
fn a_clear_lead_is_sure_and_a_doubtful_one_is_not() {
    let (fine, poor) = (errors(&[1.0, 1.05, 0.95]), errors(&[4.0, 4.1, 3.9]));
    let clear = ordering("2", ("a", &fine), ("b", &poor)).expect("compares");
    assert!((clear.ratio - 0.5).abs() < 2e-3, "{clear:?}");
    assert!(
        clear.ci95[0] < 0.5 && 0.5 < clear.ci95[1] && clear.ci95[1] < 0.6,
        "{clear:?}"
    );
    assert!(clear.probability > 0.999, "{clear:?}");
    let back = ordering("2", ("b", &poor), ("a", &fine)).expect("compares");
    assert!((back.ratio * clear.ratio - 1.0).abs() < 1e-12 && back.probability < 1e-3);
    let doubtful = ordering(
        "2",
        ("a", &errors(&[1.1, 1.0, 1.2])),
        ("b", &errors(&[0.5, 1.0, 2.0])),
    );
    let doubtful = doubtful.expect("compares");
    assert!((0.05..0.95).contains(&doubtful.probability), "{doubtful:?}");
    assert!(doubtful.ci95[0] < 1.0 && doubtful.ci95[1] > 1.0);
}

/// Two equal models of three seeds each, 400 times: what is said to be 95 % sure is wrong in about 5 %.
#[test]
fn intervals_cover_what_they_say() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut seeds = || {
        let mut of = [0.0; 3];
        for scale in &mut of {
            // Twelve uniform numbers less their mean are nearly normal.
            let normal: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
            *scale = (0.2 * normal).exp().powi(2);
        }
        errors(&of)
    };
    let runs = 400;
    let held = (0..runs)
        .filter(|_| {
            let found = ordering("2", ("a", &seeds()), ("b", &seeds())).expect("compares");
            found.ci95[0] <= 1.0 && 1.0 <= found.ci95[1]
        })
        .count();
    let share = held as f64 / f64::from(runs);
    assert!((0.92..=0.99).contains(&share), "{share}");
}

#[test]
fn nothing_is_said_without_a_second_seed_or_of_other_trajectories() {
    let some = errors(&[1.0, 1.1, 0.9]);
    for other in [vec![], errors(&[1.0]), vec![vec![1.0; 7]; 3]] {
        assert_eq!(ordering("2", ("a", &some), ("b", &other)), None);
        assert_eq!(ordering("2", ("a", &other), ("b", &some)), None);
    }
}
