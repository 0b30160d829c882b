//! First-order changes along a track, in one pass.
//!
//! At the boundaries between blocks of a few steps, one step from the state there tells how the next state and the readings
//! change with the state, with generalised forces, and with every parameter. Between boundaries the changes are carried by
//! the transition matrix of a step, held over the block. So a parameter costs one step a block, not a rollout.

use hydro_effects::Entry;
use nalgebra::{DMatrix, DMatrixView, DVector};
use rayon::prelude::*;

use crate::{
    error::GapError,
    likelihood::{
        changes::{Change, Kind, changes},
        coloured_noise,
        command_forces::command_forces,
        directions::Direction,
        every_step,
        form_error::{self, Base, Beside},
        layout::Layout,
        memories, slow_drift,
        step_changes::{Inputs, StateChanges, inputs, references, state_changes},
        symmetric,
        track::{self, Grid, Rolled, Track},
    },
    plant::{Quantity, SensorKind, Simulation},
    problem::{point::Point, problem::Problem},
    rollout::{
        sensor_correction::{self, Correction},
        shooting::{Trace, WarmUp},
        whitening,
    },
};

/// Changes of one segment.
#[derive(Clone, Debug)]
pub(crate) struct LinkColumns {
    /// Whitened readings by size of their correlated noise.
    pub(crate) noise: Vec<Whitened>,
    /// Tangent at the segment's end from the next one's start [2 nv, columns].
    pub(crate) end: DMatrix<f64>,
    /// True where the prediction starts anew, from the readings alone.
    pub(crate) anew: bool,
}

impl LinkColumns {
    /// Without the parameters `from..to`, and without readings.
    pub(crate) fn without(&self, from: usize, to: usize) -> Self {
        let kept = self.but(from, to);
        Self {
            noise: self.noise.iter().map(|of| of.select(&kept)).collect(),
            end: self.end.select_columns(&kept),
            anew: self.anew,
        }
    }

    /// All columns but those of the parameters `from..to`.
    fn but(&self, from: usize, to: usize) -> Vec<usize> {
        (0..self.end.ncols())
            .filter(|column| !(1 + from..1 + to).contains(column))
            .collect()
    }
}

impl Whitened {
    /// Some columns, the latents all among them; no readings.
    fn select(&self, columns: &[usize]) -> Self {
        Self {
            gram: self.gram.select_columns(columns).select_rows(columns),
            half_log_determinant: self.half_log_determinant,
            readings: DMatrix::zeros(0, 0),
            scaled: self.scaled.clone(),
        }
    }
}

/// The readings of a segment, whitened for one size of their correlated noise.
#[derive(Clone, Debug)]
pub(crate) struct Whitened {
    /// Gram matrix of the columns; the first is the residual, carried back to zero parameters.
    pub(crate) gram: DMatrix<f64>,
    /// Half the logarithm of the determinant of the noise's covariance, beside its white part.
    pub(crate) half_log_determinant: f64,
    /// Columns by row and channel [rows * channels, columns]; empty unless they are kept. A reading that is absent has none
    /// but zeros.
    pub(crate) readings: DMatrix<f64>,
    /// Gram matrices of the latents' columns in the readings of one sensor each, for those that a sweep asks for.
    pub(crate) scaled: Vec<DMatrix<f64>>,
}

/// How a track is swept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sweep<'s> {
    /// Directions beyond the set's own; without them starts and unmodelled forces alone.
    pub(crate) directions: Option<&'s [Direction]>,
    /// Pieces of a segment over which unmodelled forces are constant.
    pub(crate) pieces: usize,
    /// Length of a block [s].
    pub(crate) block: f64,
    /// Time between states at which changes are taken that do not follow the commands [s].
    pub(crate) look: f64,
    /// Scale of the unmodelled forces by degree of freedom.
    pub(crate) force_scale: &'s DVector<f64>,
    /// Sizes of the correlated noise of sensors that declare none, in what their readings move.
    pub(crate) drifts: &'s [f64],
    /// True where the readings' columns are kept beside their Gram matrix.
    pub(crate) keep_readings: bool,
    /// Sources of channels whose latents' columns are wanted by themselves.
    pub(crate) scaled: &'s [usize],
    /// Length of predictions, which then start anew [s]; none: a trial is one.
    pub(crate) horizon: Option<f64>,
}

/// Sweeps a track about a point. `None` where the system blows up on it or the plant refuses it.
pub(crate) fn sweep(
    problem: &Problem<'_>,
    track: &Track,
    point: &Point,
    how: Sweep<'_>,
) -> Result<Option<Vec<LinkColumns>>, GapError> {
    let Sweep {
        directions,
        pieces,
        force_scale,
        ..
    } = how;
    let model = problem.model;
    let step = model.timestep;
    let grid = Grid::new([how.block, how.look], pieces, step);
    let trial = &problem.trials[track.trial];
    let motion = &problem.motions[track.trial];
    let entries = problem.entries(point);
    let nuisances_at = problem.nuisance_values(point);
    let Ok(mut base) = problem.plant.simulation(&nuisances_at, &entries) else {
        return Ok(None);
    };
    let (changes, beside, z) = match directions {
        Some(directions) => {
            let beside = form_error::beside(problem, point);
            let z = carried(problem, point, beside.forms());
            (changes(problem, point, directions, &entries), beside, z)
        }
        None => (Vec::new(), Beside::default(), DVector::zeros(0)),
    };
    let keep = changes.iter().any(|change| change.kind.has_own_memory());
    let rolled = track::roll(
        base.as_mut(),
        trial,
        motion,
        track,
        WarmUp::required(model, &entries, &problem.settings.options.rollout),
        step,
        grid,
        force_scale,
        keep,
    );
    let Some(rolled) = rolled else {
        return Ok(None);
    };
    // Differences are taken with the cheaper integrator.
    let plant = problem.plant.cheaper().unwrap_or(problem.plant);
    let Ok(mut base) = plant.simulation(&nuisances_at, &entries) else {
        return Ok(None);
    };
    base.prescribe(trial.prescribed.clone());
    let states = state_changes(problem, base.as_mut(), &rolled, (track, grid), force_scale);
    let references = references(base.as_mut(), &rolled);
    let defects = defects(base.as_ref(), track, &rolled);
    let about = (&nuisances_at[..], &entries[..]);
    let Ok(noises) = command_forces(problem, (track, &rolled), grid, force_scale, about) else {
        return Ok(None);
    };
    let memories = memories::of_changes(problem, (track, &rolled), grid, &changes, about)?;
    let inputs: Vec<Option<Inputs>> = changes
        .par_iter()
        .enumerate()
        .map(|(at, change)| {
            if change.every_step {
                let along = (track, &rolled[..]);
                let of_steps = (grid, force_scale);
                return every_step::inputs(problem, along, of_steps, change, about).map(Some);
            }
            let memories = memories.get(&change.remembers_as.unwrap_or(at));
            inputs(
                problem,
                track,
                &rolled,
                &references,
                grid,
                (change, memories),
                about,
            )
        })
        .collect::<Result<_, GapError>>()?;
    let inputs = match directions {
        Some(_) => {
            let base = Base {
                rolled: &rolled,
                references: &references,
                states: &states,
                force_scale,
            };
            form_error::with_forms(problem, point, base, inputs)
        }
        None => inputs,
    };
    let layout = Layout {
        nv: model.nv,
        channels: problem.channels.len(),
        parameters: inputs.len(),
        pieces,
        commands: noises.first().map_or(0, DMatrix::ncols),
        drifting: problem.drifting.len(),
    };
    let corrections = corrections(problem, &nuisances_at, &entries);
    let links = (0..rolled.len())
        .into_par_iter()
        .map(|at| {
            assemble(
                problem,
                track,
                &rolled,
                at,
                &layout,
                (&states[at], &noises[at]),
                defects.get(at),
                (&changes, &beside),
                &inputs,
                &corrections,
                &z,
                (how.drifts, how.keep_readings, how.scaled),
                grid,
            )
        })
        .collect();
    Ok(Some(starting_anew(links, track, trial.steady, how.horizon)))
}

/// Links whose predictions start anew where they are as long as a horizon.
fn starting_anew(
    mut links: Vec<LinkColumns>,
    track: &Track,
    steady: bool,
    horizon: Option<f64>,
) -> Vec<LinkColumns> {
    let mut since = f64::NEG_INFINITY;
    for (link, of) in links.iter_mut().zip(&track.links) {
        let start = of.segment.start;
        if horizon.is_some_and(|horizon| steady || start - since > horizon - 1e-9) {
            link.anew = true;
            since = start;
        }
    }
    links
}

/// The point's parameters as they are carried back to zero.
fn carried(problem: &Problem<'_>, point: &Point, forms: usize) -> DVector<f64> {
    let known = problem.normalised(point);
    let nuisances = problem.nuisances.len();
    let mut z = DVector::zeros(known.len() + forms);
    z.rows_mut(0, nuisances)
        .copy_from(&known.rows(0, nuisances));
    // Shapes stay where they are: without their amplitudes they change nothing.
    let parameters = point
        .candidates
        .iter()
        .flat_map(|of| &problem.candidates[*of].parameters);
    for (at, p) in parameters.enumerate() {
        z[nuisances + forms + at] = if p.shapes { 0.0 } else { known[nuisances + at] };
    }
    z
}

/// Corrections of all sensors, those for the instants that an integrator's positions and velocities belong to with them.
fn corrections(problem: &Problem<'_>, nuisances: &[f64], entries: &[Entry]) -> Vec<Correction> {
    let model = problem.model;
    let mut all = sensor_correction::corrections(model, entries);
    for (nuisance, value) in model.nuisances.iter().zip(nuisances) {
        let has = match nuisance.quantity {
            Quantity::PositionLag => SensorKind::is_position,
            Quantity::VelocityLag => SensorKind::is_velocity,
            Quantity::ForceLag => SensorKind::is_force,
            _ => continue,
        };
        for (correction, sensor) in all.iter_mut().zip(&model.sensors) {
            if has(sensor.kind) {
                correction.delay += value * model.timestep;
            }
        }
    }
    all
}

#[expect(clippy::too_many_arguments)]
fn assemble(
    problem: &Problem<'_>,
    track: &Track,
    rolled: &[Rolled],
    at: usize,
    layout: &Layout,
    (states, noise): (&StateChanges, &DMatrix<f64>),
    defect: Option<&DVector<f64>>,
    (changes, beside): (&[Change], &Beside),
    inputs: &[Option<Inputs>],
    corrections: &[Correction],
    z: &DVector<f64>,
    (drifts, keep_readings, scaled): (&[f64], bool, &[usize]),
    grid: Grid,
) -> LinkColumns {
    let of = &rolled[at];
    let link = &track.links[at];
    let trial = &problem.trials[track.trial];
    let step = problem.model.timestep;
    let (nv, channels) = (layout.nv, layout.channels);
    let tangents = 2 * nv;
    let width = layout.columns();
    // Changes of state and channels at the boundaries.
    let mut state = DMatrix::<f64>::zeros(tangents, width);
    for axis in 0..tangents {
        state[(axis, layout.start() + axis)] = 1.0;
    }
    let blocks = of.boundaries.len() - 1;
    // Columns of one boundary: those of the parameters, and of forces and noise of the piece that a block belongs to.
    type Part = fn(&(DMatrix<f32>, DMatrix<f32>)) -> &DMatrix<f32>;
    let columns_at = |part: Part, forces: &[DMatrix<f64>], boundary: usize, block: usize| {
        let forces = &forces[boundary];
        let mut all = DMatrix::<f64>::zeros(forces.nrows(), width);
        for (column, inputs) in inputs.iter().enumerate() {
            if let Some(inputs) = inputs {
                for (row, value) in part(&inputs.0[at]).column(boundary).iter().enumerate() {
                    all[(row, 1 + column)] = f64::from(*value);
                }
            }
        }
        let piece = link.piece(grid, block);
        let first = piece * nv;
        let noise_at = layout.commands() + piece * layout.commands;
        all.columns_mut(noise_at, layout.commands)
            .copy_from(&(forces * noise));
        let mut own = all.columns_mut(layout.forces() + first, nv);
        own.copy_from(forces);
        for (axis, mut column) in own.column_iter_mut().enumerate() {
            column *= link.factor(first + axis);
        }
        all
    };
    let input =
        |boundary: usize, block: usize| columns_at(|of| &of.0, &states.force, boundary, block);
    let direct =
        |boundary: usize, block: usize| columns_at(|of| &of.1, &states.direct, boundary, block);
    // Readings at the boundaries, by the step.
    let mut readings: Vec<(usize, DMatrix<f64>)> = Vec::with_capacity(blocks + 1);
    readings.push((0, &states.reading[0] * &state + direct(0, 0)));
    for block in 0..blocks {
        let (from, to) = (of.boundaries[block].step, of.boundaries[block + 1].step);
        let transition = 0.5 * (&states.transition[block] + &states.transition[block + 1]);
        let (carried, before, after) = powers(&transition, to - from);
        state = carried * state + before * input(block, block) + after * input(block + 1, block);
        let reading = &states.reading[block + 1] * &state + direct(block + 1, block);
        readings.push((to, reading));
    }
    // Rows between boundaries are linear.
    let rows = link.segment.rows.clone();
    let mut outputs = DMatrix::<f64>::zeros(rows.len() * channels, width);
    let mut reads = Vec::with_capacity(rows.len() * channels);
    for (number, row) in rows.clone().enumerate() {
        for source in &problem.channels.sources {
            let correction = &corrections[source.sensor];
            let time = trial.times[row] - step - correction.delay - link.segment.start;
            let place = time / step;
            let after = readings
                .partition_point(|(at, _)| (*at as f64) < place)
                .clamp(1.min(readings.len() - 1), readings.len() - 1);
            let before = after.saturating_sub(1);
            let (from, to) = (readings[before].0 as f64, readings[after].0 as f64);
            let part = ((place - from) / (to - from).max(1.0)).clamp(0.0, 1.0);
            let scale = if source.attitude {
                1.0
            } else {
                correction.scale
            };
            for channel in source.channel..source.channel + source.channels {
                let shares = [scale * (1.0 - part), scale * part];
                reads.push((
                    number * channels + channel,
                    channel,
                    [before, after],
                    shares,
                ));
            }
        }
    }
    for column in 1..layout.drifts() {
        let mut into = outputs.column_mut(column);
        for (out, channel, [before, after], shares) in &reads {
            let (a, b) = (&readings[*before].1, &readings[*after].1);
            into[*out] = shares[0] * a[(*channel, column)] + shares[1] * b[(*channel, column)];
        }
    }
    let mut residual = Vec::new();
    let residual_of = |trace: &Trace, corrections: &[Correction], residual: &mut Vec<f64>| {
        sensor_correction::residuals(
            trace,
            trial,
            &link.segment,
            &problem.channels,
            corrections,
            step,
            residual,
        );
    };
    residual_of(&of.trace, corrections, &mut residual);
    let mut other = Vec::new();
    for (number, change) in changes.iter().enumerate() {
        let column = if number < beside.numbers {
            number
        } else {
            number + beside.forms()
        };
        if change.kind != Kind::Measurement {
            continue;
        }
        if change.lead == 0.0 {
            let moved = self::corrections(problem, &change.nuisances, &change.entries);
            residual_of(&of.trace, &moved, &mut other);
        } else {
            residual_of(&of.trace.with_lead(change.lead), corrections, &mut other);
        }
        for (row, (before, after)) in residual.iter().zip(&other).enumerate() {
            let slope = (before - after) / change.step;
            outputs[(row, 1 + column)] = if slope.is_finite() { slope } else { 0.0 };
        }
    }
    slow_drift::put(problem, track, at, layout.drifts(), &mut outputs);
    // Whitened, and nothing where there is no reading.
    let present: Vec<bool> = residual.iter().map(|value| value.is_finite()).collect();
    whitening::whiten(&problem.channels, &mut residual);
    let mut factors = vec![0.0; residual.len()];
    for (row, value) in residual.iter().enumerate() {
        outputs[(row, 0)] = link.weight(row) * value;
        if present[row] {
            factors[row] = link.weight(row) / problem.channels.list[row % channels].noise;
        }
    }
    for mut column in outputs.column_iter_mut().skip(1) {
        for (value, factor) in column.iter_mut().zip(&factors) {
            *value *= factor;
        }
    }
    if let Some(defect) = defect.filter(|_| !trial.steady) {
        state.set_column(0, &-defect);
    }
    // Carried back to zero parameters.
    let known = z.len();
    let mut carried = outputs.columns(1, known) * z;
    let mut at_end: DVector<f64> = DMatrixView::from(state.columns(1, known)) * z;
    if !link.forces.is_empty() {
        let forces = DVector::from_column_slice(&link.forces);
        carried += outputs.columns(layout.forces(), forces.len()) * &forces;
        at_end += DMatrixView::from(state.columns(layout.forces(), forces.len())) * &forces;
    }
    let mut first = outputs.column_mut(0);
    first += carried;
    let mut first = state.column_mut(0);
    first -= at_end;
    if trial.steady {
        drop_rounding(&mut outputs);
        // The next state has nothing to do with this one.
        state.fill(0.0);
    }
    let times = &trial.times[rows];
    let time = problem.drift_time(trial.period());
    let noise = drifts.iter().map(|drift| {
        let mut readings = outputs.clone();
        let half_log_determinant = coloured_noise::whiten(
            &mut readings,
            *drift,
            &problem.drifting,
            channels,
            &factors,
            (times, time),
        );
        let scaled = scaled.iter().map(|source| {
            let source = &problem.channels.sources[*source];
            let own = source.channel..source.channel + source.channels;
            let rows: Vec<usize> = (0..readings.nrows())
                .filter(|row| own.contains(&(row % channels)))
                .collect();
            let of_latents = readings.columns(layout.start(), width - layout.start());
            let of_latents = of_latents.select_rows(&rows);
            of_latents.transpose() * &of_latents
        });
        Whitened {
            scaled: scaled.collect(),
            gram: symmetric::gram(&readings),
            half_log_determinant,
            readings: match keep_readings {
                true => readings,
                false => DMatrix::zeros(0, 0),
            },
        }
    });
    LinkColumns {
        noise: noise.collect(),
        end: state,
        anew: false,
    }
}

/// Whitened change of a reading with a parameter that is rounding: what cannot act on a prescribed model leaves some.
const ROUNDING: f64 = 1e-9;

/// Clears the columns of parameters and latents that hold nothing but rounding.
fn drop_rounding(outputs: &mut DMatrix<f64>) {
    for mut column in outputs.column_iter_mut().skip(1) {
        if column.amax() < ROUNDING {
            column.fill(0.0);
        }
    }
}

/// Tangents from the end of every segment to the start of the next [2 nv].
fn defects(simulation: &dyn Simulation, track: &Track, rolled: &[Rolled]) -> Vec<DVector<f64>> {
    let nexts = track.links.iter().skip(1);
    (rolled.iter().zip(nexts))
        .map(|(of, next)| {
            let (qpos, qvel) = &of.end;
            let nv = qvel.len();
            let mut tangent = DVector::zeros(2 * nv);
            let (way, change) = tangent.as_mut_slice().split_at_mut(nv);
            simulation.differentiate(qpos, &next.segment.qpos, way);
            for ((value, a), b) in change.iter_mut().zip(qvel).zip(&next.segment.qvel) {
                *value = b - a;
            }
            tangent
        })
        .collect()
}

/// Over `steps` steps of one transition matrix: the state's change with the state, and with inputs of each step that go
/// linearly from a first to a last value.
fn powers(transition: &DMatrix<f64>, steps: usize) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
    let n = transition.nrows();
    let mut carried = DMatrix::identity(n, n);
    let mut before = DMatrix::zeros(n, n);
    let mut after = DMatrix::zeros(n, n);
    for step in 0..steps {
        let part = step as f64 / steps as f64;
        carried = transition * carried;
        before = transition * before;
        after = transition * after;
        for axis in 0..n {
            before[(axis, axis)] += 1.0 - part;
            after[(axis, axis)] += part;
        }
    }
    (carried, before, after)
}
