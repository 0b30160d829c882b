//! Learned force models: from the recorded motion of a robot to the force of the water on it.
//!
//! A model reads *samples*, vectors of features x_k (joint positions and velocities, attitude, velocity through the
//! water, density) taken at a fixed sample period, and gives the force F_k: components of the water's wrench on the base,
//! or generalised forces of joints, in the order that its card names.
//!
//! # Parts
//!
//! - From features to numbers: [`features`] (the ordered list of inputs), [`kinematics`] (links and joints), [`robot`]
//!   (URDF), [`encoding`] (attitude as the up direction, closed forms of drag and added mass), [`normaliser`] (zero mean,
//!   unit deviation), [`envelope`] (the range of the training data and what holds a simulation to it).
//! - The models: [`architectures`] has one file each; [`solver`] and [`adjoint`] say how their differential equations are
//!   stepped and differentiated. Underneath lie the crate's own differentiable operations on whole trajectories
//!   (`operations`), the perceptron that they share (`perceptron`) and dense products (`kernel`).
//! - Using a model: [`ForceModel`] predicts whole trajectories; an [`Engine`] ([`engine`]) is stepped sample by sample by
//!   a simulation, without allocation; [`checkpoint`] is a trained model on disk; [`parameters`] are named weights;
//!   [`document`] reads files that name their schema.
//!
//! Training is not here (crate `hydro-training`), and nothing here touches MuJoCo.
//!
//! # Time
//!
//! Samples k = 0, 1, 2, ... are one sample period apart. A model of window W sees x_{k-W+1} .. x_k; before the start
//! stands x_0. The Attention-ODE and the MLP-ODE step F_k to F_{k+1} with their latent h_k held, so both are known at
//! sample k, and between samples the force is their linear interpolation. The other models (MLP, LSTM, CNODE,
//! Relaxation-ODE) give F_k of the motion up to x_k; until the next sample that force is held.
//!
//! # Example
//!
//! An untrained Attention-ODE for a floating robot of one joint, stepped through three samples:
//!
//! ```
//! use hydro_model::{
//!     AttentionOdeConfig, Encoder, EngineKind, ForceModel, ModelConfig, Normaliser, Parameters,
//!     Scratch, Solver, features::FeatureLayout,
//! };
//!
//! let config = ModelConfig::AttentionOde(AttentionOdeConfig::default());
//! let layout = FeatureLayout::floating_base(&["hip".to_owned()])?;
//! let encoded = Encoder::new(config.encoding(), &layout).len();
//! let (model, _weights) = Parameters::draw(0, |vb| {
//!     let normaliser = Normaliser::identity(encoded, 6);
//!     ForceModel::new(&config, &layout, normaliser, Solver::Rk4, vb)
//!         .map_err(candle_core::Error::wrap)
//! })?;
//!
//! let engine = model.engine(EngineKind::Fused)?;
//! let mut memory = vec![0.0; engine.memory_len()];
//! let mut scratch = Scratch::default();
//! let mut x = vec![0.0; engine.inputs()];
//! let (mut force, mut now, mut next) = ([0.0; 6], [0.0; 6], [0.0; 6]);
//! engine.start(&x, &force, &mut memory, &mut scratch);
//! for sample in 1..=3 {
//!     engine.sample(&memory, &force, &mut now, &mut next, &mut scratch);
//!     force = next;
//!     x[1] = 0.1 * f64::from(sample); // velocity of the joint [rad/s]
//!     engine.observe(&x, &mut memory, &mut scratch);
//! }
//! assert!(force.iter().all(|component| component.is_finite()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod adjoint;
pub mod architectures;
pub mod checkpoint;
pub mod document;
pub mod encoding;
pub mod engine;
pub mod envelope;
mod error;
pub mod features;
mod force_model;
mod kernel;
pub mod kinematics;
pub mod normaliser;
mod operations;
pub mod outputs;
pub mod parameters;
mod perceptron;
pub mod robot;
pub mod solver;
#[cfg(test)]
mod testing;
pub mod water;

pub use self::{
    adjoint::Adjoint,
    architectures::{
        AttentionOde, AttentionOdeConfig, Cnode, CnodeConfig, Control, Lstm, LstmConfig, Mlp,
        MlpConfig, MlpOde, MlpOdeConfig, ModelConfig, Network, RelaxationOde, RelaxationOdeConfig,
        Tokens,
    },
    encoding::{Encoder, Encoding},
    engine::{BATCH_SIZE, Engine, EngineKind, Scratch, one_by_one},
    error::ModelError,
    force_model::ForceModel,
    normaliser::Normaliser,
    outputs::{Output, Outputs},
    parameters::Parameters,
    solver::Solver,
};
