//! All results of one comparison as one serialisable value, from which the table and the page are made.

use serde::{Deserialize, Serialize};

use super::{closed_loop::ClosedLoop, long_run::LongRun, open_loop::OpenLoop, step_time::StepTime};

/// A comparison from end to end.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Summary {
    /// Name of the method that the page is about.
    pub subject: String,
    /// Errors on recorded inputs, where a data set was given.
    pub open_loop: Option<OpenLoop>,
    /// Errors when driving the simulation.
    pub closed_loop: ClosedLoop,
    /// The long run, where one was given.
    pub long: Option<LongRun>,
    /// Times of a physics step.
    pub step_times: Vec<StepTime>,
    /// Commands and digests behind the numbers: name and value.
    pub provenance: Vec<(String, String)>,
}

/// Result of a comparison with baselines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Standing {
    /// Quantities compared.
    pub compared: Vec<String>,
    /// Baselines that it was compared with in any of them.
    pub baselines: Vec<String>,
    /// Baselines at least as good as the subject, with the quantity.
    pub not_beaten: Vec<String>,
}

impl Summary {
    /// The subject beside those of `baselines` that took part: pooled open-loop error with and without hydrostatics, median
    /// closed-loop position error at `horizon` [s].
    pub fn standing(&self, baselines: &[&str], horizon: f64) -> Standing {
        let mut standing = Standing::default();
        let mut compare = |what: &str, errors: &[(&str, f64)]| {
            let of = |name: &str| {
                errors
                    .iter()
                    .find(|(known, _)| *known == name)
                    .map(|(_, error)| *error)
            };
            let subject = of(&self.subject).unwrap_or(f64::INFINITY);
            let met: Vec<_> = baselines
                .iter()
                .filter_map(|baseline| Some((baseline, of(baseline)?)))
                .collect();
            if !met.is_empty() {
                standing.compared.push(what.to_owned());
            }
            for (baseline, error) in met {
                if !standing.baselines.iter().any(|known| known == baseline) {
                    standing.baselines.push((*baseline).to_owned());
                }
                if error <= subject {
                    standing.not_beaten.push(format!("{baseline} in {what}"));
                }
            }
        };
        if let Some(open) = &self.open_loop {
            let pooled: Vec<_> = open
                .rows
                .iter()
                .map(|row| (row.name.as_str(), row.errors.pooled))
                .collect();
            compare("open loop", &pooled);
            let without: Vec<_> = open
                .rows
                .iter()
                .map(|row| (row.name.as_str(), row.errors.pooled_hydrodynamic))
                .collect();
            compare("open loop without buoyancy", &without);
        }
        let closed = &self.closed_loop;
        if let Some(h) = closed
            .horizons
            .iter()
            .position(|known| (known - horizon).abs() < 1e-9)
        {
            let position: Vec<_> = closed
                .rows
                .iter()
                .map(|row| (row.name.as_str(), row.position[h].median))
                .collect();
            compare(&format!("closed loop after {horizon} s"), &position);
        }
        standing
    }
}

#[cfg(test)]
#[path = "tests/summary.rs"]
mod tests;
