//! The attributes of `hydro.wrench`: strings of an MJCF to checked settings, read once, in one place.
//! What each is: [`super::attribute_table`].

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use hydro_effects::{
    potential_flow::PotentialFlow,
    sea::{CurrentField, SeaNote, WaveField},
};
use hydro_model::{EngineKind, Outputs, Solver};

use super::{attribute_error::AttributeError, sea::Sea, search_path::SearchPath};

/// Density of fresh water [kg/m^3].
pub const FRESH_WATER: f64 = 1000.0;

/// Greatest density [kg/m^3] and displaced volume [m^3]: beyond any fluid and ship.
const DENSEST: f64 = 1e5;
const LARGEST_VOLUME: f64 = 1e9;

/// The force at the first sample of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum InitialForce {
    /// The checkpoint's prediction for a window filled with the first sample.
    Estimate,
    /// These numbers [N, N m], one an output of the card.
    Given(Vec<f64>),
}

/// Checked attributes of one instance.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The checkpoint's folder, found.
    pub checkpoint: Option<PathBuf>,
    /// Named effects: the text of an `effects.json`.
    pub effects: Option<String>,
    /// Density of the water [kg/m^3].
    pub density: f64,
    /// True where an attribute gives it.
    pub density_is_given: bool,
    /// Height of the free surface, world z [m]; `None`: fully submerged.
    pub waterline: Option<f64>,
    /// Velocity of the water in the world [m/s].
    pub current: [f64; 3],
    /// A current that is more than three numbers: the text of a `hydro-current/1`.
    pub current_field: Option<String>,
    /// Waves: the text of a `hydro-waves/1`.
    pub waves: Option<String>,
    /// Potential flow about the carrying body: the text of a `hydro-potential-flow/1`.
    pub potential_flow: Option<String>,
    /// Names of the geoms that displace water.
    pub hull: Option<Vec<String>>,
    /// Displaced volume of the body [m^3], where it is not the hull's.
    pub volume: Option<f64>,
    /// Centre of buoyancy of the body, body frame [m], where it is not that of the submerged part.
    pub centre_of_buoyancy: Option<[f64; 3]>,
    /// Names of the card's joints in this model, in the card's order; `None`: the card's.
    pub joints: Option<Vec<String>>,
    /// `None`: the card's.
    pub solver: Option<Solver>,
    /// Which implementation evaluates the network.
    pub engine: EngineKind,
    /// The force at the first sample.
    pub initial_force: InitialForce,
    /// Factors on the wrench of the checkpoint, force x y z, torque x y z in the body's frame; what the
    /// network carries from sample to sample stays unscaled.
    pub wrench_scale: [f64; 6],
    /// Which of the card's outputs act; `None`: all.
    pub outputs: Option<Outputs>,
}

impl Settings {
    /// Reads every attribute through `text`; an empty value is an absent one, as in MuJoCo.
    pub fn parse(
        text: impl Fn(&'static str) -> Option<String>,
        search: &SearchPath,
    ) -> Result<Self, AttributeError> {
        let value = |name| {
            text(name)
                .map(|found| found.trim().to_owned())
                .filter(|found| !found.is_empty())
        };
        let checkpoint = match value("checkpoint") {
            None => None,
            Some(found) => match search.find(Path::new(&found)) {
                Ok(folder) => Some(folder),
                Err(tried) => return Err(AttributeError::NoCheckpoint { found, tried }),
            },
        };
        let effects = match value("effects") {
            None => None,
            Some(found) => Some(document("effects", NO_JSON, found, search)?),
        };
        if checkpoint.is_none() && effects.is_none() {
            return Err(AttributeError::Neither);
        }
        let wrench_scale = match value("wrench_scale") {
            None => [1.0; 6],
            Some(found) if checkpoint.is_none() => {
                return Err(AttributeError::WithoutCheckpoint {
                    attribute: "wrench_scale",
                    found,
                });
            }
            Some(found) => factors("wrench_scale", found)?,
        };
        let outputs = match value("outputs") {
            None => None,
            Some(found) if checkpoint.is_none() => {
                return Err(AttributeError::WithoutCheckpoint {
                    attribute: "outputs",
                    found,
                });
            }
            Some(found) => Some(choice("outputs", found, "`wrench` or `generalised`")?),
        };
        let waterline = match value("waterline") {
            None => None,
            Some(found) => Some(one_number(
                "waterline",
                &found,
                "one number, world z in m",
                |_| true,
            )?),
        };
        let (current, current_field) = match value("current") {
            None => ([0.0; 3], None),
            Some(found) if found.split_whitespace().all(is_number) => {
                let expected = "three numbers, world x y z in m/s";
                (three_numbers("current", found, expected)?, None)
            }
            Some(found) => {
                let otherwise =
                    "neither three numbers, world x y z in m/s, nor JSON, which starts with {";
                let field = document("current", otherwise, found, search)?;
                ([0.0; 3], Some(field))
            }
        };
        Ok(Self {
            checkpoint,
            effects,
            density: match value("density") {
                None => FRESH_WATER,
                Some(found) => one_number(
                    "density",
                    &found,
                    "one number >= 0 and at most 1e5, in kg/m^3",
                    |density| (0.0..=DENSEST).contains(&density),
                )?,
            },
            density_is_given: value("density").is_some(),
            waterline,
            current,
            current_field,
            waves: match value("waves") {
                None => None,
                Some(_) if waterline.is_none() => return Err(AttributeError::NoSurface("waves")),
                Some(found) => Some(document("waves", NO_JSON, found, search)?),
            },
            potential_flow: match value("potential_flow") {
                None => None,
                Some(_) if waterline.is_none() => {
                    return Err(AttributeError::NoSurface("potential_flow"));
                }
                Some(found) => Some(document("potential_flow", NO_JSON, found, search)?),
            },
            hull: value("hull").map(|found| words(&found)),
            volume: match value("volume") {
                None => None,
                Some(found) => Some(one_number(
                    "volume",
                    &found,
                    "one number > 0 and at most 1e9, in m^3",
                    |volume| volume > 0.0 && volume <= LARGEST_VOLUME,
                )?),
            },
            centre_of_buoyancy: match value("centre_of_buoyancy") {
                None => None,
                Some(found) => Some(three_numbers(
                    "centre_of_buoyancy",
                    found,
                    "three numbers, body frame x y z in m",
                )?),
            },
            joints: value("joints").map(|found| words(&found)),
            solver: match value("solver") {
                None => None,
                Some(found) => Some(choice("solver", found, "`euler`, `rk4` or `dopri5`")?),
            },
            engine: match value("engine") {
                None => EngineKind::Fused,
                Some(found) => choice(
                    "engine",
                    found,
                    "`fused`, `fused-f16`, `fused-i16` or `candle`",
                )?,
            },
            initial_force: match value("initial_force") {
                None => InitialForce::Estimate,
                Some(found) if found == "estimate" => InitialForce::Estimate,
                Some(found) => {
                    let expected = "`estimate`, or one number an output of the card, in N and N m";
                    InitialForce::Given(numbers("initial_force", &found, expected)?)
                }
            },
            wrench_scale,
            outputs,
        })
    }
}

impl Settings {
    /// Surface, waves and current of these attributes, where gravity is this strong [m/s^2], and what a user should know
    /// of them.
    ///
    /// # Errors
    /// A fault of the text of waves or current.
    pub fn sea(&self, gravity: f64) -> Result<(Sea, Vec<String>), AttributeError> {
        let waves = match &self.waves {
            Some(text) => {
                Some(
                    WaveField::parse(text, gravity).map_err(|source| AttributeError::Sea {
                        attribute: "waves",
                        source: Box::new(source),
                    })?,
                )
            }
            None => None,
        };
        let (waves, notes) = waves.unzip();
        let notes = notes.into_iter().flatten();
        let notes = notes.map(|note: SeaNote| format!("attribute `waves`: {note}"));
        let sea = Sea {
            waterline: self.waterline,
            waves: waves.map(Arc::new),
            current: self.current_field()?.map(Arc::new),
        };
        Ok((sea, notes.collect()))
    }

    /// Potential flow about the carrying body.
    ///
    /// # Errors
    /// A fault of its text.
    pub fn potential_flow(&self) -> Result<Option<PotentialFlow>, AttributeError> {
        let Some(text) = &self.potential_flow else {
            return Ok(None);
        };
        PotentialFlow::parse(text)
            .map(Some)
            .map_err(|source| AttributeError::Sea {
                attribute: "potential_flow",
                source: Box::new(source),
            })
    }

    /// A current that is more than three numbers.
    ///
    /// # Errors
    /// A fault of its text.
    pub fn current_field(&self) -> Result<Option<CurrentField>, AttributeError> {
        let Some(text) = &self.current_field else {
            return Ok(None);
        };
        CurrentField::parse(text)
            .map(Some)
            .map_err(|source| AttributeError::Sea {
                attribute: "current",
                source: Box::new(source),
            })
    }
}

/// The other form of a value that is a document, for the message where it names no file.
const NO_JSON: &str = "no JSON, which starts with {";

/// JSON that stands in an attribute, or in the file that it names.
fn document(
    attribute: &'static str,
    otherwise: &'static str,
    found: String,
    search: &SearchPath,
) -> Result<String, AttributeError> {
    if found.starts_with('{') {
        return Ok(found);
    }
    let path = match search.find(Path::new(&found)) {
        Ok(path) => path,
        Err(tried) => {
            return Err(AttributeError::NoFile {
                attribute,
                otherwise,
                found,
                tried,
            });
        }
    };
    hydro_files::read_text(&path, hydro_files::TEXT).map_err(|fault| {
        AttributeError::UnreadableFile {
            attribute,
            path,
            reason: fault.to_string(),
        }
    })
}

fn is_number(word: &str) -> bool {
    word.parse::<f64>().is_ok()
}

fn words(found: &str) -> Vec<String> {
    found.split_whitespace().map(str::to_owned).collect()
}

fn three_numbers(
    attribute: &'static str,
    found: String,
    expected: &'static str,
) -> Result<[f64; 3], AttributeError> {
    numbers(attribute, &found, expected)?
        .try_into()
        .map_err(|_| AttributeError::Value {
            attribute,
            found,
            expected,
        })
}

fn numbers(
    attribute: &'static str,
    found: &str,
    expected: &'static str,
) -> Result<Vec<f64>, AttributeError> {
    found
        .split_whitespace()
        .map(|word| word.parse::<f64>().ok().filter(|number| number.is_finite()))
        .collect::<Option<Vec<f64>>>()
        .ok_or_else(|| AttributeError::Value {
            attribute,
            found: found.to_owned(),
            expected,
        })
}

/// Six factors, one an axis of a wrench.
fn factors(attribute: &'static str, found: String) -> Result<[f64; 6], AttributeError> {
    let expected = "six factors > 0, force x y z, then torque x y z";
    let given: Option<[f64; 6]> = numbers(attribute, &found, expected)?.try_into().ok();
    given
        .filter(|factors| factors.iter().all(|factor| *factor > 0.0))
        .ok_or(AttributeError::Value {
            attribute,
            found,
            expected,
        })
}

fn one_number(
    attribute: &'static str,
    found: &str,
    expected: &'static str,
    allowed: impl Fn(f64) -> bool,
) -> Result<f64, AttributeError> {
    match numbers(attribute, found, expected)?.as_slice() {
        [number] if allowed(*number) => Ok(*number),
        _ => Err(AttributeError::Value {
            attribute,
            found: found.to_owned(),
            expected,
        }),
    }
}

fn choice<T: std::str::FromStr>(
    attribute: &'static str,
    found: String,
    expected: &'static str,
) -> Result<T, AttributeError> {
    found.parse().map_err(|_| AttributeError::Value {
        attribute,
        found,
        expected,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::{cell::RefCell, collections::BTreeSet, fs};

    use super::*;
    use crate::plugin::attribute_table::WRENCH;

    fn parse(given: &[(&str, &str)]) -> Result<Settings, AttributeError> {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("b1")).unwrap();
        let search = SearchPath::new(vec![folder.path().to_owned()]);
        let text = |name: &'static str| {
            given
                .iter()
                .find(|(key, _)| *key == name)
                .map(|(_, value)| (*value).to_owned())
        };
        Settings::parse(text, &search)
    }

    #[test]
    fn a_checkpoint_alone_gives_the_documented_defaults() {
        let settings = parse(&[("checkpoint", "b1")]).unwrap();
        assert!(settings.checkpoint.unwrap().ends_with("b1"));
        assert_eq!(settings.effects, None);
        assert_eq!(settings.density, 1000.0);
        assert_eq!(settings.waterline, None);
        assert_eq!(settings.current, [0.0; 3]);
        assert_eq!(settings.waves, None);
        assert_eq!(settings.hull, None);
        assert_eq!(settings.volume, None);
        assert_eq!(settings.centre_of_buoyancy, None);
        assert_eq!(settings.joints, None);
        assert_eq!(settings.solver, None);
        assert_eq!(settings.engine, EngineKind::Fused);
        assert_eq!(settings.initial_force, InitialForce::Estimate);
        assert_eq!(settings.wrench_scale, [1.0; 6]);
    }

    #[test]
    fn the_table_lists_what_is_read() {
        let asked = RefCell::new(BTreeSet::new());
        let text = |name: &'static str| {
            asked.borrow_mut().insert(name);
            (name == "effects").then(|| "{}".to_owned())
        };
        Settings::parse(text, &SearchPath::new(Vec::new())).unwrap();
        let listed = WRENCH
            .iter()
            .map(|attribute| attribute.name.to_str().unwrap());
        assert_eq!(asked.into_inner(), listed.collect());
    }

    #[test]
    fn every_attribute_is_read() {
        let settings = parse(&[
            ("checkpoint", "b1"),
            ("density", " 1025.5 "),
            ("waterline", "-0.2"),
            ("current", "0.1 -0.2 0"),
            ("waves", r#"{"a": 1}"#),
            ("hull", " keel  deck"),
            ("volume", "0.02"),
            ("centre_of_buoyancy", "0 0.1 -0.2"),
            ("joints", "a b  c"),
            ("solver", "rk4"),
            ("engine", "candle"),
            ("initial_force", "1 2 3 4 5 6"),
            ("wrench_scale", "1 1.1 0.9 1 1 1.2"),
        ])
        .unwrap();
        assert_eq!(settings.density, 1025.5);
        assert_eq!(settings.waterline, Some(-0.2));
        assert_eq!(settings.current, [0.1, -0.2, 0.0]);
        assert_eq!(settings.waves.as_deref(), Some(r#"{"a": 1}"#));
        assert_eq!(settings.hull, Some(vec!["keel".into(), "deck".into()]));
        assert_eq!(settings.volume, Some(0.02));
        assert_eq!(settings.centre_of_buoyancy, Some([0.0, 0.1, -0.2]));
        assert_eq!(
            settings.joints,
            Some(vec!["a".into(), "b".into(), "c".into()])
        );
        assert_eq!(settings.solver, Some(Solver::Rk4));
        assert_eq!(settings.engine, EngineKind::Candle);
        assert_eq!(
            settings.initial_force,
            InitialForce::Given(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
        );
        assert_eq!(settings.wrench_scale, [1.0, 1.1, 0.9, 1.0, 1.0, 1.2]);
    }

    #[test]
    fn a_refusal_names_attribute_value_and_repair() {
        for (key, value, expected) in [
            ("density", "-1", ">= 0"),
            ("density", "salt", "kg/m^3"),
            ("density", "1000 1025", "one number"),
            ("density", "nan", "kg/m^3"),
            ("waterline", "0 0", "world z"),
            ("current", "1 2", "three numbers"),
            ("current", "1 2 inf", "three numbers"),
            ("current", "1 2 x", "neither three numbers"),
            ("volume", "0", "> 0"),
            ("volume", "nan", "m^3"),
            ("centre_of_buoyancy", "1 2", "body frame"),
            ("solver", "heun", "`rk4`"),
            ("engine", "gpu", "`candle`"),
            ("initial_force", "guess", "`estimate`"),
            ("wrench_scale", "1 1 1", "six factors"),
            ("wrench_scale", "1 1 1 1 1 1 1", "six factors"),
            ("wrench_scale", "1 1 1 1 1 0", "> 0"),
            ("wrench_scale", "1 1 1 1 1 -2", "> 0"),
            ("wrench_scale", "1 1 1 1 1 inf", "six factors"),
            ("wrench_scale", "1 1 nan 1 1 1", "six factors"),
            ("wrench_scale", "twice", "six factors"),
        ] {
            let text = parse(&[("checkpoint", "b1"), (key, value)])
                .unwrap_err()
                .to_string();
            assert!(text.contains(&format!("`{key}` is `{value}`")), "{text}");
            assert!(text.contains(expected), "{text}");
        }
    }

    #[test]
    fn effects_stand_in_the_attribute_or_in_a_file() {
        let inline = r#" {"schema": "x"}"#;
        let settings = parse(&[("effects", inline)]).unwrap();
        assert_eq!(settings.effects.as_deref(), Some(inline.trim()));
        assert_eq!(settings.checkpoint, None);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("effects.json");
        fs::write(&path, "{}").unwrap();
        let settings = parse(&[("effects", path.to_str().unwrap())]).unwrap();
        assert_eq!(settings.effects.as_deref(), Some("{}"));
        let text = parse(&[("effects", "no.json")]).unwrap_err().to_string();
        assert!(
            text.contains("`no.json`") && text.contains("/no.json."),
            "{text}"
        );
        let text = parse(&[("effects", folder.path().to_str().unwrap())])
            .unwrap_err()
            .to_string();
        assert!(text.contains("cannot be read"), "{text}");
    }

    #[test]
    fn a_current_may_be_a_document_and_waves_need_a_surface() {
        let field = r#"{"schema": "hydro-current/1", "velocity": [0.1, 0, 0]}"#;
        let settings = parse(&[("checkpoint", "b1"), ("current", field)]).unwrap();
        assert_eq!(settings.current, [0.0; 3]);
        let (sea, notes) = settings.sea(9.81).unwrap();
        assert_eq!(sea.motion([0.0; 3].into(), 0.0, &[]).velocity.x, 0.1);
        assert!(notes.is_empty() && sea.waterline.is_none() && sea.moves());
        let waves = r#"{"schema": "hydro-waves/1", "components": [{"height": 1, "period": 5}]}"#;
        let text = parse(&[("checkpoint", "b1"), ("waves", waves)]).unwrap_err();
        assert!(text.to_string().contains("needs `waterline`"), "{text}");
        let given = [("checkpoint", "b1"), ("waves", waves), ("waterline", "2")];
        let settings = parse(&given).unwrap();
        let (sea, _) = settings.sea(9.81).unwrap();
        assert_eq!(sea.level(0.0, 0.0, 0.0), Some(2.5));
        let text = settings.sea(0.0).unwrap_err().to_string();
        assert!(
            text.contains("attribute `waves`") && text.contains("gravity"),
            "{text}"
        );
    }

    #[test]
    fn factors_on_the_checkpoint_need_one() {
        let text = parse(&[("effects", "{}"), ("wrench_scale", "1 1 1 1 1 1.1")])
            .unwrap_err()
            .to_string();
        assert!(
            text.contains("`wrench_scale` is `1 1 1 1 1 1.1`") && text.contains("no `checkpoint`"),
            "{text}"
        );
    }

    #[test]
    fn a_missing_checkpoint_lists_the_places() {
        let text = parse(&[]).unwrap_err().to_string();
        assert!(
            text.contains("`checkpoint` and `effects` are missing"),
            "{text}"
        );
        let text = parse(&[("checkpoint", "b2")]).unwrap_err().to_string();
        assert!(
            text.contains("`b2`") && text.contains("/b2.") && text.contains("HYDRO_PATH"),
            "{text}"
        );
    }
}
