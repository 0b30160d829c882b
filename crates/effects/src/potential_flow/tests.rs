use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::Vector6;
use proptest::prelude::*;
use serde_json::{Value, json};

use super::PotentialFlow;
use crate::sea::{Wave, WaveField};

fn file() -> Value {
    let mass: Vec<Vec<f64>> = (0..6)
        .map(|row| {
            (0..6)
                .map(|column| if row == column { 10.0 } else { 0.0 })
                .collect()
        })
        .collect();
    let row = |value: f64| vec![value, 2.0 * value, 0.0, 0.0, 0.0, value];
    json!({"schema": "hydro-potential-flow/1", "volume": 0.4, "point": [0.1, 0, -0.2], "added_mass": mass,
        "radiation": {"a": [[-2.0]], "b": [[0, 0, 3.0, 0, 0, 0]], "c": [[0], [0], [5.0], [0], [0], [0]]},
        "excitation": {"frequency": [1.0, 2.0], "direction": [-90, 0, 90],
            "real": [row(1.0), row(2.0), row(3.0), row(4.0), row(5.0), row(6.0)],
            "imaginary": [row(0.0), row(1.0), row(0.0), row(0.0), row(-1.0), row(0.0)]}})
}

fn flow(file: &Value) -> PotentialFlow {
    PotentialFlow::parse(&file.to_string()).expect("a file")
}

fn fault(change: impl Fn(&mut Value)) -> String {
    let mut file = file();
    change(&mut file);
    PotentialFlow::parse(&file.to_string())
        .expect_err("it should be refused")
        .to_string()
}

fn waves(frequency: f64, direction: f64, phase: f64) -> WaveField {
    let wave = Wave {
        amplitude: 0.01,
        period: TAU / frequency,
        direction,
        phase,
    };
    WaveField::new(&[wave], None, 9.81).expect("waves").0
}

/// x' = -2 x + 3 w, F = -5 x: after a velocity is switched on, F = -7.5 (1 - exp(-2 t)) w.
#[test]
fn memory_is_the_response_of_its_system() {
    let flow = flow(&file());
    let velocity = Vector6::new(0.7, 0.0, 0.4, 0.0, 0.0, 0.0);
    let mut memory = [0.0];
    let step = 0.002;
    let stepping = flow.stepping(step).expect("a step");
    for at in 1..=1000 {
        stepping.advance(&velocity, &mut memory);
        let expected = -7.5 * 0.4 * (1.0 - (-2.0 * step * f64::from(at)).exp());
        let force = flow.radiation_force(&memory);
        assert!((force[2] - expected).abs() < 1e-5, "{force} {expected}");
        assert_eq!(force[0], 0.0);
    }
    stepping.advance(&Vector6::repeat(f64::INFINITY), &mut memory);
    assert!(memory[0].is_finite());
    assert!(flow.stepping(f64::NAN).is_none() && flow.stepping(0.0).is_none());
}

/// A permutation of six states: the QR iteration goes round for ever, as in https://github.com/dimforge/nalgebra/issues/611.
#[test]
fn a_matrix_whose_poles_are_not_found_is_refused() {
    let states = 6;
    let text = fault(|file| {
        let mut a = vec![vec![0.0; states]; states];
        (1..states).for_each(|row| a[row][row - 1] = 1.0);
        a[0][states - 1] = 1.0;
        file["radiation"] =
            json!({"a": a, "b": vec![[0.0; 6]; states], "c": vec![vec![0.0; states]; 6]});
    });
    assert!(text.contains("poles are not found"), "{text}");
}

#[test]
fn a_listed_wave_pushes_as_listed_whatever_the_heading_and_place() {
    let flow = flow(&file());
    for heading in [0.0, 1.0, -2.5] {
        let waves = waves(2.0, heading, 0.3);
        let k = waves.components()[0].wavenumber;
        let (place, time) = ([3.0, -7.0], 12.3);
        let phase = k[0] * place[0] + k[1] * place[1] - 2.0 * time + 0.3;
        let force = flow.excitation_force(&waves, place, heading, time);
        // Direction 0, frequency 2: 5 - i.
        let expected = 0.01 * (5.0 * phase.cos() + phase.sin());
        assert!((force[0] - expected).abs() < 1e-9, "{force} {expected}");
        assert!((force[1] - 2.0 * expected).abs() < 1e-9);
    }
}

#[test]
fn between_the_listed_ones_it_is_linear_and_goes_round() {
    let flow = flow(&file());
    let real = |frequency: f64, direction: f64| {
        let waves = waves(frequency, direction, 0.0);
        flow.excitation_force(&waves, [0.0; 2], 0.0, 0.0)[0] / 0.01
    };
    assert!((real(1.5, FRAC_PI_2) - 4.5).abs() < 1e-9);
    assert!((real(1.0, PI / 4.0) - 2.5).abs() < 1e-9);
    // Astern, half way from 90 to 270 degrees: 3 and 1.
    assert!((real(1.0, PI) - 2.0).abs() < 1e-9);
    // Outside: the nearest.
    assert!((real(9.0, 0.0) - 5.0).abs() < 1e-9 && (real(0.2, 0.0) - 2.0).abs() < 1e-9);
}

#[test]
fn what_is_left_out_does_nothing() {
    let mut file = file();
    let fields = file.as_object_mut().expect("an object");
    fields.remove("radiation");
    fields.remove("excitation");
    fields.remove("point");
    let flow = flow(&file);
    assert_eq!(
        (flow.state_len(), flow.is_excited(), flow.point),
        (0, false, [0.0; 3])
    );
    assert_eq!(flow.radiation_force(&[]), Vector6::zeros());
    assert!(flow.stepping(0.01).is_none());
    let force = flow.excitation_force(&waves(1.0, 0.0, 0.0), [0.0; 2], 0.0, 0.0);
    assert_eq!(force, Vector6::zeros());
}

#[test]
fn every_refusal_says_what_and_where() {
    assert!(
        fault(|file| file["schema"] = json!("x")).contains("expected `hydro-potential-flow/1`")
    );
    assert!(fault(|file| file["volume"] = json!(0)).contains("volume: found 0 m^3"));
    assert!(
        fault(|file| file["radation"] = json!(0))
            .contains("there is no `radation`; did you mean `radiation`?")
    );
    assert!(fault(|file| file["added_mass"] = json!([1])).contains("expected 6 rows of 6 numbers"));
    assert!(fault(|file| file["added_mass"][1][4] = json!(3)).contains("a symmetric matrix"),);
    assert!(fault(|file| file["added_mass"][1][1] = json!(-3)).contains("the eigenvalue -3"));
    assert!(
        fault(|file| file["radiation"]["a"] = json!([[0.1]]))
            .contains("a pole with the real part 1.000e-1")
    );
    assert!(fault(|file| file["radiation"]["b"] = json!([[1]])).contains("radiation.b[0]"));
    assert!(fault(|file| file["radiation"]["c"][2][0] = json!("x")).contains("radiation.c[2][0]"));
    assert!(
        fault(|file| file["excitation"]["frequency"] = json!([2, 1]))
            .contains("expected numbers that ascend")
    );
    assert!(
        fault(|file| file["excitation"]["direction"] = json!([0, 1, 400])).contains("at most 360")
    );
    assert!(
        fault(|file| file["excitation"]["real"] = json!([]))
            .contains("expected 6 rows of 6 numbers")
    );
    let many: Vec<Vec<f64>> = vec![vec![-1.0; 257]; 257];
    assert!(fault(|file| file["radiation"]["a"] = json!(many)).contains("1 to 256 rows"));
}

proptest! {
    #[test]
    fn odd_files_are_refused_or_give_numbers(
        key in prop::sample::select(vec!["volume", "point", "added_mass", "radiation", "excitation"]),
        value in prop_oneof![
            any::<f64>().prop_map(|value| json!(value)),
            Just(json!([])), Just(json!({})), Just(json!("x")), Just(json!([[1e300]])), Just(Value::Null),
        ],
    ) {
        let mut file = file();
        file[key] = value;
        if let Ok(flow) = PotentialFlow::parse(&file.to_string()) {
            let force = flow.excitation_force(&waves(1.3, 0.4, 0.0), [1.0, 2.0], 0.1, 3.0);
            prop_assert!(force.iter().all(|value| value.is_finite()));
        }
    }
}
