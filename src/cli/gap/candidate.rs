//! The candidate model that `add` writes and `verify` judges.

use std::path::Path;

use anyhow::Context as _;
use hydro_effects::{
    Id,
    card::{Target, TargetKind},
    effect,
};
use hydro_gap::{
    patch,
    plant::{Nuisance, PlantDescription, Quantity},
    records::{Added, Refitted},
};

use super::{effects::example_of, results_folder::PATCHED};

/// Result of `add`: its record, the text of the candidate model, and the files of a learned residual that the text names.
/// Without a text the record says why there is none.
pub(super) struct Candidate {
    pub(super) added: Added,
    pub(super) xml: Option<String>,
    /// Files by their names in the folder of results.
    pub(super) residual: Vec<(&'static str, Vec<u8>)>,
}

/// Records the values of the nominal model that were written; `beside` completes the sentence "as they were fitted ...".
pub(super) fn record_refitted(
    added: &mut Added,
    patched: &patch::Patched,
    numbers: &[(Nuisance, f64)],
    deviations: &[f64],
    beside: &str,
) {
    let refitted = patched.numbers.iter().map(|written| {
        let quantity = &numbers[written.number].0.quantity;
        let unit = match quantity {
            Quantity::CentreOfMass(_) => 1.0,
            _ => written.from.abs(),
        };
        Refitted {
            what: written.name.clone(),
            from: written.from,
            to: written.to,
            unit: written.unit.to_owned(),
            deviation: deviations[written.number] * unit,
        }
    });
    added.numbers = refitted.collect();
    if !added.numbers.is_empty() {
        added.remarks.push(format!(
            "{PATCHED} holds {} numbers of the nominal model as they were fitted {beside}, each within \
             its declared uncertainty",
            added.numbers.len()
        ));
    }
}

/// The candidate of a patched model, with its difference to the nominal text.
pub(super) fn patched_candidate(
    nominal: &Path,
    mut added: Added,
    patched: patch::Patched,
) -> anyhow::Result<Candidate> {
    let text = hydro_files::read_text(nominal, hydro_files::TEXT)
        .with_context(|| format!("--model {}", nominal.display()))?;
    let name = nominal.file_name().unwrap_or_default();
    let names = (&*name.to_string_lossy(), PATCHED);
    added.diff = patch::unified(&text, &patched.xml, names);
    added.model = Some(PATCHED.to_owned());
    added.remarks.extend(patched.remarks);
    Ok(Candidate {
        added,
        xml: Some(patched.xml),
        residual: Vec::new(),
    })
}

/// Names of the parameters of an effect on a target of a model. They depend on a body's shape (the axes across its longest
/// one), not on the sizes of joints, actuators and sensors.
pub(super) fn parameter_names(model: &PlantDescription, id: Id, target: &str) -> Vec<String> {
    let effect = effect(id);
    let kind = effect.card().target;
    let body = model.bodies.iter().find(|body| body.name == target);
    let sizes = match body {
        Some(body) if kind == TargetKind::Body => Target::Body(body.scale.clone()),
        _ => example_of(effect),
    };
    effect
        .parameters(&sizes)
        .into_iter()
        .map(|parameter| parameter.name)
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hydro_gap::plant::Plant as _;
    use hydro_plugin::mujoco::plant::MujocoPlant;

    use super::*;

    /// The names must be those that the plugin reads: a link is long along z, a hull along x.
    #[test]
    fn names_are_those_of_the_body() {
        let text = r#"<mujoco><option density="1000"/><worldbody>
            <body name="hull"><freejoint/><geom type="ellipsoid" size="0.4 0.2 0.1" mass="30"/>
            <body name="link"><joint name="hinge"/>
            <geom type="ellipsoid" size="0.03 0.02 0.2" mass="1"/></body></body></worldbody></mujoco>"#;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("nominal.xml");
        std::fs::write(&path, text).unwrap();
        let plant = MujocoPlant::load(&path).unwrap();
        let names = |id, target: &str| parameter_names(plant.description(), id, target);
        assert_eq!(names(Id::CrossFlowDrag, "hull"), ["sway", "heave"]);
        assert_eq!(names(Id::CrossFlowDrag, "link"), ["surge", "sway"]);
        assert_eq!(names(Id::JointDamping, "hinge"), ["damping"]);
        // An actuator's name may be a body's.
        assert_eq!(names(Id::ActuatorDelay, "link"), ["delay"]);
    }
}
