//! The contract of refitted numbers: a model with numbers and effects written into it moves as the nominal
//! does with its nuisance parameters turned and the effects added.
#![cfg(mujoco_plugins)]

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use hydro_effects::{Entry, Id, Target, effect};
use hydro_gap::{
    patch::{self, Patched, Request},
    plant::{Nuisance, Plant, PlantDescription, Quantity, Simulation},
};
use hydro_plugin::mujoco::plant::MujocoPlant;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Steps of a comparison.
const STEPS: usize = 200;
/// Deviation of the numbers, relative.
const LEVEL: f64 = 0.1;
/// Deviation of the centres of mass [m].
const WAY: f64 = 0.01;
/// Greatest difference of two runs, relative to the largest value.
const SAME: f64 = 1e-8;

/// Names of an effect's parameters.
fn names(id: Id) -> Vec<String> {
    use hydro_effects::TargetKind;
    // They do not depend on sizes; a plant of everything has one of each kind.
    thread_local! {
        static SIZES: MujocoPlant = load(ANY, &tempfile::tempdir().unwrap());
    }
    SIZES.with(|plant| {
        let description = plant.description();
        let sizes = match effect(id).card().target {
            TargetKind::Body => Target::Body(description.bodies[0].scale.clone()),
            TargetKind::Joint => Target::Joint(description.joints[0].scale.clone()),
            kind => panic!("no test has an effect on a {kind:?} but a gain"),
        };
        let parameters = effect(id).parameters(&sizes);
        parameters.into_iter().map(|of| of.name).collect()
    })
}

fn names_of(_: &PlantDescription, id: Id, _: &str) -> Vec<String> {
    match id {
        Id::ActuatorGain => vec!["gain".to_owned()],
        _ => names(id),
    }
}

const ANY: &str = r#"<mujoco><worldbody><body name="b"><joint name="j"/><geom size="0.1"/></body></worldbody></mujoco>"#;

fn load(text: &str, folder: &tempfile::TempDir) -> MujocoPlant {
    let path = folder.path().join("model.xml");
    fs::write(&path, text).unwrap();
    MujocoPlant::load(&path).unwrap()
}

fn entry(effect: Id, target: &str, parameters: &[f64]) -> Entry {
    Entry {
        effect,
        target: target.to_owned(),
        parameters: parameters.to_vec(),
    }
}

/// Values of nuisance parameters such that every body keeps moments that a body can have.
fn turned(plant: &MujocoPlant, seed: u64, wanted: impl Fn(&Nuisance) -> bool) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let description = plant.description();
    let mut moments: BTreeMap<&str, [f64; 3]> = BTreeMap::new();
    for body in &description.bodies {
        let was = body.inertial.moments;
        for attempt in 0..1000 {
            // A slender body has room for what all three share alone.
            let common = rng.random_range(-LEVEL..LEVEL);
            let own = if attempt < 900 { LEVEL } else { 1e-3 };
            let values: [f64; 3] =
                std::array::from_fn(|_| common + own * rng.random_range(-0.5..0.5));
            let [a, b, c]: [f64; 3] =
                std::array::from_fn(|axis| was[axis] * hydro_gap::plant::factor(values[axis]));
            if a + b > c && a + c > b && b + c > a {
                moments.insert(&body.name, values);
                break;
            }
        }
    }
    let value = |nuisance: &Nuisance| match nuisance.quantity {
        Quantity::Inertia(axis) => moments
            .get(nuisance.element.as_str())
            .map_or(0.0, |of| of[axis]),
        Quantity::CentreOfMass(_) => rng.random_range(-WAY..WAY),
        // No number of a model: the patch says so and writes none.
        of if of.is_of_log() => 0.0,
        _ => rng.random_range(-LEVEL..LEVEL),
    };
    let mut value = value;
    description
        .nuisances
        .iter()
        .map(|nuisance| {
            let value = value(nuisance);
            if wanted(nuisance) { value } else { 0.0 }
        })
        .collect()
}

fn written(path: &Path, plant: &MujocoPlant, nuisances: &[f64], entries: &[Entry]) -> Patched {
    let numbers: Vec<(Nuisance, f64)> = plant
        .description()
        .nuisances
        .iter()
        .cloned()
        .zip(nuisances.iter().copied())
        .collect();
    patch::patch(&Request {
        nominal: path,
        entries,
        numbers: &numbers,
        description: plant.description(),
        names: names_of,
        search: &[],
    })
    .unwrap()
}

/// Steps under controls that excite everything; every position, velocity and reading.
fn run(simulation: &mut dyn Simulation, plant: &MujocoPlant) -> Vec<Vec<f64>> {
    let actuators = &plant.description().actuators;
    let start = simulation.qpos().to_vec();
    let speeds: Vec<f64> = (0..simulation.qvel().len())
        .map(|dof| 0.2 * (1.0 + dof as f64).sin())
        .collect();
    simulation.set_motion(0.0, &start, &speeds);
    let mut rows = Vec::with_capacity(STEPS);
    for step in 0..STEPS {
        let control: Vec<f64> = actuators
            .iter()
            .enumerate()
            .map(|(at, actuator)| {
                let wave = (0.03 * step as f64 * (1.0 + 0.2 * at as f64) + at as f64).sin();
                let [low, high] = actuator.range.unwrap_or([-1.0, 1.0]);
                0.5 * (low + high) + 0.3 * (high - low) * wave
            })
            .collect();
        simulation.set_control(&control);
        simulation.step();
        let mut row = simulation.qpos().to_vec();
        row.extend(simulation.qvel());
        row.extend(simulation.sensors());
        rows.push(row);
    }
    assert!(!simulation.diverged());
    rows
}

/// The largest difference of two runs, in parts of the largest value of each column.
fn difference(one: &[Vec<f64>], other: &[Vec<f64>]) -> f64 {
    let mut worst = 0.0_f64;
    for column in 0..one[0].len() {
        let size = one.iter().map(|row| row[column].abs()).fold(1e-2, f64::max);
        for (one, other) in one.iter().zip(other) {
            assert_eq!(one.len(), other.len());
            worst = worst.max((one[column] - other[column]).abs() / size);
        }
    }
    worst
}

/// Writes numbers and effects into the model of a file, and holds the two against each other.
fn check(path: &Path, entries: &[Entry], seed: u64, wanted: impl Fn(&Nuisance) -> bool) -> Patched {
    let plant = MujocoPlant::load(path).unwrap();
    let nuisances = turned(&plant, seed, wanted);
    let patched = written(path, &plant, &nuisances, entries);
    let folder = tempfile::tempdir().unwrap();
    let after = load(&patched.xml, &folder);
    let mut wanted = plant.simulation(&nuisances, entries).unwrap();
    let mut found = after
        .simulation(&vec![0.0; after.description().nuisances.len()], &[])
        .unwrap();
    let wanted = run(wanted.as_mut(), &plant);
    let found = run(found.as_mut(), &plant);
    let difference = difference(&wanted, &found);
    assert!(
        difference < SAME,
        "{} {entries:?} differs by {difference:.1e}\n{}",
        path.display(),
        patched.xml
    );
    let turned = nuisances.iter().filter(|value| **value != 0.0).count();
    assert_eq!(patched.numbers.len(), turned, "{:?}", patched.remarks);
    patched
}

fn check_text(text: &str, entries: &[Entry]) -> Patched {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("nominal.xml");
    fs::write(&path, text).unwrap();
    check(&path, entries, 7, |_| true)
}

fn nominal(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("mjcf/gap")
        .join(name)
}

#[test]
fn nominals_of_the_workflow() {
    for name in ["vehicle.xml", "leg.xml", "b1_tow.xml"] {
        for seed in [1, 2] {
            check(&nominal(name), &[], seed, |_| true);
        }
    }
}

#[test]
fn a_nominal_with_a_checkpoint() {
    let patched = check(&nominal("b1_swim.xml"), &[], 3, |_| true);
    assert!(patched.xml.contains("key=\"wrench_scale\""));
}

#[test]
fn numbers_and_effects_on_the_same_element() {
    let vehicle = [
        entry(Id::ActuatorGain, "thruster_2", &[0.85]),
        entry(Id::Payload, "hull", &[1.5, 0.1, -0.05, 0.02]),
        entry(Id::Current, "hull", &[0.2, -0.1, 0.05]),
    ];
    check(&nominal("vehicle.xml"), &vehicle, 4, |_| true);
    // A payload would move the centre at which net buoyancy acts.
    let added = [
        entry(Id::AddedMass, "hull", &[10.0, 14.0, 17.0, 0.2, 0.4, 0.4]),
        entry(Id::NetBuoyancy, "hull", &[3.0, 0.0, 0.0, 0.0]),
    ];
    check(&nominal("vehicle.xml"), &added, 5, |_| true);
    let leg = [
        entry(Id::JointDamping, "thigh_joint", &[0.7]),
        entry(Id::ActuatorGain, "calf_servo", &[1.2]),
        entry(Id::NetBuoyancy, "calf", &[1.0, 0.0, 0.0, 0.0]),
    ];
    check(&nominal("leg.xml"), &leg, 6, |_| true);
}

/// A hull with an arm: all that a text can say of inertia, damping, fluid and gain.
fn robot(top: &str, hull: &str, arm: &str, joint: &str, actuators: &str) -> String {
    format!(
        r#"<mujoco>
  {top}
  <worldbody>
    <body name="hull" gravcomp="0.9">
      <freejoint/>
      {hull}
      <body name="arm" pos="0.3 0 0" gravcomp="0.4">
        <joint name="elbow" axis="0 1 0" {joint}/>
        {arm}
        <body name="hand" pos="0.2 0 0"><joint name="wrist" type="slide" axis="1 0 0" stiffness="30"/>
          <geom type="box" size="0.05 0.04 0.03" mass="0.8"/></body>
      </body>
    </body>
  </worldbody>
  <actuator>{actuators}</actuator>
  <sensor><jointpos joint="elbow"/><jointvel joint="wrist"/></sensor>
</mujoco>"#
    )
}

const HULL: &str =
    r#"<geom type="ellipsoid" size="0.3 0.2 0.15" mass="10" pos="0.01 0 0" euler="0 10 0"/>"#;
const ARM: &str = r#"<geom type="capsule" size="0.04" fromto="0 0 0 0.2 0 0.05" mass="1.5"/><geom size="0.06" pos="0.1 0.05 0" mass="0.5"/>"#;
const SERVO: &str = r#"<position name="elbow" joint="elbow" kp="20" kv="1"/><motor name="wrist" joint="wrist" gear="3"/>"#;

#[test]
fn inertia_of_geoms_and_of_every_notation() {
    let ellipsoids = |text: &str| text.replace("<geom ", "<geom fluidshape=\"ellipsoid\" ");
    let water = r#"<option density="1000" viscosity="0.001"/>"#;
    let full =
        r#"<inertial pos="0.02 0 0.01" mass="9" fullinertia="0.2 0.3 0.35 0.01 0.02 -0.01"/>"#;
    let turned =
        r#"<inertial pos="0.02 0 0.01" mass="9" diaginertia="0.2 0.3 0.35" euler="20 0 30"/>"#;
    let framed = r#"<frame pos="0.01 0 0" euler="0 0 20"><inertial pos="0 0.01 0" mass="9" diaginertia="0.2 0.3 0.35"/></frame>"#;
    for (top, hull) in [
        (water.to_owned(), ellipsoids(HULL)),
        (water.to_owned(), format!("{}\n{full}", ellipsoids(HULL))),
        (water.to_owned(), format!("{turned}{}", ellipsoids(HULL))),
        (water.to_owned(), format!("{framed}{HULL}")),
        (
            format!("{water}<compiler inertiafromgeom=\"true\"/>"),
            format!("{turned}{HULL}"),
        ),
        (
            format!("<compiler inertiafromgeom=\"true\" inertiagrouprange=\"0 1\"/>{water}"),
            format!("{HULL}<geom size=\"0.1\" group=\"3\" mass=\"5\"/>"),
        ),
        (
            format!("<compiler balanceinertia=\"true\" boundmass=\"0\"/>{water}"),
            HULL.to_owned(),
        ),
    ] {
        let text = robot(&top, &hull, ARM, "damping=\"0.5\"", SERVO);
        check_text(&text, &[]);
        let effects = [
            entry(Id::NetBuoyancy, "hand", &[1.0, 0.0, 0.0, 0.0]),
            entry(Id::JointDamping, "elbow", &[0.3]),
            entry(Id::ActuatorGain, "wrist", &[0.7]),
            entry(Id::Payload, "arm", &[0.4, 0.1, 0.0, 0.02]),
        ];
        check_text(&text, &effects);
    }
}

#[test]
fn classes_and_what_the_compiler_tunes() {
    let top = r#"<option density="1000" viscosity="0.01" integrator="implicitfast"/>
  <default>
    <joint damping="0.4 0.2 0.1"/>
    <geom fluidcoef="0.7 0.3"/>
    <position kp="30" dampratio="0.8"/>
    <default class="wet"><geom fluidshape="ellipsoid"/>
      <default class="thin"><geom fluidcoef="0.9 0.2 1.1 0.5 0.4"/></default></default>
    <default class="tuned"><joint springdamper="0.3 0.9"/></default>
  </default>"#;
    let hull = HULL.replace("<geom ", "<geom class=\"wet\" ");
    let arm = ARM.replace("<geom ", "<geom class=\"thin\" ");
    for joint in [
        "",
        "damping=\"0.6\"",
        "damping=\"0.6 0.1\"",
        "class=\"tuned\"",
        "springdamper=\"0.2 1\" damping=\"1 0.1\"",
    ] {
        for actuators in [
            r#"<position name="elbow" joint="elbow"/>"#,
            r#"<position name="elbow" joint="elbow" kp="12" kv="0.3" forcerange="-3 3"/>"#,
            r#"<general name="elbow" joint="elbow" biastype="affine" gainprm="15" biasprm="0 -15 1"/>"#,
            r#"<velocity name="elbow" joint="elbow" kv="2"/><damper name="d" joint="wrist" kv="1" ctrlrange="0 1"/>"#,
        ] {
            check_text(&robot(top, &hull, &arm, joint, actuators), &[]);
        }
    }
    // MuJoCo's own coefficients, which no text says.
    let own = top.replace("<geom fluidcoef=\"0.7 0.3\"/>", "");
    check_text(&robot(&own, &hull, &arm, "", SERVO), &[]);
}

#[test]
fn a_box_fluid_and_effects_of_the_nominal() {
    let top = r#"<option density="1000" viscosity="0.01"/>
  <extension><plugin plugin="hydro.wrench"><instance name="w"><config key="effects" value='{"schema":
    "hydro-effects/1", "effects": [{"effect": "linear_drag", "target": "hull", "parameters": {"surge": 10,
    "sway": 20, "heave": 20, "roll": 1, "pitch": 2, "yaw": 2}}, {"effect": "joint_damping", "target": "elbow",
    "parameters": {"damping": 0.2}}]}'/></instance></plugin></extension>"#;
    let hull = format!("<plugin plugin=\"hydro.wrench\" instance=\"w\"/>{HULL}");
    let text = robot(top, &hull, ARM, "damping=\"0.5\"", SERVO);
    let patched = check_text(&text, &[]);
    let shown: Vec<String> = patched.numbers.iter().map(ToString::to_string).collect();
    for part in ["fluid.density 1000 -> ", "hull.linear_drag.surge 1 -> "] {
        assert!(shown.iter().any(|line| line.starts_with(part)), "{shown:?}");
    }
    let more = [entry(Id::LinearDrag, "hull", &[1.0; 6])];
    check_text(&text, &more);
}

#[test]
fn numbers_at_zero_leave_the_text_as_it_is() {
    let path = nominal("leg.xml");
    let plant = MujocoPlant::load(&path).unwrap();
    let zeros = vec![0.0; plant.description().nuisances.len()];
    let patched = written(&path, &plant, &zeros, &[]);
    assert_eq!(patched.xml, fs::read_to_string(&path).unwrap());
    assert!(patched.numbers.is_empty() && patched.remarks.is_empty());
}

#[test]
fn what_cannot_be_written_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let patched = |text: &str| {
        let plant = load(text, &folder);
        let nuisances = vec![0.1; plant.description().nuisances.len()];
        let patched = written(&folder.path().join("model.xml"), &plant, &nuisances, &[]);
        (plant, patched)
    };
    // A rod: its greatest moments are equal, and ten per cent more of all stay so; one alone breaks it.
    let rod = r#"<mujoco><worldbody><body name="rod"><freejoint/><inertial pos="0 0 0" mass="1"
        diaginertia="1 1 0.01"/></body></worldbody></mujoco>"#;
    let plant = load(rod, &folder);
    let description = plant.description();
    let nuisances: Vec<f64> = description
        .nuisances
        .iter()
        .map(|nuisance| f64::from(u8::from(nuisance.quantity == Quantity::Inertia(0))) * 0.1)
        .collect();
    let bent = written(&folder.path().join("model.xml"), &plant, &nuisances, &[]);
    assert!(
        bent.remarks[0].contains("are impossible"),
        "{:?}",
        bent.remarks
    );
    load(&bent.xml, &folder);
    let unnamed = r#"<mujoco><worldbody><body><joint damping="1"/><geom size="0.1"/></body></worldbody></mujoco>"#;
    let (plant, kept) = patched(unnamed);
    assert_eq!(kept.xml, unnamed);
    assert_eq!(kept.remarks.len(), plant.description().nuisances.len());
    assert!(
        kept.remarks[0].contains("names no body"),
        "{:?}",
        kept.remarks
    );
    let total = unnamed
        .replace("<worldbody>", "<compiler settotalmass=\"3\"/><worldbody>")
        .replace("<body>", "<body name=\"b\">");
    let (_, kept) = patched(&total);
    assert!(
        kept.remarks
            .iter()
            .any(|line| line.contains("settotalmass")),
        "{:?}",
        kept.remarks
    );
    assert_eq!(kept.xml, total);
}

/// The wrench that a sensor of the plugin reads.
#[test]
fn a_checkpoints_wrench_is_scaled_and_its_effects_are_not() {
    let text = fs::read_to_string(nominal("b1_swim.xml")).unwrap();
    let sensor = "<sensor><plugin name=\"water\" plugin=\"hydro.wrench\" instance=\"water\"/>";
    let text = text.replace("<sensor>", sensor);
    let with = |configs: &str| {
        let anchor = "<config key=\"density\" value=\"1000\" />";
        assert!(text.contains(anchor));
        text.replace(anchor, &format!("{anchor}{configs}"))
    };
    let reading = |text: &str| {
        let plant = load(text, &tempfile::tempdir().unwrap());
        let sensor = &plant.description().sensors;
        let at = sensor
            .iter()
            .find(|sensor| sensor.name == "water")
            .unwrap()
            .start;
        let nuisances = vec![0.0; plant.description().nuisances.len()];
        let mut simulation = plant.simulation(&nuisances, &[]).unwrap();
        let start = simulation.qpos().to_vec();
        simulation.set_motion(0.0, &start, &vec![0.3; simulation.qvel().len()]);
        simulation.step();
        simulation.sensors()[at..at + 6].to_vec()
    };
    let scale = "<config key=\"wrench_scale\" value=\"1 1.5 2 0.5 1 3\"/>";
    let push = r#"<config key="effects" value='{"schema":"hydro-effects/1","effects":[{"effect":"constant_force","target":"trunk","parameters":{PARAMETERS}}]}'/>"#;
    let parameters: Vec<String> = names(Id::ConstantForce)
        .iter()
        .map(|name| format!("\"{name}\":2.0"))
        .collect();
    let push = push.replace("PARAMETERS", &parameters.join(","));
    for engine in ["fused", "fused-f16", "fused-i16", "candle"] {
        let engine = format!("<config key=\"engine\" value=\"{engine}\"/>");
        let plain = reading(&with(&engine));
        let scaled = reading(&with(&format!("{engine}{scale}")));
        for (axis, factor) in [1.0, 1.5, 2.0, 0.5, 1.0, 3.0].into_iter().enumerate() {
            assert!(plain[axis] != 0.0);
            assert!((scaled[axis] - factor * plain[axis]).abs() < 1e-12 * plain[axis].abs());
        }
        let pushed = reading(&with(&format!("{engine}{push}")));
        let both = reading(&with(&format!("{engine}{push}{scale}")));
        for axis in 0..6 {
            let (one, other) = (pushed[axis] - plain[axis], both[axis] - scaled[axis]);
            assert!((one - other).abs() < 1e-9, "{axis}: {one} {other}");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.xml");
    fs::write(&path, with(&scale.replace("1.5 2", "-1.5 2"))).unwrap();
    let refusal = MujocoPlant::load(&path).unwrap_err().to_string();
    assert!(
        refusal.contains("wrench_scale") && refusal.contains("six factors"),
        "{refusal}"
    );
}
