//! Odd files: the parsers refuse or accept, and never panic.

use proptest::prelude::*;
use serde_json::{Map, Value, json};

use super::GRAVITY;
use crate::sea::{CurrentField, WaveField};

const KEYS: [&str; 25] = [
    "schema",
    "depth",
    "components",
    "height",
    "amplitude",
    "period",
    "direction",
    "phase",
    "spectrum",
    "significant_height",
    "peak_period",
    "spreading",
    "peak_enhancement",
    "seed",
    "velocity",
    "profile",
    "grid",
    "x",
    "y",
    "time",
    "random",
    "deviation",
    "time_constant",
    "",
    "\u{1F30A}",
];

fn odd_number() -> impl Strategy<Value = Value> {
    prop_oneof![
        (-3.0..3.0).prop_map(|number| json!(number)),
        (1.0..30.0).prop_map(|number| json!(number)),
        any::<f64>().prop_map(|number| json!(number)),
        any::<i64>().prop_map(|number| json!(number)),
        (0..200_u64).prop_map(|number| json!(number)),
    ]
}

fn odd_value() -> impl Strategy<Value = Value> {
    let words = prop::sample::select(vec![
        "jonswap",
        "tma",
        "pierson_moskowitz",
        "hydro-waves/1",
        "",
        "\u{1F30A}",
    ]);
    let leaf = prop_oneof![
        4 => odd_number(),
        1 => words.prop_map(|word| json!(word)),
        1 => Just(Value::Null),
        1 => any::<bool>().prop_map(|value| json!(value)),
    ];
    leaf.prop_recursive(3, 24, 6, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..6).prop_map(Value::Array),
            prop::collection::vec((prop::sample::select(KEYS.to_vec()), inner), 0..6).prop_map(
                |fields| {
                    Value::Object(
                        fields
                            .into_iter()
                            .map(|(key, value)| (key.to_owned(), value))
                            .collect(),
                    )
                }
            ),
        ]
    })
}

/// An object of a schema with odd values under known keys.
fn odd_file(schema: &'static str, keys: &'static [&'static str]) -> impl Strategy<Value = String> {
    prop::collection::vec((prop::sample::select(keys), odd_value()), 0..8).prop_map(move |fields| {
        let mut map: Map<String, Value> = fields
            .into_iter()
            .map(|(key, value)| (key.to_owned(), value))
            .collect();
        map.insert("schema".to_owned(), json!(schema));
        Value::Object(map).to_string()
    })
}

/// A spectrum of odd numbers.
fn odd_spectrum() -> impl Strategy<Value = String> {
    let names = prop::sample::select(vec!["jonswap", "tma", "eckv", "pierson_moskowitz"]);
    let keys = &[
        "depth",
        "direction",
        "spreading",
        "peak_enhancement",
        "inverse_wave_age",
        "seed",
    ][..];
    let more = prop::collection::vec((prop::sample::select(keys), odd_number()), 0..4);
    (names, odd_number(), odd_number(), more).prop_map(|(name, height, period, more)| {
        let mut file = json!({"schema": "hydro-waves/1", "spectrum": name, "significant_height": height,
                              "peak_period": period});
        for (key, value) in more {
            file[key] = value;
        }
        file.to_string()
    })
}

fn read_waves(text: &str) {
    match WaveField::parse(text, GRAVITY) {
        Ok((sea, notes)) => {
            let water = sea.kinematics([1.0, -2.0, -0.3], 4.0);
            let numbers = [water.velocity, water.acceleration].concat();
            assert!(numbers.iter().all(|number| number.is_finite()), "{text}");
            assert!(
                water.elevation.abs() <= sea.highest() * (1.0 + 1e-12) + 1e-300,
                "{text}"
            );
            assert!(sea.shortest_length() > 0.0 && sea.peak().length > 0.0);
            notes
                .iter()
                .for_each(|note| assert!(!note.to_string().is_empty()));
        }
        Err(fault) => assert!(!fault.to_string().is_empty()),
    }
}

fn read_current(text: &str) {
    match CurrentField::parse(text) {
        Ok(current) => {
            let mut state = vec![0.0; current.state_len()];
            current.reset(&mut state);
            current.advance(&mut state, 0.01);
            assert!(
                current
                    .velocity([3.0, -2.0], 2.0, 1.0, &state)
                    .iter()
                    .all(|speed| speed.is_finite())
            );
        }
        Err(fault) => assert!(!fault.to_string().is_empty()),
    }
}

proptest! {
    #[test]
    fn waves_never_panic(text in odd_file("hydro-waves/1", &KEYS)) {
        read_waves(&text);
        read_current(&text);
    }

    #[test]
    fn spectra_never_panic(text in odd_spectrum()) {
        read_waves(&text);
    }

    #[test]
    fn listed_waves_never_panic(list in prop::collection::vec((odd_number(), odd_number(), odd_number()), 0..5)) {
        let list: Vec<Value> = list.into_iter().map(|(height, period, direction)| {
            json!({"height": height, "period": period, "direction": direction})
        }).collect();
        read_waves(&json!({"schema": "hydro-waves/1", "components": list}).to_string());
    }

    #[test]
    fn currents_never_panic(text in odd_file("hydro-current/1", &["velocity", "profile", "random"])) {
        read_current(&text);
        read_waves(&text);
    }

    #[test]
    fn no_text_panics(text in ".*", cut in 0..160_usize) {
        read_waves(&text);
        read_current(&text);
        let whole = r#"{"schema": "hydro-waves/1", "spectrum": "jonswap", "significant_height": 0.5, "peak_period": 5, "seed": 3}"#;
        read_waves(&whole[..cut.min(whole.len())]);
    }
}
