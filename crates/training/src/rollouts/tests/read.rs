//! Refusals.
#![allow(clippy::unwrap_used)]

use super::*;

fn index_with(schema: &str, file: &str, sha256: &str) -> String {
    format!(
        r#"{{"schema":"{schema}","model":"m.xml","model_sha256":"0a","timestep":0.002,"sample_period":0.01,"seed":0,
        "command":"c","mujoco":"4.0.0","features":["density"],"joints":[],
        "rollouts":[{{"file":"{file}","sha256":"{sha256}","density":1000,"duration":0.01}}]}}"#
    )
}

fn load(index: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rollouts.json"), index).unwrap();
    std::fs::write(folder.path().join("run.npz"), b"no archive").unwrap();
    Rollouts::load(folder.path()).unwrap_err().to_string()
}

#[test]
fn refusals_say_what_was_found() {
    assert!(load(&index_with("hydro-rollouts/9", "run.npz", "")).contains("`hydro-rollouts/9`"));
    assert!(load(&index_with(SCHEMA, "gone.npz", "")).contains("gone.npz"));
    assert!(load(&index_with(SCHEMA, "run.npz", "00")).contains("changed or truncated"));
    let digest = hexadecimal(&Sha256::digest(b"no archive"));
    assert!(load(&index_with(SCHEMA, "run.npz", &digest)).contains("run.npz"));
    assert!(load("{").contains("rollouts.json"));
    let odd = index_with(SCHEMA, "run.npz", &digest);
    let zero = load(&odd.replace("0.002", "0"));
    assert!(
        zero.contains("timestep is 0 s, expected from 1e-6"),
        "{zero}"
    );
    let huge = load(&odd.replace("\"sample_period\":0.01", "\"sample_period\":1e300"));
    assert!(huge.contains("sample_period is 1e300 s"), "{huge}");
    assert!(load(&odd.replace("run.npz", "../run.npz")).contains("not a plain file name"));
    let nowhere = Rollouts::load(Path::new("no/such/folder")).unwrap_err();
    assert!(nowhere.to_string().contains("record_rollouts.py"));
}
