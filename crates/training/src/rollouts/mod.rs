//! Recorded rollouts of a simulated robot (`hydro-rollouts/1`): states, controls, pushes, features and
//! the true fluid wrench, sampled along runs of one density each.
//!
//! A folder holds `rollouts.json` and one `.npz` (no pickles) a run. Rows `0..=N` are samples; control
//! and push row `k` is held from sample `k` to `k + 1`.

mod error;
mod index;
mod read;
mod rollout;
mod table;

pub use self::{
    error::RolloutError,
    index::{Entry, Index, SCHEMA},
    read::Rollouts,
    rollout::Rollout,
    table::Table,
};
