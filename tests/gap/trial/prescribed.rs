//! Prescribed joints and tables of steady states: what is read, how a table is dealt out, what is refused.

use hydro_gap::trial::{
    RemarkKind, SensorQuantity, Signature, list, read, read_listed, write_csv, write_npz,
};

use super::fixture::{Folder, kinds, names, sensor};

/// A hull on a carriage with two joints, a rudder and a load cell.
fn towed() -> Signature {
    Signature {
        actuators: names(&["rudder"]),
        sensors: vec![
            sensor("force", 3, SensorQuantity::Other),
            sensor("yaw", 1, SensorQuantity::Other),
        ],
        joints: names(&["tow", "yaw"]),
        state_len: 5,
        timestep: 0.01,
    }
}

fn refused(folder: &Folder, name: &str, text: &str, parts: &[&str]) {
    let path = folder.path(name);
    std::fs::write(&path, text).unwrap();
    let error = read(&path, &towed()).unwrap_err().to_string();
    for part in [name].iter().chain(parts) {
        assert!(error.contains(part), "`{part}` in: {error}");
    }
    assert!(!error.contains('\n'), "{error}");
}

/// The name of a sensor comes before that of a joint; `_pos` always means the joint.
#[test]
fn a_column_of_a_joint_prescribes_it() {
    let folder = Folder::new();
    let path = folder.text("time,rudder,tow,yaw,yaw_pos,force[1]\n0,0,1,7,0.1,2\n1,0,2,7,,2\n2,0,,7,0.3,2\n3,0,4,7,0.4,2\n4,0,5,7,0.5,2");
    let (trial, _) = read(&path, &towed()).unwrap();
    let prescribed = trial.prescribed.clone().unwrap();
    assert_eq!(prescribed.columns, ["tow", "yaw"]);
    assert_eq!(prescribed.times, [0.0, 1.0, 2.0, 3.0, 4.0]);
    assert_eq!(prescribed.row(0), [1.0, 0.1]);
    assert!(prescribed.at(2, 0).is_nan() && prescribed.at(1, 1).is_nan());
    assert_eq!(trial.sensors.column("yaw"), Some(3));
    assert!(trial.steady.is_none());
    for write in [write_csv, write_npz] {
        let error = write(&folder.path("again"), &trial).unwrap_err();
        assert!(error.to_string().contains("prescribed"), "{error}");
    }
}

#[test]
fn prescribed_joints_that_make_no_trajectory_are_refused() {
    let folder = Folder::new();
    let rows = |column: &str, cells: [&str; 5]| {
        let mut text = format!("time,rudder,force[1],{column}\n");
        for (time, cell) in cells.iter().enumerate() {
            text += &format!("{time},0,2,{cell}\n");
        }
        text
    };
    let good = ["0", "1", "2", "3", "4"];
    refused(
        &folder,
        "a.csv",
        &rows("towe", good),
        &[
            "column `towe`",
            "did you mean `tow`?",
            "the joints `tow`, `yaw`",
        ],
    );
    refused(
        &folder,
        "b.csv",
        &rows("tow", ["0", "", "2", "", "4"]),
        &["prescribed joint `tow`", "3 samples, expected at least 4"],
    );
    refused(
        &folder,
        "c.csv",
        &rows("tow", ["0", "1", "inf", "3", "4"]),
        &["line 4", "column `tow`", "not finite"],
    );
    let mut late = rows("tow", good);
    for time in 5..20 {
        late += &format!("{time},0,2,\n");
    }
    refused(
        &folder,
        "d.csv",
        &late,
        &["samples from 0 s to 4 s", "sensors from 0 s to 19 s"],
    );
}

const TABLE: &str = "tow_vel,yaw_pos,rudder,force[1],force[1]_sd,force[0]\n\
                     1,0.1,0,5,0.2,1\n1,0.2,0,6,,2\n2,0.3,1,7,0.3,3\n";

#[test]
fn a_file_without_times_is_a_table_of_steady_states() {
    let folder = Folder::new();
    let path = folder.text(TABLE);
    let (trial, remarks) = read(&path, &towed()).unwrap();
    let table = trial.steady.unwrap();
    assert_eq!(table.motion.columns, ["tow_vel", "yaw"]);
    assert_eq!(table.motion.times, [1.0, 2.0, 3.0]);
    assert_eq!(table.motion.row(2), [2.0, 0.3]);
    assert_eq!(trial.sensors.columns, ["force[0]", "force[1]"]);
    assert_eq!(trial.sensors.row(1), [2.0, 6.0]);
    assert_eq!(trial.control.row(2), [1.0]);
    let deviation = table.deviations.column("force[1]").unwrap();
    let deviations: Vec<f64> = table.deviations.column_values(deviation).collect();
    assert_eq!(deviations[2], 0.3);
    assert!(deviations[1].is_nan());
    let lacking = RemarkKind::MissingComponents {
        sensor: "force".to_owned(),
        columns: names(&["force[2]"]),
    };
    assert!(kinds(&remarks).contains(&&lacking));
    let path = folder.text("tow_vel,rudder,force[1]\n1,0,5\n2,0,6\n");
    let (_, remarks) = read(&path, &towed()).unwrap();
    let held = RemarkKind::HeldJoints {
        joints: names(&["yaw"]),
    };
    assert!(kinds(&remarks).contains(&&held));
}

/// Every row is in one part, ten parts at most; a log in time is one trial.
#[test]
fn a_table_is_dealt_out_row_by_row() {
    let folder = Folder::new();
    let mut text = "tow_vel,rudder,force[1]\n".to_owned();
    for row in 1..=23 {
        text += &format!("{row},0,{row}\n");
    }
    std::fs::write(folder.path("towing.csv"), text).unwrap();
    std::fs::write(
        folder.path("free.csv"),
        "time,rudder,force[1]\n0,0,1\n1,0,1\n",
    )
    .unwrap();
    let listed = list(folder.0.path()).unwrap();
    assert_eq!(listed.len(), 11);
    assert_eq!((listed[0].name.as_str(), listed[0].part), ("free", None));
    assert_eq!(
        (listed[1].name.as_str(), listed[1].part),
        ("towing-01", Some((0, 10)))
    );
    let mut rows = Vec::new();
    for one in &listed[1..] {
        let (trial, _) = read_listed(one, &towed()).unwrap();
        assert_eq!(trial.name, one.name);
        assert_eq!(trial.sensors.times, trial.control.times);
        for row in 0..trial.sensors.len() {
            assert_eq!(trial.sensors.at(row, 0), trial.sensors.times[row]);
            rows.push(trial.sensors.times[row] as usize);
        }
    }
    rows.sort_unstable();
    assert!(rows.into_iter().eq(1..=23));
}

#[test]
fn tables_that_do_not_hold_together_are_refused() {
    let folder = Folder::new();
    let table = |cells: &str| format!("tow_vel,rudder,force[1],force[1]_sd\n1,0,5,0.1\n{cells}\n");
    let cases: [(&str, String, &[&str]); 9] = [
        (
            "one.csv",
            "tow_vel,rudder,force[1]\n1,0,5\n".to_owned(),
            &["1 row", "at least 2"],
        ),
        (
            "nan.csv",
            table("1,0,nan,0.1"),
            &["line 3", "column `force[1]`", "not finite"],
        ),
        (
            "moved.csv",
            table("nan,0,5,0.1"),
            &["line 3", "column `tow_vel`", "not finite"],
        ),
        (
            "empty.csv",
            table(",0,5,0.1"),
            &["line 3", "column `tow_vel` is empty"],
        ),
        (
            "word.csv",
            table("1,0,five,0.1"),
            &["line 3", "column `force[1]`", "`five`"],
        ),
        (
            "sd.csv",
            table("1,0,5,0"),
            &["line 3", "standard deviation of 0"],
        ),
        ("row.csv", table("1,0,,"), &["line 3", "no mean reading"]),
        (
            "forceless.csv",
            "tow_vel,rudder\n1,0\n2,0\n".to_owned(),
            &[
                "no column with the mean reading",
                "`tow_vel`",
                "force[0..3]",
            ],
        ),
        (
            "steady.csv",
            "time,tow_vel,rudder,force[1]\n1,1,0,5\n2,1,0,5\n".to_owned(),
            &["no column `time`", "another name"],
        ),
    ];
    for (name, text, parts) in cases {
        refused(&folder, name, &text, parts);
    }
    refused(
        &folder,
        "joint.csv",
        "tow_vel,rudder,sway_vel,force[1]\n1,0,0,5\n2,0,0,5\n",
        &["column `sway_vel`", "the joints `tow`, `yaw`"],
    );
    refused(
        &folder,
        "idle.csv",
        "tow_vel,force[1]\n1,5\n2,5\n",
        &["no column for the actuators `rudder`"],
    );
    refused(
        &folder,
        "untimed.csv",
        "rudder,force[1]\n1,5\n2,5\n",
        &["no column `time`", "a table of steady states"],
    );
}
