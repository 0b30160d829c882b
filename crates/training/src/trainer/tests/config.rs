//! Bounds of the settings, and their JSON.

use super::*;

#[test]
fn every_bound_is_named() {
    type Change = fn(&mut TrainConfig);
    let cases: [(Change, &str); 13] = [
        (
            |c| c.epochs = 2_000_000,
            "epochs is 2000000, expected 1000000 at most",
        ),
        (
            |c| c.batch = 1 << 40,
            "batch is 1099511627776, expected 65536 at most",
        ),
        (
            |c| {
                c.adjoint = Adjoint::Continuous;
                c.model = ModelConfig::Mlp(hydro_model::MlpConfig::default());
            },
            "adjoint is continuous, expected discrete, the only one of the model mlp",
        ),
        (
            |c| {
                c.adjoint = Adjoint::Continuous;
                c.solver = Solver::DormandPrince;
            },
            "adjoint is continuous, expected discrete, the only one of the solver dopri5",
        ),
        (
            |c| {
                c.solver = Solver::DormandPrince;
                c.model = ModelConfig::Cnode(hydro_model::CnodeConfig::default());
            },
            "model configuration: solver is dopri5, expected euler or rk4: a CNODE's path has its slopes at the \
             times of fixed steps",
        ),
        (
            |c| {
                c.model = ModelConfig::RelaxationOde(hydro_model::RelaxationOdeConfig {
                    modes: 0,
                    ..hydro_model::RelaxationOdeConfig::default()
                });
            },
            "model configuration: modes is 0, expected from 1 to 5",
        ),
        (
            |c| {
                c.model = ModelConfig::RelaxationOde(hydro_model::RelaxationOdeConfig {
                    modes: 6,
                    ..hydro_model::RelaxationOdeConfig::default()
                });
            },
            "model configuration: modes is 6, expected from 1 to 5",
        ),
        (|c| c.epochs = 0, "epochs is 0, expected at least 1"),
        (|c| c.horizon = 1, "horizon is 1, expected at least 2"),
        (
            |c| c.learning_rate = 0.0,
            "learning_rate is 0, expected above 0 and at most 1",
        ),
        (
            |c| c.clip_norm = f64::NAN,
            "clip_norm is NaN, expected above 0",
        ),
        (|c| c.warm_up = 1.5, "warm_up is 1.5, expected from 0 to 1"),
        (
            |c| c.weight_decay = -1.0,
            "weight_decay is -1, expected 0 or more",
        ),
    ];
    for (change, expected) in cases {
        let mut config = TrainConfig::default();
        change(&mut config);
        assert_eq!(
            config.check().expect_err("out of range").to_string(),
            expected
        );
    }
    TrainConfig::default()
        .check()
        .expect("the defaults are valid");
}

#[test]
fn settings_survive_json_and_unknown_ones_are_refused() {
    let text = serde_json::to_string(&TrainConfig::default()).expect("serialises");
    assert_eq!(
        serde_json::from_str::<TrainConfig>(&text).expect("parses"),
        TrainConfig::default()
    );
    let error = serde_json::from_str::<TrainConfig>("{\"epoch\": 3}").expect_err("unknown");
    assert!(
        error.to_string().contains("unknown field `epoch`"),
        "{error}"
    );
}

#[test]
fn the_first_setting_that_differs_is_named() {
    let expected = TrainConfig::default();
    assert_eq!(expected.difference(&expected), None);
    type Change = fn(&mut TrainConfig);
    let cases: [(Change, &str); 4] = [
        (|c| c.epochs = 3, "epochs is 3, expected 40"),
        (
            |c| c.trajectories = Some(7),
            "trajectories is 7, expected null",
        ),
        (
            |c| {
                c.model = ModelConfig::AttentionOde(AttentionOdeConfig {
                    heads: 1,
                    ..AttentionOdeConfig::default()
                });
            },
            "heads is 1, expected",
        ),
        (
            |c| c.model = ModelConfig::Mlp(hydro_model::MlpConfig::default()),
            "model.",
        ),
    ];
    for (change, words) in cases {
        let mut found = TrainConfig::default();
        change(&mut found);
        let text = found.difference(&expected).expect("a difference");
        assert!(text.contains(words), "{text}");
    }
}
