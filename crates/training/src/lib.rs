//! From a data set to a checkpoint, and from a checkpoint to its errors.
//!
//! A data set holds trajectories of a robot's motion and of the water's wrench on its base. Training fits a model of
//! [`hydro_model`] to them: the loss is the mean squared error of the force, in standard deviations, over every sample
//! of a window that is integrated from the recorded force at its start; the gradient runs through the solver.
//!
//! | part | contents |
//! |---|---|
//! | [`dataset`] | folders of trajectories (`hydro-dataset/1`), read, checked and written |
//! | [`trainer`] | settings, windows, batches, AdamW, schedule, state, log, device, range of the training data |
//! | [`metrics`] | wrenches predicted along trajectories, and their errors |
//! | [`rollouts`] | recorded runs of a simulated robot (`hydro-rollouts/1`) |
//! | [`simulator`] | the trait that a closed loop drives; MuJoCo implements it elsewhere |
//! | [`drag`] | linear plus quadratic drag by least squares, a baseline |
//! | [`comparison`] | a learned wrench beside its baselines, in open and closed loop |
//! | [`experiment`] | the paper's experiments: models, seeds, examinations, tables |
//! | [`residual_model`] | a small model of the wrench that another water model lacks |
//!
//! Nothing here prints or touches MuJoCo: an [`Observer`] is told of progress, and the command line shows it.
//!
//! ```
//! use std::{collections::BTreeMap, sync::atomic::AtomicBool};
//!
//! use hydro_model::{MlpConfig, ModelConfig, features::{Feature, FeatureLayout}};
//! use hydro_training::{
//!     InitialForce, TrainConfig, Trainer,
//!     dataset::{self, Manifest, Trajectory},
//!     evaluate,
//! };
//!
//! // A body that goes to and fro against linear drag, -3 N s/m: two trajectories of 20 samples.
//! let about = Manifest {
//!     schema: dataset::SCHEMA.to_owned(),
//!     name: "drag".to_owned(),
//!     features: FeatureLayout::new(vec![Feature::LinearVelocity(0), Feature::Density])?,
//!     feature_units: vec!["m/s".to_owned(), "kg/m^3".to_owned()],
//!     outputs: vec!["force.x".to_owned()],
//!     output_units: vec!["N".to_owned()],
//!     frames: BTreeMap::new(),
//!     sample_period: 0.05,
//!     samples: 20,
//!     kinematics: None,
//!     generalised: None,
//!     water: None,
//!     added_mass: Vec::new(),
//!     splits: BTreeMap::new(),
//!     provenance: BTreeMap::new(),
//! };
//! let trajectory = |phase: f32| {
//!     let speeds: Vec<f32> = (0..20).map(|k| (0.3 * k as f32 + phase).sin()).collect();
//!     Trajectory {
//!         x: speeds.iter().flat_map(|v| [*v, 1000.0 + v]).collect(),
//!         wrench: speeds.iter().map(|v| -3.0 * v).collect(),
//!     }
//! };
//! let folder = tempfile::tempdir()?;
//! let splits = [
//!     ("train", vec![trajectory(0.0), trajectory(1.0)]),
//!     ("val", vec![trajectory(2.0)]),
//! ];
//! let data = dataset::write(&folder.path().join("data"), &about, &splits)?;
//!
//! let config = TrainConfig {
//!     model: ModelConfig::Mlp(MlpConfig { hidden: vec![8], ..MlpConfig::default() }),
//!     epochs: 5,
//!     horizon: 20,
//!     ..TrainConfig::default()
//! };
//! let mut trainer = Trainer::new(config, &data)?;
//! trainer.run(&folder.path().join("run"), &AtomicBool::new(false), &mut ())?;
//! let checkpoint = trainer.checkpoint("drag", "an example")?;
//! let found = evaluate(&checkpoint, &data.split("val", None)?, InitialForce::Clean)?;
//! assert!(found.errors.rmse[0].is_finite());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod comparison;
pub mod dataset;
pub mod drag;
mod error;
pub mod experiment;
pub mod metrics;
pub mod residual_model;
pub mod rollouts;
pub mod simulator;
pub mod trainer;

pub use self::{
    error::TrainError,
    metrics::{
        ErrorSums, Errors, Evaluation, InitialForce, UnknownInitialForce, evaluate, predict,
        predict_by_network,
    },
    residual_model::{LearnedResidual, RecordedWrench, ResidualData, learn_residual},
    trainer::{
        AdamW, Labels, LogRecord, Observer, StepSettings, TrainConfig, TrainDevice, TrainOutcome,
        TrainProgress, Trainer, UnknownDevice,
    },
};
