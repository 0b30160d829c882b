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
    let effects: Vec<Entry> = ["ahead", "aside", "up", "turn"]
        .map(|target| Entry {
            effect: Id::ActuatorLag,
            target: target.to_owned(),
            parameters: vec![lag],
        })
        .to_vec();
    let trials = (0..2).map(|seed| trial("timed", &effects, &[0.0, 0.0], seed, noise));
    let mut answer = None;
    on_prepared(
        &RigidBody::with_gains(),
        trials.collect(),
        |problem, watch| {
            let followed = Followed::new(problem, watch).unwrap();
            let explanation = explain(&followed, watch).unwrap();
            answer = Some(name(&explanation, watch).unwrap().named);
        },
    );
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
