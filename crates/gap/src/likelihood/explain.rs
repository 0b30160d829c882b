//! Which set of effects explains the trials: sweep, filter, search, and again about the best set.

use hydro_effects::Id;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    error::GapError,
    fit::{
        hypothesis::Point, laplace::Quadratic, segmented_problem::SegmentedProblem,
        truncated_normal::Bounds,
    },
    likelihood::{
        columns::{self, LinkColumns},
        filter::{self, Forces},
        form_error,
        search::{Choices, Found, Level, Search, log_sum},
        track::Track,
    },
    progress::Watch,
    rollout::state_estimation,
    select::{linear_evidence, screen::Direction},
};

/// Rounds of sweep and search at most.
const ROUNDS: usize = 6;
/// Sweeps that let a working point settle, at most, and the change of the log likelihood that ends them [nat].
const SETTLING: usize = 5;
const SETTLED: f64 = 0.5;
/// Sweeps that let starts and forces follow the readings, at most.
const FOLLOWING: usize = 10;

/// A set with its share of the posterior.
#[derive(Clone, Debug)]
pub(crate) struct Explained {
    pub(crate) effects: Vec<(Id, Vec<String>)>,
    pub(crate) force: f64,
    pub(crate) log_posterior: f64,
    pub(crate) probability: f64,
    pub(crate) values: Vec<(usize, Vec<f64>)>,
}

/// The working point, and what the sweeps about it need.
struct Working<'p, 'a> {
    problem: &'p SegmentedProblem<'a>,
    watch: &'p Watch<'p>,
    tracks: Vec<Track>,
    arrival: Vec<DVector<f64>>,
    scale: DVector<f64>,
    noise: Vec<f64>,
    point: Point,
}

/// One sweep: columns of all tracks, filtered at every level.
struct Swept {
    links: Vec<Option<Vec<LinkColumns>>>,
    levels: Vec<Level>,
    /// Parameters that are integrated out: uncertain numbers, errors of form.
    beside: usize,
}

impl Working<'_, '_> {
    fn sweep(&self, directions: Option<&[Direction]>) -> Result<Swept, GapError> {
        let problem = self.problem;
        let step = problem.model.timestep;
        let options = &problem.options.likelihood;
        let links: Vec<Option<Vec<LinkColumns>>> = self
            .tracks
            .par_iter()
            .map(|track| {
                self.watch.check()?;
                let period = problem.trials[track.trial].period();
                let block = period.clamp(options.block[0], options.block[1]).max(step);
                columns::sweep(
                    problem,
                    track,
                    &self.point,
                    directions,
                    options.pieces,
                    block,
                    &self.scale,
                    &self.noise,
                )
            })
            .collect::<Result<_, GapError>>()?;
        let beside = directions.map_or(0, |_| {
            problem.nuisances.len() + form_error::forms(problem, &self.point)
        });
        let parameters = directions.map_or(0, |of| beside + own(problem, &self.point) + of.len());
        let levels = options
            .forces
            .par_iter()
            .filter_map(|force| {
                let prior = self.forces(*force);
                let (mut gram, mut half) = (DMatrix::zeros(1 + parameters, 1 + parameters), 0.0);
                for (links, arrival) in links.iter().zip(&self.arrival) {
                    let filtered = filter::filter(links.as_ref()?, parameters, arrival, prior)?;
                    gram += filtered.gram;
                    half += filtered.half_log_determinant;
                }
                Level::new(*force, &gram, half, beside)
            })
            .collect();
        Ok(Swept {
            links,
            levels,
            beside,
        })
    }

    /// Moves the working point to a found set, and the starts to where the readings have them then.
    fn move_to(
        &mut self,
        swept: &Swept,
        directions: &[Direction],
        found: &Found,
    ) -> Result<(), GapError> {
        let level = &swept.levels[found.level];
        let (point, z) = moved(
            self.problem,
            &self.point,
            directions,
            level,
            found,
            swept.beside,
        );
        self.smooth(swept, &z, level.force)?;
        self.point = point;
        Ok(())
    }

    /// Prior of the unmodelled forces at a level.
    fn forces(&self, sd: f64) -> Forces {
        Forces {
            sd,
            correlation: self.problem.options.likelihood.force_correlation,
        }
    }

    /// Moves starts and unmodelled forces to where all readings have them, parameters known.
    fn smooth(&mut self, swept: &Swept, z: &DVector<f64>, force: f64) -> Result<(), GapError> {
        let prior = self.forces(force);
        for ((track, links), arrival) in self.tracks.iter_mut().zip(&swept.links).zip(&self.arrival)
        {
            let smoothed = links
                .as_ref()
                .and_then(|links| filter::smooth(links, z, arrival, prior));
            if let Some(smoothed) = smoothed {
                move_starts(self.problem, track, &smoothed.starts)?;
                for (link, forces) in track.links.iter_mut().zip(smoothed.forces) {
                    if forces.iter().all(|value| value.is_finite()) {
                        link.forces = forces.as_slice().to_vec();
                    }
                }
            }
        }
        Ok(())
    }

    /// Lets starts and unmodelled forces follow the readings, all parameters as they are.
    fn follow(&mut self) -> Result<(), GapError> {
        let mut last: Option<f64> = None;
        for _ in 0..FOLLOWING {
            let swept = self.sweep(None)?;
            let best = (swept.levels.iter()).max_by(|a, b| a.empty.total_cmp(&b.empty));
            let Some(best) = best else { return Ok(()) };
            let (force, log) = (best.force, best.empty);
            self.smooth(&swept, &DVector::zeros(0), force)?;
            if last.is_some_and(|last| (log - last).abs() < SETTLED) {
                break;
            }
            last = Some(log);
        }
        Ok(())
    }

    /// Noise factors from the residuals: more than declared, never less.
    fn adapt_noise(&mut self, swept: &Swept) {
        let mut squares = vec![(0.0, 0_u32); self.noise.len()];
        for link in swept.links.iter().flatten().flatten() {
            for (sum, of) in squares.iter_mut().zip(&link.squares) {
                sum.0 += of.0;
                sum.1 += of.1 as u32;
            }
        }
        let channels = &self.problem.channels.list;
        for ((noise, (sum, count)), channel) in self.noise.iter_mut().zip(&squares).zip(channels) {
            let factor = (sum / f64::from(*count).max(1.0)).sqrt();
            *noise = if channel.declared_noise.is_some() {
                factor.max(1.0)
            } else {
                factor.max(1e-3)
            };
        }
    }

    /// Lets starts, numbers and the set's values settle, no other effect in sight.
    fn settle(&mut self) -> Result<(), GapError> {
        let mut last: Option<(usize, f64)> = None;
        for _ in 0..SETTLING {
            let swept = self.sweep(Some(&[]))?;
            let choices = Choices::new(self.problem, &self.point, &[]);
            let best = (swept.levels.iter().enumerate())
                .filter_map(|(number, level)| {
                    let search = Search {
                        level,
                        number,
                        choices: &choices,
                    };
                    search.whole(&self.point.candidates)
                })
                .max_by(|a, b| a.log_posterior.total_cmp(&b.log_posterior));
            let Some(best) = best else { return Ok(()) };
            self.move_to(&swept, &[], &best)?;
            let settled = last.is_some_and(|(level, log)| {
                level == best.level && (best.log_posterior - log).abs() < SETTLED
            });
            last = Some((best.level, best.log_posterior));
            if settled {
                break;
            }
        }
        Ok(())
    }
}

/// Sweeps, searches and moves the working point until the best set stays.
pub(crate) fn explain(
    problem: &SegmentedProblem<'_>,
    most_seconds: f64,
    watch: &Watch<'_>,
) -> Result<Vec<Explained>, GapError> {
    let options = &problem.options.likelihood;
    let each = most_seconds / problem.trials.len().max(1) as f64;
    let tracks: Vec<Track> = problem
        .trials
        .iter()
        .zip(problem.motions)
        .enumerate()
        .map(|(at, (trial, motion))| {
            let length = options
                .segment_length
                .max(options.segment_rows * trial.period());
            let rest = problem.options.segments.joined_rest;
            Track::new(
                at,
                trial,
                motion,
                [length, rest * length, each],
                problem.model.timestep,
            )
        })
        .collect();
    let mut working = Working {
        problem,
        watch,
        arrival: arrival(problem),
        scale: force_scale(problem, &tracks)?,
        tracks,
        noise: vec![1.0; problem.channels.len()],
        point: Point {
            candidates: Vec::new(),
            values: Vec::new(),
            nuisances: DVector::zeros(problem.nuisances.len()),
            starts: Vec::new(),
        },
    };
    let mut last: Option<(Vec<usize>, f64)> = None;
    let mut result = Vec::new();
    for round in 0..ROUNDS {
        working.follow()?;
        // Without a set only starts and forces may explain the gap, or the numbers would run to their bounds for it.
        if round > 0 {
            working.settle()?;
        }
        let directions: Vec<Direction> = (0..problem.candidates.len())
            .filter(|candidate| !working.point.candidates.contains(candidate))
            .flat_map(|candidate| problem.directions(candidate))
            .collect();
        let swept = working.sweep(Some(&directions))?;
        let choices = Choices::new(problem, &working.point, &directions);
        let mut found: Vec<Found> = (swept.levels.iter().enumerate())
            .flat_map(|(number, level)| {
                Search {
                    level,
                    number,
                    choices: &choices,
                }
                .run()
            })
            .collect();
        found.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
        let Some(best) = found.first() else { break };
        let total = log_sum(found.iter().map(|of| of.log_posterior));
        result = found
            .iter()
            .map(|of| Explained {
                effects: of
                    .set
                    .iter()
                    .map(|at| {
                        (
                            problem.candidates[*at].effect,
                            problem.candidates[*at].targets.clone(),
                        )
                    })
                    .collect(),
                force: swept.levels[of.level].force,
                log_posterior: of.log_posterior,
                probability: (of.log_posterior - total).exp(),
                values: Vec::new(),
            })
            .collect();
        let stays = last
            .as_ref()
            .is_some_and(|(set, log)| *set == best.set && (log - best.log_posterior).abs() < 1.0);
        last = Some((best.set.clone(), best.log_posterior));
        if stays {
            break;
        }
        working.move_to(&swept, &directions, best)?;
        working.adapt_noise(&swept);
    }
    if let Some(first) = result.first_mut() {
        let point = &working.point;
        first.values = point
            .candidates
            .iter()
            .copied()
            .zip(point.values.iter().cloned())
            .collect();
    }
    Ok(result)
}

fn own(problem: &SegmentedProblem<'_>, point: &Point) -> usize {
    point
        .candidates
        .iter()
        .map(|of| problem.candidates[*of].parameters.len())
        .sum()
}

/// Standard deviation of the first start of every track.
fn arrival(problem: &SegmentedProblem<'_>) -> Vec<DVector<f64>> {
    let options = &problem.options.states;
    problem
        .trials
        .iter()
        .map(|trial| {
            let sd = if trial.initial_state.is_some() {
                options.arrival_sd
            } else {
                options.first_arrival_sd
            };
            state_estimation::arrival_precision(problem.model.nv, sd)
                .map(|precision| precision.sqrt().recip())
        })
        .collect()
}

/// Scale of the unmodelled force on every degree of freedom: inertia times the root mean square acceleration, as in the trials
/// and unforced.
fn force_scale(problem: &SegmentedProblem<'_>, tracks: &[Track]) -> Result<DVector<f64>, GapError> {
    let nv = problem.model.nv;
    let step = problem.model.timestep;
    let nominal = vec![0.0; problem.model.nuisances.len()];
    let mut simulation = problem.plant.simulation(&nominal, &[])?;
    // Accelerations from the estimated motion, inertia from the response to a force.
    let (mut squares, mut count) = (DVector::<f64>::zeros(nv), 0.0);
    let mut mobility = DVector::<f64>::zeros(nv);
    let mut free = DVector::<f64>::zeros(nv);
    let mut looked = 0.0;
    for track in tracks {
        let motion = &problem.motions[track.trial];
        for row in 1..motion.times.len() {
            let seconds = motion.times[row] - motion.times[row - 1];
            let ((_, before), (_, after)) = (motion.state(row - 1), motion.state(row));
            for axis in 0..nv {
                squares[axis] += ((after[axis] - before[axis]) / seconds).powi(2);
            }
            count += 1.0;
        }
        for link in track.links.iter().step_by(4) {
            let segment = &link.segment;
            let mut after = |force: Option<usize>| {
                let mut pushed = vec![0.0; nv];
                if let Some(axis) = force {
                    pushed[axis] = 1.0;
                }
                simulation.set_motion(segment.start, &segment.qpos, &segment.qvel);
                simulation.set_force(&pushed);
                simulation.step();
                simulation.qvel().to_vec()
            };
            let from = after(None);
            for axis in 0..nv {
                free[axis] += ((from[axis] - segment.qvel[axis]) / step).powi(2);
            }
            for axis in 0..nv {
                mobility[axis] += (after(Some(axis))[axis] - from[axis]) / step;
            }
            looked += 1.0;
        }
    }
    Ok(DVector::from_fn(nv, |axis, _| {
        let inertia = looked / mobility[axis].abs().max(1e-12);
        let acceleration =
            (squares[axis] / f64::max(count, 1.0) + free[axis] / f64::max(looked, 1.0)).sqrt();
        inertia * acceleration.max(1e-3)
    }))
}

/// The working point at a found set, and all parameters of the sweep there.
fn moved(
    problem: &SegmentedProblem<'_>,
    point: &Point,
    directions: &[Direction],
    level: &Level,
    found: &Found,
    beside: usize,
) -> (Point, DVector<f64>) {
    let nuisances = beside;
    let own = own(problem, point);
    let mut z = DVector::zeros(nuisances + own + directions.len());
    if let Some(posterior) = &found.posterior {
        for (column, value) in found.columns.iter().zip(posterior.mean.iter()) {
            z[nuisances + column] = *value;
        }
    }
    // The uncertain numbers that go with them, within their bounds.
    let rest = z.len() - nuisances;
    let across = level.whole.a.view((0, nuisances), (nuisances, rest));
    let numbers = Quadratic {
        q: 0.0,
        b: level.whole.b.rows(0, nuisances) - across * z.rows(nuisances, rest),
        a: level
            .whole
            .a
            .view((0, 0), (nuisances, nuisances))
            .into_owned(),
    };
    let most = problem.options.fit.largest_shift;
    let bounds = vec![
        Bounds {
            lower: -most,
            upper: most,
        };
        nuisances
    ];
    if let Some(best) = numbers.best(&bounds) {
        z.rows_mut(0, nuisances).copy_from(&best.z);
    }
    let mut next = Point {
        candidates: Vec::new(),
        values: Vec::new(),
        nuisances: z.rows(0, problem.nuisances.len()).into_owned(),
        starts: Vec::new(),
    };
    for (candidate, ..) in &found.members {
        let parameters = &problem.candidates[*candidate].parameters;
        let mut first = 0;
        let mut values = None;
        for (row, of) in point.candidates.iter().enumerate() {
            if of == candidate {
                let own: Vec<f64> = parameters
                    .iter()
                    .enumerate()
                    .map(|(at, p)| {
                        let about = if p.shapes {
                            point.values[row][at]
                        } else {
                            p.null
                        };
                        (about + z[nuisances + first + at] * p.prior_sd).clamp(p.lower, p.upper)
                    })
                    .collect();
                values = Some(own);
            }
            first += point.values[row].len();
        }
        let values = values.unwrap_or_else(|| {
            let along: Vec<(&Direction, f64)> = found
                .columns
                .iter()
                .filter(|column| **column >= own)
                .map(|column| (&directions[column - own], z[nuisances + column]))
                .filter(|(direction, _)| direction.candidate == *candidate)
                .collect();
            linear_evidence::values(problem, *candidate, &along)
        });
        next.candidates.push(*candidate);
        next.values.push(values);
    }
    (next, z)
}

fn move_starts(
    problem: &SegmentedProblem<'_>,
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
