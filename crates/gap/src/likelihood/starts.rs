//! The starts of a track's segments, and the unmodelled forces beside them, moved.

use nalgebra::DVector;

use crate::{error::GapError, likelihood::track::Track, problem::problem::Problem};

/// Tracks a part of the way from some to others: starts and unmodelled forces.
pub(super) fn on_the_way(
    problem: &Problem<'_>,
    from: &[Track],
    to: &[Track],
    part: f64,
) -> Result<Vec<Track>, GapError> {
    let nominal = vec![0.0; problem.model.nuisances.len()];
    let mut simulation = problem.plant.simulation(&nominal, &[])?;
    let nv = problem.model.nv;
    let mut tracks = from.to_vec();
    for (track, to) in tracks.iter_mut().zip(to) {
        for (link, to) in track.links.iter_mut().zip(&to.links) {
            let (start, end) = (&mut link.segment, &to.segment);
            simulation.set_motion(start.start, &start.qpos, &start.qvel);
            let mut tangent = vec![0.0; 2 * nv];
            simulation.differentiate(&start.qpos, &end.qpos, &mut tangent[..nv]);
            for ((way, from), to) in tangent[nv..].iter_mut().zip(&start.qvel).zip(&end.qvel) {
                *way = to - from;
            }
            for way in &mut tangent {
                *way *= part;
            }
            simulation.retract(&tangent);
            start.qpos = simulation.qpos().to_vec();
            start.qvel = simulation.qvel().to_vec();
            let forces = to.forces.iter().enumerate().map(|(at, to)| {
                let from = link.forces.get(at).copied().unwrap_or_default();
                from + part * (to - from)
            });
            link.forces = forces.collect();
        }
    }
    Ok(tracks)
}

/// Moves the starts of a track's segments along tangents [2 nv]; one that is not finite stays.
pub(super) fn move_starts(
    problem: &Problem<'_>,
    track: &mut Track,
    tangents: &[DVector<f64>],
) -> Result<(), GapError> {
    let nominal = vec![0.0; problem.model.nuisances.len()];
    let mut simulation = problem.plant.simulation(&nominal, &[])?;
    for (link, tangent) in track.links.iter_mut().zip(tangents) {
        if tangent.iter().any(|value| !value.is_finite()) {
            continue;
        }
        let segment = &mut link.segment;
        simulation.set_motion(segment.start, &segment.qpos, &segment.qvel);
        simulation.retract(tangent.as_slice());
        segment.qpos = simulation.qpos().to_vec();
        segment.qvel = simulation.qvel().to_vec();
    }
    Ok(())
}
