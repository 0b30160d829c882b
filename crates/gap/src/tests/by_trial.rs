//! What differs from trial to trial: gains of the actuators, and effects with a value of each trial's own.

use std::collections::BTreeMap;

use hydro_effects::Id;

use super::{fake::RigidBody, on_hull, on_prepared, settings, trial, under};
use crate::{
    likelihood::{explain::explain, explanation::Explanation, followed::Followed},
    output::verdict::Outcome,
    progress::Watch,
    stage::{
        add::add,
        name::{Naming, name},
        verify::{VerifyInput, verify},
    },
    trial::Trial,
};

/// Hands over the answer on trials of a body with uncertain gains.
fn answered(trials: Vec<Trial>, test: impl Fn(&Explanation<'_>, &Naming, &Watch<'_>)) {
    on_prepared(&RigidBody::with_gains(), trials, |problem, watch| {
        let followed = Followed::new(problem, watch).unwrap();
        let explanation = explain(&followed, watch).unwrap();
        let naming = name(&explanation, watch).unwrap();
        test(&explanation, &naming, watch);
    });
}

/// Trials of a current each [m/s].
fn in_currents(currents: &[[f64; 3]]) -> Vec<Trial> {
    let trial = |(at, current): (usize, &[f64; 3])| {
        let current = on_hull(Id::Current, current.to_vec());
        trial(&at.to_string(), &[current], &[0.02, -0.02], at as u64, 1.0)
    };
    currents.iter().enumerate().map(trial).collect()
}

/// Its mean over the trials is none, so that no common current explains anything. Trials that were left out are predicted by
/// what their first halves tell.
#[test]
fn a_current_that_differs_from_trial_to_trial_is_named_with_each_trials_own() {
    let currents = [
        [0.15, 0.1, 0.0],
        [-0.15, -0.1, 0.0],
        [0.1, -0.15, 0.0],
        [-0.1, 0.15, 0.0],
    ];
    answered(in_currents(&currents), |explanation, naming, watch| {
        let named = &naming.named;
        assert_eq!(named.outcome, Outcome::Named, "{:?}", named.effects);
        let ids: Vec<Id> = named.chosen.iter().map(|of| of.effect).collect();
        assert_eq!(ids, [Id::Current], "{:?}", named.ranking);
        for (axis, of) in named.chosen[0].parameters.iter().enumerate() {
            let [low, high] = of.ci95;
            assert!(of.value.abs() < 0.1 && low < 0.0 && high > 0.0, "{of:?}");
            assert!(
                high - low > 0.05,
                "no narrower than four draws allow: {of:?}"
            );
            for (at, current) in currents.iter().enumerate() {
                let found = of.by_trial[&at.to_string()];
                assert!((found - current[axis]).abs() < 0.02, "{at} {axis}: {found}");
            }
        }
        let added = add(explanation, naming).unwrap().added;
        let (plant, none) = (RigidBody::with_gains(), BTreeMap::new());
        let input = VerifyInput {
            before: &plant,
            after: &plant,
            sensors: &none,
            cross_fit: &added.cross_fit,
            own: added.own.as_ref(),
            recalibrated: &added.recalibrated,
            commands_before: added.commands_before,
        };
        let unseen = in_currents(&[[0.12, -0.1, 0.0], [-0.05, 0.15, 0.0]]);
        let fitted = in_currents(&currents);
        let verified = verify(&input, unseen, fitted, &[], &settings(), watch).unwrap();
        assert!(verified.accepted, "{:?}", verified.refused_because);
        for sensor in ["dvl", "position"] {
            let of = &verified.gap.per_sensor[sensor];
            assert!(of.reduction > 0.8, "{sensor}: {of:?}");
        }
        // The mean alone helps nobody.
        let input = VerifyInput { own: None, ..input };
        let fitted = in_currents(&currents);
        let verified = verify(&input, Vec::new(), fitted, &[], &settings(), watch).unwrap();
        let of = &verified.gap.per_sensor["dvl"];
        assert!(of.reduction < 0.2, "{of:?}");
    });
}

/// Occam's factor takes the form with one value.
#[test]
fn a_common_current_has_no_values_by_trial() {
    answered(in_currents(&[[0.15, 0.1, 0.0]; 4]), |_, naming, _| {
        let named = &naming.named;
        let ids: Vec<Id> = named.chosen.iter().map(|of| of.effect).collect();
        assert_eq!(ids, [Id::Current], "{:?}", named.ranking);
        for of in &named.chosen[0].parameters {
            assert!(of.by_trial.is_empty(), "{of:?}");
        }
    });
}

/// As a battery makes them: two per cent from trial to trial, the same of all actuators. Where the nominal rules that out, they
/// are a gap.
#[test]
fn gains_that_differ_from_trial_to_trial_are_no_gap() {
    let outcome = |gain_by_trial: f64| {
        let gains = [0.03, -0.03, 0.02, -0.02];
        let trial = |(at, gain): (usize, &f64)| {
            let numbers = [0.0, 0.0, *gain, *gain, *gain, *gain];
            trial(&at.to_string(), &[], &numbers, at as u64, 0.2)
        };
        let trials = gains.iter().enumerate().map(trial).collect();
        let mut settings = settings();
        settings.uncertainty.gain_by_trial = gain_by_trial;
        let mut outcome = None;
        under(
            settings,
            &RigidBody::with_gains(),
            trials,
            |problem, watch| {
                let followed = Followed::new(problem, watch).unwrap();
                let explanation = explain(&followed, watch).unwrap();
                outcome = Some(name(&explanation, watch).unwrap().named.outcome);
            },
        );
        outcome.unwrap()
    };
    assert_eq!(outcome(0.02), Outcome::NoGap);
    assert_ne!(outcome(0.0), Outcome::NoGap);
}
