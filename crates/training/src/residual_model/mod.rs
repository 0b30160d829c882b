//! A small force model of the wrench that another water model lacks, trained on estimates of that wrench along
//! trials.
//!
//! Trials are few and the wrench is uncertain, so the network is small, whole trials validate it, and it is offered
//! only where it predicts their wrench better than no wrench at all.

mod data;
mod learn;

pub use self::{
    data::{RecordedWrench, ResidualData},
    learn::{LearnedResidual, learn_residual},
};
