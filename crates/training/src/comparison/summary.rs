//! Everything that one comparison found, as one serialisable value: the table and the page show this.

use serde::{Deserialize, Serialize};

use super::{
    bounded::{Bounds, within},
    closed_loop::ClosedLoop,
    open_loop::OpenLoop,
};

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
    pub long: Option<LongRun>,
    /// Times of a physics step.
    pub step_times: Vec<StepTime>,
    /// Where it all comes from: name and value.
    pub provenance: Vec<(String, String)>,
}

/// Peaks of a long run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LongRun {
    /// Under the subject.
    pub subject: Bounds,
    /// Under the true wrench at the robot's own state.
    pub oracle: Bounds,
}

impl LongRun {
    /// True where the subject stays within `factor` times the oracle's peaks, or the truth's where those are greater.
    pub fn within(&self, factor: f64) -> bool {
        within(&self.subject.ratios(), &self.oracle.ratios(), factor)
    }
}

/// Where a subject was held against its rivals.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Standing {
    /// What was compared.
    pub compared: Vec<String>,
    /// Rivals that are at least as good as the subject, and in what.
    pub not_beaten: Vec<String>,
}

impl Summary {
    /// The subject beside those of `rivals` that took part: pooled open-loop error with and without hydrostatics, median
    /// closed-loop position error at `horizon` [s].
    pub fn standing(&self, rivals: &[&str], horizon: f64) -> Standing {
        let mut standing = Standing::default();
        let mut compare = |what: &str, errors: &[(&str, f64)]| {
            let of = |name: &str| {
                errors
                    .iter()
                    .find(|(known, _)| *known == name)
                    .map(|(_, error)| *error)
            };
            let subject = of(&self.subject).unwrap_or(f64::INFINITY);
            let met: Vec<_> = rivals
                .iter()
                .filter_map(|rival| Some((rival, of(rival)?)))
                .collect();
            if !met.is_empty() {
                standing.compared.push(what.to_owned());
            }
            for (rival, error) in met {
                if error <= subject {
                    standing.not_beaten.push(format!("{rival} in {what}"));
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
mod tests {
    use super::*;
    use crate::comparison::closed_loop::Errors;
    use crate::comparison::closed_loop::Spread;

    /// Distances after 2 s [m].
    fn summary(distances: &[(&str, f64)]) -> Summary {
        let row = |(name, distance): &(&str, f64)| Errors {
            name: (*name).to_owned(),
            position: vec![Spread::of(&[*distance])],
            attitude: vec![Spread::of(&[0.0])],
            diverged: 0,
            position_by_run: Vec::new(),
            path: Vec::new(),
        };
        Summary {
            subject: "ours".to_owned(),
            open_loop: None,
            closed_loop: ClosedLoop {
                horizons: vec![2.0],
                runs: 1,
                truth_path: Vec::new(),
                time: Vec::new(),
                rows: distances.iter().map(row).collect(),
            },
            long: None,
            step_times: Vec::new(),
            provenance: Vec::new(),
        }
    }

    #[test]
    fn a_tie_or_a_divergence_beats_nobody_and_who_was_not_there_was_not_met() {
        let met = vec!["closed loop after 2 s".to_owned()];
        let standing = |ours: f64, horizon| {
            let all = summary(&[("ours", ours), ("box", 0.2), ("truth", 0.0)]);
            all.standing(&["box", "drag"], horizon)
        };
        for (ours, beaten) in [
            (0.1, true),
            (0.2, false),
            (0.3, false),
            (f64::INFINITY, false),
        ] {
            let found = standing(ours, 2.0);
            assert_eq!(
                (&found.compared, found.not_beaten.is_empty()),
                (&met, beaten)
            );
        }
        assert_eq!(standing(0.1, 4.0), Standing::default());
        assert_eq!(
            summary(&[("ours", 0.1)]).standing(&["box"], 2.0),
            Standing::default()
        );
    }
}
