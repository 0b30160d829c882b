//! A thread's own handles of the instances it steps.
//!
//! MuJoCo asks for an instance by its key several times a step. Each thread therefore keeps what it was given by the
//! registry, so that a step takes no lock and writes no memory that another thread's step reads: with two threads in
//! `mujoco.batch` the registry's counters would go back and forth between the cores.

use std::{cell::RefCell, ops::Deref, rc::Rc, sync::Arc};

use super::{
    instance::Instance,
    registry::{InstanceKey, Registry},
};

/// An instance, held by this thread.
#[derive(Clone, Debug)]
#[expect(
    clippy::redundant_allocation,
    reason = "cloning counts in this thread's memory; the inner count is shared with others"
)]
pub struct Handle(Rc<Arc<Instance>>);

impl Handle {
    /// A handle of an instance that was just made.
    pub fn new(instance: Arc<Instance>) -> Self {
        Self(Rc::new(instance))
    }

    /// The instance of a key, where this process has made it.
    pub fn for_key(key: InstanceKey) -> Option<Self> {
        let registry = Registry::global();
        KNOWN.with_borrow_mut(|known| {
            let forgotten = registry.forgotten();
            if known.forgotten != forgotten {
                known.forgotten = forgotten;
                known.handles.clear();
            }
            if let Some((_, handle)) = known.handles.iter().find(|(of, _)| *of == key) {
                return Some(handle.clone());
            }
            let handle = Self::new(registry.get(key)?);
            known.handles.push((key, handle.clone()));
            Some(handle)
        })
    }
}

impl Deref for Handle {
    type Target = Instance;

    fn deref(&self) -> &Instance {
        &self.0
    }
}

/// This thread's handles; dropped when the registry has forgotten more than `forgotten` instances.
#[derive(Default)]
struct Known {
    forgotten: u64,
    handles: Vec<(InstanceKey, Handle)>,
}

thread_local! {
    static KNOWN: RefCell<Known> = RefCell::default();
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::plugin::Base;
    use crate::plugin::{Afloat, Body, Settings, search_path::SearchPath};

    /// An instance of effects alone, another for every density.
    fn made(density: usize) -> InstanceKey {
        let text = |name: &str| match name {
            "effects" => Some(r#"{"schema":"hydro-effects/1","effects":[]}"#.to_owned()),
            "density" => Some(density.to_string()),
            _ => None,
        };
        let settings = Settings::parse(text, &SearchPath::new(Vec::new())).unwrap();
        let body = Body {
            name: "hull".to_owned(),
            base: Base::Free { qpos: 0, dof: 0 },
            joints: Vec::new(),
        };
        {
            let registry = Registry::global();
            registry
                .acquire(settings, &body, None, Afloat::default())
                .unwrap()
                .0
        }
    }

    #[test]
    fn a_thread_keeps_what_is_used_and_lets_go_of_what_was_forgotten() {
        let (kept, gone) = (made(1001), made(1002));
        let handle = Handle::for_key(kept).unwrap();
        assert_eq!(handle.settings().density, 1001.0);
        // The same instance, by another thread's handle too.
        let address = std::ptr::from_ref::<Instance>(&handle) as usize;
        let other = std::thread::spawn(move || {
            let handle = Handle::for_key(kept).unwrap();
            std::ptr::from_ref::<Instance>(&handle) as usize
        });
        assert_eq!(other.join().unwrap(), address);

        let weak = Arc::downgrade(&Registry::global().get(gone).unwrap());
        assert!(Handle::for_key(gone).is_some());
        Registry::global().release(gone);
        for density in 2000..2020 {
            Registry::global().release(made(density));
        }
        assert!(Handle::for_key(gone).is_none(), "it was idle the longest");
        assert!(weak.upgrade().is_none(), "nobody holds it any more");
        assert!(Handle::for_key(kept).is_some());
        Registry::global().release(kept);
    }
}
