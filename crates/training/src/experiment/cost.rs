//! Time of a trajectory in each engine, engines in turn, on one thread.

use std::time::Instant;

use hydro_model::{Engine, ModelError, Scratch, one_by_one};
use serde::{Deserialize, Serialize};

use crate::dataset::Split;

/// Samples of the trajectory that is timed, as in the paper's table.
const STEPS: usize = 400;
/// Trajectories at a time, beside one.
const MANY: usize = 64;
/// Rounds. Every engine is timed once a round, so that a slow moment of the machine affects all.
pub const ROUNDS: usize = 5;

/// Milliseconds for 400 samples: median over rounds, and the quartiles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Timed {
    /// Median.
    pub median: f64,
    /// First and third quartile.
    pub quartiles: [f64; 2],
}

/// Times of one model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// [`super::Entry::id`].
    pub entry: String,
    /// The processor.
    pub machine: String,
    /// One trajectory, a sample at a time as in a simulation.
    pub stepped: Timed,
    /// One recorded trajectory, in the engine's own way: a Relaxation-ODE and what has no memory take many samples as one product.
    pub one: Timed,
    /// 64 of them.
    pub many: Timed,
}

/// Times engines, on a processor of that name, on a trajectory made of the split's first samples, over and over; `tick` is told after each round.
///
/// # Errors
/// An engine of other features.
pub fn time_engines(
    engines: &[(String, Box<dyn Engine>)],
    split: &Split,
    machine: &str,
    tick: &dyn Fn(usize),
) -> Result<Vec<Cost>, ModelError> {
    let mut times = vec![[Vec::new(), Vec::new(), Vec::new()]; engines.len()];
    let mut scratch = Scratch::default();
    let (one, many) = (input(split, 1), input(split, MANY));
    let stepped: Run = |engine, x, start, scratch| one_by_one(engine, x, start, scratch);
    let whole: Run = |engine, x, start, scratch| engine.trajectories(x, start, scratch);
    for round in 0..=ROUNDS {
        for ((_, engine), times) in engines.iter().zip(&mut times) {
            let runs = [(stepped, &one), (whole, &one), (whole, &many)];
            for ((run, (x, start)), times) in runs.into_iter().zip(times) {
                let began = Instant::now();
                std::hint::black_box(run(&**engine, x, start, &mut scratch)?);
                // The first round warms up.
                if round > 0 {
                    times.push(1e3 * began.elapsed().as_secs_f64());
                }
            }
        }
        tick(round);
    }
    Ok(engines
        .iter()
        .zip(times)
        .map(|((entry, _), [stepped, one, many])| Cost {
            entry: entry.clone(),
            machine: machine.to_owned(),
            stepped: timed(stepped),
            one: timed(one),
            many: timed(many),
        })
        .collect())
}

/// Runs an engine through x [B, 400, n] from F_0 [B, f].
type Run = fn(&dyn Engine, &[f64], &[f64], &mut Scratch) -> Result<Vec<f64>, ModelError>;

/// x [B, 400, n] and F_0 [B, f].
fn input(split: &Split, batch: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut x, mut start) = (Vec::new(), Vec::new());
    for index in (0..split.len()).cycle().take(batch) {
        let whole = split.x(index).iter().map(|value| f64::from(*value));
        x.extend(whole.cycle().take(STEPS * split.inputs()));
        let first = &split.clean(index)[..split.outputs()];
        start.extend(first.iter().map(|value| f64::from(*value)));
    }
    (x, start)
}

fn timed(mut times: Vec<f64>) -> Timed {
    times.sort_by(f64::total_cmp);
    let at = |share: usize| times[(times.len() - 1) * share / 4];
    Timed {
        median: at(2),
        quartiles: [at(1), at(3)],
    }
}
