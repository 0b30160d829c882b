//! Short windows along a trial: cut, run under a constant base wrench, differentiated.

use hydro_frames::Wrench;
use nalgebra::{DMatrix, DVector};

use crate::{
    error::GapError,
    options::Options,
    plant::{FreeBase, Plant, PlantDescription, Simulation},
    problem::{
        channels::{Channels, MeasuredTrial, rotation_between},
        segments::{self, EstimatedMotion, Segment},
    },
    rollout::{
        sensor_correction::{self, Correction},
        shooting::{self, Trace, WarmUp},
        state_estimation,
        whitening::whiten,
    },
};

/// Model, channels and options that all windows share.
pub(super) struct WindowProblem<'a> {
    pub(super) plant: &'a dyn Plant,
    pub(super) model: &'a PlantDescription,
    pub(super) base: &'a FreeBase,
    pub(super) channels: &'a Channels,
    /// Values of `PlantDescription::nuisances`.
    pub(super) nuisances: &'a [f64],
    pub(super) options: &'a Options,
    /// Steps of the difference quotients by the wrench [N, N m].
    pub(super) wrench_step: [f64; 6],
}

/// Rollout of one window.
#[derive(Clone, Debug)]
pub(super) struct WindowRollout {
    /// Whitened residuals [readings].
    pub(super) residual: DVector<f64>,
    /// State where the next window starts.
    pub(super) qpos: Vec<f64>,
    pub(super) qvel: Vec<f64>,
}

/// Sensitivities of a rollout to the start (a tangent [2 nv]) and the wrench [6].
#[derive(Clone, Debug)]
pub(super) struct WindowSensitivities {
    /// Change of the whitened prediction [readings, 2 nv + 6].
    pub(super) readings: DMatrix<f64>,
    /// Change of the end, as a tangent [2 nv, 2 nv + 6].
    pub(super) end: DMatrix<f64>,
}

/// A state of the plant on its way.
pub(super) struct Sample {
    pub(super) time: f64,
    pub(super) qpos: Vec<f64>,
    pub(super) qvel: Vec<f64>,
}

/// A simulation led through what comes before a window, and the memory that it has there.
struct Prepared {
    simulation: Box<dyn Simulation>,
    memory: Vec<f64>,
    trace: Trace,
}

impl WindowProblem<'_> {
    /// Steps between samples.
    pub(super) fn sample_steps(&self) -> usize {
        ((self.options.residual.sample_period / self.model.timestep).round() as usize).max(1)
    }

    /// Cuts a trial into windows that follow each other without a gap, starting on its motion; `most` at
    /// most.
    pub(super) fn cut(
        &self,
        trial: &MeasuredTrial,
        motion: &EstimatedMotion,
        most: usize,
    ) -> Result<Vec<Segment>, GapError> {
        let mut simulation = self.plant.simulation(self.nuisances, &[])?;
        simulation.prescribe(trial.prescribed.clone());
        let options = &self.options.residual;
        let step = self.model.timestep;
        let rows = trial.times.len();
        let (qpos, qvel) = motion.state(0);
        let mut next = (motion.times[0], qpos.to_vec(), qvel.to_vec());
        let mut windows = Vec::new();
        let mut first = 0;
        while first < rows && windows.len() < most {
            let end = segments::window_end(trial, first, options.window, options.least_rows);
            let (start, qpos, qvel) = next;
            windows.push(Segment {
                rows: first..end,
                start,
                qpos,
                qvel,
            });
            // The next one starts where this one ends, a little after its last row.
            let over = start + shooting::steps(trial, end, start, step) as f64 * step;
            let (qpos, qvel) = motion.state(end - 1);
            simulation.set_motion(motion.times[end - 1], qpos, qvel);
            let mut control = vec![0.0; trial.control.width()];
            while simulation.time() < over - 0.5 * step && !simulation.diverged() {
                trial.control.interpolate(simulation.time(), &mut control);
                simulation.set_control(&control);
                simulation.step();
            }
            next = (over, simulation.qpos().to_vec(), simulation.qvel().to_vec());
            first = end;
        }
        Ok(windows)
    }

    fn prepare(
        &self,
        trial: &MeasuredTrial,
        motion: &EstimatedMotion,
        window: &Segment,
    ) -> Result<Prepared, GapError> {
        let mut simulation = self.plant.simulation(self.nuisances, &[])?;
        let warm_up = WarmUp::required(self.model, &[], &self.options.rollout);
        let step = self.model.timestep;
        shooting::lead_in(simulation.as_mut(), trial, window, motion, warm_up, step);
        Ok(Prepared {
            memory: simulation.save(),
            simulation,
            trace: Trace::default(),
        })
    }

    /// Runs a window; none where it blew up.
    fn roll(
        &self,
        prepared: &mut Prepared,
        trial: &MeasuredTrial,
        window: &Segment,
        tangent: Option<&[f64]>,
        wrench: [f64; 6],
    ) -> Option<WindowRollout> {
        let step = self.model.timestep;
        let simulation = prepared.simulation.as_mut();
        simulation.load(&prepared.memory);
        simulation.set_base_wrench(Wrench::from_array(wrench));
        let trace = &mut prepared.trace;
        if !shooting::roll(simulation, trial, window, step, tangent, trace) {
            return None;
        }
        let none = vec![Correction::NONE; self.model.sensors.len()];
        let mut residual = Vec::new();
        sensor_correction::residuals(
            trace,
            trial,
            window,
            self.channels,
            &none,
            step,
            &mut residual,
        );
        whiten(self.channels, &mut residual);
        let simulation = prepared.simulation.as_ref();
        Some(WindowRollout {
            residual: DVector::from_vec(residual),
            qpos: simulation.qpos().to_vec(),
            qvel: simulation.qvel().to_vec(),
        })
    }

    /// Runs a window.
    pub(super) fn run(
        &self,
        trial: &MeasuredTrial,
        motion: &EstimatedMotion,
        window: &Segment,
        wrench: [f64; 6],
    ) -> Result<Option<WindowRollout>, GapError> {
        let mut prepared = self.prepare(trial, motion, window)?;
        Ok(self.roll(&mut prepared, trial, window, None, wrench))
    }

    /// Runs a window and looks along every direction.
    pub(super) fn differentiate(
        &self,
        trial: &MeasuredTrial,
        motion: &EstimatedMotion,
        window: &Segment,
        wrench: [f64; 6],
    ) -> Result<Option<(WindowRollout, WindowSensitivities)>, GapError> {
        let mut prepared = self.prepare(trial, motion, window)?;
        let Some(ran) = self.roll(&mut prepared, trial, window, None, wrench) else {
            return Ok(None);
        };
        let (nv, tangents) = (self.model.nv, 2 * self.model.nv);
        let mut slopes = WindowSensitivities {
            readings: DMatrix::zeros(ran.residual.len(), tangents + 6),
            end: DMatrix::zeros(tangents, tangents + 6),
        };
        for column in 0..tangents + 6 {
            let (mut tangent, mut pushed) = (vec![0.0; tangents], wrench);
            let step = if column < tangents {
                tangent[column] = state_estimation::STEP[column / nv];
                tangent[column]
            } else {
                pushed[column - tangents] += self.wrench_step[column - tangents];
                self.wrench_step[column - tangents]
            };
            let moved = self.roll(&mut prepared, trial, window, Some(&tangent), pushed);
            let Some(moved) = moved else {
                return Ok(None);
            };
            let change = (&ran.residual - &moved.residual) / step;
            slopes.readings.set_column(column, &change);
            let end = self.tangent((&ran.qpos, &ran.qvel), (&moved.qpos, &moved.qvel)) / step;
            slopes.end.set_column(column, &end);
        }
        Ok(Some((ran, slopes)))
    }

    /// The states at every `every`-th step of a window, counted on from `count`; the count at its end.
    #[expect(clippy::too_many_arguments)]
    pub(super) fn sample(
        &self,
        trial: &MeasuredTrial,
        motion: &EstimatedMotion,
        window: &Segment,
        wrench: [f64; 6],
        every: usize,
        count: usize,
        samples: &mut Vec<Sample>,
    ) -> Result<usize, GapError> {
        let Prepared { mut simulation, .. } = self.prepare(trial, motion, window)?;
        let step = self.model.timestep;
        let mut control = vec![0.0; trial.control.width()];
        simulation.set_motion(window.start, &window.qpos, &window.qvel);
        simulation.set_base_wrench(Wrench::from_array(wrench));
        let steps = shooting::steps(trial, window.rows.end, window.start, step);
        for at in 0..steps {
            let time = window.start + at as f64 * step;
            if (count + at).is_multiple_of(every) {
                samples.push(Sample {
                    time,
                    qpos: simulation.qpos().to_vec(),
                    qvel: simulation.qvel().to_vec(),
                });
            }
            trial.control.interpolate(time, &mut control);
            simulation.set_control(&control);
            simulation.step();
        }
        Ok(count + steps)
    }

    /// The start of a window moved along a tangent.
    pub(super) fn moved(
        &self,
        simulation: &mut dyn Simulation,
        window: &Segment,
        tangent: &[f64],
    ) -> Segment {
        simulation.set_motion(window.start, &window.qpos, &window.qvel);
        simulation.retract(tangent);
        Segment {
            qpos: simulation.qpos().to_vec(),
            qvel: simulation.qvel().to_vec(),
            ..window.clone()
        }
    }

    /// The tangent [2 nv] from one state to another, of a free base with hinges and slides.
    pub(super) fn tangent(&self, from: (&[f64], &[f64]), to: (&[f64], &[f64])) -> DVector<f64> {
        let nv = self.model.nv;
        let mut tangent = DVector::zeros(2 * nv);
        let FreeBase { qpos, dof, .. } = *self.base;
        for axis in 0..3 {
            tangent[dof + axis] = to.0[qpos + axis] - from.0[qpos + axis];
        }
        let attitude = qpos + 3..qpos + 7;
        let turn = rotation_between(&from.0[attitude.clone()], &to.0[attitude]);
        for (axis, angle) in turn.into_iter().enumerate() {
            tangent[dof + 3 + axis] = angle;
        }
        for joint in &self.model.joints {
            tangent[joint.dof] = to.0[joint.qpos] - from.0[joint.qpos];
        }
        for dof in 0..nv {
            tangent[nv + dof] = to.1[dof] - from.1[dof];
        }
        tangent
    }
}
