//! A simulation with backlash in joints, seen as one of the nominal model: the coordinates of the extra joints are
//! hidden.

use std::sync::Arc;

use hydro_frames::Wrench;
use hydro_gap::plant::{Simulation, prescribed::PrescribedMotion};
use nalgebra::DMatrix;

use super::{backlash::Backlash, simulation::MujocoSimulation};
use crate::mujoco::ffi::{ModelView, bindings::mjOBJ_JOINT};

/// Indices of the nominal's coordinates among those of the model with backlash.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    qpos: Vec<usize>,
    qvel: Vec<usize>,
    /// Lengths with the extra ones.
    nq: usize,
    nv: usize,
}

impl Layout {
    /// The layout, and the numbers of the extra joints in the order of `backlashes`.
    pub(crate) fn new(
        nominal: ModelView<'_>,
        extended: ModelView<'_>,
        backlashes: &[Backlash],
    ) -> (Self, Vec<usize>) {
        let joint = mjOBJ_JOINT as i32;
        let extra: Vec<usize> = backlashes
            .iter()
            .filter_map(|backlash| extended.id(joint, &backlash.name()))
            .collect();
        let numbers = |model: ModelView<'_>| (model.raw().nq as usize, model.raw().nv as usize);
        let ((nq, nv), (all_q, all_v)) = (numbers(nominal), numbers(extended));
        // An extra joint is a hinge or a slide: one coordinate each.
        let without = |all: usize, address: &[i32]| -> Vec<usize> {
            let hidden: Vec<usize> = extra.iter().map(|id| address[*id] as usize).collect();
            (0..all).filter(|at| !hidden.contains(at)).collect()
        };
        let layout = Self {
            qpos: without(all_q, extended.jnt_qposadr()),
            qvel: without(all_v, extended.jnt_dofadr()),
            nq: all_q,
            nv: all_v,
        };
        debug_assert_eq!((layout.qpos.len(), layout.qvel.len()), (nq, nv));
        (layout, extra)
    }

    /// Spreads a nominal's coordinates; extra ones keep what `into` has.
    fn spread(places: &[usize], from: &[f64], into: &mut [f64]) {
        for (at, value) in places.iter().zip(from) {
            into[*at] = *value;
        }
    }
}

/// See [`Layout`].
#[derive(Debug)]
pub(crate) struct BacklashSimulation {
    inner: MujocoSimulation,
    layout: Layout,
    qpos: Vec<f64>,
    qvel: Vec<f64>,
}

impl BacklashSimulation {
    pub(crate) fn new(inner: MujocoSimulation, layout: Layout) -> Self {
        let mut simulation = Self {
            qpos: vec![0.0; layout.qpos.len()],
            qvel: vec![0.0; layout.qvel.len()],
            inner,
            layout,
        };
        simulation.fold();
        simulation
    }

    /// Copies the nominal's coordinates out.
    fn fold(&mut self) {
        for (value, at) in self.qpos.iter_mut().zip(&self.layout.qpos) {
            *value = self.inner.qpos()[*at];
        }
        for (value, at) in self.qvel.iter_mut().zip(&self.layout.qvel) {
            *value = self.inner.qvel()[*at];
        }
    }
}

impl BacklashSimulation {
    /// A full-physics state of the nominal as one of the model with backlash, every joint in the middle of its own.
    fn whole(&self, state: &[f64]) -> Vec<f64> {
        let (nq, nv) = (self.layout.qpos.len(), self.layout.qvel.len());
        let mut all = Vec::with_capacity(state.len() + self.layout.nq + self.layout.nv);
        if state.len() > nq + nv {
            let mut qpos = vec![0.0; self.layout.nq];
            let mut qvel = vec![0.0; self.layout.nv];
            Layout::spread(&self.layout.qpos, &state[1..=nq], &mut qpos);
            Layout::spread(&self.layout.qvel, &state[1 + nq..1 + nq + nv], &mut qvel);
            all.push(state[0]);
            all.extend(qpos);
            all.extend(qvel);
            all.extend(&state[1 + nq + nv..]);
        }
        all
    }
}

impl Simulation for BacklashSimulation {
    fn reset(&mut self) {
        self.inner.reset();
        self.fold();
    }

    fn time(&self) -> f64 {
        self.inner.time()
    }

    /// Every joint starts in the middle of its backlash.
    fn restart(&mut self, state: &[f64]) {
        let all = self.whole(state);
        self.inner.restart(&all);
        self.fold();
    }

    fn rejoin(&mut self, state: &[f64]) {
        let all = self.whole(state);
        self.inner.rejoin(&all);
        self.fold();
    }

    fn set_motion(&mut self, time: f64, qpos: &[f64], qvel: &[f64]) {
        let (mut all_q, mut all_v) = (self.inner.qpos().to_vec(), self.inner.qvel().to_vec());
        Layout::spread(&self.layout.qpos, qpos, &mut all_q);
        Layout::spread(&self.layout.qvel, qvel, &mut all_v);
        self.inner.set_motion(time, &all_q, &all_v);
        self.fold();
    }

    fn qpos(&self) -> &[f64] {
        &self.qpos
    }

    fn qvel(&self) -> &[f64] {
        &self.qvel
    }

    fn retract(&mut self, tangent: &[f64]) {
        let (nominal, all) = (self.layout.qvel.len(), self.layout.nv);
        let mut spread = vec![0.0; 2 * all];
        let (way, speed) = spread.split_at_mut(all);
        Layout::spread(&self.layout.qvel, &tangent[..nominal], way);
        Layout::spread(&self.layout.qvel, &tangent[nominal..], speed);
        self.inner.retract(&spread);
        self.fold();
    }

    fn differentiate(&self, from: &[f64], to: &[f64], tangent: &mut [f64]) {
        let mut all_from = self.inner.qpos().to_vec();
        let mut all_to = all_from.clone();
        Layout::spread(&self.layout.qpos, from, &mut all_from);
        Layout::spread(&self.layout.qpos, to, &mut all_to);
        let mut all = vec![0.0; self.layout.nv];
        self.inner.differentiate(&all_from, &all_to, &mut all);
        for (value, at) in tangent.iter_mut().zip(&self.layout.qvel) {
            *value = all[*at];
        }
    }

    fn full_state(&self) -> Vec<f64> {
        let all = self.inner.full_state();
        let mut state = vec![all[0]];
        state.extend_from_slice(&self.qpos);
        state.extend_from_slice(&self.qvel);
        state.extend_from_slice(&all[1 + self.layout.nq + self.layout.nv..]);
        state
    }

    fn memory(&self) -> Vec<f64> {
        self.inner.memory()
    }

    fn set_memory(&mut self, memory: &[f64]) {
        self.inner.set_memory(memory);
    }

    fn save(&self) -> Vec<f64> {
        self.inner.save()
    }

    fn load(&mut self, saved: &[f64]) {
        self.inner.load(saved);
        self.fold();
    }

    fn set_control(&mut self, control: &[f64]) {
        self.inner.set_control(control);
    }

    fn body_jacobian(&mut self, body: &str) -> DMatrix<f64> {
        let all = self.inner.body_jacobian(body);
        all.select_columns(&self.layout.qvel)
    }

    fn set_base_wrench(&mut self, wrench: Wrench) {
        self.inner.set_base_wrench(wrench);
    }

    fn set_earlier_control(&mut self, control: &[f64]) {
        self.inner.set_earlier_control(control);
    }

    fn set_force(&mut self, force: &[f64]) {
        let mut all = vec![0.0; self.layout.nv];
        Layout::spread(&self.layout.qvel, force, &mut all);
        self.inner.set_force(&all);
    }

    fn prescribe(&mut self, motion: Option<Arc<PrescribedMotion>>) {
        let motion = motion.map(|motion| {
            let mut motion = (*motion).clone();
            for joint in &mut motion.joints {
                joint.qpos = self.layout.qpos[joint.qpos];
                joint.dof = self.layout.qvel[joint.dof];
            }
            Arc::new(motion)
        });
        self.inner.prescribe(motion);
    }

    fn step(&mut self) {
        self.inner.step();
        self.fold();
    }

    fn remember(&mut self, next: &[f64]) {
        let all = self.whole(next);
        self.inner.remember(&all);
        self.fold();
    }

    fn look(&mut self) {
        self.inner.look();
    }

    fn reading_lead(&self) -> f64 {
        self.inner.reading_lead()
    }

    fn sensors(&self) -> &[f64] {
        self.inner.sensors()
    }

    fn diverged(&self) -> bool {
        self.inner.diverged()
    }
}
