//! Settings of a training run.

use hydro_model::{Adjoint, AttentionOdeConfig, ModelConfig, Outputs, Solver};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::TrainError;

/// Most passes over the data.
const MOST_EPOCHS: usize = 1_000_000;
/// Most windows a step.
const MOST_BATCH: usize = 65_536;

/// Which wrench the model is fitted to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Labels {
    /// The perturbed one, as a measurement would be.
    #[default]
    Perturbed,
    /// The clean one.
    Clean,
}

/// Settings of a training run; the same settings, data and seed give the same weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainConfig {
    /// Kind and sizes.
    pub model: ModelConfig,
    /// Solver of the ODE.
    pub solver: Solver,
    /// Gradient to follow: of the solver's steps, or of the differential equation. With the latter the
    /// log says every epoch how far it is from the former.
    pub adjoint: Adjoint,
    /// Seed of the first weights and of the order of windows.
    pub seed: u64,
    /// Passes over the training split.
    pub epochs: usize,
    /// Windows a step.
    pub batch: usize,
    /// Samples a window, the start included; held to the length of a trajectory.
    pub horizon: usize,
    /// Share of windows that start as a run does, without a past.
    pub cold_start: f64,
    /// Largest learning rate.
    pub learning_rate: f64,
    /// Share of all steps over which the learning rate rises from zero.
    pub warm_up: f64,
    /// Learning rate at the end, as a share of the largest; a cosine leads there.
    pub final_share: f64,
    /// AdamW's decay of weight matrices, per unit of learning rate.
    pub weight_decay: f64,
    /// Largest norm of the gradient over all weights.
    pub clip_norm: f64,
    /// Epochs without a better validation error after which training stops.
    pub patience: usize,
    /// Which wrench to fit.
    pub labels: Labels,
    /// Training trajectories used; all without a number.
    pub trajectories: Option<usize>,
    /// The wrench on the base, or the torques of the joints too.
    pub outputs: Outputs,
}

impl Default for TrainConfig {
    fn default() -> Self {
        Self {
            model: ModelConfig::AttentionOde(AttentionOdeConfig::default()),
            solver: Solver::Euler,
            adjoint: Adjoint::Discrete,
            seed: 0,
            epochs: 40,
            batch: 32,
            horizon: 50,
            cold_start: 0.1,
            learning_rate: 4e-3,
            warm_up: 0.03,
            final_share: 0.01,
            weight_decay: 1e-2,
            clip_norm: 1.0,
            patience: 20,
            labels: Labels::Perturbed,
            trajectories: None,
            outputs: Outputs::Wrench,
        }
    }
}

impl TrainConfig {
    /// First setting that is not the one of `expected`, for a message; `None` where all are the same.
    pub fn difference(&self, expected: &Self) -> Option<String> {
        // Settings are plain data with text keys; they always serialise.
        let [found, expected] =
            [self, expected].map(|config| serde_json::to_value(config).unwrap_or_default());
        difference("", &found, &expected)
    }

    /// Refuses what cannot be trained, before any work.
    pub fn check(&self) -> Result<(), TrainError> {
        self.model.check()?;
        self.model.check_solver(self.solver)?;
        if self.adjoint == Adjoint::Continuous && !self.model.steps_a_field() {
            return Err(TrainError::Config {
                field: "adjoint",
                found: self.adjoint.to_string(),
                expected: format!("discrete, the only one of the model {}", self.model.kind()),
            });
        }
        if self.adjoint == Adjoint::Continuous && self.solver == Solver::DormandPrince {
            return Err(TrainError::Config {
                field: "adjoint",
                found: self.adjoint.to_string(),
                expected: format!("discrete, the only one of the solver {}", self.solver),
            });
        }
        let counts = [
            ("epochs", self.epochs, 1, MOST_EPOCHS),
            ("batch", self.batch, 1, MOST_BATCH),
            ("horizon", self.horizon, 2, usize::MAX),
            ("patience", self.patience, 1, usize::MAX),
            (
                "trajectories",
                self.trajectories.unwrap_or(1),
                1,
                usize::MAX,
            ),
        ];
        for (field, found, least, most) in counts {
            let expected = if found < least {
                format!("at least {least}")
            } else if found > most {
                format!("{most} at most")
            } else {
                continue;
            };
            return Err(TrainError::Config {
                field,
                found: found.to_string(),
                expected,
            });
        }
        let open = f64::MIN_POSITIVE;
        let numbers = [
            ("learning_rate", self.learning_rate, open, 1.0),
            ("clip_norm", self.clip_norm, open, f64::MAX),
            ("weight_decay", self.weight_decay, 0.0, f64::MAX),
            ("warm_up", self.warm_up, 0.0, 1.0),
            ("final_share", self.final_share, 0.0, 1.0),
            ("cold_start", self.cold_start, 0.0, 1.0),
        ];
        for (field, found, least, most) in numbers {
            if !(least..=most).contains(&found) {
                return Err(TrainError::Config {
                    field,
                    found: found.to_string(),
                    expected: match (least > 0.0, most < f64::MAX) {
                        (true, true) => format!("above 0 and at most {most}"),
                        (true, false) => "above 0".to_owned(),
                        (false, true) => format!("from 0 to {most}"),
                        (false, false) => "0 or more".to_owned(),
                    },
                });
            }
        }
        Ok(())
    }
}

/// First value that differs, with the names that lead to it.
fn difference(place: &str, found: &Value, expected: &Value) -> Option<String> {
    if let (Value::Object(ours), Value::Object(theirs)) = (found, expected) {
        let mut names: Vec<&String> = ours.keys().chain(theirs.keys()).collect();
        names.sort();
        names.dedup();
        return names.into_iter().find_map(|name| {
            let inside = match place {
                "" => name.clone(),
                place => format!("{place}.{name}"),
            };
            let value = |of: &serde_json::Map<String, Value>| of.get(name).cloned();
            let [ours, theirs] = [ours, theirs].map(|of| value(of).unwrap_or_default());
            difference(&inside, &ours, &theirs)
        });
    }
    (found != expected).then(|| {
        let [found, expected] = [found, expected].map(hydro_files::short);
        format!("{place} is {found}, expected {expected}")
    })
}

#[cfg(test)]
#[path = "tests/config.rs"]
mod tests;
