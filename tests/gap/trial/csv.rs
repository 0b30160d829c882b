//! Text: what is accepted, said and refused.

use std::fs;

use hydro_gap::trial::{Part, Remark, RemarkKind, read, write_csv};

use super::fixture::{
    Folder, HEADER, accepted_csv, kinds, names, refused, refused_csv, rows, signature,
};

#[test]
fn a_plain_csv_is_read_as_it_stands() {
    let (trial, remarks) = accepted_csv(&rows(3));
    assert_eq!(trial.name, "run");
    assert_eq!(trial.control.columns, ["left", "right"]);
    assert_eq!(trial.control.data, [0.0, 0.0, 1.0, 2.0, 2.0, 4.0]);
    assert_eq!(trial.sensors.columns, signature().sensor_columns());
    assert_eq!(trial.sensors.times, [0.0, 0.1, 0.2]);
    assert_eq!(
        kinds(&remarks),
        [&RemarkKind::MissingInitialState, &RemarkKind::MissingStates]
    );
}

#[test]
fn csv_columns_of_any_order_and_rate_are_matched_and_said() {
    let text = "hip,gyro[1],gyro[0],time,right_ctrl,left
        0.5,2,1,0.0,3,4
        ,,,0.1,5,6
        0.6,nan,11,0.2,,8
        ,,,0.3,9,10
        ,22,21,0.4,11,12";
    let (trial, remarks) = accepted_csv(text);
    assert_eq!(trial.control.len(), 5);
    // The empty command lies between 5 at 0.1 s and 9 at 0.3 s.
    assert_eq!(trial.control.row(2), [8.0, 7.0]);
    assert_eq!(trial.sensors.columns, ["gyro[0]", "gyro[1]", "hip"]);
    assert_eq!(trial.sensors.times, [0.0, 0.2, 0.4]);
    assert_eq!(trial.sensors.row(0), [1.0, 2.0, 0.5]);
    assert!(trial.sensors.at(1, 1).is_nan() && trial.sensors.at(2, 2).is_nan());
    let said = kinds(&remarks);
    for kind in [
        RemarkKind::Reordered {
            part: Part::Control,
        },
        RemarkKind::Reordered {
            part: Part::Sensors,
        },
        RemarkKind::FilledControls {
            actuator: "right".into(),
            rows: 1,
            of: 5,
        },
        RemarkKind::MissingSensor {
            sensor: "quat".into(),
        },
        RemarkKind::DroppedSamples {
            sensor: "gyro".into(),
            rows: 1,
            of: 3,
        },
        RemarkKind::DroppedSamples {
            sensor: "hip".into(),
            rows: 1,
            of: 3,
        },
        RemarkKind::DifferentRates {
            control_period: 0.1,
            sensor_period: 0.2,
        },
    ] {
        let close = |said: &&RemarkKind| format!("{said:.3?}") == format!("{kind:.3?}");
        assert!(said.iter().any(close), "{kind:?} is not in {said:?}");
    }
}

#[test]
fn jitter_gaps_and_idle_controls_are_said() {
    let text = format!(
        "{HEADER}\n0,1,0,,,,,,,0\n1,1,1,,,,,,,0\n2.2,1,2,,,,,,,0\n3.2,1,3,,,,,,,0\n9.2,1,4,,,,,,,0\n10.2,1,4,,,,,,,0"
    );
    let (_, remarks) = accepted_csv(&text);
    let said: Vec<String> = remarks.iter().map(ToString::to_string).collect();
    let has = |part: &str| said.iter().any(|text| text.contains(part));
    assert!(
        has("the times of the sensors are uneven: 1 of 5 steps"),
        "{said:?}"
    );
    assert!(
        has("rows of the controls are missing: 1 gap, some 5 rows"),
        "{said:?}"
    );
    assert!(has("constant and excite nothing: `left`"), "{said:?}");
    let still = rows(3).replace(",1,2,", ",0,0,").replace(",2,4,", ",0,0,");
    let (_, remarks) = accepted_csv(&still);
    assert!(kinds(&remarks).contains(&&RemarkKind::ConstantControls));
    let json = serde_json::to_string(&remarks).unwrap();
    assert!(json.contains(r#""kind":"constant_controls""#), "{json}");
    assert_eq!(serde_json::from_str::<Vec<Remark>>(&json).unwrap(), remarks);
}

#[test]
fn csv_states_are_the_models_or_kept_in_part() {
    let whole = "time,left,right,hip,qpos[0],qpos[1],qvel[0]
        0,1,2,0,7,8,9
        0.1,2,3,0,,,
        0.2,2,3,0,17,18,19";
    let (trial, remarks) = accepted_csv(whole);
    assert_eq!(trial.initial_state.unwrap(), [0.0, 7.0, 8.0, 9.0]);
    let state = trial.state.unwrap();
    assert_eq!(
        state.columns,
        ["state[0]", "state[1]", "state[2]", "state[3]"]
    );
    assert_eq!(state.data, [0.0, 7.0, 8.0, 9.0, 0.2, 17.0, 18.0, 19.0]);
    assert!(
        remarks
            .iter()
            .all(|remark| remark.kind != RemarkKind::MissingInitialState)
    );

    let (trial, remarks) = accepted_csv(
        &whole
            .replace(",qvel[0]", "")
            .replace(",9\n", "\n")
            .replace(",,,", ",,")
            .replace(",19", ""),
    );
    assert!(trial.initial_state.is_none());
    assert_eq!(trial.state.unwrap().columns, ["qpos[0]", "qpos[1]"]);
    assert!(kinds(&remarks).contains(&&RemarkKind::PartialState {
        found: 3,
        expected: 4
    }));

    refused_csv(&whole.replace("qpos[1]", "qpos[2]"), &["`qpos[1]`"]);
    refused_csv(
        &whole.replace("qvel[0]", "qpos[0]"),
        &["two columns", "qpos[0]"],
    );
    refused_csv(
        &whole.replace("qvel[0]", "state[0]"),
        &["either `state[i]`"],
    );
    refused_csv(
        &whole.replace("0.1,2,3,0,,,", "0.1,2,3,0,,1,"),
        &["line 3", "`qpos[0]`", "empty"],
    );
    refused_csv(
        &whole.replace(",19", ",inf"),
        &["line 4", "state[3]", "inf"],
    );
    let long =
        "time,left,right,hip,qpos[0],qpos[1],qvel[0],qvel[1]\n0,1,2,0,7,8,9,1\n1,1,2,0,7,8,9,1";
    refused_csv(long, &["5 columns, expected 4"]);
}

#[test]
fn csv_refusals_name_file_row_column_and_what_the_model_has() {
    let good = rows(4);
    refused_csv("", &["empty"]);
    refused_csv(HEADER, &["0 rows"]);
    refused_csv(&rows(1), &["1 row, expected at least 2"]);
    refused_csv(
        &good.replace("hip", "hop"),
        &["`hop`", "did you mean `hip`", "`left`", "gyro[0..2]"],
    );
    refused_csv(
        &good.replace("hip", "thermometer"),
        &["`thermometer`", "the model has"],
    );
    refused_csv(
        &good.replace("gyro[1]", "gyro[2]"),
        &["gyro[2]", "expected 2", "`gyro[1]`"],
    );
    refused_csv(
        &good.replace("gyro[1]", "gyro[0]"),
        &["two columns for `gyro[0]`"],
    );
    refused_csv(
        &good.replace("right", "left_ctrl"),
        &["two columns for `left`"],
    );
    refused_csv(&good.replace("time", "t"), &["`t`"]);
    refused_csv(
        "left,right,hip\n1,2,3\n2,3,4",
        &["no column `time`", "`left`"],
    );
    refused_csv("time;left;right\n0;1;2", &["commas"]);
    refused_csv("0,1,2,3\n1,2,3,4", &["first line must name the columns"]);
    refused_csv(
        "time,left,hip\n0,1,2\n1,2,2",
        &["actuators `right`", "controls here: `left`"],
    );
    refused_csv(
        "time,left,right,hip\n0,1,,2\n1,2,,2",
        &["actuators `right`"],
    );
    refused_csv("time,left,right\n0,1,2\n1,2,2", &["sensors: 0 rows"]);
    refused_csv(
        "time,left,right,hip\n0,1,2,nan\n1,2,2,nan",
        &["no sensor of the model"],
    );
    refused_csv(
        &good.replace("0.2,2", "0.05,2"),
        &["line 4", "runs backwards", "0.1", "0.05"],
    );
    refused_csv(&good.replace("0.2,2", "0.1,2"), &["line 4", "stands still"]);
    refused_csv(
        &good.replace("0.2,2", ",2"),
        &["line 4", "`time`", "not finite"],
    );
    refused_csv(
        &good.replace("0.2,2", "inf,2"),
        &["line 4", "`time`", "not finite"],
    );
    refused_csv(
        &good.replace("0.2,2", "0.2,nan"),
        &["line 4", "`left`", "NaN"],
    );
    refused_csv(
        &good.replace("0.2,2", "0.2,two"),
        &["line 4", "`left`", "`two` is no number"],
    );
    refused_csv(
        &good.replace("0.2,2", "0.2,2,9"),
        &["line 4", "11 cells, expected 10"],
    );
    refused_csv(
        &good.replacen(",0.1,1,0", ",inf,1,0", 1),
        &["line 2", "gyro[1]", "inf"],
    );
    refused_csv(
        &good.replace(",1,0,0,0,", ",0.5,0.5,0,0,"),
        &["`quat`", "0.7071", "suspected"],
    );
    refused_csv(
        &good.replacen("0.5", "45", 1),
        &["line 2", "`hip`", "45", "degrees suspected"],
    );
    refused_csv(
        "time,left,right,quat[0],quat[1],quat[2]\n0,1,2,1,0,0\n0.1,1,2,1,0,0",
        &["`quat`", "lacks quat[3]", "all four"],
    );
    // 40 000 rows at 50 Hz, in milliseconds; and one time that is no time.
    let rows = (0..40_000).map(|row| format!("\n{},1,2,0.5", 20 * row));
    let milliseconds: String = std::iter::once("time,left,right,hip".to_owned())
        .chain(rows)
        .collect();
    let mut quick = signature();
    quick.timestep = 0.01;
    let folder = Folder::new();
    let message = read(&folder.text(&milliseconds), &quick)
        .unwrap_err()
        .to_string();
    for part in ["line 40001", "`time`", "20", "milliseconds suspected"] {
        assert!(message.contains(part), "{message}");
    }
    // Two seconds at 100 Hz, in milliseconds and in hours.
    for (factor, expected) in [
        (1e3, "milliseconds suspected"),
        (1e-7, "another unit suspected"),
    ] {
        let rows = (0..200).map(|row| format!("\n{:e},1,2,0.5", 0.01 * factor * f64::from(row)));
        let text: String = std::iter::once("time,left,right,hip".to_owned())
            .chain(rows)
            .collect();
        let mut quick = signature();
        quick.timestep = 0.005;
        let folder = Folder::new();
        let message = read(&folder.text(&text), &quick).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    refused_csv(
        "time,left,right,hip\n0,1,2,0\n1e300,1,2,0\n1e300,1,2,0",
        &["line 4", "stands still from 1e300 s to 1e300 s"],
    );
    refused_csv(
        "time,left,right,hip\n0,1,2,0\n0.1,1,2,0\n1e300,1,2,0",
        &["line 4", "`time`", "1e300", "expected seconds"],
    );
    let folder = Folder::new();
    let path = folder.path("run.csv");
    fs::write(
        &path,
        [good.as_bytes(), b"\n0.4,1,1,\xff,0,1,0,0,0,0"].concat(),
    )
    .unwrap();
    refused(&path, &["line 6", "UTF-8"]);
    fs::write(&path, [b"\xef\xbb\xbf", good.as_bytes()].concat()).unwrap();
    read(&path, &signature()).unwrap();
    refused(&folder.path("run.mat"), &[".npz or a .csv"]);
    refused(&folder.path("gone.csv"), &["No such file"]);
    refused(&folder.path("gone.npz"), &["No such file"]);
    for name in ["zero.csv", "zero.npz"] {
        std::os::unix::fs::symlink("/dev/zero", folder.path(name)).unwrap();
        refused(&folder.path(name), &["is a device; expected a file"]);
        fs::create_dir(folder.path(&format!("folder-{name}"))).unwrap();
        refused(&folder.path(&format!("folder-{name}")), &["is a folder"]);
    }
    let sparse = fs::File::create(folder.path("sparse.csv")).unwrap();
    sparse.set_len(1 << 31).unwrap();
    refused(
        &folder.path("sparse.csv"),
        &["its first line has 1048576 bytes"],
    );
}

#[test]
fn a_name_shared_by_an_actuator_and_a_sensor_is_told_apart() {
    let mut shared = signature();
    shared.actuators = names(&["hip", "right"]);
    let folder = Folder::new();
    let path = folder.text("time,hip,right\n0,1,2\n1,2,3");
    let message = read(&path, &shared).unwrap_err().to_string();
    assert!(message.contains("`hip_ctrl`"), "{message}");
    let path = folder.text("time,hip_ctrl,hip,right\n0,1,2,3\n1,2,3,3");
    let (trial, _) = read(&path, &shared).unwrap();
    assert_eq!(trial.control.data, [1.0, 3.0, 2.0, 3.0]);
    assert_eq!(trial.sensors.data, [2.0, 3.0]);
    write_csv(&path, &trial).unwrap();
    assert_eq!(read(&path, &shared).unwrap().0, trial);
}

#[test]
fn a_revolving_joint_is_no_mistake() {
    let row = |k: usize| format!("\n{k},{k},0,{}", 3 * k);
    let text = "time,left,right,hip".to_owned() + &(0..20).map(row).collect::<String>();
    let (_, remarks) = accepted_csv(&text);
    let said = |remark: &Remark| matches!(&remark.kind, RemarkKind::LargeAngle { column, .. } if column == "hip");
    assert!(remarks.iter().any(said), "{remarks:?}");
}

/// A joint that winds five turns up and down again: radians where the gyroscope reads its rate, degrees where it reads that over 57.3.
#[test]
fn a_rate_beside_it_tells_the_unit_of_an_angle() {
    let text = |unit: f64| {
        let row = |k: usize| {
            let time = 0.1 * k as f64;
            let (angle, rate) = (30.0 * time.sin(), 30.0 * time.cos() / unit);
            format!("\n{time},1,2,{rate},{angle}")
        };
        "time,left,right,gyro[0],hip".to_owned() + &(0..100).map(row).collect::<String>()
    };
    accepted_csv(&text(1.0));
    refused_csv(&text(57.3), &["`hip`", "degrees suspected"]);
    refused_csv(&text(-1.0), &["`hip`", "degrees suspected"]);
}
