//! Rows of the tables: the paper's models at the paper's sizes, ours, and memoryless baselines.

use hydro_model::{
    AttentionOdeConfig, CnodeConfig, Control, Encoding, LstmConfig, MlpConfig, MlpOdeConfig,
    ModelConfig, RelaxationOdeConfig, Solver, Tokens, kinematics::Kinematics,
};

use super::budget::Budget;
use crate::trainer::TrainConfig;

/// A row of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Name in files and on command lines.
    pub id: &'static str,
    /// Name in the tables.
    pub label: &'static str,
    /// Kind and sizes.
    pub model: ModelConfig,
    /// Solver of its equation.
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
/// sizes and its raw features, h as long as the force and no linear part; beside them its other equation, attention over the features and
/// steps by the sample at their end (at the rates of the former, which were not searched for these), ours with one mode
/// and with three, ours without the closed forms, the paper's four given what ours is given (what is the equation's merit, and
/// what the features'?), and two memoryless baselines: a perceptron of the paper's field, and one that is given what ours is
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
    let over_features = AttentionOdeConfig {
        tokens: Tokens::Features,
        window: 1,
        ..attention.clone()
    };
    let over_features_end = ModelConfig::AttentionOde(AttentionOdeConfig {
        end_of_step: true,
        ..over_features.clone()
    });
    let over_features = ModelConfig::AttentionOde(over_features);
    let attention_end = ModelConfig::AttentionOde(AttentionOdeConfig {
        end_of_step: true,
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
            "attention-ode-end",
            "Attention-ODE, sample at the end of the step",
            &attention_end,
            Euler,
            [125e-6, 4e-3, 1e-3],
        ),
        (
            "attention-features-euler",
            "Attention-ODE over the features, Euler",
            &over_features,
            Euler,
            [125e-6, 4e-3, 1e-3],
        ),
        (
            "attention-features-end",
            "Attention-ODE over the features, sample at the end of the step",
            &over_features_end,
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
            "memoryless MLP (baseline)",
            &mlp,
            Euler,
            [2e-3, 4e-3, 4e-3],
        ),
        (
            "mlp-informed",
            "memoryless MLP, our features (baseline)",
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

#[cfg(test)]
#[path = "tests/entries.rs"]
mod tests;
