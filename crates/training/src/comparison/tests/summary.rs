//! Standing against baselines.

use super::*;
use crate::comparison::{ClosedLoopRow, Spread};

/// Distances after 2 s [m].
fn summary(distances: &[(&str, f64)]) -> Summary {
    let row = |(name, distance): &(&str, f64)| ClosedLoopRow {
        name: (*name).to_owned(),
        position: vec![Spread::from_values(&[*distance])],
        attitude: vec![Spread::from_values(&[0.0])],
        joints: vec![Spread::from_values(&[0.0])],
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
        assert_eq!(found.baselines, ["box"], "no drag took part");
    }
    assert_eq!(standing(0.1, 4.0), Standing::default());
    assert_eq!(
        summary(&[("ours", 0.1)]).standing(&["box"], 2.0),
        Standing::default()
    );
}
