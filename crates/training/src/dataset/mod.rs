//! Data sets on disk: a folder with `manifest.json` and shards, read and checked, and written.
//!
//! A shard `<split>-00000-of-00004.safetensors` holds, for M trajectories of T samples:
//! `x` f32 [M,T,n] (raw SI features), `wrench` f32 [M,T,f] (perturbed), `wrench_clean` f32 [M,T,f],
//! `hydrostatic` f32 [M,T,f] (the buoyancy part of the clean one; zeros where it is absent), `time` f32 [T] and
//! `condition` i32 [M,T]. Where the manifest names the columns of `generalised`, there are also `generalised` f32 [M,T,6+joints]
//! (force in the world, torque in the base, torques of the joints) and `generalised_hydrostatic`, and
//! [`Dataset::with_outputs`] has the torques follow the wrench. Splits are by trajectory. Nothing here normalises or trains.

mod error;
mod manifest;
mod reader;
mod split;
mod writer;

pub use self::{
    error::DatasetError,
    manifest::{Manifest, SCHEMA, ShardEntry, SplitEntry},
    reader::Dataset,
    split::Split,
    writer::{Trajectory, write},
};
