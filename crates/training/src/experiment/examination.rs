//! Open-loop examination of one trained model.

use std::collections::BTreeMap;

use hydro_model::checkpoint::Checkpoint;
use serde::{Deserialize, Serialize};

use super::{
    detail::{Detail, detail},
    energy::{Energy, energy},
    fluctuation::fluctuation,
    noise::{LEVELS, noisy},
    predictor::Predictor,
};
use crate::{
    TrainError,
    comparison::Ratios,
    dataset::Split,
    metrics::{ErrorSums, Errors, InitialForce, mean_attention},
};

/// Forces from which trajectories are integrated. The paper starts from the true one, which a simulation does not have.
const STARTS: [InitialForce; 3] = [
    InitialForce::Clean,
    InitialForce::Estimate,
    InitialForce::Zero,
];

/// Results of one model.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Examination {
    /// Errors on the test split by the force at the start.
    pub starts: BTreeMap<String, Errors>,
    /// Root mean square error of the estimated first force, in standard deviations of each axis.
    pub estimate_error: f64,
    /// Errors by trajectory and by time, from the true first force.
    pub detail: Detail,
    /// The drag part's work.
    pub energy: Option<Energy>,
    /// Power above the truth's bandwidth, over the truth's.
    pub fluctuation: Option<f64>,
    /// Errors under noise on the features.
    pub noise: Vec<Noisy>,
    /// Errors on data outside the training range.
    pub beyond: Vec<OutOfRange>,
    /// Mean attention weight by head and lag, newest first.
    pub attention: Option<Vec<Vec<f64>>>,
    /// The force along the first test trajectory, one row a sample.
    pub example: Vec<Vec<f32>>,
    /// In closed loop, where MuJoCo drove it.
    pub swimming: Option<Swimming>,
}

/// nRMSE under noise of so many standard deviations on every feature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noisy {
    /// Standard deviation of the noise over the feature's own.
    pub level: f64,
    /// Pooled.
    pub nrmse: f64,
}

/// Errors on a data set of another range; normalised by that set's own standard deviations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutOfRange {
    /// Name of the data set.
    pub name: String,
    /// Its manifest's sha256.
    pub sha256: String,
    /// The errors.
    #[serde(flatten)]
    pub errors: Errors,
}

/// Closed loop: the plugin drives MuJoCo. Errors of a run that diverged are None.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Swimming {
    /// Times at which errors are read [s].
    pub horizons: Vec<f64>,
    /// Median distance from the truth at each [m].
    pub position: Vec<Option<f64>>,
    /// Median angle at each [deg].
    pub attitude: Vec<Option<f64>>,
    /// Number of runs.
    pub runs: usize,
    /// Number of runs that diverged.
    pub diverged: usize,
    /// Length of the long run [min].
    pub minutes: Option<f64>,
    /// Greatest speed, rate, force and torque of the long run over the truth's; None where it diverged.
    pub peaks: Option<Ratios>,
    /// True where all four stay within 1.5.
    pub bounded: Option<bool>,
}

/// Examines a checkpoint on a test split and on sets outside its training range (name, sha256, split).
///
/// # Errors
/// A split that is not of the checkpoint's robot.
pub fn examine(
    checkpoint: &Checkpoint,
    test: &Split,
    beyond: &[(String, String, Split)],
) -> Result<Examination, TrainError> {
    let predictor = Predictor::new(checkpoint.model(None)?)?;
    let card = &checkpoint.card;
    let errors = |split: &Split, forces: &[Vec<f64>]| {
        let mut sums = ErrorSums::new(split.outputs());
        for (index, forces) in forces.iter().enumerate() {
            sums.add_trajectory(forces, split, index);
        }
        sums.errors()
    };
    let mut starts = BTreeMap::new();
    let mut from_truth = Vec::new();
    let mut estimate_error = f64::NAN;
    for start in STARTS {
        let forces = predictor.forces(test, start)?;
        starts.insert(start.to_string(), errors(test, &forces));
        match start {
            InitialForce::Clean => from_truth = forces,
            InitialForce::Estimate => {
                estimate_error = first_error(test, &forces, &card.normaliser.output_std);
            }
            _ => (),
        }
    }
    let clean = starts.get(&InitialForce::Clean.to_string());
    let mut noise: Vec<Noisy> = clean
        .map(|errors| Noisy {
            level: 0.0,
            nrmse: errors.pooled,
        })
        .into_iter()
        .collect();
    for level in LEVELS {
        let shaken = noisy(test, &card.features, level);
        let forces = predictor.forces(&shaken, InitialForce::Clean)?;
        noise.push(Noisy {
            level,
            nrmse: errors(test, &forces).pooled,
        });
    }
    let beyond = beyond
        .iter()
        .map(|(name, sha256, split)| {
            let forces = predictor.forces(split, InitialForce::Clean)?;
            Ok(OutOfRange {
                name: name.clone(),
                sha256: sha256.clone(),
                errors: errors(split, &forces),
            })
        })
        .collect::<Result<_, TrainError>>()?;
    Ok(Examination {
        starts,
        estimate_error,
        detail: detail(test, &from_truth),
        energy: energy(&card.features, &card.outputs, test, &from_truth),
        fluctuation: fluctuation(test, &from_truth),
        noise,
        beyond,
        attention: mean_attention(predictor.model(), test)?,
        example: from_truth.first().map_or_else(Vec::new, |forces| {
            let rows = forces.chunks_exact(test.outputs());
            rows.map(|row| row.iter().map(|value| *value as f32).collect())
                .collect()
        }),
        swimming: None,
    })
}

/// RMS over trajectories and axes of the first force's error, in `std`.
fn first_error(split: &Split, forces: &[Vec<f64>], std: &[f64]) -> f64 {
    let mut square = 0.0;
    for (index, forces) in forces.iter().enumerate() {
        for ((force, clean), std) in forces.iter().zip(split.clean(index)).zip(std) {
            square += ((force - f64::from(*clean)) / std).powi(2);
        }
    }
    (square / (forces.len() * std.len()) as f64).sqrt()
}
