//! A nominal MJCF: included files, paths, and the patch. The first byte says which effects are written; a zero byte parts the
//! model from the file `part.xml` beside it. What is written is well-formed, and can be patched again.

use std::path::Path;

use hydro_effects::{Entry, Id, effect};
use hydro_gap::{
    patch::{
        self, CheckpointWrench, PatchError, Patched, Request, add_checkpoint_wrench, diff, patch,
    },
    plant::PlantDescription,
};

use super::{
    folder, refused,
    robot::{self, ACTUATOR, BODIES, JOINTS},
};

/// Reads a model and patches it.
pub fn read(bytes: &[u8]) -> bool {
    let Some((first, files)) = bytes.split_first() else {
        return false;
    };
    let mut files = files.splitn(2, |byte| *byte == 0);
    let [model, part] = [files.next(), files.next()].map(Option::unwrap_or_default);
    folder::put("mjcf/part.xml", part);
    let path = folder::put("mjcf/nominal.xml", model);
    let entries = entries(*first);
    let patched = match written(&path, &entries) {
        Ok(patched) => patched,
        Err(error) => return refused(&error),
    };
    let nominal = String::from_utf8_lossy(model);
    let _ = (
        diff(&nominal, &patched.xml),
        patch::unified(&nominal, &patched.xml, ("a", "b")),
    );
    // What was inlined and made absolute stays as it is.
    let again = folder::put("mjcf/patched.xml", patched.xml.as_bytes());
    let same = written(&again, &[]).expect("it is well-formed");
    assert_eq!(same.xml, patched.xml);
    let wrench = CheckpointWrench {
        body: BODIES[0],
        checkpoint: Path::new("/nowhere"),
        density: 1000.0,
        current: [0.0; 3],
    };
    if let Err(error) = add_checkpoint_wrench(patched, &path, &wrench) {
        refused(&error);
    }
    true
}

fn written(path: &Path, entries: &[Entry]) -> Result<Patched, PatchError> {
    patch(&Request {
        nominal: path,
        entries,
        description: &robot::description(),
        numbers: &[],
        names,
        search: &[],
    })
}

fn names(_: &PlantDescription, id: Id, target: &str) -> Vec<String> {
    let target = robot::target(effect(id).card().target, target);
    let parameters = effect(id).parameters(&target);
    parameters.into_iter().map(|of| of.name).collect()
}

/// Sets of effects that are written in every form.
fn entries(which: u8) -> Vec<Entry> {
    let [hull, fin] = BODIES;
    let [hinge, mast] = JOINTS;
    let lists: [&[(Id, &str)]; 6] = [
        &[],
        &[
            (Id::ActuatorGain, ACTUATOR),
            (Id::JointDamping, hinge),
            (Id::JointStiffness, mast),
            (Id::Current, hull),
        ],
        &[
            (Id::ActuatorLag, ACTUATOR),
            (Id::JointFriction, hinge),
            (Id::NetBuoyancy, hull),
        ],
        &[
            (Id::ActuatorDelay, ACTUATOR),
            (Id::JointBacklash, hinge),
            (Id::JointBacklash, mast),
        ],
        &[
            (Id::Payload, fin),
            (Id::LinearDrag, fin),
            (Id::AddedMass, hull),
        ],
        &[
            (Id::ActuatorDeadband, ACTUATOR),
            (Id::QuadraticDrag, hull),
            (Id::NetBuoyancy, fin),
        ],
    ];
    let list = lists[usize::from(which) % lists.len()];
    let entry = |(id, name): &(Id, &str)| {
        let target = robot::target(effect(*id).card().target, name);
        let parameters = effect(*id).parameters(&target);
        let value = |of: &hydro_effects::Parameter| (of.null + 0.1).clamp(of.lower, of.upper);
        Entry {
            effect: *id,
            target: (*name).to_owned(),
            parameters: parameters.iter().map(value).collect(),
        }
    };
    list.iter().map(entry).collect()
}
