//! Everything that one comparison found, as one serialisable value: the table and the page show this.

use serde::{Deserialize, Serialize};

use super::{bounded::Bounds, closed_loop::ClosedLoop, open_loop::OpenLoop};

/// Time of one physics step of a contender's scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StepTime {
    /// Name in the table.
    pub name: String,
    /// Median over runs of the mean time of a step [us].
    pub microseconds: f64,
}

/// A comparison from end to end.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Summary {
    /// Name of the contender that the page is about.
    pub subject: String,
    /// Errors on recorded inputs, where a data set was given.
    pub open_loop: Option<OpenLoop>,
    /// Errors when driving the simulation.
    pub closed_loop: ClosedLoop,
    /// The long run, where one was given.
    pub bounds: Option<Bounds>,
    /// Times of a physics step.
    pub step_times: Vec<StepTime>,
    /// Where it all comes from: name and value.
    pub provenance: Vec<(String, String)>,
}
