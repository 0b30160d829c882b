#![allow(clippy::unwrap_used)]
use hydro_model::{
    envelope::{Envelope, Limits},
    features::FeatureLayout,
};

use super::{network::limits, *};
use crate::plugin::{Base, search_path::SearchPath};

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

/// The range of a pump that was trained from -1 to 1 m/s, and from -100 to 100 N.
fn range() -> Limits {
    let envelope = Envelope {
        least: vec![-1.0],
        most: vec![1.0],
        least_force: vec![-100.0],
        most_force: vec![100.0],
    };
    Limits::new(envelope, &layout(), &["force.x".to_owned()])
}

fn layout() -> FeatureLayout {
    serde_json::from_str(r#"["linear_velocity.x"]"#).unwrap()
}

/// A pump on a slide, sampled at every step of 10 ms.
fn pump(limits: Limits, initial_force: InitialForce) -> LearnedWrench {
    let text = |name| {
        (name == "effects").then(|| r#"{"schema":"hydro-effects/1","effects":[]}"#.to_owned())
    };
    let settings = Settings::parse(text, &SearchPath::default()).unwrap();
    let body = Body {
        name: "hull".to_owned(),
        base: Base::Gantry {
            world_from_base: [1.0, 0.0, 0.0, 0.0],
            slides: vec![(0, [1.0, 0.0, 0.0])],
        },
        joints: Vec::new(),
    };
    LearnedWrench {
        settings: Settings {
            initial_force,
            ..settings
        },
        features: FeatureMap::new(&layout(), &[], None, &body, 1000.0, [0.0; 3]).unwrap(),
        network: Network {
            engine: Arc::new(Pump),
            limits,
        },
        places: vec![OutputPlace::Component(0)],
        sample_period: 0.01,
        residual: false,
        density_notice: None,
        control_notice: None,
    }
}

/// Forces at the samples, and the one that the last is followed by.
fn run(learned: &LearnedWrench, speeds: &[f64]) -> (Vec<f64>, f64) {
    let mut state = vec![0.0; learned.state_len()];
    LearnedWrench::reset(&mut state);
    let forces = speeds.iter().enumerate().map(|(sample, speed)| {
        let qvel = [*speed];
        let moment = at(sample, &qvel);
        learned.follow_clock(&mut state, moment);
        learned.force(&state, moment).wrench.force[0]
    });
    (forces.collect(), state[FORCES + 1])
}

fn at(sample: usize, qvel: &[f64]) -> Moment<'_> {
    Moment {
        time: 0.01 * sample as f64,
        timestep: 0.01,
        runge_kutta: false,
        qpos: &[0.0],
        qvel,
        water: [0.0; 3],
    }
}

fn from_rest() -> InitialForce {
    InitialForce::Given(vec![0.0])
}

fn close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (one, other) in found.iter().zip(expected) {
        assert!((one - other).abs() < 1e-9, "{found:?}, not {expected:?}");
    }
}

#[test]
fn inside_its_range_it_is_the_engine_itself() {
    let speeds = [0.1, -1.0, 0.7, 1.0, -0.3];
    let held = run(&pump(range(), from_rest()), &speeds);
    assert_eq!(held, run(&pump(Limits::default(), from_rest()), &speeds));
    close(&held.0, &[0.0, 1.0, -9.0, -2.0, 8.0]);
}

#[test]
fn outside_the_drag_is_added_once_and_not_carried_on() {
    // 2 m/s is half a width outside: the drag is all of 100 N, the network is told 1 m/s.
    let (forces, carried) = run(&pump(range(), from_rest()), &[0.5, 2.0, 2.0, 0.5]);
    close(&forces, &[0.0, 5.0 - 100.0, 15.0 - 100.0, 25.0]);
    close(&[carried], &[30.0]);
    // From the first sample on.
    let (forces, _) = run(&pump(range(), from_rest()), &[2.0, 0.5]);
    close(&forces, &[-100.0, 10.0]);
}

#[test]
fn being_out_of_range_is_told_once_a_start() {
    let learned = pump(range(), from_rest());
    let mut state = vec![0.0; learned.state_len()];
    let speeds = [0.5, 1.0, 2.0, 0.5, 3.0];
    for _ in 0..2 {
        LearnedWrench::reset(&mut state);
        let told: Vec<_> = speeds
            .iter()
            .enumerate()
            .map(|(sample, speed)| learned.follow_clock(&mut state, at(sample, &[*speed])))
            .collect();
        let Some(Notice::OutOfRange(excess)) = &told[2] else {
            panic!("{told:?}");
        };
        assert_eq!((excess.found, excess.range), (2.0, (-1.0, 1.0)));
        assert_eq!(told.iter().flatten().count(), 1, "{told:?}");
        let text = told[2].clone().unwrap().text(0.02, 0.01, 0.01);
        for part in [
            "`linear_velocity.x` is 2.000 m/s at t = 0.02 s",
            "outside the training range -1.000 to 1.000",
        ] {
            assert!(text.contains(part), "{text}");
        }
    }
}

#[test]
fn its_force_stays_within_what_was_shown() {
    let (forces, carried) = run(&pump(range(), from_rest()), &[1.0; 30]);
    close(&[forces[9], forces[29], carried], &[90.0, 100.0, 100.0]);
    let (forces, _) = run(&pump(range(), InitialForce::Estimate), &[0.7]);
    close(&forces, &[0.7]);
    // What the network starts from is held as well.
    let given = InitialForce::Given(vec![1e6]);
    close(
        &run(&pump(range(), given), &[-1.0; 3]).0,
        &[100.0, 90.0, 80.0],
    );
    // 7 m/s: 6 half widths outside, and an estimate for 1 m/s.
    let (forces, _) = run(&pump(range(), InitialForce::Estimate), &[7.0]);
    close(&forces, &[1.0 - 100.0 * 11.0]);
}

#[test]
fn an_infinite_force_is_a_fault_and_no_great_one() {
    let burst = InitialForce::Given(vec![f64::MAX]);
    let wide = Envelope {
        least: vec![-f64::MAX],
        most: vec![f64::MAX],
        least_force: vec![-f64::MAX],
        most_force: vec![f64::MAX],
    };
    let learned = pump(Limits::new(wide, &layout(), &["force.x".to_owned()]), burst);
    let mut state = vec![0.0; learned.state_len()];
    assert_eq!(
        learned.follow_clock(&mut state, at(0, &[1e307])),
        Some(Notice::NotFinite)
    );
    assert_eq!(
        learned.force(&state, at(0, &[1e307])),
        LearnedForce::default()
    );
}

#[test]
fn closed_forms_are_asked_in_twice_the_range() {
    let models = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    for (name, factor) in [("b1-task2", 1.0), ("b1-relaxation", 2.0)] {
        let card = Checkpoint::load(&models.join(name)).unwrap().card;
        let wide = card.envelope.clone().unwrap().widened(factor);
        let (mut x, mut force) = (vec![1e4; card.features.len()], vec![-1e9; 6]);
        limits(&card).hold(&mut x);
        limits(&card).hold_force(&mut force);
        // The last is the density; the six before it, the base's velocities.
        assert_eq!(x[28..34], wide.most[28..34], "{name}");
        assert_eq!(force, wide.least_force, "{name}");
    }
}
