//! `nominal.toml`: uncertainties of the nominal model.

use hydro_gap::Uncertainty;

use super::{refused, robot};

/// Reads a table.
pub fn read(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return false;
    };
    match Uncertainty::parse(text, &robot::nuisances()) {
        Ok(_) => true,
        Err(error) => refused(&error),
    }
}
