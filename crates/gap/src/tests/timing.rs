//! Delay and lag of actuators: one mechanism, whose member is named where refits tell it.

use hydro_effects::{Entry, Id};

use super::{fake::RigidBody, on_prepared, trial};
use crate::{
    likelihood::{explain::explain, followed::Followed},
    output::{records::Named, verdict::Outcome},
    stage::name::name,
};

/// The answer on trials in which every actuator lags by one time constant [s].
fn answered(lag: f64, noise: f64) -> Named {
    answered_on(&RigidBody::with_gains(), lag, noise)
}

/// The same on a nominal; the actuators begin at rest under commands that do not.
fn answered_on(nominal: &RigidBody, lag: f64, noise: f64) -> Named {
    let effects: Vec<Entry> = ["ahead", "aside", "up", "turn"]
        .map(|target| Entry {
            effect: Id::ActuatorLag,
            target: target.to_owned(),
            parameters: vec![lag],
        })
        .to_vec();
    let trials = (0..2).map(|seed| trial("timed", &effects, &[0.0, 0.0], seed, noise));
    let mut answer = None;
    on_prepared(nominal, trials.collect(), |problem, watch| {
        let followed = Followed::new(problem, watch).unwrap();
        let explanation = explain(&followed, watch).unwrap();
        answer = Some(name(&explanation, watch).unwrap().named);
    });
    answer.unwrap()
}

/// Commands of at most 0.3 Hz: of a short lag nothing shows but that the response comes late; of a longer one its spread too.
#[test]
fn slow_commands_leave_both_members_and_name_the_experiment() {
    let named = answered(0.06, 1.0);
    let ids: Vec<Id> = named.chosen.iter().map(|of| of.effect).collect();
    assert!(
        !ids.is_empty() && ids.iter().all(|id| *id == Id::ActuatorLag),
        "{ids:?} {:?}",
        named.ranking
    );
    let named = answered(0.03, 1.0);
    assert_eq!(named.outcome, Outcome::Confusable, "{:?}", named.ranking);
    let mut set = named.confusion_set.clone();
    set.sort_unstable();
    assert_eq!(set, [Id::ActuatorLag, Id::ActuatorDelay]);
    assert!(named.next_experiment.is_some() && named.chosen.is_empty());
    // Something is missing, whichever it is: the likeliest is added for it.
    let added = named.added();
    assert_eq!(added.len(), 4, "of every actuator");
    assert!(
        added
            .iter()
            .all(|of| of.effect == added[0].effect && set.contains(&of.effect))
    );
}

/// A log whose commands are there from its first row on does not say whether the actuators had them before.
#[test]
fn actuators_that_began_at_rest_are_told_from_those_whose_first_commands_were_held() {
    let named = answered_on(&RigidBody::with_a_start(), 0.4, 1.0);
    assert!(!named.chosen.is_empty(), "{:?}", named.ranking);
    for of in &named.chosen {
        assert_eq!(of.effect, Id::ActuatorLag, "{:?}", named.ranking);
        assert!((of.parameters[0].value / 0.4 - 1.0).abs() < 0.05);
    }
    let before = named.nuisances.last().unwrap();
    assert!(
        before.0 == "commands.before" && (before.1 + 1.0).abs() < 0.1,
        "{before:?}"
    );
}
