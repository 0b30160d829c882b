//! Linear potential flow about a hull, as a boundary element program computes it: radiation and excitation.
//!
//! A file `hydro-potential-flow/1` has, for a body upright at its draught,
//!
//! ```json
//! {"schema": "hydro-potential-flow/1", "volume": 0.4, "point": [0, 0, -0.05],
//!  "added_mass": [["6 numbers"], "6 rows"],
//!  "radiation": {"a": [["n"], "n rows"], "b": [["6"], "n rows"], "c": [["n"], "6 rows"]},
//!  "excitation": {"frequency": [0.5, 1.0], "direction": [0, 90], "real": [["6"], "a row a frequency and direction"], "imaginary": []}}
//! ```
//!
//! `volume` [m^3] is displaced at the draught. Forces and motions are about `point` [m, body frame], in the order surge, sway,
//! heave, roll, pitch, yaw. `added_mass` is that of infinite frequency [kg, kg m, kg m^2]. The water remembers by
//! x' = a x + b nu, F = -c x, nu the velocity [m/s, rad/s] (W. E. Cummins, Schiffstechnik 9, 1962; T. F. Ogilvie, 5th Symposium on
//! Naval Hydrodynamics, 1964). Excitation is the complex force of a wave of 1 m amplitude, Froude-Krylov and diffraction together
//! [N/m, N]: F = Re X exp(-i w t) where the elevation above the point is cos(w t); `direction` of travel [degrees] from the body's
//! x towards its y, rows by direction fastest. Between the listed frequencies and directions it is linear, outside it is that of
//! the nearest.

//!
//! ```text
//! radiation    the memory of waves made
//! excitation   the force of waves met
//! flow         both, about one hull
//! read         its file
//! ```

mod excitation;
mod flow;
mod radiation;
mod read;
#[cfg(test)]
mod tests;

pub use flow::PotentialFlow;
pub use radiation::Stepping;
pub use read::SCHEMA;
