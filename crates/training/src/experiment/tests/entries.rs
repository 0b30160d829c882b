//! Entries have names of their own and can be trained.

use std::collections::BTreeSet;

use super::*;
use crate::experiment::Experiment;

#[test]
fn entries_have_names_of_their_own_and_can_be_built_and_trained() {
    for (experiment, outputs) in [(Experiment::Task1, 2), (Experiment::Task2, 6)] {
        let entries = entries(outputs, None);
        let ids: BTreeSet<&str> = entries.iter().map(|entry| entry.id).collect();
        let labels: BTreeSet<&str> = entries.iter().map(|entry| entry.label).collect();
        assert_eq!((ids.len(), labels.len()), (entries.len(), entries.len()));
        for entry in entries {
            for data in experiment.data() {
                for budget in [Budget::full(data), Budget::quick(data)] {
                    entry
                        .training(data, &budget, 3)
                        .check()
                        .expect("valid settings");
                }
            }
        }
    }
}
