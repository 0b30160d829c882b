//! Attributes of `hydro.wrench`, a line `key=value` each.

use hydro_plugin::plugin::{Settings, search_path::SearchPath};

use super::{current, folder, potential_flow, refused, waves};

/// Reads the attributes, and the documents in them.
pub fn read(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return false;
    };
    let given: Vec<(&str, &str)> = text
        .lines()
        .filter_map(|line| line.split_once('='))
        .collect();
    let value = |name: &'static str| {
        let found = given.iter().find(|(key, _)| *key == name);
        found.map(|(_, value)| (*value).to_owned())
    };
    folder::put("attributes/b1/card.json", b"{}");
    let search = SearchPath::new(vec![folder::path().join("attributes")]);
    let settings = match Settings::parse(value, &search) {
        Ok(settings) => settings,
        Err(error) => return refused(&error),
    };
    let numbers = [
        settings.density,
        settings.waterline.unwrap_or(0.0),
        settings.volume.unwrap_or(1.0),
    ];
    assert!(numbers.iter().all(|number| number.is_finite()));
    match settings.sea(9.81) {
        Ok((sea, _)) => {
            sea.waves.iter().for_each(|of| waves::look(of));
            sea.current.iter().for_each(|of| current::look(of));
        }
        Err(error) => return refused(&error),
    }
    match settings.potential_flow() {
        Ok(flow) => {
            flow.iter().for_each(potential_flow::look);
            true
        }
        Err(error) => refused(&error),
    }
}
