//! Currents: profile, random part, refusals.

use proptest::prelude::*;

use crate::sea::CurrentField;

const RANDOM: &str = r#"{"schema": "hydro-current/1", "velocity": [0.3, 0, 0],
    "random": {"deviation": [0.1, 0.2, 0], "time_constant": 30, "seed": 1}}"#;

fn current(text: &str) -> CurrentField {
    CurrentField::parse(text).expect("a current")
}

fn start(current: &CurrentField) -> Vec<f64> {
    let mut state = vec![0.0; current.state_len()];
    current.reset(&mut state);
    state
}

#[test]
fn a_constant_current_is_the_same_everywhere() {
    let field = current(r#"{"schema": "hydro-current/1", "velocity": [0.3, -0.2, 0.05]}"#);
    assert_eq!(
        field,
        CurrentField::uniform([0.3, -0.2, 0.05]).expect("a current")
    );
    assert_eq!(field.state_len(), 0);
    for depth in [-1.0, 0.0, 7.0, 1e9, f64::NAN] {
        assert_eq!(
            field.velocity([1e6, -3.0], depth, 7.0, &[]),
            [0.3, -0.2, 0.05]
        );
    }
    let mut nothing = [];
    field.reset(&mut nothing);
    field.advance(&mut nothing, 0.01);
}

#[test]
fn a_profile_is_linear_between_its_points_and_constant_outside() {
    let field = current(
        r#"{"schema": "hydro-current/1", "profile": [{"depth": 1, "velocity": [0.5, 0, 0]},
            {"depth": 3, "velocity": [0.1, 0.2, 0]}, {"depth": 10, "velocity": [0, 0, 0.7]}]}"#,
    );
    for (depth, expected) in [
        (-2.0, [0.5, 0.0, 0.0]),
        (1.0, [0.5, 0.0, 0.0]),
        (1.5, [0.4, 0.05, 0.0]),
        (3.0, [0.1, 0.2, 0.0]),
        (6.5, [0.05, 0.1, 0.35]),
        (10.0, [0.0, 0.0, 0.7]),
        (1e9, [0.0, 0.0, 0.7]),
        (f64::NAN, [0.5, 0.0, 0.0]),
    ] {
        for (found, expected) in field.mean([0.0; 2], depth, 0.0).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-15, "{depth}");
        }
    }
}

/// x y depth time, x fastest: what is linear in all four, and bilinear in x and y, comes back exactly.
#[test]
fn a_grid_is_multilinear_between_its_points_and_constant_outside() {
    let axes: [Vec<f64>; 4] = [
        vec![-10.0, 0.0, 30.0],
        vec![5.0, 15.0],
        vec![0.0, 2.0, 20.0],
        vec![100.0, 400.0],
    ];
    let law = |x: f64, y: f64, depth: f64, time: f64| {
        [
            0.01 * x + 0.02 * y - 0.03 * depth + 0.001 * time,
            1e-3 * x * y,
            0.1,
        ]
    };
    let mut velocities = Vec::new();
    for time in &axes[3] {
        for depth in &axes[2] {
            for y in &axes[1] {
                velocities.extend(axes[0].iter().map(|x| law(*x, *y, *depth, *time)));
            }
        }
    }
    let [x, y, depth, time] = &axes;
    let grid =
        serde_json::json!({"x": x, "y": y, "depth": depth, "time": time, "velocity": velocities});
    let text = serde_json::json!({"schema": "hydro-current/1", "grid": grid}).to_string();
    let field = current(&text);
    let close = |found: [f64; 3], expected: [f64; 3]| {
        let pairs = found.into_iter().zip(expected);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-12
    };
    for (x, y, depth, time) in [
        (-10.0, 5.0, 0.0, 100.0),
        (30.0, 15.0, 20.0, 400.0),
        (-3.0, 7.0, 1.0, 250.0),
        (29.0, 14.9, 19.0, 101.0),
    ] {
        let found = field.velocity([x, y], depth, time, &[]);
        assert!(close(found, law(x, y, depth, time)), "{found:?}");
    }
    let outside = field.velocity([-99.0, 99.0], -5.0, 1e9, &[]);
    assert!(close(outside, law(-10.0, 15.0, 0.0, 400.0)));
    let nowhere = field.velocity([f64::NAN; 2], f64::NAN, f64::NAN, &[]);
    assert!(nowhere.iter().all(|value| value.is_finite()));

    // An axis that is not there.
    let flat = r#"{"schema": "hydro-current/1", "grid": {"y": [0, 4], "velocity": [[0, 0, 0], [1, 0, 0]]}}"#;
    assert_eq!(
        current(flat).velocity([7.0, 1.0], 3.0, 9.0, &[]),
        [0.25, 0.0, 0.0]
    );
}

#[test]
fn every_refusal_of_a_grid_says_what_and_where() {
    let with = |fields: &str| {
        let text = format!(r#"{{"schema": "hydro-current/1", "grid": {fields}}}"#);
        CurrentField::parse(&text)
            .expect_err("it should be refused")
            .to_string()
    };
    let one = "[[1, 0, 0]]";
    assert!(with("3").contains("grid: found the number 3, expected an object"));
    assert!(with(r#"{"x": [0, 1]}"#).contains("grid: no `velocity`"));
    assert!(with(&format!(r#"{{"z": [0], "velocity": {one}}}"#)).contains("there is no `z`"));
    assert_eq!(
        with(&format!(r#"{{"x": [0, 1], "velocity": {one}}}"#)),
        "grid.velocity: found a list of 1, expected 2: x times y times depth times time, 2 x 1 x 1 x 1, x fastest"
    );
    assert_eq!(
        with(&format!(r#"{{"x": [1, 1], "velocity": {one}}}"#)),
        "grid.x[1]: found 1 m after 1 m, expected numbers that ascend"
    );
    assert_eq!(
        with(&format!(r#"{{"depth": [-1], "velocity": {one}}}"#)),
        "grid.depth[0]: found -1 m, expected 0 to 10000000 m"
    );
    assert!(with(&format!(r#"{{"time": ["a"], "velocity": {one}}}"#)).contains("grid.time[0]"));
    assert_eq!(
        with(r#"{"velocity": [[1, 0, 1e9]]}"#),
        "grid.velocity[0][2]: found 1e9 m/s, expected -100 to 100 m/s"
    );
    assert!(with(r#"{"velocity": [[1, 0]]}"#).contains("grid.velocity[0]: found a list of 2"));
    let axis: Vec<usize> = (0..2000).collect();
    let text = format!(r#"{{"x": {axis:?}, "y": {axis:?}, "velocity": {one}}}"#);
    assert_eq!(
        with(&text),
        "grid: found 4000000 points, expected at most 500000"
    );
}

/// Over 4000 time constants, by steps of a sixth of one.
#[test]
fn a_random_current_has_its_deviation_and_correlation() {
    let field = current(RANDOM);
    let mut state = start(&field);
    let (step, count) = (5.0, 24_000);
    let past: Vec<[f64; 3]> = (0..count)
        .map(|_| {
            field.advance(&mut state, step);
            let [x, y, z] = field.velocity([0.0; 2], 0.0, 0.0, &state);
            [x - 0.3, y, z]
        })
        .collect();
    for (axis, deviation) in [(0, 0.1), (1, 0.2)] {
        let product = |lag: usize| {
            let pairs = past.iter().zip(&past[lag..]);
            pairs.map(|(a, b)| a[axis] * b[axis]).sum::<f64>() / (count - lag) as f64
        };
        let variance = product(0);
        assert!(
            (variance / (deviation * deviation) - 1.0).abs() < 0.05,
            "{variance}"
        );
        for lag in [1, 6, 12] {
            let expected = (-(lag as f64) * step / 30.0).exp();
            let found = product(lag) / variance;
            assert!(
                (found - expected).abs() < 0.04,
                "{lag}: {found}, expected {expected}"
            );
        }
    }
    let across = past.iter().map(|v| v[0] * v[1]).sum::<f64>() / count as f64;
    assert!(across.abs() < 0.04 * 0.1 * 0.2);
    assert!(past.iter().all(|v| v[2] == 0.0));
}

/// A thousand seeds: the start and what comes after it are spread alike, whatever the step.
#[test]
fn a_random_current_is_stationary_from_the_start() {
    for steps in [[0.0, 0.0], [0.01, 0.01], [3.0, 40.0]] {
        let squares: f64 = (0..1000)
            .map(|seed| {
                let field = current(&RANDOM.replace("\"seed\": 1", &format!("\"seed\": {seed}")));
                let mut state = start(&field);
                steps
                    .into_iter()
                    .for_each(|step| field.advance(&mut state, step));
                (state[0] / 0.1).powi(2) + (state[1] / 0.2).powi(2)
            })
            .sum();
        assert!((squares / 2000.0 - 1.0).abs() < 0.1, "{squares}");
    }
}

#[test]
fn a_copied_or_restored_state_goes_on_with_the_same_bits() {
    let field = current(RANDOM);
    let mut state = start(&field);
    assert_eq!(state, start(&field));
    for _ in 0..1000 {
        field.advance(&mut state, 0.002);
    }
    let saved = state.clone();
    let on = |mut state: Vec<f64>| {
        for _ in 0..500 {
            field.advance(&mut state, 0.002);
        }
        state.into_iter().map(f64::to_bits).collect::<Vec<_>>()
    };
    let expected = on(state);
    // Another object, another thread.
    let again =
        std::thread::scope(|scope| scope.spawn(|| on(saved.clone())).join().expect("it ran"));
    assert_eq!(again, expected);
    assert_eq!(saved[3], 1001.0);
    let other = current(&RANDOM.replace("\"seed\": 1", "\"seed\": 2"));
    assert_ne!(start(&other), start(&field));
}

/// Bits that must never change, and the first numbers by NumPy, whose Philox counts before it draws:
///
/// ```text
/// import numpy as np; from math import *
/// def normal(c):
///     raw = np.random.Philox(counter=[c - 1, 0, 0, 0], key=[1, 2]).random_raw(4)
///     u = ((raw >> np.uint64(12)).astype(float) + 0.5)*2.0**-52
///     return [sqrt(-2*log(u[i]))*f(2*pi*u[i + 1]) for i, f in ((0, cos), (0, sin))]
/// v = [0.05, -0.1]; keep = exp(-2/30)
/// for c in 3, 4: v = [keep*v + d*sqrt(1 - keep**2)*n for v, d, n in zip(v, (0.1, 0.2), normal(c))]
/// print(v)
/// ```
#[test]
fn steps_as_computed_independently() {
    let field = current(RANDOM);
    let mut state = [0.05, -0.1, 0.0, 3.0];
    field.advance(&mut state, 2.0);
    field.advance(&mut state, 2.0);
    for (found, expected) in state.into_iter().zip([
        0.037_831_790_448_389_13,
        -0.055_230_329_159_880_66,
        0.0,
        5.0,
    ]) {
        assert!((found - expected).abs() < 1e-15, "{found}");
    }
    assert_eq!(
        state.map(f64::to_bits)[..2],
        [4585612956631510398, 13811492387164937868]
    );
}

#[test]
fn odd_steps_and_states_change_nothing() {
    let field = current(RANDOM);
    let mut state = start(&field);
    let before = state.clone();
    for step in [0.0, -1.0, f64::NAN] {
        field.advance(&mut state, step);
        assert_eq!(state, before);
    }
    let mut short = [1.0, 2.0];
    field.advance(&mut short, 0.1);
    field.reset(&mut short);
    assert_eq!(short, [1.0, 2.0]);
    assert_eq!(field.velocity([0.0; 2], 0.0, 0.0, &short), [0.3, 0.0, 0.0]);
    // A state of zeros is the start.
    let mut zeros = [0.0; 4];
    assert_eq!(
        field.velocity([0.0; 2], 2.0, 0.0, &zeros),
        field.velocity([0.0; 2], 2.0, 0.0, &before)
    );
    field.advance(&mut zeros, 0.1);
    field.advance(&mut state, 0.1);
    assert_eq!(zeros[..], state[..]);
}

/// Added everywhere from when it is set; steps leave it, a reset takes it back; beside a random part, which goes on as it would.
#[test]
fn what_a_program_sets_is_added_and_stays() {
    let alone = current(
        r#"{"schema": "hydro-current/1", "settable": true,
            "profile": [{"depth": 0, "velocity": [0.5, 0, 0]}, {"depth": 10, "velocity": [0.1, 0, 0]}]}"#,
    );
    let mut state = start(&alone);
    assert_eq!(state, [0.0; 3]);
    assert_eq!(alone.velocity([0.0; 2], 10.0, 0.0, &state), [0.1, 0.0, 0.0]);
    state.copy_from_slice(&[0.25, -0.5, 0.125]);
    alone.advance(&mut state, 0.1);
    assert_eq!(
        alone.velocity([3.0, 4.0], 0.0, 9.0, &state),
        [0.75, -0.5, 0.125]
    );
    assert_eq!(
        alone.velocity([0.0; 2], 20.0, 0.0, &state),
        [0.35, -0.5, 0.125]
    );
    alone.reset(&mut state);
    assert_eq!(state, [0.0; 3]);

    let random = current(RANDOM);
    let both = current(&RANDOM.replace("\"random\"", "\"settable\": true, \"random\""));
    let mut gusts = start(&random);
    let mut state = start(&both);
    assert_eq!(state[..4], gusts[..]);
    state[4..].copy_from_slice(&[1.0, 2.0, 3.0]);
    for _ in 0..10 {
        random.advance(&mut gusts, 0.1);
        both.advance(&mut state, 0.1);
    }
    assert_eq!(state[..4], gusts[..]);
    let without = random.velocity([0.0; 2], 0.0, 0.0, &gusts);
    let with = both.velocity([0.0; 2], 0.0, 0.0, &state);
    for (axis, (with, without)) in with.into_iter().zip(without).enumerate() {
        assert!((with - without - (axis + 1) as f64).abs() < 1e-12);
    }
    // What is no velocity counts as none.
    for odd in [f64::NAN, f64::INFINITY, 100.1] {
        let mut state = state.clone();
        state[5] = odd;
        assert_eq!(both.velocity([0.0; 2], 0.0, 0.0, &state), without);
    }
    // Memory as a simulation starts it: the random part draws, nothing is set.
    assert_eq!(
        both.velocity([0.0; 2], 0.0, 0.0, &[0.0; 7]),
        both.velocity([0.0; 2], 0.0, 0.0, &start(&both))
    );
    // A constant current has no such part unless it says so.
    assert_eq!(
        current(r#"{"schema": "hydro-current/1", "velocity": [1, 0, 0], "settable": false}"#)
            .state_len(),
        0
    );
}

#[test]
fn every_refusal_says_what_and_where() {
    let with = |fields: &str| {
        let text = format!(r#"{{"schema": "hydro-current/1", {fields}}}"#);
        CurrentField::parse(&text)
            .expect_err("it should be refused")
            .to_string()
    };
    let fault = |text: &str| CurrentField::parse(text).expect_err("refused").to_string();
    assert!(fault("0.3 0 0").starts_with("not JSON"));
    assert!(
        fault("[0.3, 0, 0]")
            .contains("found a list of 3, expected an object with `schema`: `hydro-current/1`")
    );
    assert!(fault(r#"{"schema": "hydro-waves/1"}"#).ends_with("expected `hydro-current/1`"));
    assert_eq!(
        fault(r#"{"schema": "hydro-current/1"}"#),
        "the file: no `velocity`, expected `velocity` or `profile` or `grid`"
    );
    assert_eq!(
        with(r#""velocity": [1, 0, 0], "profile": []"#),
        "the file: found both `velocity` and `profile`, expected one of them"
    );
    assert_eq!(
        with(r#""velocity": [1, 0, 0], "radnom": {}"#),
        "the file: there is no `radnom`; did you mean `random`?; there are: schema, velocity, profile, grid, random, \
         settable"
    );
    assert_eq!(
        with(r#""velocity": [1, 0]"#),
        "velocity: found a list of 2, expected three numbers [m/s], x y z"
    );
    assert_eq!(
        with(r#""velocity": [1, 0, "a"]"#),
        "velocity[2]: found the string `a`, expected a number [m/s]"
    );
    assert_eq!(
        with(r#""velocity": [1, 0, 1e6]"#),
        "velocity[2]: found 1000000 m/s, expected -100 to 100 m/s"
    );
    assert!(with(r#""velocity": 3"#).contains("velocity: found the number 3"));
    assert!(with(r#""profile": []"#).contains("expected a list of 1 to 1000 points"));
    assert!(
        with(r#""profile": [3]"#).contains("profile[0]: found the number 3, expected an object")
    );
    let point = |fields: &str| {
        with(&format!(
            r#""profile": [{{"depth": 2, "velocity": [1, 0, 0]}}, {{{fields}}}]"#
        ))
    };
    assert_eq!(
        point(r#""velocity": [1, 0, 0]"#),
        "profile[1]: no `depth`, expected a number [m]"
    );
    assert_eq!(
        point(r#""depth": 3"#),
        "profile[1]: no `velocity`, expected three numbers [m/s], x y z"
    );
    assert_eq!(
        point(r#""depth": 2, "velocity": [1, 0, 0]"#),
        "profile[1].depth: found 2 m after 2 m, expected depths that ascend"
    );
    assert_eq!(
        point(r#""depth": -2, "velocity": [1, 0, 0]"#),
        "profile[1].depth: found -2 m, expected 0 to 20000 m"
    );
    assert!(point(r#""z": -2, "velocity": [1, 0, 0]"#).contains("profile[1]: there is no `z`"));
    let random = |fields: &str| with(&format!(r#""velocity": [1, 0, 0], "random": {{{fields}}}"#));
    assert_eq!(
        random(r#""deviation": [1, 0, 0]"#),
        "random: no `time_constant`, expected a number [s]"
    );
    assert_eq!(
        random(r#""time_constant": 30"#),
        "random: no `deviation`, expected three numbers [m/s], x y z"
    );
    assert_eq!(
        random(r#""deviation": [-1, 0, 0], "time_constant": 30"#),
        "random.deviation[0]: found -1 m/s, expected 0 to 100 m/s"
    );
    assert_eq!(
        random(r#""deviation": [1, 0, 0], "time_constant": 0"#),
        "random.time_constant: found 0 s, expected 0.001 to 10000000 s"
    );
    assert!(
        random(r#""deviation": [1, 0, 0], "time_constant": 1, "seed": -1"#)
            .contains("random.seed: found the number -1")
    );
    assert!(random(r#""deviation": [1, 0, 0], "tau": 1"#).contains("random: there is no `tau`"));
    assert!(
        with(r#""velocity": [1, 0, 0], "random": 3"#)
            .contains("random: found the number 3, expected an object")
    );
    assert_eq!(
        with(r#""velocity": [1, 0, 0], "settable": 1"#),
        "settable: found the number 1, expected true or false"
    );
    for bad in [f64::NAN, f64::INFINITY] {
        let text = CurrentField::uniform([0.0, bad, 0.0])
            .expect_err("refused")
            .to_string();
        assert!(text.starts_with("velocity[1]: found "), "{text}");
    }
}

proptest! {
    #[test]
    fn a_random_current_stays_finite(state in prop::collection::vec(any::<f64>(), 4), step in any::<f64>()) {
        let field = current(RANDOM);
        let mut next = state.clone();
        field.advance(&mut next, step);
        if state[..3].iter().all(|speed| speed.is_finite()) {
            prop_assert!(next[..3].iter().all(|speed| speed.is_finite()));
        }
    }
}
