//! Patched models beside nominal ones that are changed by hand, in the real Python wheel:
//! `scripts/tests/test_patched.py`.

use std::{fs, path::Path, process::Command};

use hydro_effects::{
    Entry, Id,
    card::{BodyScale, JointScale},
};
use hydro_gap::{
    patch::{self, Request},
    plant::{Inertial, PlantBody, PlantDescription, PlantJoint},
};
use serde_json::{Value, json};

/// Mass of the fin [kg].
const FIN: f64 = 0.5;

/// A fish with a fin on a hinge and a trim weight on a rail.
fn fish(top: &str, hinge: &str, actuators: &str) -> String {
    format!(
        r#"<mujoco model="fish">
  <option timestep="0.002" density="1000" viscosity="0.001" integrator="implicitfast"/>
  {top}
  <worldbody>
    <body name="hull">
      <freejoint/>
      <geom type="ellipsoid" size="0.3 0.1 0.12" mass="12"/>
      <site name="cell"/>
      <body name="weight">
        <joint name="rail" type="slide" axis="1 0 0" damping="3"/>
        <geom type="sphere" size="0.05" mass="2"/>
      </body>
      <body name="fin" pos="-0.3 0 0">
        <joint name="hinge" axis="0 0 1" {hinge}/>
        <geom type="capsule" size="0.02" fromto="0 0 0 -0.2 0 0" mass="{FIN}"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    {actuators}
    <motor name="other" joint="rail"/>
  </actuator>
  <keyframe>
    <key name="bent" qpos="0 0 0 1 0 0 0 0.1 0.2"/>
  </keyframe>
</mujoco>
"#
    )
}

fn names(_: &PlantDescription, effect: Id, _: &str) -> Vec<String> {
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

/// Description of the fish as compiled.
fn description() -> PlantDescription {
    let joint = |name: &str, qpos, inertia, slides| PlantJoint {
        name: name.to_owned(),
        qpos,
        dof: qpos - 1,
        start: 0.0,
        scale: JointScale {
            armature: 0.0,
            damping: 0.0,
            inertia,
            torque: 1.0,
            speed: 0.0,
            travel: 0.0,
            middle: 0.0,
            slides,
            driven: true,
        },
        pushes: Vec::new(),
        stiffness: 0.0,
        damping: 0.0,
        is_coordinate: false,
        is_level: false,
    };
    PlantDescription {
        timestep: 0.002,
        nq: 9,
        nv: 8,
        state_len: 18,
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
                mass: FIN,
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
            inertial: Inertial::default(),
        }],
        base: None,
        joints: vec![joint("rail", 7, 2.0, true), joint("hinge", 8, 0.007, false)],
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

/// Models that are written for the Python side, and what they are.
struct Cases<'a> {
    folder: &'a Path,
    list: Vec<Value>,
}

impl Cases<'_> {
    fn add(&mut self, model: &str, effect: Id, target: &str, parameters: &[f64]) {
        let name = format!("{effect}_{}", self.list.len());
        let nominal = format!("{name}.xml");
        fs::write(self.folder.join(&nominal), model).unwrap();
        let entry = Entry {
            effect,
            target: target.to_owned(),
            parameters: parameters.to_vec(),
        };
        let native = self.patch(&nominal, &name, &[entry]);
        self.list.push(json!({
            "name": name, "nominal": nominal, "patched": format!("{name}_patched.xml"),
            "effect": effect, "target": target, "parameters": parameters, "native": native,
        }));
    }

    /// Writes a patched model; true where it needs no plugin.
    fn patch(&self, nominal: &str, name: &str, entries: &[Entry]) -> bool {
        let nominal = self.folder.join(nominal);
        let patched = patch::patch(&Request {
            nominal: &nominal,
            entries,
            description: &description(),
            numbers: &[],
            names,
            search: &[],
        })
        .unwrap();
        let path = self.folder.join(format!("{name}_patched.xml"));
        patch::save(&patched.xml, &path).unwrap();
        assert!(patch::save("<mujoco/>", &path).is_err());
        !patched.xml.contains("hydro.")
    }
}

const DEFAULTS: [&str; 9] = [
    "",
    "<default><position kp=\"30\" kv=\"0.5\"/></default>",
    "<default><position kp=\"3\" dampratio=\"0.7\"/></default>",
    "<default><general gainprm=\"7\" biastype=\"affine\" biasprm=\"0.1 -2 -0.3\" gear=\"2\"/></default>",
    "<default><general dyntype=\"filter\" dynprm=\"0.05\" gainprm=\"2\"/></default>",
    "<default><velocity kv=\"0.3\"/><motor gear=\"2\" ctrlrange=\"-0.7 0.7\"/></default>",
    "<default><motor forcerange=\"-0.4 0.4\"/><default class=\"c\"><position kp=\"5\"/></default></default>",
    "<default><position kp=\"5\"/><default class=\"c\"><velocity kv=\"0.4\"/></default></default>",
    "<default><damper kv=\"0.2\"/><default class=\"c\"><general biasprm=\"0 -1 0.5\" biastype=\"affine\"/></default></default>",
];

const ACTUATORS: [&str; 12] = [
    "<motor name=\"servo\" joint=\"hinge\"/>",
    "<motor name=\"servo\" joint=\"hinge\" ctrlrange=\"-0.5 0.5\" forcerange=\"-0.3 0.3\" gear=\"3\"/>",
    "<position name=\"servo\" joint=\"hinge\"/>",
    "<position name=\"servo\" joint=\"hinge\" kp=\"4\" kv=\"0.1\" forcerange=\"-0.6 0.6\"/>",
    "<position name=\"servo\" joint=\"hinge\" kp=\"4\" dampratio=\"1\"/>",
    "<position name=\"servo\" joint=\"hinge\" kp=\"4\" timeconst=\"0.03\"/>",
    "<velocity name=\"servo\" joint=\"hinge\"/>",
    "<general name=\"servo\" joint=\"hinge\"/>",
    "<general name=\"servo\" joint=\"hinge\" gaintype=\"affine\" gainprm=\"1 0.2 -0.1\" biastype=\"affine\"/>",
    "<damper name=\"servo\" joint=\"hinge\" kv=\"0.1\" ctrlrange=\"0 1\"/>",
    "<cylinder name=\"servo\" joint=\"hinge\" area=\"0.5\" bias=\"0.1 0 -0.01\"/>",
    "<intvelocity name=\"servo\" joint=\"hinge\" kp=\"2\" kv=\"0.1\" actrange=\"-1 1\"/>",
];

fn actuators(cases: &mut Cases<'_>) {
    for defaults in DEFAULTS {
        for actuator in ACTUATORS {
            let classed = actuator.replace(" joint=", " class=\"c\" joint=");
            let mut actuators = vec![actuator.to_owned()];
            if defaults.contains("class") {
                actuators.push(classed);
            }
            for actuator in actuators {
                let model = fish(defaults, "damping=\"0.05\"", &actuator);
                cases.add(&model, Id::ActuatorGain, "servo", &[0.6]);
                cases.add(&model, Id::ActuatorLag, "servo", &[0.04]);
            }
        }
    }
    for (actuator, seconds) in [(0, 0.0131), (2, 0.002), (3, 0.2), (6, 0.0025)] {
        let model = fish("", "damping=\"0.05\"", ACTUATORS[actuator]);
        cases.add(&model, Id::ActuatorDelay, "servo", &[seconds]);
    }
    let model = fish("", "", ACTUATORS[0]);
    cases.add(&model, Id::ActuatorDeadband, "servo", &[0.1]);
}

fn joints(cases: &mut Cases<'_>) {
    let radian = "<compiler angle=\"radian\"/>";
    let class =
        "<default><joint damping=\"0.03 0.01\" stiffness=\"0.5\" frictionloss=\"0.01\"/></default>";
    for top in ["", radian, class] {
        for joint in [
            "",
            "armature=\"0.01\" springref=\"0.1\"",
            "ref=\"0.3\" damping=\"0.1\"",
        ] {
            let model = fish(top, joint, ACTUATORS[3]);
            cases.add(&model, Id::JointDamping, "hinge", &[0.2]);
            cases.add(&model, Id::JointArmature, "hinge", &[0.03]);
            cases.add(&model, Id::JointStiffness, "hinge", &[0.4, 0.3]);
            cases.add(&model, Id::JointFriction, "hinge", &[0.05, 0.0, 0.1]);
            cases.add(&model, Id::JointBacklash, "hinge", &[0.1]);
        }
        let model = fish(top, "", ACTUATORS[3]);
        cases.add(&model, Id::JointDamping, "rail", &[2.0]);
        cases.add(&model, Id::JointArmature, "rail", &[3.0]);
        cases.add(&model, Id::JointStiffness, "rail", &[20.0, 0.05]);
        cases.add(&model, Id::JointBacklash, "rail", &[0.01]);
        cases.add(&model, Id::JointFriction, "rail", &[1.0, 1.0, 0.1]);
    }
}

fn bodies(cases: &mut Cases<'_>) {
    for top in ["", "<compiler inertiafromgeom=\"true\"/>"] {
        let model = fish(top, "", ACTUATORS[3]);
        cases.add(&model, Id::Payload, "hull", &[1.5, 0.1, -0.05, 0.2]);
        cases.add(&model, Id::Payload, "fin", &[0.3, -0.1, 0.0, 0.02]);
        cases.add(&model, Id::NetBuoyancy, "fin", &[2.0, 0.0, 0.0, 0.0]);
        cases.add(&model, Id::Current, "hull", &[0.3, -0.1, 0.0]);
        cases.add(&model, Id::LinearDrag, "fin", &[1.0, 2.0, 3.0]);
    }
}

/// A model whose mesh stands in another folder and whose parts are included.
fn files(cases: &mut Cases<'_>) {
    const MESH: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    let include =
        "<mujocoinclude><asset><mesh name=\"near\" file=\"near.obj\"/></asset></mujocoinclude>";
    let body = "<worldbody><body name=\"hull\"><freejoint/><geom type=\"mesh\" mesh=\"far\"/>\
                <geom type=\"mesh\" mesh=\"near\"/></body></worldbody>";
    for folder in ["meshes", "parts"] {
        fs::create_dir(cases.folder.join(folder)).unwrap();
    }
    fs::write(cases.folder.join("meshes/far.obj"), MESH).unwrap();
    fs::write(
        cases.folder.join("parts/near.obj"),
        MESH.replace("0 0 1", "0 0 2"),
    )
    .unwrap();
    fs::write(cases.folder.join("parts/near.xml"), include).unwrap();
    for (name, compiler, far) in [
        ("files_folder", "<compiler meshdir=\"meshes\"/>", "far.obj"),
        ("files_none", "", "meshes/far.obj"),
        (
            "files_both",
            "<compiler assetdir=\"meshes/\" angle=\"radian\"/>",
            "far.obj",
        ),
    ] {
        let model = format!(
            "<mujoco>\n  {compiler}\n  <asset><mesh name=\"far\" file=\"{far}\"/></asset>\n  \
             <include file=\"parts/near.xml\"/>\n  {body}\n</mujoco>"
        );
        fs::write(cases.folder.join(format!("{name}.xml")), model).unwrap();
        cases.patch(&format!("{name}.xml"), name, &[]);
        cases.list.push(json!({
            "name": name, "nominal": format!("{name}.xml"), "patched": format!("{name}_patched.xml"),
            "effect": "files", "target": "", "parameters": [], "native": true,
        }));
    }
}

#[test]
fn patched_models_in_python() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = root.join(".venv/bin/python");
    if !python.exists() {
        return crate::skip_python::without_venv();
    }
    let folder = tempfile::tempdir().unwrap();
    let mut cases = Cases {
        folder: folder.path(),
        list: Vec::new(),
    };
    actuators(&mut cases);
    joints(&mut cases);
    bodies(&mut cases);
    files(&mut cases);
    fs::write(
        folder.path().join("cases.json"),
        serde_json::to_string(&cases.list).unwrap(),
    )
    .unwrap();
    let status = Command::new(&python)
        .arg(root.join("scripts/tests/test_patched.py"))
        .env("HYDRO_TEST_PATCHED", folder.path())
        .status()
        .unwrap();
    assert!(status.success());
}
