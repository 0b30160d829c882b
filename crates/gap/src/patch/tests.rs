//! The whole writer, on small models.
#![allow(clippy::unwrap_used)]

use std::{fs, path::Path};

use hydro_effects::{
    Entry, Id, TargetKind,
    card::{BodyScale, JointScale},
};
use proptest::prelude::*;

use super::*;
use crate::plant::{
    Inertial, Nuisance, NuisanceClass, PlantBody, PlantDescription, PlantJoint, Quantity,
};

/// Names of the parameters, as far as the tests go.
pub(super) fn names(_: &PlantDescription, effect: Id, _: &str) -> Vec<String> {
    let names: &[&str] = match effect {
        Id::ActuatorGain => &["gain"],
        Id::ActuatorDeadband => &["width"],
        Id::ActuatorLag => &["time_constant"],
        Id::ActuatorDelay => &["delay"],
        Id::InflowThrustLoss => &["slope"],
        Id::JointFriction => &["coulomb", "stribeck", "stribeck_speed"],
        Id::JointDamping => &["damping"],
        Id::JointArmature => &["armature"],
        Id::JointStiffness => &["stiffness", "reference"],
        Id::JointBacklash => &["play"],
        Id::NetBuoyancy => &["force", "moment_x", "moment_y", "moment_z"],
        Id::Payload => &["mass", "x", "y", "z"],
        _ => &["x", "y", "z"],
    };
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn description() -> PlantDescription {
    PlantDescription {
        timestep: 0.002,
        nq: 8,
        nv: 7,
        state_len: 16,
        bodies: vec![PlantBody {
            name: "fin".to_owned(),
            root: false,
            moves: true,
            only_dof: None,
            end: true,
            wet: true,
            floats: false,
            bulk: 0.01,
            scale: BodyScale {
                mass: 0.5,
                inertia: [0.01; 3],
                extent: [0.1; 3],
                volume: 1e-3,
                hull_volume: 1e-3,
                buoyancy_left_out: 0.0,
                density: 1000.0,
                gravity: 9.81,
                speed: 0.0,
                rate: 0.0,
            },
            inertial: Inertial {
                mass: 0.5,
                position: [0.0; 3],
                attitude: [1.0, 0.0, 0.0, 0.0],
                moments: [0.01; 3],
                compensation: 0.0,
            },
        }],
        base: None,
        joints: vec![PlantJoint {
            name: "hinge".to_owned(),
            qpos: 7,
            dof: 6,
            start: 0.0,
            scale: JointScale {
                inertia: 0.02,
                armature: 0.0,
                damping: 0.0,
                torque: 1.0,
                speed: 0.0,
                travel: 0.0,
                middle: 0.0,
                slides: false,
                driven: true,
            },
            pushes: Vec::new(),
            stiffness: 3.0,
            damping: 0.0,
            is_coordinate: false,
            is_level: false,
        }],
        actuators: Vec::new(),
        sensors: Vec::new(),
        nuisances: Vec::new(),
        wrench_bodies: Vec::new(),
        waterline: 0.0,
        has_surface: false,
        walls: Vec::new(),
        medium: hydro_effects::Medium::Water,
        has_fluid: true,
    }
}

const MODEL: &str = r#"<mujoco model="fish">
  <!-- A comment that stays. -->
  <compiler angle="radian"/>
  <option timestep="0.002" density="1000"/>
  <worldbody>
    <body name="hull">
      <freejoint/>
      <geom size="0.2"/>
      <site name="cell"/>
      <body name="fin">
        <joint name="hinge" axis="0 0 1"/>
        <geom size="0.1"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="servo" joint="hinge"/>
  </actuator>
  <sensor>
    <force name="scale" site="cell" noise="0.1"/>
    <gyro name="gyro" site="cell"/>
  </sensor>
  <keyframe>
    <key qpos="0 0 0 1 0 0 0 0.1"/>
  </keyframe>
</mujoco>
"#;

fn entry(effect: Id, target: &str, parameters: &[f64]) -> Entry {
    Entry {
        effect,
        target: target.to_owned(),
        parameters: parameters.to_vec(),
    }
}

fn patched(text: &str, entries: &[Entry]) -> Result<Patched, PatchError> {
    renumbered(text, entries, &[])
}

fn renumbered(
    text: &str,
    entries: &[Entry],
    numbers: &[(Nuisance, f64)],
) -> Result<Patched, PatchError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("nominal.xml");
    fs::write(&path, text).unwrap();
    patch(&Request {
        nominal: &path,
        entries,
        description: &description(),
        numbers,
        names,
        search: &[],
    })
}

/// Lines that a patch takes away and adds.
fn difference(text: &str, entries: &[Entry]) -> (Vec<String>, Vec<String>) {
    let patched = patched(text, entries).unwrap();
    let lines = diff(text, &patched.xml);
    let of = |kind| -> Vec<String> {
        lines
            .iter()
            .filter(|line| line.kind == kind)
            .map(|line| line.text.trim().to_owned())
            .collect()
    };
    (of(DiffKind::Removed), of(DiffKind::Added))
}

#[test]
fn no_effect_changes_no_byte() {
    let same = patched(MODEL, &[]).unwrap();
    assert_eq!(same.xml, MODEL);
    let sensors = [entry(Id::SensorBias, "gyro", &[0.1, 0.0, 0.0])];
    let same = patched(MODEL, &sensors).unwrap();
    assert_eq!(same.xml, MODEL);
    assert!(same.written.is_empty());
}

#[test]
fn a_native_form_is_a_line() {
    let (removed, added) = difference(
        MODEL,
        &[
            entry(Id::JointDamping, "hinge", &[0.3]),
            entry(Id::ActuatorGain, "servo", &[0.8]),
            entry(Id::Current, "hull", &[0.2, 0.0, 0.0]),
        ],
    );
    assert_eq!(
        removed,
        [
            "<option timestep=\"0.002\" density=\"1000\"/>",
            "<joint name=\"hinge\" axis=\"0 0 1\"/>",
            "<motor name=\"servo\" joint=\"hinge\"/>"
        ]
    );
    assert_eq!(
        added,
        [
            "<option timestep=\"0.002\" density=\"1000\" wind=\"0.2 0 0\"/>",
            "<joint name=\"hinge\" axis=\"0 0 1\" damping=\"0.3\"/>",
            "<general name=\"servo\" joint=\"hinge\" gainprm=\"0.8\"/>"
        ]
    );
}

#[test]
fn play_shifts_the_key_frame() {
    let (_, added) = difference(MODEL, &[entry(Id::JointBacklash, "hinge", &[0.02])]);
    assert!(added[0].starts_with("<joint name=\"hinge_play\" axis=\"0 0 1\""));
    assert_eq!(added[1], "<key qpos=\"0 0 0 1 0 0 0 0.1 0\"/>");
}

#[test]
fn no_play_is_nothing_to_write() {
    let none = patched(MODEL, &[entry(Id::JointBacklash, "hinge", &[0.0])]).unwrap();
    assert_eq!(none.xml, MODEL);
    assert_eq!(none.written[0].form, "nothing: no play");
}

/// The rotor of the joint with play is the nominal's, as in the fit, whatever is added to it.
#[test]
fn armature_leaves_the_joint_of_play_alone() {
    let play = entry(Id::JointBacklash, "hinge", &[0.02]);
    let (_, alone) = difference(MODEL, std::slice::from_ref(&play));
    let armature = entry(Id::JointArmature, "hinge", &[0.3]);
    let (_, both) = difference(MODEL, &[armature, play]);
    assert!(both.iter().any(|line| line.contains("armature=\"0.3\"")));
    let extra = |lines: &[String]| {
        let extra = lines.iter().find(|line| line.contains("hinge_play"));
        extra.cloned().unwrap()
    };
    assert_eq!(extra(&alone), extra(&both));
}

#[test]
fn what_mjcf_cannot_say_is_the_plugins_and_weighed() {
    let entries = [
        entry(Id::LinearDrag, "fin", &[1.0, 2.0, 3.0]),
        entry(Id::ActuatorDeadband, "servo", &[0.1]),
        entry(Id::NetBuoyancy, "fin", &[2.0, 0.0, 0.0, 0.0]),
        entry(Id::Current, "hull", &[0.2, 0.0, 0.0]),
    ];
    let patched = patched(MODEL, &entries).unwrap();
    let forms: Vec<&str> = patched
        .written
        .iter()
        .map(|written| written.form.as_str())
        .collect();
    assert_eq!(
        forms,
        [
            "hydro.wrench on `fin`",
            "hydro.wrench on `fin`",
            "hydro.wrench on `fin`",
            "option wind"
        ]
    );
    for part in [
        "{\"effect\":\"linear_drag\",\"target\":\"fin\",\"parameters\":{\"x\":1.0,\"y\":2.0,\"z\":3.0}}",
        "<config key=\"density\" value=\"1000\"/>",
        "wind=\"0.2 0 0\"",
        "<plugin name=\"scale\" plugin=\"hydro.load_cell\">",
        "<plugin plugin=\"hydro.load_cell\"/>",
        "<!-- noise 0.1 -->",
        "<!-- A comment that stays. -->",
    ] {
        assert!(patched.xml.contains(part), "{part}\n{}", patched.xml);
    }
    assert!(patched.remarks[0].contains("`scale` became a load cell"));
}

#[test]
fn a_current_moves_the_water_of_the_plugin_where_there_is_no_other() {
    let dry = MODEL.replace(" density=\"1000\"", "");
    let current = entry(Id::Current, "hull", &[0.2, 0.0, 0.0]);
    let drag = entry(Id::AddedMass, "fin", &[1.0, 2.0, 3.0]);
    let both = patched(&dry, &[current.clone(), drag]).unwrap();
    assert_eq!(both.written[0].form, "current of hydro.wrench");
    assert!(
        both.xml
            .contains("<config key=\"current\" value=\"0.2 0 0\"/>")
    );
    assert!(both.xml.contains("<body name=\"fin_water\"/>"));
    let alone = patched(&dry, &[current]).unwrap();
    assert_eq!(alone.written[0].form, "hydro.wrench on `hull`");
    assert!(alone.xml.contains("{\"effect\":\"current\""));
}

#[test]
fn what_comes_before_the_plugin_is_the_plugins() {
    let late = entry(Id::ActuatorDelay, "servo", &[0.02]);
    let dead = entry(Id::ActuatorDeadband, "servo", &[0.1]);
    let alone = patched(MODEL, std::slice::from_ref(&late)).unwrap();
    assert_eq!(alone.written[0].form, "delay of the actuator");
    let both = patched(MODEL, &[late.clone(), dead]).unwrap();
    assert_eq!(both.written[0].form, "hydro.wrench on `hull`");
    let text = patched(MODEL, &[late.clone(), late])
        .unwrap_err()
        .to_string();
    assert!(
        text.contains("actuator_delay acts on `servo` already"),
        "{text}"
    );
}

#[test]
fn buoyancy_that_nothing_weighs_is_gravity_compensation() {
    let free = MODEL.replace("<force name=\"scale\" site=\"cell\" noise=\"0.1\"/>", "");
    let (_, added) = difference(
        &free,
        &[entry(Id::NetBuoyancy, "fin", &[0.981, 0.0, 0.0, 0.0])],
    );
    assert_eq!(added, ["<body name=\"fin\" gravcomp=\"0.2\">"]);
}

#[test]
fn a_target_that_is_not_there_lists_what_is() {
    for (effect, target, kind, existing) in [
        (Id::LinearDrag, "tail", "body", "hull, fin"),
        (Id::JointDamping, "knee", "joint", "hinge"),
        (Id::ActuatorLag, "motor", "actuator", "servo"),
    ] {
        let values = vec![0.1; names(&description(), effect, "").len()];
        let text = patched(MODEL, &[entry(effect, target, &values)])
            .unwrap_err()
            .to_string();
        assert!(
            text.contains(&format!("the {kind} `{target}`")) && text.contains(existing),
            "{text}"
        );
    }
}

#[test]
fn values_are_counted_and_must_be_numbers() {
    let text = |values: &[f64]| {
        patched(MODEL, &[entry(Id::JointStiffness, "hinge", values)])
            .unwrap_err()
            .to_string()
    };
    assert!(text(&[1.0]).contains("has 1 values, expected 2: stiffness, reference"));
    assert!(text(&[1.0, f64::NAN]).contains("`reference` is NaN"));
}

#[test]
fn a_model_that_is_none_is_refused() {
    let text = patched("<mujoco><worldbody></mujoco>", &[])
        .unwrap_err()
        .to_string();
    assert!(text.contains("nominal.xml"), "{text}");
    let text = patched("<robot/>", &[]).unwrap_err().to_string();
    assert!(text.contains("expected <mujoco>"), "{text}");
    let folder = tempfile::tempdir().unwrap();
    let request = Request {
        nominal: &folder.path().join("none.xml"),
        entries: &[],
        description: &description(),
        numbers: &[],
        names,
        search: &[],
    };
    let text = patch(&request).unwrap_err().to_string();
    assert!(text.contains("none.xml"), "{text}");
}

/// Elements and attributes that the writer looks at, with words and numbers that it may not expect.
fn element() -> impl Strategy<Value = String> {
    let tag = prop::sample::select(vec![
        "body",
        "joint",
        "freejoint",
        "geom",
        "site",
        "default",
        "option",
        "compiler",
        "actuator",
        "motor",
        "position",
        "general",
        "muscle",
        "sensor",
        "force",
        "torque",
        "plugin",
        "extension",
        "instance",
        "config",
        "worldbody",
        "keyframe",
        "key",
        "mesh",
        "frame",
        "tendon",
        "inertial",
        "attach",
    ]);
    let key = prop::sample::select(vec![
        "name",
        "class",
        "childclass",
        "joint",
        "site",
        "instance",
        "plugin",
        "key",
        "value",
        "qpos",
        "act",
        "gainprm",
        "kp",
        "damping",
        "stiffness",
        "type",
        "file",
        "meshdir",
        "delay",
        "gravcomp",
        "wind",
        "density",
        "mass",
        "fullinertia",
        "quat",
        "inertiafromgeom",
        "fluidcoef",
        "fluidshape",
        "springdamper",
        "dampratio",
        "checkpoint",
    ]);
    let value = prop::sample::select(vec![
        "hull",
        "fin",
        "hinge",
        "servo",
        "ellipsoid",
        "hydro.wrench",
        "effects",
        "",
        "1",
        "-2e9",
        "1 2 3",
        "nan",
        "\u{e9}",
        "&lt;",
        "{}",
        "x/y.obj",
        "true",
        "user",
    ]);
    let head = (tag, prop::collection::vec((key, value), 0..4)).prop_map(|(tag, attributes)| {
        let mut seen = Vec::new();
        let mut head = tag.to_owned();
        for (key, value) in attributes {
            if !seen.contains(&key) {
                seen.push(key);
                head.push_str(&format!(" {key}='{value}'"));
            }
        }
        (tag.to_owned(), head)
    });
    let leaf = head.clone().prop_map(|(_, head)| format!("<{head}/>"));
    leaf.prop_recursive(4, 40, 6, move |inner| {
        (
            head.clone(),
            prop::collection::vec(inner, 0..6),
            any::<bool>(),
        )
            .prop_map(|((tag, head), inner, breaks)| {
                let gap = if breaks { "\n  " } else { "" };
                format!("<{head}>{gap}{}<!-- c --></{tag}>", inner.join(gap))
            })
    })
}

/// Every kind of number, on whatever there may be.
fn numbers() -> Vec<(Nuisance, f64)> {
    let value = Quantity::EffectValue {
        instance: 0,
        entry: 0,
        value: 0,
    };
    [
        (Quantity::Mass, "fin"),
        (Quantity::Inertia(1), "fin"),
        (Quantity::CentreOfMass(2), "fin"),
        (Quantity::FluidCoefficient(0), "fluid"),
        (Quantity::Density, "fluid"),
        (Quantity::Viscosity, "fluid"),
        (Quantity::Gain, "servo"),
        (Quantity::Damping, "hinge"),
        (Quantity::Stiffness(0), "hinge"),
        (value, "hull"),
        (Quantity::Wrench(5), "water"),
    ]
    .into_iter()
    .map(|(quantity, element)| {
        let nuisance = Nuisance {
            name: format!("{element}.{quantity:?}"),
            element: element.to_owned(),
            class: NuisanceClass::Mass,
            quantity,
        };
        (nuisance, 0.05)
    })
    .collect()
}

#[test]
fn every_number_is_written_or_told_of() {
    let numbers = numbers();
    let text = MODEL.replace(
        "name=\"hinge\"",
        "name=\"hinge\" damping=\"0.2 0.1\" stiffness=\"3\"",
    );
    let patched = renumbered(&text, &[], &numbers).unwrap();
    let shown: Vec<String> = patched.numbers.iter().map(ToString::to_string).collect();
    assert_eq!(
        shown,
        [
            "fin.Mass 0.5 -> 0.525 kg",
            "fin.Inertia(1) 0.01 -> 0.0105 kg m^2",
            "fin.CentreOfMass(2) 0 -> 0.05 m",
            "fluid.FluidCoefficient(0) 1 -> 1.05 x nominal",
            "fluid.Density 1000 -> 1050 kg/m^3",
            "servo.Gain 1 -> 1.05 x nominal",
            "hinge.Damping 0 -> 0 N m s/rad",
            "hinge.Stiffness(0) 3 -> 3.15 N m/rad",
        ]
    );
    assert_eq!(patched.remarks.len(), numbers.len() - shown.len());
    assert!(patched.remarks[0].contains("stays at its nominal value, though +5.00 % was fitted"));
    let wrong: Vec<(Nuisance, f64)> = numbers
        .iter()
        .map(|(nuisance, _)| (nuisance.clone(), f64::NAN))
        .collect();
    let kept = renumbered(&text, &[], &wrong).unwrap();
    assert_eq!(
        (kept.xml.as_str(), kept.remarks.len()),
        (text.as_str(), wrong.len())
    );
}

#[test]
fn an_effect_is_added_to_the_number() {
    let free = MODEL
        .replace("<force name=\"scale\" site=\"cell\" noise=\"0.1\"/>", "")
        .replace("name=\"hinge\"", "name=\"hinge\" damping=\"0.2\"");
    let entries = [
        entry(Id::JointDamping, "hinge", &[0.3]),
        entry(Id::ActuatorGain, "servo", &[0.8]),
        entry(Id::NetBuoyancy, "fin", &[0.981, 0.0, 0.0, 0.0]),
    ];
    let mut numbers = numbers();
    numbers.retain(|(nuisance, _)| !matches!(nuisance.quantity, Quantity::CentreOfMass(_)));
    let text = renumbered(&free, &entries, &numbers).unwrap().xml;
    for part in [
        "damping=\"0.51\"",
        "gainprm=\"0.84\"",
        "gravcomp=\"0.190476190476\"",
        "mass=\"0.525\"",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn no_model_makes_it_panic(
        sections in prop::collection::vec(element(), 0..8),
        which in prop::collection::vec((0..Id::ALL.len(), 0..3usize), 0..6),
        value in prop::sample::select(vec![0.0, 0.7, -1.0, 1e300, 1e-300]),
    ) {
        let text = format!("<mujoco>{}</mujoco>", sections.concat());
        let entries: Vec<Entry> = which
            .into_iter()
            .map(|(effect, target)| {
                let effect = Id::ALL[effect];
                let values = vec![value; names(&description(), effect, "").len()];
                entry(effect, ["hull", "hinge", "servo"][target], &values)
            })
            .collect();
        if let Ok(patched) = renumbered(&text, &entries, &numbers()) {
            prop_assert!(Mjcf::parse(&patched.xml, Path::new("p.xml")).is_ok());
        }
    }

    #[test]
    fn a_well_formed_model_stays_so(
        inside in prop::collection::vec(element(), 0..4),
        effect in 0..Id::ALL.len(),
        value in 0.001..3.0,
    ) {
        let effect = Id::ALL[effect];
        let inside: String = inside.concat().replace("worldbody", "geom");
        let text = MODEL.replace("<geom size=\"0.1\"/>", &inside);
        let target = match hydro_effects::effect(effect).card().target {
            TargetKind::Body | TargetKind::Sensor => "hull",
            TargetKind::Joint => "hinge",
            TargetKind::Actuator => "servo",
        };
        let values = vec![value; names(&description(), effect, "").len()];
        if let Ok(patched) = renumbered(&text, &[entry(effect, target, &values)], &numbers()) {
            prop_assert!(Mjcf::parse(&patched.xml, Path::new("p.xml")).is_ok());
        }
    }
}
