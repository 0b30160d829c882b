//! `hydro.load_cell`: a force or torque sensor that feels the water, as an engine plugin.
//!
//! ```text
//! plugin   registration and MuJoCo's callbacks
//! cell     one load cell: its attributes, packed into `plugin_data`
//! reading  what it reads
//! ```

pub(crate) mod cell;
pub(crate) mod plugin;
mod reading;
