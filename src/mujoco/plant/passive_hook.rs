//! MuJoCo's passive callback, through which a simulation of `hydro gap` gets its effects.
//!
//! It is one for the process and is set once. What it applies are the active effects of the thread that steps;
//! where a thread has none, nothing.

use std::sync::{
    Once,
    atomic::{AtomicPtr, Ordering},
};

use crate::mujoco::{
    effects::active_effects,
    ffi::{
        Api, DataView,
        bindings::{mjData, mjModel},
        guard,
    },
    wrench::instance_effects,
};

type Passive = unsafe extern "C" fn(*const mjModel, *mut mjData);

static INSTALLED: Once = Once::new();

/// A callback that was installed before ours; it is called first.
static EARLIER: AtomicPtr<()> = AtomicPtr::new(std::ptr::null_mut());

/// Sets the passive callback, once.
pub(crate) fn install(api: &Api) {
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

unsafe extern "C" fn passive(m: *const mjModel, d: *mut mjData) {
    let earlier = EARLIER.load(Ordering::Relaxed);
    if !earlier.is_null() {
        // SAFETY: stored from a function pointer of this type.
        unsafe { std::mem::transmute::<*mut (), Passive>(earlier)(m, d) };
    }
    if active_effects::current().is_none() {
        return;
    }
    guard("passive callback", (), || {
        // SAFETY: MuJoCo passes a model and a data of it that live through the call.
        let Some(mut data) = (unsafe { DataView::from_callback(m, d) }) else {
            return;
        };
        let effects = instance_effects::with_effects(&mut data);
        instance_effects::add_once(&mut data, &effects, None);
    });
}
