//! What a simulation of `hydro gap` adds to the model, while it steps on this thread.
//!
//! MuJoCo's passive callback is one for the process. It is set once; what it applies is that of the
//! simulation which this thread steps, and nothing where it steps none. So results do not depend on how
//! many threads step.

use std::{
    cell::Cell,
    ffi::c_int,
    ptr::null,
    sync::{
        Once,
        atomic::{AtomicPtr, Ordering},
    },
};

use super::{
    api::Api,
    bindings::{mjData, mjModel},
    boundary::guard,
    effect_forces, wrench,
};
use crate::plugin::Bound;

/// What is added to a model.
#[derive(Debug, Default)]
pub(super) struct Run {
    /// Effects.
    pub(super) bound: Bound,
    /// Their memory.
    pub(super) memory: Vec<f64>,
    /// Factors on the wrench of a nominal's checkpoint: force x y z, torque x y z.
    pub(super) wrench_scale: Option<[f64; 6]>,
    /// Steps by which commands act early.
    pub(super) command_lead: f64,
    /// Part of a step's last jump that forces show inside it.
    pub(super) reading_lead: f64,
    /// Effects that the nominal's instances have, with nuisance parameters turned.
    pub(super) nominal: Vec<(usize, Bound)>,
    /// Bodies whose centre of mass was moved: buoyancy stays where it was. Number, way of the centre of
    /// mass in the body's frame [m], and buoyancy over gravity [kg].
    pub(super) moved_centres: Vec<(usize, [f64; 3], f64)>,
}

type Passive = unsafe extern "C" fn(*const mjModel, *mut mjData);

static INSTALLED: Once = Once::new();

/// A callback that was installed before ours; it is called first.
static EARLIER: AtomicPtr<()> = AtomicPtr::new(std::ptr::null_mut());

thread_local! {
    static CURRENT: Cell<*const Run> = const { Cell::new(null()) };
}

/// Sets the passive callback, once.
pub(super) fn install(api: &Api) {
    INSTALLED.call_once(|| {
        // SAFETY: `mjcb_passive` is a nullable function pointer of this type.
        let Some(slot) = (unsafe { api.variable::<Option<Passive>>(b"mjcb_passive\0") }) else {
            return;
        };
        // SAFETY: the variable's address; `Once` keeps other threads of ours away, and models are
        // stepped only after a plant was made.
        unsafe {
            if let Some(other) = *slot {
                EARLIER.store(other as *mut (), Ordering::Relaxed);
            }
            *slot = Some(passive);
        }
    });
}

/// Runs `step` with `run` as what this thread's simulation adds.
pub(super) fn with_run<T>(run: &Run, step: impl FnOnce() -> T) -> T {
    struct Restore(*const Run);
    impl Drop for Restore {
        fn drop(&mut self) {
            CURRENT.set(self.0);
        }
    }
    let _restore = Restore(CURRENT.replace(run));
    step()
}

/// What this thread's simulation adds.
pub(super) fn current<'a>() -> Option<&'a Run> {
    // SAFETY: set by `with_run` alone, whose argument outlives all that runs inside it; callers are
    // MuJoCo's callbacks and keep nothing.
    unsafe { CURRENT.get().as_ref() }
}

unsafe extern "C" fn passive(m: *const mjModel, d: *mut mjData) {
    let earlier = EARLIER.load(Ordering::Relaxed);
    if !earlier.is_null() {
        // SAFETY: stored from a function pointer of this type.
        unsafe { std::mem::transmute::<*mut (), Passive>(earlier)(m, d) };
    }
    if CURRENT.get().is_null() {
        return;
    }
    guard("passive callback", (), || {
        // SAFETY: MuJoCo passes a model and a data of it that live through the call.
        let Some(mut data) = (unsafe { wrench::both(m, d) }) else {
            return;
        };
        effect_forces::add_once(&mut data, None::<c_int>.map(|id| id as usize));
    });
}
