//! The whole workflow on a rigid body, with separate truths.

use std::{collections::BTreeMap, sync::atomic::AtomicBool};

use hydro_effects::{Entry, Id};

use super::{fake::RigidBody, on_hull, on_prepared, settings, trial, under};
use crate::{
    likelihood::{explain::explain, followed::Followed},
    output::{
        records::{Named, Verified},
        verdict::{Outcome, SensorPatch},
    },
    problem::problem::Problem,
    progress::Watch,
    stage::{
        add::add,
        conclude::conclude,
        locate::locate,
        name::name,
        verify::{VerifyInput, verify},
    },
    trial::Trial,
};

fn run(effects: &[Entry]) -> Named {
    let plant = RigidBody::new();
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    let trials = || -> Vec<Trial> {
        (0..4)
            .map(|at| trial(&format!("trial {at}"), effects, &[0.02, -0.02], at, 1.0))
            .collect()
    };
    let settings = settings();
    let problem = Problem::prepare(&plant, trials(), settings.clone(), &watch).unwrap();
    let followed = Followed::new(&problem, &watch).unwrap();
    let found = locate(&followed, &[], &watch).unwrap();
    let explanation = explain(&followed, &watch).unwrap();
    let naming = name(&explanation, &watch).unwrap();
    assert_eq!(
        found.p_value < 0.05,
        !effects.is_empty(),
        "{}",
        found.p_value
    );
    if effects.is_empty() {
        // Innovations over their covariance are those of the noise.
        assert!((found.excess - 1.0).abs() < 0.05, "{}", found.excess);
        assert_eq!(
            (naming.named.explained, naming.named.chosen.len()),
            (None, 0)
        );
    } else {
        assert!(naming.named.calibration.alarm <= 0.03);
    }
    let addition = add(&explanation, &naming);
    // The numbers of the nominal are handed on as this fit has them.
    let numbers = addition.iter().flat_map(|addition| {
        assert_eq!(addition.numbers.len(), addition.deviations.len());
        addition.numbers.iter().zip(&addition.deviations)
    });
    for ((nuisance, value), deviation) in numbers {
        let truth = if nuisance.name == "hull.mass" {
            0.02
        } else {
            -0.02
        };
        assert!(
            (value - truth).abs() < 4.0 * deviation && *deviation <= 0.03,
            "{} {value} {deviation}",
            nuisance.name
        );
    }
    let unseen = || -> Vec<Trial> {
        (10..13)
            .map(|at| trial(&format!("trial {at}"), effects, &[0.02, -0.02], at, 1.0))
            .collect()
    };
    let none = BTreeMap::new();
    let input = VerifyInput {
        before: &plant,
        after: &plant,
        sensors: &none,
        cross_fit: &[],
        recalibrated: &[],
        commands_before: 0.0,
        own: None,
    };
    // Nothing was patched: the same plant twice is no better, so nothing is claimed.
    let channels = &found.channels;
    let verified = verify(&input, unseen(), Vec::new(), channels, &settings, &watch).unwrap();
    assert_eq!(verified.gap.reduction, Some(0.0));
    let added = addition.map(|addition| addition.added);
    if let Some(added) = &added {
        // Fits that left a trial out explain it.
        let input = VerifyInput {
            cross_fit: &added.cross_fit,
            recalibrated: &added.recalibrated,
            commands_before: added.commands_before,
            ..input
        };
        let fitted = added.cross_fit.len();
        let crossed = verify(&input, unseen(), trials(), channels, &settings, &watch).unwrap();
        assert!(crossed.cross_fitted && crossed.gap.n_holdout_trials == fitted + 3);
        assert!(crossed.gap.reduction > Some(0.2), "{:?}", crossed.gap);
        // Numbers alone do less than with the effect.
        let alone = crossed.recalibrated.unwrap();
        assert!(alone > crossed.gap.after.unwrap(), "{alone}");
        // What is there predicts trials that were left out better than numbers do.
        let gain: f64 = added.cross_fit.iter().map(|without| without.gain).sum();
        assert!(gain > 3.0, "{gain}");
        // The file is no better, so nothing is accepted.
        assert!(!crossed.accepted, "{:?}", crossed.refused_because);
    }
    let verdict = conclude(&found, &naming.named, added.as_ref(), Some(&verified));
    assert!(verdict.named.is_empty() && !verdict.verified);
    assert_eq!(verdict.verdict, naming.named.outcome);
    assert_eq!(verdict.doubts, naming.named.remarks);
    // What held-out trials contradict is no name.
    let contradicted = Verified {
        contradicted: true,
        ..verified
    };
    let verdict = conclude(&found, &naming.named, added.as_ref(), Some(&contradicted));
    if naming.named.outcome == Outcome::Named {
        assert_eq!(verdict.verdict, Outcome::Unknown);
        assert!(verdict.contradicted && verdict.effects.iter().all(|effect| effect.surrogate));
        assert_eq!((verdict.explained, verdict.unexplained), (None, Some(1.0)));
    }
    naming.named
}

/// The name stage on trials of the plain body.
fn named_of(trials: Vec<Trial>) -> Named {
    let mut found = None;
    on_prepared(&RigidBody::new(), trials, |problem, watch| {
        let followed = Followed::new(problem, watch).unwrap();
        let explanation = explain(&followed, watch).unwrap();
        found = Some(name(&explanation, watch).unwrap().named);
    });
    found.unwrap()
}

#[test]
fn nothing_missing_is_no_gap() {
    assert_eq!(run(&[]).outcome, Outcome::NoGap);
}

#[test]
fn quadratic_drag_is_named() {
    let entry = on_hull(Id::QuadraticDrag, vec![25.0, 40.0, 40.0, 0.0, 0.0, 1.0]);
    let named = run(&[entry]);
    assert_eq!(named.outcome, Outcome::Named);
    assert_eq!(named.chosen[0].effect, Id::QuadraticDrag);
}

/// A sensor's scale that runs to the end of what is plausible stands for something else.
#[test]
fn a_value_at_the_edge_of_what_is_plausible_is_no_name() {
    let scaled = |scale: f64| {
        let trials = (0..2).map(|at| {
            let mut trial = trial(&format!("trial {at}"), &[], &[0.02, -0.02], at, 1.0);
            let columns = trial.sensors.columns.len();
            for row in trial.sensors.data.chunks_mut(columns) {
                row[7..10].iter_mut().for_each(|value| *value *= scale);
            }
            trial
        });
        let named = named_of(trials.collect());
        (named.outcome, named.remarks.join("; "))
    };
    assert_eq!(scaled(1.2), (Outcome::Named, String::new()));
    let (outcome, remarks) = scaled(1.45);
    assert_eq!(outcome, Outcome::Unknown);
    let said = [
        "the likeliest explanation is not named, for values are at the end of what is plausible: `scale` of a sensor scale on `dvl` is",
        "to 1.3; plausible: 0.7 to 1.3)",
    ];
    assert!(
        remarks.starts_with(said[0]) && remarks.ends_with(said[1]),
        "{remarks}"
    );
}

/// Where a set with plausible values explains as much as is asked for, it is named, and what was left out is told.
#[test]
fn what_explains_enough_is_named_beside_a_value_at_the_edge() {
    let drag = on_hull(Id::QuadraticDrag, vec![250.0, 400.0, 400.0, 0.0, 0.0, 10.0]);
    let named = |least: f64| {
        let trials = (0..2).map(|at| {
            let effects = std::slice::from_ref(&drag);
            let mut trial = trial(&format!("trial {at}"), effects, &[0.02, -0.02], at, 1.0);
            let columns = trial.sensors.columns.len();
            for row in trial.sensors.data.chunks_mut(columns) {
                row[10..13].iter_mut().for_each(|value| *value *= 1.6);
            }
            trial
        });
        let mut settings = settings();
        settings.options.name.plausible = least;
        let mut found = None;
        under(
            settings,
            &RigidBody::new(),
            trials.collect(),
            |problem, watch| {
                let followed = Followed::new(problem, watch).unwrap();
                let explanation = explain(&followed, watch).unwrap();
                found = Some(name(&explanation, watch).unwrap().named);
            },
        );
        let named = found.unwrap();
        (named.outcome, named.remarks.join("; "))
    };
    let (outcome, remarks) = named(0.9);
    assert_eq!(outcome, Outcome::Unknown, "{remarks}");
    let (outcome, remarks) = named(0.2);
    assert_eq!(outcome, Outcome::Named, "{remarks}");
    assert!(
        remarks.contains("which were left out: `scale` of a sensor scale on `gyro`"),
        "{remarks}"
    );
}

/// A mass that is four standard deviations from the nominal's is said.
#[test]
fn a_number_far_from_what_was_said_of_it_is_told() {
    let of_mass = |mass: f64| {
        let trials = (0..2).map(|at| trial(&format!("trial {at}"), &[], &[mass, 0.0], at, 1.0));
        named_of(trials.collect()).remarks.join("; ")
    };
    let (near, far) = (of_mass(0.04), of_mass(0.12));
    assert!(!near.contains("hull.mass"), "{near}");
    assert!(far.contains("`hull.mass` by +"), "{far}");
}

/// A number that is moved almost as far as it may be casts a doubt, and takes no name away.
#[test]
fn a_number_near_the_edge_of_what_it_may_be_is_told_beside_the_name() {
    let drag = on_hull(Id::QuadraticDrag, vec![25.0, 40.0, 40.0, 0.0, 0.0, 1.0]);
    let beside = |mass: f64| {
        let effects = std::slice::from_ref(&drag);
        let trials = (0..2).map(|at| trial(&format!("trial {at}"), effects, &[mass, 0.0], at, 1.0));
        let named = named_of(trials.collect());
        let names: Vec<Id> = named.chosen.iter().map(|of| of.effect).collect();
        assert_eq!(named.outcome, Outcome::Named);
        assert_eq!(names, [Id::QuadraticDrag]);
        named.remarks.join("; ")
    };
    assert_eq!(beside(0.04), "");
    let remarks = beside(0.145);
    assert!(
        remarks.contains("in standard deviations: `hull.mass` by +4."),
        "{remarks}"
    );
}

/// The run does not end with it.
#[test]
fn an_addition_that_blows_up_is_refused() {
    let (plant, after) = (RigidBody::new(), RigidBody::unstable());
    let none = BTreeMap::new();
    let input = VerifyInput {
        before: &plant,
        after: &after,
        sensors: &none,
        cross_fit: &[],
        recalibrated: &[],
        commands_before: 0.0,
        own: None,
    };
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    let unseen = (0..2).map(|at| trial(&at.to_string(), &[], &[0.0, 0.0], at, 1.0));
    let verified = verify(
        &input,
        unseen.collect(),
        Vec::new(),
        &[],
        &settings(),
        &watch,
    )
    .unwrap();
    assert!(!verified.accepted && verified.gap.reduction < Some(0.0));
}

/// The velocities of a trial as they were so long before, linear between its rows.
fn late(mut trial: Trial, delay: f64) -> Trial {
    let sensors = &mut trial.sensors;
    let (width, part) = (sensors.columns.len(), delay / 0.02);
    let is_late = |column: usize| sensors.columns[column].starts_with("dvl");
    for at in (width..sensors.data.len()).rev() {
        if is_late(at % width) {
            sensors.data[at] += part * (sensors.data[at - width] - sensors.data[at]);
        }
    }
    trial
}

/// Steps are of 5 ms: a shorter delay of a sensor cannot be told from when within a step it reads.
#[test]
fn a_sensors_delay_of_less_than_a_step_is_none() {
    let delays = |delay: f64| -> Vec<f64> {
        let trials = (0..2).map(|seed| late(trial("late", &[], &[0.0, 0.0], seed, 0.1), delay));
        let mut found = Vec::new();
        on_prepared(&RigidBody::new(), trials.collect(), |problem, watch| {
            let followed = Followed::new(problem, watch).unwrap();
            let explanation = explain(&followed, watch).unwrap();
            let named = name(&explanation, watch).unwrap().named;
            let delays = named.chosen.into_iter();
            let delays = delays.filter(|of| of.effect == Id::SensorDelay && of.target == "dvl");
            found = delays.map(|of| of.parameters[0].value).collect();
        });
        found
    };
    assert!(delays(0.003).is_empty());
    let long = delays(0.015);
    assert!(
        matches!(long[..], [value] if (value - 0.015).abs() < 0.003),
        "{long:?}"
    );
}

#[test]
fn added_mass_is_named() {
    let entry = on_hull(Id::AddedMass, vec![8.0, 15.0, 18.0, 0.1, 0.2, 0.2]);
    let named = run(&[entry]);
    assert_eq!(named.chosen[0].effect, Id::AddedMass);
}

/// Away from the origin of the body, about which a first screen knows nothing while there is no mass.
#[test]
fn a_payload_is_named_with_its_place() {
    let entry = on_hull(Id::Payload, vec![1.0, 0.25, 0.0, 0.05]);
    let named = run(&[entry]);
    let ids: Vec<Id> = named.chosen.iter().map(|effect| effect.effect).collect();
    assert_eq!(ids, [Id::Payload]);
    let x = &named.chosen[0].parameters[1];
    assert!((x.value - 0.25).abs() < 0.03, "{x:?}");
}

/// Weight away from the centre of mass, where it weighs nothing, is no rival of an offset of buoyancy.
#[test]
fn an_offset_of_buoyancy_is_named_alone() {
    let entry = on_hull(Id::BuoyancyOffset, vec![0.02, 0.01, 0.0]);
    let named = run(&[entry]);
    assert_eq!(named.outcome, Outcome::Named, "{:?}", named.confusion_set);
    assert_eq!(named.chosen[0].effect, Id::BuoyancyOffset);
    assert_forms_are_one(&named);
}

#[test]
fn buoyancy_away_from_the_centre_of_mass_is_one_effect() {
    let entry = on_hull(Id::NetBuoyancy, vec![20.0, 0.0, 1.0, 0.0]);
    let named = run(&[entry]);
    let ids: Vec<Id> = named.chosen.iter().map(|effect| effect.effect).collect();
    assert_eq!(ids, [Id::NetBuoyancy]);
    assert_eq!(named.chosen[0].parameters.len(), 4);
    assert_forms_are_one(&named);
}

/// Forms share what an effect on a body may have: what is optional is rarely there.
#[test]
fn forms_share_the_prior_of_their_effect() {
    let trials = vec![trial("one", &[], &[0.0, 0.0], 1, 1.0)];
    on_prepared(&RigidBody::new(), trials, |problem, _| {
        let of = |id: Id| -> Vec<f64> {
            (0..problem.candidates.len())
                .filter(|at| problem.candidates[*at].effect == id)
                .map(|at| problem.priors[at].log_share.exp())
                .collect()
        };
        let (munk, weight) = (of(Id::MunkMoment), of(Id::NetBuoyancy));
        assert_eq!((munk.len(), weight.len()), (1, 2));
        assert!((weight[0] + weight[1] - munk[0]).abs() < 1e-12);
        // A lift refines a drag.
        assert!(of(Id::Lift)[0] < 0.5 * munk[0]);
        assert!(weight[1] < 0.5 * weight[0], "{weight:?}");
    });
}

/// A memory, a lift, an added mass without a drag: unlikely where the model has no fluid, else as any.
#[test]
fn what_presupposes_a_drag_is_unaccompanied_without_one() {
    for (body, dry) in [
        (RigidBody::without_fluid(), true),
        (RigidBody::new(), false),
    ] {
        let trials = vec![trial("one", &[], &[0.0, 0.0], 1, 1.0)];
        on_prepared(&body, trials, |problem, _| {
            let of = |id: Id| {
                let mut all = 0..problem.candidates.len();
                all.find(|at| problem.candidates[*at].effect == id).unwrap()
            };
            let drag = of(Id::LinearDrag);
            for id in [Id::WakeMemory, Id::BassetHistory, Id::Lift, Id::AddedMass] {
                let at = of(id);
                assert_eq!(problem.is_unaccompanied(at, &[at]), dry, "{id}");
                assert_eq!(
                    problem.is_unaccompanied(at, &[of(Id::Payload), at]),
                    dry,
                    "{id}"
                );
                assert!(!problem.is_unaccompanied(at, &[drag, at]), "{id}");
            }
            assert!(!problem.is_unaccompanied(drag, &[drag]));
        });
    }
}

/// A hypothesis, or an effect, stands once, whatever its forms.
fn assert_forms_are_one(named: &crate::output::records::Named) {
    for (at, of) in named.ranking.iter().enumerate() {
        let before = &named.ranking[..at];
        assert!(
            !before.iter().any(|other| other.effects == of.effects),
            "{of:?}"
        );
    }
    let sum: f64 = named.ranking.iter().map(|of| of.probability).sum();
    assert!((sum - 1.0).abs() < 1e-6, "{sum}");
    for (at, of) in named.effects.iter().enumerate() {
        let mut before = named.effects[..at].iter();
        assert!(!before.any(|other| (other.effect, &other.target) == (of.effect, &of.target)));
    }
}

/// Whatever the answer, it is of that trial alone, and the verdict says so.
#[test]
fn of_one_trial_no_reduction_is_claimed_and_the_verdict_says_why() {
    let drag = on_hull(Id::QuadraticDrag, vec![25.0, 40.0, 40.0, 0.0, 0.0, 1.0]);
    let plant = RigidBody::new();
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    for (effects, outcome) in [(vec![], Outcome::NoGap), (vec![drag], Outcome::Named)] {
        let one = vec![trial("alone", &effects, &[0.02, -0.02], 0, 1.0)];
        let problem = Problem::prepare(&plant, one, settings(), &watch).unwrap();
        let followed = Followed::new(&problem, &watch).unwrap();
        let found = locate(&followed, &[], &watch).unwrap();
        let explanation = explain(&followed, &watch).unwrap();
        let naming = name(&explanation, &watch).unwrap();
        let added = add(&explanation, &naming).map(|addition| addition.added);
        let verdict = conclude(&found, &naming.named, added.as_ref(), None);
        assert_eq!(verdict.verdict, outcome);
        let why = verdict.refused_because.unwrap();
        assert!(why.starts_with("there is a single trial"), "{why}");
        assert!(verdict.named.is_empty() && !verdict.verified && verdict.patch.is_none());
        assert_eq!(
            (verdict.gap.reduction, verdict.gap.n_holdout_trials),
            (None, 0)
        );
        // Also what no effect explains, whatever else is known of it.
        let mut unknown = naming.named.clone();
        unknown.outcome = Outcome::Unknown;
        let why = conclude(&found, &unknown, None, None).refused_because;
        assert!(why.unwrap().starts_with("there is a single trial"));
    }
}

/// The three fields of `patch.sensors` in `verdict.json`.
#[test]
fn a_corrected_sensor_has_bias_scale_and_delay() {
    let of = |patch: &SensorPatch| serde_json::to_value(patch).unwrap();
    let vector = of(&SensorPatch::none(3));
    assert_eq!(
        vector,
        serde_json::json!({"bias": [0.0, 0.0, 0.0], "scale": 1.0, "delay": 0.0})
    );
    let scalar = SensorPatch {
        delay: 0.04,
        ..SensorPatch::none(1)
    };
    assert_eq!(
        of(&scalar),
        serde_json::json!({"bias": 0.0, "scale": 1.0, "delay": 0.04})
    );
    // Files of before had only what was corrected.
    let before: SensorPatch = serde_json::from_str(r#"{"delay": 0.04}"#).unwrap();
    assert_eq!(before, scalar);
}
