//! The working point of the linearisation, and the sweeps about it.

use nalgebra::DVector;
use rayon::prelude::*;

use crate::{
    error::GapError,
    likelihood::{
        by_trial::Deviation,
        columns::{self, LinkColumns, Sweep},
        directions::Direction,
        filter::{self, Filtered, Forces},
        form_error::{self, Beside},
        found::{Found, likeliest},
        innovations::{self, Innovation},
        level::{Level, Sizes},
        search::{Choices, Search},
        track::Track,
    },
    plant::Quantity,
    problem::{point::Point, problem::Problem},
    progress::Watch,
    rollout::state_estimation,
};

/// Sweeps that let a working point settle, at most, and the change of the log likelihood that ends them [nat].
const SETTLING: usize = 5;
const SETTLED: f64 = 0.5;
/// Sweeps that let starts and forces follow the readings, at most.
const FOLLOWING: usize = 10;

/// Values of a set, and the starts and unmodelled forces of all segments.
pub(crate) struct WorkingPoint<'p, 'a> {
    pub(crate) problem: &'p Problem<'a>,
    watch: &'p Watch<'p>,
    tracks: Vec<Track>,
    arrival: Vec<DVector<f64>>,
    scale: DVector<f64>,
    /// Levels of disturbances to look at.
    sizes: Vec<Sizes>,
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

/// One sweep: the likelihood of all tracks at every level of disturbances.
pub(crate) struct Swept {
    /// Columns by track; none where they were not kept.
    links: Vec<Vec<LinkColumns>>,
    /// Sizes of correlated noise that they were whitened for.
    drifts: Vec<f64>,
    pub(crate) levels: Vec<Level>,
}

impl Swept {
    /// Place of a level's correlated noise among those of the links.
    fn noise(&self, sizes: Sizes) -> usize {
        let mut drifts = self.drifts.iter();
        drifts.position(|drift| *drift == sizes.drift).unwrap_or(0)
    }
}

/// Columns of one track and its likelihood by level; none at a level where the filter fails.
struct TrackSwept {
    links: Vec<LinkColumns>,
    filtered: Vec<Option<Filtered>>,
}

impl<'p, 'a> WorkingPoint<'p, 'a> {
    /// The empty set at the nominal, every start where the estimated motion has it.
    pub(crate) fn new(problem: &'p Problem<'a>, watch: &'p Watch<'p>) -> Result<Self, GapError> {
        let most =
            problem.settings.options.segments.most_freedom_seconds / problem.model.nv.max(1) as f64;
        let each = most / problem.trials.len().max(1) as f64;
        let tracks: Vec<Track> = problem
            .trials
            .iter()
            .zip(&problem.motions)
            .enumerate()
            .map(|(at, (trial, motion))| {
                let length = segment_length(problem, at);
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
            sizes: sizes(problem),
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
        let mut links = Vec::new();
        let mut by_level: Vec<Vec<Filtered>> = vec![Vec::new(); self.sizes.len()];
        let tracks = swept.len();
        for track in swept {
            links.push(track.links);
            for (level, filtered) in by_level.iter_mut().zip(track.filtered) {
                level.extend(filtered);
            }
        }
        let whole = (self.sizes.iter().zip(by_level)).filter(|(_, of)| of.len() == tracks);
        let mut levels = Vec::new();
        for (sizes, trials) in whole {
            levels.extend(Level::new(levels.len(), *sizes, trials, &beside));
        }
        Ok(Some(Swept {
            links,
            drifts: self.drifts(),
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
        let drifts = self.drifts();
        let links = columns::sweep(
            problem,
            track,
            &self.point.in_trial(track.trial),
            Sweep {
                directions,
                pieces: options.pieces,
                block,
                look: options.look.max(block),
                force_scale: &self.scale,
                drifts: &drifts,
                keep_readings: keep == Keep::Readings,
            },
        )?;
        let Some(links) = links else { return Ok(None) };
        let own = match directions {
            Some(_) => uncertain_by_trial(problem),
            None => Vec::new(),
        };
        let filtered = self
            .sizes
            .par_iter()
            .map(|sizes| {
                let noise = drifts.iter().position(|drift| *drift == sizes.drift)?;
                let force = self.forces(track, sizes.force);
                let trial = track.trial;
                filter::filter(trial, &links, noise, parameters, arrival, force)?.with_own(&own)
            })
            .collect();
        Ok(Some(TrackSwept {
            links: if keep != Keep::Likelihood {
                links
            } else {
                Vec::new()
            },
            filtered,
        }))
    }

    /// Sizes of correlated noise among the levels.
    fn drifts(&self) -> Vec<f64> {
        let mut drifts: Vec<f64> = self.sizes.iter().map(|of| of.drift).collect();
        drifts.sort_by(f64::total_cmp);
        drifts.dedup();
        drifts
    }

    /// Prior of the unmodelled forces of a track.
    fn forces(&self, track: &Track, sd: f64) -> Forces {
        let options = &self.problem.settings.options.likelihood;
        let piece = segment_length(self.problem, track.trial) / options.pieces as f64;
        Forces {
            sd,
            correlation: (-piece / options.force_time).exp(),
        }
    }

    /// Moves starts and unmodelled forces to where all readings have them, the parameters of every trial known.
    fn smooth(&mut self, swept: &Swept, z: &[DVector<f64>], sizes: Sizes) -> Result<(), GapError> {
        let noise = swept.noise(sizes);
        let priors: Vec<Forces> = (self.tracks.iter())
            .map(|track| self.forces(track, sizes.force))
            .collect();
        let links = swept.links.iter().zip(&self.arrival).zip(priors).zip(z);
        for (track, (((links, arrival), prior), z)) in self.tracks.iter_mut().zip(links) {
            let Some(smoothed) = filter::smooth(links, noise, z, arrival, prior) else {
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
                .filter_map(|level| Some((level.sizes, level.given(&[])?.empty)))
                .max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((sizes, log)) = best else {
                return Ok(false);
            };
            let none = vec![DVector::zeros(0); self.tracks.len()];
            self.smooth(&swept, &none, sizes)?;
            if self.point.candidates.is_empty() {
                self.look_up_to(sizes.force);
            }
            if last.is_some_and(|last| (log - last).abs() < SETTLED) {
                break;
            }
            last = Some(log);
        }
        Ok(true)
    }

    /// Levels worth a look where without effects some unmodelled forces are the likeliest: effects leave less to them.
    fn look_up_to(&mut self, likeliest: f64) {
        let forces = &self.problem.settings.options.likelihood.forces;
        let next = forces.iter().find(|force| **force > likeliest);
        let largest = next.copied().unwrap_or(likeliest);
        self.sizes = sizes(self.problem);
        self.sizes.retain(|of| of.force <= largest);
    }

    /// Lets starts, numbers and the set's values settle, no other effect in sight. False where a track blows up.
    pub(crate) fn settle(&mut self) -> Result<bool, GapError> {
        let mut last: Option<(Sizes, f64)> = None;
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
            self.smooth(&swept, &z, level.sizes)?;
            self.point = point;
            let now = (level.sizes, best.log_posterior);
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
        let least = swept.as_ref().and_then(|swept| self.least_forces(swept));
        Ok(least.map(|(_, found)| found.log_likelihood))
    }

    /// The same beside the likeliest unmodelled forces.
    pub(crate) fn settled_likelihood(&mut self) -> Result<Option<f64>, GapError> {
        if !(self.follow()? && self.settle()?) {
            return Ok(None);
        }
        let Some(swept) = self.sweep(Some(&[]), Keep::Likelihood)? else {
            return Ok(None);
        };
        let found = swept.levels.iter().filter_map(|level| self.own_set(level));
        let logs = found.map(|found| found.log_likelihood);
        Ok(logs.max_by(f64::total_cmp))
    }

    /// Leaves the rows of every trial out from one on.
    pub(crate) fn keep_rows(&mut self, rows: usize) {
        for track in &mut self.tracks {
            track.links.retain(|link| link.segment.rows.end <= rows);
        }
    }

    /// Uncertain numbers and the point's own parameters of the only trial, the point's values known but for deviations along
    /// some directions of these. `None` where the trial blows up.
    pub(crate) fn own_values(
        &mut self,
        directions: &[Deviation],
    ) -> Result<Option<DVector<f64>>, GapError> {
        if !self.follow()? {
            return Ok(None);
        }
        let Some(swept) = self.sweep(Some(&[]), Keep::Likelihood)? else {
            return Ok(None);
        };
        let found = swept.levels.iter().filter_map(|level| self.own_set(level));
        let found: Vec<Found> = found.collect();
        let level = likeliest(&found).map(|found| &swept.levels[found.level]);
        let forms = form_error::beside(self.problem, &self.point);
        let numbers = forms.numbers;
        // Errors of form are none, here as where the fit was made.
        let kept: Vec<usize> = (0..numbers)
            .chain(forms.len()..forms.len() + self.point.values.iter().map(Vec::len).sum::<usize>())
            .collect();
        let known = self.problem.normalised(&self.point);
        Ok(level.and_then(|level| level.deviating(&kept, directions, &known)))
    }

    /// The point's set on the likelihood of a sweep without directions.
    fn own_set(&self, level: &Level) -> Option<Found> {
        let choices = Choices::new(self.problem, &self.point, &[]);
        let choices = &choices;
        Search { level, choices }.whole(&self.point.candidates)
    }

    /// The point's set beside the least unmodelled forces, where the drifts make it likeliest.
    fn least_forces<'s>(&self, swept: &'s Swept) -> Option<(&'s Level, Found)> {
        let least = swept.levels.first()?.sizes.force;
        let levels = swept.levels.iter().filter(|of| of.sizes.force == least);
        let found: Vec<Found> = levels.filter_map(|level| self.own_set(level)).collect();
        let best = likeliest(&found)?.clone();
        Some((&swept.levels[best.level], best))
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
        let Some((level, found)) = self.least_forces(&swept) else {
            return Ok(None);
        };
        let (_, z) = level.moved(self.problem, &self.point, &[], &found);
        let seconds = self.problem.settings.options.segments.length;
        let by_track = (self
            .tracks
            .iter()
            .zip(&swept.links)
            .zip(&self.arrival)
            .zip(&z))
        .map(|(((track, links), arrival), z)| {
            innovations::innovations(
                self.problem,
                track,
                links,
                swept.noise(level.sizes),
                z,
                (arrival, self.forces(track, level.sizes.force)),
                seconds,
            )
        });
        Ok(by_track.collect())
    }

    /// Goes half the way back to the nominal.
    pub(crate) fn halve(&mut self) {
        self.point.nuisances *= 0.5;
        let point = &mut self.point;
        let held = point.candidates.iter().zip(&mut point.values);
        for ((candidate, values), by_trial) in held.zip(&mut point.by_trial) {
            let parameters = &self.problem.candidates[*candidate].parameters;
            for values in by_trial.values_mut().chain([values]) {
                for (value, p) in values.iter_mut().zip(parameters) {
                    *value = 0.5 * (*value + p.null);
                }
            }
        }
    }
}

/// All levels of disturbances, those of the least forces first.
fn sizes(problem: &Problem<'_>) -> Vec<Sizes> {
    let options = &problem.settings.options.likelihood;
    let drifts = match problem.drifting.is_empty() {
        true => &options.drifts[..1],
        false => &options.drifts[..],
    };
    let all = options.forces.iter().flat_map(|force| {
        let of = |drift: &f64| Sizes {
            force: *force,
            drift: *drift,
        };
        drifts.iter().map(of)
    });
    all.collect()
}

/// Directions in which the uncertain numbers of the nominal deviate from trial to trial: the gain of all actuators together.
fn uncertain_by_trial(problem: &Problem<'_>) -> Vec<Deviation> {
    let gain = problem.settings.uncertainty.gain_by_trial;
    let numbers = problem.nuisances.iter().enumerate();
    let gains: Deviation = numbers
        .filter(|(_, (of, _))| problem.model.nuisances[*of].quantity == Quantity::Gain)
        .map(|(at, (_, sd))| (at, gain / sd))
        .collect();
    match gain > 0.0 && !gains.is_empty() {
        true => vec![gains],
        false => Vec::new(),
    }
}

/// Length of a trial's segments [s].
fn segment_length(problem: &Problem<'_>, trial: usize) -> f64 {
    let options = &problem.settings.options.likelihood;
    let rows = options.segment_rows * problem.trials[trial].period();
    options.segment_length.max(rows)
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
