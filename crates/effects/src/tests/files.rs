//! What a file of effects may say: physics bounds it, not a fit's priors; every refusal.

use super::fixture::{Model, target};
use crate::{
    EffectSet, Entry, Id, Physical, SetError, Target, TargetKind, Targets, all,
    card::{BodyScale, JointScale, LARGEST},
    effect,
};

/// A file with one effect.
fn file(effect: &str, target: &str, parameters: &str) -> String {
    format!(
        r#"{{"schema": "hydro-effects/1", "effects": [{{"effect": "{effect}", "target": "{target}", "parameters": {parameters}}}]}}"#
    )
}

fn on_hull(effect: &str, parameters: &str) -> Result<EffectSet, SetError> {
    EffectSet::parse(&file(effect, "hull", parameters), &Model)
}

fn refusal(effect: &str, parameters: &str) -> String {
    let fault = on_hull(effect, parameters).expect_err("it should be refused");
    fault.to_string()
}

/// A matrix as text, with elements changed.
fn matrix(diagonal: [f64; 6], changes: &[(usize, usize, f64)]) -> String {
    let mut rows = [[0.0; 6]; 6];
    for (axis, value) in diagonal.into_iter().enumerate() {
        rows[axis][axis] = value;
    }
    for (row, column, value) in changes {
        rows[*row][*column] = *value;
    }
    format!("{rows:?}")
}

fn with_matrix(diagonal: [f64; 6], changes: &[(usize, usize, f64)]) -> String {
    format!(r#"{{"matrix": {}}}"#, matrix(diagonal, changes))
}

const ROUND: [f64; 6] = [6.0, 12.0, 18.0, 0.2, 0.3, 0.4];

/// 385 N of buoyancy on a hull of 12.5 kg that lies on the bottom of a tank: more than any fit looks at.
#[test]
fn a_light_hull_may_have_much_buoyancy() {
    let set = on_hull("net_buoyancy", r#"{"force": 385}"#).expect("physics allows it");
    assert_eq!(set.entries[0].parameters, [385.0, 0.0, 0.0, 0.0]);
    let Some(Target::Body(scale)) = Model.find(TargetKind::Body, "hull") else {
        unreachable!()
    };
    let fitted = effect(Id::NetBuoyancy).parameters(&Target::Body(scale));
    assert!(fitted[0].upper < 385.0, "a fit keeps its bounds");
}

/// Kinds of values of the whole catalogue: those that are not listed may be any.
#[test]
fn physics_has_a_sign_where_there_is_one() {
    use Physical::{Any, Between, NotNegative, Positive};
    let expected = |id: Id, name: &str| match (id, name) {
        (
            Id::NetBuoyancy | Id::BuoyancyOffset | Id::ConstantForce | Id::MunkMoment | Id::Lift,
            _,
        )
        | (Id::Windage, "height")
        | (Id::Payload | Id::Fin, "x" | "y" | "z")
        | (Id::Propeller, "thrust")
        | (Id::Waves, "phase" | "vertical_lag")
        | (Id::JointStiffness, "reference")
        | (Id::SensorBias, _) => Any,
        (Id::Current, _) | (Id::Waves | Id::Windage, "x" | "y" | "z") => Between(-1e4, 1e4),
        (Id::ActuatorDelay, _) => Between(0.0, 60.0),
        (Id::Fin, "stall") => Between(0.0, std::f64::consts::PI),
        (Id::Propeller, "wake") => Between(0.0, 1.0),
        (Id::ThrustCurve, "exponent") => Between(0.1, 10.0),
        (Id::ThrustCurve, "full") => Positive,
        (_, "rate" | "length" | "frequency" | "stribeck_speed") => Positive,
        _ => NotNegative,
    };
    for effect in all() {
        let card = effect.card();
        for parameter in effect.parameters(&target(card.target)) {
            let expected = expected(card.id, &parameter.name);
            assert_eq!(
                parameter.physical, expected,
                "{} {}",
                card.id, parameter.name
            );
        }
    }
}

/// A target of a kind: a speck, a vehicle, a tanker.
fn targets_of_all_sizes(kind: TargetKind) -> Vec<Target> {
    let body = |length: f64| {
        let volume = length * length * length / 60.0;
        let mass = 1000.0 * volume;
        Target::Body(BodyScale {
            mass,
            inertia: [mass * length * length / 12.0; 3],
            extent: [length, length / 6.0, length / 10.0],
            volume,
            hull_volume: volume,
            buoyancy_left_out: 0.0,
            density: 1000.0,
            gravity: 9.81,
            speed: 1.0,
            rate: 1.0,
        })
    };
    let joint = |torque: f64| {
        Target::Joint(JointScale {
            inertia: torque,
            armature: 0.0,
            torque,
            damping: 0.0,
            speed: 1.0,
            travel: 1.0,
            middle: 3.0,
            slides: false,
            driven: true,
        })
    };
    match kind {
        TargetKind::Body => [1e-3, 1.0, 350.0].map(body).to_vec(),
        TargetKind::Joint => [1e-6, 1.0, 1e9].map(joint).to_vec(),
        TargetKind::Actuator | TargetKind::Sensor => vec![target(kind)],
    }
}

/// What a fit finds can be written and read, and what a file may say does not depend on the model.
#[test]
fn every_fit_stays_within_physics() {
    for effect in all() {
        let card = effect.card();
        let sizes = targets_of_all_sizes(card.target);
        let first = effect.parameters(&sizes[0]);
        for size in &sizes {
            for (parameter, other) in effect.parameters(size).iter().zip(&first) {
                let place = format!("{} {} {size:?}", card.id, parameter.name);
                assert_eq!(parameter.physical, other.physical, "{place}");
                for bound in [parameter.lower, parameter.upper] {
                    assert!(
                        bound.is_infinite() || parameter.physical.holds(bound),
                        "{place} {bound}"
                    );
                }
                for value in [parameter.null, parameter.start] {
                    assert!(parameter.physical.holds(value), "{place} {value}");
                }
            }
        }
    }
}

/// Every parameter of every effect: just outside what physics allows is refused by name, the bound itself is read.
#[test]
fn what_physics_forbids_is_refused_by_name() {
    let mut refused = 0;
    for effect in all() {
        let card = effect.card();
        let target = Model.names(card.target)[0].clone();
        let found = Model.find(card.target, &target).expect("it is there");
        let parameters = effect.parameters(&found);
        let nulls: Vec<f64> = parameters.iter().map(|of| of.start).collect();
        let check = |at: usize, value: f64| {
            let mut parameters = nulls.clone();
            parameters[at] = value;
            let entry = Entry {
                effect: card.id,
                target: target.clone(),
                parameters,
            };
            let set = EffectSet {
                entries: vec![entry],
            };
            set.check(&Model).map_err(|fault| fault.to_string())
        };
        for (at, parameter) in parameters.iter().enumerate() {
            let (allowed, forbidden) = match parameter.physical {
                Physical::Any => (
                    vec![-LARGEST, LARGEST],
                    vec![-1.01 * LARGEST, 1.01 * LARGEST],
                ),
                Physical::NotNegative => (vec![0.0, LARGEST], vec![-1e-9, 1.01 * LARGEST]),
                Physical::Positive => (vec![1e-9, LARGEST], vec![0.0, -1.0, 1.01 * LARGEST]),
                Physical::Between(lower, upper) => {
                    (vec![lower, upper], vec![lower - 1.0, upper + 1.0])
                }
            };
            for value in allowed {
                assert_eq!(check(at, value), Ok(()), "{} {}", card.id, parameter.name);
            }
            for value in forbidden {
                let text = check(at, value).expect_err("it should be refused");
                let named = format!(
                    "effects[0], {} on {target}: {} is {value} [{}], expected {}",
                    card.id, parameter.name, parameter.unit, parameter.physical
                );
                assert_eq!(text, named);
                refused += 1;
            }
            for value in [f64::NAN, f64::INFINITY] {
                let text = check(at, value).expect_err("it should be refused");
                assert!(text.contains("expected a finite number"), "{text}");
            }
        }
    }
    assert!(refused > 150, "{refused}");
}

#[test]
fn matrices_are_read_and_written() {
    let changes = [(1, 5, 0.7), (5, 1, 0.7), (2, 4, -0.9), (4, 2, -0.9)];
    for (effect, point) in [
        ("added_mass", ""),
        ("linear_drag", r#", "point": [0.1, 0, -0.2]"#),
        ("quadratic_drag", r#", "point": [0, 0, 0]"#),
    ] {
        let text = format!(r#"{{"matrix": {}{point}}}"#, matrix(ROUND, &changes));
        let set = on_hull(effect, &text).expect("a file");
        let values = &set.entries[0].parameters;
        assert_eq!(values.len(), if point.is_empty() { 36 } else { 39 });
        assert_eq!((values[11], values[31], values[16]), (0.7, 0.7, -0.9));
        let written = set.to_json(&Model).expect("a text");
        assert_eq!(written.contains("point"), !point.is_empty());
        assert_eq!(EffectSet::parse(&written, &Model), Ok(set));
    }
}

#[test]
fn an_asymmetric_added_mass_is_refused_with_the_pair() {
    let text = refusal(
        "added_mass",
        &with_matrix(ROUND, &[(1, 5, 0.75), (5, 1, 0.25)]),
    );
    assert!(
        text.contains("effects[0], added_mass on hull: the matrix is not symmetric: sway, yaw is 0.75 and yaw, sway is 0.25 [kg m], 0.5 apart"),
        "{text}"
    );
    let rounded = [(1, 5, 0.7), (5, 1, 0.7 * (1.0 + 1e-12))];
    on_hull("added_mass", &with_matrix(ROUND, &rounded)).expect("rounding is no asymmetry");
    // Drags need not be.
    on_hull("linear_drag", &with_matrix(ROUND, &[(1, 5, 0.7)])).expect("a drag");
    on_hull("quadratic_drag", &with_matrix(ROUND, &[(1, 5, 0.7)])).expect("a drag");
}

#[test]
fn an_indefinite_matrix_is_refused_with_its_eigenvalue() {
    // [[12, 3], [3, 0.4]]: the lesser eigenvalue is 6.2 - sqrt(5.8^2 + 9).
    let coupled = with_matrix(ROUND, &[(1, 5, 3.0), (5, 1, 3.0)]);
    let least = 6.2 - (5.8_f64 * 5.8 + 9.0).sqrt();
    let told = |text: &str| -> f64 {
        let rest = text.split("eigenvalue ").nth(1).expect("an eigenvalue");
        rest.split(',')
            .next()
            .and_then(|number| number.parse().ok())
            .expect("a number")
    };
    let text = refusal("added_mass", &coupled);
    assert!(
        text.contains("the matrix has the eigenvalue") && text.contains("kinetic energy"),
        "{text}"
    );
    assert!((told(&text) - least).abs() < 1e-12, "{text}");
    // The symmetric part of a drag.
    let text = refusal("linear_drag", &with_matrix(ROUND, &[(1, 5, 6.0)]));
    assert!(
        text.contains("the symmetric part of the matrix") && text.contains("add energy"),
        "{text}"
    );
    assert!((told(&text) - least).abs() < 1e-12, "{text}");
    // Small moments of inertia beside great masses: 1 g m^2 too little.
    let ship = [1e8, 1e8, 1e8, 1e-3, 1.0, 1.0];
    let text = refusal(
        "added_mass",
        &with_matrix(ship, &[(3, 4, 0.04), (4, 3, 0.04)]),
    );
    assert!(told(&text) < 0.0, "{text}");
    // The edge is allowed: a coupling as large as the diagonal allows, and nothing at all.
    let edge = [(0, 1, 6.0), (1, 0, 6.0)];
    on_hull("added_mass", &with_matrix([6.0; 6], &edge)).expect("semidefinite");
    on_hull("added_mass", &with_matrix([0.0; 6], &[])).expect("zero");
}

#[test]
fn fossens_signs_are_recognised() {
    let negative = ROUND.map(|value| -value);
    for effect in ["added_mass", "linear_drag", "quadratic_drag"] {
        let text = refusal(effect, &with_matrix(negative, &[]));
        assert!(text.contains("hydro effects from-fossen"), "{text}");
    }
    let text = refusal(
        "quadratic_drag",
        &with_matrix([1.0, 1.0, -2.0, 1.0, 1.0, 1.0], &[]),
    );
    assert!(
        text.contains("heave, heave is -2 [N s^2/m^2], expected at least 0"),
        "{text}"
    );
}

#[test]
fn what_is_no_matrix_is_refused_with_its_place() {
    let place = "effects[0].parameters";
    let cases = [
        (
            r#"{"matrix": 3}"#.to_owned(),
            format!("{place}.matrix: found the number 3, expected a list of 6 rows"),
        ),
        (
            r#"{"matrix": [[1, 2]]}"#.to_owned(),
            format!("{place}.matrix: found 1 rows, expected 6: surge, sway"),
        ),
        (
            with_matrix(ROUND, &[]).replacen("[[6.0, ", "[[", 1),
            format!("{place}.matrix[0]: found a list of 5, expected a list of 6 numbers"),
        ),
        (
            with_matrix(ROUND, &[]).replacen("6.0", "\"6\"", 1),
            format!("{place}.matrix[0][0]: found the string `6`, expected a number"),
        ),
        (
            with_matrix(ROUND, &[])
                .replacen("[6.0", "7, [6.0", 1)
                .replacen(", [0.0, 0.0, 0.0, 0.0, 0.0, 0.4]", "", 1),
            format!("{place}.matrix[0]: found the number 7, expected a list of 6 numbers"),
        ),
        (
            with_matrix(ROUND, &[]).replacen('{', r#"{"point": [0, 1], "#, 1),
            format!("{place}.point: found a list of 2, expected a list of 3 numbers [m]"),
        ),
        (
            with_matrix(ROUND, &[]).replacen('{', r#"{"point": [0, 1, 2e4], "#, 1),
            "added_mass on hull: point[2] is 20000 [m], expected -10000 to 10000".to_owned(),
        ),
        (
            with_matrix(ROUND, &[]).replacen('{', r#"{"surge": 6, "#, 1),
            format!("{place}: found `surge` beside `matrix`, expected only `matrix` and `point`"),
        ),
        (
            with_matrix([2e18, 1.0, 1.0, 1.0, 1.0, 1.0], &[]),
            "matrix, surge, surge is 2000000000000000000 [kg], expected -1e18 to 1e18".to_owned(),
        ),
    ];
    for (parameters, expected) in cases {
        let text = refusal("added_mass", &parameters);
        assert!(text.contains(&expected), "{text}\n{expected}");
    }
    // Which effects take one is said where one is looked for.
    let text = refusal("added_mass", r#"{"matrx": []}"#);
    assert!(
        text.contains("there is no parameter `matrx`") && text.contains("`matrix` (6 rows of 6)"),
        "{text}"
    );
    let text = refusal("lift", &with_matrix(ROUND, &[]));
    assert!(
        text.contains("there is no parameter `matrix`") && !text.contains("6 rows"),
        "{text}"
    );
}

#[test]
fn values_of_a_matrix_are_counted_and_finite() {
    let check = |effect: Id, parameters: Vec<f64>| {
        let target = "hull".to_owned();
        let entries = vec![Entry {
            effect,
            target,
            parameters,
        }];
        let fault = EffectSet { entries }.check(&Model);
        fault.expect_err("it should be refused").to_string()
    };
    let text = check(Id::AddedMass, vec![0.0; 35]);
    assert!(text.contains("35 values for 6 parameters"), "{text}");
    let text = check(Id::Lift, vec![0.0; 36]);
    assert!(text.contains("36 values for 2 parameters"), "{text}");
    let mut values = vec![0.0; 39];
    values[11] = f64::NAN;
    let text = check(Id::LinearDrag, values.clone());
    assert!(
        text.contains("matrix, sway, yaw is NaN, expected a finite number"),
        "{text}"
    );
    (values[11], values[37]) = (0.0, f64::INFINITY);
    let text = check(Id::LinearDrag, values);
    assert!(
        text.contains("point[1] is inf, expected a finite number"),
        "{text}"
    );
}

/// A matrix and six numbers are the same effect.
#[test]
fn a_matrix_beside_six_numbers_is_one_effect_twice() {
    let six = r#"{"surge": 6, "sway": 12, "heave": 18, "roll": 0.2, "pitch": 0.3, "yaw": 0.4}"#;
    let one = |parameters: &str| {
        format!(r#"{{"effect": "added_mass", "target": "hull", "parameters": {parameters}}}"#)
    };
    let text = format!(
        r#"{{"schema": "hydro-effects/1", "effects": [{}, {}]}}"#,
        one(six),
        one(&with_matrix(ROUND, &[]))
    );
    let fault = EffectSet::parse(&text, &Model).expect_err("it should be refused");
    assert_eq!(
        fault.to_string(),
        "effects[1]: added_mass on hull stands there twice"
    );
}
