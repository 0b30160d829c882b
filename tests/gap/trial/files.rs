//! Folders, and what is written.

use std::{fs, path::Path};

use hydro_gap::trial::{
    RemarkKind, Series, Signature, Trial, list, read, read_folder, write_csv, write_npz,
};
use zip::CompressionMethod;

use super::fixture::{Arrays, Folder, kinds, rows, signature};

#[test]
fn a_folder_is_listed_without_opening_a_trial() {
    let folder = Folder::new();
    let at = |name: &str| folder.path(name);
    let message = list(folder.0.path()).unwrap_err().to_string();
    assert!(message.contains("found none"), "{message}");
    fs::write(at("notes.txt"), "").unwrap();
    let message = list(folder.0.path()).unwrap_err().to_string();
    assert!(message.contains("`notes.txt`"), "{message}");
    for file in ["b.csv", "a.NPZ", ".hidden.csv"] {
        fs::write(at(file), "neither").unwrap();
    }
    fs::create_dir(at("c.npz")).unwrap();
    let trials = list(folder.0.path()).unwrap();
    let found: Vec<_> = trials
        .iter()
        .map(|trial| (trial.name.as_str(), trial.path.clone()))
        .collect();
    assert_eq!(found, [("a", at("a.NPZ")), ("b", at("b.csv"))]);
    assert!(read_folder(folder.0.path(), &signature()).is_err());
    Arrays::new().write(&at("a.NPZ"), CompressionMethod::Stored);
    fs::write(at("b.csv"), rows(3)).unwrap();
    let read = read_folder(folder.0.path(), &signature()).unwrap();
    assert_eq!(read[1].0.name, "b");
    fs::write(at("a.csv"), "").unwrap();
    let message = list(folder.0.path()).unwrap_err().to_string();
    assert!(message.contains("two trials named `a`"), "{message}");
    assert!(
        list(&at("nowhere"))
            .unwrap_err()
            .to_string()
            .contains("nowhere")
    );
}

#[test]
fn trials_of_a_conversion_that_was_cut_short_are_refused() {
    let folder = Folder::new();
    fs::write(folder.path("dive-00.csv"), rows(3)).unwrap();
    let marker = folder.path(".dive.unfinished");
    fs::write(&marker, "").unwrap();
    let message = list(folder.0.path()).unwrap_err().to_string();
    assert!(message.contains("dive.unfinished"), "{message}");
    assert!(message.contains("was cut short here"), "{message}");
    fs::remove_file(marker).unwrap();
    assert_eq!(list(folder.0.path()).unwrap().len(), 1);
}

#[test]
fn what_a_file_cannot_hold_is_not_written() {
    let folder = Folder::new();
    let path = folder.path("run.csv");
    let (trial, _) = Arrays::new().accepted();
    let fault = |change: &dyn Fn(&mut Trial)| {
        let mut trial = trial.clone();
        change(&mut trial);
        let message = write_csv(&path, &trial).unwrap_err().to_string();
        assert!(message.contains("cannot be written"), "{message}");
        message
    };
    fault(&|trial| trial.control.times[1] = 0.0);
    fault(&|trial| trial.sensors.times[1] = f64::NAN);
    fault(&|trial| trial.control.data.truncate(3));
    fault(&|trial| trial.sensors.columns[1] = "gyro[0]".into());
    fault(&|trial| trial.initial_state = Some(Vec::new()));
    let later = fault(&|trial| {
        trial.state = Some(Series {
            times: vec![0.0],
            columns: (0..4).map(|i| format!("state[{i}]")).collect(),
            data: vec![1.0; 4],
        });
    });
    assert!(later.contains("not before the first"), "{later}");
    assert!(!path.exists());
    let nowhere = write_npz(&folder.path("no/where.npz"), &trial).unwrap_err();
    assert!(nowhere.to_string().contains("where.npz"));
    write_npz(&path, &trial).unwrap();
    let once = fs::read(&path).unwrap();
    write_npz(&path, &trial).unwrap();
    assert_eq!(once, fs::read(&path).unwrap());
}

#[test]
fn a_model_without_actuators_has_no_controls() {
    let passive = Signature {
        actuators: Vec::new(),
        ..signature()
    };
    let folder = Folder::new();
    let path = folder.text("time,hip\n0,1\n1,0.5\n2,0.2");
    let (trial, remarks) = read(&path, &passive).unwrap();
    assert_eq!((trial.control.len(), trial.control.width()), (3, 0));
    assert!(!kinds(&remarks).contains(&&RemarkKind::ConstantControls));
    for (name, write) in [
        ("a.npz", write_npz as fn(&Path, &Trial) -> _),
        ("a.csv", write_csv),
    ] {
        let path = folder.path(name);
        write(&path, &trial).unwrap();
        let (again, _) = read(&path, &passive).unwrap();
        assert_eq!(again.control, trial.control);
        assert_eq!(again.sensors, trial.sensors);
    }
}
