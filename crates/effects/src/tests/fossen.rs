//! Vehicles' tables, as they were published, turned into effects; every refusal.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::fixture::{Model, still};
use crate::{EffectSet, Id, effect, fossen::VehicleTable};

/// M. von Benzon et al., An Open-Source Benchmark Simulator: Control of a BlueROV2 Underwater Robot, J. Mar. Sci. Eng. 10(12),
/// 1898, 2022.
const BLUEROV2: &str = r#"
convention = "ned"
X_udot = -6.36
Y_vdot = -7.12
Z_wdot = -18.68
K_pdot = -0.189
M_qdot = -0.135
N_rdot = -0.222
X_u = -13.7
Y_v = 0
Z_w = -33
K_p = 0
M_q = -0.8
N_r = 0
X_uu = -141
Y_vv = -217
Z_ww = -190
K_pp = -1.19
M_qq = -0.47
N_rr = -1.5
"#;

/// T. Prestero, Verification of a Six-Degree of Freedom Simulation Model for the REMUS Autonomous Underwater Vehicle, MIT and
/// WHOI 2001: cross-flow drag, added mass, and some of the products of velocities.
const REMUS: &str = r#"
left_out = ["X_wq", "Y_uv", "Z_uq"]
X_udot = -0.930
Y_vdot = -35.5
Y_rdot = 1.93
Z_wdot = -35.5
Z_qdot = -1.93
K_pdot = -0.0704
M_wdot = -1.93
M_qdot = -4.88
N_vdot = 1.93
N_rdot = -4.88
"X_u|u|" = -1.62
"Y_v|v|" = -1310
"Y_r|r|" = 0.632
"Z_w|w|" = -131
"Z_q|q|" = -0.632
"K_p|p|" = -0.130
"M_w|w|" = 3.18
"M_q|q|" = -188
"N_v|v|" = -3.18
"N_r|r|" = -94.0
X_wq = -35.5
Y_uv = -28.6
Z_uq = -5.22
"#;

/// Girona 500 as UWSim simulates it (`dynamics_g500.yaml`, IRS Lab, Jaume I University): matrices as uuv_simulator has them.
const GIRONA500: &str = r#"{
    "added_mass": [49, 0, 0, 0, 0, 0,  0, 49, 0, 0, 0, 0,  0, 0, 49, 0, 0, 0,
                   0, 0, 0, 0, 0, 0,  0, 0, 0, 0, 0, 0,  0, 0, 0, 0, 0, 0],
    "linear_damping": [0, 0, 0, -130, -130, -130],
    "quadratic_damping": [-148, -148, -148, -180, -180, -180]
}"#;

/// The long-range vehicle Tethys in gz-sim's tutorial on added mass: tags of the plugin `Hydrodynamics`.
const TETHYS: &str = r#"
convention = "flu"
xDotU = -4.876161
yDotV = -126.324739
zDotW = -126.324739
kDotP = 0
mDotQ = -33.46
nDotR = -33.46
xUabsU = -6.2282
xU = 0
yVabsV = -601.27
yV = 0
zWabsW = -601.27
zW = 0
kPabsP = -0.1916
kP = 0
mQabsQ = -632.698957
mQ = 0
nRabsR = -632.698957
nR = 0
"#;

fn table(text: &str) -> VehicleTable {
    VehicleTable::parse(text).expect("a table")
}

fn refusal(text: &str) -> String {
    let fault = VehicleTable::parse(text).and_then(|table| table.to_json("hull"));
    fault.expect_err("it should be refused").to_string()
}

fn diagonal(values: [f64; 6]) -> Option<Matrix6<f64>> {
    Some(Matrix6::from_diagonal(&Vector6::from(values)))
}

#[test]
fn every_table_makes_a_file_that_loads() {
    for (text, count) in [(BLUEROV2, 3), (REMUS, 2), (GIRONA500, 3), (TETHYS, 3)] {
        let written = table(text).to_json("hull").expect("a file");
        assert!(!written.contains("-0.0,"), "{written}");
        let set = EffectSet::parse(&written, &Model).expect("it loads");
        assert_eq!(set.entries.len(), count);
        assert_eq!(table(text).effects("hull"), Ok(set));
    }
}

#[test]
fn a_bluerov2_is_its_public_numbers_with_positive_signs() {
    let found = table(BLUEROV2);
    assert_eq!(
        found.added_mass,
        diagonal([6.36, 7.12, 18.68, 0.189, 0.135, 0.222])
    );
    assert_eq!(
        found.linear_drag,
        diagonal([13.7, 0.0, 33.0, 0.0, 0.8, 0.0])
    );
    assert_eq!(
        found.quadratic_drag,
        diagonal([141.0, 217.0, 190.0, 1.19, 0.47, 1.5])
    );
    assert_eq!(found.point, [0.0; 3]);
    // A diagonal is the same in both frames.
    assert_eq!(table(&BLUEROV2.replace("ned", "flu")), found);
    let set = found.effects("hull").expect("effects");
    let ids: Vec<Id> = set.entries.iter().map(|of| of.effect).collect();
    assert_eq!(ids, [Id::AddedMass, Id::LinearDrag, Id::QuadraticDrag]);
}

#[test]
fn a_girona500_has_uuv_simulators_lists() {
    let found = table(GIRONA500);
    assert_eq!(
        found.added_mass,
        diagonal([49.0, 49.0, 49.0, 0.0, 0.0, 0.0])
    );
    assert_eq!(
        found.linear_drag,
        diagonal([0.0, 0.0, 0.0, 130.0, 130.0, 130.0])
    );
    assert_eq!(
        found.quadratic_drag,
        diagonal([148.0, 148.0, 148.0, 180.0, 180.0, 180.0])
    );
}

#[test]
fn gz_sims_tags_are_derivatives() {
    let found = table(TETHYS);
    let masses = [4.876161, 126.324739, 126.324739, 0.0, 33.46, 33.46];
    assert_eq!(found.added_mass, diagonal(masses));
    assert_eq!(found.linear_drag, diagonal([0.0; 6]));
    let drags = [6.2282, 601.27, 601.27, 0.1916, 632.698957, 632.698957];
    assert_eq!(found.quadratic_drag, diagonal(drags));
}

#[test]
fn a_remus_is_symmetric_after_the_change_of_frame() {
    let found = table(REMUS);
    let added = found.added_mass.expect("an added mass");
    assert_eq!(added, added.transpose());
    assert_eq!((added[(1, 5)], added[(2, 4)]), (-1.93, 1.93));
    assert!(found.linear_drag.is_none());
    let drag = found.quadratic_drag.expect("a drag");
    assert_eq!((drag[(1, 5)], drag[(5, 1)]), (-0.632, 3.18));
    assert_eq!((drag[(2, 4)], drag[(4, 2)]), (0.632, -3.18));
    assert_eq!(
        drag.diagonal(),
        Vector6::new(1.62, 1310.0, 131.0, 0.13, 188.0, 94.0)
    );
}

/// Prestero's added-mass forces, his equations of section 4.3 with the products of velocities written out (X_wq = Z_wdot,
/// X_qq = Z_qdot, ...), against the effect. His frame is forward, starboard, down.
#[test]
fn a_remus_feels_presteros_products_of_velocities() {
    let (xu, yv, yr, zw, zq, kp) = (-0.930, -35.5, 1.93, -35.5, -1.93, -0.0704);
    let (mw, mq, nv, nr) = (-1.93, -4.88, 1.93, -4.88);
    let (u, v, w, p, q, r) = (1.3, -0.4, 0.3, 0.5, -0.7, 0.6);
    let expected = [
        zw * w * q + zq * q * q - yv * v * r - yr * r * r,
        xu * u * r - zw * w * p - zq * p * q,
        -xu * u * q + yv * v * p + yr * r * p,
        // K: of the hull of revolution nothing but what cancels in his table.
        -(yv - zw) * v * w - (yr + zq) * w * r + (mw + nv) * v * q - (mq - nr) * q * r,
        -(zw - xu) * u * w - yr * v * p + (kp - nr) * r * p - zq * u * q,
        -(xu - yv) * u * v + zq * w * p - (kp - mq) * p * q + yr * u * r,
    ];
    let turn = [1.0, -1.0, -1.0];
    let mut motion = still();
    motion.linear = std::array::from_fn(|axis| turn[axis] * [u, v, w][axis]);
    motion.angular = std::array::from_fn(|axis| turn[axis] * [p, q, r][axis]);
    let set = table(REMUS).effects("hull").expect("effects");
    let values = &set.entries[0].parameters;
    let part = effect(Id::AddedMass).body_part(values).expect("a body");
    // Components that do not change: the origin accelerates by omega x v.
    let carried = Vector3::from(motion.angular).cross(&Vector3::from(motion.linear));
    let acceleration = Vector6::new(carried.x, carried.y, carried.z, 0.0, 0.0, 0.0);
    let inertia = part.inertia(values, &motion).expect("inertia");
    let found = Vector6::from(part.wrench(values, &motion, &[])) - inertia * acceleration;
    for (axis, expected) in expected.into_iter().enumerate() {
        let found = turn[axis % 3] * found[axis];
        assert!(
            (found - expected).abs() < 1e-12,
            "{axis}: {found} {expected}"
        );
    }
    // Cross-flow drag, his equations of section 4.2.
    let values = &set.entries[1].parameters;
    let part = effect(Id::QuadraticDrag).body_part(values).expect("a body");
    let found = part.wrench(values, &motion, &[]);
    let expected = [
        -1.62 * u * u.abs(),
        -1310.0 * v * v.abs() + 0.632 * r * r.abs(),
        -131.0 * w * w.abs() - 0.632 * q * q.abs(),
        -0.130 * p * p.abs(),
        3.18 * w * w.abs() - 188.0 * q * q.abs(),
        -3.18 * v * v.abs() - 94.0 * r * r.abs(),
    ];
    for (axis, expected) in expected.into_iter().enumerate() {
        let found = turn[axis % 3] * found[axis];
        assert!(
            (found - expected).abs() < 1e-10,
            "{axis}: {found} {expected}"
        );
    }
}

/// Surge and roll with the other four: half a turn about x changes the sign of these couplings alone.
#[test]
fn couplings_change_their_sign_with_the_frame() {
    let names = ["X_udot", "Y_vdot", "Z_wdot", "K_pdot", "M_qdot", "N_rdot"];
    let masses: String = names.iter().map(|name| format!("{name} = -20\n")).collect();
    let columns = ["u", "v", "w", "p", "q", "r"];
    for (row, known) in names.iter().enumerate() {
        for (column, letter) in columns
            .iter()
            .enumerate()
            .filter(|(column, _)| *column != row)
        {
            let name = format!("{}_{letter}dot", &known[..1]);
            let of = |convention: &str| {
                let text = format!("convention = \"{convention}\"\n{masses}{name} = -3\n");
                table(&text).added_mass.expect("an added mass")[(row, column)]
            };
            let changes = row.is_multiple_of(3) != column.is_multiple_of(3);
            assert_eq!(of("flu"), 3.0, "{name}");
            assert_eq!(of("ned"), if changes { -3.0 } else { 3.0 }, "{name}");
        }
    }
}

#[test]
fn one_of_a_pair_is_enough_and_rounding_is_averaged() {
    let masses = "Y_vdot = -35.5\nN_rdot = -4.88\n";
    let coupling = |more: &str| table(&format!("{masses}{more}")).added_mass.expect("one");
    for text in [
        "Y_rdot = 1.93",
        "N_vdot = 1.93",
        "Y_rdot = 1.93\nN_vdot = 1.93",
    ] {
        let found = coupling(text);
        assert_eq!((found[(1, 5)], found[(5, 1)]), (-1.93, -1.93));
    }
    let found = coupling("Y_rdot = 1.93\nN_vdot = 1.94");
    assert_eq!((found[(1, 5)], found[(5, 1)]), (-1.935, -1.935));
    let text = refusal(&format!("{masses}Y_rdot = 1.93\nN_vdot = -1.93"));
    assert!(
        text.contains("sway, yaw is -1.93 and yaw, sway is 1.93 [kg m], 3.86 apart"),
        "{text}"
    );
}

#[test]
fn names_have_many_spellings() {
    let quadratic = [
        "Y_r|r|",
        "Y_|r|r",
        "Yrabsr",
        "yRabsR",
        "Y_absr",
        "y_abs_r_r",
    ];
    for name in quadratic {
        let found = table(&format!("\"{name}\" = 2.0"));
        assert_eq!(
            found.quadratic_drag.expect("a drag")[(1, 5)],
            -2.0,
            "{name}"
        );
    }
    for name in ["N_rdot", "Nrdot", "nDotR", "N_dot_r"] {
        let found = table(&format!("\"{name}\" = -2.0"));
        assert_eq!(found.added_mass.expect("a mass")[(5, 5)], 2.0, "{name}");
    }
    for name in ["N_r", "Nr", "nR"] {
        let found = table(&format!("\"{name}\" = -2.0"));
        assert_eq!(found.linear_drag.expect("a drag")[(5, 5)], 2.0, "{name}");
    }
}

#[test]
fn positive_tables_and_points_are_taken() {
    let found = table("signs = \"positive\"\npoint = [0.1, 0, -0.2]\nX_udot = 6.36\nX_u = 13.7");
    assert_eq!(found.added_mass.expect("a mass")[(0, 0)], 6.36);
    assert_eq!(found.linear_drag.expect("a drag")[(0, 0)], 13.7);
    let set = found.effects("hull").expect("effects");
    assert_eq!(set.entries[0].parameters[36..], [0.1, 0.0, -0.2]);
    // Lists of uuv_simulator have an added mass of positive sign either way.
    let found = table("added_mass = [1, 2, 3, 4, 5, 6]");
    assert_eq!(found.added_mass, diagonal([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
}

#[test]
fn what_is_no_table_is_refused_by_name() {
    let cases = [
        ("X_udot = ", "neither TOML nor JSON"),
        ("{\"X_udot\": }", "neither TOML nor JSON"),
        (
            "",
            "no hydrodynamic derivative; expected names such as X_udot, Y_rdot (added mass)",
        ),
        ("", "it has: none"),
        (
            "point = [0, 0, 0]\nconvention = \"ned\"",
            "it has: convention, point",
        ),
        (
            "convention = \"enu\"\nX_u = -1",
            "`convention` is \"enu\", expected \"ned\"",
        ),
        (
            "signs = 1\nX_u = -1",
            "`signs` is 1, expected \"derivatives\"",
        ),
        (
            "point = [1, 2]\nX_u = -1",
            "`point` is [1,2], expected three numbers",
        ),
        (
            "left_out = 3\nX_u = -1",
            "`left_out` is 3, expected a list of names",
        ),
        (
            "left_out = [\"X_w\"]\nX_u = -1",
            "left_out names `X_w`, which the table does not have; did you mean `X_u`?",
        ),
        ("X_u = \"-1\"", "`X_u` is \"-1\", expected a finite number"),
        ("X_u = nan", "`X_u` is null, expected a finite number"),
        ("X_u = -1\nxU = -1", "are one number given twice"),
        (
            "X_u = -1\nlinear_damping = [1, 2, 3, 4, 5, 6]",
            "are one number given twice",
        ),
        ("W = 299\nX_u = -1", "`W` is no hydrodynamic derivative"),
        (
            "conventoin = \"ned\"\nX_u = -1",
            "did you mean `convention`?",
        ),
        ("X_prop = 3", "`X_prop` is no hydrodynamic derivative"),
        ("X_uudot = 3", "`X_uudot` is no hydrodynamic derivative"),
        (
            "linear_damping = [1, 2]",
            "expected a list of 6 numbers (the diagonal) or of 36",
        ),
        ("X_wq = -35.5", "`X_wq` multiplies two velocities"),
        ("Y_uv = -28.6", "body lift is the effect `lift`"),
        ("\"Y_u|v|\" = 1", "multiplies two velocities"),
        ("X_uuu = 1", "multiplies two velocities"),
        ("X_qq = -1.93", "write `X_q|q|` where it turns round"),
        ("X_udot = 6.36", "the matrix has the eigenvalue -6.36"),
        ("X_u = 13.7", "hydro effects from-fossen"),
        (
            "N_rr = 1.5",
            "yaw, yaw is -1.5 [N m s^2/rad^2], expected at least 0",
        ),
    ];
    for (text, expected) in cases {
        let found = refusal(text);
        assert!(found.contains(expected), "{text}: {found}");
    }
}
