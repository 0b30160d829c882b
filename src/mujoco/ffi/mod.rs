//! MuJoCo's C interface: its structs and functions, and what keeps them safe to use.
//!
//! ```text
//! bindings      structs and the table of functions, written by build.rs
//! api           which MuJoCo is called: the one that is already in this process
//! layout        a probe: its structs are laid out as in the headers
//! views         pointers and counts as slices
//! attributes    attributes of a model's plugin instances
//! boundary      no panic leaves Rust
//! warn          MuJoCo's warning channel
//! warnings      counts of MuJoCo's warnings
//! scene_folder  where the MJCF lies, if this process loads it itself
//! last_refusal  why a plugin refused the latest model
//! ```

pub(crate) mod api;
#[cfg(mujoco_plugins)]
mod attributes;
pub(crate) mod bindings;
mod boundary;
pub(crate) mod last_refusal;
#[cfg(mujoco_plugins)]
pub(crate) mod layout;
pub(crate) mod scene_folder;
pub(crate) mod views;
mod warn;
pub mod warnings;

pub(crate) use self::{
    api::Api,
    boundary::guard,
    views::{DataView, ModelView},
    warn::warn,
};
