//! A current given on a grid in place, depth and time.

use std::{
    fmt,
    hash::{DefaultHasher, Hasher},
};

use serde_json::Value;

use super::{
    error::SeaError,
    json::{Fields, ascending, vector},
};

/// Coordinates [m]; times [s]; velocities [m/s].
const PLACES: [f64; 2] = [-1e7, 1e7];
const TIMES: [f64; 2] = [-1e10, 1e10];
const VELOCITIES: [f64; 2] = [-100.0, 100.0];
/// Most coordinates of an axis, and most points of the grid.
const MOST_COORDINATES: usize = 10_000;
const MOST_POINTS: usize = 500_000;

const KEYS: [&str; 5] = ["x", "y", "depth", "time", "velocity"];

/// Velocities at the points of a rectangular grid; linear between them, along each axis, and constant outside.
#[derive(Clone, PartialEq)]
pub(super) struct Grid {
    /// Coordinates of x, y, depth and time, ascending; empty where the current is the same along an axis.
    axes: [Vec<f64>; 4],
    /// At the points, x fastest, then y, depth and time [m/s].
    velocities: Vec<[f64; 3]>,
}

impl fmt::Debug for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut hasher = DefaultHasher::new();
        let numbers = self.axes.iter().flatten();
        for number in numbers.chain(self.velocities.iter().flatten()) {
            hasher.write_u64(number.to_bits());
        }
        f.debug_struct("Grid")
            .field("points", &self.velocities.len())
            .field("digest", &hasher.finish())
            .finish_non_exhaustive()
    }
}

impl Grid {
    /// Reads and checks the object `grid`.
    pub(super) fn read(value: &Value) -> Result<Self, SeaError> {
        let fields = &Fields::new("grid", value, &KEYS)?;
        let axis = |key, unit, bounds| axis(fields, key, unit, bounds);
        let axes = [
            axis("x", "m", PLACES)?,
            axis("y", "m", PLACES)?,
            axis("depth", "m", [0.0, PLACES[1]])?,
            axis("time", "s", TIMES)?,
        ];
        let points = axes.iter().map(|axis| axis.len().max(1)).product::<usize>();
        if points > MOST_POINTS {
            return Err(SeaError::Value {
                field: fields.place(),
                found: format!("{points} points"),
                expected: format!("at most {MOST_POINTS}"),
            });
        }
        let list = fields.list("velocity", "velocities", MOST_POINTS)?;
        if list.len() != points {
            let lengths = axes.each_ref().map(|axis| axis.len().max(1).to_string());
            return Err(SeaError::Value {
                field: fields.field("velocity"),
                found: format!("a list of {}", list.len()),
                expected: format!(
                    "{points}: x times y times depth times time, {}, x fastest",
                    lengths.join(" x ")
                ),
            });
        }
        let velocities = (0..points)
            .map(|at| {
                vector(
                    &format!("grid.velocity[{at}]"),
                    &list[at],
                    "m/s",
                    VELOCITIES,
                )
            })
            .collect::<Result<_, _>>()?;
        Ok(Self { axes, velocities })
    }

    /// Velocity [m/s] at a place x, y [m], a depth [m] and a time [s].
    pub(super) fn velocity(&self, at: [f64; 4]) -> [f64; 3] {
        let mut corners = [(0, 0.0); 4];
        let mut strides = [0; 4];
        let mut stride = 1;
        for (axis, coordinates) in self.axes.iter().enumerate() {
            corners[axis] = bracket(coordinates, at[axis]);
            strides[axis] = stride;
            stride *= coordinates.len().max(1);
        }
        let mut sum = [0.0; 3];
        for corner in 0..16_usize {
            let (mut index, mut weight) = (0, 1.0);
            for (axis, (first, share)) in corners.into_iter().enumerate() {
                let is_next = corner >> axis & 1 == 1;
                weight *= if is_next { share } else { 1.0 - share };
                index += (first + usize::from(is_next)) * strides[axis];
            }
            if weight != 0.0 {
                let velocity = self.velocities[index];
                sum = [0, 1, 2].map(|axis| sum[axis] + weight * velocity[axis]);
            }
        }
        sum
    }
}

/// Index of the coordinate before a value, and the share of the next one: 0 outside and where there is none.
fn bracket(coordinates: &[f64], value: f64) -> (usize, f64) {
    let after = coordinates.partition_point(|coordinate| *coordinate <= value);
    if after == 0 || after == coordinates.len() {
        return (after.saturating_sub(1), 0.0);
    }
    let (low, high) = (coordinates[after - 1], coordinates[after]);
    (after - 1, (value - low) / (high - low))
}

/// Coordinates of an axis that may be absent.
fn axis(
    fields: &Fields<'_>,
    key: &'static str,
    unit: &str,
    bounds: [f64; 2],
) -> Result<Vec<f64>, SeaError> {
    match fields.get(key) {
        Some(_) => ascending(fields, key, unit, bounds, MOST_COORDINATES),
        None => Ok(Vec::new()),
    }
}
