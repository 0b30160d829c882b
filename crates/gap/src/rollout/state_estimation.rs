//! States along a trial, from its sensors: moving-horizon estimation with the nominal model over short
//! windows, each started where the last one ended.

use nalgebra::{DMatrix, DVector};

use crate::{
    error::GapError,
    options::{Options, StateOptions},
    plant::{PlantDescription, SensorKind, Simulation},
    problem::{
        channels::{Channels, MeasuredTrial},
        segments::{self, EstimatedMotion, Segment},
    },
    rollout::{
        sensor_correction::{self, Correction},
        shooting::{self, Trace, WarmUp},
        system::System,
        whitening::whiten,
    },
};

/// Steps of the difference quotients: positions [m or rad], velocities.
pub(crate) const STEP: [f64; 2] = [1e-5, 1e-4];

/// The rows of a trial by which a start is judged, and how they are predicted from it.
struct Window<'a> {
    trial: &'a MeasuredTrial,
    /// The motion before the start.
    motion: &'a EstimatedMotion,
    warm_up: WarmUp,
    channels: &'a Channels,
    corrections: &'a [Correction],
    model: &'a PlantDescription,
}

impl Window<'_> {
    /// Whitened residuals of a segment, its start moved by a tangent; none where it blew up.
    fn residuals(
        &self,
        simulation: &mut dyn Simulation,
        segment: &Segment,
        tangent: Option<&[f64]>,
        trace: &mut Trace,
    ) -> Option<DVector<f64>> {
        let step = self.model.timestep;
        let mut residual = Vec::new();
        let whole = shooting::run(
            simulation,
            self.trial,
            segment,
            self.motion,
            self.warm_up,
            step,
            tangent,
            trace,
        );
        if !whole {
            return None;
        }
        sensor_correction::residuals(
            trace,
            self.trial,
            segment,
            self.channels,
            self.corrections,
            step,
            &mut residual,
        );
        whiten(self.channels, &mut residual);
        Some(DVector::from_vec(residual))
    }

    /// Sensitivity of a segment to its start: minus the derivative of the whitened residuals
    /// by the tangent [rows * channels, 2 nv]; none where a rollout blew up.
    fn sensitivity(
        &self,
        simulation: &mut dyn Simulation,
        segment: &Segment,
    ) -> Option<DMatrix<f64>> {
        let nv = self.model.nv;
        let mut trace = Trace::default();
        let mut from =
            |tangent: &[f64]| self.residuals(simulation, segment, Some(tangent), &mut trace);
        let mut tangent = vec![0.0; 2 * nv];
        let before = from(&tangent)?;
        let mut matrix = DMatrix::zeros(before.len(), 2 * nv);
        for axis in 0..2 * nv {
            let step = STEP[axis / nv];
            tangent.fill(0.0);
            tangent[axis] = step;
            matrix.set_column(axis, &((&before - from(&tangent)?) / step));
        }
        Some(matrix)
    }
}

/// Sum of squares.
fn squares(residual: &DVector<f64>) -> f64 {
    residual.iter().map(|value| value * value).sum()
}

/// Turns a first guess about the vertical to where a compass, or whatever else tells the heading, fits it best: from the opposite
/// heading no slope leads there. `sd` [rad]: of the guess's heading.
fn face(
    guess: &mut Segment,
    (turns, sd): (usize, f64),
    mut misfit: impl FnMut(&Segment) -> Option<f64>,
) {
    let mut best = misfit(guess).unwrap_or(f64::INFINITY);
    let from = guess.clone();
    for turn in 1..turns {
        let half = std::f64::consts::PI * turn as f64 / turns as f64;
        let (cos, sin) = (half.cos(), half.sin());
        let [w, x, y, z] = [3, 4, 5, 6].map(|at| from.qpos[at]);
        let mut turned = from.clone();
        let attitude = [
            cos * w - sin * z,
            cos * x - sin * y,
            cos * y + sin * x,
            cos * z + sin * w,
        ];
        turned.qpos[3..7].copy_from_slice(&attitude);
        let (cos, sin) = ((2.0 * half).cos(), (2.0 * half).sin());
        let (east, north) = (from.qvel[0], from.qvel[1]);
        (turned.qvel[0], turned.qvel[1]) = (cos * east - sin * north, sin * east + cos * north);
        // Headings that fit alike, for nothing tells them, are left alone.
        let angle = (2.0 * half).min(std::f64::consts::TAU - 2.0 * half);
        let prior = (angle / sd).powi(2);
        let found = misfit(&turned).map_or(f64::INFINITY, |misfit| misfit + prior);
        if found < best {
            best = found;
            guess.clone_from(&turned);
        }
    }
}

/// Precision of a start about its guess, by tangent axis.
pub(crate) fn arrival_precision(nv: usize, sd: [f64; 2]) -> DVector<f64> {
    DVector::from_fn(2 * nv, |axis, _| sd[axis / nv].powi(-2))
}

/// The motion of a trial at its rows.
///
/// # Errors
/// The nominal diverges within a window, or a trial is too short.
pub(crate) fn estimate_motion(
    system: &System<'_>,
    trial: &MeasuredTrial,
    channels: &Channels,
    corrections: &[Correction],
    options: &Options,
) -> Result<EstimatedMotion, GapError> {
    let (states, warm_up) = (&options.states, system.warm_up(&options.rollout));
    let model = system.model();
    if let Some(motion) = steady_motion(system, trial)? {
        return Ok(motion);
    }
    let rows = trial.times.len();
    if rows < states.least_rows {
        return Err(GapError::TooShort {
            trial: trial.name.clone(),
            found: rows,
            expected: states.least_rows,
        });
    }
    let mut simulation = system.simulation()?;
    let mut cheaper = system.cheaper()?;
    let (mut qpos, mut qvel, has_heading) = first_guess(simulation.as_mut(), trial, model);
    if let Some(prescribed) = &trial.prescribed {
        let start = on_the_grid(trial, trial.times[0] - model.timestep, model.timestep);
        prescribed.impose(start, &mut qpos, &mut qvel);
    }
    let mut motion = EstimatedMotion::default();
    let mut guess = Segment {
        rows: 0..rows,
        start: on_the_grid(trial, trial.times[0] - model.timestep, model.timestep),
        qpos,
        qvel,
    };
    let mut first = 0;
    while first < rows {
        let mut end = segments::window_end(trial, first, states.window, states.least_rows);
        guess.rows = first..end;
        let window = Window {
            trial,
            motion: &motion,
            warm_up,
            channels,
            corrections,
            model,
        };
        if first == 0 && !has_heading {
            let headings = (states.first_headings, states.first_arrival_sd[0]);
            let mut trace = Trace::default();
            face(&mut guess, headings, |guess| {
                let residual = window.residuals(simulation.as_mut(), guess, None, &mut trace);
                residual.as_ref().map(squares)
            });
        }
        let sd = if first == 0 && trial.initial_state.is_none() {
            states.first_arrival_sd
        } else {
            states.arrival_sd
        };
        let from = guess.clone();
        loop {
            let misfit = settle(
                (simulation.as_mut(), cheaper.as_mut()),
                &window,
                &mut guess,
                sd,
                states,
            );
            // What is missing bends it: a shorter one follows the readings. As many rows as a window has must be left.
            let half = first + ((end - first) / 2).max(states.least_rows);
            let may_shorten = half < end && half + states.least_rows <= rows;
            if !may_shorten || misfit.as_ref().is_ok_and(|misfit| *misfit < states.far_off) {
                misfit?;
                break;
            }
            end = half;
            guess = Segment {
                rows: first..end,
                ..from.clone()
            };
        }
        follow(
            simulation.as_mut(),
            trial,
            &mut guess,
            &mut motion,
            warm_up,
            model,
        );
        first = end;
    }
    Ok(motion)
}

/// Steady states are known: prescribed, and otherwise as the model starts. `None` for a log in time.
fn steady_motion(
    system: &System<'_>,
    trial: &MeasuredTrial,
) -> Result<Option<EstimatedMotion>, GapError> {
    let Some(prescribed) = trial.prescribed.as_ref().filter(|_| trial.steady) else {
        return Ok(None);
    };
    let mut simulation = system.simulation()?;
    simulation.reset();
    let mut qpos = simulation.qpos().to_vec();
    let mut qvel = vec![0.0; system.model().nv];
    let mut motion = EstimatedMotion::default();
    for label in &trial.times {
        let time = label - system.model().timestep;
        prescribed.impose(time, &mut qpos, &mut qvel);
        motion.times.push(time);
        motion.qpos.extend_from_slice(&qpos);
        motion.qvel.extend_from_slice(&qvel);
    }
    Ok(Some(motion))
}

/// The instant nearest to a time at which a whole number of steps has passed since the first command: a
/// command is held over a step, so steps that begin elsewhere would see it late or early.
fn on_the_grid(trial: &MeasuredTrial, time: f64, step: f64) -> f64 {
    let Some(origin) = trial.control.times.first() else {
        return time;
    };
    origin + ((time - origin) / step).round() * step
}

/// Fits the start of a window to its rows, by Gauss-Newton; the root mean square of what is left of them, in noises.
fn settle(
    (simulation, cheaper): (&mut dyn Simulation, &mut dyn Simulation),
    window: &Window<'_>,
    guess: &mut Segment,
    sd: [f64; 2],
    options: &StateOptions,
) -> Result<f64, GapError> {
    let (trial, model) = (window.trial, window.model);
    let precision = arrival_precision(model.nv, sd);
    let mut moved = DVector::zeros(2 * model.nv);
    let mut trace = Trace::default();
    let mut sensitivity: Option<DMatrix<f64>> = None;
    let mut best: Option<(f64, Segment)> = None;
    let mut misfit = f64::INFINITY;
    let rows = guess.rows.clone();
    let values = rows.flat_map(|row| trial.row(row));
    let readings = values.filter(|value| value.is_finite()).count().max(1);
    for left in (0..=options.steps).rev() {
        let residual = window.residuals(simulation, guess, None, &mut trace);
        let cost = residual.as_ref().map_or(f64::INFINITY, |residual| {
            squares(residual) + moved.component_mul(&moved).dot(&precision)
        });
        match &best {
            None if residual.is_none() => {
                return Err(GapError::NominalDiverges {
                    trial: trial.name.clone(),
                    start: guess.start,
                    after: trial.times[guess.rows.end - 1] - guess.start,
                    expected: options.window,
                    timestep: model.timestep,
                });
            }
            // A step that was too long is not shortened: along what no sensor sees a start would wander from window to window.
            Some((before, state)) if cost >= before * (1.0 - options.settled) => {
                if cost > *before {
                    guess.clone_from(state);
                }
                return Ok(misfit);
            }
            _ => best = Some((cost, guess.clone())),
        }
        let left_over = residual.as_ref();
        misfit = left_over.map_or(misfit, |of| (squares(of) / readings as f64).sqrt());
        if left == 0 {
            return Ok(misfit);
        }
        if sensitivity.is_none() {
            sensitivity = window.sensitivity(cheaper, guess);
        }
        let (Some(matrix), Some(residual)) = (&sensitivity, &residual) else {
            return Ok(misfit);
        };
        let mut normal = matrix.tr_mul(matrix);
        for axis in 0..2 * model.nv {
            normal[(axis, axis)] += precision[axis];
        }
        let gradient = matrix.tr_mul(residual) - moved.component_mul(&precision);
        let Some(factor) = normal.cholesky() else {
            return Ok(misfit);
        };
        let step = factor.solve(&gradient);
        moved += &step;
        simulation.set_motion(guess.start, &guess.qpos, &guess.qvel);
        simulation.retract(step.as_slice());
        guess.qpos = simulation.qpos().to_vec();
        guess.qvel = simulation.qvel().to_vec();
    }
    Ok(misfit)
}

/// Runs a settled window, writes the state at each of its rows into the motion, and leaves the guess where
/// the next window starts.
fn follow(
    simulation: &mut dyn Simulation,
    trial: &MeasuredTrial,
    guess: &mut Segment,
    motion: &mut EstimatedMotion,
    warm_up: WarmUp,
    model: &PlantDescription,
) {
    let step = model.timestep;
    let mut control = vec![0.0; trial.control.width()];
    shooting::lead_in(simulation, trial, guess, motion, warm_up, step);
    simulation.set_motion(guess.start, &guess.qpos, &guess.qvel);
    let mut at = 0_usize;
    let mut go_to = |simulation: &mut dyn Simulation, time: f64| {
        // To the step nearest to the time asked for.
        let target = ((time - guess.start) / step).round().max(0.0) as usize;
        while at < target {
            trial
                .control
                .interpolate(guess.start + at as f64 * step, &mut control);
            simulation.set_control(&control);
            simulation.step();
            at += 1;
        }
        guess.start + at as f64 * step
    };
    for row in guess.rows.clone() {
        let time = go_to(simulation, trial.times[row] - step);
        motion.times.push(time);
        motion.qpos.extend_from_slice(simulation.qpos());
        motion.qvel.extend_from_slice(simulation.qvel());
    }
    if let Some(next) = trial.times.get(guess.rows.end) {
        let time = go_to(simulation, next - step);
        guess.start = time;
        guess.qpos = simulation.qpos().to_vec();
        guess.qvel = simulation.qvel().to_vec();
    }
}

/// A first state: the log's, else what position, attitude, joint and velocity sensors say of it directly,
/// and the model's own for the rest; and false where it is that of a free body whose heading is the model's own.
fn first_guess(
    simulation: &mut dyn Simulation,
    trial: &MeasuredTrial,
    model: &PlantDescription,
) -> (Vec<f64>, Vec<f64>, bool) {
    if let Some(state) = &trial.initial_state {
        let (qpos, qvel) = (
            state[1..1 + model.nq].to_vec(),
            state[1 + model.nq..1 + model.nq + model.nv].to_vec(),
        );
        return (qpos, qvel, true);
    }
    let is_free = model.nq == model.nv + 1
        && model.nv >= 6
        && model.joints.iter().all(|joint| joint.qpos >= 7);
    let mut has_heading = !is_free;
    simulation.reset();
    let mut qpos = simulation.qpos().to_vec();
    let mut qvel = simulation.qvel().to_vec();
    for sensor in &model.sensors {
        let reading = (0..trial.times.len())
            .map(|row| &trial.row(row)[sensor.start..sensor.start + sensor.len])
            .find(|reading| reading.iter().all(|value| value.is_finite()));
        let Some(reading) = reading else { continue };
        let joint = sensor
            .joint
            .as_ref()
            .and_then(|name| model.joints.iter().find(|joint| joint.name == *name));
        let free = sensor.frame_of.as_ref().is_some_and(|name| {
            model
                .bodies
                .iter()
                .any(|body| body.root && body.name == *name)
                && model.nq == model.nv + 1
        });
        match (sensor.kind, joint) {
            (SensorKind::JointPosition, Some(joint)) => qpos[joint.qpos] = reading[0],
            (SensorKind::JointVelocity, Some(joint)) => qvel[joint.dof] = reading[0],
            (SensorKind::Position, _) if free => qpos[..3].copy_from_slice(reading),
            (SensorKind::Quaternion, _) if free => {
                qpos[3..7].copy_from_slice(reading);
                has_heading = true;
            }
            (SensorKind::AngularVelocity, _) if free => qvel[3..6].copy_from_slice(reading),
            _ => {}
        }
    }
    (qpos, qvel, has_heading)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A start whose body heads west where the model heads east; nothing but the heading counts.
    #[test]
    fn a_start_faces_where_its_compass_says() {
        let heading = |segment: &Segment| {
            let [w, x, y, z] = [3, 4, 5, 6].map(|at| segment.qpos[at]);
            (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
        };
        let start = Segment {
            rows: 0..1,
            start: 0.0,
            // Pitched by 0.2 rad.
            qpos: vec![1.0, 2.0, -3.0, 0.1f64.cos(), 0.0, 0.1f64.sin(), 0.0],
            qvel: vec![1.0, 0.0, 0.5, 0.1, 0.2, 0.3],
        };
        let nearest = (std::f64::consts::TAU / 16.0).cos() - 1e-9;
        for wanted in [0.0, 1.5, 3.1, -2.4] {
            let mut guess = start.clone();
            let misfit = |of: &Segment| Some(100.0 * (1.0 - (heading(of) - wanted).cos()));
            face(&mut guess, (8, 1.0), misfit);
            assert!(
                (heading(&guess) - wanted).cos() >= nearest,
                "{wanted}: {}",
                heading(&guess)
            );
            assert_eq!(guess.qpos[..3], start.qpos[..3]);
            let pitch = |of: &Segment| of.qpos[3] * of.qpos[5] - of.qpos[6] * of.qpos[4];
            assert!((pitch(&guess) - pitch(&start)).abs() < 1e-12);
            // The velocity turns with it.
            let (east, north) = (guess.qvel[0], guess.qvel[1]);
            assert!((north.atan2(east) - heading(&guess)).cos() > 1.0 - 1e-12);
            assert_eq!(guess.qvel[2..], start.qvel[2..]);
        }
        // Nothing tells the heading: it is left alone.
        let mut guess = start.clone();
        face(&mut guess, (8, 1.0), |of| {
            Some(3.0 + 1e-3 * heading(of).cos())
        });
        assert_eq!(guess.qpos, start.qpos);
    }
}
