//! Cards with odd values anywhere: refused, or a model that can be stepped.

use proptest::prelude::*;
use serde_json::{Value, json};

use super::*;

/// Numbers at every edge, and what is no number.
fn odd_value() -> impl Strategy<Value = Value> {
    let sizes = prop::sample::select(vec![0, 1, 2, 65_536, 65_537, 1 << 32, u64::MAX]);
    let words = prop::sample::select(vec![
        "",
        "density",
        "quaternion.w",
        "rk4",
        "mlp",
        "\u{1F30A}",
    ]);
    prop_oneof![
        4 => sizes.prop_map(|size| json!(size)),
        2 => any::<f64>().prop_map(|number| json!(number)),
        1 => prop::sample::select(vec![-1.0, 1e-300, 1e300, 1e308]).prop_map(|number| json!(number)),
        1 => words.prop_map(|word| json!(word)),
        1 => prop::sample::select(vec![json!(null), json!(true), json!([]), json!({}), json!([8, 8, 8, 8])]),
    ]
}

/// Pointers to all values below one.
fn places(value: &Value, at: &str, found: &mut Vec<String>) {
    found.push(at.to_owned());
    match value {
        Value::Object(fields) => fields
            .iter()
            .for_each(|(key, value)| places(value, &format!("{at}/{key}"), found)),
        Value::Array(list) => list
            .iter()
            .enumerate()
            .for_each(|(index, value)| places(value, &format!("{at}/{index}"), found)),
        _ => {}
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn an_odd_card_is_refused_or_steps(changes in prop::collection::vec((any::<prop::sample::Index>(), odd_value()), 1..4)) {
        let (_root, folder) = saved();
        edit(&folder, |card| {
            for (index, value) in &changes {
                let mut all = Vec::new();
                places(card, "", &mut all);
                let place = &all[index.index(all.len())];
                if let Some(found) = card.pointer_mut(place).filter(|_| !place.is_empty()) {
                    *found = value.clone();
                }
            }
        });
        match Checkpoint::load(&folder) {
            Err(error) => prop_assert!(!error.to_string().is_empty()),
            Ok(checkpoint) => {
                let engine = checkpoint.engine(crate::EngineKind::Fused, None).expect("it was checked");
                let mut force = vec![0.0; engine.outputs()];
                engine.estimate(&vec![0.1; engine.inputs()], &mut force, &mut Scratch::default());
            }
        }
    }

    #[test]
    fn odd_bytes_of_weights_are_refused(at in any::<prop::sample::Index>(), byte in any::<u8>(), cut in any::<prop::sample::Index>()) {
        let (_root, folder) = saved();
        let path = folder.join(WEIGHTS);
        let sound = fs::read(&path).expect("read");
        let mut bytes = sound.clone();
        bytes[at.index(sound.len())] = byte;
        bytes.truncate(1 + cut.index(sound.len()));
        fs::write(&path, &bytes).expect("written");
        edit(&folder, |card| card["weights_sha256"] = hexadecimal(&Sha256::digest(&bytes)).into());
        if let Err(error) = Checkpoint::load(&folder) {
            prop_assert!(!error.to_string().is_empty());
        } else {
            prop_assert_eq!(bytes.len(), sound.len());
        }
    }
}
