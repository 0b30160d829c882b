//! A learned wrench beside its baselines: in open loop on recorded inputs, and in closed loop, where
//! the wrench changes the motion that it sees.

mod closed_loop;
mod drive;
mod long_run;
mod method;
mod open_loop;
#[cfg(test)]
#[path = "tests/point_mass.rs"]
mod point_mass;
mod spread;
mod step_time;
mod summary;

pub use self::{
    closed_loop::{ClosedLoop, ClosedLoopRow, closed_loop},
    drive::drive,
    long_run::{BOUND, LongRun, LongRunPeaks, Peak, Ratios, long_run_peaks, within},
    method::{
        MakeSimulator, MakeTruth, Method, ORACLE, ORACLE_OF_ALL, ORACLE_OF_THE_BASE, Water,
        WrenchAtState, WrenchFunction,
    },
    open_loop::{Example, OpenLoop, OpenLoopRow, Predict, open_loop, precomputed},
    spread::Spread,
    step_time::{StepTime, step_times},
    summary::{Standing, Summary},
};
