//! The working point of the linearisation, and the sweeps about it.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    error::GapError,
    likelihood::{
        by_trial,
        columns::{self, LinkColumns, Sweep},
        directions::Direction,
        disturbances::Disturbances,
        filter::{self, Filtered},
        force_scale::Unmodelled,
        form_error::{self, Beside},
        level::{Level, Sizes},
        levels::{Grid, Levels},
        reversals,
        scale_slope::{self, ScaleColumn},
        starts::move_starts,
        track::{self, Track},
    },
    problem::{point::Point, problem::Problem},
    progress::Watch,
    rollout::state_estimation,
};

/// Change of the log likelihood that ends the sweeps that let a point settle [nat].
pub(super) const SETTLED: f64 = 0.5;
/// Change of the log likelihood, as a part of it, that ends the sweeps that let starts and forces follow the readings: all sets go on
/// from there.
const FOLLOWED: f64 = 1e-3;
/// Sweeps that let starts and forces follow the readings, at most: from the estimated motion, and again at other values.
const FOLLOWING: usize = 10;
const FOLLOWING_AGAIN: usize = 2;

/// Values of a set, and the starts and unmodelled forces of all segments.
#[derive(Clone)]
pub(crate) struct WorkingPoint<'p, 'a> {
    pub(crate) problem: &'p Problem<'a>,
    watch: &'p Watch<'p>,
    pub(super) tracks: Vec<Track>,
    pub(super) arrival: Vec<DVector<f64>>,
    pub(super) unmodelled: Unmodelled,
    pub(super) levels: Levels,
    pub(crate) point: Point,
    /// True where it is known which readings rows resolve.
    is_weighed: bool,
    /// True where a step of the last fit went too far, or it ended before it had settled: its set counts by what the point has reached.
    pub(crate) counts_as_reached: bool,
    /// Log likelihood without effects, where sets are compared with none.
    pub(super) without_effects: Option<f64>,
    /// Candidates that no look is along.
    pub(super) left_out: BTreeSet<usize>,
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
    pub(super) links: Vec<Vec<LinkColumns>>,
    /// Sizes of correlated noise that they were whitened for.
    drifts: Vec<f64>,
    pub(crate) levels: Vec<Level>,
}

impl Swept {
    /// Place of a level's correlated noise among those of the links.
    pub(super) fn noise(&self, sizes: Sizes) -> usize {
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
        let sizes = (
            Unmodelled::new(problem, &tracks)?,
            Levels::coarse(Grid::of(problem)),
        );
        Ok(Self {
            is_weighed: false,
            ..Self::along(problem, watch, tracks, sizes)
        })
    }

    /// The empty set at the nominal, along tracks whose readings are weighed.
    pub(super) fn along(
        problem: &'p Problem<'a>,
        watch: &'p Watch<'p>,
        tracks: Vec<Track>,
        (unmodelled, levels): (Unmodelled, Levels),
    ) -> Self {
        Self {
            problem,
            watch,
            arrival: arrival(problem),
            unmodelled,
            tracks,
            levels,
            point: problem.origin(),
            is_weighed: true,
            counts_as_reached: false,
            without_effects: None,
            left_out: BTreeSet::new(),
        }
    }

    /// Weighs the readings by what rows resolve of the motion that starts and unmodelled forces follow.
    fn weigh(&mut self) -> Result<(), GapError> {
        let problem = self.problem;
        let origin = problem.origin();
        let scale = &self.unmodelled.forces(problem, &self.tracks, &origin)?;
        let pieces = problem.settings.options.likelihood.pieces;
        let tracks = self.tracks.par_iter_mut();
        tracks.try_for_each(|track| {
            let grid =
                track::Grid::new(looks(problem, track.trial), pieces, problem.model.timestep);
            if let Some(rolled) = track::weigh(problem, track, (grid, scale))? {
                reversals::discount(problem, track, &rolled, grid);
            }
            Ok(())
        })
    }

    /// Sweeps all tracks, each as one prediction or as predictions of a `horizon` [s]; without `directions`, for starts and
    /// unmodelled forces alone. Directions are looked along at the levels at which sets are searched. `None` where a track blows
    /// up.
    pub(crate) fn sweep(
        &self,
        directions: Option<&[Direction]>,
        keep: Keep,
        horizon: Option<f64>,
    ) -> Result<Option<Swept>, GapError> {
        let problem = self.problem;
        let beside = directions.map_or_else(Beside::default, |_| {
            form_error::beside(problem, &self.point)
        });
        let own: usize = self.point.values.iter().map(Vec::len).sum();
        let settled = directions.map_or(0, |_| beside.len() + own);
        let parameters = [settled, settled + directions.map_or(0, <[Direction]>::len)];
        let scales = directions.map_or_else(Vec::new, |directions| {
            scale_slope::scale_columns(problem, &self.point, beside.len(), directions)
        });
        // A point that the plant refuses has no likelihood.
        let scale = self.unmodelled.forces(problem, &self.tracks, &self.point);
        let Ok(force_scale) = scale else {
            return Ok(None);
        };
        let swept: Option<Vec<TrackSwept>> = self
            .tracks
            .par_iter()
            .zip(&self.arrival)
            .map(|(track, arrival)| {
                self.watch.check()?;
                let arrival = (arrival, &force_scale);
                let how = (keep, horizon);
                self.sweep_track(track, arrival, directions, (parameters, &scales), how)
            })
            .collect::<Result<_, GapError>>()?;
        let Some(swept) = swept else { return Ok(None) };
        let mut links = Vec::new();
        let mut by_level: Vec<Vec<Filtered>> = vec![Vec::new(); self.levels.all.len()];
        let tracks = swept.len();
        for track in swept {
            links.push(track.links);
            for (level, filtered) in by_level.iter_mut().zip(track.filtered) {
                level.extend(filtered);
            }
        }
        let whole = (self.levels.all.iter().zip(by_level)).filter(|(_, of)| of.len() == tracks);
        let mut levels = Vec::new();
        for (sizes, trials) in whole {
            let is_searched = self.levels.near.contains(sizes);
            let number = levels.len();
            levels.extend(Level::new(number, *sizes, is_searched, trials, &beside));
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
        (arrival, force_scale): (&DVector<f64>, &DVector<f64>),
        directions: Option<&[Direction]>,
        ([settled, parameters], scales): ([usize; 2], &[ScaleColumn]),
        (keep, horizon): (Keep, Option<f64>),
    ) -> Result<Option<TrackSwept>, GapError> {
        let problem = self.problem;
        let options = &problem.settings.options.likelihood;
        let [block, look] = looks(problem, track.trial);
        let drifts = self.drifts();
        let sources: Vec<usize> = scales.iter().map(|of| of.source).collect();
        let links = columns::sweep(
            problem,
            track,
            &self.point.in_trial(track.trial),
            Sweep {
                directions,
                pieces: options.pieces,
                block,
                look,
                force_scale,
                drifts: &drifts,
                keep_readings: keep == Keep::Readings,
                scaled: &sources,
                horizon,
            },
        )?;
        let Some(links) = links else { return Ok(None) };
        let own = match directions {
            Some(_) => by_trial::uncertain(problem),
            None => Vec::new(),
        };
        let is_searched = |of: &Sizes| settled == parameters || self.levels.near.contains(of);
        let few: Vec<LinkColumns> = match self.levels.all.iter().all(is_searched) {
            true => Vec::new(),
            false => {
                let without = links.par_iter().map(|of| of.without(settled, parameters));
                without.collect()
            }
        };
        let heads = |links: &[LinkColumns], parameters| -> Vec<DMatrix<f64>> {
            let noises = 0..links.first().map_or(0, |of| of.noise.len());
            let heads = noises.into_par_iter();
            heads
                .map(|noise| filter::head(links, noise, parameters))
                .collect()
        };
        let (head, head_of_few) = (heads(&links, parameters), heads(&few, settled));
        let filtered = self
            .levels
            .all
            .par_iter()
            .map(|sizes| {
                let noise = drifts.iter().position(|drift| *drift == sizes.drift)?;
                let prior = self.disturbances(track, *sizes);
                let trial = track.trial;
                let mut passed = Vec::new();
                let (links, head) = match is_searched(sizes) {
                    true => (&links, &head),
                    false => (&few, &head_of_few),
                };
                let wanted = (!scales.is_empty()).then_some(&mut passed);
                let mut filtered = filter::filter(
                    trial,
                    (links, noise),
                    head.get(noise)?,
                    arrival,
                    prior,
                    wanted,
                )?;
                if !scales.is_empty() {
                    let passed = (&passed[..], 2 * prior.drifting);
                    scale_slope::add_slopes(&mut filtered, scales, (links, noise), passed)?;
                }
                filtered.with_own(&own)
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
        let mut drifts: Vec<f64> = self.levels.all.iter().map(|of| of.drift).collect();
        drifts.sort_by(f64::total_cmp);
        drifts.dedup();
        drifts
    }

    /// Prior of the disturbances of a track.
    pub(super) fn disturbances(&self, track: &Track, sizes: Sizes) -> Disturbances {
        let options = &self.problem.settings.options.likelihood;
        let segment = segment_length(self.problem, track.trial);
        let piece = segment / options.pieces as f64;
        // One steady state has nothing to do with another.
        let steady = self.problem.trials[track.trial].steady;
        let correlation =
            |seconds: f64, time: f64| if steady { 0.0 } else { (-seconds / time).exp() };
        Disturbances {
            force: sizes.force,
            force_correlation: correlation(piece, options.force_time),
            commands: self.problem.noisy_commands().count(),
            drifting: self.problem.drifting.len(),
            drift: if steady { 0.0 } else { sizes.slow_drift },
            drift_correlation: correlation(segment, options.slow_drift_time),
        }
    }

    /// Moves starts and unmodelled forces to where all readings have them, the parameters of every trial known.
    pub(super) fn smooth(
        &mut self,
        swept: &Swept,
        z: &[DVector<f64>],
        sizes: Sizes,
    ) -> Result<(), GapError> {
        let noise = swept.noise(sizes);
        let priors: Vec<Disturbances> = (self.tracks.iter())
            .map(|track| self.disturbances(track, sizes))
            .collect();
        let links = swept.links.iter().zip(&self.arrival).zip(priors).zip(z);
        let problem = self.problem;
        let each: Vec<_> = self.tracks.iter_mut().zip(links).collect();
        (each.into_par_iter()).try_for_each(|(track, (((links, arrival), prior), z))| {
            // A steady state is known, and readings are linear in its forces: about those that explain them a sensor's scale
            // would explain them again.
            if problem.trials[track.trial].steady {
                return Ok(());
            }
            let Some(smoothed) = filter::smooth(links, noise, z, arrival, prior) else {
                return Ok(());
            };
            move_starts(problem, track, &smoothed.starts)?;
            for (link, forces) in track.links.iter_mut().zip(smoothed.forces) {
                if forces.iter().all(|value| value.is_finite()) {
                    link.forces = forces.as_slice().to_vec();
                }
            }
            Ok(())
        })
    }

    /// Lets starts and unmodelled forces follow the readings, all parameters as they are. Without effects this tells which
    /// levels are worth a look. False where a track blows up.
    pub(crate) fn follow(&mut self) -> Result<bool, GapError> {
        let chooses = self.point.candidates.is_empty() && self.levels.all.len() > 1;
        let all = self.levels.all.clone();
        if !chooses {
            self.levels.all = self.levels.nearest(Grid::of(self.problem));
        }
        let followed = self.follow_there(chooses);
        self.is_weighed = true;
        if !chooses {
            self.levels.all = all;
        }
        followed
    }

    fn follow_there(&mut self, chooses: bool) -> Result<bool, GapError> {
        let mut last: Option<f64> = None;
        let options = &self.problem.settings.options.likelihood;
        let mut likeliest: Option<(f64, Vec<Track>)> = None;
        let most = match self.is_weighed {
            true => FOLLOWING_AGAIN,
            false => FOLLOWING,
        };
        for _ in 0..most {
            // As long as they first follow, and then alike for all that is compared from here.
            if !self.is_weighed {
                self.weigh()?;
            }
            let Some(swept) = self.sweep(None, Keep::Columns, None)? else {
                return Ok(false);
            };
            let logs: Vec<(Sizes, f64)> = (swept.levels.iter())
                .filter_map(|level| Some((level.sizes, level.given(&[])?.empty)))
                .collect();
            let Some(best) = logs.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else {
                return Ok(false);
            };
            if let Some((log, tracks)) = &likeliest
                && best.1 < log - options.too_far
            {
                self.tracks.clone_from(tracks);
                break;
            }
            // Weights change as long as they are not settled: only then is another one's likelihood of another quantity.
            if self.is_weighed {
                likeliest = Some((best.1, self.tracks.clone()));
            }
            let none = vec![DVector::zeros(0); self.tracks.len()];
            self.smooth(&swept, &none, best.0)?;
            if chooses && let Some(levels) = Levels::up_to(Grid::of(self.problem), &logs) {
                self.levels = levels;
            }
            let enough = SETTLED.max(FOLLOWED * best.1.abs());
            if last.is_some_and(|last| (best.1 - last).abs() < enough) {
                break;
            }
            last = Some(best.1);
        }
        Ok(true)
    }

    /// The largest log likelihood once starts and unmodelled forces follow the readings, all parameters as they are. `None` where
    /// a track blows up.
    pub(super) fn followed_likelihood(&mut self) -> Result<Option<f64>, GapError> {
        if !self.follow()? {
            return Ok(None);
        }
        let swept = self.sweep(None, Keep::Likelihood, None)?;
        let logs = swept.iter().flat_map(|swept| &swept.levels);
        let logs = logs.filter_map(|level| Some(level.given(&[])?.empty));
        Ok(logs.reduce(f64::max))
    }

    /// Searches sets from now on where these are likely.
    pub(crate) fn search_about(&mut self, best: Sizes, logs: &[(Sizes, f64)]) {
        self.levels.search_about(Grid::of(self.problem), best, logs);
    }

    /// Looks at the least unmodelled forces alone.
    pub(crate) fn keep_least(&mut self) {
        self.levels.keep_least(Grid::of(self.problem));
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

/// Lengths of a block of a trial, and between states at which changes are taken [s].
fn looks(problem: &Problem<'_>, trial: usize) -> [f64; 2] {
    let options = &problem.settings.options.likelihood;
    let period = problem.trials[trial].period();
    let block = period.clamp(options.block[0], options.block[1]);
    let block = block.max(problem.model.timestep);
    [block, options.look.max(block)]
}

/// Length of a trial's segments [s].
fn segment_length(problem: &Problem<'_>, trial: usize) -> f64 {
    let options = &problem.settings.options.likelihood;
    let rows = options.segment_rows * problem.trials[trial].period();
    options.segment_length.max(rows)
}

/// Standard deviation of the first start of every track; none of what is prescribed.
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
            let nv = problem.model.nv;
            let sd = state_estimation::arrival_precision(nv, sd)
                .map(|precision| precision.sqrt().recip());
            DVector::from_fn(2 * nv, |axis, _| match trial.imposes(axis % nv) {
                true => 0.0,
                false => sd[axis],
            })
        })
        .collect()
}
