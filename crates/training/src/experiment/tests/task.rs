//! Names of experiments.

use super::*;

#[test]
fn names_are_read_back_and_others_refused() {
    for experiment in Experiment::ALL {
        assert_eq!(experiment.to_string().parse(), Ok(experiment));
    }
    let error = "task3"
        .parse::<Experiment>()
        .expect_err("no such experiment");
    assert_eq!(
        error.to_string(),
        "unknown experiment `task3`: there are task1 and task2"
    );
}
