//! Effects and values to write, and the model to write them into.

use std::path::{Path, PathBuf};

use hydro_effects::{Entry, Id};

use crate::plant::{Nuisance, PlantDescription};

/// Names of the parameters of an effect on a target of a model; a body's shape may choose them.
pub type Names = fn(&PlantDescription, Id, &str) -> Vec<String>;

/// Effects and values to write, and the model to write them into.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// The nominal MJCF.
    pub nominal: &'a Path,
    /// Effects with values, in the order of the catalogue's parameters. `payload`: mass, x, y, z; `net_buoyancy`: force,
    /// its moment; `current`: x, y, z.
    pub entries: &'a [Entry],
    /// Nuisance parameters of the nominal model and their deviations, as in `Plant::simulation`: relative, or metres for
    /// a centre of mass. A deviation of zero leaves the text as it is.
    pub numbers: &'a [(Nuisance, f64)],
    /// The nominal model as compiled: masses, inertias, addresses, step.
    pub description: &'a PlantDescription,
    /// Names of an effect's parameters on a target, in order.
    pub names: Names,
    /// Folders in which the plugin looks for relative paths before the model's own.
    pub search: &'a [PathBuf],
}
