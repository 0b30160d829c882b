//! `hydro attributes`: what can be written in an MJCF.

use hydro_plugin::plugin::attribute_table::{Attribute, LOAD_CELL, WRENCH};
use serde::Serialize;

use super::output::print_json;

/// Schema of the list.
const SCHEMA: &str = "hydro-attributes/1";

/// Flags of `hydro attributes`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Print one JSON value and nothing else.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct List {
    schema: &'static str,
    plugins: [Plugin; 2],
}

#[derive(Serialize)]
struct Plugin {
    plugin: &'static str,
    attributes: Vec<Entry>,
}

#[derive(Serialize)]
struct Entry {
    name: String,
    /// Null where it is no number.
    unit: Option<&'static str>,
    meaning: &'static str,
    default: &'static str,
}

impl From<&Attribute> for Entry {
    fn from(attribute: &Attribute) -> Self {
        Self {
            name: attribute.name.to_string_lossy().into_owned(),
            unit: Some(attribute.unit).filter(|unit| !unit.is_empty()),
            meaning: attribute.meaning,
            default: attribute.default,
        }
    }
}

fn list() -> List {
    let plugin = |plugin, table: &[Attribute]| Plugin {
        plugin,
        attributes: table.iter().map(Entry::from).collect(),
    };
    List {
        schema: SCHEMA,
        plugins: [
            plugin("hydro.wrench", &WRENCH),
            plugin("hydro.load_cell", &LOAD_CELL),
        ],
    }
}

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let list = list();
    if args.json {
        return print_json(&list);
    }
    for Plugin { plugin, attributes } in &list.plugins {
        say!("{plugin}");
        for entry in attributes {
            let unit = entry
                .unit
                .map_or(String::new(), |unit| format!(" [{unit}]"));
            say!("  {}{unit}: {}", entry.name, entry.meaning);
            say!("      default: {}", entry.default);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_attribute_is_described_once() {
        let list = serde_json::to_value(list()).unwrap();
        for plugin in list["plugins"].as_array().unwrap() {
            let attributes = plugin["attributes"].as_array().unwrap();
            for attribute in attributes {
                for key in ["name", "meaning", "default"] {
                    assert!(!attribute[key].as_str().unwrap().is_empty(), "{attribute}");
                }
            }
            let names: BTreeSet<&str> = attributes
                .iter()
                .flat_map(|one| one["name"].as_str())
                .collect();
            assert_eq!(names.len(), attributes.len(), "{plugin}");
        }
    }
}
