//! `mujoco.sysid` reads what is written here, and the reverse.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use hydro_gap::trial::{Part, RemarkKind, SensorQuantity, Signature, Trial, read, write_npz};

use super::fixture::{Folder, names, sensor};

#[expect(clippy::print_stderr, reason = "a skipped test says so")]
fn skip(reason: &str) {
    eprintln!("skipped: {reason}");
}

/// The model of `tests/gap/trial/sysid_trials.py`.
fn sysid_signature(state_len: usize) -> Signature {
    Signature {
        actuators: names(&["left", "right"]),
        sensors: vec![
            sensor("imu_gyro", 3, SensorQuantity::Other),
            sensor("imu_quat", 4, SensorQuantity::Quaternion),
            sensor("hip", 1, SensorQuantity::Angle),
            sensor("speed", 3, SensorQuantity::Other),
        ],
        joints: Vec::new(),
        state_len,
        timestep: 0.004,
    }
}

/// HYDRO_PYTHON names another Python than that of `.venv`.
#[test]
fn mujoco_sysid_and_this_library_read_each_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = std::env::var_os("HYDRO_PYTHON")
        .map_or_else(|| root.join(".venv/bin/python"), PathBuf::from);
    if !python.exists() {
        return skip("no .venv (scripts/setup.sh makes it)");
    }
    let importable = Command::new(&python)
        .args(["-c", "from mujoco.sysid import SystemTrajectory"])
        .output()
        .unwrap();
    let complaint = String::from_utf8_lossy(&importable.stderr);
    assert!(
        importable.status.success(),
        "no mujoco.sysid in .venv; scripts/setup.sh installs it: {complaint}"
    );
    let folder = Folder::new();
    let run = |task: &str| {
        let output = Command::new(&python)
            .arg(root.join("tests/gap/trial/sysid_trials.py"))
            .arg(task)
            .arg(folder.0.path())
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8(output.stdout).unwrap()
    };
    let state_len: usize = run("write").trim().parse().unwrap();
    let signature = sysid_signature(state_len);
    let read = |name: &str| read(&folder.path(name), &signature);

    let (trial, remarks) = read("rollout.npz").unwrap();
    assert!(remarks.is_empty(), "{remarks:?}");
    assert_eq!(trial.sensors.columns, signature.sensor_columns());
    // The time convention: a sensor row labelled t is of the state at t - timestep.
    let hip = trial.sensors.column("hip").unwrap();
    let state = trial.state.clone().unwrap();
    let start = trial.initial_state.clone().unwrap();
    assert_eq!(trial.sensors.times, state.times);
    assert_eq!(trial.control.times[0], start[0]);
    assert_eq!(trial.sensors.times[0], start[0] + signature.timestep);
    assert_eq!(trial.sensors.at(0, hip), start[8]);
    for row in 1..trial.sensors.len() {
        assert_eq!(trial.sensors.at(row, hip), state.at(row - 1, 8));
    }

    for same in ["compressed.npz", "plain.npz"] {
        let (other, _) = read(same).unwrap();
        let name = trial.name.clone();
        assert_eq!(Trial { name, ..other }, trial, "{same}");
    }
    let (fortran, _) = read("fortran.npz").unwrap();
    let pairs = fortran.sensors.data.iter().zip(&trial.sensors.data);
    for (single, double) in pairs {
        assert_eq!(*single, f64::from(*double as f32));
    }
    assert!(
        fortran
            .control
            .data
            .iter()
            .all(|value| value.fract() == 0.0)
    );

    let (some, remarks) = read("some.npz").unwrap();
    assert_eq!(
        some.sensors.columns,
        ["imu_gyro[0]", "imu_gyro[1]", "imu_gyro[2]", "hip"]
    );
    assert_eq!(some.sensors.row(3)[3], trial.sensors.at(6, hip));
    assert_eq!(some.sensors.row(3)[..3], trial.sensors.row(6)[..3]);
    let said = |wanted: fn(&RemarkKind) -> bool| remarks.iter().any(|remark| wanted(&remark.kind));
    assert!(said(|kind| matches!(
        kind,
        RemarkKind::DifferentRates { .. }
    )));
    assert!(said(|kind| matches!(
        kind,
        RemarkKind::Reordered {
            part: Part::Sensors
        }
    )));
    assert!(said(|kind| matches!(kind, RemarkKind::SetAside { .. })));
    assert!(said(|kind| matches!(
        kind,
        RemarkKind::MissingSensor { .. }
    )));
    let refusal = read("pickled.npz").unwrap_err().to_string();
    assert!(
        refusal.contains("`initial_state` holds pickled"),
        "{refusal}"
    );

    write_npz(&folder.path("rust.npz"), &trial).unwrap();
    run("check");
}
