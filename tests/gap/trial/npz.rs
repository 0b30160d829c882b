//! Archives: what is accepted, said and refused.

use std::{fs, path::Path};

use hydro_gap::trial::{Part, RemarkKind, read};
use zip::CompressionMethod;

use super::fixture::{Arrays, Folder, kinds, names, npy, refused, signature, with_raw};

#[test]
fn npz_refusals_name_array_and_shape() {
    let good = Arrays::new();
    let (trial, remarks) = good.accepted();
    assert_eq!(trial.sensors.columns, signature().sensor_columns());
    assert_eq!(kinds(&remarks), [&RemarkKind::MissingStates]);
    for array in [
        "control_times",
        "control_data",
        "sensordata_times",
        "sensordata_data",
    ] {
        let parts = [&format!("no array `{array}`"), "`initial_state`"];
        good.clone().without(array).refused(&parts);
    }
    let (trial, _) = good.clone().without("initial_state").accepted();
    assert!(trial.initial_state.is_none());
    assert!(
        good.clone()
            .shaped("initial_state", &[0])
            .accepted()
            .0
            .initial_state
            .is_none()
    );
    good.clone()
        .shaped("initial_state", &[5])
        .refused(&["`initial_state`", "[5]", "[4]"]);
    good.clone().shaped("control_data", &[4, 3]).refused(&[
        "`control_data`",
        "3 columns, expected 2",
        "`left`",
    ]);
    good.clone().shaped("control_data", &[3, 2]).refused(&[
        "`control_data`",
        "[3, 2]",
        "[4, columns]",
    ]);
    good.clone()
        .shaped("sensordata_data", &[4, 6])
        .refused(&["6 columns, expected 7", "gyro[0..2]"]);
    good.clone()
        .shaped("sensordata_data", &[4, 7, 1])
        .refused(&["[4, 7, 1]"]);
    good.clone()
        .shaped("control_times", &[4, 1])
        .refused(&["`control_times`", "[4, 1]"]);
    good.clone()
        .shaped("control_times", &[0])
        .shaped("control_data", &[0, 2])
        .refused(&["controls: 0 rows"]);
    good.clone()
        .shaped("state_data", &[4, 4])
        .refused(&["no array `state_times`"]);
    good.clone()
        .shaped("state_times", &[1])
        .shaped("state_data", &[1, 3])
        .refused(&["3 columns, expected 4"]);
    good.clone()
        .set("control_data", 5, f64::NAN)
        .refused(&["row 2 (from 0)", "`right`", "NaN"]);
    good.clone()
        .set("control_times", 2, f64::INFINITY)
        .refused(&["row 2", "`control_times`", "inf"]);
    good.clone().set("sensordata_times", 2, 0.1).refused(&[
        "row 2",
        "`sensordata_times`",
        "stands still",
    ]);
    good.clone()
        .set("sensordata_times", 2, 0.0)
        .refused(&["row 2", "runs backwards from 0.1 s to 0 s"]);
    good.clone()
        .set("sensordata_data", 7, f64::INFINITY)
        .refused(&["row 1", "gyro[0]"]);
    good.clone()
        .set("initial_state", 3, f64::NAN)
        .refused(&["initial_state", "row 3"]);
    let (trial, remarks) = good.clone().set("sensordata_data", 7, f64::NAN).accepted();
    assert!(trial.sensors.at(1, 0).is_nan());
    let dropped = RemarkKind::DroppedSamples {
        sensor: "gyro".into(),
        rows: 1,
        of: 4,
    };
    assert!(kinds(&remarks).contains(&&dropped));
    let (_, remarks) = good.clone().shaped("notes", &[3]).accepted();
    assert!(kinds(&remarks).contains(&&RemarkKind::SetAside {
        names: names(&["notes"])
    }));
    let (_, remarks) = good.set("initial_state", 0, 3.0).accepted();
    let start = RemarkKind::StartTimes {
        initial_state: 3.0,
        first_control: 0.0,
    };
    assert!(kinds(&remarks).contains(&&start));
}

#[test]
fn signal_mappings_choose_and_permute_columns() {
    let good = Arrays::new();
    let sensors = |text: &str| good.clone().text("sensordata_signal_mapping", text);
    let controls = |text: &str| good.clone().text("control_signal_mapping", text);
    let (trial, remarks) =
        sensors(r#"{"hip": [0, [6]], "gyro": [0, [1, 0]], "base_qpos": [2, [2, 3]]}"#).accepted();
    assert_eq!(trial.sensors.columns, ["gyro[0]", "gyro[1]", "hip"]);
    assert_eq!(trial.sensors.row(0), [0.1, 0.0, 0.5]);
    let said = kinds(&remarks);
    assert!(said.contains(&&RemarkKind::Reordered {
        part: Part::Sensors
    }));
    assert!(said.contains(&&RemarkKind::MissingSensor {
        sensor: "quat".into()
    }));
    assert!(said.contains(&&RemarkKind::SetAside {
        names: names(&["base_qpos"])
    }));
    let unnamed = names(&["sensordata_data[4]", "sensordata_data[5]"]);
    assert!(said.contains(&&RemarkKind::SetAside { names: unnamed }));
    let (trial, _) = controls(r#"{"right": [5, [0]], "left_ctrl": [5, [1]]}"#).accepted();
    assert_eq!(trial.control.row(0), [1.0, 0.0]);

    sensors(r#"{"hipp": [0, [6]]}"#).refused(&["`hipp`", "did you mean `hip`"]);
    sensors(r#"{"gyro": [0, [0]]}"#).refused(&["`gyro`", "1 column, expected 2"]);
    sensors(r#"{"hip": [0, [7]]}"#).refused(&[
        "sensordata_signal_mapping",
        "column 7",
        "7 columns",
    ]);
    sensors(r#"{"hip": [0, [-1]]}"#).refused(&["sensordata_signal_mapping"]);
    sensors(r#"{"gyro": [0, [1, 1]]}"#).refused(&["named twice"]);
    sensors("{").refused(&["sensordata_signal_mapping", "JSON"]);
    sensors("{}").refused(&["no sensor of the model", "sensors"]);
    controls(r#"{"left_ctrl": [5, [0]]}"#).refused(&["actuators `right`", "controls here: `left`"]);
    controls(r#"{"middle_ctrl": [5, [0]]}"#)
        .refused(&["`middle_ctrl`", "the model has the actuators `left`"]);
    controls(r#"{"left_ctrl": [5, [0, 1]]}"#).refused(&["`left_ctrl`", "2 columns, expected 1"]);
    controls(r#"{"left_ctrl": [5, [0]], "left": [5, [1]]}"#).refused(&["two columns for `left`"]);
}

#[test]
fn arrays_of_other_kinds_and_lying_headers_are_refused() {
    let refused_raw = |header: &str, data: &[u8], parts: &[&str]| {
        let (_folder, path) = with_raw("control_times", &npy(header, data));
        refused(&path, &[&["control_times"], parts].concat());
    };
    let plain = |descr: &str, shape: &str| {
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n")
    };
    refused_raw(
        &plain("|O", "()"),
        b"\x80\x04N.",
        &["pickled", "leave the array out"],
    );
    refused_raw(
        &plain("<c16", "(4,)"),
        &[0; 64],
        &["'<c16'", "expected f4, f8 or an integer"],
    );
    refused_raw(&plain("<U1", "(4,)"), &[0; 16], &["'<U1'"]);
    refused_raw(&plain("<f8", "(4,)"), &[0; 31], &["shape [4]"]);
    refused_raw(
        &plain("<f8", "(400000000,)"),
        &[0; 31],
        &["shape [400000000]"],
    );
    refused_raw(
        &plain("<f8", "(99999999,99999999,99999999)"),
        b"",
        &["not that of a plain array"],
    );
    refused_raw(&plain("<U999999999999", "()"), b"", &["<U999999999999"]);
    refused_raw(&"(".repeat(4000), b"", &["not that of a plain array"]);
    refused_raw(&" ".repeat(5000), b"", &["5000 bytes"]);
    refused_raw("{}", b"", &["missing key"]);
    let (_folder, path) = with_raw("control_times", b"hello");
    refused(&path, &["control_times", "cut short"]);
    let (_folder, path) = with_raw("control_signal_mapping", &npy(&plain("<f8", "()"), &[0; 8]));
    refused(&path, &["control_signal_mapping", "expected a string"]);
    let (_folder, path) = with_raw(
        "control_signal_mapping",
        &npy(&plain("<U1", "()"), b"\x00\xd8\x00\x00"),
    );
    refused(&path, &["control_signal_mapping"]);
}

/// Sizes that the directory of an archive states for a member, little-endian: its signature, then at byte 20 the compressed
/// size, at 24 that of the content, at 46 the name.
fn stating(path: &Path, member: &str, at: usize, size: u32) {
    let mut bytes = fs::read(path).unwrap();
    let entry = bytes.windows(46 + member.len()).position(|window| {
        window.starts_with(b"PK\x01\x02") && window.ends_with(member.as_bytes())
    });
    let place = entry.unwrap() + at;
    bytes[place..place + 4].copy_from_slice(&size.to_le_bytes());
    fs::write(path, bytes).unwrap();
}

#[test]
fn an_array_that_inflates_is_held_to_its_stated_size_and_that_to_its_bytes() {
    let array = |descr: &str, count: u32, zeros: usize| {
        let header =
            format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({count},), }}\n");
        let bytes = npy(&header, &vec![0; zeros]);
        let size = bytes.len() as u32;
        let (folder, path) = with_raw("control_times", &bytes);
        (folder, path, size)
    };
    // 64 MiB in 64 kB, of a header that states 32 bytes: the directory states so too, or tells the truth.
    let (_folder, path, size) = array("<f8", 4, 1 << 26);
    assert!(fs::metadata(&path).unwrap().len() < 1 << 17);
    refused(
        &path,
        &["control_times", "shape [4]", &format!("{size} bytes")],
    );
    stating(&path, "control_times.npy", 24, size - (1 << 26) + 32);
    refused(&path, &["control_times", "larger than its declared"]);
    // A header and a directory that state 800 MB over nothing, whatever size they give the nothing.
    let (_folder, path, size) = array("<f8", 100_000_000, 0);
    stating(&path, "control_times.npy", 24, size + 800_000_000);
    let parts = ["control_times", "800000", "compressed ones hold"];
    refused(&path, &parts);
    stating(&path, "control_times.npy", 20, 1_000_000);
    refused(&path, &parts);
    // Truth in all places: 128 MiB of single bytes in 128 kB, which are 1 GiB of numbers.
    let (_folder, path, _) = array("|i1", (1 << 27) + 1, (1 << 27) + 1);
    assert!(fs::metadata(&path).unwrap().len() < 1 << 18);
    refused(
        &path,
        &[
            "control_times",
            "shape [134217729]",
            "expected 1073741824 bytes at most",
        ],
    );
    // As many strings of no length, which take no byte of the file.
    let header = "{'descr': '<U0', 'fortran_order': False, 'shape': (9999999999999,), }\n";
    let (_folder, path) = with_raw("control_signal_mapping", &npy(header, b""));
    refused(
        &path,
        &["control_signal_mapping", "larger than an array may be"],
    );
}

#[test]
fn elements_of_other_widths_are_numbers_too() {
    let shape = "'fortran_order': False, 'shape': (4,), }\n";
    let integers: [(&str, Vec<u8>); 3] = [
        (
            ">i2",
            [0_i16, 1, 2, 3]
                .iter()
                .flat_map(|v| v.to_be_bytes())
                .collect(),
        ),
        ("|u1", vec![0, 1, 2, 3]),
        (
            "<f4",
            [0_f32, 1.0, 2.0, 3.0]
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect(),
        ),
    ];
    for (descr, bytes) in integers {
        let header = format!("{{'descr': '{descr}', {shape}");
        let (_folder, path) = with_raw("control_times", &npy(&header, &bytes));
        let (trial, _) = read(&path, &signature()).unwrap();
        assert_eq!(trial.control.times, [0.0, 1.0, 2.0, 3.0]);
    }
}

#[test]
fn a_file_cut_anywhere_or_changed_is_refused() {
    let folder = Folder::new();
    let path = folder.path("run.npz");
    for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
        Arrays::new().write(&path, method);
        let whole = fs::read(&path).unwrap();
        for length in (0..whole.len()).step_by(97) {
            fs::write(&path, &whole[..length]).unwrap();
            refused(&path, &[if length == 0 { "empty" } else { "cut short" }]);
        }
    }
    // One bit of a number: the checksum of the archive tells.
    Arrays::new().write(&path, CompressionMethod::Stored);
    let mut bytes = fs::read(&path).unwrap();
    let at = bytes
        .windows(8)
        .position(|eight| eight == 7_f64.to_le_bytes())
        .unwrap();
    bytes[at] ^= 1;
    fs::write(&path, bytes).unwrap();
    refused(&path, &["control_data", "checksum"]);
}
