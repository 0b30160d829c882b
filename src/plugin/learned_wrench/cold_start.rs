//! The first sample of a run, remembered from `compute` to `advance` of the same step.
//!
//! A run's first sample is the state at the *start* of its first step. `compute` sees that state but
//! must not write memory; `advance`, which may, sees only the state at the step's end. So `compute`
//! leaves a note here, on the thread that runs both. The note is a pure function of the state it was
//! made from; a missing one costs one step of delay, never a wrong force.

use std::cell::RefCell;

/// Notes kept a thread; the oldest goes first. A scene holds far fewer cold instances at once.
const CAPACITY: usize = 256;

/// Largest distance of a stage's time from that of Runge-Kutta, as a part of the step.
const STAGE_TOLERANCE: f64 = 1e-6;

/// Address of an instance's state: one for each pair of instance and `mjData`.
pub(super) type Place = usize;

/// The first sample of a run, with the forces at it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Start {
    /// Time of the sample [s].
    pub(super) time: f64,
    /// The first sample [n].
    pub(super) sample: Vec<f64>,
    /// Force at the first sample [f].
    pub(super) now: Vec<f64>,
    /// Force one sample period later [f].
    pub(super) next: Vec<f64>,
    /// Drag of the velocities that are out of the network's range [f].
    pub(super) drag: Vec<f64>,
}

thread_local! {
    static NOTES: RefCell<Vec<(Place, Start)>> = const { RefCell::new(Vec::new()) };
}

/// Leaves a note, in place of an older one of the same place.
pub(super) fn remember(place: Place, start: Start) {
    NOTES.with_borrow_mut(|notes| {
        notes.retain(|(known, _)| *known != place);
        if notes.len() == CAPACITY {
            notes.remove(0);
        }
        notes.push((place, start));
    });
}

/// Reads the note of a place.
pub(super) fn with<T>(place: Place, read: impl FnOnce(&Start) -> T) -> Option<T> {
    NOTES.with_borrow(|notes| {
        notes
            .iter()
            .find(|(known, _)| *known == place)
            .map(|(_, start)| read(start))
    })
}

/// Takes the note of a place away.
pub(super) fn take(place: Place) -> Option<Start> {
    NOTES.with_borrow_mut(|notes| {
        let at = notes.iter().position(|(known, _)| *known == place)?;
        Some(notes.remove(at).1)
    })
}

/// True where `time` is that of an inner stage of the Runge-Kutta step that began at `start`.
pub(super) fn is_inner_stage(start: f64, time: f64, timestep: f64) -> bool {
    let after = (time - start) / timestep;
    [0.5, 1.0]
        .iter()
        .any(|stage| (after - stage).abs() < STAGE_TOLERANCE)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_note_is_replaced_read_and_taken_once() {
        let at = |time| Start {
            time,
            ..Start::default()
        };
        remember(1, at(0.0));
        remember(2, at(5.0));
        remember(1, at(1.0));
        assert_eq!(with(1, |start| start.time), Some(1.0));
        assert_eq!(take(1).unwrap().time, 1.0);
        assert_eq!(take(1), None);
        assert_eq!(take(2).unwrap().time, 5.0);
    }

    #[test]
    fn memory_is_bounded() {
        for place in 0..2 * CAPACITY {
            remember(place, Start::default());
        }
        assert_eq!(NOTES.with_borrow(Vec::len), CAPACITY);
        assert!(with(0, |_| ()).is_none() && with(2 * CAPACITY - 1, |_| ()).is_some());
    }

    #[test]
    fn stages_are_those_of_the_classical_tableau() {
        assert!(is_inner_stage(1.0, 1.001, 0.002) && is_inner_stage(1.0, 1.002, 0.002));
        assert!(!is_inner_stage(1.0, 1.0, 0.002) && !is_inner_stage(1.0, 1.0015, 0.002));
    }
}
