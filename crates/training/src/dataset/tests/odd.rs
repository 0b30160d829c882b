//! Manifests with odd values anywhere: refused, or splits that can be read.

use proptest::prelude::*;

use super::*;

fn odd_value() -> impl Strategy<Value = Value> {
    let counts = prop::sample::select(vec![0, 1, 2, 3, 1 << 32, u64::MAX]);
    let words = prop::sample::select(vec![
        "",
        "..",
        "../x",
        "/dev/zero",
        "density",
        "position.a",
        "N",
        "train-00000-of-00002.safetensors",
        "\u{1F30A}",
    ]);
    prop_oneof![
        3 => counts.prop_map(|count| json!(count)),
        1 => any::<f64>().prop_map(|number| json!(number)),
        2 => words.prop_map(|word| json!(word)),
        1 => prop::sample::select(vec![json!(null), json!(true), json!([]), json!({}), json!(-1), json!(1e300)]),
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
    fn an_odd_manifest_is_refused_or_read(changes in prop::collection::vec((any::<prop::sample::Index>(), odd_value()), 1..4)) {
        let fixture = Fixture::new();
        let mut manifest = fixture.manifest.clone();
        for (index, value) in &changes {
            let mut all = Vec::new();
            places(&manifest, "", &mut all);
            let place = &all[index.index(all.len())];
            if let Some(found) = manifest.pointer_mut(place).filter(|_| !place.is_empty()) {
                *found = value.clone();
            }
        }
        fs::write(fixture.root.path().join("manifest.json"), manifest.to_string()).expect("written");
        match Dataset::open(fixture.root.path()) {
            Err(error) => prop_assert!(!error.to_string().is_empty()),
            Ok(data) => {
                for (name, split) in &data.manifest().splits {
                    match data.split(name, None) {
                        Err(error) => prop_assert!(!error.to_string().is_empty()),
                        Ok(read) => prop_assert_eq!(read.len(), split.trajectories),
                    }
                }
            }
        }
    }
}
