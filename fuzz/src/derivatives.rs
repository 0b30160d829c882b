//! A table of hydrodynamic derivatives, TOML or JSON. One that is accepted makes effects that are.

use hydro_effects::fossen::VehicleTable;

use super::{effects, refused, robot};

/// Reads a table.
pub fn read(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return false;
    };
    match VehicleTable::parse(text).and_then(|table| table.to_json(robot::BODIES[0])) {
        Ok(written) => effects::read(written.as_bytes()),
        Err(error) => refused(&error),
    }
}
