//! The network within the range that it was trained in.
//!
//! Its velocities are held to that range, its forces to those that it was shown, and a drag acts on what is left of a
//! velocity outside (see [`hydro_model::envelope`]).

use std::sync::Arc;

use hydro_model::{
    Engine, Scratch,
    checkpoint::Card,
    envelope::{Excess, Limits},
};

use super::moment::finite;
use crate::plugin::attributes::InitialForce;

/// Factor on the training range for a model that is given closed forms of the water's force (the range
/// of forces grows by the square): what it learned to weigh goes on to hold. Open loop, on Task 2 at speeds beyond
/// (`gen_task2.py --regime speeds`), nRMSE of such a perceptron was 0.31 with this, 0.31 if asked anywhere, and 0.48 if held
/// to the range itself; without closed forms an LSTM's was 0.72 held to the range and 0.80 if asked anywhere.
const CLOSED_FORMS_REACH: f64 = 2.0;

/// Forces [f] at one sample, to be written.
pub(super) struct Forces<'a> {
    /// At the sample [N, N m].
    pub(super) now: &'a mut [f64],
    /// One sample period later.
    pub(super) next: &'a mut [f64],
    /// Drag of the velocities out of range, at the sample.
    pub(super) drag: &'a mut [f64],
}

/// A prediction that is no number.
pub(super) struct NotFinite;

/// An engine, and the range that it is held to.
#[derive(Debug)]
pub(super) struct Network {
    pub(super) engine: Arc<dyn Engine>,
    pub(super) limits: Limits,
}

impl Network {
    pub(super) fn new(engine: Arc<dyn Engine>, card: &Card) -> Self {
        Self {
            engine,
            limits: limits(card),
        }
    }

    /// The velocity of `sample` [n] furthest out of its range, if one is.
    pub(super) fn excess(&self, sample: &[f64]) -> Option<Excess> {
        self.limits.excess(sample)
    }

    /// Forces at the first sample [n] of a run; `carried` [f] becomes the force before it.
    pub(super) fn first(
        &self,
        sample: &[f64],
        initial: &InitialForce,
        carried: &mut [f64],
        forces: Forces<'_>,
        scratch: &mut Scratch,
    ) -> Result<(), NotFinite> {
        let mut memory = vec![0.0; self.engine.memory_len()];
        self.forces_at(
            &mut sample.to_vec(),
            &mut memory,
            carried,
            forces,
            scratch,
            |engine, held, memory, carried, scratch| {
                match initial {
                    InitialForce::Given(force) => carried.copy_from_slice(force),
                    InitialForce::Estimate => engine.estimate(held, carried, scratch),
                }
                self.limits.hold_force(carried);
                engine.start(held, carried, memory, scratch);
            },
        )
    }

    /// Fills the memory for a run that starts with this sample [n] and this force [f].
    pub(super) fn start(
        &self,
        sample: &[f64],
        force: &[f64],
        memory: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let mut held = sample.to_vec();
        self.limits.hold(&mut held);
        self.engine.start(&held, force, memory, scratch);
    }

    /// Forces at the next sample [n], which is held to the range, after the force `carried` [f].
    pub(super) fn next(
        &self,
        sample: &mut [f64],
        memory: &mut [f64],
        carried: &mut [f64],
        forces: Forces<'_>,
        scratch: &mut Scratch,
    ) -> Result<(), NotFinite> {
        self.forces_at(
            sample,
            memory,
            carried,
            forces,
            scratch,
            |engine, held, memory, _, scratch| {
                engine.observe(held, memory, scratch);
            },
        )
    }

    /// Drag, hold, `tell` the engine of the held sample, ask it for forces, check, hold.
    fn forces_at(
        &self,
        sample: &mut [f64],
        memory: &mut [f64],
        carried: &mut [f64],
        Forces { now, next, drag }: Forces<'_>,
        scratch: &mut Scratch,
        tell: impl FnOnce(&dyn Engine, &[f64], &mut [f64], &mut [f64], &mut Scratch),
    ) -> Result<(), NotFinite> {
        self.limits.drag(sample, drag);
        self.limits.hold(sample);
        tell(&*self.engine, sample, memory, carried, scratch);
        self.engine.sample(memory, carried, now, next, scratch);
        // Checked before they are held: an infinite force would become a large one.
        if !finite(now) || !finite(next) || !finite(drag) {
            return Err(NotFinite);
        }
        self.limits.hold_force(now);
        self.limits.hold_force(next);
        Ok(())
    }
}

/// The range of a card's network; unlimited where the card has no `envelope`.
pub(super) fn limits(card: &Card) -> Limits {
    let Some(envelope) = card.envelope.clone() else {
        return Limits::default();
    };
    let reach = match card.model.encoding().has_closed_forms() {
        true => envelope.widened(CLOSED_FORMS_REACH),
        false => envelope,
    };
    Limits::new(reach, &card.features, &card.outputs)
}
