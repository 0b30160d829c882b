//! The sea as a field in place and time: linear waves and currents.
//!
//! World frame, z up, SI units, angles in radians; in JSON angles are in degrees. Heights `z` and depths are measured from
//! the still level, `z` upwards, `depth` downwards. A direction is the one that a wave travels to, counterclockwise from
//! world x.
//!
//! Waves are Airy's: components that do not act on each other, exact for small steepness. [`WaveField::parse`] reads
//!
//! ```json
//! {"schema": "hydro-waves/1", "depth": 20, "components": [
//!   {"height": 0.5, "period": 4, "direction": 0, "phase": 90}]}
//! ```
//!
//! (`amplitude` may stand for `height`; without `depth` the water is deep; `direction` and `phase` are 0 where absent), or
//!
//! ```json
//! {"schema": "hydro-waves/1", "spectrum": "jonswap", "significant_height": 0.5, "peak_period": 5,
//!  "direction": 30, "spreading": 10, "peak_enhancement": 3.3, "components": 60, "seed": 1}
//! ```
//!
//! (`spectrum` may be `pierson_moskowitz`, without `peak_enhancement`; all crests are straight without `spreading`;
//! absent, `direction` is 0, `peak_enhancement` 3.3, `components` 60, `seed` 0). [`CurrentField::parse`] reads
//!
//! ```json
//! {"schema": "hydro-current/1", "velocity": [0.3, 0, 0]}
//! ```
//!
//! ```json
//! {"schema": "hydro-current/1",
//!  "profile": [{"depth": 0, "velocity": [0.5, 0, 0]}, {"depth": 10, "velocity": [0.1, 0, 0]}],
//!  "random": {"deviation": [0.1, 0.1, 0], "time_constant": 30, "seed": 1}}
//! ```
//!
//! ```json
//! {"schema": "hydro-current/1", "velocity": [0, 0, 0], "settable": true}
//! ```
//!
//! ```json
//! {"schema": "hydro-current/1", "grid": {"x": [0, 50], "depth": [0, 10], "time": [0, 3600],
//!  "velocity": [[0.1, 0, 0], [0.4, 0, 0], "... 8 of them, x fastest, then y, depth and time"]}}
//! ```
//!
//! ```
//! use hydro_effects::sea::WaveField;
//!
//! let text = r#"{"schema": "hydro-waves/1", "components": [{"height": 0.5, "period": 4}]}"#;
//! let (waves, notes) = WaveField::parse(text, 9.81)?;
//! let water = waves.kinematics([0.0, 0.0, 0.0], 0.0);
//! assert_eq!(water.elevation, 0.25);
//! assert!((water.pressure - 9.81 * 0.25).abs() < 1e-12);
//! assert!(notes.is_empty());
//! # Ok::<(), hydro_effects::sea::SeaError>(())
//! ```
//!
//! Waves and current are added: a current neither carries the waves along nor changes their length. What the sea is at a
//! place and time is a pure function of the text, the place, the time and of numbers that the caller keeps: four of a random
//! current, three of one that a program sets. The arithmetic is our own or that of the crate `libm`, so that every machine gives the same bits.
//!
//! ```text
//! error        what is refused
//! note         what is accepted and should be known
//! json         fields of an object, by name
//! elementary   sine, cosine and exponential without branches
//! random       numbers from a seed and a counter
//! dispersion   wave number of a frequency
//! limits       where linear waves and Morison's force end
//! quantiles    quantiles of a density
//! spectrum     a spectrum to components
//! components   the sum over components
//! wave_field   waves as a field
//! wave_json    its file
//! current      currents, and their file
//! grid         a current on a grid
//! ```

mod components;
mod current;
mod dispersion;
mod elementary;
mod error;
mod grid;
pub(crate) mod json;
mod limits;
mod note;
mod quantiles;
mod random;
mod spectrum;
#[cfg(test)]
mod tests;
mod wave_field;
mod wave_json;

pub use components::{Component, Kinematics};
pub use current::CurrentField;
pub use dispersion::wavenumber;
pub use error::{CURRENT_SCHEMA, SeaError, WAVES_SCHEMA};
pub use limits::{maccamy_fuchs, second_harmonic, steepest};
pub use note::SeaNote;
pub use spectrum::{Spectrum, SpectrumShape};
pub use wave_field::{Peak, Wave, WaveField};
