//! The working point of the linearisation, and the sweeps about it.

use nalgebra::DVector;
use rayon::prelude::*;

use crate::{
    error::GapError,
    likelihood::{
        columns::{self, LinkColumns, Sweep},
        directions::Direction,
        filter::{self, Filtered, Forces},
        form_error::{self, Beside},
        found::{Found, likeliest},
        innovations::{self, Innovation},
        level::Level,
        search::{Choices, Search},
        track::Track,
    },
    problem::{point::Point, problem::Problem},
    progress::Watch,
    rollout::state_estimation,
};

/// Sweeps that let a working point settle, at most, and the change of the log likelihood that ends them [nat].
const SETTLING: usize = 5;
const SETTLED: f64 = 0.5;
/// Sweeps that let starts and forces follow the readings, at most.
const FOLLOWING: usize = 10;

/// Values of a set, the starts and unmodelled forces of all segments, and the noise.
pub(crate) struct WorkingPoint<'p, 'a> {
    pub(crate) problem: &'p Problem<'a>,
    watch: &'p Watch<'p>,
    tracks: Vec<Track>,
    arrival: Vec<DVector<f64>>,
    scale: DVector<f64>,
    noise: Vec<f64>,
    pub(crate) point: Point,
}

/// Part of a sweep that is kept beside the likelihood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Keep {
    Likelihood,
    /// Columns of every segment: memory grows with the trials.
    Columns,
    /// Those of every reading too.
    Readings,
}

/// One sweep: the likelihood of all tracks at every level of unmodelled forces.
pub(crate) struct Swept {
    /// Columns by track; none where they were not kept.
    links: Vec<Vec<LinkColumns>>,
    /// Whitened squares and count of the residuals by channel, as rolled out.
    squares: Vec<(f64, usize)>,
    pub(crate) levels: Vec<Level>,
}

/// Columns of one track and its likelihood by level; none at a level where the filter fails.
struct TrackSwept {
    links: Vec<LinkColumns>,
    squares: Vec<(f64, usize)>,
    filtered: Vec<Option<Filtered>>,
}

impl<'p, 'a> WorkingPoint<'p, 'a> {
    /// The empty set at the nominal, every start where the estimated motion has it.
    pub(crate) fn new(problem: &'p Problem<'a>, watch: &'p Watch<'p>) -> Result<Self, GapError> {
        let options = &problem.settings.options.likelihood;
        let most =
            problem.settings.options.segments.most_freedom_seconds / problem.model.nv.max(1) as f64;
        let each = most / problem.trials.len().max(1) as f64;
        let tracks: Vec<Track> = problem
            .trials
            .iter()
            .zip(&problem.motions)
            .enumerate()
            .map(|(at, (trial, motion))| {
                let length = options
                    .segment_length
                    .max(options.segment_rows * trial.period());
                let rest = problem.settings.options.segments.joined_rest;
                Track::new(
                    at,
                    trial,
                    motion,
                    [length, rest, each],
                    problem.model.timestep,
                )
            })
            .collect();
        Ok(Self {
            problem,
            watch,
            arrival: arrival(problem),
            scale: force_scale(problem, &tracks)?,
            tracks,
            noise: vec![1.0; problem.channels.len()],
            point: problem.origin(),
        })
    }

    /// Sweeps all tracks; without `directions`, for starts and unmodelled forces alone. `None` where a track blows up.
    pub(crate) fn sweep(
        &self,
        directions: Option<&[Direction]>,
        keep: Keep,
    ) -> Result<Option<Swept>, GapError> {
        let problem = self.problem;
        let options = &problem.settings.options.likelihood;
        let beside = directions.map_or_else(Beside::default, |_| {
            form_error::beside(problem, &self.point)
        });
        let own: usize = self.point.values.iter().map(Vec::len).sum();
        let parameters = directions.map_or(0, |of| beside.len() + own + of.len());
        let swept: Option<Vec<TrackSwept>> = self
            .tracks
            .par_iter()
            .zip(&self.arrival)
            .map(|(track, arrival)| {
                self.watch.check()?;
                self.sweep_track(track, arrival, directions, parameters, keep)
            })
            .collect::<Result<_, GapError>>()?;
        let Some(swept) = swept else { return Ok(None) };
        let squares = summed(self.noise.len(), swept.iter().map(|track| &track.squares));
        let mut links = Vec::new();
        let mut by_level: Vec<Vec<Filtered>> = vec![Vec::new(); options.forces.len()];
        let tracks = swept.len();
        for track in swept {
            links.push(track.links);
            for (level, filtered) in by_level.iter_mut().zip(track.filtered) {
                level.extend(filtered);
            }
        }
        let whole = (options.forces.iter().zip(by_level)).filter(|(_, of)| of.len() == tracks);
        let levels = whole
            .enumerate()
            .filter_map(|(number, (force, trials))| Level::new(number, *force, trials, &beside))
            .collect();
        Ok(Some(Swept {
            links,
            squares,
            levels,
        }))
    }

    fn sweep_track(
        &self,
        track: &Track,
        arrival: &DVector<f64>,
        directions: Option<&[Direction]>,
        parameters: usize,
        keep: Keep,
    ) -> Result<Option<TrackSwept>, GapError> {
        let problem = self.problem;
        let options = &problem.settings.options.likelihood;
        let period = problem.trials[track.trial].period();
        let block = period
            .clamp(options.block[0], options.block[1])
            .max(problem.model.timestep);
        let links = columns::sweep(
            problem,
            track,
            &self.point,
            Sweep {
                directions,
                pieces: options.pieces,
                block,
                look: options.look.max(block),
                force_scale: &self.scale,
                noise: &self.noise,
                keep_readings: keep == Keep::Readings,
            },
        )?;
        let Some(links) = links else { return Ok(None) };
        let squares = summed(self.noise.len(), links.iter().map(|link| &link.squares));
        let filtered = options
            .forces
            .par_iter()
            .map(|force| filter::filter(&links, parameters, arrival, self.forces(*force)))
            .collect();
        Ok(Some(TrackSwept {
            links: if keep != Keep::Likelihood {
                links
            } else {
                Vec::new()
            },
            squares,
            filtered,
        }))
    }

    /// Prior of the unmodelled forces at a level.
    fn forces(&self, sd: f64) -> Forces {
        Forces {
            sd,
            correlation: self.problem.settings.options.likelihood.force_correlation,
        }
    }

    /// Moves starts and unmodelled forces to where all readings have them, parameters known.
    fn smooth(&mut self, swept: &Swept, z: &DVector<f64>, force: f64) -> Result<(), GapError> {
        let prior = self.forces(force);
        for ((track, links), arrival) in self.tracks.iter_mut().zip(&swept.links).zip(&self.arrival)
        {
            let Some(smoothed) = filter::smooth(links, z, arrival, prior) else {
                continue;
            };
            move_starts(self.problem, track, &smoothed.starts)?;
            for (link, forces) in track.links.iter_mut().zip(smoothed.forces) {
                if forces.iter().all(|value| value.is_finite()) {
                    link.forces = forces.as_slice().to_vec();
                }
            }
        }
        Ok(())
    }

    /// Lets starts and unmodelled forces follow the readings, all parameters as they are. False where a track blows up.
    pub(crate) fn follow(&mut self) -> Result<bool, GapError> {
        let mut last: Option<f64> = None;
        for _ in 0..FOLLOWING {
            let Some(swept) = self.sweep(None, Keep::Columns)? else {
                return Ok(false);
            };
            let best = (swept.levels.iter())
                .filter_map(|level| Some((level.force, level.given(&[])?.empty)))
                .max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((force, log)) = best else {
                return Ok(false);
            };
            self.smooth(&swept, &DVector::zeros(0), force)?;
            if last.is_some_and(|last| (log - last).abs() < SETTLED) {
                break;
            }
            last = Some(log);
        }
        Ok(true)
    }

    /// Lets starts, numbers and the set's values settle, no other effect in sight. False where a track blows up.
    pub(crate) fn settle(&mut self) -> Result<bool, GapError> {
        let mut last: Option<(f64, f64)> = None;
        for _ in 0..SETTLING {
            let Some(swept) = self.sweep(Some(&[]), Keep::Columns)? else {
                return Ok(false);
            };
            let levels = swept.levels.iter();
            let found: Vec<Found> = levels.filter_map(|level| self.own_set(level)).collect();
            let Some(best) = likeliest(&found) else {
                return Ok(false);
            };
            let level = &swept.levels[best.level];
            let (point, z) = level.moved(self.problem, &self.point, &[], best);
            self.smooth(&swept, &z, level.force)?;
            self.point = point;
            let now = (level.force, best.log_posterior);
            if last.is_some_and(|last| last.0 == now.0 && (last.1 - now.1).abs() < SETTLED) {
                break;
            }
            last = Some(now);
        }
        Ok(true)
    }

    /// Log marginal likelihood of the point's set beside the least unmodelled forces, once it has settled. `None` where a trial
    /// blows up.
    pub(crate) fn settled_evidence(&mut self) -> Result<Option<f64>, GapError> {
        if !(self.follow()? && self.settle()?) {
            return Ok(None);
        }
        let swept = self.sweep(Some(&[]), Keep::Likelihood)?;
        let least = swept.as_ref().and_then(|swept| swept.levels.first());
        let found = least.and_then(|level| self.own_set(level));
        Ok(found.map(|found| found.log_likelihood))
    }

    /// The point's set on the likelihood of a sweep without directions.
    fn own_set(&self, level: &Level) -> Option<Found> {
        let choices = Choices::new(self.problem, &self.point, &[]);
        let choices = &choices;
        Search { level, choices }.whole(&self.point.candidates)
    }

    /// Innovations of every track: the difference of each segment from what those before predict without unmodelled forces, the
    /// uncertain numbers where all readings have them. `None` where a track blows up.
    pub(crate) fn innovations(&mut self) -> Result<Option<Vec<Vec<Innovation>>>, GapError> {
        if !self.follow()? {
            return Ok(None);
        }
        let Some(swept) = self.sweep(Some(&[]), Keep::Readings)? else {
            return Ok(None);
        };
        let least = swept.levels.first();
        let Some((level, found)) = least.and_then(|level| Some((level, self.own_set(level)?)))
        else {
            return Ok(None);
        };
        let (_, z) = level.moved(self.problem, &self.point, &[], &found);
        let prior = self.forces(level.force);
        let seconds = self.problem.settings.options.segments.length;
        let by_track = (self.tracks.iter().zip(&swept.links).zip(&self.arrival)).map(
            |((track, links), arrival)| {
                innovations::innovations(self.problem, track, links, &z, (arrival, prior), seconds)
            },
        );
        Ok(by_track.collect())
    }

    /// Goes half the way back to the nominal.
    pub(crate) fn halve(&mut self) {
        self.point.nuisances *= 0.5;
        for (candidate, values) in self.point.candidates.iter().zip(&mut self.point.values) {
            let parameters = &self.problem.candidates[*candidate].parameters;
            for (value, p) in values.iter_mut().zip(parameters) {
                *value = 0.5 * (*value + p.null);
            }
        }
    }

    /// Noise factors from the residuals, never below what is declared.
    pub(crate) fn adapt_noise(&mut self, swept: &Swept) {
        let least = self.problem.settings.options.likelihood.least_noise_factor;
        let channels = &self.problem.channels.list;
        for ((noise, (sum, count)), channel) in
            self.noise.iter_mut().zip(&swept.squares).zip(channels)
        {
            if *count == 0 {
                continue;
            }
            let factor = (sum / *count as f64).sqrt();
            let is_declared = channel.declared_noise.is_some();
            *noise = factor.max(if is_declared { 1.0 } else { least });
        }
    }
}

/// Sum of squares and counts by channel.
fn summed<'s>(
    channels: usize,
    all: impl Iterator<Item = &'s Vec<(f64, usize)>>,
) -> Vec<(f64, usize)> {
    let mut sums = vec![(0.0, 0); channels];
    for squares in all {
        for (sum, of) in sums.iter_mut().zip(squares) {
            sum.0 += of.0;
            sum.1 += of.1;
        }
    }
    sums
}

/// Standard deviation of the first start of every track.
fn arrival(problem: &Problem<'_>) -> Vec<DVector<f64>> {
    let options = &problem.settings.options.states;
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
fn force_scale(problem: &Problem<'_>, tracks: &[Track]) -> Result<DVector<f64>, GapError> {
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
                mobility[axis] += (after(Some(axis))[axis] - from[axis]) / step;
            }
            looked += 1.0;
        }
    }
    Ok(DVector::from_fn(nv, |axis, _| {
        let inertia = looked / mobility[axis].abs().max(1e-12);
        let acceleration =
            (squares[axis] / f64::max(count, 1.0) + free[axis] / f64::max(looked, 1.0)).sqrt();
        inertia * acceleration.max(problem.settings.options.likelihood.least_acceleration)
    }))
}

fn move_starts(
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
