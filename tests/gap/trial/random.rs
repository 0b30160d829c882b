//! Properties: what is written is read back, and no file makes the reader panic.

use std::{fs, path::Path};

use hydro_gap::trial::{Series, Trial, read, write_csv, write_npz};
use proptest::prelude::*;
use zip::CompressionMethod;

use super::fixture::{Arrays, Folder, HEADER, names, npy, rows, signature, with_raw};

/// Strictly increasing times.
fn times(rows: usize) -> impl Strategy<Value = Vec<f64>> {
    (-1e3..1e3, proptest::collection::vec(1e-6..1.0_f64, rows)).prop_map(|(start, steps)| {
        let mut time: f64 = start;
        steps
            .into_iter()
            .map(|step| {
                time += step;
                time
            })
            .collect()
    })
}

prop_compose! {
    fn block(columns: Vec<String>, least: usize, value: BoxedStrategy<f64>)
        (rows in least..12)
        (times in times(rows),
         data in proptest::collection::vec(value.clone(), rows * columns.len()),
         columns in Just(columns.clone())) -> Series {
        Series { times, columns, data }
    }
}

/// Trials that both formats can hold: a gyro that may lose samples, any subset of sensors, states or none.
fn trials() -> impl Strategy<Value = Trial> {
    let any_number = prop_oneof![
        4 => -1e6..1e6_f64,
        1 => any::<f64>().prop_filter("finite", |value| value.is_finite()),
    ]
    .boxed();
    let with_gaps = prop_oneof![5 => any_number.clone(), 1 => Just(f64::NAN)].boxed();
    let hip = -3.0..3.0_f64;
    let control = block(names(&["left", "right"]), 1, any_number.clone());
    let sensors = prop_oneof![
        block(names(&["gyro[0]", "gyro[1]"]), 2, with_gaps),
        block(names(&["hip"]), 2, hip.boxed()),
    ]
    .prop_filter("a sample in every column", |sensors| {
        (0..sensors.width())
            .all(|column| sensors.column_values(column).any(|value| !value.is_nan()))
    });
    let columns = (0..4).map(|i| format!("state[{i}]")).collect();
    let state = proptest::option::of(block(columns, 2, any_number));
    (control, sensors, state).prop_map(|(control, sensors, state)| {
        let initial_state = state.as_ref().map(|state: &Series| state.row(0).to_vec());
        Trial {
            name: "run".into(),
            control,
            sensors,
            initial_state,
            state,
            ..Trial::default()
        }
    })
}

/// Equal to the last bit; all that is missing is alike.
fn bits(series: &Series) -> (Vec<u64>, &[String], Vec<u64>) {
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect();
    (bits(&series.times), &series.columns, bits(&series.data))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn what_is_written_is_read_back(trial in trials()) {
        let folder = Folder::new();
        for (name, write) in [("run.npz", write_npz as fn(&Path, &Trial) -> _), ("run.csv", write_csv)] {
            let path = folder.path(name);
            write(&path, &trial).unwrap();
            let (again, _) = read(&path, &signature()).unwrap();
            prop_assert_eq!(&again.name, &trial.name);
            prop_assert_eq!(&again.initial_state, &trial.initial_state);
            prop_assert_eq!(bits(&again.control), bits(&trial.control));
            prop_assert_eq!(bits(&again.sensors), bits(&trial.sensors));
            prop_assert_eq!(again.state.as_ref().map(bits), trial.state.as_ref().map(bits));
        }
    }

    #[test]
    fn random_bytes_are_no_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let folder = Folder::new();
        for name in ["run.npz", "run.csv"] {
            let path = folder.path(name);
            fs::write(&path, &bytes).unwrap();
            prop_assert!(read(&path, &signature()).is_err());
        }
    }

    #[test]
    fn csv_cells_of_any_text_are_no_panic(cells in proptest::collection::vec("[0-9.,\n\"naife+ -]{0,12}", 0..40)) {
        let folder = Folder::new();
        let text = format!("{HEADER},qpos[0],state[1]\n{}", cells.join(","));
        let _ = read(&folder.text(&text), &signature());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn changed_bytes_of_a_valid_file_are_no_panic(
        changes in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..6),
        cut in proptest::option::of(any::<proptest::sample::Index>()),
        is_npz: bool,
    ) {
        let folder = Folder::new();
        let path = if is_npz { folder.path("run.npz") } else { folder.text(&rows(4)) };
        if is_npz {
            let mapping = r#"{"hip": [0, [6]], "gyro": [0, [1, 0]]}"#;
            Arrays::new().text("sensordata_signal_mapping", mapping).write(&path, CompressionMethod::Stored);
        }
        let mut bytes = fs::read(&path).unwrap();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        fs::write(&path, bytes).unwrap();
        let _ = read(&path, &signature());
    }

    // The checksum of an archive hides most of what a changed array would do: here it is right.
    #[test]
    fn changed_headers_of_arrays_are_no_panic(
        changes in proptest::collection::vec((0_usize..70, any::<u8>()), 1..4),
    ) {
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (4,), }\n";
        let mut bytes = npy(header, &[0; 32]);
        for (at, byte) in changes {
            bytes[at] = byte;
        }
        let (_folder, path) = with_raw("control_times", &bytes);
        let _ = read(&path, &signature());
    }
}
