//! A simulation with backlash in joints, seen as one of the nominal model: the coordinates of the extra joints are
//! hidden.

use std::sync::Arc;

use hydro_frames::Wrench;
use hydro_gap::plant::{Simulation, prescribed::PrescribedMotion};
use nalgebra::DMatrix;

use super::{backlash::Backlash, simulation::MujocoSimulation};
use crate::mujoco::ffi::{ModelView, bindings::mjOBJ_JOINT};

/// Places of the nominal's coordinates among those of the model with backlash.
///
/// The nominal's coordinate of a joint with backlash is that of the body, `q_joint + s`: what moves beyond the joint then
/// moves as in the nominal, and `s` is a memory. The joint's own sensors and its servo have `q_joint`.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    qpos: Vec<usize>,
    qvel: Vec<usize>,
    /// Lengths with the extra ones.
    nq: usize,
    nv: usize,
    played: Vec<Played>,
}

/// Coordinates of a joint, in the nominal's order, and of the extra joint behind it, in the other model's.
#[derive(Clone, Copy, Debug)]
struct Played {
    qpos: usize,
    qvel: usize,
    extra_qpos: usize,
    extra_qvel: usize,
}

impl Layout {
    /// The layout, and the numbers of the extra joints in the order of `backlashes`.
    pub(crate) fn new(
        nominal: ModelView<'_>,
        extended: ModelView<'_>,
        backlashes: &[Backlash],
    ) -> (Self, Vec<usize>) {
        let id = mjOBJ_JOINT as i32;
        let pairs: Vec<(usize, usize)> = backlashes
            .iter()
            .filter_map(|of| Some((nominal.id(id, &of.joint)?, extended.id(id, &of.name())?)))
            .collect();
        let numbers = |model: ModelView<'_>| (model.raw().nq as usize, model.raw().nv as usize);
        let ((nq, nv), (all_q, all_v)) = (numbers(nominal), numbers(extended));
        let played: Vec<Played> = (pairs.iter())
            .map(|(joint, extra)| Played {
                qpos: nominal.jnt_qposadr()[*joint] as usize,
                qvel: nominal.jnt_dofadr()[*joint] as usize,
                extra_qpos: extended.jnt_qposadr()[*extra] as usize,
                extra_qvel: extended.jnt_dofadr()[*extra] as usize,
            })
            .collect();
        // An extra joint is a hinge or a slide: one coordinate each.
        let without = |all: usize, hidden: Vec<usize>| -> Vec<usize> {
            (0..all).filter(|at| !hidden.contains(at)).collect()
        };
        let layout = Self {
            qpos: without(all_q, played.iter().map(|of| of.extra_qpos).collect()),
            qvel: without(all_v, played.iter().map(|of| of.extra_qvel).collect()),
            nq: all_q,
            nv: all_v,
            played,
        };
        debug_assert_eq!((layout.qpos.len(), layout.qvel.len()), (nq, nv));
        (layout, pairs.into_iter().map(|(_, extra)| extra).collect())
    }

    /// Positions, then velocities, of the bodies behind backlash relative to their joints.
    fn play(&self, qpos: &[f64], qvel: &[f64]) -> Vec<f64> {
        let ways = self.played.iter().map(|of| qpos[of.extra_qpos]);
        let speeds = self.played.iter().map(|of| qvel[of.extra_qvel]);
        ways.chain(speeds).collect()
    }

    /// Puts a nominal's coordinates into the other model's, the bodies behind backlash at `play`.
    fn unfold(&self, [qpos, qvel]: [&[f64]; 2], play: &[f64], [q, v]: [&mut [f64]; 2]) {
        Self::spread(&self.qpos, qpos, q);
        Self::spread(&self.qvel, qvel, v);
        let (ways, speeds) = play.split_at(self.played.len());
        for ((of, way), speed) in self.played.iter().zip(ways).zip(speeds) {
            q[self.qpos[of.qpos]] -= way;
            q[of.extra_qpos] = *way;
            v[self.qvel[of.qvel]] -= speed;
            v[of.extra_qvel] = *speed;
        }
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
        let (qpos, qvel) = (self.inner.qpos(), self.inner.qvel());
        for (value, at) in self.qpos.iter_mut().zip(&self.layout.qpos) {
            *value = qpos[*at];
        }
        for (value, at) in self.qvel.iter_mut().zip(&self.layout.qvel) {
            *value = qvel[*at];
        }
        for of in &self.layout.played {
            self.qpos[of.qpos] += qpos[of.extra_qpos];
            self.qvel[of.qvel] += qvel[of.extra_qvel];
        }
    }

    fn play(&self) -> Vec<f64> {
        self.layout.play(self.inner.qpos(), self.inner.qvel())
    }

    /// A full-physics state of the nominal as one of the model with backlash; none for one of another length.
    fn whole(&self, state: &[f64], play: &[f64]) -> Vec<f64> {
        let (nq, nv) = (self.layout.qpos.len(), self.layout.qvel.len());
        if state.len() <= nq + nv {
            return Vec::new();
        }
        let (mut qpos, mut qvel) = (vec![0.0; self.layout.nq], vec![0.0; self.layout.nv]);
        let nominal = [&state[1..=nq], &state[1 + nq..1 + nq + nv]];
        self.layout.unfold(nominal, play, [&mut qpos, &mut qvel]);
        [&state[..1], &qpos, &qvel, &state[1 + nq + nv..]].concat()
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
        let middle = vec![0.0; 2 * self.layout.played.len()];
        let all = self.whole(state, &middle);
        self.inner.restart(&all);
        self.fold();
    }

    fn rejoin(&mut self, state: &[f64]) {
        let all = self.whole(state, &self.play());
        self.inner.rejoin(&all);
        self.fold();
    }

    fn set_motion(&mut self, time: f64, qpos: &[f64], qvel: &[f64]) {
        let (mut all_q, mut all_v) = (self.inner.qpos().to_vec(), self.inner.qvel().to_vec());
        let play = self.play();
        let all = [&mut all_q[..], &mut all_v[..]];
        self.layout.unfold([qpos, qvel], &play, all);
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

    fn commands_before(&self) -> f64 {
        self.inner.commands_before()
    }

    /// That of the effects, and where the bodies are in their backlash.
    fn memory(&self) -> Vec<f64> {
        [self.inner.memory(), self.play()].concat()
    }

    fn hidden(&self) -> usize {
        2 * self.layout.played.len()
    }

    fn set_memory(&mut self, memory: &[f64]) {
        let Some((of_effects, play)) =
            (memory.len().checked_sub(self.hidden())).map(|at| memory.split_at(at))
        else {
            return;
        };
        self.inner.set_memory(of_effects);
        let (mut qpos, mut qvel) = (self.inner.qpos().to_vec(), self.inner.qvel().to_vec());
        let all = [&mut qpos[..], &mut qvel[..]];
        self.layout.unfold([&self.qpos, &self.qvel], play, all);
        self.inner.set_motion(self.inner.time(), &qpos, &qvel);
        self.fold();
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
        for of in &self.layout.played {
            all[of.extra_qvel] = force[of.qvel];
        }
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
