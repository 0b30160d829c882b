//! Reversals of joints: pieces of a segment in which a joint turns round count less.
//!
//! Dry friction changes its sign there within a few steps, and a real joint sticks a little longer or shorter than any model of
//! it does. In rows of small noise that little outweighs all the rest of a trial. So unmodelled forces may be larger there, along
//! the joint alone, and its own readings count less; for all sets of effects alike.

use crate::{
    likelihood::track::{Grid, Link, Rolled, Track},
    problem::problem::Problem,
};

/// Gives the unmodelled forces of a track their factors, and the readings of each joint theirs beside what they have.
pub(crate) fn discount(problem: &Problem<'_>, track: &mut Track, rolled: &[Rolled], grid: Grid) {
    let model = problem.model;
    let options = &problem.settings.options.likelihood;
    let (nq, nv, channels) = (model.nq, model.nv, problem.channels.len());
    let trial = &problem.trials[track.trial];
    if trial.steady {
        return;
    }
    let mut factors = vec![vec![1.0; grid.pieces * nv]; track.links.len()];
    for joint in model.joints.iter().filter(|of| !trial.imposes(of.dof)) {
        let speeds: Vec<Vec<f64>> = (rolled.iter())
            .map(|of| (of.boundaries.iter().map(|at| at.full[1 + nq + joint.dof])).collect())
            .collect();
        let least = options.reversal_speed * root_mean_square(&speeds);
        let own: Vec<usize> = (problem.channels.sources.iter())
            .filter(|of| model.sensors[of.sensor].joint.as_deref() == Some(&joint.name))
            .flat_map(|of| of.channel..of.channel + of.channels)
            .collect();
        let links = track.links.iter_mut().zip(&mut factors);
        for ((link, factors), speeds) in links.zip(&speeds) {
            let slow = slow_pieces(link, speeds, least, grid);
            for piece in &slow {
                factors[piece * nv + joint.dof] = options.reversal_force;
            }
            for (number, row) in link.segment.rows.clone().enumerate() {
                let step = (trial.times[row] - link.segment.start) / model.timestep - 1.0;
                if slow.contains(&link.piece_at(grid, step.max(0.0) as usize)) {
                    for channel in &own {
                        link.weights[number * channels + channel] *= options.reversal_weight;
                    }
                }
            }
        }
    }
    for (link, factors) in track.links.iter_mut().zip(factors) {
        link.set_factors(factors);
    }
}

/// Pieces at a boundary of which a joint is slow, or between two of which it turns round.
fn slow_pieces(link: &Link, speeds: &[f64], least: f64, grid: Grid) -> Vec<usize> {
    let blocks = speeds.windows(2).enumerate();
    let slow = blocks.filter(|(_, pair)| {
        pair.iter().any(|speed| speed.abs() < least) || pair[0] * pair[1] <= 0.0
    });
    let mut pieces: Vec<usize> = slow.map(|(block, _)| link.piece(grid, block)).collect();
    pieces.dedup();
    pieces
}

fn root_mean_square(speeds: &[Vec<f64>]) -> f64 {
    let all = speeds.iter().flatten();
    let count = all.clone().count().max(1);
    (all.map(|speed| speed * speed).sum::<f64>() / count as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::segments::Segment;

    const GRID: Grid = Grid {
        block: 2,
        stride: 1,
        pieces: 2,
    };

    fn link() -> Link {
        Link {
            segment: Segment {
                rows: 0..8,
                start: 0.0,
                qpos: vec![],
                qvel: vec![],
            },
            steps: 16,
            forces: vec![0.5, 2.0],
            weights: vec![1.0; 8],
            factors: vec![1.0, 50.0],
        }
    }

    /// Eight blocks in two pieces.
    #[test]
    fn pieces_are_slow_where_the_joint_is_or_turns_round() {
        let speeds = |of: [f64; 9]| slow_pieces(&link(), &of, 0.1, GRID);
        let fast = [1.0; 9];
        assert!(speeds(fast).is_empty());
        let mut turning = fast;
        turning[7..].fill(-1.0);
        assert_eq!(speeds(turning), [1]);
        let mut slow = fast;
        slow[1] = 0.05;
        assert_eq!(speeds(slow), [0]);
        // At the boundary between the pieces both are.
        let mut between = fast;
        between[4] = 0.0;
        assert_eq!(speeds(between), [0, 1]);
    }

    /// Other factors scale the values that smoothing found, not the forces.
    #[test]
    fn unmodelled_forces_stay_when_their_factors_change() {
        let mut link = link();
        let scale = nalgebra::DVector::from_element(1, 3.0);
        let forces = |link: &Link| [0, 15].map(|step| link.force(GRID, step, &scale)[0]);
        let before = forces(&link);
        assert_eq!(before, [1.5, 300.0]);
        link.set_factors(vec![50.0, 1.0]);
        assert_eq!(forces(&link), before);
        assert_eq!(link.factors, [50.0, 1.0]);
    }
}
