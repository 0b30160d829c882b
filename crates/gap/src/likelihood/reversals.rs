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
        let own: Vec<usize> = (problem.channels.sources.iter())
            .filter(|of| model.sensors[of.sensor].joint.as_deref() == Some(&joint.name))
            .flat_map(|of| of.channel..of.channel + of.channels)
            .collect();
        // Where no sensor is a joint's own, nothing says that it turns round.
        if own.is_empty() {
            continue;
        }
        let speeds: Vec<Vec<f64>> = (rolled.iter())
            .map(|of| (of.boundaries.iter().map(|at| at.full[1 + nq + joint.dof])).collect())
            .collect();
        let least = options.reversal_speed * root_mean_square(&speeds);
        let turns = turning_blocks(&speeds, least);
        let links = track.links.iter_mut().zip(&mut factors);
        for ((link, factors), turns) in links.zip(&turns) {
            let turning = pieces_of(link, turns, grid);
            for piece in &turning {
                factors[piece * nv + joint.dof] = options.reversal_force;
            }
            for (number, row) in link.segment.rows.clone().enumerate() {
                let step = (trial.times[row] - link.segment.start) / model.timestep - 1.0;
                if turning.contains(&link.piece_at(grid, step.max(0.0) as usize)) {
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

/// Blocks of each link, true where the joint turns round: is slow, or changes its direction. Not the rest with which a trial
/// begins or ends: from rest a joint sets off in one direction.
fn turning_blocks(speeds: &[Vec<f64>], least: f64) -> Vec<Vec<bool>> {
    let is_slow = |speed: f64| speed.abs() < least;
    let turns = |pair: &[f64]| is_slow(pair[0]) || is_slow(pair[1]) || pair[0] * pair[1] <= 0.0;
    let pairs = || speeds.iter().flat_map(|of| of.windows(2));
    let mut turning: Vec<Vec<bool>> = (speeds.iter())
        .map(|of| of.windows(2).map(turns).collect())
        .collect();
    let from_start = turning.iter_mut().flatten().zip(pairs());
    for (turns, _) in from_start.take_while(|(_, pair)| is_slow(pair[0])) {
        *turns = false;
    }
    let from_end = turning.iter_mut().flatten().rev().zip(pairs().rev());
    for (turns, _) in from_end.take_while(|(_, pair)| is_slow(pair[1])) {
        *turns = false;
    }
    turning
}

/// Pieces of a link in which one of its blocks turns.
fn pieces_of(link: &Link, turning: &[bool], grid: Grid) -> Vec<usize> {
    let blocks = (0..turning.len()).filter(|block| turning[*block]);
    let mut pieces: Vec<usize> = blocks.map(|block| link.piece(grid, block)).collect();
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
    fn pieces_turn_where_the_joint_is_slow_or_changes_its_direction() {
        let turning =
            |of: [f64; 9]| pieces_of(&link(), &turning_blocks(&[of.into()], 0.1)[0], GRID);
        let fast = [1.0; 9];
        assert!(turning(fast).is_empty());
        let mut turned = fast;
        turned[7..].fill(-1.0);
        assert_eq!(turning(turned), [1]);
        let mut slow = fast;
        slow[1] = 0.05;
        assert_eq!(turning(slow), [0]);
        // At the boundary between the pieces both are.
        let mut between = fast;
        between[4] = 0.0;
        assert_eq!(turning(between), [0, 1]);
    }

    /// Rest before the first motion and after the last is no reversal, whatever sign noise gives it; rest between motions is.
    #[test]
    fn rest_at_the_ends_of_a_trial_is_no_reversal() {
        let turns = |speeds: &[&[f64]]| -> Vec<Vec<bool>> {
            let speeds: Vec<Vec<f64>> = speeds.iter().map(|of| of.to_vec()).collect();
            turning_blocks(&speeds, 0.1)
        };
        let falls: &[&[f64]] = &[&[0.0, -0.01, 0.02], &[0.02, 0.5, 1.0]];
        assert_eq!(turns(falls), [[false; 2]; 2]);
        let stops: &[&[f64]] = &[&[1.0, 0.5, 0.05], &[0.05, -0.01, 0.0]];
        assert_eq!(turns(stops), [[false; 2]; 2]);
        let waits: &[&[f64]] = &[&[1.0, 0.05, 0.0], &[0.0, 0.05, 1.0]];
        assert_eq!(turns(waits), [[true; 2]; 2]);
        // It turns round in its first block, fast before and after, or soon after it set off, or shortly before it stops.
        assert_eq!(turns(&[&[1.0, -1.0, -1.0]]), [[true, false]]);
        assert_eq!(turns(&[&[0.0, 0.05, 0.2, -0.2]]), [[false, false, true]]);
        assert_eq!(turns(&[&[-0.2, 0.2, 0.05, 0.0]]), [[true, false, false]]);
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
