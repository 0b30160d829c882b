//! Every statistical choice of the workflow, with its unit, meaning and source.
//!
//! Outside stand what a file format says (95 % of `ci95`, the defaults of `nominal.toml` in `problem/uncertainty.rs`), the
//! menu of experiments (`stage/experiment_design.rs`), and numbers of numerical methods: steps of difference quotients,
//! iterations, rounding.
//!
//! Lengths of time are for logs of 20 Hz and more; [`Options::for_rows`] is the one place where they follow slower rows.
//!
//! The values are passed with [`Settings`](crate::Settings); nothing reads them from anywhere else. Where no source is
//! named, a value was chosen on hidden cases made for that purpose.

/// Declares a documented struct whose `Default` holds the values beside the fields.
macro_rules! options {
    ($(#[$outer:meta])* $name:ident { $($(#[$inner:meta])* $field:ident: $kind:ty = $value:expr,)* }) => {
        $(#[$outer])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name { $($(#[$inner])* pub $field: $kind,)* }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $value,)* }
            }
        }
    };
}

/// The choices by part of the workflow.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Options {
    pub segments: SegmentOptions,
    pub outliers: OutlierOptions,
    pub candidates: CandidateOptions,
    pub rollout: RolloutOptions,
    pub states: StateOptions,
    pub locate: LocateOptions,
    pub name: NameOptions,
    pub add: AddOptions,
    pub verify: VerifyOptions,
    pub residual: ResidualOptions,
    pub likelihood: LikelihoodOptions,
}

/// Time between rows up to which all lengths of time are those below [s]: they were chosen on logs of 20 to 100 Hz.
const FINE_ROWS: f64 = 0.05;

impl Options {
    /// The choices for logs with a row every `period` seconds. Where rows are further apart than 0.05 s, every length of time
    /// grows in proportion, so that a segment, a piece of unmodelled force or a horizon holds as many rows as at 20 Hz: a
    /// second becomes 20 s at 1 Hz. Such logs are of slow systems (a glider's time constants are tens of seconds); what is
    /// faster than its rows cannot be seen in them. `None`, steady states alone: nothing grows.
    pub fn for_rows(&self, period: Option<f64>) -> Self {
        let mut options = self.clone();
        // Times are rounded: 0.05 s is no more than 0.05 s.
        let longer = match period {
            Some(period) if period.is_finite() && period > FINE_ROWS * (1.0 + 1e-6) => {
                period / FINE_ROWS
            }
            _ => return options,
        };
        for time in [
            &mut options.segments.length,
            &mut options.segments.most_freedom_seconds,
            &mut options.rollout.effect_warm_up,
            &mut options.rollout.nominal_warm_up,
            &mut options.states.window,
            &mut options.candidates.command_seconds,
            &mut options.locate.command_rate_time,
            &mut options.residual.window,
            &mut options.residual.sample_period,
            &mut options.likelihood.segment_length,
            &mut options.likelihood.look,
            &mut options.likelihood.force_time,
            &mut options.likelihood.slow_drift_time,
        ] {
            *time *= longer;
        }
        let [_, coarsest] = &mut options.likelihood.block;
        *coarsest *= longer;
        for horizon in &mut options.verify.horizons {
            *horizon *= longer;
        }
        options
    }
}

options! {
    /// Segments over which the nominal predicts from one start.
    SegmentOptions {
        /// Length of a segment [s]. The motion that a small force causes grows with its square; the uncertainty of a start does
        /// not.
        length: f64 = 6.0,
        /// Rows of a segment at least.
        least_rows: usize = 10,
        /// Rest of a trial that joins the segment before it, as a part of a segment's length.
        joined_rest: f64 = 0.5,
        /// Length of all trials together times the degrees of freedom at most [s]: each degree of freedom costs time and
        /// memory. Of longer ones the beginnings are used, of each trial as much.
        most_freedom_seconds: f64 = 1300.0,
    }
}

options! {
    /// Single misread rows of a sensor that declares no noise.
    OutlierOptions {
        /// Rows on either side of a reading that it is compared with; twice as many on one side of the first and the last.
        beside: usize = 4,
        /// Deviation of these from a parabola up to which the reading is judged [noises].
        smooth: f64 = 2.0,
        /// Deviation of the reading from the parabola from which it is left out [standard deviations].
        deviation: f64 = 4.0,
    }
}

options! {
    /// Candidate effects, their priors, and the priors that `nominal.toml` does not name.
    CandidateOptions {
        /// Moving bodies up to which effects are tried on every body; of larger models on their bases alone, and a payload on
        /// the ends of up to as many chains too.
        all_bodies: usize = 6,
        /// A body is the base of its tree instead of the first one where its volume is this many times as large.
        base_volume_ratio: f64 = 2.0,
        /// Distance from the surface or a wall, in greatest extents of a body, beyond which it does not feel them
        /// (J. N. Newman, Marine Hydrodynamics, MIT Press 1977, sections 6.17 and 6.20).
        reach: f64 = 2.0,
        /// Periods of an oscillation that the longest trial holds at least; one of fewer is a slow force.
        periods: f64 = 1.5,
        /// Prior probability of the form of an effect that has its optional parameters.
        elaborate_form: f64 = 0.2,
        /// Prior odds of an effect that refines another, a memory of drag say, against that one.
        refinement: f64 = 0.1,
        /// Least speed [m/s] and rate [rad/s] that scale a prior.
        least_speed: f64 = 0.05,
        /// Least speed of a joint that scales a prior [rad/s or m/s].
        least_joint_speed: f64 = 1e-3,
        /// Least travel of a joint that scales a prior [rad or m].
        least_joint_travel: f64 = 1e-3,
        /// Travel, in greatest extents of the largest body, below which effects of depth and distance are not tried.
        least_travel: f64 = 0.1,
        /// Standard deviation of when within a step a force is read [steps]: the real system has no steps.
        reading_lead_sd: f64 = 0.5,
        /// Standard deviation of when within a step a command acts [steps]: the time convention of trials leaves little.
        command_lead_sd: f64 = 0.1,
        /// Standard deviation of the part of a trial's first commands that memories are led through before its log, about all of them.
        commands_before_sd: f64 = 1.0,
        /// Least noise of a sensor that declares none, relative to its largest reading: a constant channel shows none.
        least_noise: f64 = 1e-6,
        /// Least noise of a logged command that is looked at, relative to its standard deviation.
        least_command_noise: f64 = 1e-3,
        /// Length on which commands are compared with smooth ones, all trials together [s].
        command_seconds: f64 = 30.0,
        /// Least noise of mean readings in a table of steady states that declares none, in the standard deviation of its
        /// readings: rows are no series, so nothing else tells it but the scatter about a hypothesis.
        least_table_noise: f64 = 1e-3,
    }
}

options! {
    /// Rollouts and the weights of their output errors.
    RolloutOptions {
        /// Length of measured motion that warms up the memory of effects [s].
        effect_warm_up: f64 = 1.0,
        /// Length of measured motion that warms up the memory of the nominal [s].
        nominal_warm_up: f64 = 0.25,
        /// Error of a reading that rows cannot resolve, as a part of the second difference that the model predicts.
        unresolved: f64 = 0.25,
    }
}

options! {
    /// Estimation of states along a trial.
    StateOptions {
        /// Length of a window [s]: short, so that a missing effect does not bend the estimate.
        window: f64 = 0.4,
        /// Misfit of a window from which half of it is looked at instead [noises, root mean square].
        far_off: f64 = 300.0,
        /// Rows of a window at least.
        least_rows: usize = 8,
        /// Prior standard deviation of the start of a window or segment: positions [m, rad], velocities [m/s, rad/s].
        arrival_sd: [f64; 2] = [0.1, 0.5],
        /// Prior standard deviation of the first start where the log gives no initial state, likewise.
        first_arrival_sd: [f64; 2] = [1.0, 2.0],
        /// Gauss-Newton steps at most a window.
        steps: usize = 8,
        /// Relative change of the misfit below which a window is settled.
        settled: f64 = 1e-4,
        /// Headings in which the start of a free body is tried where no sensor reads its attitude.
        first_headings: usize = 8,
    }
}

options! {
    /// Windows and conditions in which the nominal fails.
    LocateOptions {
        /// Level of significance.
        level: f64 = 0.05,
        /// Windows of a segment.
        windows: usize = 4,
        /// Depth of the regression tree.
        tree_depth: usize = 2,
        /// Part of the samples in a leaf at least.
        tree_leaf: f64 = 0.05,
        /// Samples in a leaf at least.
        tree_leaf_samples: f64 = 5.0,
        /// Thresholds that are tried a feature: quantiles.
        tree_quantiles: usize = 19,
        /// Time over which the rate of a command is taken, ahead of a sample [s].
        command_rate_time: f64 = 0.05,
        /// Share of the excess over share of the samples above which a leaf is reported.
        tree_lift: f64 = 1.2,
    }
}

options! {
    /// Which effects are named.
    NameOptions {
        /// Level of the test for any gap: the part of trials without one in which one is claimed.
        alarm: f64 = 0.03,
        /// Probability of no gap above which none is claimed, whatever the test says.
        agreement: f64 = 0.2,
        /// Simulated sets of trials without a gap; the least probability is 1 / (this + 1).
        null_draws: usize = 99,
        /// Sets whose confusions are simulated, at most.
        leaders: usize = 3,
        /// Simulated sets of trials in which one of them is true.
        leader_draws: usize = 20,
        /// Probability, given that there is a gap, from which an effect is named, or unmodelled forces alone are the answer.
        named: f64 = 0.9,
        /// Part of the excess that a set explains at least, or the gap is unknown.
        explained: f64 = 0.5,
        /// Part of the way from nothing to a parameter's bound, beside the bound, in which a value is at the edge of what is
        /// plausible: its set is not named.
        edge: f64 = 0.04,
        /// Part of the excess that a set with plausible values explains at least where a likelier one has such a value, or the gap
        /// is unknown.
        plausible: f64 = 0.9,
        /// Shift of a number of the nominal from which the reader is warned [prior standard deviations].
        far: f64 = 3.0,
        /// Probability above which an effect that is not named is one of those that it could be.
        error: f64 = 0.05,
        /// Probability up to which an effect is not listed.
        negligible: f64 = 1e-3,
        /// Squared whitened distance from which an experiment tells two explanations apart.
        distinguishable: f64 = 9.0,
    }
}

options! {
    /// Effects and numbers written into the model.
    AddOptions {
        /// Shift of a number of the nominal from which it is written [prior standard deviations].
        least_shift: f64 = 0.01,
        /// Draws of the bootstrap over trials.
        bootstrap_draws: usize = 400,
    }
}

options! {
    /// Verification on held-out trials.
    VerifyOptions {
        /// Lengths of the rollouts [s], ascending.
        horizons: [f64; 3] = [0.5, 1.0, 2.0],
        /// Whitened error of a reading after a rollout that blew up, relative to the nominal's or 1, whichever is larger.
        diverged_error: f64 = 1e3,
        /// Draws of the bootstrap over trials.
        bootstrap_draws: usize = 1000,
        /// Relative growth of an error that counts as harm, at 95 % confidence for all sensors together.
        harm: f64 = 0.02,
        /// Least mean gain in log predictive density of a trial left out, against refitted numbers of the nominal alone
        /// [nat]: odds of one to twenty. Where both predict about alike, the posterior has decided, which knows the priors
        /// of these numbers.
        least_gain: f64 = -3.0,
        /// Error of rollouts with the effects over that with the numbers refitted alone, at which these decide, or its inverse.
        clear_error: f64 = 0.5,
        /// Trials up to which every trial is judged by a fit that left it out (cross-fit).
        cross_fit_trials: usize = 10,
    }
}

options! {
    /// The missing wrench on the base.
    ResidualOptions {
        /// Length of a window [s]: short beside the motion of a vehicle, long enough for a sensor to see its push.
        window: f64 = 0.2,
        /// Rows of a window at least.
        least_rows: usize = 3,
        /// Windows of all trials together at most.
        most_windows: usize = 480,
        /// Windows of a trial at least.
        least_windows: usize = 10,
        /// Time between samples [s], rounded to steps.
        sample_period: f64 = 0.02,
        /// Prior standard deviation of the wrench at the start of a trial [weights; torques: weights times half the greatest
        /// extent].
        first_wrench: f64 = 1.0,
        /// Standard deviations of the change from window to window that are tried, in the same units.
        wrench_changes: [f64; 6] = [3e-5, 2e-4, 1e-3, 5e-3, 2e-2, 1e-1],
        /// Standard deviation of the base's jump between windows: positions [m, rad], velocities [m/s, rad/s]. Covers the
        /// change of a wrench within a window.
        base_gap_sd: [f64; 2] = [2e-4, 2e-3],
        /// Standard deviation of the joints' jump, likewise: wide, so that no wrench on the base stands for what the model lacks at joints.
        joint_gap_sd: [f64; 2] = [1e-2, 2e-1],
    }
}

options! {
    /// The marginal likelihood of whole trials, and the search on it.
    LikelihoodOptions {
        /// Length of a segment [s]: so short that a rollout from a start near the readings is nearly linear in all that is
        /// missing.
        segment_length: f64 = 0.1,
        /// Length of a segment in rows, at least.
        segment_rows: f64 = 5.0,
        /// Pieces of a segment over which unmodelled forces are constant.
        pieces: usize = 2,
        /// Length of a block of steps over which transition matrices are held and inputs are linear [s]: that of a row, within
        /// these.
        block: [f64; 2] = [0.005, 0.02],
        /// Time between states at which changes are taken, linear between [s]; those with the commands are taken at every block.
        look: f64 = 0.05,
        /// Standard deviations of the unmodelled forces that are tried, in what moves a degree of freedom.
        forces: [f64; 11] = [1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0],
        /// Factor between the sizes of disturbances that are tried about the likeliest.
        level_ratio: f64 = 1.5,
        /// Unmodelled forces up to which simulation and measurement agree, in what moves a degree of freedom: an integrator
        /// errs by as much.
        negligible_force: f64 = 1e-3,
        /// Slow error of a sensor up to which it may be the sensor's own, in what its readings move.
        sensors_own: f64 = 0.05,
        /// Prior probability of larger unmodelled forces: that something is missing which is not in the catalogue. The same of
        /// larger errors of sensors.
        outside: f64 = 0.1,
        /// Standard deviations of the slow error of a sensor that declares no noise that are tried, in what its readings move.
        drifts: [f64; 6] = [0.0, 1e-3, 4e-3, 1.6e-2, 6e-2, 0.25],
        /// Time constant of such errors [rows].
        drift_rows: f64 = 2.5,
        /// Standard deviations of an error of such a sensor that drifts slowly that are tried, likewise.
        slow_drifts: [f64; 4] = [0.0, 3e-3, 1e-2, 3e-2],
        /// Time constant of slow drifts [s].
        slow_drift_time: f64 = 1.0,
        /// Least acceleration that scales an unmodelled force [m/s^2, rad/s^2].
        least_acceleration: f64 = 1e-3,
        /// Speed of a joint below which it counts as turning round [root mean square of its speed].
        reversal_speed: f64 = 0.1,
        /// Factor on the unmodelled force along a joint that turns round.
        reversal_force: f64 = 50.0,
        /// Factor on the weight of that joint's readings meanwhile.
        reversal_weight: f64 = 0.02,
        /// Time constant of unmodelled forces [s].
        force_time: f64 = 0.22,
        /// Largest shift of an uncertain number of the nominal [prior standard deviations]: a gap of hundreds of noises must
        /// not be explained by a mass fifty times the nominal's.
        largest_shift: f64 = 5.0,
        /// Relative error of the form of an effect of the catalogue, and of the terms that it neglects.
        form_error: f64 = 0.15,
        /// Prior odds of a set with effects of a medium of which the model tells nothing, and the part of what it explains that
        /// these must bring together.
        untold_medium: f64 = 0.1,
        /// Factors on the errors of an effect's form that are tried.
        form_sizes: [f64; 3] = [1.0, 0.3, 0.1],
        /// Levels of an effect's size at which its form may be off, each by itself.
        form_levels: usize = 3,
        /// Range of these levels below the largest size, on a logarithmic scale.
        form_range: f64 = 64.0,
        /// Factors on the usual value of a rate or length that are tried.
        shape_factors: [f64; 3] = [1.0 / 3.0, 1.0, 3.0],
        /// Factors on the usual value of a frequency that are tried.
        frequency_factors: [f64; 4] = [0.4, 0.8, 1.6, 3.0],
        /// Places of a payload along each axis, and of the rest of a spring, that are tried beside the usual [prior standard
        /// deviations].
        places: [f64; 2] = [-1.5, 1.5],
        /// Factors on the standard deviations of an effect's priors that are tried; alike likely.
        prior_scales: [f64; 5] = [1.0, 0.3, 0.1, 0.03, 0.01],
        /// Prior probability that an effect which may differ from trial to trial does.
        differs: f64 = 0.2,
        /// Standard deviations of a trial's own value about the common one that are tried, in that of the common one's prior; alike
        /// likely.
        own_sizes: [f64; 2] = [1.0, 0.1],
        /// Prior probability of one missing effect more.
        another_effect: f64 = 0.5,
        /// Prior odds of an effect without those that it presupposes, in a model without fluid.
        unaccompanied: f64 = 0.01,
        /// Effects that are added before the readings are linearised again, at most; one more each time that so few cannot follow the
        /// readings.
        added: usize = 1,
        /// Points that are looked from after the first, at most.
        rounds: usize = 12,
        /// Log posterior that a set may lack against the best, as far as first order from elsewhere tells, and still be looked
        /// from [nat].
        rival_within: f64 = 5.0,
        /// Log posterior that a set may lack about itself against first order from the best's point, before its values are fitted
        /// from there once more [nat].
        lagging: f64 = 1.0,
        /// Behind the best set of a look, how far the sets stand whose effects further looks are along [nat]; the last one is along
        /// all.
        worth_within: f64 = 50.0,
        /// Log posterior that a rival may still gain while it settles [gains of its last sweep]: one that stays far behind even so
        /// is not settled to the end.
        hoped: f64 = 10.0,
        /// Effects that two sets share at least, and more than half of all theirs, where what one lost about itself the other loses.
        shared: usize = 3,
        /// Sweeps that let the values of a set settle, at most: along precise readings of a motion that no set explains the
        /// likelihood may fall by a few nats a sweep for as long.
        settling: usize = 20,
        /// Loss of log likelihood with which a step of the fit has gone too far [nat]: from one linearisation to the next that of a
        /// good step may fall by some ten.
        too_far: f64 = 30.0,
        /// Part of such a step that is gone instead.
        shorter: f64 = 0.25,
        /// Log posterior that a set may lack against the best, once its values have settled, and sets are still searched from
        /// there [nat].
        far_behind: f64 = 10.0,
        /// Square of how far a standard deviation of an effect's parameter moves all readings together, in theirs, below which the trials
        /// say nothing of it.
        silent: f64 = 1e-4,
        /// Part of what commands before a log change at its start below which nothing is left of them.
        forgotten: f64 = 1e-6,
        /// Log likelihood that the best values of all parameters may lack at a level of unmodelled forces for sets to be
        /// searched there [nat].
        level_within: f64 = 15.0,
        /// Effects of a set at most.
        largest: usize = 8,
        /// Sets that are enlarged by one effect.
        beam: usize = 3,
        /// Information that the trials hold of an effect's parameters at their usual size, at least [nat]: an effect of which they
        /// tell less leaves no trace.
        least_information: f64 = 0.5,
        /// Effects whose addition to a set is evaluated to first order: those of the greatest likelihoods.
        screened: usize = 24,
        /// Enlarged sets that are evaluated in full, of each.
        evaluated: usize = 6,
        /// Log posterior that an enlarged set may lack against the best and still be enlarged [nat].
        enlarged_within: f64 = 3.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Logs of 20 Hz and more, their times rounded or not, have the times as written; at 1 Hz a second holds twenty.
    #[test]
    fn lengths_of_time_follow_slow_rows_alone() {
        let options = Options::default();
        for period in [
            None,
            Some(0.01),
            Some(0.05),
            Some(0.050_000_01),
            Some(f64::INFINITY),
        ] {
            assert_eq!(options.for_rows(period), options, "{period:?}");
        }
        let slow = options.for_rows(Some(1.0));
        assert_eq!(slow.verify.horizons, [10.0, 20.0, 40.0]);
        assert!((slow.segments.length - 120.0).abs() < 1e-9);
        assert!((slow.likelihood.force_time - 4.4).abs() < 1e-9);
        assert_eq!(slow.likelihood.block[0], options.likelihood.block[0]);
        assert_eq!(slow.name, options.name);
    }
}
