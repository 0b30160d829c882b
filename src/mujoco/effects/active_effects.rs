//! The effects that a simulation of `hydro gap` adds to its model, while it steps on this thread.
//!
//! They belong to the thread: MuJoCo's passive callback is one for the process, and applies what the thread
//! that it runs on has set here. Results therefore do not depend on how many threads step.

use std::{cell::Cell, ptr::null};

use crate::plugin::Bound;

/// Effects and changes that are added to a model.
#[derive(Debug, Default)]
pub(crate) struct ActiveEffects {
    /// Effects.
    pub(crate) bound: Bound,
    /// Their memory.
    pub(crate) memory: Vec<f64>,
    /// Factors on the wrench of a nominal's checkpoint: force x y z, torque x y z.
    pub(crate) wrench_scale: Option<[f64; 6]>,
    /// Steps by which commands act early.
    pub(crate) command_lead: f64,
    /// Part of a trial's first commands that memories are led through before its log.
    pub(crate) commands_before: f64,
    /// Part of a step's last jump that forces show inside it.
    pub(crate) reading_lead: f64,
    /// Effects that the nominal's instances have, with nuisance parameters turned.
    pub(crate) nominal: Vec<(usize, Bound)>,
    /// Bodies whose centre of mass was moved: buoyancy stays where it was. Number, way of the centre of
    /// mass in the body's frame [m], and buoyancy over gravity [kg].
    pub(crate) moved_centres: Vec<(usize, [f64; 3], f64)>,
}

thread_local! {
    static CURRENT: Cell<*const ActiveEffects> = const { Cell::new(null()) };
}

/// Runs `step` with `active` as what this thread's simulation adds.
pub(crate) fn with_active<T>(active: &ActiveEffects, step: impl FnOnce() -> T) -> T {
    struct Restore(*const ActiveEffects);
    impl Drop for Restore {
        fn drop(&mut self) {
            CURRENT.set(self.0);
        }
    }
    let _restore = Restore(CURRENT.replace(active));
    step()
}

/// The active effects of this thread, if it steps a simulation of `hydro gap`.
pub(crate) fn current<'a>() -> Option<&'a ActiveEffects> {
    // SAFETY: set by `with_active` alone, whose argument outlives all that runs inside it; callers are
    // MuJoCo's callbacks and keep nothing.
    unsafe { CURRENT.get().as_ref() }
}
