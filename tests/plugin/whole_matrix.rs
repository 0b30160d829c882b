//! Whole matrices in MuJoCo's step: beside the six numbers, against the equation of motion, energy, refusals.
#![cfg(mujoco_plugins)]

use std::sync::Arc;

use hydro_effects::{Id, Motion, effect, fossen::VehicleTable};
use hydro_plugin::mujoco::simulator::{Data, Model};
use nalgebra::{Matrix6, Vector3, Vector6};

/// A box of 8 kg with its frame off the middle of its geom, without gravity, with these effects.
fn scene(effects: &str) -> String {
    format!(
        r#"<mujoco><option gravity="0 0 0" timestep="0.002"/>
        <extension><plugin plugin="hydro.wrench"><instance name="water"><config key="effects" value='{effects}'/>
        </instance></plugin></extension>
        <worldbody><body name="hull"><freejoint/>
          <geom type="box" size="0.3 0.15 0.1" pos="0.02 -0.01 0.03" mass="8"/>
          <plugin plugin="hydro.wrench" instance="water"/><body name="hull_water"/>
        </body></worldbody></mujoco>"#
    )
}

fn loaded(effects: &str) -> Data {
    let model = Model::from_xml(&scene(effects)).unwrap();
    Data::new(&Arc::new(model)).unwrap()
}

fn file(effects: &[(&str, String)]) -> String {
    let effects: Vec<String> = effects
        .iter()
        .map(|(effect, parameters)| {
            format!(r#"{{"effect": "{effect}", "target": "hull", "parameters": {parameters}}}"#)
        })
        .collect();
    format!(
        r#"{{"schema": "hydro-effects/1", "effects": [{}]}}"#,
        effects.join(", ")
    )
}

fn rows(matrix: &Matrix6<f64>) -> Vec<Vec<f64>> {
    let rows = matrix.row_iter();
    rows.map(|row| row.iter().copied().collect()).collect()
}

fn whole(matrix: &Matrix6<f64>, point: &str) -> String {
    format!(r#"{{"matrix": {:?}{point}}}"#, rows(matrix))
}

const NAMES: [&str; 6] = ["surge", "sway", "heave", "roll", "pitch", "yaw"];
const MASSES: [f64; 6] = [6.0, 12.0, 18.0, 0.2, 0.3, 0.4];
const DRAGS: [f64; 6] = [20.0, 30.0, 40.0, 0.5, 0.7, 0.8];

fn six(values: [f64; 6]) -> String {
    let fields = NAMES.iter().zip(values);
    let fields: Vec<String> = fields
        .map(|(name, value)| format!("\"{name}\": {value}"))
        .collect();
    format!("{{{}}}", fields.join(", "))
}

/// Symmetric, with couplings of every kind.
fn coupled() -> Matrix6<f64> {
    let mut matrix = Matrix6::from_diagonal(&Vector6::from(MASSES));
    for (row, column, value) in [
        (0, 1, 2.0),
        (0, 4, 0.8),
        (1, 3, -0.6),
        (1, 5, 1.1),
        (2, 4, -1.3),
        (3, 5, 0.1),
    ] {
        (matrix[(row, column)], matrix[(column, row)]) = (value, value);
    }
    matrix
}

fn thrown(data: &mut Data) {
    data.qvel_mut()
        .copy_from_slice(&[0.7, -0.3, 0.4, 0.9, -1.2, 0.6]);
}

#[test]
fn a_diagonal_matrix_moves_as_the_six_numbers_do() {
    let diagonal = |values: [f64; 6]| whole(&Matrix6::from_diagonal(&Vector6::from(values)), "");
    let mut ends = [six as fn([f64; 6]) -> String, diagonal].map(|written| {
        let mut data = loaded(&file(&[
            ("added_mass", written(MASSES)),
            ("linear_drag", written(DRAGS)),
            ("quadratic_drag", written(DRAGS)),
        ]));
        thrown(&mut data);
        for _ in 0..500 {
            data.step();
        }
        data.qpos().to_vec()
    });
    let [six, whole] = &mut ends;
    for (six, whole) in six.iter().zip(whole) {
        assert!((six - *whole).abs() < 1e-12, "{six} {whole}");
    }
}

/// (M + A + h D) a = forces, at the level attitude, where the axes of body and world are the same.
#[test]
fn accelerations_are_those_of_the_equation_of_motion() {
    let point = [0.1, 0.0, -0.05];
    let drag = Matrix6::from_diagonal(&Vector6::from(DRAGS))
        + 0.1 * (coupled() - coupled().transpose())
        + Matrix6::from_fn(|row, column| if (row, column) == (0, 4) { 0.4 } else { 0.0 });
    let place = format!(r#", "point": {point:?}"#);
    let mut data = loaded(&file(&[
        ("added_mass", whole(&coupled(), &place)),
        ("linear_drag", whole(&drag, &place)),
    ]));
    thrown(&mut data);
    data.forward();

    let (m, centre) = (8.0, Vector3::new(0.02, -0.01, 0.03));
    let moments = [0.1_f64, 0.15, 0.3].map(|half| half * half);
    let [z, y, x] = moments;
    let inertia = nalgebra::Matrix3::from_diagonal(&Vector3::new(y + z, x + z, x + y)) * (m / 3.0);
    let lever = centre.cross_matrix();
    let about_origin = inertia - m * lever * lever;
    let mut total = Matrix6::identity() * m;
    total.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-m * lever));
    total.fixed_view_mut::<3, 3>(3, 0).copy_from(&(m * lever));
    total.fixed_view_mut::<3, 3>(3, 3).copy_from(&about_origin);

    let nu = Vector6::from_column_slice(data.qvel());
    let omega = nu.fixed_rows::<3>(3).into_owned();
    let force = -m * omega.cross(&omega.cross(&centre));
    let torque = -omega.cross(&(about_origin * omega));
    let mut wrench = Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
    let motion = Motion {
        linear: [nu[0], nu[1], nu[2]],
        angular: omega.into(),
        ..Motion::default()
    };
    for (id, matrix) in [(Id::AddedMass, coupled()), (Id::LinearDrag, drag)] {
        let values: Vec<f64> = rows(&matrix).concat().into_iter().chain(point).collect();
        let part = effect(id).body_part(&values).unwrap();
        wrench += Vector6::from(part.wrench(&values, &motion, &[]));
        total += part.inertia(&values, &motion).unwrap_or_default();
        if id == Id::LinearDrag {
            let damping = part.damping(&values, &motion, &[]).unwrap();
            total += (damping + damping.transpose()) * (0.5 * 0.002);
        }
    }
    let expected = total.lu().solve(&wrench).unwrap();
    for (found, expected) in data.qacc().iter().zip(expected.iter()) {
        assert!(
            (found - expected).abs() < 1e-9 * expected.abs().max(1.0),
            "{found} {expected}"
        );
    }
}

/// Without drag nothing is lost: kinetic energy of body and water, under Runge-Kutta.
#[test]
fn a_coupled_added_mass_keeps_energy() {
    let effects = file(&[(
        "added_mass",
        whole(&coupled(), r#", "point": [0.1, 0, -0.05]"#),
    )]);
    let text = scene(&effects).replace(
        "timestep=\"0.002\"",
        "timestep=\"0.002\" integrator=\"RK4\"",
    );
    let model = Arc::new(Model::from_xml(&text).unwrap());
    let mut data = Data::new(&model).unwrap();
    thrown(&mut data);
    let energy = |data: &Data| {
        let qvel = data.qvel();
        let q = data.qpos();
        let attitude = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            q[3], q[4], q[5], q[6],
        ));
        let v = attitude.inverse() * Vector3::new(qvel[0], qvel[1], qvel[2]);
        let omega = Vector3::new(qvel[3], qvel[4], qvel[5]);
        let at = |point: Vector3<f64>| v + omega.cross(&point);
        let there = at(Vector3::new(0.1, 0.0, -0.05));
        let nu = Vector6::new(there.x, there.y, there.z, omega.x, omega.y, omega.z);
        let [z, y, x] = [0.1_f64, 0.15, 0.3].map(|half| half * half);
        let moments = Vector3::new(y + z, x + z, x + y) * (8.0 / 3.0);
        let own = 8.0 * at(Vector3::new(0.02, -0.01, 0.03)).norm_squared()
            + omega.dot(&moments.component_mul(&omega));
        0.5 * (own + nu.dot(&(coupled() * nu)))
    };
    let before = energy(&data);
    for _ in 0..5000 {
        data.step();
    }
    let after = energy(&data);
    assert!((after / before - 1.0).abs() < 1e-6, "{before} {after}");
}

#[test]
fn a_bluerov2_from_its_table_is_dragged_to_rest() {
    let table = "X_udot = -6.36\nY_vdot = -7.12\nZ_wdot = -18.68\nK_pdot = -0.189\nM_qdot = -0.135\nN_rdot = -0.222\n\
        X_u = -13.7\nZ_w = -33\nM_q = -0.8\nX_uu = -141\nY_vv = -217\nZ_ww = -190\nK_pp = -1.19\nM_qq = -0.47\nN_rr = -1.5\n";
    let effects = VehicleTable::parse(table).unwrap().to_json("hull").unwrap();
    let mut data = loaded(&effects);
    thrown(&mut data);
    for _ in 0..5000 {
        data.step();
    }
    let speed = data
        .qvel()
        .iter()
        .fold(0.0_f64, |most, value| most.max(value.abs()));
    assert!(speed < 0.1, "{speed}");
}

#[test]
fn what_no_body_can_have_does_not_load() {
    let refusal = |effect: &str, matrix: Matrix6<f64>| {
        let text = scene(&file(&[(effect, whole(&matrix, ""))]));
        Model::from_xml(&text).unwrap_err().to_string()
    };
    let mut skewed = coupled();
    skewed[(0, 1)] = 0.0;
    let text = refusal("added_mass", skewed);
    assert!(
        text.contains("attribute `effects`")
            && text.contains("surge, sway is 0 and sway, surge is 2 [kg]"),
        "{text}"
    );
    let text = refusal("linear_drag", -coupled());
    assert!(text.contains("eigenvalue"), "{text}");
    // The inertia of a free body alone, its frame in its middle, has no room for products.
    let text = scene(&file(&[("added_mass", whole(&coupled(), ""))]))
        .replace("<body name=\"hull_water\"/>", "")
        .replace("pos=\"0.02 -0.01 0.03\"", "");
    let text = Model::from_xml(&text).unwrap_err().to_string();
    assert!(text.contains("hull_water"), "{text}");
}
