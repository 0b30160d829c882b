//! An engine that is held within what it was trained on: see [`crate::envelope`].

use crate::{
    checkpoint::Card,
    envelope::{Envelope, Limits},
    model::{Engine, Scratch},
};

/// How many times the range of its training a model is asked in that is given closed forms of the water's force (the range
/// of forces grows by the square): what it learned to weigh goes on to hold. Open loop, on Task 2 at speeds beyond
/// (`gen_task2.py --regime speeds`), nRMSE of such a perceptron was 0.31 with this, 0.31 if asked anywhere, and 0.48 if held
/// to the range itself; without closed forms an LSTM's was 0.72 held to the range and 0.80 if asked anywhere.
const CLOSED_FORMS_REACH: f64 = 2.0;

/// Most components of a wrench.
const MOST_OUTPUTS: usize = 6;

/// The engine of a card, held within the card's envelope where it has one.
pub(super) fn guarded(engine: Box<dyn Engine>, card: &Card) -> Box<dyn Engine> {
    match &card.envelope {
        Some(envelope) if engine.outputs() <= MOST_OUTPUTS => {
            let limits = Limits::new(reach(envelope, card), &card.features, &card.outputs);
            Box::new(Guarded { engine, limits })
        }
        _ => engine,
    }
}

fn reach(envelope: &Envelope, card: &Card) -> Envelope {
    if card.model.encoding().has_closed_forms() {
        envelope.clone().widened(CLOSED_FORMS_REACH)
    } else {
        envelope.clone()
    }
}

/// An engine with drag for what is beyond its limits.
///
/// Its memory is the drag at the newest sample [f], that at the one before [f], the newest sample as the engine was given
/// it [n], and the engine's own.
#[derive(Debug)]
struct Guarded {
    engine: Box<dyn Engine>,
    limits: Limits,
}

impl Guarded {
    fn parts<'a>(&self, memory: &'a mut [f64]) -> [&'a mut [f64]; 4] {
        let (drag, rest) = memory.split_at_mut(self.outputs());
        let (before, rest) = rest.split_at_mut(self.outputs());
        let (held, inner) = rest.split_at_mut(self.inputs());
        [drag, before, held, inner]
    }
}

impl Engine for Guarded {
    fn inputs(&self) -> usize {
        self.engine.inputs()
    }

    fn outputs(&self) -> usize {
        self.engine.outputs()
    }

    fn memory_len(&self) -> usize {
        2 * self.outputs() + self.inputs() + self.engine.memory_len()
    }

    fn start(&self, x: &[f64], force: &[f64], memory: &mut [f64], scratch: &mut Scratch) {
        let [drag, before, held, inner] = self.parts(memory);
        self.limits.drag(x, drag);
        before.fill(0.0);
        held.copy_from_slice(x);
        self.limits.hold(held);
        self.engine.start(held, force, inner, scratch);
    }

    fn observe(&self, x: &[f64], memory: &mut [f64], scratch: &mut Scratch) {
        let [drag, before, held, inner] = self.parts(memory);
        before.copy_from_slice(drag);
        self.limits.drag(x, drag);
        held.copy_from_slice(x);
        self.limits.hold(held);
        self.engine.observe(held, inner, scratch);
    }

    fn sample(
        &self,
        memory: &[f64],
        force: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let (drag, rest) = memory.split_at(self.outputs());
        let (before, rest) = rest.split_at(self.outputs());
        // In what was carried here is the drag of the sample before, which is not the network's.
        let mut carried = [0.0; MOST_OUTPUTS];
        let carried = &mut carried[..force.len()];
        for ((carried, force), before) in carried.iter_mut().zip(force).zip(before) {
            *carried = force - before;
        }
        let inner = &rest[self.inputs()..];
        self.engine.sample(inner, carried, now, next, scratch);
        for forces in [now, next] {
            self.limits.hold_force(forces);
            for (force, drag) in forces.iter_mut().zip(drag) {
                *force += drag;
            }
        }
    }

    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch) {
        let mut held = x.to_vec();
        self.limits.hold(&mut held);
        self.engine.estimate(&held, force, scratch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::FeatureLayout;

    /// Predicts the next force: the one before and ten times the speed. Its memory is the speed.
    #[derive(Debug)]
    struct Pump;

    impl Engine for Pump {
        fn inputs(&self) -> usize {
            1
        }
        fn outputs(&self) -> usize {
            1
        }
        fn memory_len(&self) -> usize {
            1
        }
        fn start(&self, x: &[f64], _: &[f64], memory: &mut [f64], _: &mut Scratch) {
            memory.copy_from_slice(x);
        }
        fn observe(&self, x: &[f64], memory: &mut [f64], _: &mut Scratch) {
            memory.copy_from_slice(x);
        }
        fn sample(
            &self,
            memory: &[f64],
            force: &[f64],
            now: &mut [f64],
            next: &mut [f64],
            _: &mut Scratch,
        ) {
            now.copy_from_slice(force);
            next[0] = force[0] + 10.0 * memory[0];
        }
        fn estimate(&self, x: &[f64], force: &mut [f64], _: &mut Scratch) {
            force[0] = x[0];
        }
    }

    fn pump() -> Guarded {
        let layout: FeatureLayout =
            serde_json::from_str(r#"["linear_velocity.x"]"#).expect("a layout");
        let envelope = Envelope {
            least: vec![-1.0],
            most: vec![1.0],
            least_force: vec![-100.0],
            most_force: vec![100.0],
        };
        Guarded {
            engine: Box::new(Pump),
            limits: Limits::new(envelope, &layout, &["force.x".to_owned()]),
        }
    }

    /// Forces at the samples, and what is carried from the last.
    fn run(engine: &dyn Engine, speeds: &[f64]) -> (Vec<f64>, f64) {
        let mut scratch = Scratch::default();
        let mut memory = vec![0.0; engine.memory_len()];
        let (mut carried, mut forces) = (0.0, Vec::new());
        for (index, speed) in speeds.iter().enumerate() {
            if index == 0 {
                engine.start(&[*speed], &[carried], &mut memory, &mut scratch);
            } else {
                engine.observe(&[*speed], &mut memory, &mut scratch);
            }
            let (mut now, mut next) = ([0.0], [0.0]);
            engine.sample(&memory, &[carried], &mut now, &mut next, &mut scratch);
            forces.push(now[0]);
            carried = next[0];
        }
        (forces, carried)
    }

    #[test]
    fn inside_its_range_it_is_the_engine_itself() {
        let speeds = [0.1, -1.0, 0.7, 1.0, -0.3];
        assert_eq!(run(&pump(), &speeds), run(&Pump, &speeds));
    }

    #[test]
    fn outside_the_drag_is_added_once_and_not_carried_on() {
        // 2 m/s is half a width outside: the drag is all of 100 N, the network is told 1 m/s.
        let (forces, carried) = run(&pump(), &[0.5, 2.0, 2.0, 0.5]);
        assert_eq!(forces, [0.0, 5.0 - 100.0, 15.0 - 100.0, 25.0]);
        assert_eq!(carried, 30.0);
    }

    #[test]
    fn its_force_stays_within_what_was_shown() {
        let (forces, carried) = run(&pump(), &[1.0; 30]);
        assert_eq!((forces[9], forces[29], carried), (90.0, 100.0, 100.0));
        let mut force = [0.0];
        pump().estimate(&[7.0], &mut force, &mut Scratch::default());
        assert_eq!(force, [1.0]);
    }
}
