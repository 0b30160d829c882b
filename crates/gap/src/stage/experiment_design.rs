//! The next experiment: which safe manoeuvre would tell two explanations apart, found by simulation.
//!
//! A manoeuvre is simulated under one explanation and the other is fitted to it, starts and uncertain
//! numbers of the nominal free; what the fit leaves, whitened and squared, is the distance that the
//! experiment would show.

use std::{f64::consts::TAU, sync::atomic::AtomicUsize};

use rayon::prelude::*;

use crate::{
    error::GapError,
    likelihood::working_point::WorkingPoint,
    plant::Simulation,
    problem::{channels::MeasuredTrial, point::Point, problem::Problem, segments::EstimatedMotion},
    progress::Watch,
    rollout::sensor_correction,
    trial::Series,
};

/// Length of a manoeuvre of the menu [s].
const LENGTH: f64 = 8.0;
/// Advice where no manoeuvre tells them apart.
const BY_ITSELF: &str = "measure the part by itself: weigh it, tow it, or pull it on a bollard";

/// One safe manoeuvre.
struct Manoeuvre {
    /// Instruction.
    text: &'static str,
    /// Control of an actuator between -1 and 1 at a time [s].
    command: fn(usize, f64) -> f64,
    /// Roll and pitch at the start [rad], where the base floats.
    tilt: [f64; 2],
}

const MENU: [Manoeuvre; 7] = [
    Manoeuvre {
        text: "a quiet run: let go from rest, commands (where there are any) held in the middle of their range",
        command: |_, _| 0.0,
        tilt: [0.0, 0.0],
    },
    Manoeuvre {
        text: "a static tilt: release it from rest, rolled and pitched by 30 degrees, commands in the middle of their range",
        command: |_, _| 0.0,
        tilt: [0.5, 0.5],
    },
    Manoeuvre {
        text: "steps: each actuator on and off in turn, from rest",
        command: |actuator, time| {
            let slot = (time / 0.5) as usize;
            if slot.is_multiple_of(2) && (slot / 2) % 4 == actuator % 4 {
                0.8
            } else {
                0.0
            }
        },
        tilt: [0.0, 0.0],
    },
    Manoeuvre {
        text: "a heading reversal at two speeds: half, then full command one way, and back",
        command: |_, time| match (time / 2.0) as usize {
            0 => 0.5,
            1 => -0.5,
            2 => 1.0,
            _ => -1.0,
        },
        tilt: [0.0, 0.0],
    },
    Manoeuvre {
        text: "an amplitude ladder: the same oscillation at a quarter, half and full command",
        command: |actuator, time| {
            let amplitude = [0.25, 0.5, 1.0][((time / (LENGTH / 3.0)) as usize).min(2)];
            amplitude * (TAU * 0.4 * time + actuator as f64).sin()
        },
        tilt: [0.0, 0.0],
    },
    Manoeuvre {
        text: "a frequency ladder: the same amplitude at 0.25, 0.5, 1 and 2 Hz",
        command: |actuator, time| {
            let frequency = [0.25, 0.5, 1.0, 2.0][((time / 2.0) as usize).min(3)];
            0.6 * (TAU * frequency * time + actuator as f64).sin()
        },
        tilt: [0.0, 0.0],
    },
    Manoeuvre {
        text: "one actuator at a time, each swept slowly from full reverse to full ahead",
        command: |actuator, time| {
            if (time / 2.0) as usize % 4 == actuator % 4 {
                (time % 2.0) - 1.0
            } else {
                0.0
            }
        },
        tilt: [0.0, 0.0],
    },
];

/// The manoeuvre that tells two fitted explanations apart best, in a sentence.
pub(crate) fn next(
    problem: &Problem<'_>,
    one: &Point,
    other: &Point,
    watch: &Watch<'_>,
) -> Result<String, GapError> {
    if problem
        .trials
        .iter()
        .all(|trial| trial.prescribed.is_some())
    {
        return Ok(PRESCRIBED.to_owned());
    }
    let done = AtomicUsize::new(0);
    let distances: Vec<Option<f64>> = MENU
        .par_iter()
        .map(|manoeuvre| {
            let distance = distance(problem, one, other, manoeuvre, watch)?;
            watch.count("trying experiments", &done, MENU.len());
            Ok(distance)
        })
        .collect::<Result<_, GapError>>()?;
    let mut best: Option<(f64, &Manoeuvre)> = None;
    for (manoeuvre, distance) in MENU.iter().zip(distances) {
        if let Some(distance) = distance
            && best.is_none_or(|(before, _)| distance > before)
        {
            best = Some((distance, manoeuvre));
        }
    }
    let Some((distance, manoeuvre)) = best else {
        return Ok(format!(
            "no manoeuvre of the menu could be simulated under both; {BY_ITSELF}"
        ));
    };
    let strength = distance.max(0.0).sqrt();
    Ok(
        if distance < problem.settings.options.name.distinguishable {
            format!(
                "no manoeuvre of the menu tells them apart in {LENGTH:.0} s (the best, {}, makes a difference of \
             {strength:.1} standard deviations); {BY_ITSELF}",
                manoeuvre.text
            )
        } else {
            format!(
                "{} ({LENGTH:.0} s of it would show a difference of {strength:.0} standard deviations)",
                manoeuvre.text
            )
        },
    )
}

/// The answer where motion is prescribed: manoeuvres are for what drives itself.
const PRESCRIBED: &str = "prescribe other motions: other speeds, angles and rates than in these trials, and one at a time";

/// Squared whitened distance between what two explanations predict of a manoeuvre.
fn distance(
    problem: &Problem<'_>,
    one: &Point,
    other: &Point,
    manoeuvre: &Manoeuvre,
    watch: &Watch<'_>,
) -> Result<Option<f64>, GapError> {
    // What is compared are two simulations, so any integrator serves, if it is the same.
    let plant = problem.plant.cheaper().unwrap_or(problem.plant);
    let mut simulation = plant.simulation(
        &vec![0.0; problem.model.nuisances.len()],
        &problem.entries(one),
    )?;
    let Some((trial, motion)) = perform(problem, simulation.as_mut(), one, manoeuvre) else {
        return Ok(None);
    };
    let quiet = Watch::silent(watch.stop);
    let simulated = Problem {
        plant,
        model: plant.description(),
        trials: vec![trial],
        motions: vec![motion],
        channels: problem.channels.clone(),
        drifting: Vec::new(),
        candidates: problem.candidates.clone(),
        priors: problem.priors.clone(),
        hulls: problem.hulls.clone(),
        nuisances: problem.nuisances.clone(),
        settings: problem.settings.clone(),
        command_noise: Vec::new(),
        commands: problem.commands.clone(),
        remarks: Vec::new(),
    };
    let evidence = |point: &Point| -> Result<Option<f64>, GapError> {
        let mut working = WorkingPoint::new(&simulated, &quiet)?;
        working.point = point.common();
        working.settled_evidence()
    };
    let (one, other) = (evidence(one)?, evidence(other)?);
    Ok(one.zip(other).map(|(one, other)| 2.0 * (one - other)))
}

/// Simulates a manoeuvre and records what the sensors would, without noise.
fn perform(
    problem: &Problem<'_>,
    simulation: &mut dyn Simulation,
    point: &Point,
    manoeuvre: &Manoeuvre,
) -> Option<(MeasuredTrial, EstimatedMotion)> {
    let model = problem.model;
    let step = model.timestep;
    let period = problem.trials.first()?.period().max(step);
    let stride = (period / step).round().max(1.0) as usize;
    let rows = (LENGTH / (stride as f64 * step)) as usize;
    let width = problem.trials.first()?.width;
    simulation.reset();
    if model.nq == model.nv + 1 {
        let mut tangent = vec![0.0; 2 * model.nv];
        tangent[3..5].copy_from_slice(&manoeuvre.tilt);
        simulation.retract(&tangent);
    }
    let corrections = sensor_correction::corrections(model, &problem.entries(point));
    let mut control = Series {
        times: Vec::new(),
        columns: model.actuators.iter().map(|a| a.name.clone()).collect(),
        data: Vec::new(),
    };
    let mut motion = EstimatedMotion::default();
    let mut trial = MeasuredTrial {
        name: "simulated".to_owned(),
        times: Vec::new(),
        values: Vec::new(),
        width,
        control: control.clone(),
        ..MeasuredTrial::default()
    };
    for row in 0..rows {
        let time = row as f64 * stride as f64 * step;
        motion.times.push(time);
        motion.qpos.extend_from_slice(simulation.qpos());
        motion.qvel.extend_from_slice(simulation.qvel());
        for at in 0..stride {
            let now = time + at as f64 * step;
            let command: Vec<f64> = (0..model.actuators.len())
                .map(|actuator| {
                    let share = (manoeuvre.command)(actuator, now);
                    match model.actuators[actuator].range {
                        Some([low, high]) => {
                            let half = problem.commands[actuator].min(0.5 * (high - low));
                            (0.5 * (low + high) + share * half).clamp(low, high)
                        }
                        None => share * problem.commands[actuator],
                    }
                })
                .collect();
            control.times.push(now);
            control.data.extend_from_slice(&command);
            simulation.set_control(&command);
            simulation.step();
            if at == 0 {
                trial.times.push(time + step);
                let mut reading = simulation.sensors()[..width].to_vec();
                for source in problem.channels.sources.iter().filter(|of| !of.attitude) {
                    let correction = &corrections[source.sensor];
                    for (component, value) in reading[source.start..source.start + source.len]
                        .iter_mut()
                        .enumerate()
                    {
                        *value = *value * correction.scale + correction.bias[component.min(2)];
                    }
                }
                trial.values.extend_from_slice(&reading);
            }
        }
    }
    trial.control = control;
    (!simulation.diverged()).then_some((trial, motion))
}
