//! What every stage starts from: the fit trials, their motions, the channels and the candidates.

use std::sync::atomic::AtomicUsize;

use rayon::prelude::*;

use super::{
    bench::{Bench, Material},
    candidates::{self, Candidate, Typical},
    error::GapError,
    measured::{Channels, Measured},
    noise,
    shooting::{self, Correction, Segment, Track},
    start,
    system::System,
    uncertainty::Uncertainty,
    watch::Watch,
};
use crate::{
    plant::{Plant, PlantDescription},
    trial::Trial,
};

/// Length of a segment [s]: what a small force does to a motion grows with the square of it, what the shape of a
/// law is wrong by and what a start is uncertain by do not.
pub(super) const SEGMENT: f64 = 6.0;
/// Length of the segments on which a nominal that is far off is brought near first [s].
const FIRST_SEGMENT: f64 = 2.0;
/// Of those, so many are enough to see the nominal's numbers.
const FIRST_SEGMENTS: usize = 12;
/// Rows of a segment at least.
pub(super) const LEAST_ROWS: usize = 10;
/// Segments at most; of more, evenly spread ones are used, so that time and memory stay bounded ...
const MOST_SEGMENTS: usize = 36;
/// ... and fewer where a model has many degrees of freedom, each of which costs time and columns: so many
/// seconds of segments of the usual length, times degrees of freedom; 36 segments for a free body.
const SECONDS_BY_FREEDOMS: f64 = 1300.0;

/// Multiples of it, less their whole parts, are spread evenly and repeat nothing.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// How the workflow is run.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How well the nominal is known.
    pub uncertainty: Uncertainty,
    /// Seed of every draw.
    pub seed: u64,
}

/// Trials made ready.
pub struct Study<'a> {
    pub(super) plant: &'a dyn Plant,
    pub(super) trials: Vec<Measured>,
    pub(super) tracks: Vec<Track>,
    pub(super) channels: Channels,
    pub(super) candidates: Vec<Candidate>,
    pub(super) settings: Settings,
    /// Largest command of every actuator in the trials.
    pub(super) commands: Vec<f64>,
    pub(super) remarks: Vec<String>,
}

impl std::fmt::Debug for Study<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Study")
            .field("trials", &self.trials.len())
            .finish_non_exhaustive()
    }
}

impl<'a> Study<'a> {
    /// Estimates noise where none is declared, and the motion of every trial.
    ///
    /// # Errors
    /// Nothing to compare, a nominal that blows up, or a stop that was asked for.
    pub fn prepare(
        plant: &'a dyn Plant,
        trials: Vec<Trial>,
        settings: Settings,
        watch: &Watch<'_>,
    ) -> Result<Self, GapError> {
        let model = plant.description();
        let trials: Vec<Measured> = trials
            .into_iter()
            .map(|trial| Measured::new(trial, model))
            .collect();
        let mut channels = Channels::of(model, &trials);
        if channels.len() == 0 {
            return Err(GapError::NothingMeasured {
                trials: trials.iter().map(|trial| trial.name.clone()).collect(),
                sensors: model.sensors.iter().map(|s| s.name.clone()).collect(),
            });
        }
        let mut remarks = Vec::new();
        let estimated = noise::estimate(&mut channels, &trials);
        if !estimated.is_empty() {
            remarks.push(format!(
                "the MJCF gives no noise for {}; it was estimated from the readings' third differences",
                estimated.join(", ")
            ));
        }
        let done = AtomicUsize::new(0);
        let none = vec![Correction::NONE; model.sensors.len()];
        let tracks = trials
            .par_iter()
            .map(|trial| {
                watch.check()?;
                let track = start::track(&System::plain(plant), trial, &channels, &none);
                watch.count("following the trials", &done, trials.len());
                track
            })
            // Of several faults that of the first trial is told, whichever thread was faster.
            .collect::<Vec<Result<Track, GapError>>>()
            .into_iter()
            .collect::<Result<Vec<Track>, GapError>>()?;
        let typical = typical(model, &trials, &tracks);
        if !model.actuators.is_empty() && !trials.iter().any(is_excited) {
            remarks.push(
                "the controls are constant in every trial: the data excite nothing but free motion"
                    .to_owned(),
            );
        }
        let candidates = candidates::enumerate(model, &channels, &trials, &typical);
        Ok(Self {
            plant,
            trials,
            tracks,
            channels,
            candidates,
            commands: typical.command,
            settings,
            remarks,
        })
    }

    /// Cuts the trials into segments and finds their sensitivities.
    pub fn bench(&self, watch: &Watch<'_>) -> Result<Bench<'_>, GapError> {
        let nuisances = self
            .plant
            .description()
            .nuisances
            .iter()
            .enumerate()
            .map(|(at, nuisance)| (at, self.settings.uncertainty.of(nuisance)))
            .filter(|(_, sd)| *sd > 0.0)
            .collect();
        let material = Material {
            plant: self.plant,
            trials: &self.trials,
            tracks: &self.tracks,
            channels: &self.channels,
            candidates: &self.candidates,
            nuisances,
        };
        let first = self.segments(FIRST_SEGMENT, FIRST_SEGMENTS);
        let seconds = SECONDS_BY_FREEDOMS / self.plant.description().nv.max(1) as f64;
        let most = MOST_SEGMENTS.min((seconds / SEGMENT).ceil() as usize);
        Bench::new(material, first, self.segments(SEGMENT, most), watch)
    }

    /// Every trial cut into segments of about `length` seconds; of more than `most`, evenly spread ones.
    fn segments(&self, length: f64, most: usize) -> Vec<Segment> {
        let all: Vec<Segment> = self
            .trials
            .iter()
            .zip(&self.tracks)
            .enumerate()
            .flat_map(|(at, (trial, track))| shooting::cut(at, trial, track, length, LEAST_ROWS))
            .collect();
        let count = all.len();
        if count <= most {
            return all;
        }
        // Not in step with the trials: always the same part of each would see the same motion.
        let place = |at: usize| (at as f64 + (at as f64 * GOLDEN).fract()) / most as f64;
        (0..most)
            .map(|at| all[((place(at) * count as f64) as usize).min(count - 1)].clone())
            .collect()
    }
}

/// True where a command changes.
fn is_excited(trial: &Measured) -> bool {
    let width = trial.control.width().max(1);
    let mut rows = trial.control.data.chunks_exact(width);
    let first = rows.next().unwrap_or(&[]);
    rows.any(|row| row.iter().zip(first).any(|(a, b)| a.is_finite() && a != b))
}

/// Root mean square speeds, excursions and commands.
fn typical(model: &PlantDescription, trials: &[Measured], tracks: &[Track]) -> Typical {
    let mut speed = vec![0.0; model.nv];
    let mut lowest = vec![f64::INFINITY; model.nq];
    let mut highest = vec![f64::NEG_INFINITY; model.nq];
    let mut rows = 0_usize;
    let mut clearance = f64::INFINITY;
    for track in tracks {
        for row in 0..track.times.len() {
            let (qpos, qvel) = track.motion(row);
            for (sum, value) in speed.iter_mut().zip(qvel) {
                *sum += value * value;
            }
            for ((low, high), value) in lowest.iter_mut().zip(&mut highest).zip(qpos) {
                *low = value.min(*low);
                *high = value.max(*high);
            }
            if let Some(base) = &model.base {
                let at: [f64; 3] = std::array::from_fn(|axis| qpos[base.qpos + axis]);
                let walls = model.walls.iter().map(|wall| wall.distance(at));
                clearance = walls.fold(clearance, f64::min);
            }
            rows += 1;
        }
    }
    let mut command = vec![0.0_f64; model.actuators.len()];
    for trial in trials {
        let width = trial.control.width();
        for row in trial.control.data.chunks_exact(width.max(1)) {
            for ((largest, value), actuator) in command.iter_mut().zip(row).zip(&model.actuators) {
                if value.is_finite() {
                    *largest = largest.max(actuator.limited(*value).abs());
                }
            }
        }
    }
    Typical {
        speed: speed
            .iter()
            .map(|sum| (sum / rows.max(1) as f64).sqrt())
            .collect(),
        travel: lowest
            .iter()
            .zip(&highest)
            .map(|(low, high)| 0.5 * (high - low).max(0.0))
            .collect(),
        highest,
        clearance,
        command,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::RigidBody;
    use crate::tests::{on_bench, trial};

    #[test]
    fn the_largest_command_is_one_that_an_actuator_obeys() {
        let trials = vec![trial("pushed", &[], &[0.0, 0.0], 0, 1.0)];
        on_bench(&RigidBody::new(), trials, |bench, _| {
            let mut model = bench.model.clone();
            let largest =
                |model: &PlantDescription| typical(model, bench.trials, bench.tracks).command;
            assert!(largest(&model)[1] > 0.5);
            model.actuators[1].range = Some([-0.2, 0.1]);
            assert_eq!(largest(&model)[1], 0.2);
        });
    }
}
