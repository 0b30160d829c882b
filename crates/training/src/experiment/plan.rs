//! Who is trained: the paper's models at the paper's sizes, ours, and the yardstick.

use std::{fmt, str::FromStr};

use hydro_model::{
    AttentionOdeConfig, CnodeConfig, Control, Encoding, LstmConfig, MlpConfig, MlpOdeConfig,
    ModelConfig, RelaxationOdeConfig, Solver, kinematics::Kinematics,
};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::TrainConfig;

/// One of the paper's two tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Experiment {
    /// Towing: 1.1 one condition, 1.2 changing ones, 1.3 with noise.
    Task1,
    /// Swimming under conditions that keep switching.
    Task2,
}

impl Experiment {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Task1, Self::Task2];

    /// Names of its data sets: Task 1's are folders below the one that is given, Task 2's is that folder itself.
    pub fn data(self) -> &'static [&'static str] {
        match self {
            Self::Task1 => &["1.1", "1.2", "1.3"],
            Self::Task2 => &["2"],
        }
    }
}

impl fmt::Display for Experiment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Task1 => "task1",
            Self::Task2 => "task2",
        })
    }
}

/// A name that is none.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("unknown experiment `{0}`: there are task1 and task2")]
pub struct UnknownExperiment(pub String);

impl FromStr for Experiment {
    type Err = UnknownExperiment;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|experiment| experiment.to_string() == name)
            .ok_or_else(|| UnknownExperiment(name.to_owned()))
    }
}

/// How long everybody may learn: the same for all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// Passes over the training split; nobody stops earlier.
    pub epochs: usize,
    /// Training trajectories; all without a number.
    pub trajectories: Option<usize>,
    /// Windows a step.
    pub batch: usize,
    /// Samples a window.
    pub horizon: usize,
}

impl Budget {
    /// That of the tables, by the name of the data set: about a thousand steps on Task 2, four hundred on each set of Task 1.
    pub fn full(data: &str) -> Self {
        Self {
            epochs: match data {
                // 154 trajectories of one or two windows; 1600 of one; 800 of eight.
                "1.1" => 48,
                "1.2" | "1.3" => 8,
                _ => 6,
            },
            trajectories: None,
            batch: 32,
            horizon: 50,
        }
    }

    /// A look: little of the data, some thirty steps.
    pub fn quick(data: &str) -> Self {
        Self {
            epochs: match data {
                "1.1" | "1.2" | "1.3" => 12,
                _ => 2,
            },
            trajectories: Some(64),
            ..Self::full(data)
        }
    }
}

/// A row of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Name in files and on command lines.
    pub id: &'static str,
    /// Name in the tables.
    pub label: &'static str,
    /// Kind and sizes.
    pub model: ModelConfig,
    /// How its equation is stepped.
    pub solver: Solver,
    /// Largest learning rates.
    pub learning_rates: LearningRates,
}

/// Largest learning rates of a row, by validation: `models/compare/README.md` has what was tried, `scripts/learning_rates.py`
/// tries it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearningRates {
    /// On 1.1.
    pub constant: f64,
    /// On 1.2, and on 1.3, which is 1.2 with noise.
    pub changing: f64,
    /// On Task 2.
    pub swimming: f64,
}

impl LearningRates {
    /// The same everywhere.
    pub fn same(rate: f64) -> Self {
        Self {
            constant: rate,
            changing: rate,
            swimming: rate,
        }
    }

    /// On the data set of this name.
    pub fn on(&self, data: &str) -> f64 {
        match data {
            "1.1" => self.constant,
            "1.2" | "1.3" => self.changing,
            _ => self.swimming,
        }
    }
}

impl Entry {
    /// Settings of its training on the data set of this name.
    pub fn training(&self, data: &str, budget: &Budget, seed: u64) -> TrainConfig {
        TrainConfig {
            model: self.model.clone(),
            solver: self.solver,
            learning_rate: self.learning_rates.on(data),
            seed,
            epochs: budget.epochs,
            patience: budget.epochs,
            batch: budget.batch,
            horizon: budget.horizon,
            trajectories: budget.trajectories,
            ..TrainConfig::default()
        }
    }
}

/// Every row for forces of `outputs` components, of a robot whose links are known or not. The four models of the paper have its
/// sizes and its raw features, h as long as the force and no linear part; beside them its other equation, ours with one mode
/// and with three, ours without the closed forms, the paper's four given what ours is given (what is the equation's merit, and
/// what the features'?), and two memoryless yardsticks: a perceptron of the paper's field, and one that is given what ours is
/// given.
pub fn entries(outputs: usize, kinematics: Option<&Kinematics>) -> Vec<Entry> {
    use Solver::{DormandPrince, Euler, Rk4};
    let mlp_ode = ModelConfig::MlpOde(MlpOdeConfig {
        latent: outputs,
        encoding: Encoding::Raw,
        skip: false,
        ..MlpOdeConfig::default()
    });
    let attention = AttentionOdeConfig {
        latent: outputs,
        encoding: Encoding::Raw,
        skip: false,
        ..AttentionOdeConfig::default()
    };
    let sum = ModelConfig::AttentionOde(AttentionOdeConfig {
        field_sees_force: false,
        ..attention.clone()
    });
    let attention = ModelConfig::AttentionOde(attention);
    let cnode = |control| {
        ModelConfig::Cnode(CnodeConfig {
            encoding: Encoding::Raw,
            control,
            ..CnodeConfig::default()
        })
    };
    let (natural, hermite) = (cnode(Control::Natural), cnode(Control::Hermite));
    let lstm = ModelConfig::Lstm(LstmConfig {
        encoding: Encoding::Raw,
        skip: false,
        ..LstmConfig::default()
    });
    let ours = RelaxationOdeConfig::with_kinematics(kinematics);
    let encoding = || ours.encoding.clone();
    let mlp_ode_informed = ModelConfig::MlpOde(MlpOdeConfig {
        encoding: encoding(),
        ..MlpOdeConfig::default()
    });
    let attention_informed = ModelConfig::AttentionOde(AttentionOdeConfig {
        encoding: encoding(),
        ..AttentionOdeConfig::default()
    });
    // Its field has a column for every number that it is given: with those of the links, four times the weights.
    let cnode_informed = ModelConfig::Cnode(CnodeConfig {
        encoding: Encoding::Hydrodynamic,
        ..CnodeConfig::default()
    });
    let lstm_informed = ModelConfig::Lstm(LstmConfig {
        encoding: encoding(),
        ..LstmConfig::default()
    });
    let informed = ModelConfig::Mlp(MlpConfig {
        encoding: encoding(),
        hidden: ours.hidden.clone(),
        ..MlpConfig::default()
    });
    let plain = ModelConfig::RelaxationOde(RelaxationOdeConfig {
        encoding: Encoding::Raw,
        ..ours.clone()
    });
    let modes = ModelConfig::RelaxationOde(RelaxationOdeConfig {
        modes: 3,
        ..ours.clone()
    });
    let relaxation = ModelConfig::RelaxationOde(ours);
    let mlp = ModelConfig::Mlp(MlpConfig {
        encoding: Encoding::Raw,
        skip: false,
        ..MlpConfig::default()
    });
    let rows = [
        (
            "mlp-ode-euler",
            "MLP-ODE, Euler",
            &mlp_ode,
            Euler,
            [2e-3, 4e-3, 2e-3],
        ),
        (
            "mlp-ode-rk4",
            "MLP-ODE, RK4",
            &mlp_ode,
            Rk4,
            [2e-3, 4e-3, 2e-3],
        ),
        (
            "mlp-ode-dopri5",
            "MLP-ODE, Dormand-Prince",
            &mlp_ode,
            DormandPrince,
            [2e-3, 1e-3, 2e-3],
        ),
        (
            "attention-ode-euler",
            "Attention-ODE, Euler",
            &attention,
            Euler,
            [125e-6, 4e-3, 1e-3],
        ),
        (
            "attention-ode-rk4",
            "Attention-ODE, RK4",
            &attention,
            Rk4,
            [125e-6, 4e-3, 1e-3],
        ),
        (
            "attention-ode-dopri5",
            "Attention-ODE, Dormand-Prince",
            &attention,
            DormandPrince,
            [125e-6, 1e-3, 1e-3],
        ),
        (
            "attention-ode-sum",
            "Attention-ODE, field without F",
            &sum,
            Euler,
            [125e-6, 4e-3, 1e-3],
        ),
        (
            "cnode-natural-rk4",
            "CNODE, natural spline, RK4 (sees the whole trajectory)",
            &natural,
            Rk4,
            [1e-3, 4e-3, 1e-3],
        ),
        (
            "cnode-hermite-rk4",
            "CNODE, causal Hermite, RK4",
            &hermite,
            Rk4,
            [1e-3, 4e-3, 1e-3],
        ),
        (
            "cnode-hermite-euler",
            "CNODE, causal Hermite, Euler",
            &hermite,
            Euler,
            [1e-3, 4e-3, 1e-3],
        ),
        ("lstm", "LSTM", &lstm, Euler, [8e-3, 64e-3, 4e-3]),
        (
            "relaxation-ode",
            "Relaxation-ODE (ours)",
            &relaxation,
            Euler,
            [4e-3, 16e-3, 4e-3],
        ),
        (
            "relaxation-ode-modes",
            "Relaxation-ODE, three modes (ours)",
            &modes,
            Euler,
            [4e-3, 16e-3, 2e-3],
        ),
        (
            "relaxation-ode-raw",
            "Relaxation-ODE, raw features",
            &plain,
            Euler,
            [8e-3, 32e-3, 8e-3],
        ),
        (
            "mlp-ode-informed",
            "MLP-ODE, our features",
            &mlp_ode_informed,
            Euler,
            [4e-3, 4e-3, 4e-3],
        ),
        (
            "attention-ode-informed",
            "Attention-ODE, our features",
            &attention_informed,
            Euler,
            [4e-3, 4e-3, 2e-3],
        ),
        (
            "cnode-informed",
            "CNODE, our features of the base",
            &cnode_informed,
            Euler,
            [1e-3, 2e-3, 250e-6],
        ),
        (
            "lstm-informed",
            "LSTM, our features",
            &lstm_informed,
            Euler,
            [8e-3, 32e-3, 4e-3],
        ),
        (
            "mlp",
            "memoryless MLP (yardstick)",
            &mlp,
            Euler,
            [2e-3, 4e-3, 4e-3],
        ),
        (
            "mlp-informed",
            "memoryless MLP, our features (yardstick)",
            &informed,
            Euler,
            [16e-3, 4e-3, 4e-3],
        ),
    ];
    rows.into_iter()
        .map(
            |(id, label, model, solver, [constant, changing, swimming])| Entry {
                id,
                label,
                model: model.clone(),
                solver,
                learning_rates: LearningRates {
                    constant,
                    changing,
                    swimming,
                },
            },
        )
        .collect()
}

/// One training and its examination.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct JobId {
    /// Name of the data set.
    pub data: String,
    /// [`Entry::id`].
    pub entry: String,
    /// Of the first weights and of the order of the data.
    pub seed: u64,
}

impl fmt::Display for JobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}/seed-{}", self.data, self.entry, self.seed)
    }
}

impl FromStr for JobId {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let read = || {
            let mut parts = text.split('/');
            let (data, entry) = (parts.next()?, parts.next()?);
            let seed = parts.next()?.strip_prefix("seed-")?.parse().ok()?;
            parts.next().is_none().then(|| Self {
                data: data.to_owned(),
                entry: entry.to_owned(),
                seed,
            })
        };
        read().ok_or_else(|| format!("job `{text}`: expected DATA/ENTRY/seed-N, as 2/lstm/seed-0"))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

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

    #[test]
    fn names_are_read_back_and_others_refused() {
        let job = JobId {
            data: "1.2".to_owned(),
            entry: "lstm".to_owned(),
            seed: 7,
        };
        assert_eq!(job.to_string().parse(), Ok(job));
        for wrong in [
            "",
            "2/lstm",
            "2/lstm/7",
            "2/lstm/seed-x",
            "2/lstm/seed-0/more",
        ] {
            assert!(wrong.parse::<JobId>().is_err(), "{wrong}");
        }
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
}
